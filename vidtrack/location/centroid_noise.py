"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import Located, locate_points
from vidtrack.location.sudden_misses import unlikely_chi2


@dataclass(frozen=True)
class Evidence:
    """What the noise is estimated from.

    most                samples of each track that are looked at
    fewest_differences  redundant measurements of the second differences of the errors that estimate the noise
    fewest_errors       of the errors themselves
    tail                share of the samples whose errors say how far standard deviations are made smaller: where some
                        centroids are far better than their sd and others as good as it says, the mean of all would
                        make the sd of the latter too small
    tail_deviations     the same share of a normal distribution
    """

    most: int = 4000
    fewest_differences: int = 30
    fewest_errors: int = 6
    tail: float = 0.99
    tail_deviations: float = 2.326


EVIDENCE = Evidence()


class Noise(NamedTuple):
    """What the standard deviations of centroids are to be multiplied by, and what that rests on.

    source   differences (of reprojection errors, from sample to sample) | errors (themselves: the calibration's are in
             them) | none: too few samples for either
    """

    factor: float
    source: str


def noise_factor(
    cameras: Sequence[Camera], b: Array, sd: Array, fallback: float, *, lag: int = 1, relative: bool = False
) -> Noise:
    """By how much the standard deviations of centroids are to be multiplied, as the reprojection errors show.

    b, sd      (n_cameras, n_targets, T, 2)  px, along tracks; NaN where lost
    fallback   the answer where too few samples estimate it; a factor from the errors themselves is never below it
    relative   nothing is known of the size of sd
    lag        samples from one to the next that share no noise; samples brought to common moments do with the next two

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them changes slowly and steadily: their second differences show the noise alone. Merged or
    mistaken samples do not count. A factor below 1 is one that the largest errors bear out too (EVIDENCE.tail).
    """
    b, sd = b[:, :, : EVIDENCE.most], np.nan_to_num(sd[:, :, : EVIDENCE.most], nan=1.0)
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
    if spare.sum() < EVIDENCE.fewest_differences:
        return _from_errors(located, sd, fallback)
    variance = float(np.median(chi2 / spare)) / 0.5
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * max(variance, 1e-12)
        variance = float(chi2[good].sum() / spare[good].sum())
    if variance < 1 and not relative:
        variance = min(max(variance, _of_tail(chi2, spare)), 1.0)
    return Noise(max(float(np.sqrt(variance)), 1e-6), "differences")


def _of_tail(chi2: Array, spare: Array) -> float:
    """The variance at which as few samples as expected have a larger sum of squares than EVIDENCE.tail of them."""
    return float(np.quantile(chi2 / unlikely_chi2(spare, EVIDENCE.tail_deviations), EVIDENCE.tail))


def _from_errors(located: Located, sd: Array, fallback: float) -> Noise:
    """From what the fixes leave; the calibration's errors are in it, so that it is too large rather than too small."""
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    spare = np.where(used.sum(0) >= 2, 2.0 * used.sum(0) - 3, 0)
    if spare.sum() < EVIDENCE.fewest_errors:
        return Noise(fallback, "none")
    chi2 = np.where(used[..., None], (located.error / sd) ** 2, 0).sum((0, -1))
    return Noise(max(float(np.sqrt(chi2.sum() / spare.sum())), fallback), "errors")
