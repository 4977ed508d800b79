"""Roughly by how much two cameras' clocks differ, where no time code says so: recordings that were started by hand.

Every offset is tried at which the recordings overlap, with the other camera's nearest sample, at a hundred moments. The
offset at which tracks lie nearest to each other's epipolar lines is good to a sampling interval.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.timing.resample import interval

MOMENTS, TRACKS = 100, 4
"""Moments and tracks of each camera that are tried; those with most samples."""
CLIP_PX = 20.0
"""Distances beyond it say no more than that the tracks differ."""
SHARE = 0.3
"""Of the moments, those that an offset must leave in common."""
CLEARLY = 0.5
"""Another offset than none must leave this share of the distance."""
TWIN = 1.5
"""Times the least distance within which another offset is as likely."""


class Rough(NamedTuple):
    """offset_s to be added to camera b's time; twins: other offsets that do about as well; px: the mean distance, and
    without any offset."""

    offset_s: float
    twins: tuple[float, ...]
    px: float
    px_without: float = float("nan")


def rough_offset(a: Camera, t_a: Array, b_a: Array, b: Camera, t_b: Array, b_b: Array, reach_s: float) -> Rough:
    """The offset of camera b's clock from that of a.

    t_a (T,), t_b (U,)  s;  b_a (n, T, 2), b_b (m, U, 2)  px, tracks that need not be in one order; NaN where lost
    reach_s             s, the largest offset that is tried
    """
    b_a, b_b = _fullest(b_a), _fullest(b_b)
    seen = np.flatnonzero(np.isfinite(b_a[..., 0]).any(0))
    if seen.size < MOMENTS // 10 or not np.isfinite(b_b).any():
        return Rough(0.0, (), float("nan"))
    moments = np.unique(seen[np.linspace(0, seen.size - 1, min(seen.size, MOMENTS)).round().astype(int)])
    step = min(interval(t_a), interval(t_b))
    offsets = step * np.arange(-np.floor(reach_s / step), np.floor(reach_s / step) + 1)
    px = np.array([_distance(a, b_a[:, moments], b, b_b, _nearest(t_b, t_a[moments] - s)) for s in offsets])
    if not np.isfinite(px).any():
        return Rough(0.0, (), float("nan"))
    best = int(np.nanargmin(px))
    none = int(np.argmin(np.abs(offsets)))
    if not px[best] < CLEARLY * px[none]:
        best = best if np.isnan(px[none]) else none
    far = (np.abs(offsets - offsets[best]) > 1.0) & (px <= TWIN * px[best])
    inner = np.r_[False, (px[1:-1] <= px[:-2]) & (px[1:-1] <= px[2:]), False]
    return Rough(float(offsets[best]), tuple(offsets[far & inner].tolist()), float(px[best]), float(px[none]))


def _fullest(tracks: Array) -> Array:
    order = np.argsort(-np.isfinite(tracks[..., 0]).sum(1), kind="stable")
    return np.asarray(tracks[order[:TRACKS]])


def _nearest(t: Array, at: Array) -> Array:
    """Index (m,) of the sample nearest to each moment; -1 beyond the record."""
    after = np.clip(np.searchsorted(t, at), 1, t.size - 1)
    index = np.where(at - t[after - 1] < t[after] - at, after - 1, after)
    return np.asarray(np.where((at < t[0]) | (at > t[-1]), -1, index))


def _distance(a: Camera, b_a: Array, b: Camera, b_b: Array, index: Array) -> float:
    """Mean distance, px, of each track of a from the epipolar lines of the track of b that is nearest to it."""
    inside = index >= 0
    if inside.sum() < SHARE * index.size:
        return float("nan")
    A, B = b_a[:, None, inside], b_b[None][:, :, index[inside]]
    d = np.minimum(np.maximum(np.abs(epipolar_distance(a, b, A, B)), np.abs(epipolar_distance(b, a, B, A))), CLIP_PX)
    n = np.isfinite(d).sum(-1)
    mean = np.where(n >= SHARE * index.size, np.nansum(d, -1) / np.maximum(n, 1), np.inf).min(1)
    mean = mean[np.isfinite(mean)]
    return float(mean.mean()) if mean.size else float("nan")
