"""Mutated files of every kind that is read: each is read, or refused in clear lines; no traceback, no hang, in 2 GB.

    PYTHONPATH=. python -m benchmarks.fuzz                        10,000 mutations of each kind
    PYTHONPATH=. python -m benchmarks.fuzz --count 200 --kinds points.csv cam1.cine
    PYTHONPATH=. python -m benchmarks.fuzz --first 4711 --count 1 --kinds cam1.ser      one seed again

Bytes are changed, cut out, put in or repeated, a few at a time, more often near the beginning, where headers are;
words, lines and the encoding of texts too. Files are read in a forked process, which may use 2 GB, and 20 s a file.
"""

from __future__ import annotations

import argparse
import sys
import time

from benchmarks.fuzz import programs, recordings, tables
from benchmarks.fuzz.forked import tried_forked

READERS = {**tables.READERS, **programs.READERS, **recordings.READERS}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10_000, help="mutations of each kind")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--kinds", nargs="*", default=list(READERS), metavar="KIND", help=", ".join(READERS))
    asked = parser.parse_args()
    if unknown := [kind for kind in asked.kinds if kind not in READERS]:
        parser.error(f"no kind {unknown[0]!r}; known: {', '.join(READERS)}")
    bad = 0
    print(f"{'file':24}{'read':>8}{'refused':>9}{'wrong':>7}{'MB':>7}{'slowest s':>11}{'s':>7}", flush=True)
    for kind in asked.kinds:
        begun = time.monotonic()
        found = tried_forked(kind, READERS[kind], range(asked.first, asked.first + asked.count))
        bad += len(found.wrong)
        print(
            f"{kind:24}{found.read:8d}{found.refused:9d}{len(found.wrong):7d}{found.largest:7.0f}{found.slowest:11.2f}"
            f"{time.monotonic() - begun:7.0f}",
            flush=True,
        )
        for seed, what in found.wrong[:20]:
            print(f"{kind} {seed}: {what}", file=sys.stderr, flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
