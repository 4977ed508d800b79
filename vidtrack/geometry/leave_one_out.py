"""Which camera errs, when the lines of sight of one point do not meet: each in turn is left out.

One camera that follows a reflection or a neighbour pulls the point off for all of them. Without it the rest agree.
Every point and every candidate is tried in the same few vectorised calls.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.batch import Task
from vidtrack.geometry.sights import Mask


def agreeing(task: Task, used: Mask, reject: Array, noise: float) -> tuple[Mask, Mask]:
    """The cameras (n_cameras, n) that agree within `reject` (n_cameras, n) px, and where (n,) it cannot be decided
    which ones do.

    Leaves out, of each point, the camera without which the others agree best, until all agree. Where those that
    agree are no more than those that do not, or two explanations are about equally good, nothing is left out and
    the point is undecided.
    """
    keep = used.copy()
    undecided = np.zeros(used.shape[1], bool)
    open_ = np.arange(used.shape[1])
    task = task._replace(known=None, steps=min(task.steps, 1))
    while open_.size:
        chi2, worst = _without_each(task.at(open_), keep[:, open_], reject[:, open_])
        first = np.argmin(chi2, 0)
        column = np.arange(open_.size)
        best, settled = chi2[first, column], worst[first, column] <= 1
        chi2[first, column] = np.inf
        with np.errstate(invalid="ignore"):
            # ASSUME: 9 in chi2 (odds of 90 to 1) decides between two cameras that may err
            unclear = ~np.isfinite(best) | (settled & ~(chi2.min(0) - best > 9 * noise**2))
        unclear |= 2 * (keep[:, open_].sum(0) - 1) <= used[:, open_].sum(0)
        undecided[open_[unclear]] = True
        keep[first[~unclear], open_[~unclear]] = False
        open_ = open_[~unclear & ~settled]
    keep[:, undecided] = used[:, undecided]
    return keep, undecided


def _without_each(task: Task, used: Mask, limit: Array) -> tuple[Array, Array]:
    """Weighted sum of squares and largest error over its limit (n_cameras, n), px, of the rest, for each camera left
    out; inf where no fix.
    """
    chi2 = np.full(used.shape, np.inf)
    worst = np.full(used.shape, np.inf)
    for camera in range(used.shape[0]):
        rest = used.copy()
        rest[camera] = False
        some = np.flatnonzero(used[camera] & (rest.sum(0) >= 2))
        solved = task.at(some).solve(rest[:, some])
        found = np.isfinite(solved.point[0])
        chi2[camera, some[found]] = solved.chi2[found]
        worst[camera, some[found]] = solved.worst(rest[:, some], limit[:, some])[found]
    return chi2, worst
