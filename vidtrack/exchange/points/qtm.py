"""QTM: the TSV files that Qualisys Track Manager exports, of markers (3D) and of bodies (6D: the place of their
origin).

Lines `NO_OF_FRAMES`, `FREQUENCY`, `TIME_STAMP`, `DATA_INCLUDED`, `MARKER_NAMES` or `BODY_NAMES`, then, in files of
2012 and later, a row of names of columns, then a row a frame, with frame and time before the coordinates where they
were asked for. mm, axes of QTM's calibration, right-handed. What was not seen is 0, 0, 0. TIME_STAMP is the
computer's date and time at the first frame; without seconds it says nothing here. Angles of 6D files are not read
(`R = Rx Ry Rz`; see docs/formats.md).
"""

from __future__ import annotations

import re

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.measured import Measured
from vidtrack.exchange.text import Path, lines_of, number, numbers

_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)")


def read(path: Path) -> Measured:
    """The markers or bodies of a TSV file."""
    lines = lines_of(path)
    head: dict[str, list[str]] = {}
    at = 0
    while at < len(lines) and (cells := lines[at].split("\t")) and number(cells[0]) is None:
        head.setdefault(cells[0].strip().upper(), [cell.strip() for cell in cells[1:] if cell.strip()])
        at += 1
    kind = (head.get("DATA_INCLUDED") or [""])[0].upper()
    names = head.get("MARKER_NAMES") if kind == "3D" else head.get("BODY_NAMES")
    rate = number((head.get("FREQUENCY") or [""])[0])
    if kind not in ("3D", "6D") or not names or rate is None or not rate > 0:
        raise VidtrackError(
            f"{path}: no TSV of QTM: it needs FREQUENCY, DATA_INCLUDED 3D or 6D, and the names. Export it from "
            "QTM with a header."
        )
    rows = _rows(path, lines, at)
    each = 3 if kind == "3D" else 16
    before = rows.shape[1] - each * len(names)
    if before not in (0, 1, 2):
        raise VidtrackError(
            f"{path}: {rows.shape[1]} columns do not hold {len(names)} "
            f"{'markers' if kind == '3D' else 'bodies'} of {each} "
            "numbers. Export it again."
        )
    p = np.array(rows[:, before:].reshape(len(rows), len(names), each)[..., :3])
    p[(p == 0).all(-1) | ~np.isfinite(p).all(-1)] = np.nan
    count = number((head.get("NO_OF_FRAMES") or [""])[0])
    if count is not None and count == count and int(count) != len(rows):
        raise VidtrackError(f"{path}: {len(rows)} of {int(count)} frames. Copy the whole file again.")
    return Measured("QTM", tuple(names), p, np.arange(len(rows)) / rate, "mm", start_of(head.get("TIME_STAMP", [])))


def _rows(path: Path, lines: list[str], at: int) -> Array:
    rows, width = [], 0
    for i, line in enumerate(lines[at:]):
        if not line.strip():
            continue
        cells = line.rstrip("\t ").split("\t")
        found = numbers(cells)
        width = width or len(cells)
        if found is None or len(cells) != width:
            raise VidtrackError(f"{path}, line {at + i + 1}: not a row of {width} numbers. Copy the whole file again.")
        rows.append(found)
    if not rows:
        raise VidtrackError(f"{path}: no frame in it. Export it again.")
    return np.array(rows)


def start_of(stamp: list[str]) -> float | None:
    """s since midnight of the first frame, to the digits of the stamp."""
    found = _CLOCK.search(" ".join(stamp))
    if not found:
        return None
    hours, minutes, seconds = found.groups()
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds.replace(",", "."))
