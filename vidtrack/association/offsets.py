"""By how many samples two cameras' recordings are apart, as far as their tracklets fit each other.

Each shift is worth what the best partner of every tracklet is worth: of a wrong one only coincidences fit. It is a
coarse answer, to a sample, from which clocks can be refined when it is known which tracklets show one target.
"""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.pairs import Side, pairs_of, rays_of
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
    first, second = (
        Side(camera, own, rays)
        for camera, own, rays in zip(cameras, tracklets, rays_of(cameras, [t.b for t in tracklets]), strict=True)
    )
    return np.array([_worth(first, second, int(shift), bias_px) for shift in shifts])


def _worth(one: Side, other: Side, shift: int, bias_px: float) -> float:
    moved = other._replace(tracklets=other.tracklets._replace(sample=other.tracklets.sample + shift))
    common = np.intersect1d(one.tracklets.sample, moved.tracklets.sample)
    if not common.size:
        return 0.0
    moments = common[np.linspace(0, common.size - 1, min(common.size, SOME)).round().astype(int)]
    found = pairs_of(one, moved, bias_px, np.unique(moments))
    best = np.zeros(one.tracklets.n)
    np.maximum.at(best, found.a, found.value)
    there = int(np.isin(one.tracklets.sample, moments).sum())
    return float(best.sum()) / max(there, 1)
