"""A calibration again without some of its points, quickly, from where the whole one ended."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.refine import inverse_root, refine
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import pulls_of
from vidtrack.geometry.jacobian import columns, derivatives, stepped

Mask = NDArray[np.bool_]

SMALL = 1e-4
"""Squared length of a step, in standard errors, below which it is the last: a hundredth of one."""


class CameraRefit:
    """One camera's calibration on all its points, ready to be redone without some.

    camera   fitted to all points
    p, b     (n, 3) world units and (n, 2) px; NaN where the camera does not show or use a point
    free     the parameters that the calibration frees
    survey   (n,) world units, tolerance of the points
    sd       px, centroid noise; None: from what the camera leaves over
    prior    name: (mean, sd) of free parameters
    """

    def __init__(
        self,
        camera: Camera,
        p: Array,
        b: Array,
        free: tuple[str, ...],
        survey: Array,
        sd: float | None,
        prior: Mapping[str, tuple[float, float]],
    ) -> None:
        self.camera, self.p, self.b, self.free, self.survey, self.prior = camera, p, b, free, survey, prior
        self.seen = np.asarray(np.isfinite(b).all(-1))
        self.pivot = p[self.seen].mean(0) if self.seen.any() else np.zeros(3)
        self.columns = columns(camera, free)
        at = derivatives(camera, p, self.pivot)
        self.seen &= np.isfinite(at.projected).all(-1)
        left = (b - at.projected)[self.seen]
        spare = max(left.size - len(free), 1)
        self.sd = max(float(np.sqrt((left**2).sum() / spare)), 1e-9) if sd is None else sd
        B = np.nan_to_num(at.by_point)
        C = self.sd**2 * np.eye(2) + (B @ B.swapaxes(-1, -2)) * survey[:, None, None] ** 2
        self.whitener = inverse_root(C)
        self.A, self.r = self._equations(camera, self.seen)

    def without(self, out: Mask) -> Camera:
        """The camera fitted to all points but those set in a mask (n,). Raises ValueError where too few are left."""
        keep = self.seen & ~out
        if 2 * keep.sum() < len(self.free):
            raise ValueError(f"{keep.sum()} points for {len(self.free)} unknown parameters")
        A, r = np.where(keep[:, None, None], self.A, 0), np.where(keep[:, None], self.r, 0)
        camera, length = self.camera, np.inf
        for _ in range(10):
            if not (np.isfinite(A).all() and np.isfinite(r).all()):  # a point has come behind the camera
                break
            step, length = self._step(camera, A.reshape(-1, len(self.free)), r.ravel())
            try:
                camera = stepped(camera, self.pivot, dict(zip(self.free, step.tolist(), strict=True)))
            except ValueError:
                break
            if length < SMALL:
                return camera
            A, r = self._equations(camera, keep)
        return self._from_scratch(keep)

    def _equations(self, camera: Camera, keep: Mask) -> tuple[Array, Array]:
        """Weighted derivatives (n, 2, k) and residuals (n, 2); zero for points that are not kept."""
        at = derivatives(camera, self.p[keep], self.pivot, self.free)
        A, r = np.zeros((len(self.p), 2, len(self.free))), np.zeros((len(self.p), 2))
        A[keep] = self.whitener[keep] @ at.by_parameter[..., self.columns]
        r[keep] = (self.whitener[keep] @ (self.b[keep] - at.projected)[..., None])[..., 0]
        return A, r

    def _step(self, camera: Camera, A: Array, r: Array) -> tuple[Array, float]:
        N, g = A.T @ A, A.T @ r
        for name, (mean, sd) in self.prior.items():
            k = self.free.index(name)
            N[k, k] += 1 / sd**2
            g[k] += (mean - getattr(camera, name)) / sd**2
        for name, (off, sd) in pulls_of(camera.through).items():
            if name in self.free:
                k = self.free.index(name)
                N[k, k] += 1 / sd**2
                g[k] += off / sd**2
        scale = 1 / np.sqrt(np.maximum(np.diag(N), 1e-300))
        step = scale * np.linalg.lstsq(N * np.outer(scale, scale), scale * g)[0]
        return step, float(step @ N @ step) if np.isfinite(step).all() else np.inf

    def _from_scratch(self, keep: Mask) -> Camera:
        """Gauss-Newton went astray: let the careful fit find the way."""
        return refine(
            self.camera,
            self.p[keep],
            self.b[keep],
            free=self.free,
            sd=self.sd,
            survey=self.survey[keep] if self.survey.any() else None,
            priors=self.prior,
        ).camera
