"""Courses smoothed over gaps in which single cameras see a target: where on their lines of sight it is.

Of places p at moments t those are taken (Whittaker's graduation, 1923) that make

    sum |p - located|^2 / S + sum |h(p) - b|^2 / sd^2 + sum |p'''|^2 / Q

least: h is what a camera sees of a place, b where it saw it, p''' the third divided difference, the jerk. Q is the
run's own: a jerk of the usual size that lasts for some moments moves a target as far as one that changes at each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.geometry.camera import Camera
from vidtrack.location.lost_targets.expected import BEYOND, LEAST_PX, Expected, linearised, with_bias


@dataclass(frozen=True)
class Smoothing:
    """How courses are smoothed over gaps.

    side     moments on each side of a gap that count; longest: of a gap, from each end
    known    located moments, at least, in a gap and beside it
    apart    moments between the four places of which a jerk is measured: noise counts less
    lasting  moments for which a jerk lasts (ASSUME: waves bend a course within a third of a second)
    fewest   jerks, at least, of which the usual one is known
    rounds   in which lines of sight are linearised
    most     gaps, at most: a recording that shows more is not mended by this
    """

    side: int = 12
    longest: int = 40
    known: int = 3
    apart: int = 3
    lasting: float = 10.0
    fewest: int = 20
    rounds: int = 3
    most: int = 400


SMOOTHING = Smoothing()
OF_LASTING = 20 / 36
"""A jerk j over a time T moves by j T^3 / 6; jerks of density q, each of its own, by sqrt(q T^5 / 20) (one sd)."""


class Sights(NamedTuple):
    """What single cameras see in n moments: which of them, of the cameras (k,), and where b, sd (k, 2) px."""

    moment: Ints
    camera: Ints
    b: Array
    sd: Array


def smoothed_gaps(
    cameras: Sequence[Camera], b: Array, sd: Array, bias_px: float, at: Array, located: Expected, wanted: Bools
) -> Expected:
    """Places in gaps of located courses (m, M), by motion and by what single cameras see; NaN elsewhere.

    b, sd    (n_cameras, m, M, 2) px; bias_px: what the calibration leaves, one standard deviation
    at       (M,) s: the moments; wanted (M,): a gap without any of these is left
    located  where two cameras or more see targets
    """
    out, S = np.full(located.p.shape, np.nan), np.full(located.S.shape, np.nan)
    step = float(np.median(np.diff(at))) if at.size > 1 else 1.0
    t = (at - at[:1]) / step if at.size else at
    jerk = usual_jerk(located.p, t)
    if not np.isfinite(jerk):
        return Expected(out, S)
    known = np.isfinite(located.p[..., 0])
    seen, wide = np.isfinite(b[..., 0]), with_bias(sd, bias_px)
    several = [(k, gap) for k in range(len(known)) for gap in _gaps(known[k]) if wanted[gap].any()]
    for k, gap in several[: SMOOTHING.most]:
        some = slice(max(0, gap.start - SMOOTHING.side), gap.stop + SMOOTHING.side)
        camera, moment = np.nonzero(seen[:, k, some] & ~known[k, some] & (seen[:, k, some].sum(axis=0) == 1))
        sights = Sights(moment, camera, b[camera, k, moment + some.start], wide[camera, k, moment + some.start])
        if np.count_nonzero(known[k, some]) >= SMOOTHING.known:
            p, cov = _smoothed(cameras, t[some], located.p[k, some], located.S[k, some], sights, jerk)
            inner = slice(gap.start - some.start, gap.stop - some.start)
            out[k, gap], S[k, gap] = p[inner], cov[inner]
    return Expected(out, S)


def usual_jerk(p: Array, t: Array) -> float:
    """Rms of the jerk of courses p (m, M, 3) at times t (M,), along one axis; NaN where it is not known."""
    s = SMOOTHING.apart
    four = [slice(i * s, t.size - (3 - i) * s) for i in range(4)]
    if t.size <= 3 * s:
        return float("nan")
    weights = _jerk_weights(np.stack([t[one] for one in four], axis=-1))
    jerk = sum(weights[:, i, None] * p[:, one] for i, one in enumerate(four))
    jerk = np.asarray(jerk)[np.isfinite(jerk)]
    return float(np.sqrt(np.mean(jerk**2))) if jerk.size >= 3 * SMOOTHING.fewest else float("nan")


def _jerk_weights(t: Array) -> Array:
    """Weights (..., 4) of places at times t (..., 4) in the third derivative of the cubic through them."""
    off = t[..., :, None] - t[..., None, :] + np.eye(4)
    return np.asarray(6 / off.prod(axis=-1))


def _gaps(known: Bools) -> Iterator[slice]:
    """The gaps of a course (M,): whole, or the beginning and the end of a long one."""
    edge = np.flatnonzero(np.diff((~known).astype(np.int8), prepend=0, append=0)).tolist()
    for i, j in zip(edge[::2], edge[1::2], strict=True):
        if j - i <= SMOOTHING.longest:
            yield slice(i, j)
        else:
            yield from (slice(i, i + SMOOTHING.longest // 2), slice(j - SMOOTHING.longest // 2, j))


def _smoothed(
    cameras: Sequence[Camera], t: Array, place: Array, S: Array, sights: Sights, jerk: float
) -> tuple[Array, Array]:
    """Places (n, 3) at times t (n,), and their covariances (n, 3, 3); place, S: where it was located, NaN elsewhere."""
    n = t.size
    known = np.flatnonzero(np.isfinite(place[:, 0]))
    A = np.zeros((n, 3, n, 3))
    right = np.zeros((n, 3))
    weight = np.linalg.inv(S[known])
    A[known, :, known] += weight
    right[known] = np.einsum("nij,nj->ni", weight, place[known])
    four = np.arange(max(n - 3, 0))[:, None] + np.arange(4)
    times = t[four]
    D = np.zeros((len(four), n))
    lasts = (times[:, 3] - times[:, 0]) / 3
    D[np.arange(len(four))[:, None], four] = (
        _jerk_weights(times) * np.sqrt(lasts / (OF_LASTING * SMOOTHING.lasting))[:, None] / jerk
    )
    for axis in range(3):
        A[:, axis, :, axis] += D.T @ D
    p = np.stack([np.interp(t, t[known], place[known, axis]) for axis in range(3)], axis=-1)
    for last in (False, True):
        for _ in range(SMOOTHING.rounds):
            whole, side = A.copy(), right.copy()
            for moment, H, b, sd in _lines(cameras, p, sights):
                side[moment] += np.einsum("nij,ni->nj", H, b / sd**2)
                whole[moment, :, moment] += np.einsum("nij,ni,nik->njk", H, 1 / sd**2, H)
            p = np.linalg.solve(whole.reshape(3 * n, 3 * n), side.ravel()).reshape(n, 3)
        off = _misses(cameras, p, sights)
        far = off > np.maximum(LEAST_PX, BEYOND * sights.sd.max(axis=-1))
        if last or not far.any():
            break
        sights = Sights(*(column[~far] for column in sights))
    inverse = np.linalg.inv(whole.reshape(3 * n, 3 * n)).reshape(n, 3, n, 3)
    i = np.arange(n)
    return p, np.asarray(inverse[i, :, i], float)


def _lines(cameras: Sequence[Camera], p: Array, sights: Sights) -> Iterator[tuple[Ints, Array, Array, Array]]:
    """Of each camera its moments (k,), how its picture follows places (k, 2, 3), what it is of them (k, 2) px, sd."""
    for i in np.unique(sights.camera).tolist():
        own = sights.camera == i
        moment = sights.moment[own]
        seen, H = linearised(cameras[i], p[moment])
        yield moment, H, sights.b[own] - seen + np.einsum("nij,nj->ni", H, p[moment]), sights.sd[own]


def _misses(cameras: Sequence[Camera], p: Array, sights: Sights) -> Array:
    """How far (k,), px, lines of sight are from places p (n, 3)."""
    out = np.zeros(sights.moment.size)
    for i in np.unique(sights.camera).tolist():
        own = sights.camera == i
        out[own] = np.linalg.norm(sights.b[own] - linearised(cameras[i], p[sights.moment[own]])[0], axis=-1)
    return out
