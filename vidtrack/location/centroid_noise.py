"""How noisy centroids are, from what the reprojection errors of a run show."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import Camera, project
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
    redundant           of the square of a camera's noise that its errors show, at least: along the other camera's
                        epipolar line they show nothing
    overlap             second differences that share samples, for each of their own
    usual               of the median sd of a camera and a target: what is larger has a reason of its own
    notable             share of the mean square of a camera's errors that a camera makes at least, to be seen in it
    """

    most: int = 4000
    fewest_differences: int = 30
    fewest_errors: int = 6
    tail: float = 0.99
    tail_deviations: float = 2.326
    redundant: float = 0.01
    overlap: float = 1.94
    usual: float = 1.25
    notable: float = 0.1


EVIDENCE = Evidence()


class Noise(NamedTuple):
    """What the standard deviations of centroids are to be multiplied by, and what that rests on.

    factor   that of all; where each camera's sd of each target has its own, their median
    each     (n_cameras, n_targets): of each camera's sd of each target (`scaled`)
    source   differences (of reprojection errors, from sample to sample) | errors (themselves: the calibration's are in
             them) | none: too few samples for either
    """

    factor: float
    source: str
    each: Array

    def scaled(self, sd: Array) -> Array:
        """The standard deviations (n_cameras, n_targets, T, 2) px as they are to be.

        What is less than is said is less of what is usual of a camera and a target. Where a sample's is larger for a
        reason of its own (a streak along its way, a part that is hidden), it stays larger by as much.
        """
        with warnings.catch_warnings(action="ignore"):  # of a camera without a sample
            usual = np.nanmedian(sd, axis=(-2, -1), keepdims=True)
        factor = self.each[:, :, None, None]
        fewer = np.square(sd) - (1 - np.square(factor)) * np.square(np.fmin(sd, EVIDENCE.usual * usual))
        return np.asarray(np.where(factor < 1, np.sqrt(np.maximum(fewer, 0.0)), factor * sd))


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
    mistaken samples do not count.

    Below 1 it is a factor of each camera's sd of each target (`_smaller`), and one that the largest errors bear out too
    (EVIDENCE.tail): what makes some sd too large says nothing of the others.
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
    shares = _shares(cameras, located.point, sd, used)
    each = _smaller(
        change, located.error / sd, shares, both & used[:, :, middle], np.hypot(sd[..., 0], sd[..., 1]), lag
    )
    return Noise(float(np.median(each)), "differences", each)


def _alike(factor: float, source: str, sd: Array) -> Noise:
    """One factor for all."""
    return Noise(factor, source, np.full(sd.shape[:2], factor))


def _smaller(change: Array, error: Array, shares: Array, used: Bools, sd: Array, lag: int) -> Array:
    """The factor (n_cameras, n_targets), up to 1, that the errors allow each camera's sd of each target.

    change   (n_cameras, n_targets, T - 2 lag, 2) second differences of the errors over sd; used: which of them count
    error    (n_cameras, n_targets, T, 2) the errors over sd; sd (n_cameras, n_targets, T) px
    shares   (n_cameras, n_cameras, n_targets, T), `_shares`

    What an sd holds may change slowly, as a target that passes behind a rope: the errors themselves count as well.
    What a camera's errors show is a sum over all cameras, and no sum may fall short of it. Where that leaves a choice
    (two cameras have one error between them) the largest sd is made smaller first, down to the next one, and then both:
    one that is too large, as where a lamp flickers before it, makes that of no other camera too small.
    """
    n, m, T = sd.shape
    each = np.ones((n, m))
    squares = np.square(change).sum(axis=-1), np.square(error).sum(axis=-1)
    for k in range(m):
        seen, chance, parts, said = np.zeros(n), np.zeros(n), np.zeros((n, n)), np.full(n, np.nan)
        for i in range(n):
            good = np.flatnonzero(used[i, k] & (shares[i, i, k, lag : T - lag] > EVIDENCE.redundant))
            if good.size < EVIDENCE.fewest_differences:
                continue
            own = shares[i, :, k, good + lag].T  # (n_cameras, good)
            expected = own.sum(axis=0)
            freedom = np.clip(expected**2 / own[i], 1.0, 2.0)  # of its two errors, as Satterthwaite counts them
            chance[i] = np.sqrt(2 * EVIDENCE.overlap / freedom.sum())
            parts[i], said[i] = own.sum(axis=1) / own.sum(), np.median(sd[i, k, good + lag])
            for square in (squares[0][i, k, good], squares[1][i, k, good + lag]):
                seen[i] = max(seen[i], _seen(square / expected, freedom))
        each[:, k] = np.sqrt(_lowered(np.square(said), seen, parts, chance))
    return each


def _seen(ratio: Array, freedom: Array) -> float:
    """The mean of the squares of errors (n,) over what was expected of them, and not less than the largest bear out.

    freedom   (n,) degrees of it
    """
    largest = ratio * freedom / unlikely_chi2(freedom, EVIDENCE.tail_deviations)
    return max(float(ratio.mean()), float(np.quantile(largest, EVIDENCE.tail)), 1e-12)


def _lowered(said: Array, seen: Array, parts: Array, chance: Array | float = 0.0) -> Array:
    """Factors (n,), up to 1, of the variances that are said, the largest made smaller first.

    said   (n,) px^2; NaN: of nothing
    seen   (n,) the mean square of each camera's errors over what is said; parts (n, n) of it that each camera makes
    chance (n,) one standard deviation of it, as a share: what other cameras made of it may be less by twice that
    """
    sure = np.maximum(1 - 2 * np.asarray(chance, float), 0.0)
    factor = np.ones(said.shape)
    now = np.nan_to_num(said)
    free = now > 0
    while free.any():
        level = now[free].max()
        top = free & (now > level * (1 - 1e-9))
        sums = parts * factor
        shown = sums > EVIDENCE.notable * sums.sum(axis=1, keepdims=True)  # (n, n): in whose errors whose noise is seen
        rows = shown[:, top].any(axis=1)
        own = sums[:, top].sum(axis=1)
        rest = seen - sure * (sums.sum(axis=1) - own)
        least = np.divide(rest, own, out=np.zeros(own.shape), where=rows)  # of the level, as each camera's errors allow
        fixed = top & ~(shown[rows].any(axis=0))
        fixed |= top & shown[rows & (least > 1 - 1e-9)].any(axis=0)
        if fixed.any():
            free &= ~fixed
            continue
        unseen = (sums.sum(axis=1) - own)[rows] / own[rows] * EVIDENCE.notable / (1 - EVIDENCE.notable)
        lower = max(
            float(least.max()), float(now[free & ~top].max(initial=0.0)) / level, 0.99 * float(unseen.min()), 1e-3
        )
        now[top], factor[top] = now[top] * lower, factor[top] * lower
    return factor


def _shares(cameras: Sequence[Camera], point: Array, sd: Array, used: Bools) -> Array:
    """The mean square (n_cameras, n_cameras, n_targets, T) over sd of a camera's errors, that each one makes.

    point  (n_targets, T, 3); sd (n_cameras, n_targets, T, 2); used (n_cameras, n_targets, T)
    The errors are (1 - S (S'S)^-1 S') noise, S the slopes of the pictures over sd; with G_i = S_i'S_i of camera i and
    M_i = (S'S)^-1 G_i its block with camera j has the sum of squares tr(M_i M_j), that with itself 2 - 2 tr(M_i) more.
    """
    step = 1e-4 * np.nanmedian(np.linalg.norm(point - cameras[0].position, axis=-1))
    about = [project(c, point[..., None, :] + step * np.eye(3)) - project(c, point)[..., None, :] for c in cameras]
    slopes = np.stack(about) / step / sd[..., None, :]  # (n, m, T, 3, 2)
    usable = used & np.asarray(np.isfinite(slopes).all(axis=(-1, -2)), bool)
    slopes = np.where(usable[..., None, None], slopes, 0.0)
    normal = slopes @ np.swapaxes(slopes, -1, -2)
    whole = normal.sum(axis=0)
    whole[usable.sum(axis=0) < 2] = np.eye(3)
    of = np.linalg.pinv(whole, hermitian=True) @ normal  # (n, m, T, 3, 3)
    out = np.einsum("imtab,jmtba->ijmt", of, of)
    for i in range(len(cameras)):
        out[i, i] += 2 - 2 * np.trace(of[i], axis1=-2, axis2=-1)
    return np.asarray(np.where(usable[:, None] & usable, out, 0.0))


def _from_errors(located: Located, sd: Array, fallback: float) -> Noise:
    """From what the fixes leave; the calibration's errors are in it, so that it is too large rather than too small."""
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    spare = np.where(used.sum(0) >= 2, 2.0 * used.sum(0) - 3, 0)
    if spare.sum() < EVIDENCE.fewest_errors:
        return _alike(fallback, "none", sd)
    chi2 = np.where(used[..., None], (located.error / sd) ** 2, 0).sum((0, -1))
    return _alike(max(float(np.sqrt(chi2.sum() / spare.sum())), fallback), "errors", sd)
