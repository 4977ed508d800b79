"""Velocity and acceleration of a target along each axis of the world, with their uncertainty.

Smoothing does the work (see `smoothing`); finite differences, with which the thesis's tracks were turned into
velocities (its section 5.3, after Katzev 1991), are kept as a reference to compare with.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.motion.smoothing import smooth

EDGE = 2.0
"""A sample whose acceleration is this many times less sure than the record's median lies at an edge."""


class Motion(NamedTuple):
    """Motion at the sample times; NaN where a sample was missing. k axes.

    position, velocity, acceleration   (n, k)  world units, world/s, world/s^2
    sigma                              (n, k, 3)  their standard deviations
    edge, outlier, short               (n,)  near a piece's end; contradicted by its neighbours; piece too short
    noise_sd, noise_ratio, spacing_s   (k,)  see `smoothing.Smooth`
    """

    position: Array
    velocity: Array
    acceleration: Array
    sigma: Array
    edge: NDArray[np.bool_]
    outlier: NDArray[np.bool_]
    short: NDArray[np.bool_]
    noise_sd: Array
    noise_ratio: Array
    spacing_s: Array


def motion(t: ArrayLike, p: ArrayLike, sigma: ArrayLike | None = None, *, noise: str = "estimated") -> Motion:
    """Smoothed motion along every axis, each with the knots that its own noise asks for.

    t      (n,)    s, rising
    p      (n, k)  world units; NaN where missing. An axis that is NaN throughout stays so (z in mode plane)
    sigma  (n, k)  world units, or None; noise: see `smoothing.smooth`
    """
    places: Array = np.asarray(p, float)
    n, axes = places.shape
    state, sd = np.full((2, n, axes, 3), np.nan)
    outlier, used = np.zeros(n, bool), np.zeros(n, bool)
    scales = np.full((3, axes), np.nan)
    for k in range(axes):
        if not np.isfinite(places[:, k]).any():
            continue
        known = sigma is not None and np.isfinite(np.asarray(sigma, float)[:, k]).any()
        smoothed = smooth(t, places[:, k], np.asarray(sigma, float)[:, k] if known else None, noise=noise, impacts=True)
        state[:, k], sd[:, k] = smoothed.state, smoothed.sd
        outlier |= smoothed.outlier
        used |= smoothed.piece >= 0
        scales[:, k] = smoothed.noise_sd, smoothed.noise_ratio, smoothed.spacing_s
    with np.errstate(invalid="ignore"):
        relative = sd[..., 2] / _median(sd[..., 2])
    edge = np.asarray((np.nan_to_num(relative) > EDGE).any(-1))
    short = np.isfinite(places).any(-1) & ~used
    return Motion(state[..., 0], state[..., 1], state[..., 2], sd, edge, outlier, short, *scales)


def _median(sd: Array) -> Array:
    """Of every column, NaN left out; NaN for a column of nothing else."""
    return np.array([np.median(c[np.isfinite(c)]) if np.isfinite(c).any() else np.nan for c in sd.T])


def finite_differences(t: ArrayLike, p: ArrayLike) -> tuple[Array, Array]:
    """Velocity and acceleration (n, k) by central differences of neighbouring samples, which may be unevenly spaced.

    t (n,) s; p (n, k) world units. NaN at both ends and beside a missing sample.
    On paper: p = t^2 gives v = 2 t, a = 2, whatever the spacing.
    """
    time: Array = np.asarray(t, float)[:, None]
    places: Array = np.asarray(p, float)
    velocity, acceleration = np.full((2, *places.shape), np.nan)
    before, after = time[1:-1] - time[:-2], time[2:] - time[1:-1]
    first, second = (places[1:-1] - places[:-2]) / before, (places[2:] - places[1:-1]) / after
    velocity[1:-1] = (first * after + second * before) / (before + after)
    acceleration[1:-1] = 2 * (second - first) / (before + after)
    return velocity, acceleration
