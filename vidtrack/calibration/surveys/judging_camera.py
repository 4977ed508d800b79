"""One camera as a judge of surveyed points: fitted to some of them, it says of every point how far it lies off.

The errors that it gives are those that each point would have if it had had no part in the fit, with their covariance
(Cook and Weisberg 1982), so that points of high leverage are judged as the others are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.initial_fit import Nominal, distances, with_lens_of
from vidtrack.calibration.camera.lens_selection import points_needed
from vidtrack.calibration.camera.one_camera import Judge, NoCamera, Points, better_part, grown
from vidtrack.calibration.camera.outliers import ENOUGH, LEAST_REDUNDANCY, SMALLEST_SCALE, Mask, limit_for, trusted
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.jacobian import columns, derivatives

RICHER = ("equidistant", "tsai2", "tsai3", "fisheye", "prism")
"""Lens models beside the plainest one that a camera may need: the first of each kind that a misfit may be taken for."""


class View(NamedTuple):
    """What one camera sees of n surveyed points: b (n, 2) px, NaN where it does not; sd (n, 2) px where known; through
    which interfaces."""

    b: Array
    image_size: tuple[int, int]
    sd: Array | None = None
    through: tuple[Interface, ...] = ()


class CameraFit(NamedTuple):
    """A camera fitted to some points: errors (n, 2) px of all, each as if it had no part in the fit."""

    camera: Camera
    scale: float  # px, noise of one coordinate
    error: Array  # (n, 2) NaN where not seen
    variance: Array  # (n, 2, 2) px^2 of the error
    by_point: Array  # (n, 2, 3)
    limit: float  # standard deviations
    length: float  # description length of its own sights
    kept: Mask  # (n,)


class JudgingCamera:
    """One camera that can judge."""

    def __init__(self, p: Array, view: View, model: str, fixed: dict[str, float], camera: Camera, keep: Mask) -> None:
        self.p, self.view, self.model, self.fixed, self.camera, self.keep = p, view, model, fixed, camera, keep
        self.seen: Mask = np.asarray(np.isfinite(view.b).all(-1))

    @classmethod
    def of(cls, p: Array, view: View) -> JudgingCamera | None:
        """The camera as it sees the points by itself; None where they are too few, or fit no camera."""
        seen = np.flatnonzero(np.isfinite(view.b).all(-1))
        if len(seen) < ENOUGH:
            return None
        points = Points(p[seen], view.b[seen], None if view.sd is None else view.sd[seen])
        nominal = nominal_of(view)
        fixed = {"Cx": nominal.Cx, "Cy": nominal.Cy, "Sx": 1.0} if points.coplanar else {}
        try:
            found = grown(points, nominal, "tsai", fixed, better_part(points))
        except (NoCamera, np.linalg.LinAlgError):
            return None
        if found is None or found.camera is None:
            return None
        keep = np.zeros(len(p), bool)
        keep[seen[found.keep]] = True
        plain = cls(p, view, "tsai", fixed, found.camera, keep)
        best, length = plain, found.description_length
        for model in RICHER if not fixed else ():
            if len(seen) >= 2 * points_needed(model):
                richer = cls(p, view, model, fixed, with_lens_of(found.camera, model), keep)
                fit = richer._grown(richer.seen, keep)
                if fit and fit.length < length:
                    best, length = richer, fit.length
                    best.keep, best.camera = fit.kept, fit.camera
        return best

    def fitted(self, out: Mask, mistaken: Mask) -> CameraFit:
        """The camera without the points of `out` (n,) and the sights of `mistaken` (n,)."""
        among = self.seen & ~out & ~mistaken
        fits = [self._grown(among, among), self._grown(among, among & self.keep)]
        best = min((fit for fit in fits if fit), key=lambda fit: fit.length, default=None)
        if best is None:
            best = self._measured(self.camera, self.keep, SMALLEST_SCALE * 1e3, np.inf)
        return best

    def _grown(self, mask: Mask, start: Mask) -> CameraFit | None:
        """Fitted to the inliers among some points (n,), grown from those of `start` (n,)."""
        among = np.flatnonzero(mask)
        points = Points(self.p[among], self.view.b[among], None if self.view.sd is None else self.view.sd[among])
        judge = Judge(points, nominal_of(self.view), self.model, self.fixed, near=self.camera)
        k = len(judge.free)
        if 2 * start.sum() < k + 4:
            return None
        try:
            keep, _, scale = trusted(start[among], judge.distances, n_parameters=k)
        except (NoCamera, np.linalg.LinAlgError):
            return None
        if judge.camera is None or 2 * keep.sum() < k + 2:
            return None
        kept = np.zeros(len(self.p), bool)
        kept[among[keep]] = True
        off = distances(judge.camera, self.p[kept], self.view.b[kept])
        variance = max(float((off**2).sum()) / max(2 * keep.sum() - k, 1), SMALLEST_SCALE**2)
        area = float(np.log(self.view.image_size[0] * self.view.image_size[1]))
        length = keep.sum() * (1 + np.log(2 * np.pi * variance)) + (~keep).sum() * area
        length += 0.5 * k * np.log(2 * len(among))
        return self._measured(judge.camera, kept, max(scale, float(np.sqrt(variance))), float(length))

    def _measured(self, camera: Camera, kept: Mask, scale: float, length: float) -> CameraFit:
        at = derivatives(camera, self.p, self.p[kept].mean(0))
        free = free_parameters(self.model, tuple(self.fixed))
        J = at.by_parameter[..., columns(camera, free)]
        e = np.where(self.seen[:, None], self.view.b - at.projected, np.nan)
        A = np.nan_to_num(J[kept]).reshape(-1, len(free))
        size = np.linalg.norm(A, axis=0)
        size = np.where(size > 0, size, 1.0)
        _, s, Vt = np.linalg.svd(A / size, full_matrices=False)
        good = s > 1e-9 * s[0]
        own = np.nan_to_num(J / size) @ (Vt[good].T / s[good])
        values, axes = np.linalg.eigh(own @ np.swapaxes(own, -1, -2))
        left = np.maximum(1 - values, LEAST_REDUNDANCY)
        growth = np.where(kept[:, None], 1 / left, 1 + values)
        gain = np.where(kept[:, None], 1 / left, 1.0)
        along = (np.nan_to_num(e)[:, None, :] @ axes)[:, 0]
        error = np.where(np.isfinite(e), (axes @ (along * gain)[..., None])[..., 0], np.nan)
        variance = (axes * growth[:, None, :]) @ np.swapaxes(axes, -1, -2) * scale**2
        n = int(self.seen.sum())
        return CameraFit(camera, scale, error, variance, np.nan_to_num(at.by_point), limit_for(n), length, kept)


def nominal_of(view: View) -> Nominal:
    return Nominal.of(view.image_size, through=view.through)
