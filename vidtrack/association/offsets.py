"""By how many samples two cameras' recordings are apart, as far as their tracklets fit each other.

Each shift is worth what the best partner of every tracklet is worth: of a wrong one only coincidences fit. It is a
coarse answer, to a sample, from which clocks can be refined when it is known which tracklets show one target.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.pairs import Rays, pairs_of, rays_of
from vidtrack.association.tracklets import Tracklets
from vidtrack.geometry.camera import Camera

SOME = 120
"""Moments, evenly spread, at which a shift is tried."""


def shift_worths(
    cameras: tuple[Camera, Camera], tracklets: tuple[Tracklets, Tracklets], shifts: Ints, bias_px: float
) -> Array:
    """What each shift (n,) of the second camera's samples, added to their moments, is worth, (n,) nats a miss.

    bias_px   what half a sample's motion and the calibration may leave, px, one standard deviation
    """
    first, second = rays_of(cameras, [t.b for t in tracklets])
    rays = (first, second)
    return np.array([_worth(cameras, tracklets, rays, int(shift), bias_px) for shift in shifts])


def _worth(
    cameras: tuple[Camera, Camera],
    tracklets: tuple[Tracklets, Tracklets],
    rays: tuple[Rays, Rays],
    shift: int,
    bias_px: float,
) -> float:
    one, other = tracklets
    moved = other._replace(sample=other.sample + shift)
    common = np.intersect1d(one.sample, moved.sample)
    if not common.size:
        return 0.0
    moments = common[np.linspace(0, common.size - 1, min(common.size, SOME)).round().astype(int)]
    found = pairs_of(cameras, (one, moved), rays, bias_px, np.unique(moments))
    best = np.zeros(one.n)
    np.maximum.at(best, found.a, found.value)
    there = int(np.isin(one.sample, moments).sum())
    return float(best.sum()) / max(there, 1)
