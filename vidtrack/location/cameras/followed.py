"""What one camera followed, as a view: the targets' tracks, and what else there was."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.tracklets import lanes, may_change, pieces_of
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.location.cameras.ball_middles import BALL
from vidtrack.location.cameras.views import Labels, View

SHORTEST = 3
"""Samples of a tracklet of no target, at least; with fewer it is taken for noise."""


class Rows(NamedTuple):
    """N rows of a table: of centroids, or of tracklets."""

    time: Array  # (N,) s
    target: Labels  # (N,) its name; '' for none
    b: Array  # (N, 2) px; NaN where it was not measured
    sd: Array  # (N, 2) px; NaN, 0 or less where that is not known
    flag: Labels  # (N,)
    label: Labels  # (N,) time code, or the like
    tracklet: Ints  # (N,) -1 for none
    bound: Bools  # (N,) whether its tracklet begins in a start box of its target's name
    ball: Array  # (N, 3) px, as `View.ball` has it; NaN where nothing was taken off


ROWS = ("time_s", "target", "Xf", "Yf", "sd_x", "sd_y", "flag", "timecode", "tracklet", "bound", *BALL)
"""The columns that `rows_of` reads."""


def rows_of(columns: Mapping[str, NDArray[Any]]) -> Rows:
    """The rows of a table of centroids or of tracklets, by its columns; without those that have no time."""
    timed = np.isfinite(np.asarray(columns["time_s"], float))
    if not timed.all():
        columns = {name: values[timed] for name, values in columns.items()}
    n = len(columns["time_s"])

    def words(name: str) -> Labels:
        if name not in columns:
            return np.full(n, "", object)
        return np.array(["" if x is None or x != x else str(x) for x in columns[name].tolist()], object)

    def numbers(name: str) -> Array:
        return np.asarray(columns[name], float) if name in columns else np.full(n, np.nan)

    return Rows(
        numbers("time_s"),
        words("target"),
        np.stack([numbers("Xf"), numbers("Yf")], -1),
        np.stack([numbers("sd_x"), numbers("sd_y")], -1),
        words("flag"),
        words("timecode"),
        np.asarray(columns.get("tracklet", np.full(n, -1)), np.intp),
        np.asarray([x is True or x == 1 for x in columns.get("bound", np.zeros(n)).tolist()], bool),
        np.stack([numbers(name) for name in BALL], -1),
    )


def view_of(
    name: str, centroids: Rows, tracklets: Rows | None, camera: Camera | None, uncertainty: CameraUncertainty | None
) -> View:
    """A camera's view, a track a target of the centroid table.

    tracklets  what else was followed is put into further tracks, named '', and a target's track is cut where one of
               its tracklets begins; None: tracks are cut by their flags alone
    """
    t, column = np.unique(centroids.time, return_inverse=True)
    labels = list(dict.fromkeys(centroids.target.tolist()))
    codes = _codes(centroids.target, labels)
    n = len(labels)
    rows = centroids
    begins = np.zeros(len(column), bool)
    number, bound = rows.tracklet, rows.bound
    if tracklets is not None and tracklets.time.size:
        tracklets = _at(tracklets, t)
        others, lane = _others(tracklets, t)
        rows = Rows._make(np.concatenate(pair) for pair in zip(centroids, others, strict=True))
        codes = np.concatenate([codes, n + lane])
        column = np.concatenate([column, np.searchsorted(t, others.time)])
        begins = np.concatenate([begins, _first_of_each(others.tracklet)])
        number, bound = rows.tracklet, rows.bound
    b = np.full((int(codes.max(initial=n - 1)) + 1, t.size, 2), np.nan)
    b[codes, column] = rows.b
    known = np.isfinite(rows.sd) & (rows.sd > 0)
    has_sd = bool(known.all(1).any())
    sd = np.ones(b.shape)
    if has_sd:
        usual = np.nanmedian(np.where(known, rows.sd, np.nan), axis=0)
        sd[codes, column] = np.where(known, rows.sd, usual)
    flag = np.full(b.shape[:2], "", object)
    flag[codes, column] = rows.flag
    label = np.full(t.size, "", object)
    label[column[: centroids.time.size]] = centroids.label
    numbers, is_bound = np.full(b.shape[:2], -1, np.intp), np.zeros(b.shape[:2], bool)
    numbers[codes, column], is_bound[codes, column] = number, bound
    broken = may_change(flag)
    broken[codes[begins], column[begins]] = True
    if tracklets is not None and tracklets.time.size:
        own = _some(tracklets, np.isin(tracklets.target.astype(str), labels) & (tracklets.target != ""))
        at = _codes(own.target, labels), np.searchsorted(t, own.time)
        numbers[at], is_bound[at] = own.tracklet, own.bound
        one = _first_of_each(own.tracklet)
        broken[at[0][one], at[1][one]] = True
    tracks = [*labels, *[""] * (len(b) - n)]
    piece = pieces_of(b, broken)
    _, first = np.unique(piece[piece >= 0], return_index=True)
    said = numbers[piece >= 0][first], is_bound[piece >= 0][first]
    seen = t, label, tracks, b, sd, flag, has_sd, piece
    ball = None
    if np.isfinite(rows.ball).any():
        ball = np.full((*b.shape[:2], 3), np.nan)
        ball[codes, column] = rows.ball
    return View(name, camera, uncertainty, *seen, *said, ball=ball)  # type: ignore[arg-type] # mode plane needs no camera


def _codes(target: Labels, labels: list[str]) -> Ints:
    number = {name: k for k, name in enumerate(labels)}
    return np.array([number[name] for name in target.tolist()], np.intp)


def _some(rows: Rows, which: Bools | Ints) -> Rows:
    return Rows._make(column[which] for column in rows)


def _at(rows: Rows, t: Array) -> Rows:
    """Measured rows of tracklets at moments that the camera has, in order of time."""
    rows = _some(rows, np.isin(rows.time, t) & np.isfinite(rows.b).all(-1) & (rows.tracklet >= 0))
    return _some(rows, np.argsort(rows.time, kind="stable"))


def _first_of_each(number: Ints) -> Bools:
    first = np.zeros(number.size, bool)
    first[np.unique(number, return_index=True)[1]] = True
    return first


def _others(tracklets: Rows, t: Array) -> tuple[Rows, Ints]:
    """Rows of tracklets of no target, and the lane of each."""
    own = _some(tracklets, tracklets.target == "")
    _, which, count = np.unique(own.tracklet, return_inverse=True, return_counts=True)
    own = _some(own, count[which] >= SHORTEST)
    number, which = np.unique(own.tracklet, return_inverse=True)
    moment = np.searchsorted(t, own.time)
    first, last = np.full(number.size, t.size), np.full(number.size, -1)
    np.minimum.at(first, which, moment)
    np.maximum.at(last, which, moment)
    return own, lanes(first, last)[which]
