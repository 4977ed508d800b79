"""A batch of points to locate: cut into blocks, solved, with what calibration and clocks add to their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.camera import Array, Camera
from vidtrack.jacobian import PARAMETERS, derivatives
from vidtrack.location.sights import (
    Mask,
    carried_noise,
    largest_sine,
    linear_gain,
    linear_point,
    look_back,
    refined_gain,
    refined_point,
    sight,
)
from vidtrack.location.symmetric import ELEMENTS, add_product

BLOCK = 8192
"""Points a block: what one needs stays in the second-level cache."""


class CameraUncertainty(Protocol):
    """How well a camera is known: covariance (k, k) of the parameters `names`, turned about `pivot` (3,)."""

    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def pivot(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...


class Solution:
    """Points of a task, coordinates first."""

    def __init__(self, n_cameras: int, n: int) -> None:
        self.point = np.empty((3, n))
        self.noise = np.empty((6, n))  # covariance from centroid noise
        self.common = np.zeros((6, n))  # and from what all points have in common: calibration and clocks
        self.miss = np.empty(n)
        self.error = np.empty((n_cameras, 2, n))
        self.chi2 = np.empty(n)  # weighted sum of squared errors

    def put(self, where: slice | NDArray[np.intp], part: Solution) -> None:
        for name, value in vars(part).items():
            getattr(self, name)[..., where] = value

    def worst(self, used: Mask) -> Array:
        """The largest reprojection error, px (n,), among the cameras used; 0 where there is no fix."""
        x, y = self.error[:, 0], self.error[:, 1]
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
    min_sine: float

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
            whole.put(part, self._block(part, used[:, part]))
        return whole

    def _block(self, part: slice, used: Mask) -> Solution:
        origin = np.mean([camera.position for camera in self.cameras], 0)
        sights = [
            sight(camera, self.b[i, part], self.weight[i, part], used[i], origin)
            for i, camera in enumerate(self.cameras)
        ]
        out = Solution(len(self.cameras), used.shape[1])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            p, Q = linear_point(sights)
            if self.steps:
                p, Q = refined_point(sights, p, self.steps)
            seen = [look_back(s, p) for s in sights]
            gains = []
            if self.known or self.slips is not None or not self.steps:
                gains = [refined_gain(s, p, Q) if self.steps else linear_gain(s, p, Q) for s in sights]
            out.noise[:] = Q if self.steps else carried_noise(sights, gains)
            out.chi2[:] = sum(np.sum(s.weight * view.error**2, 0) for s, view in zip(sights, seen, strict=True))
            n = np.sum([s.used for s in sights], 0)
            out.miss[:] = np.sqrt(sum(s.used * view.off2 for s, view in zip(sights, seen, strict=True)) / n)
            behind = np.any([s.used & (view.depth <= 0) for s, view in zip(sights, seen, strict=True)], 0)
            good = (n >= 2) & ~behind & (largest_sine([view.line for view in seen]) >= self.min_sine)
        for i, (s, view) in enumerate(zip(sights, seen, strict=True)):
            out.error[i] = np.where(s.seen, view.error, np.nan)
        out.point[:] = np.where(good, p + origin[:, None], np.nan)
        if self.known:
            out.common[:, good] = self.known.carried(out.point[:, good], [gain[..., good] for gain in gains])
        if self.slips is not None:
            for gain, slip in zip(gains, self.slips[:, part], strict=True):
                moved = gain[0] * slip[:, 0] + gain[1] * slip[:, 1]
                add_product(out.common, moved, moved)
        return out


class CalibrationErrors:
    """What is known of the cameras' calibration errors."""

    def __init__(
        self, cameras: Sequence[Camera], uncertainties: Sequence[CameraUncertainty | None], joint: ArrayLike | None
    ) -> None:
        self.cameras = cameras
        self.uncertainties = uncertainties
        parts = [np.asarray(u.covariance, float) for u in uncertainties if u is not None]
        size = sum(len(part) for part in parts)
        self.covariance = np.zeros((size, size)) if joint is None else np.asarray(joint, float)
        if self.covariance.shape != (size, size):
            raise ValueError(f"the joint covariance must be ({size}, {size}), not {self.covariance.shape}")
        start = 0
        for part in parts if joint is None else ():
            stop = start + len(part)
            self.covariance[start:stop, start:stop] = part
            start = stop

    def carried(self, point: Array, gains: Sequence[Array]) -> Array:
        """Covariance (6, n) of points (3, n): with G = dp/d(Xf, Yf) and J = d(Xf, Yf)/dk, (G J) C (G J)^T."""
        parts = []
        for camera, uncertainty, gain in zip(self.cameras, self.uncertainties, gains, strict=True):
            if uncertainty is not None:
                J = derivatives(camera, point.T, uncertainty.pivot).by_parameter
                J = J[..., [PARAMETERS.index(name) for name in uncertainty.names]]
                parts.append(np.ascontiguousarray(gain.transpose(2, 1, 0)) @ J)
        if not parts:
            return np.zeros((6, point.shape[1]))
        by_parameter = np.concatenate(parts, -1)
        product = by_parameter @ self.covariance
        return np.stack([np.sum(product[:, i] * by_parameter[:, j], -1) for i, j in ELEMENTS])
