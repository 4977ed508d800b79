"""What each camera of a run saw, as arrays, and brought to moments that all cameras share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.location.correspondence import NONE, Indices
from vidtrack.timing.resample import resample

Labels = NDArray[np.object_]


class View(NamedTuple):
    """One camera's centroids: n tracks at T moments."""

    name: str
    camera: Camera
    uncertainty: CameraUncertainty | None
    t: Array  # (T,) s, by the camera's own clock
    timecode: Labels  # (T,)
    tracks: list[str]
    b: Array  # (n, T, 2) px
    sd: Array  # (n, T, 2) px; 1 where nobody knows
    flag: Labels  # (n, T)
    has_sd: bool


def same_day(views: Sequence[View]) -> list[View]:
    """The views, those whose time code has passed midnight brought to the first one's day."""
    first = next((float(v.t[0]) for v in views if v.t.size), 0.0)
    days = [round((first - float(v.t[0])) / 86400.0) if v.t.size else 0 for v in views]
    return [v._replace(t=v.t + 86400.0 * day) for v, day in zip(views, days, strict=True)]


class Seen(NamedTuple):
    """A camera's tracks at M moments."""

    b: Array  # (n, M, 2) px
    sd: Array  # (n, M, 2)
    flag: Labels  # (n, M)
    between: bool  # whether any moment lies between samples


def brought(view: View, t: Array, at: Array) -> Seen:
    """What a camera saw at the moments `at` (M,), s, its own moments being truly t (T,).

    A sample brought to another moment has the noise that its neighbours leave it, and the flags of both of them.
    """
    moved = resample(t, view.b, at)
    if not view.t.size:
        return Seen(moved.values, np.full(moved.values.shape, np.nan), np.full(moved.gain.shape, "", object), False)
    before, after = np.clip(moved.before, 0, t.size - 1), np.clip(moved.after, 0, t.size - 1)
    sd = np.maximum(view.sd[:, before], view.sd[:, after]) * moved.gain[..., None]
    a, b = view.flag[:, before], view.flag[:, after]
    flag = np.asarray(np.where(a == b, a, joined(a, b)), object)
    flag[:, (moved.before < 0) | (moved.after >= t.size)] = ""
    return Seen(moved.values, sd, flag, bool((moved.before != moved.after).any()))


def joined(a: Labels, b: Labels) -> Labels:
    """Flags put together with a semicolon."""
    return np.asarray(np.where(a == "", b, np.where(b == "", a, a + ";" + b)), object)


def flags_by_target(seen: Seen, target: Indices, m: int) -> Labels:
    """A camera's flags put together by target, (m, M)."""
    out = np.full((m, seen.flag.shape[1]), "", object)
    for track in np.flatnonzero(target != NONE):
        out[target[track]] = joined(out[target[track]], seen.flag[track])
    return out


def timecodes(views: Sequence[View], times: Sequence[Array], at: Array, whose: NDArray[np.intp]) -> Labels:
    """The label of every common moment, by the camera whose moment it is."""
    out = np.full(at.size, "", object)
    for i, (view, t) in enumerate(zip(views, times, strict=True)):
        own = whose == i
        out[own] = view.timecode[np.searchsorted(t, at[own])]
    return out
