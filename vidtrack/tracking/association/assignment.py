"""Who is who: targets and blobs joined one to one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array


def one_to_one(cost: Array) -> NDArray[np.intp]:
    """For each target (row) the blob (column) that is its own, (n,), -1 where it gets none.

    cost  (n, m), inf where a blob cannot be the target. As many targets as possible get a blob; among all such ways
          the one with the least sum of costs (Hungarian method).
    """
    chosen = np.full(cost.shape[0], -1, np.intp)
    allowed = np.isfinite(cost)
    rows = np.flatnonzero(allowed.any(axis=1))
    if rows.size == 0:
        return chosen
    best = np.argmin(cost[rows], axis=1)
    if np.unique(best).size == rows.size:  # everybody's first choice
        chosen[rows] = best
        return chosen
    from scipy.optimize import linear_sum_assignment

    ceiling = float(cost[allowed].max()) * (cost.shape[0] + 1) + 1.0
    picked, column = linear_sum_assignment(np.where(allowed, cost, ceiling))
    real = allowed[picked, column]
    chosen[picked[real]] = column[real]
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
