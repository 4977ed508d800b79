"""A second search for targets that a camera lost or could not separate, where the other cameras show them to be.

The track stage kept pieces of the pictures in which a target was sought in vain, or looked like no disc. What is
expected there is fitted to them, all discs that touch at once; a fit counts where it agrees with what was expected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import NONE
from vidtrack.association.tracklets import pieces_of
from vidtrack.location.cameras.ball_diameters import diameters, px_across
from vidtrack.location.cameras.views import Labels, View, balls_by_target, brought, by_target, of_samples, owners
from vidtrack.location.lost_targets.expected import (
    InPicture,
    bridged_gaps,
    expected,
    in_picture,
    located_by_all,
    moments_of,
)
from vidtrack.location.lost_targets.kept_pieces import Columns, Kept, kept_of
from vidtrack.location.lost_targets.piece_search import (
    SEEKING,
    Found,
    Motion,
    found_in_pieces,
    motion_of,
    or_measured,
    usual_discs,
)
from vidtrack.location.lost_targets.smoothed_courses import smoothed_gaps
from vidtrack.location.matching import Match

LOOKS = ("tracklet", "pixels", "brightness")

SAME_S = 1e-5
"""s, between the times of one sample in two tables."""

SOUGHT = "sought"
"""The flag of a sample that the second search found."""


class Looks(NamedTuple):
    """What the tracklets (n,) of a camera look like, by their numbers: pixels, grey levels over the background."""

    pixels: Array
    contrast: Array


def looks_of(tracklet: Ints, pixels: Array, contrast: Array) -> Looks:
    """The looks of tracklets from their rows (N,): medians."""
    n = int(tracklet.max(initial=-1)) + 1
    out = np.full((2, n), np.nan)
    order = np.argsort(tracklet, kind="stable")
    edges = np.searchsorted(tracklet[order], np.arange(n + 1))
    for k in range(n):
        own = order[edges[k] : edges[k + 1]]
        if own.size:
            out[:, k] = np.median(pixels[own]), np.median(contrast[own])
    return Looks(*out)


def second_search(
    views: Sequence[View],
    times: Sequence[Array],
    at: Array,
    match: Match,
    b: Array,
    sd: Array,
    kept: Mapping[str, Kept],
    looks: Mapping[str, Looks],
    vain: Sequence[set[tuple[int, ...]]],
    ball: Array | None = None,
) -> list[Found]:
    """What each camera shows where the other cameras expect targets.

    vain     for each view which fits were tried in vain, as of `found_in_pieces`
    times    (T,) s of each view, corrected; at (M,) s: common moments, at which b, sd (n_cameras, m, M, 2) px are known
    ball     (n_cameras, m, M, 3) as of `balls_by_target`
    """
    bias = match.bias_px if np.isfinite(match.bias_px) else 0.0
    cameras = [view.camera for view in views]
    located = located_by_all(cameras, b, sd, bias)
    bridged = bridged_gaps(located)
    diameter = np.full(b.shape[1], np.nan) if ball is None else diameters(cameras, located.p, ball[..., 2])
    smoothed = smoothed_gaps(cameras, b, sd, bias, at, located, _with_pieces(views, times, at, kept))
    out = []
    for i, view in enumerate(views):
        own = kept.get(view.name)
        nothing = Found(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros((0, 2)))
        if own is None or not own.time.size or not match.labels or view.name not in looks:
            out.append(nothing)
            continue
        sample, same = _samples_of(view, own)
        moment = moments_of(sample, times[i], at)
        gap = SEEKING.apart * float(np.median(np.diff(at))) if at.size > 1 else 0.0
        usable = np.flatnonzero(same & (np.abs(at[moment] - times[i][sample]) <= gap))
        if not usable.size:
            out.append(nothing)
            continue
        some, column = np.unique(moment[usable], return_inverse=True)
        near = np.unique(np.clip(some[:, None] + (-1, 0, 1), 0, at.size - 1)) if own.exposure else some
        where = expected(cameras, b, sd, i, bias, near, bridged, smoothed)
        about = in_picture(view.camera, where)
        steps = at / float(np.median(np.diff(view.t))) if own.exposure else np.arange(at.size, dtype=float)
        place = np.searchsorted(near, some)
        course = or_measured(about, b[i][:, near], sd[i][:, near])
        motion = Motion(*(column[:, place] for column in motion_of(course, steps[near], own.exposure, bias)))
        usual = _looks(view, match.trajectory[i], looks[view.name], len(match.labels))
        usual = np.repeat(usual_discs(usual, b[i], steps, own.exposure)[..., None], some.size, axis=2)
        if not own.exposure:  # of what is drawn out the pixels say less
            usual = _at_their_distance(usual, diameter, view, where.p[:, place], ball)
        shown = _outwards(view, about.at[:, place], usual[0]), _outwards(view, b[i][:, some], usual[0])
        expect, seen = InPicture(shown[0], about.S[:, place]), (shown[1], sd[i][:, some])
        found = found_in_pieces(own, usable, sample[usable], column, expect, motion, usual, *seen, bias, vain[i])
        if view.balls and found.target.size:
            at_moment = moments_of(found.sample, times[i], at)
            radius = usual[0][found.target, np.searchsorted(some, at_moment)]
            middle = view.balls.inwards(view.camera, found.b, radius)
            moved = found.b - middle
            columns = np.concatenate([moved, radius[:, None]], axis=1)
            found = found._replace(b=middle, sd=view.balls.sd_inwards(found.sd, moved), ball=columns)
        out.append(found)
    return out


def _outwards(view: View, b: Array, radius: Array) -> Array:
    """Where the pictures show the outlines of balls that are seen at b (m, k, 2) px, of radius (m, k) px."""
    return view.balls.outwards(view.camera, b, radius) if view.balls else b


def _at_their_distance(usual: Array, diameter: Array, view: View, p: Array, ball: Array | None) -> Array:
    """Usual discs (2, m, k), with the radius that balls of a diameter (m,) have at p (m, k, 3), where that is known."""
    if ball is None:
        return usual
    radius = diameter[:, None] / 2 * px_across(view.camera, p)
    return np.stack([np.where(np.isfinite(radius), radius, usual[0]), usual[1]])


def _samples_of(view: View, own: Kept) -> tuple[Ints, Bools]:
    """The sample of a view that each piece is nearest to, and whether it is of that."""
    day = 86400.0 * round((view.t[0] - own.time[0]) / 86400.0)  # a view's time goes on past midnight
    sample = np.clip(np.searchsorted(view.t, own.time + day - SAME_S), 0, view.t.size - 1)
    return sample, np.abs(view.t[sample] - own.time - day) < SAME_S


def _with_pieces(views: Sequence[View], times: Sequence[Array], at: Array, kept: Mapping[str, Kept]) -> Bools:
    """Moments (M,) of which any camera kept a piece."""
    out = np.zeros(at.size, bool)
    for view, t in zip(views, times, strict=True):
        own = kept.get(view.name)
        if own is not None and own.time.size:
            out[moments_of(_samples_of(view, own)[0], t, at)] = True
    return out


def _looks(view: View, trajectory: Ints, looks: Looks, m: int) -> Array:
    """Pixels and contrast of each target (2, m), as the median of its samples; NaN where it is not known."""
    track, moment = np.nonzero(of_samples(view.piece, trajectory) != NONE)
    piece = view.piece[track, moment]
    number = view.number[piece]
    real = (number >= 0) & (number < looks.pixels.size)
    whose, number = trajectory[piece][real], number[real]
    out = np.full((2, m), np.nan)
    for k in range(m):
        own = number[whose == k]
        if own.size:
            out[:, k] = np.nanmedian(looks.pixels[own]), np.nanmedian(looks.contrast[own])
    return out


def with_found(view: View, trajectory: Ints, reason: Labels, found: Found) -> tuple[View, Ints, Labels]:
    """A view with what was found as further tracks, and of each of its tracklets the trajectory, or why it has none.

    What the tracker took for a target at those samples, and why it measured none, is left out.
    """
    if not found.target.size:
        return view, trajectory, reason
    targets, row = np.unique(found.target, return_inverse=True)
    n, T = len(targets), view.t.size
    b, sd = np.full((n, T, 2), np.nan), np.ones((n, T, 2))
    b[row, found.sample], sd[row, found.sample] = found.b, found.sd
    ball = view.ball
    if ball is not None:
        ball = np.concatenate([ball, np.full((n, T, 3), np.nan)])
        if found.ball is not None:
            ball[len(view.tracks) + row, found.sample] = found.ball
    flag = np.full((n, T), "", object)
    flag[row, found.sample] = SOUGHT
    piece = pieces_of(b)
    track, moment = np.nonzero(piece >= 0)
    whose = np.zeros(int(piece.max()) + 1, np.intp)
    whose[piece[track, moment]] = targets[track]
    old_b, old_flag, old_piece = view.b.copy(), view.flag.copy(), view.piece.copy()
    for k, own in enumerate(owners(view.piece, trajectory)):
        again = found.sample[found.target == own[found.sample]]
        old_b[k, again], old_flag[k, again], old_piece[k, again] = np.nan, "", NONE
    piece = np.concatenate([old_piece, np.where(piece >= 0, piece + view.n_pieces, NONE)])
    left = np.unique(piece[piece != NONE])  # a tracklet may have lost all its samples
    piece = np.where(piece == NONE, NONE, np.searchsorted(left, piece))
    wider = view._replace(
        tracks=[*view.tracks, *[""] * n],
        b=np.concatenate([old_b, b]),
        sd=np.concatenate([view.sd, sd]),
        flag=np.concatenate([old_flag, flag]),
        ball=ball,
        piece=piece,
        number=np.concatenate([view.number, np.full(whose.size, NONE)])[left],
        bound=np.concatenate([view.bound, np.zeros(whose.size, bool)])[left],
    )
    return wider, np.append(trajectory, whose)[left], np.append(reason, np.full(whose.size, "", object))[left]


def searched_again(
    views: Sequence[View],
    times: Sequence[Array],
    at: Array,
    match: Match,
    kept: Mapping[str, Columns],
    tracklets: Mapping[str, Columns],
) -> tuple[list[View], Match, dict[str, int]]:
    """The views and the match with what the second search found, and how many samples that are in each camera.

    times             (T,) s of each view, corrected; at (M,) s: the common moments
    kept, tracklets   of each camera the columns `tracking.windows.COLUMNS` and `association.tracklets.COLUMNS`
    What is found makes courses longer, so that more is expected: it is repeated while that finds anything.
    """
    pieces = {name: kept_of(own) for name, own in kept.items()}
    looks = {name: looks_of(*(own[word] for word in LOOKS)) for name, own in tracklets.items()}
    counts = [0] * len(views)
    vain: list[set[tuple[int, ...]]] = [set() for _ in views]
    for _ in range(SEEKING.rounds if any(own.time.size for own in pieces.values()) else 0):
        seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
        b, sd = by_target(seen, match.trajectory, len(match.labels))
        ball = balls_by_target(seen, match.trajectory, len(match.labels))
        found = second_search(views, times, at, match, b, sd, pieces, looks, vain, ball)
        if not any(f.target.size for f in found):
            break
        counts = [n + f.target.size for n, f in zip(counts, found, strict=True)]
        several = zip(views, match.trajectory, match.reason, found, strict=True)
        views, trajectory, reason = zip(*(with_found(*own) for own in several), strict=True)
        match = match._replace(trajectory=trajectory, reason=reason, ties=())
    return list(views), match, dict(zip((view.name for view in views), counts, strict=True))
