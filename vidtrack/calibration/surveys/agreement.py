"""Where all cameras together see each surveyed point, and which points and which sights of single cameras are wrong.

A point that is misplaced in the survey is seen at one and the same other place by every camera; a sight that is wrong
disagrees with the survey and with the other cameras.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.outliers import FALSE_ALARMS, HEAVY_TAILS, Mask
from vidtrack.calibration.surveys.judging_camera import CameraFit, JudgingCamera
from vidtrack.geometry.jacobian import derivatives

MEDIAN_OF_CHI2 = 2.366
"""Of 3 degrees of freedom."""


class Agreement:
    """What all cameras together say of each of n points."""

    def __init__(self, out: Mask, error: Array, weight: Array, by_point: Array, limits: Array) -> None:
        self.out, self.error, self.weight, self.by_point, self.limits = out, error, weight, by_point, limits
        self.place = self.sd = self.displacement = self.covariance = np.empty(0)
        self.spread = 0.0
        self.n_seen: NDArray[np.intp] = np.asarray(np.isfinite(error[..., 0]).sum(0))
        self.agreed: Mask = np.zeros(len(out), bool)

    @classmethod
    def of(
        cls, p: Array, sigma: Array, out: Mask, cameras: Sequence[JudgingCamera], fits: Sequence[CameraFit]
    ) -> Agreement:
        error = np.stack([fit.error for fit in fits])
        seen = np.isfinite(error[..., 0])
        weight = np.linalg.inv(np.stack([fit.variance for fit in fits]))
        agreement = cls(
            out,
            error,
            np.where(seen[..., None, None], weight, 0.0),
            np.stack([fit.by_point for fit in fits]),
            np.array([fit.limit for fit in fits]),
        )
        agreement.displacement, agreement.covariance = displaced(error, agreement.weight, agreement.by_point)
        agreement._relocate(p, cameras, fits)
        agreement._spread(sigma)
        agreement.place = p + agreement.displacement
        agreement.sd = np.sqrt(np.einsum("naa->na", agreement.covariance))
        return agreement

    def _relocate(self, p: Array, cameras: Sequence[JudgingCamera], fits: Sequence[CameraFit]) -> None:
        """Far from the survey's place the pictures are not linear: steps from where the last one led."""
        far = np.flatnonzero(self.out & np.isfinite(self.displacement).all(-1))
        for _ in range(10 if far.size else 0):
            x = (p + self.displacement)[far]
            at = [derivatives(fit.camera, x, x.mean(0)) for fit in fits]
            error = np.stack([w.view.b[far] - each.projected for w, each in zip(cameras, at, strict=True)])
            by_point = np.stack([np.nan_to_num(each.by_point) for each in at])
            step, covariance = displaced(error, self.weight[:, far], by_point)
            self.displacement[far] += np.nan_to_num(step)
            self.covariance[far], self.by_point[:, far] = covariance, by_point
            self.error[:, far] = error
            if not np.nanmax(np.abs(step), initial=0.0) > 1e-6 * np.ptp(p, axis=0).max():
                break
        # from here on errors are those about the new place for the points of `out`, about the survey for the others

    def _spread(self, sigma: Array) -> None:
        """The survey's tolerance that makes the displacements of the points in place as large as they should be."""
        use = np.flatnonzero(~self.out & np.isfinite(self.displacement).all(-1) & (self.n_seen > 1))
        self.relative = np.where(sigma > 0, sigma, 0.0) / sigma.max() if sigma.max() > 0 else np.ones(len(sigma))
        if not use.size:
            return
        target = MEDIAN_OF_CHI2 / (1 + 5 / max(3 * use.size, 1)) ** 2
        low, high = 0.0, float(np.linalg.norm(self.displacement[use], axis=-1).max()) + 1e-300
        if np.median(self.tested(0.0)[use]) <= target:
            return
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if np.median(self.tested(middle)[use]) > target else (low, middle)
        self.spread = high

    def tested(self, spread: float) -> Array:
        """Chi-squared (n,) of the displacements by their covariance and a survey that errs by `spread`."""
        C = self.covariance + (spread * self.relative)[:, None, None] ** 2 * np.eye(3)
        known: Mask = np.asarray(np.isfinite(self.displacement).all(-1))
        d = np.where(known[:, None], self.displacement, 0.0)
        C = np.where(known[:, None, None], C, np.eye(3))
        return np.where(known, (d * np.linalg.solve(C, d[..., None])[..., 0]).sum(-1), 0.0)

    def decided(self, p: Array) -> tuple[Mask, Mask]:
        """Which points (n,) are misplaced or unclear, and which sights (m, n) are mistaken."""
        m, n = self.error.shape[:2]
        chi2 = self.tested(self.spread)
        moved = chi2 > _limit3(n) ** 2
        off = self.distance(self.error) > self.limits[:, None]  # about the new place for points that are out
        out, mistaken = np.zeros(n, bool), np.zeros((m, n), bool)
        for j in range(n):
            seen = np.flatnonzero(np.isfinite(self.error[:, j, 0]))
            if len(seen) < 2:
                continue
            if self.out[j]:
                self._revised(j, seen, moved, off, out, mistaken)
            elif off[:, j].any() or moved[j]:
                self._suspected(j, seen, off, out, mistaken)
        return out, mistaken

    def _revised(self, j: int, seen: NDArray[np.intp], moved: Mask, off: Mask, out: Mask, mistaken: Mask) -> None:
        """A point that is out: does it come back, and do the cameras agree on where it is?"""
        wrong = off[seen, j]
        if not wrong.any():
            out[j] = moved[j]
            self.agreed[j] = True
            return
        at_survey = self._at_survey(j)
        bad = seen[at_survey[seen] > self.limits[seen]]
        if 2 * len(bad) < len(seen) or (len(seen) == 2 and len(bad) == 1):
            mistaken[bad, j] = True  # the others see it in its place
            return
        keep = self._without_one(j, seen)
        out[j] = True
        if keep is not None:
            mistaken[keep, j] = True
            self.agreed[j] = True

    def _suspected(self, j: int, seen: NDArray[np.intp], off: Mask, out: Mask, mistaken: Mask) -> None:
        """A point that was in: the few cameras that see it elsewhere err, or it is elsewhere."""
        bad = seen[off[seen, j]]
        after = self._after(j, seen)
        agree = bool((after[seen] <= self.limits[seen]).all())
        rest = np.setdiff1d(seen, bad)
        if len(bad) and len(rest) and (not agree or len(seen) == 2) and 2 * len(bad) <= len(seen):
            mistaken[bad, j] = True
        else:
            out[j] = True

    def _without_one(self, j: int, seen: NDArray[np.intp]) -> int | None:
        """The camera without which the others agree on one place; None where there is none."""
        best, chosen = np.inf, None
        for i in seen.tolist() if len(seen) > 2 else ():
            rest = np.setdiff1d(seen, [i])
            after = self._after(j, rest)
            if (after[rest] <= self.limits[rest]).all() and (after[rest] ** 2).sum() < best:
                best, chosen = float((after[rest] ** 2).sum()), i
        return chosen

    def _after(self, j: int, cameras: NDArray[np.intp]) -> Array:
        """Distances (m,), in standard deviations, from the place that some cameras agree on best; to first order."""
        own = (cameras, slice(j, j + 1))
        d, _ = displaced(self.error[own], self.weight[own], self.by_point[own])
        return self._distance_of(self.error[:, j] - self.by_point[:, j] @ np.nan_to_num(d[0]), j)

    def _at_survey(self, j: int) -> Array:
        """Distances (m,) from the survey's place, to first order about where the point is now."""
        error = self.error[:, j] + self.by_point[:, j] @ self.displacement[j]
        return self._distance_of(error, j)

    def distance(self, error: Array) -> Array:
        e = np.nan_to_num(error)
        squared: Array = (e * (self.weight @ e[..., None])[..., 0]).sum(-1)
        return np.sqrt(squared)

    def _distance_of(self, error: Array, j: int) -> Array:
        e = np.nan_to_num(error)
        squared: Array = (e * (self.weight[:, j] @ e[..., None])[..., 0]).sum(-1)
        return np.sqrt(squared)


def displaced(error: Array, weight: Array, by_point: Array) -> tuple[Array, Array]:
    """The displacement (n, 3) that explains errors (m, n, 2) best, and its covariance; NaN for fewer than 2 sights."""
    Bt = np.swapaxes(by_point, -1, -2)
    N = (Bt @ weight @ by_point).sum(0)
    g = (Bt @ weight @ np.nan_to_num(error)[..., None])[..., 0].sum(0)
    enough = (np.isfinite(error[..., 0]) & (weight[..., 0, 0] > 0)).sum(0) > 1
    scale = np.sqrt(np.maximum(np.einsum("naa->na", N), 1e-300))
    scaled = N / scale[:, :, None] / scale[:, None, :]
    enough &= np.linalg.cond(np.where(enough[:, None, None], scaled, np.eye(3))) < 1e10
    C = np.linalg.inv(np.where(enough[:, None, None], scaled, np.eye(3))) / scale[:, :, None] / scale[:, None, :]
    d = (C @ g[..., None])[..., 0]
    return np.where(enough[:, None], d, np.nan), np.where(enough[:, None, None], C, np.nan)


def _limit3(n: int) -> float:
    """Standard deviations that one of n displacements exceeds by chance FALSE_ALARMS times (Wilson and Hilferty)."""
    z = NormalDist().inv_cdf(1 - FALSE_ALARMS / max(n, 1))
    return HEAVY_TAILS * float(np.sqrt(3 * (1 - 2 / 27 + z * np.sqrt(2 / 27)) ** 3))
