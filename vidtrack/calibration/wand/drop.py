"""A ball that is dropped: it shows the cameras, in their own axes, which way is down and how long a metre is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.wand.axes import Fall, falling
from vidtrack.calibration.wand.refined import Refined
from vidtrack.calibration.wand.tracks import Timed
from vidtrack.geometry.triangulate import locate_points
from vidtrack.timing.resample import resample


class DropSettings(NamedTuple):
    """How a fall is located."""

    sd: float = 0.2
    """px, of the centroid of a ball that falls: exposure smears it."""
    fewest: int = 6
    """Samples that a camera must have."""
    reach: int = 50
    """Half frames over which the shift of an unknown clock is sought."""


SETTINGS = DropSettings()


def dropped(done: Refined, timed: Timed, tracks: Mapping[int, tuple[Array, Array]]) -> Fall:
    """The fall of a ball of which cameras have tracks: t (T,) s and b (T, 2) px, by the camera's number.

    Cameras whose clocks are unknown may have been started at other moments than for the wand: their shift is the one by
    which they see the ball on the other cameras' lines of sight.
    Raises ValueError where the ball is followed in no camera, or does not fall.
    """
    long = [i for i, (t, _) in tracks.items() if len(t) > SETTINGS.fewest]
    if not long:
        raise ValueError("the ball is followed in no camera")
    first = timed.reference if timed.reference in long else long[0]
    at = tracks[first][0]
    b = np.full((len(done.cameras), len(at), 2), np.nan)
    for i in sorted(long, key=lambda i: i != first):
        t, seen = tracks[i]
        shift = _shift(done, timed, b, i, t, seen, at) if i in timed.late and i != first else 0.0
        b[i] = resample(t + shift, seen, at).values
    located = locate_points(done.cameras, b, sd=SETTINGS.sd)
    return falling(at, located.point, np.sqrt(np.einsum("naa->na", located.covariance)))


def _shift(done: Refined, timed: Timed, b: Array, i: int, t: Array, seen: Array, at: Array) -> float:
    step = float(np.median(np.diff(t)))

    def miss(shift: float) -> float:
        trial = b.copy()
        trial[i] = resample(t + shift, seen, at).values
        off = locate_points(done.cameras, trial, sd=SETTINGS.sd).miss
        off = off[np.isfinite(off)]
        return float(np.median(off)) if len(off) > SETTINGS.fewest else np.inf

    centres = 0.0, float(timed.shift[i] + done.clocks[i])
    tried = [c + k * step / 2 for c in centres for k in range(-SETTINGS.reach, SETTINGS.reach + 1)]
    best = min(tried, key=miss)
    for width in (step / 4, step / 16, step / 64):
        best = min((best + k * width for k in range(-3, 4)), key=miss)
    return best
