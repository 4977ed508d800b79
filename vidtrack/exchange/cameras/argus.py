"""Argus camera profiles: a line a camera, `camera f w h cx cy aspect k1 k2 t1 t2 k3`, separated by spaces or commas.

f px (fy = f aspect), w h px the picture; cx, cy px from the upper-left corner, OpenCV's: the centre of the first
pixel is (0, 0); k1 k2 t1 t2 k3 OpenCV's distortion, from undistorted to distorted. A profile holds a lens and no
pose: the pose is in DLT coefficients of pixels without that distortion. The libraries of lenses that Argus ships
begin each line with the name of a shooting mode, and have no camera. Omnidirectional models are refused: lines of
more numbers, and in a library the modes "(CMei)" and "(Fisheye)". A line "(CMei)" has twelve cells too, the last of
them xi, no k3.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, lines_of, number
from vidtrack.geometry.brown import BrownLens

_OMNIDIRECTIONAL = re.compile(r"\((cmei|fisheye)\)", re.IGNORECASE)


class Profile(NamedTuple):
    """A line of a profile: the number of its camera (0 where it has none), its name, its lens."""

    number: int
    name: str
    lens: BrownLens


def read_profiles(path: Path) -> list[Profile]:
    """All cameras of a profile, or all modes of a library."""
    found = []
    for i, line in enumerate(lines_of(path)):
        cells = [cell.strip() for cell in line.split(",")] if "," in line else line.split()
        if not any(cells):
            continue
        if len(cells) == 13 and cells[12] in ("", "0", "End"):
            cells = cells[:12]  # as Argus' libraries end their lines
        values = [number(cell) for cell in cells[1:]]
        if any(v is None or v != v for v in values):
            if values.count(None) > 2:
                continue  # the names of the columns
            raise VidtrackError(
                f"{path}, line {i + 1}: not a camera profile. Each line has 12 numbers; correct the line."
            )
        if len(cells) > 12 or _OMNIDIRECTIONAL.search(cells[0]):
            raise VidtrackError(
                f"{path}, line {i + 1}: {cells[0]}: an omnidirectional lens, which is not read. Keep lines of f w h "
                "cx cy aspect k1 k2 t1 t2 k3 only."
            )
        if len(cells) < 12:
            raise VidtrackError(f"{path}, line {i + 1}: {len(cells)} numbers; a camera profile has 12. Copy it again.")
        f, w, h, cx, cy, aspect, k1, k2, t1, t2, k3 = (float(v) for v in values if v is not None)
        lens = BrownLens(f, f * aspect, cx, cy, (round(w), round(h)), (k1, k2, k3), t1, t2)
        index = number(cells[0])
        found.append(Profile(int(index) if index is not None and np.isfinite(index) else 0, cells[0], lens))
    if not found:
        raise VidtrackError(f"{path}: no camera profile in it. Each line has 12 numbers.")
    return found


def looks_like_profiles(path: Path) -> bool:
    """Whether each line of a text has the twelve numbers of a profile, the first a camera's number."""
    rows = [line.replace(",", " ").split() for line in lines_of(path) if line.strip()]
    return bool(rows) and all(len(row) == 12 and all(number(cell) is not None for cell in row) for row in rows)
