"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import Located, locate_points

MOST = 4000
"""Samples of each track that are looked at."""


FEWEST_DIFFERENCES, FEWEST_ERRORS = 30, 6
"""Redundant measurements that estimate the noise: second differences of the errors, or the errors themselves."""


class Noise(NamedTuple):
    """What the standard deviations of centroids are to be multiplied by, and what that rests on.

    source   differences (of reprojection errors, from sample to sample) | errors (themselves: the calibration's are in
             them) | none: too few samples for either
    """

    factor: float
    source: str


def noise_factor(cameras: Sequence[Camera], b: Array, sd: Array, fallback: float, *, lag: int = 1) -> Noise:
    """By how much the standard deviations of centroids are to be multiplied, as the reprojection errors show.

    b, sd      (n_cameras, n_targets, T, 2)  px, along tracks; NaN where lost. sd is only relative
    fallback   the answer where too few samples estimate it; a factor from the errors themselves is never below it
    lag        samples from one to the next that share no noise; samples brought to common moments do with the next two

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them changes slowly and steadily: their second differences show the noise alone. Merged or
    mistaken samples do not count.
    """
    b, sd = b[:, :, :MOST], np.nan_to_num(sd[:, :, :MOST], nan=1.0)
    if not b.size:
        return Noise(fallback, "none")
    located = locate_points(cameras, b, sd=sd)
    if b.shape[2] <= 2 * lag:
        return _from_errors(located, sd, fallback)
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    first, middle, last = slice(None, -2 * lag), slice(lag, -lag), slice(2 * lag, None)
    change = located.error[:, :, first] - 2 * located.error[:, :, middle] + located.error[:, :, last]
    change /= np.sqrt(sd[:, :, first] ** 2 + 4 * sd[:, :, middle] ** 2 + sd[:, :, last] ** 2)
    same = (used[:, :, first] == used[:, :, middle]) & (used[:, :, middle] == used[:, :, last])
    both = same.all(0) & (used[:, :, middle].sum(0) >= 2)
    spare = np.where(both, 2.0 * used[:, :, middle].sum(0) - 3, 0)[both]
    chi2 = np.nansum(change**2, (0, -1))[both]
    if spare.sum() < FEWEST_DIFFERENCES:
        return _from_errors(located, sd, fallback)
    variance = float(np.median(chi2 / spare)) / 0.5
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * max(variance, 1e-12)
        variance = float(chi2[good].sum() / spare[good].sum())
    return Noise(max(float(np.sqrt(variance)), 1e-6), "differences")


def _from_errors(located: Located, sd: Array, fallback: float) -> Noise:
    """From what the fixes leave; the calibration's errors are in it, so that it is too large rather than too small."""
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    spare = np.where(used.sum(0) >= 2, 2.0 * used.sum(0) - 3, 0)
    if spare.sum() < FEWEST_ERRORS:
        return Noise(fallback, "none")
    chi2 = np.where(used[..., None], (located.error / sd) ** 2, 0).sum((0, -1))
    return Noise(max(float(np.sqrt(chi2.sum() / spare.sum())), fallback), "errors")
