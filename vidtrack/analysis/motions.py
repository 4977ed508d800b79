"""Motions of a floating body as a wave laboratory names them: surge, sway, heave, roll, pitch, yaw at a named point.

A basin's axes are named, never assumed: surge lies along `waves`, heave along `up`, sway completes the right-handed set
(sway = heave x surge). Angles are those of the turn away from the body's attitude at rest, about these axes, yaw first,
then pitch, then roll (intrinsic z-y'-x''). The motion of a point that the body carries is

    p(t) = origin(t) + R(t) a

and a small error of the attitude moves it by the lever arm: its covariance is J C J^T with J = [-(R a)x, 1].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.analysis.interval import Estimate, own_scatter, t_factor
from vidtrack.arrays import Array
from vidtrack.motion.rigid import angles_by_turn, roll_pitch_yaw, unwrapped

AXES = {
    sign + name: (1.0 if sign == "+" else -1.0) * axis
    for name, axis in zip("xyz", np.eye(3), strict=True)
    for sign in "+-"
}
"""Directions by name: +x, -x, ..., -z in the world of the survey."""

SWINGS = -0.3
"""A record whose correlation falls below this swings: waves of any sea do (-0.4 to -1), noise does not."""


class Motions(NamedTuple):
    """Six degrees of freedom of one point of a body, about its place and attitude at rest.

    motion   (n, 6)  surge, sway, heave in world units; roll, pitch, yaw in degrees
    sigma    (n, 6)  their standard deviations
    rest     (3,)    world units, the point's place at rest, in world axes
    """

    motion: Array
    sigma: Array
    rest: Array


class Statistics(NamedTuple):
    """Of one degree of freedom, over the measured samples: units as given.

    mean has the interval of a correlated record; sd, min, max are of the samples, with half widths of 95 % intervals:
    of sd by the record's independent samples, of the extremes by their sigma; drift is the change of the mean from the
    first to the last quarter of the record, with its interval. sigma: the usual one of a sample, NaN where not given.
    """

    mean: Estimate
    sd: float
    least: float
    most: float
    drift: Estimate
    n: int
    sigma: float = float("nan")
    sd_half_width: float = float("nan")
    least_half_width: float = float("nan")
    most_half_width: float = float("nan")


def basin_axes(waves: str, up: str) -> Array:
    """Rows (3, 3): the world directions of surge, sway and heave.

    waves, up   one of +x, -x, +y, -y, +z, -z
    Raises ValueError where the two are not perpendicular.
    """
    surge, heave = AXES[waves], AXES[up]
    if surge @ heave != 0:
        raise ValueError(f"waves {waves} and up {up} lie on one line")
    return np.stack([surge, np.cross(heave, surge), heave])


def motions_at(
    origin: ArrayLike,
    R: ArrayLike,
    covariance: ArrayLike,
    point: ArrayLike,
    axes: Array,
    *,
    at_rest: ArrayLike | None = None,
) -> Motions:
    """The motions of a point of the body.

    origin      (n, 3)     world units; R (n, 3, 3) body to world; NaN where the pose is unknown
    covariance  (n, 6, 6)  of small turns about the world axes (rad) and of the origin
    point       (3,)       in the body's axes, world units
    axes        (3, 3)     see `basin_axes`
    at_rest     (n,)       samples in which the body was at rest; default: the mean over all of them
    """
    o, r, c = np.asarray(origin, float), np.asarray(R, float), np.asarray(covariance, float)
    arm = r @ np.asarray(point, float)
    known = np.isfinite(o).all(-1) & np.isfinite(r).all((-1, -2))
    rest = known if at_rest is None else known & np.asarray(at_rest, bool)
    if not rest.any():
        raise ValueError("the body's pose is known in no sample at rest")
    place = o + arm
    rest_place = place[rest].mean(axis=0)
    relative = axes @ r @ mean_rotation(r[rest]).T @ axes.T
    angles = roll_pitch_yaw(relative)
    J = np.zeros((len(o), 3, 6))
    x, y, z = arm[:, 0], arm[:, 1], arm[:, 2]
    J[:, 0, 1], J[:, 0, 2] = z, -y
    J[:, 1, 0], J[:, 1, 2] = -z, x
    J[:, 2, 0], J[:, 2, 1] = y, -x
    J[:, [0, 1, 2], [3, 4, 5]] = 1
    J = axes @ J
    turn = angles_by_turn(angles) @ axes
    shift_variance = np.einsum("nij,njk,nik->ni", J, c, J)
    turn_variance = np.einsum("nij,njk,nik->ni", turn, c[:, :3, :3], turn)
    motion = np.concatenate([(place - rest_place) @ axes.T, np.degrees(unwrapped(angles))], axis=1)
    sigma = np.concatenate([np.sqrt(shift_variance), np.degrees(np.sqrt(turn_variance))], axis=1)
    return Motions(motion, sigma, rest_place)


def before_motion(t: ArrayLike, motion: ArrayLike, sigma: ArrayLike, *, fewest: int = 15) -> Array:
    """The samples (n,) at the beginning in which a body rests: until one degree of freedom leaves what noise explains.

    t (n,) s; motion, sigma (n, 6) of `Motions`. No sample where fewer than `fewest` are at rest.
    """
    x, sd = np.asarray(motion, float), np.asarray(sigma, float)
    known = np.flatnonzero(np.isfinite(x).all(axis=1))
    if known.size < fewest + 1:
        return np.zeros(len(x), bool)
    hold = np.median(x[known[:fewest]], axis=0)
    scatter = np.maximum(np.nanmedian(sd, axis=0), 1.4826 * np.median(np.abs(np.diff(x[known], axis=0)), axis=0) / 2)
    away = (np.abs(x[known] - hold) > 6 * scatter).any(axis=1)
    end = int(np.argmax(away)) if away.any() else known.size
    at_rest: Array = np.zeros(len(x), bool)
    if end >= fewest and away.any():
        at_rest[known[: max(fewest, end - 1)]] = True
    return at_rest


def mean_rotation(R: Array) -> Array:
    """The rotation (3, 3) nearest to rotations (n, 3, 3) in the least-squares sense."""
    U, _, Vt = np.linalg.svd(R.mean(axis=0))
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def statistics(x: ArrayLike, sigma: ArrayLike | None = None) -> Statistics:
    """Mean, scatter, extremes and drift of a record (n,), sigma (n,) of its samples; NaN is left out."""
    values = np.asarray(x, float)
    sigmas = np.full(values.shape, np.nan) if sigma is None else np.asarray(sigma, float)
    good = np.isfinite(values)
    values, sigmas = values[good], sigmas[good]
    if values.size < 8:
        nothing = Estimate(float("nan"), float("nan"))
        return Statistics(nothing, float("nan"), float("nan"), float("nan"), nothing, int(values.size))
    sd, independent, period = float(values.std(ddof=1)), _independent(values), _period(values)
    sd_half_width = t_factor(independent - 1) * sd / float(np.sqrt(2 * max(1.0, independent - 1)))
    mean, quarter = _mean(values), values.size // 4
    if period:
        mean = _mean_of_cycles(values, period)
        sd_half_width = _mean_of_cycles((values - mean.value) ** 2, period).half_width / (2 * sd)
        quarter = period * max(1, round(quarter / period))
    first, last = values[:quarter], values[-quarter:]
    widths = [
        (_mean_of_cycles(values, period, quarter) if period else _mean(part)).half_width for part in (first, last)
    ]
    drift = Estimate(float(last.mean() - first.mean()), float(np.hypot(widths[0], widths[1])))
    known = sigmas[np.isfinite(sigmas)]
    return Statistics(
        mean,
        sd,
        float(values.min()),
        float(values.max()),
        drift,
        int(values.size),
        float(np.median(known)) if known.size else float("nan"),
        sd_half_width,
        1.96 * float(sigmas[np.argmin(values)]),
        1.96 * float(sigmas[np.argmax(values)]),
    )


def _mean(values: Array) -> Estimate:
    """The mean, with an interval that counts how long the record stays on one side of it."""
    n, own, independent = values.size, values - values.mean(), _independent(values)
    sd = float(np.sqrt(own @ own / max(1, n - 1)))
    return Estimate(float(values.mean()), t_factor(independent - 1) * sd / float(np.sqrt(independent)))


def _mean_of_cycles(values: Array, period: int, over: int | None = None) -> Estimate:
    """The mean of a record that swings, over all or `over` of its samples.

    Its halves of a cycle cancel: the variance is that of the spectrum at frequency 0, by Bartlett's weights over whole
    periods, about an eighth of the record; and what an unfinished cycle at its end may make.
    """
    n = values.size
    reach = period * max(1, n // (8 * period))
    own = values - values.mean()
    lags = _covariance(own)[1 : reach + 1] * (1 - np.arange(1, reach + 1) / (reach + 1))
    lasting = max(0.0, float(own @ own / n + 2 * lags.sum()))
    scatter = 1.96 * own_scatter(reach / n) * float(np.sqrt(lasting / (over or n)))
    unfinished = float(values.mean() - values[n % period :].mean())
    return Estimate(float(values.mean()), float(np.hypot(scatter, 0.0 if over else unfinished)))


def _period(values: Array) -> int | None:
    """The period, samples, of a record that swings: twice the lag at which it is most unlike itself; else None."""
    n = values.size
    covariance = _covariance(values - values.mean())[: n // 8 + 1]
    half = int(np.argmin(covariance))
    swings = half > 0 and covariance[half] < SWINGS * covariance[0] and half < n // 8
    return 2 * half if swings else None


def _covariance(own: Array) -> Array:
    """Of a record without its mean, (n,), by lag."""
    n = own.size
    size = 1 << (2 * n - 1).bit_length()
    covariance: Array = np.fft.irfft(np.abs(np.fft.rfft(own, size)) ** 2, size)[:n] / n
    return covariance


def _independent(values: Array) -> float:
    """How many independent samples a record is worth."""
    n = values.size
    own = values - values.mean()
    correlation = _covariance(own) * n / max(own @ own, 1e-300)
    pairs = correlation[1 : 2 * ((n - 1) // 2) + 1].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0)  # Geyer (1992): the sum over pairs of lags ends where it turns negative
    lasting = 1 + 2 * float(pairs[: negative[0] if negative.size else len(pairs)].sum())
    return max(2.0, n / max(1.0, lasting))


def watch_circle(motion: ArrayLike) -> tuple[float, Array]:
    """The largest horizontal distance from rest, and the convex hull (k, 2), of surge and sway (n, >= 2)."""
    from scipy.spatial import ConvexHull

    plane = np.asarray(motion, float)[:, :2]
    plane = plane[np.isfinite(plane).all(-1)]
    if len(plane) < 3 or np.linalg.matrix_rank(plane - plane.mean(axis=0)) < 2:
        return float(np.hypot(*plane.T).max(initial=0.0)), plane[:0]
    return float(np.hypot(*plane.T).max()), plane[ConvexHull(plane).vertices]
