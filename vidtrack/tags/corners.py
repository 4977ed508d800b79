"""Corners of coded tags among a run's targets: their names, and where cameras saw them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from vidtrack.arrays import Array
from vidtrack.location.cameras.views import Seen, View

CORNER = re.compile(r"tag(\d+)_([1-4])$")
SQUARE = ((-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0))
"""A tag of side 1 in its own axes: x to the right as it is read, y up, z out of its face."""


def corner_names(targets: Iterable[str]) -> list[str]:
    """Those of the targets that are corners of tags, by number and corner."""
    found = {name: match for name in set(targets) if (match := CORNER.match(name))}
    return sorted(found, key=lambda name: (int(found[name][1]), int(found[name][2])))


def with_corners(
    targets: int | Sequence[str] | Literal["all"] | None, corners: Sequence[str]
) -> list[str] | Literal["all"] | None:
    """The targets of a run as its config says them, and the corners of its tags, which "all" has already."""
    if targets is None or targets == "all":
        return targets
    return [*([f"t{n + 1}" for n in range(targets)] if isinstance(targets, int) else map(str, targets)), *corners]


def corners_of(
    views: Sequence[View], seen: Sequence[Seen], tags: Sequence[int], at: Array, slips: Sequence[float]
) -> tuple[Array, Array]:
    """Corners (C, T, 4 n, 2) px of n tags at the moments `at` (T,) s and their sd; NaN for a tag not seen whole.

    slips   s, standard deviation of each camera's clock: how far that moves a corner is in its sd
    """
    b, sd = (np.full((len(views), at.size, 4 * len(tags), 2), np.nan) for _ in range(2))
    for c, (view, own) in enumerate(zip(views, seen, strict=True)):
        row_of = {name: row for row, name in enumerate(view.tracks)}
        for k, number in enumerate(tags):
            rows = [row_of.get(f"tag{number}_{i}", -1) for i in range(1, 5)]
            if min(rows) < 0:
                continue
            corners = own.b[rows].swapaxes(0, 1)
            noise = own.sd[rows].swapaxes(0, 1)
            if slips[c] > 0 and at.size > 1:
                velocity = np.nan_to_num(np.gradient(corners, at, axis=0))
                noise = np.hypot(noise, velocity * slips[c])
            whole = np.isfinite(corners).all((-1, -2)) & np.isfinite(noise).all((-1, -2))
            b[c, whole, 4 * k : 4 * k + 4] = corners[whole]
            sd[c, whole, 4 * k : 4 * k + 4] = noise[whole]
    return b, sd
