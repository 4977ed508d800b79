"""Lines as the data of an SVG path, thinned to what a screen can show.

Coordinates are whole tenths of a px, each point relative to the one before: short text, no rounding that adds up.
A line of more points than columns of pixels keeps in each column its first, least, most and last: no peak is lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from vidtrack.arrays import Array

UNIT = 10
"""Units of the SVG a px."""


def stretches(*columns: Array) -> Iterator[tuple[Array, ...]]:
    """The columns (n,) between what is not finite in any of them."""
    seen = np.asarray(np.isfinite(np.stack(columns)).all(axis=0))
    if seen.all():
        if len(seen):
            yield columns
        return
    ends = np.flatnonzero(np.diff(np.concatenate([[0], seen.astype(np.int8), [0]])))
    for begin, end in zip(ends[::2], ends[1::2], strict=True):
        yield tuple(column[begin:end] for column in columns)


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """A line in tenths of a px; of many points, in each run within a column of px first, least, most and last."""
    X, Y = np.rint(UNIT * np.clip(x, -1e6, 1e6)), np.rint(UNIT * np.clip(y, -1e6, 1e6))
    begins = np.flatnonzero(np.diff(np.floor(X / UNIT), prepend=np.nan))
    if len(begins) * 4 >= len(X):
        return X, Y
    ends = np.append(begins[1:], len(X)) - 1
    least, most = np.minimum.reduceat(Y, begins), np.maximum.reduceat(Y, begins)
    down = Y[ends] < Y[begins]
    middle = [np.where(down, most, least), np.where(down, least, most)]
    return (
        np.stack([X[begins], X[begins], X[ends], X[ends]], 1).ravel(),
        np.stack([Y[begins], *middle, Y[ends]], 1).ravel(),
    )


def moves(X: Array, Y: Array) -> str:
    """A path through whole points, each relative to the one before; one point alone is a dot."""
    steps = np.diff(np.stack([X, Y], 1).astype(np.int64), axis=0)
    steps = steps[(steps != 0).any(axis=1)]
    begin = f"M{X[0]:.0f} {Y[0]:.0f}"
    return begin + ("l" + _joined(steps.ravel().tolist()) if len(steps) else "h0")


def _joined(numbers: Iterable[int]) -> str:
    return " ".join(map(str, numbers)).replace(" -", "-")
