"""Cameras' clocks: how far each is off and how fast it runs, estimated from the motion itself.

Where cameras are not locked together (the thesis's half frame), a moving target is seen by one of them a little
later, and lies off its epipolar curve by its speed across that curve times the delay. The clock that brings the
whole trajectory nearest to the curves is the answer; targets at rest, or moving along the curves, contribute nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.timing.clock import RATE_PRIOR_PPM, Clock
from vidtrack.timing.resample import interval, resample

CENTROID_BIAS_PX = 0.005
"""ASSUME: of an epipolar distance, what does not average away along a track: pixel locking, uneven light."""


OFFSET_PRIOR_S = 100.0
"""ASSUME: s, so wide that it decides nothing where the motion contributes anything."""

ANY_RATE_PPM, SURELY = 20_000.0, 4.0
"""A rate is first sought without regard to what crystals do, within so many ppm; where it lies by more than so many
standard deviations beyond them (a converted recording, a counter that is no clock), it stays what the motion says."""


class Clocks(NamedTuple):
    """What `estimate_clocks` returns; cameras whose clocks are not sought keep the clock they came with."""

    clocks: tuple[Clock, ...]
    sd: tuple[Clock, ...]  # standard deviations; NaN where the motion gives no estimate, 0 where the clock was given
    covariance: Array  # (n_cameras, 2, 2) of offset and rate, s and ppm
    error_px: float  # rms distance from the epipolar curves with these clocks
    error_before_px: float  # and with those they came with
    offsets: Array  # (m,) s, offsets tried
    error_by_offset: Array  # (n_cameras, m) px, rms distance with the camera off by so much from its estimate
    ambiguous: tuple[bool, ...]  # another offset fits about as well (a periodic motion)


def estimate_clocks(
    cameras: Sequence[Camera],
    times: Sequence[ArrayLike],
    tracks: Sequence[ArrayLike],
    *,
    free: Sequence[int],
    clocks: Sequence[Clock] | None = None,
    max_offset_s: float | Sequence[float] = 1.0,
    rate: bool = True,
    bias_px: float = 0.0,
) -> Clocks:
    """Estimate the clocks of some cameras from the epipolar error along the trajectories.

    times          for each camera (T_c,)  s, rising
    tracks         for each camera (n_targets, T_c, 2)  px, the same targets in every camera; NaN where lost
    free           cameras whose clock is sought; at least one other camera has the right time
    clocks         those the cameras came with; default: none of them off
    max_offset_s   how far to search on either side; one for all cameras, or one each
    rate           whether rates are sought too, near 0 (RATE_PRIOR_PPM) unless the motion shows another beyond doubt
    bias_px        sd of the error that the calibration leaves in epipolar distances; it varies little along a
                   trajectory, and is fitted beside the clocks so as not to pass for a delay
    Raises ValueError when every camera is free or shapes do not match.
    """
    problem = _Problem(
        list(cameras),
        [np.asarray(t, float) for t in times],
        [np.asarray(b, float) for b in tracks],
        list(free),
        bias_px,
    )
    _check(problem)
    reach = np.broadcast_to(max_offset_s, len(cameras))
    start = list(clocks) if clocks is not None else [Clock()] * len(cameras)
    before = _rms(problem.distances(start))
    at = list(start)
    known = [c for c in range(len(at)) if c not in free]
    for camera in free:
        at[camera] = _searched(problem, at, camera, float(reach[camera]), known)
    at, covariance = _with_rates(problem, at) if rate else _refined(problem, at, {})
    sd = tuple(Clock(*np.sqrt(np.diag(c)).tolist()) for c in covariance)
    step = min(interval(t) for t in problem.times)
    offsets = np.linspace(-3, 3, 61) * step
    curves = np.full((len(at), offsets.size), np.nan)
    for camera in free:
        curves[camera] = [_rms(problem.distances(_moved(at, camera, s), camera)) for s in offsets]
    error = _rms(problem.distances(at))
    ambiguous = tuple(
        camera in free and _has_twin(problem, at, camera, float(reach[camera]), step) for camera in range(len(at))
    )
    return Clocks(tuple(at), sd, covariance, error, before, offsets, curves, ambiguous)


class _Distances(NamedTuple):
    d: Array  # (n_targets, T_a) px from the epipolar curve
    seen: Array  # (n_targets, T_a, 2) px, by camera b
    gain: Array  # (n_targets, T_a) of resampling


class _Problem(NamedTuple):
    cameras: list[Camera]
    times: list[Array]
    tracks: list[Array]
    free: list[int]
    bias_px: float

    def distances(self, clocks: Sequence[Clock], only: int | None = None) -> list[_Distances]:
        """Of every pair of cameras that a clock touches; b of a pair is resampled to the moments of a.

        only: the pairs of one camera.
        """
        t = [clock.corrected(times) for clock, times in zip(clocks, self.times, strict=True)]
        parts = []
        for a, b in combinations(range(len(t)), 2):
            if not {a, b} & set(self.free if only is None else [only]):
                continue
            seen = resample(t[b], self.tracks[b], t[a])
            d = epipolar_distance(self.cameras[a], self.cameras[b], self.tracks[a], seen.values)
            parts.append(_Distances(d, seen.values, seen.gain))
        return parts


def _check(problem: _Problem) -> None:
    n = len(problem.cameras)
    if len(problem.times) != n or len(problem.tracks) != n:
        raise ValueError(f"{n} cameras need as many times and tracks, not {len(problem.times)}, {len(problem.tracks)}")
    if any(b.shape[1:] != (t.size, 2) for t, b in zip(problem.times, problem.tracks, strict=True)):
        raise ValueError("tracks must be (n_targets, T, 2) with as many moments as the camera's times")
    if not set(problem.free) < set(range(n)):
        raise ValueError("at least one camera must keep its clock")


def _rms(parts: Sequence[_Distances]) -> float:
    d = np.concatenate([part.d.ravel() for part in parts]) if parts else np.zeros(0)
    d = d[np.isfinite(d)]
    return float(np.sqrt(np.mean(d * d))) if d.size else float("nan")


def _moved(clocks: Sequence[Clock], camera: int, offset_s: float, rate_ppm: float = 0.0) -> list[Clock]:
    out = list(clocks)
    out[camera] = Clock(out[camera].offset_s + offset_s, out[camera].rate_ppm + rate_ppm)
    return out


def _searched(problem: _Problem, at: Sequence[Clock], camera: int, reach: float, known: Sequence[int]) -> Clock:
    """The offset of least error against the cameras whose clock is known, tried in steps of half an interval."""
    some = [camera, *known]
    part = _Problem(
        [problem.cameras[c] for c in some],
        [problem.times[c] for c in some],
        [problem.tracks[c] for c in some],
        [0],
        0.0,
    )
    clocks = [at[c] for c in some]
    step = min(interval(t) for t in part.times) / 2
    offsets = step * np.arange(-np.ceil(reach / step), np.ceil(reach / step) + 1)
    errors = np.array([_explained(part.distances(_moved(clocks, 0, s))) for s in offsets])
    if not np.isfinite(errors).any():
        return at[camera]
    return _moved(clocks, 0, float(offsets[np.nanargmin(errors)]))[0]


def _explained(parts: Sequence[_Distances]) -> float:
    """Rms distance, px, with a penalty for moments lost by moving tracks apart; NaN with almost nothing in common."""
    n = sum(int(np.isfinite(part.d).sum()) for part in parts)
    whole = sum(part.d.size for part in parts)
    return _rms(parts) / np.sqrt(n / whole) if n > max(5, 0.2 * whole) else float("nan")


def _has_twin(problem: _Problem, at: Sequence[Clock], camera: int, reach: float, step: float) -> bool:
    """Whether some offset outside the neighbourhood of the estimate fits within twice the error."""
    offsets = np.arange(-reach, reach + step, step)
    errors = np.array([_explained(problem.distances(_moved(at, camera, float(s)), camera)) for s in offsets])
    best = _explained(problem.distances(at, camera))
    low = errors <= 2 * best
    # the valley around the estimate itself does not count
    middle = int(np.argmin(np.abs(offsets)))
    left, right = middle, middle
    while left > 0 and errors[left - 1] >= errors[left]:
        left -= 1
    while right < offsets.size - 1 and errors[right + 1] >= errors[right]:
        right += 1
    return bool(low[:left].any() or low[right + 1 :].any())


def _with_rates(problem: _Problem, at: list[Clock]) -> tuple[list[Clock], Array]:
    """Clocks and covariances, with rates of which crystals are capable or that are beyond doubt."""
    by_motion, covariance = _refined(problem, at, dict.fromkeys(problem.free, ANY_RATE_PPM))
    sure = [
        camera
        for camera in problem.free
        if abs(by_motion[camera].rate_ppm) > SURELY * np.hypot(np.sqrt(covariance[camera, 1, 1]), RATE_PRIOR_PPM)
    ]
    begin = [by_motion[camera] if camera in sure else clock for camera, clock in enumerate(at)]
    return _refined(problem, begin, {c: ANY_RATE_PPM if c in sure else RATE_PRIOR_PPM for c in problem.free})


def _refined(problem: _Problem, at: list[Clock], rates: Mapping[int, float]) -> tuple[list[Clock], Array]:
    """Gauss-Newton on all distances together, from clocks within a fraction of an interval: clocks and covariances.

    rates   camera: the deviation, ppm, that its rate is supposed to have; without it only offsets are sought
    """
    names = [(camera, what) for camera in problem.free for what in ("offset_s", *["rate_ppm"] * (camera in rates))]
    step = min(interval(t) for t in problem.times)
    length = max(float(np.ptp(t)) for t in problem.times)
    # a whole interval to either side: samples that the distance itself does not rest on, so that their noise in the
    # slope is not its own
    unit = {"offset_s": step, "rate_ppm": step / length * 1e6}
    covariance = np.full((len(names), len(names)), np.nan)
    for _ in range(20):
        parts = problem.distances(at)
        d = np.concatenate([part.d.ravel() for part in parts])
        J = np.stack([_slope(problem, at, camera, what, unit[what]) for camera, what in names], -1)
        good = np.isfinite(d) & np.isfinite(J).all(-1)
        # ASSUME: a distance beyond four times the usual one is a bad centroid, not a delay
        usual = 1.4826 * float(np.median(np.abs(d[good]))) if good.any() else 0.0
        good &= np.abs(d) <= 4 * max(usual, 1e-9)
        if good.sum() < 3 * len(names):
            break
        nuisance = _smooth_errors(parts)[good] if problem.bias_px > 0 else np.zeros((int(good.sum()), 0))
        move, covariance = _step(problem, names, rates, at, J[good], nuisance, d[good])
        covariance = covariance * _doubt(parts, J[good], d[good], step) + _lasting(names, J[good], length)
        limits = np.array([(0.5 if what == "offset_s" else 25.0) * unit[what] for _, what in names])
        for (camera, what), value in zip(names, np.clip(move, -limits, limits), strict=True):
            at = _moved(at, camera, **_by(what, float(value)))
        if (np.abs(move) < 0.01 * np.sqrt(np.diag(covariance))).all():
            break
    return at, _by_camera(names, covariance, len(at))


def _slope(problem: _Problem, at: Sequence[Clock], camera: int, what: str, unit: float) -> Array:
    """How the distances (n,) change with one number of one clock, px per its unit."""
    ahead, behind = (problem.distances(_moved(at, camera, **_by(what, sign * unit))) for sign in (1, -1))
    return np.concatenate([(a.d - b.d).ravel() for a, b in zip(ahead, behind, strict=True)]) / (2 * unit)


def _step(
    problem: _Problem,
    names: Sequence[tuple[int, str]],
    rates: Mapping[int, float],
    at: Sequence[Clock],
    J: Array,
    nuisance: Array,
    d: Array,
) -> tuple[Array, Array]:
    """The Gauss-Newton step of the clocks, with priors on rates and on what the calibration leaves; its covariance."""
    A = np.concatenate([J, nuisance], -1)
    tight = np.array([(rates[camera] if what == "rate_ppm" else OFFSET_PRIOR_S) ** -2.0 for camera, what in names])
    now = np.array([getattr(at[camera], what) for camera, what in names])
    prior = np.concatenate([tight, np.full(nuisance.shape[1], 1 / max(problem.bias_px, 1e-9) ** 2)])
    pull = np.concatenate([-tight * now * [what == "rate_ppm" for _, what in names], np.zeros(nuisance.shape[1])])
    size = np.sqrt((A * A).sum(0) + prior)  # a clock of which the distances say nothing rests on its prior alone
    noise2 = float(np.mean(d * d))
    for _ in range(3):  # the noise and the step follow from each other
        H = (A.T @ A / noise2 + np.diag(prior)) / size / size[:, None]
        move = np.linalg.solve(H, (pull - A.T @ d / noise2) / size) / size
        noise2 = max(float(np.sum((d + A @ move) ** 2)) / max(d.size - A.shape[1], 1), 1e-12)
    n = len(names)
    return move[:n], (np.linalg.inv(H) / size / size[:, None])[:n, :n]


def _doubt(parts: Sequence[_Distances], J: Array, d: Array, step: float) -> float:
    """By how much the variance is larger than that of a fit to white noise with exact slopes.

    Resampled noise is smaller than the samples' own but no longer white: over many samples it counts in full.
    And the noise of centroids makes slopes where nothing moves: 1/(4 step^2) of the distances' variance.
    """
    gain2 = float(np.nanmean(np.concatenate([part.gain.ravel() for part in parts]) ** 2))
    steep = float(np.sum(J**2, 0).max())
    if not steep > 0:
        return 1.0
    chance = float(np.sum(d * d)) / (4 * step**2)
    return 2 / (1 + gain2) * steep / max(steep - chance, 0.01 * steep)


def _lasting(names: Sequence[tuple[int, str]], J: Array, length: float) -> Array:
    """Covariance of the clocks from errors of CENTROID_BIAS_PX that go with the motion, one way or its opposite.

    They pass for a delay, and for as large a change of it between the halves of the run.
    """
    out = np.zeros((len(names), len(names)))
    for i, (camera, what) in enumerate(names):
        if what == "offset_s":
            late2 = CENTROID_BIAS_PX**2 / max(float(np.mean(J[:, i] ** 2)), 1e-12)
            out[i, i] = late2
            if (camera, "rate_ppm") in names:
                k = names.index((camera, "rate_ppm"))
                slope2 = 12 * late2 / length**2 * 1e12
                out[i, i] += slope2 * (length * 1e-6 / 2) ** 2
                out[k, k] = slope2
                out[i, k] = out[k, i] = -slope2 * length * 1e-6 / 2
    return out


def _smooth_errors(parts: Sequence[_Distances]) -> Array:
    """For each pair of cameras three columns (n, 3 n_pairs) that a calibration error may follow: 1, Xf and Yf."""
    columns = np.zeros((sum(part.d.size for part in parts), 3 * len(parts)))
    start = 0
    for k, part in enumerate(parts):
        stop = start + part.d.size
        seen = part.seen.reshape(-1, 2)
        middle = np.nanmean(seen, 0) if np.isfinite(seen).any() else 0.0
        columns[start:stop, 3 * k] = 1
        columns[start:stop, 3 * k + 1 : 3 * k + 3] = (seen - middle) / max(
            np.nanmax(np.abs(seen - middle), initial=1), 1
        )
        start = stop
    return columns


def _by(which: str, value: float) -> dict[str, float]:
    return {"offset_s": value} if which == "offset_s" else {"offset_s": 0.0, "rate_ppm": value}


def _by_camera(names: Sequence[tuple[int, str]], covariance: Array, n_cameras: int) -> Array:
    """Each camera's own part (n_cameras, 2, 2) of the covariance; 0 for what was not sought."""
    out = np.zeros((n_cameras, 2, 2))
    for i, (camera, which) in enumerate(names):
        for j, (other, what) in enumerate(names):
            if camera == other:
                out[camera, int(which == "rate_ppm"), int(what == "rate_ppm")] = covariance[i, j]
    return out
