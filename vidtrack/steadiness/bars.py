"""Bars about a picture: a player's window, a screen recorder or an editor sets a film into a larger picture.

A bar has one level, at all its pixels and in all pictures; where it ends, the picture begins with a straight step along
the whole edge. A dark wall is as flat, but ends nowhere in a step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FLAT = 2.0
"""Grey levels of 255 by which a bar may vary, in the mean of some pictures: coders leave one or two beside its edge."""

STEP = 4.0
"""Grey levels: the least by which the picture differs from the bar along its edge. Noise of a mean is below 1."""

EDGE = 3
"""Px from the last flat row to the rows that are compared with it: scaling and coding soften the step."""

ALONG = 0.9
"""Share of the edge along which there must be the step."""

LEAST = 0.02
"""Share of the picture's width or height: what is narrower is the blanking of a tape or rounding of a size."""

MOST = 0.6
"""Share of the picture's width or height that bars take: a flat wall with a ball before it would have wider ones."""


def bars_of(picture: NDArray[Any], block: int = 1) -> tuple[int, int, int, int]:
    """How wide the bars are at the left, top, right and bottom, in px of the recording; 0 where there is none.

    picture   (h, w) mean of some pictures, grey levels of 255; block: px of the recording that one px of it is
    """
    values = np.asarray(picture, np.float32)
    h, w = values.shape
    top, bottom, left, right = (_flat(v) for v in (values, values[::-1], values.T, values.T[::-1]))
    top, bottom = (top, bottom) if top + bottom <= MOST * h else (0, 0)
    left, right = (left, right) if left + right <= MOST * w else (0, 0)
    if min(h, w) <= 4 * EDGE:
        return 0, 0, 0, 0
    rows, columns = values[:, left : w - right], values[top : h - bottom].T
    found = [_bar(side, n) for side, n in ((columns, left), (rows, top), (columns[::-1], right), (rows[::-1], bottom))]
    a, b, c, d = (n * block for n in found)
    return a, b, c, d


def bars_record(picture: NDArray[Any] | None, block: int = 1) -> dict[str, list[int]]:
    """`bars_of` as a record has them; nothing where there is none, or no picture."""
    found = (0, 0, 0, 0) if picture is None else bars_of(picture, block)
    return {"bars": list(found)} if any(found) else {}


def _flat(values: NDArray[np.float32]) -> int:
    """How many rows from the first on have one level; 0 where most have it: then it is the picture's own."""
    flat = (np.abs(values - np.median(values[0])) <= FLAT).all(1)
    n = len(flat) if flat.all() else int(np.argmin(flat))
    return n if n <= MOST * len(flat) else 0


def _bar(rows: NDArray[np.float32], n: int) -> int:
    """n, where the first n rows are a bar: wide enough, and the picture behind them begins with a step."""
    if n < LEAST * len(rows):
        return 0
    step = np.abs(rows[n + EDGE - 1] - rows[0]) > STEP
    return n if step.mean() >= ALONG else 0
