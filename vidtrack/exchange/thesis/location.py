"""location.prn: what locate writes, the target frame by frame.

A description, a header, then `time1 time2 x y z`: the time codes of both cameras' samples, which were paired by
their order in the two files and by nothing else, and the place to 0.01, world units. Where one file is longer, its
rows go on with the last sample of the other (one time code stands still); after the last line end of the input the
last row is written once more. Rows of both kinds are left out here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, numbers
from vidtrack.exchange.thesis.header import body_of, header
from vidtrack.files.atomic import replacing

_ROW = re.compile(r"\s*(\d{1,2}:\d{2}:\d{2}\D\d{1,2})\s+(\d{1,2}:\d{2}:\d{2}\D\d{1,2})\s+(.*)")


class Located(NamedTuple):
    """The target: time codes of both cameras, and p (n, 3) world units; repeated: rows that were left out."""

    first: tuple[str, ...]
    second: tuple[str, ...]
    p: Array
    repeated: int = 0


def read_location(path: Path) -> Located:
    """Read location.prn."""
    first, second, p = [], [], []
    for line, text in body_of(path, "positions"):
        found = _ROW.match(text)
        values = numbers(found[3].split()) if found else None
        if not found or values is None or len(values) < 3:
            raise VidtrackError(f"{path}, line {line}: not `time1 time2 x y z`. Copy the whole file again.")
        first.append(found[1])
        second.append(found[2])
        p.append(values[:3])
    keep = [i for i in range(len(p)) if i == 0 or not (first[i] == first[i - 1] or second[i] == second[i - 1])]
    codes = tuple(first[i] for i in keep), tuple(second[i] for i in keep)
    return Located(*codes, np.array(p)[keep], len(p) - len(keep))


def write_location(
    path: Path, codes: Sequence[Sequence[str]], p: Array, description: str = "", decimals: int = 2
) -> None:
    """Write location.prn: codes of the two cameras, (n,) each; positions that are not known are left out."""
    text = (
        "This file contains the final 3-D location of the",
        "target from the two 2-D location files",
        " Time1          Time2           X         Y         Z",
    )
    known = np.flatnonzero(np.isfinite(p).all(-1)).tolist()
    places = ["  ".join(f"{value:8.{decimals}f}" for value in p[i]) for i in known]
    body = "".join(f"{codes[0][i]}\t{codes[1][i]}\t {place}\n" for i, place in zip(known, places, strict=True))
    with replacing(path) as file:
        file.write((f"{description}\n" + header("location.prn", text, height=10) + body).encode())
