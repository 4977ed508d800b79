"""What each camera of a run saw, as arrays, and brought to moments that all cameras share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import NONE
from vidtrack.association.tracklets import Tracklets, tracklets_of
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.location.cameras.ball_middles import AtMiddles
from vidtrack.timing.resample import resample

Labels = NDArray[np.object_]


class View(NamedTuple):
    """One camera's centroids: n tracks at T moments, and the tracklets that the tracks are made of."""

    name: str
    camera: Camera  # of mode plane: none is needed, and it is None
    uncertainty: CameraUncertainty | None
    t: Array  # (T,) s, by the camera's own clock
    timecode: Labels  # (T,)
    tracks: list[str]  # their names; '' for what was followed besides the targets
    b: Array  # (n, T, 2) px
    sd: Array  # (n, T, 2) px; 1 where it is not known
    flag: Labels  # (n, T)
    has_sd: bool
    piece: Ints  # (n, T) the tracklet of each sample, numbered from 0 in a camera; NONE where there is none
    number: Ints  # (n_pieces,) that of the same tracklet in the table of the track stage; NONE where it has none
    bound: Bools  # (n_pieces,) whether it begins in a start box of its track's name
    balls: AtMiddles | None = None  # how balls were moved to their middles; None: b is where they were measured
    ball: Array | None = None  # (n, T, 3) px, x and y taken off b for that, and the ball's radius; NaN: nothing

    @property
    def named(self) -> list[str]:
        """Names of the targets' tracks."""
        return [name for name in self.tracks if name]

    @property
    def n_pieces(self) -> int:
        """How many tracklets there are."""
        return int(self.piece.max(initial=NONE)) + 1

    @property
    def given(self) -> list[str]:
        """The name that a start box gives each tracklet, '' where none does."""
        track = np.zeros(self.n_pieces, np.intp)
        where = np.nonzero(self.piece != NONE)
        track[self.piece[where]] = where[0]
        return [self.tracks[k] if bound else "" for k, bound in zip(track.tolist(), self.bound.tolist(), strict=True)]


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
    piece: Ints  # (n, M) the tracklet of each sample; NONE where there is none
    ball: Array | None  # (n, M, 3) px, as `View.ball` has it


def brought(view: View, t: Array, at: Array) -> Seen:
    """What a camera saw at the moments `at` (M,), s, its own moments being truly t (T,).

    A sample brought to another moment has the noise that its neighbours leave it, and the flags of both of them.
    """
    moved = resample(t, view.b, at)
    if not view.t.size:
        nothing = np.full(moved.gain.shape, NONE, np.intp)
        unknown = np.full(moved.values.shape, np.nan)
        return Seen(moved.values, unknown, np.full(moved.gain.shape, "", object), False, nothing, None)
    before, after = np.clip(moved.before, 0, t.size - 1), np.clip(moved.after, 0, t.size - 1)
    sd = np.maximum(view.sd[:, before], view.sd[:, after]) * moved.gain[..., None]
    a, b = view.flag[:, before], view.flag[:, after]
    flag = np.asarray(np.where(a == b, a, joined(a, b)), object)
    flag[:, (moved.before < 0) | (moved.after >= t.size)] = ""
    piece = view.piece[:, before]
    one = (piece == view.piece[:, after]) & np.isfinite(moved.values).all(-1)
    values = np.where(one[..., None], moved.values, np.nan)
    ball = None if view.ball is None else (view.ball[:, before] + view.ball[:, after]) / 2
    return Seen(values, sd, flag, bool((moved.before != moved.after).any()), np.where(one, piece, NONE), ball)


def tracklets_seen(seen: Seen) -> tuple[Tracklets, Ints]:
    """The tracklets that have any sample at these moments, and their numbers (n,) in the camera."""
    track, moment = np.nonzero(seen.piece != NONE)
    number, owner = np.unique(seen.piece[track, moment], return_inverse=True)
    return tracklets_of(owner, moment, seen.b[track, moment], seen.sd[track, moment]), number


def by_trajectory(values: Array, piece: Ints, trajectory: Ints, m: int) -> Array:
    """Values of tracks (n, T, k) put together by trajectory, (m, T, k); NaN where none has a sample.

    piece   (n, T) the tracklet of each sample; trajectory (n_pieces,) that of each tracklet, NONE where it has none
    """
    out = np.full((m, *values.shape[1:]), np.nan)
    whose = of_samples(piece, trajectory)
    track, moment = np.nonzero(whose != NONE)
    out[whose[track, moment], moment] = values[track, moment]
    return out


def by_target(seen: Sequence[Seen], trajectory: Sequence[Ints], m: int) -> tuple[Array, Array]:
    """Positions and their standard deviations, px (n_cameras, m, M, 2), trajectory by trajectory."""
    both = list(zip(seen, trajectory, strict=True))
    b = [by_trajectory(s.b, s.piece, t, m) for s, t in both]
    sd = [by_trajectory(s.sd, s.piece, t, m) for s, t in both]
    return np.stack(b), np.stack(sd)


def balls_by_target(seen: Sequence[Seen], trajectory: Sequence[Ints], m: int) -> Array | None:
    """`View.ball` by trajectory (n_cameras, m, M, 3); None where no camera's balls were moved."""
    if all(s.ball is None for s in seen):
        return None
    both = zip(seen, trajectory, strict=True)
    nothing = np.full((m, seen[0].piece.shape[1], 3), np.nan)
    return np.stack([nothing if s.ball is None else by_trajectory(s.ball, s.piece, t, m) for s, t in both])


def of_samples(piece: Ints, trajectory: Ints) -> Ints:
    """The trajectory (n, T) of each sample; NONE."""
    return np.append(trajectory, NONE)[piece]


def joined(a: Labels, b: Labels) -> Labels:
    """Flags put together with a semicolon."""
    return np.asarray(np.where(a == "", b, np.where(b == "", a, a + ";" + b)), object)


def with_word(flag: Labels, rows: Bools, word: str) -> Labels:
    """Flags (m, M) with a word before those of the rows (m,)."""
    added = np.full(flag.shape, "", object)
    added[rows] = word
    return joined(added, flag)


def flags_by_trajectory(seen: Seen, trajectory: Ints, m: int) -> Labels:
    """A camera's flags put together by trajectory, (m, M).

    Where a track has no sample, its flag goes to the trajectory that its last tracklet was of, or else its next one.
    """
    out = np.full((m, seen.flag.shape[1]), "", object)
    for flag, owner in zip(seen.flag, owners(seen.piece, trajectory), strict=True):
        moment = np.flatnonzero((flag != "") & (owner != NONE))
        out[owner[moment], moment] = joined(out[owner[moment], moment], flag[moment])
    return out


def owners(piece: Ints, trajectory: Ints) -> Ints:
    """The trajectory (n, T) that each sample of a track is of, where it has none that of its last one, or else its next
    one; NONE for a track that has none at all.
    """
    out = of_samples(piece, trajectory).copy()
    for whose in out:
        known = np.flatnonzero(whose != NONE)
        if known.size:
            last = np.searchsorted(known, np.arange(whose.size), "right") - 1
            whose[:] = whose[known[np.maximum(last, 0)]]
    return out


def timecodes(views: Sequence[View], times: Sequence[Array], at: Array, whose: NDArray[np.intp]) -> Labels:
    """The label of every common moment, by the camera whose moment it is."""
    out = np.full(at.size, "", object)
    for i, (view, t) in enumerate(zip(views, times, strict=True)):
        own = whose == i
        out[own] = view.timecode[np.searchsorted(t, at[own])]
    return out
