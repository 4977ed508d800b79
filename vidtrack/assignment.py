"""Rows and columns joined one to one at the least cost: targets and blobs, tags and blobs, picks and blobs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array


def one_to_one(cost: Array) -> NDArray[np.intp]:
    """For each row its column, (n,), -1 where it gets none: as many pairs as possible, at the least sum of costs.

    cost  (n, m), inf where a pair cannot be. Among all ways that join the most pairs, the one of least cost (Hungarian
          method).
    """
    chosen = np.full(cost.shape[0], -1, np.intp)
    allowed = np.isfinite(cost)
    rows = np.flatnonzero(allowed.any(axis=1))
    if rows.size == 0:
        return chosen
    best = np.argmin(cost[rows], axis=1)
    if np.unique(best).size == rows.size:  # no two rows want the same column
        chosen[rows] = best
        return chosen
    from scipy.optimize import linear_sum_assignment

    ceiling = float(cost[allowed].max()) * (cost.shape[0] + 1) + 1.0
    picked, column = linear_sum_assignment(np.where(allowed, cost, ceiling))
    real = allowed[picked, column]
    chosen[picked[real]] = column[real]
    return chosen


def one_to_one_within(cost: Array, most: float) -> NDArray[np.intp]:
    """For each row its column, (n,), -1 where it gets none: the least sum, where a row without a column costs `most`.

    cost  (n, m), inf or NaN where a pair cannot be. No pair costs `most` or more.
    """
    from scipy.optimize import linear_sum_assignment

    chosen = np.full(cost.shape[0], -1, np.intp)
    row, column = linear_sum_assignment(np.fmin(cost, most))
    real = cost[row, column] < most
    chosen[row[real]] = column[real]
    return chosen


def mutual_best(cost: Array) -> NDArray[np.intp]:
    """As `one_to_one`, but quick and greedy: those that are each other's best are joined, then again among the rest."""
    chosen = np.full(cost.shape[0], -1, np.intp)
    cost = cost.copy()
    while cost.size:
        best, wanted_by = np.argmin(cost, axis=1), np.argmin(cost, axis=0)
        rows = np.arange(cost.shape[0])
        joined = (wanted_by[best] == rows) & np.isfinite(cost[rows, best])
        if not joined.any():
            break
        chosen[joined] = best[joined]
        cost[joined] = np.inf
        cost[:, best[joined]] = np.inf
    return chosen
