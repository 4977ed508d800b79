"""Cameras that show nothing where the others locate a target: a fix that they contradict, or a view that is blocked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import contains, project
from vidtrack.location.views import Seen, View


@dataclass(frozen=True)
class Limits:
    """Shares of the picture's diagonal.

    near   what the camera followed so near to the place may be the target, or hide it
    inside from the edge of the picture, at least, where a target is seen whole
    """

    near: float = 0.04
    inside: float = 0.03


LIMITS = Limits()


def unseen(view: View, seen: Seen, times: Array, at: Array, point: Array) -> Bools:
    """Where (m, M) one camera followed nothing near located targets that should be well inside its picture.

    times (T,) s: when the camera took its pictures; at (M,) s: moments; point (m, M, 3) in the world, NaN: not located
    """
    if not times.size:
        return np.zeros(point.shape[:2], bool)
    diagonal = float(np.hypot(*view.camera.image_size))
    with np.errstate(invalid="ignore"):
        place = project(view.camera, point)
        out = np.isfinite(place).all(-1) & contains(view.camera, place, LIMITS.inside * diagonal)
    gap = 1.5 * float(np.median(np.diff(times))) if times.size > 1 else 0.0
    nearest = np.abs(at - times[np.clip(np.searchsorted(times, at - gap), 0, times.size - 1)])
    out &= nearest <= gap
    for own in seen.b:
        with np.errstate(invalid="ignore"):
            out &= ~(np.linalg.norm(place - own, axis=-1) < LIMITS.near * diagonal)
    return np.asarray(out, bool)
