"""What a track was at moments between its samples, without ever bridging a gap.

A cubic through four neighbouring samples (Lagrange): centred where it can be, one-sided beside a gap or an end, a
parabola where only three samples have no gap between them. Beyond that there is no answer. At 30 samples a second a
swing of 24 in and 1.6 s is off by 0.0002 in midway between samples; a straight line would be off by 0.05 in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array

WINDOWS = ((-1, 4), (0, 4), (-2, 4), (-1, 3), (0, 3))
"""First sample, counted from the last one not later than the moment, and number of samples; best first."""

COINCIDE = 1e-3
"""Of a sampling interval: moments nearer than this are one (33 us at 30 Hz)."""


class Resampled(NamedTuple):
    """What `resample` returns."""

    values: Array  # (..., m, k); NaN where the samples around the moment have a gap
    gain: Array  # (..., m) how many times the samples' standard deviation the values have
    before: NDArray[np.intp]  # (m,) index of the last sample not later than the moment, -1 for none
    after: NDArray[np.intp]  # (m,) of the first not earlier; T for none; equal to before where they coincide


def interval(t: ArrayLike) -> float:
    """The usual time between samples (n,), s: the median; NaN for fewer than two."""
    t = np.asarray(t, float)
    return float(np.median(np.diff(t))) if t.size > 1 else float("nan")


def exposures_begun(middle: ArrayLike) -> Array:
    """When each exposure began, s, from its middle (n,), if the shutter was open from picture to picture."""
    middle = np.asarray(middle, float)
    return middle - 0.5 * interval(middle)


def resample(t: ArrayLike, x: ArrayLike, at: ArrayLike) -> Resampled:
    """Values of tracks at other moments.

    t    (T,)         s, rising, not necessarily even
    x    (..., T, k)  samples; NaN where lost
    at   (m,)         s
    A moment that coincides with a sample gets that sample as it is. Samples more than 1.5 intervals apart have
    a gap between them; there is no value before the first or after the last sample.
    Raises ValueError for shapes that do not match or times that do not rise.
    """
    t, x, at = np.asarray(t, float), np.asarray(x, float), np.asarray(at, float)
    if t.ndim != 1 or at.ndim != 1 or x.ndim < 2 or x.shape[-2] != t.size:
        raise ValueError(f"times and samples must be (T,), (..., T, k) and (m,), not {t.shape}, {x.shape}, {at.shape}")
    if not (np.diff(t) > 0).all():
        raise ValueError("times must rise")
    values = np.full((*x.shape[:-2], at.size, x.shape[-1]), np.nan)
    gain = np.full(values.shape[:-1], np.nan)
    if not t.size:
        nothing = np.full(at.size, -1)
        return Resampled(values, gain, nothing, nothing + 1)
    step = interval(t) if t.size > 1 else 1.0
    nearest = np.clip(np.searchsorted((t[1:] + t[:-1]) / 2, at), 0, t.size - 1)
    same = np.abs(t[nearest] - at) <= COINCIDE * step
    before = np.where(same, nearest, np.searchsorted(t, at, "right") - 1)
    after = np.where(same, nearest, before + 1)

    valid = np.isfinite(x).all(-1)
    linked = valid[..., :-1] & valid[..., 1:] & (np.diff(t) < 1.5 * step)
    todo = np.broadcast_to(~same & (before >= 0) & (after < t.size), gain.shape).copy()
    for first, count in WINDOWS:
        start = before + first
        some = np.flatnonzero(todo.any(tuple(range(todo.ndim - 1))) & (start >= 0) & (start + count <= t.size))
        window = start[some][:, None] + np.arange(count)
        whole = todo[..., some] & linked[..., window[:, :-1]].all(-1)
        w = _lagrange((t[window] - at[some, None]) / step)
        answer = np.einsum("mc,...mck->...mk", w, x[..., window, :])
        values[..., some, :] = np.where(whole[..., None], answer, values[..., some, :])
        gain[..., some] = np.where(whole, np.sqrt((w * w).sum(-1)), gain[..., some])
        todo[..., some] &= ~whole
    values[..., same, :] = x[..., nearest[same], :]
    gain[..., same] = np.where(valid[..., nearest[same]], 1.0, np.nan)
    return Resampled(values, gain, before, after)


def _lagrange(nodes: Array) -> Array:
    """Weights (m, c) that give the value at 0 of the polynomial through values at nodes (m, c)."""
    count = nodes.shape[-1]
    w = np.ones_like(nodes)
    with np.errstate(divide="ignore", invalid="ignore"):
        for i in range(count):
            for j in range(count):
                if i != j:
                    w[:, i] *= nodes[:, j] / (nodes[:, j] - nodes[:, i])
    return w


def common_times(times: Sequence[ArrayLike]) -> tuple[Array, NDArray[np.intp]]:
    """The moments (m,), s, rising, to which several cameras' samples are brought, and whose moments they are (m,).

    They are those of the camera with most samples; where it has none within 3/4 of an interval, of the next one.
    """
    t = [np.asarray(each, float) for each in times]
    at, whose = np.zeros(0), np.zeros(0, np.intp)
    for camera in sorted(range(len(t)), key=lambda c: -t[c].size):
        own = t[camera]
        if at.size:
            step = interval(own) if own.size > 1 else interval(at)
            after = np.clip(np.searchsorted(at, own), 1, max(at.size - 1, 1))
            near = np.minimum(np.abs(own - at[after - 1]), np.abs(own - at[np.minimum(after, at.size - 1)]))
            own = own[near >= (0.75 * step if np.isfinite(step) else 1e-6)]  # stills have no interval
        at, whose = np.concatenate([at, own]), np.concatenate([whose, np.full(own.size, camera)])
        order = np.argsort(at, kind="stable")
        at, whose = at[order], whose[order]
    return at, whose
