"""Cameras that show nothing where the others locate a target: a fix that they contradict, or a view that is blocked.

And how often each camera measured what it should have seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import contains, project
from vidtrack.location.cameras.views import Seen, View


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
    place, out = _in_view(view, times, at, point)
    diagonal = float(np.hypot(*view.camera.image_size))
    for own in seen.b:
        with np.errstate(invalid="ignore"):
            out &= ~(np.linalg.norm(place - own, axis=-1) < LIMITS.near * diagonal)
    return np.asarray(out, bool)


def shares_seen(
    views: Sequence[View],
    times: Sequence[Array],
    at: Array,
    point: Array,
    b: Array,
    again: Array,
    labels: Sequence[str],
) -> dict[str, Any]:
    """Of each camera and target: samples in which it lies well inside the picture, and how many of them are measured.

    b (n_cameras, m, M, 2) px: what the tracks show; again: the same with what was sought again; NaN: nothing
    """
    inside = [_in_view(view, t, at, point)[1] for view, t in zip(views, times, strict=True)]
    found, with_sought = (np.isfinite(own[..., 0]) for own in (b, again))
    return {
        view.name: {
            label: {
                "inside": int(inside[i][k].sum()),
                "tracked": int((inside[i][k] & found[i, k]).sum()),
                "sought": int((inside[i][k] & with_sought[i, k] & ~found[i, k]).sum()),
            }
            for k, label in enumerate(labels)
        }
        for i, view in enumerate(views)
    }


def _in_view(view: View, times: Array, at: Array, point: Array) -> tuple[Array, Bools]:
    """Where located targets lie in a camera's picture (m, M, 2) px, and where that is well inside while it records."""
    if not times.size:
        return np.full((*point.shape[:2], 2), np.nan), np.zeros(point.shape[:2], bool)
    diagonal = float(np.hypot(*view.camera.image_size))
    with np.errstate(invalid="ignore"):
        place = project(view.camera, point)
        out = np.isfinite(place).all(-1) & contains(view.camera, place, LIMITS.inside * diagonal)
    gap = 1.5 * float(np.median(np.diff(times))) if times.size > 1 else 0.0
    nearest = np.abs(at - times[np.clip(np.searchsorted(times, at - gap), 0, times.size - 1)])
    return place, np.asarray(out & (nearest <= gap))
