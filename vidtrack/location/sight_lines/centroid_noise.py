"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import Located, locate_points
from vidtrack.location.sight_lines.sudden_misses import unlikely_chi2


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
    redundant           of the square of a camera's noise that its errors show, at least: along the other camera's
                        epipolar line they show nothing
    """

    most: int = 4000
    fewest_differences: int = 30
    fewest_errors: int = 6
    tail: float = 0.99
    tail_deviations: float = 2.326
    redundant: float = 0.01


EVIDENCE = Evidence()


class Noise(NamedTuple):
    """What the standard deviations of centroids are to be multiplied by, and what that rests on.

    factor   that of all; where each camera's sd of each target has its own, their median
    each     (n_cameras, n_targets): of each camera's sd of each target, for what changes from sample to sample
    whole    the same, for all that is in them: sd may hold what lasts
    source   differences (of reprojection errors, from sample to sample) | errors (themselves: the calibration's are in
             them) | none: too few samples for either
    """

    factor: float
    source: str
    each: Array
    whole: Array


def noise_factor(
    cameras: Sequence[Camera],
    b: Array,
    sd: Array,
    fallback: float,
    *,
    lag: int = 1,
    relative: bool = False,
    alike: Sequence[bool] | None = None,
) -> Noise:
    """By how much the standard deviations of centroids are to be multiplied, as the reprojection errors show.

    b, sd      (n_cameras, n_targets, T, 2)  px, along tracks; NaN where lost
    fallback   the answer where too few samples estimate it; a factor from the errors themselves is never below it
    relative   nothing is known of the size of sd
    lag        samples from one to the next that share no noise; samples brought to common moments do with the next two
    alike      (n_cameras,) whose sd holds what is alike in all samples, as what is not known of the outlines of balls
               that a lamp lights from one side: nothing there is made smaller

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them changes slowly and steadily: their second differences show the noise alone. Merged or
    mistaken samples do not count.

    Below 1 it is a factor of each camera's sd of each target (`_smaller`), and one that the largest errors bear out too
    (EVIDENCE.tail): what makes some sd too large says nothing of the others. `whole` is one that the errors themselves
    bear out, with what the calibration leaves in them.
    """
    b, sd = b[:, :, : EVIDENCE.most], np.nan_to_num(sd[:, :, : EVIDENCE.most], nan=1.0)
    if not b.size:
        return _alike(fallback, "none", sd)
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
    if variance >= 1 or relative:
        return _alike(max(float(np.sqrt(variance)), 1e-6), "differences", sd)
    redundant, least = _redundancy(cameras, located.point, sd)
    each = _smaller(change, redundant[:, :, middle], both & used[:, :, middle])
    lasting = _smaller(located.error / sd, redundant, used & (least > EVIDENCE.redundant))
    if alike is not None:
        each[list(alike)] = lasting[list(alike)] = 1.0
    return Noise(float(np.median(each)), "differences", each, np.maximum(each, lasting))


def _alike(factor: float, source: str, sd: Array) -> Noise:
    """One factor for all."""
    each = np.full(sd.shape[:2], factor)
    return Noise(factor, source, each, each)


def _smaller(change: Array, redundant: Array, used: Bools) -> Array:
    """The largest factor (n_cameras, n_targets), up to 1, that the errors allow each camera's sd of each target.

    change      (n_cameras, n_targets, T, 2) errors over sd; redundant (n_cameras, n_targets, T): the mean square that
                the camera's own noise makes of them, were it as large as its sd; used: which count
    All other cameras' noise can only add to that. Of two cameras nothing shows which of them is better than its sd
    says: each is taken to make all of the errors.
    """
    each = np.ones(used.shape[:2])
    square = np.square(change).sum(axis=-1)
    for i, k in np.ndindex(each.shape):
        good = np.flatnonzero(used[i, k] & (redundant[i, k] > EVIDENCE.redundant))
        if good.size < EVIDENCE.fewest_differences:
            continue
        ratio = square[i, k, good] / redundant[i, k, good]
        freedom = 1.0 if used[:, k].sum(axis=0).max() < 3 else 2.0
        largest = float(np.quantile(ratio, EVIDENCE.tail)) * freedom
        tail = largest / float(unlikely_chi2(freedom, EVIDENCE.tail_deviations))
        each[i, k] = np.sqrt(min(max(float(ratio.mean()), tail, 1e-12), 1.0))
    return each


def _redundancy(cameras: Sequence[Camera], point: Array, sd: Array) -> tuple[Array, Array]:
    """Sum of the squares (n_cameras, n_targets, T) by which a camera's errors follow its own noise, both over sd; and
    the least of them, of the direction in which they follow it least.

    point  (n_targets, T, 3); sd (n_cameras, n_targets, T, 2). Of the errors (1 - A (A'A)^-1 A') noise, A the slopes of
    the pictures over sd, the block of each camera.
    """
    step = 1e-4 * np.nanmedian(np.linalg.norm(point - cameras[0].position, axis=-1))
    about = [project(c, point[..., None, :] + step * np.eye(3)) - project(c, point)[..., None, :] for c in cameras]
    slopes = np.stack([np.swapaxes(own, -1, -2) / step for own in about]) / sd[..., None]  # (n, m, T, 2, 3)
    usable = np.asarray(np.isfinite(slopes).all(axis=(-1, -2)), bool)
    slopes = np.where(usable[..., None, None], slopes, 0.0)
    normal = np.einsum("nmtij,nmtik->mtjk", slopes, slopes)
    normal[usable.sum(axis=0) < 2] = np.eye(3)
    inverse = np.linalg.pinv(normal, hermitian=True)
    block = np.eye(2) - slopes @ inverse @ np.swapaxes(slopes, -1, -2)
    both = np.square(block).sum(axis=(-1, -2))
    least = (both - np.sqrt(np.maximum(both**2 - 4 * np.linalg.det(block) ** 2, 0.0))) / 2
    return np.where(usable, both, 0.0), np.where(usable, least, 0.0)


def _from_errors(located: Located, sd: Array, fallback: float) -> Noise:
    """From what the fixes leave; the calibration's errors are in it, so that it is too large rather than too small."""
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    spare = np.where(used.sum(0) >= 2, 2.0 * used.sum(0) - 3, 0)
    if spare.sum() < EVIDENCE.fewest_errors:
        return _alike(fallback, "none", sd)
    chi2 = np.where(used[..., None], (located.error / sd) ** 2, 0).sum((0, -1))
    return _alike(max(float(np.sqrt(chi2.sum() / spare.sum())), fallback), "errors", sd)
