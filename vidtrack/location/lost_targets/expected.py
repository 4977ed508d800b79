"""Where targets are expected in one camera's picture: by what the other cameras see, and by their motion over gaps.

Where two other cameras see a target, it is where they locate it. Where fewer do, its place is interpolated over the
gap by a polynomial; how well that goes is measured on stretches of the run that have no gap, and what one other camera
sees narrows it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.accepted import limits_of


@dataclass(frozen=True)
class Bridging:
    """How places are interpolated over gaps.

    side     moments on each side of a gap that the polynomial goes through; degrees: those that are tried
    longest  moments of a gap, at most; beyond: moments before the begin or after the end of a course
    fewest   stretches without a gap on which the error is measured, at least; most: at most
    unsure   times the usual sd of a place, from which on it says nothing of those beside it
    """

    side: int = 6
    degrees: tuple[int, ...] = (2, 3, 5, 7)
    longest: int = 20
    beyond: int = 4
    fewest: int = 20
    most: int = 400
    unsure: float = 8.0


BRIDGING = Bridging()
LEAST_PX, BEYOND = 1.0, 6.0
"""Px of a reprojection error, and sd, above which a camera is left out."""


class Expected(NamedTuple):
    """Places p (m, M, 3), world units, and covariance S (m, M, 3, 3); NaN where a target may be anywhere."""

    p: Array
    S: Array


class InPicture(NamedTuple):
    """Where a camera sees them: at (m, M, 2) px, and covariance (m, M, 2, 2) px^2."""

    at: Array
    S: Array


def expected(
    cameras: Sequence[Camera],
    b: Array,
    sd: Array,
    camera: int,
    bias_px: float,
    moments: Ints,
    bridged: Expected,
    smoothed: Expected | None = None,
) -> Expected:
    """Where targets are at some moments (k,) as far as the cameras but one say, (m, k).

    b, sd    (n_cameras, m, M, 2) px of all cameras; bias_px: what the calibration leaves, one standard deviation
    bridged  as `bridged_gaps` makes it; smoothed: as `smoothed_gaps`, where nothing else says it and the camera itself
             sees nothing
    """
    b, wide = b[:, :, moments], with_bias(sd[:, :, moments], bias_px)
    others = b.copy()
    others[camera] = np.nan
    limits = limits_of(wide, others, LEAST_PX, BEYOND)
    located = locate_points(cameras, others, sd=wide, reject=limits, most_unsure=np.inf)
    point, S = located.point.copy(), located.covariance.copy()
    p = bridged.p[:, moments]
    left = np.isnan(point[..., 0]) & np.isfinite(p[..., 0])
    point[left], S[left] = p[left], bridged.S[:, moments][left]
    for j, other in enumerate(cameras):
        seen = left & np.isfinite(others[j, ..., 0])
        if seen.any():
            point[seen], S[seen] = _narrowed(other, point[seen], S[seen], b[j][seen], wide[j][seen])
    if smoothed is not None:
        left = np.isnan(point[..., 0]) & np.isnan(b[camera, ..., 0])
        point[left], S[left] = smoothed.p[:, moments][left], smoothed.S[:, moments][left]
    return Expected(point, S)


def located_by_all(cameras: Sequence[Camera], b: Array, sd: Array, bias_px: float) -> Expected:
    """Where targets are (m, M) by all cameras; b, sd, bias_px as of `expected`."""
    wide = with_bias(sd, bias_px)
    found = locate_points(cameras, b, sd=wide, reject=limits_of(wide, b, LEAST_PX, BEYOND), most_unsure=np.inf)
    return Expected(found.point, found.covariance)


def with_bias(sd: Array, bias_px: float) -> Array:
    """Standard deviations with what the calibration leaves; where none is known it is 1 px."""
    return np.asarray(np.hypot(np.where(np.isfinite(sd), sd, 1.0), bias_px))


def in_picture(camera: Camera, where: Expected) -> InPicture:
    """What a camera should see of the places."""
    at, J = linearised(camera, where.p)
    return InPicture(at, J @ where.S @ np.swapaxes(J, -1, -2))


def bridged_gaps(located: Expected) -> Expected:
    """Places in the gaps of located courses (m, M), and shortly before their begin and after their end.

    A place that is known much less well than most counts as a gap: an interpolation that goes through it goes astray,
    by more than stretches without a gap say.
    """
    p, out, S = located.p, np.full(located.p.shape, np.nan), np.full(located.S.shape, np.nan)
    known = np.isfinite(p[..., 0])
    spread = np.sqrt(np.maximum(np.einsum("...ii->...", located.S), 0.0))
    if known.any():
        known &= spread < BRIDGING.unsure * float(np.median(spread[known]))
    gaps: dict[tuple[int, int, int], list[tuple[int, int]]] = {}
    for k in range(len(p)):
        for gap in _gaps(known[k]):
            gaps.setdefault(gap[1:], []).append((k, gap[0]))
    for (length, before, after), several in gaps.items():
        found = _interpolation(p, known, length, before, after)
        if found is None:
            continue
        weights, error = found
        for k, i in several:
            ends = np.r_[i - before : i, i + length : i + length + after]
            out[k, i : i + length] = weights @ p[k, ends]
            S[k, i : i + length] = error
    return Expected(out, S)


def _gaps(known: Bools) -> Iterator[tuple[int, int, int, int]]:
    """First moment and length of each gap of a course (M,) that is to be bridged, and how many moments before and after
    it are known and used.
    """
    edge = np.flatnonzero(np.diff(known.astype(np.int8), prepend=0, append=0)).tolist()
    stretches = list(zip(edge[::2], edge[1::2], strict=True))
    side = BRIDGING.side
    for (i, j), (k, m) in itertools.pairwise(stretches):
        if k - j <= BRIDGING.longest and min(j - i, m - k) >= side:
            yield j, k - j, side, side
    if stretches and stretches[0][1] - stretches[0][0] >= 2 * side:
        length = min(stretches[0][0], BRIDGING.beyond)
        yield stretches[0][0] - length, length, 0, 2 * side
    if stretches and stretches[-1][1] - stretches[-1][0] >= 2 * side:
        yield stretches[-1][1], min(len(known) - stretches[-1][1], BRIDGING.beyond), 2 * side, 0


def _interpolation(p: Array, known: Bools, length: int, before: int, after: int) -> tuple[Array, Array] | None:
    """Weights (length, before + after) of places beside a gap in those within it, and the covariance (length, 3, 3) of
    what that leaves, from stretches of the run without a gap; None where there are too few.
    """
    n = length + before + after
    if not length or known.shape[1] < n:
        return None
    count = np.cumsum(np.pad(known, ((0, 0), (1, 0))), axis=1)
    track, start = np.nonzero(count[:, n:] - count[:, :-n] == n)
    if start.size < BRIDGING.fewest:
        return None
    step = max(1, start.size // BRIDGING.most)
    x = p[track[::step, None], start[::step, None] + np.arange(n)]
    ends = np.r_[0:before, before + length : n]
    inner = slice(before, before + length)
    t = (np.arange(n) - (n - 1) / 2) / n
    best: tuple[Array, Array] | None = None
    for degree in BRIDGING.degrees:
        weights = np.vander(t[inner], degree + 1) @ np.linalg.pinv(np.vander(t[ends], degree + 1))
        off = x[:, inner] - weights @ x[:, ends]
        error = np.einsum("ski,skj->kij", off, off) / len(x)
        if best is None or np.trace(error.sum(0)) < np.trace(best[1].sum(0)):
            best = weights, error
    return best


def _narrowed(camera: Camera, p: Array, S: Array, b: Array, sd: Array) -> tuple[Array, Array]:
    """Places (n, 3) with covariance S (n, 3, 3), after a camera saw them at b (n, 2) px."""
    at, J = linearised(camera, p)
    own = J @ S @ np.swapaxes(J, -1, -2)
    own[:, [0, 1], [0, 1]] += sd**2
    gain = S @ np.swapaxes(J, -1, -2) @ np.linalg.inv(own)
    moved = p + np.einsum("nij,nj->ni", gain, b - at)
    return moved, S - gain @ J @ S


def linearised(camera: Camera, p: Array) -> tuple[Array, Array]:
    """Where a camera sees places (..., 3), px, and how that follows them (..., 2, 3)."""
    there = p[np.isfinite(p[..., 0])]
    step = 1e-5 * float(np.linalg.norm(there.mean(axis=0) - camera.position)) if there.size else 1.0
    at = project(camera, p)
    J = np.stack([(project(camera, p + step * e) - project(camera, p - step * e)) / (2 * step) for e in np.eye(3)], -1)
    return at, J


def moments_of(samples: Ints, times: Array, at: Array) -> Ints:
    """The moment (n,) of `at` (M,), s, that each of a camera's samples (n,) is nearest to; times (T,) s of them all."""
    t = times[samples]
    k = np.clip(np.searchsorted(at, t), 1, max(at.size - 1, 1))
    nearer = np.abs(at[k - 1] - t) <= np.abs(at[np.minimum(k, at.size - 1)] - t)
    return np.where(nearer, k - 1, np.minimum(k, at.size - 1))
