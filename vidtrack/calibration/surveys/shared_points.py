"""The same points, as several cameras list them, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array

Key = tuple[str, str]
"""What names a point: the clip that shows it, and its tag."""


class Table(Protocol):
    """Columns by name: a DataFrame, or a dict of arrays."""

    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: Any, /) -> bool: ...


class SharedPoints(NamedTuple):
    """n different points and the m cameras' sights of them."""

    keys: list[Key]  # n, in the order in which they are first met
    p: Array  # (n, 3) world units
    sigma: Array  # (n,) world units, the survey's tolerance
    b: Array  # (m, n, 2) px; NaN where a camera does not show the point
    used: NDArray[np.bool_]  # (m, n) whether the camera's calibration used it
    row: NDArray[np.intp]  # (m, n) the row of each camera's list that a point comes from; -1 where it lists it not

    @property
    def b_used(self) -> Array:
        """(m, n, 2) px; NaN also where the calibration did not use the sight."""
        return np.where(self.used[..., None], self.b, np.nan)


def side_by_side(tables: Sequence[Table], *, sigma: float = 0.0) -> SharedPoints:
    """Arrange the lists of m cameras by point.

    tables   for each camera columns tag, x, y, z (world units), Xf, Yf (px); clip, sigma, used where known: without
             used, every sight that is not NaN counts
    sigma    world units, for points that have none of their own
    A ball that two clips show is two points: it may have been hung anew.
    Raises ValueError where one camera lists a point twice, or two cameras place one point differently.
    """
    lists = [_keys(table) for table in tables]
    order: dict[Key, int] = {}
    for own in lists:
        if twice := {key for key in own if own.count(key) > 1} if len(set(own)) < len(own) else set():
            raise ValueError(f"a camera lists tag {min(twice)[1]} twice")
        for key in own:
            order.setdefault(key, len(order))
    m, n = len(tables), len(order)
    p, tolerance, b = np.full((n, 3), np.nan), np.full(n, np.nan), np.full((m, n, 2), np.nan)
    used, row = np.zeros((m, n), bool), np.full((m, n), -1, np.intp)
    for i, (table, own) in enumerate(zip(tables, lists, strict=True)):
        at = np.array([order[key] for key in own], np.intp)
        places = _columns(table, ("x", "y", "z"))
        known = np.isfinite(p[at]).all(-1)
        if not np.array_equal(p[at][known], places[known]):
            raise ValueError("two cameras place one point differently")
        p[at], b[i, at], row[i, at] = places, _columns(table, ("Xf", "Yf")), np.arange(len(own))
        used[i, at] = np.asarray(table["used"], bool) if "used" in table else True
        if "sigma" in table:
            tolerance[at] = np.asarray(table["sigma"], float)
    used &= np.isfinite(b).all(-1)
    return SharedPoints(list(order), p, np.where(np.isfinite(tolerance), tolerance, sigma), b, used, row)


def _keys(table: Table) -> list[Key]:
    tags = [str(tag) for tag in table["tag"]]
    clips = [str(clip) for clip in table["clip"]] if "clip" in table else [""] * len(tags)
    return list(zip(clips, tags, strict=True))


def _columns(table: Table, names: Sequence[str]) -> Array:
    return np.stack([np.asarray(table[name], float) for name in names], -1)
