"""How fast vidtrack is, beside other programs and physical limits, in one run: one table, with last time's beside it.

    python -m benchmarks [--quick] [--save] [--only track location ...] [--last FILE]

Ratios are ours over theirs, by processor time, taking turns in one process: below 1 vidtrack is faster than its peer;
beside a limit (a bare decode loop) 1 is the best there is. --save writes what was measured over benchmarks/last.json,
with which the next run is compared; --quick measures smaller cases, into and beside benchmarks/last-quick.json. Exit
code 1 where a row became slower. Peers that are not installed are left out; `bash setup.sh benchmark` installs them.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.figures import GROUPS, everything, measured
from benchmarks.table import as_record, described, lines, machine, read_record, slower, write_record

HERE = Path(__file__).resolve().parent


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="smaller cases, a few minutes")
    parser.add_argument("--save", action="store_true", help="this is what the next run is compared with")
    parser.add_argument("--only", nargs="+", default=[], choices=GROUPS, help="these rows alone")
    parser.add_argument("--last", type=Path, help="what to compare with")
    parser.add_argument(
        "--peers", type=Path, help="a folder of packages of other programs, after all others on the path"
    )
    asked = parser.parse_args()
    if asked.peers:
        sys.path.append(str(asked.peers.resolve()))
    place = asked.last or HERE / ("last-quick.json" if asked.quick else "last.json")
    last, about = read_record(place), machine()
    with tempfile.TemporaryDirectory(prefix="vidtrack-benchmarks-") as folder:
        now = []
        for pair, rounds in everything(Path(folder), quick=asked.quick, only=asked.only):
            print(f"{pair.name}, beside {pair.peer}", file=sys.stderr, flush=True)
            now.append(measured(pair, rounds))
    kept = last["figures"] if asked.only and last else {}
    if kept:
        last = last | {"figures": {key: old for key, old in kept.items() if key.startswith(tuple(asked.only))}}
    print(described(about))
    if last:
        print(f"last time: {described(last['machine'])}")
    print("", *lines(now, last), sep="\n")
    if asked.save:
        record = as_record(now, about)
        write_record(place, record | {"figures": kept | record["figures"]})
        print(f"\nkept in {place.relative_to(HERE.parent) if place.is_relative_to(HERE.parent) else place}")
    worse = slower(now, last)
    for key in worse:
        print(f"slower: {key}", file=sys.stderr)
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
