"""Mutated recordings of every kind: each is read, or refused in one line; no traceback, no endless reading.

    PYTHONPATH=. python benchmarks/fuzz.py                 10,000 mutations a kind
    PYTHONPATH=. python benchmarks/fuzz.py --count 200 --kinds cam1.tif cam1.cine

Bytes are changed, cut out, put in or repeated, a few at a time, more often near the beginning, where headers are.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from pathlib import Path

import numpy as np

from tests.files.clips import make_clip
from tests.video.pictures import SIZE, cine, levels, ser, tiff, write_mraw
from vidtrack.errors import VidtrackError
from vidtrack.video.reader import open_video
from vidtrack.video.time_source import find_time

SLOW = 20.0
"""s for a recording of a few pictures: more is a reader that hangs."""

CLIPS = {
    "cam1.mp4": ("libx264", "yuv420p"),
    "cam1.mkv": ("ffv1", "gray"),
    "cam1.avi": ("mjpeg", "yuvj420p"),
    "cam1.mpg": ("mpeg2video", "yuv420p"),
    "cam1.ts": ("libx264", "yuv420p"),
    "cam1.mov": ("prores_ks", "yuv422p10le"),
    "cam1.mxf": ("mpeg2video", "yuv422p"),
}
KINDS = (*CLIPS, "cam1.tif", "stack.tif", "cam1.cine", "cam1.ser", "cam1.mraw", "cam1.cih")


def made(folder: Path, kind: str) -> Path:
    """A small healthy recording; of cam1.cih the header is what is mutated."""
    path = folder / kind
    if kind in CLIPS:
        codec, pix_fmt = CLIPS[kind]
        make_clip(path, codec, pix_fmt, n=6, size=SIZE, picture=lambda i: levels(i, 10 if "10" in pix_fmt else 8))
    elif kind == "cam1.tif":
        path.write_bytes(tiff([levels(i) for i in range(3)]))
    elif kind == "stack.tif":
        path.write_bytes(tiff([levels(i) for i in range(3)], imagej="ImageJ=1.53\nimages=3\nfps=25\n"))
    elif kind == "cam1.cine":
        path.write_bytes(cine([0.0, 0.01, 0.021]))
    elif kind == "cam1.ser":
        path.write_bytes(ser([0.0, 0.01, 0.021]))
    else:
        write_mraw(folder / "cam1.mraw", 3, stored=8, effective=8, rate=100)
    return path


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with one to four changes."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        reach = min(len(out), 4096) if rng.random() < 0.6 else len(out)
        at, length = int(rng.integers(0, max(reach, 1))), int(rng.integers(1, 33))
        way = int(rng.integers(5))
        if way == 0:
            out[at : at + 1] = bytes([int(rng.integers(256))])
        elif way == 1:
            out[at : at + 4] = int(rng.choice([0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000])).to_bytes(4, "little")
        elif way == 2:
            del out[at : at + length]
        elif way == 3:
            out[at:at] = out[at : at + length]
        else:
            del out[at:]
    return bytes(out)


def outcome(path: Path) -> str:
    """ "read", "refused", or what must not be."""
    begin = time.monotonic()
    try:
        with open_video(str(path)) as video:
            find_time(str(path), video.info)
            for count, frame in enumerate(video.frames()):
                frame.luma.max()
                if count > 2000 or time.monotonic() - begin > SLOW:
                    return "does not end"
            problems = video.account.problems
        return "read" if all("\n" not in line for line in problems) else "a line that is none"
    except VidtrackError as error:
        return "refused" if len(error.problems) == 1 and "\n" not in error.problems[0] else "not one line"
    except Exception:
        return traceback.format_exc()


def tried(folder: Path, kind: str, seeds: range) -> dict[str, int]:
    """Outcome -> how often."""
    path = made(folder, kind)
    data = path.read_bytes()
    target = folder / ("cam1.mraw" if kind == "cam1.cih" else kind)
    found: dict[str, int] = {}
    for seed in seeds:
        path.write_bytes(mutated(data, np.random.default_rng([seed, KINDS.index(kind)])))
        one = outcome(target)
        found[one] = found.get(one, 0) + 1
        if one not in ("read", "refused"):
            print(f"{kind} {seed}: {one}", file=sys.stderr)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10_000, help="mutations of each kind")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    arguments = parser.parse_args()
    bad = 0
    for kind in arguments.kinds:
        with tempfile.TemporaryDirectory() as folder:
            found = tried(Path(folder), kind, range(arguments.count))
        wrong = sum(n for word, n in found.items() if word not in ("read", "refused"))
        bad += wrong
        print(f"{kind:12} read {found.get('read', 0):6}  refused {found.get('refused', 0):6}  wrong {wrong:4}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
