"""A batch of points to locate: cut into blocks, solved, with what calibration and clocks add to their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CalibrationErrors
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.sights import (
    Mask,
    Sight,
    carried_noise,
    linear_gain,
    linear_point,
    look_back,
    refined_gain,
    refined_point,
    sight,
)
from vidtrack.geometry.symmetric import add_product

BLOCK = 8192
"""Points a block: what one needs stays in the second-level cache."""

LEAST_DEPTH = 1e-3
"""ASSUME: share of the base line by which a point must lie in front of a camera. Lines of sight that diverge send the
fit to a camera's own centre, where the depth is 0 but for rounding."""


class Solution:
    """Points of a task, coordinates first."""

    def __init__(self, n_cameras: int, n: int) -> None:
        self.point = np.empty((3, n))
        self.noise = np.empty((6, n))  # covariance from centroid noise
        self.common = np.zeros((6, n))  # and from what all points have in common: calibration and clocks
        self.miss = np.empty(n)
        self.error = np.empty((n_cameras, 2, n))
        self.chi2 = np.empty(n)  # weighted sum of squared errors

    def put(self, where: NDArray[np.intp], part: Solution) -> None:
        for name, value in vars(part).items():
            getattr(self, name)[..., where] = value

    def block(self, where: slice) -> Solution:
        """Some of the points: what is written there is written here."""
        part = object.__new__(Solution)
        vars(part).update({name: value[..., where] for name, value in vars(self).items()})
        return part

    def worst(self, used: Mask, limit: Array) -> Array:
        """The largest reprojection error (n,) over its limit (n_cameras, n), px, among the cameras used; 0 where there
        is no fix.
        """
        x, y = self.error[:, 0] / limit, self.error[:, 1] / limit
        length2: Array = np.where(used & np.isfinite(self.point[0]), x * x + y * y, 0).max(0)
        return np.sqrt(length2)


class Task(NamedTuple):
    """n points to be located: b and weight are (n_cameras, n, 2), px and 1/px^2."""

    cameras: Sequence[Camera]
    b: Array
    weight: Array
    known: CalibrationErrors | None
    slips: Array | None  # (n_cameras, n, 2) px, by which a clock's standard error moves each camera's measurement
    steps: int  # of refinement, at most; 0 is the thesis's linear answer
    most_unsure: float  # the largest sigma of a fix, as a share of its distance to the nearest camera

    def at(self, which: NDArray[np.intp]) -> Task:
        """The same for some of the points."""
        slips = None if self.slips is None else self.slips[:, which]
        return self._replace(b=self.b[:, which], weight=self.weight[:, which], slips=slips)

    def solve(self, used: Mask) -> Solution:
        """Locate all points from the cameras used (n_cameras, n), block by block."""
        n = used.shape[1]
        whole = Solution(len(self.cameras), n)
        for start in range(0, n, BLOCK):
            part = slice(start, min(start + BLOCK, n))
            self._solve(part, used[:, part], whole.block(part))
        return whole

    def points(self, used: Mask) -> Array:
        """The points (3, n) of `solve` alone, without what else is known of them; no calibration error, no slips."""
        out = np.empty((3, used.shape[1]))
        least_depth = LEAST_DEPTH * _base_line(self.cameras)
        for start in range(0, out.shape[1], BLOCK):
            part = slice(start, min(start + BLOCK, out.shape[1]))
            sights, origin = self._sights(part, used[:, part])
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                p, Q = linear_point(sights)
                p, Q, _ = refined_point(sights, p, self.steps)
                depths = [(s.R @ p + s.t[:, None])[2] for s in sights]
                out[:, part] = np.where(
                    self._fixed(sights, depths, Q[:3].sum(0), least_depth), p + origin[:, None], np.nan
                )
        return out

    def _sights(self, part: slice, used: Mask) -> tuple[list[Sight], Array]:
        """What the cameras used see of some points, and the origin (3,) about which that is written."""
        origin = np.asarray(np.mean([camera.position for camera in self.cameras], 0))
        sights = [
            sight(camera, self.b[i, part], self.weight[i, part], used[i], origin)
            for i, camera in enumerate(self.cameras)
        ]
        return sights, origin

    def _solve(self, part: slice, used: Mask, out: Solution) -> None:
        sights, origin = self._sights(part, used)
        gains = []
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            p, Q = linear_point(sights)
            if self.steps:
                p, Q, rows = refined_point(sights, p, self.steps)
                if self.known or self.slips is not None:
                    gains = [refined_gain(s, r, Q) for s, r in zip(sights, rows, strict=True)]
            else:
                gains = [linear_gain(s, p, Q) for s in sights]
            out.noise[:] = Q if self.steps else carried_noise(sights, gains)
            if self.known:
                out.common[:] = self.known.carried(sights, p, gains, origin)
            good = self._compared(sights, p, out, LEAST_DEPTH * _base_line(self.cameras))
        out.point[:] = np.where(good, p + origin[:, None], np.nan)
        if self.slips is not None:
            for gain, slip in zip(gains, self.slips[:, part], strict=True):
                moved = gain[0] * slip[:, 0] + gain[1] * slip[:, 1]
                add_product(out.common, moved, moved)

    def _compared(self, sights: Sequence[Sight], p: Array, out: Solution, least_depth: float) -> Mask:
        """How far off the points p (3, n) are in each picture, into `out`; whether (n,) each is a fix.

        Where lines of sight are so nearly parallel that sigma is a large share of the distance, the covariance no
        longer describes what the point may be: it is no fix.
        """
        n, off2 = np.zeros((2, p.shape[1]))
        out.chi2[:] = 0
        depths = []
        for s, error in zip(sights, out.error, strict=True):
            view = look_back(s, p)
            n += s.on
            off2 += s.on * view.off2
            depths.append(view.depth)
            x, y = view.error
            out.chi2 += s.weight[0] * x * x + s.weight[1] * y * y
            error[:] = np.where(s.seen, view.error, np.nan)
        np.sqrt(off2 / n, out=out.miss)
        variance = out.noise[:3].sum(0) + np.nan_to_num(out.common[:3].sum(0))
        return self._fixed(sights, depths, variance, least_depth)

    def _fixed(self, sights: Sequence[Sight], depths: Sequence[Array], variance: Array, least_depth: float) -> Mask:
        """Which points (n,) at these depths are fixes; variance: sigma squared, of all coordinates together."""
        n, behind = np.zeros(variance.size, np.intp), np.zeros(variance.size, bool)
        nearest = np.full(n.size, np.inf)
        for s, depth in zip(sights, depths, strict=True):
            n += s.used
            behind |= s.used & ~(depth > least_depth)
            nearest = np.minimum(nearest, np.where(s.used, depth, np.inf))
        return np.asarray((n >= 2) & ~behind & (variance <= (self.most_unsure * nearest) ** 2))


def _base_line(cameras: Sequence[Camera]) -> float:
    """The largest distance between two perspective centres, world units."""
    return max(float(np.linalg.norm(a.position - b.position)) for a, b in combinations(cameras, 2))
