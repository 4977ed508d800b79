"""A second search for targets that a camera lost or could not separate, where the other cameras show them to be.

The track stage kept pieces of the pictures in which a target was sought in vain, or looked like no disc. What is
expected there is fitted to them, all discs that touch at once; a fit counts where it agrees with what was expected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import NONE
from vidtrack.association.tracklets import pieces_of
from vidtrack.location.expected import InPicture, bridged_gaps, expected, in_picture, located_by_all, moments_of
from vidtrack.location.kept_pieces import Columns, Kept, kept_of
from vidtrack.location.matching import Match
from vidtrack.location.views import Labels, View, brought, by_target, of_samples, owners
from vidtrack.tracking.measurement.exposure_time import lateness

LOOKS = ("tracklet", "pixels", "brightness")

SAME_S = 1e-5
"""s, between the times of one sample in two tables."""

SOUGHT = "sought"
"""The flag of a sample that the second search found."""


@dataclass(frozen=True)
class Seeking:
    """When a target is sought again, and when it is found.

    beyond     standard deviations that a fit, or a sample, may lie off what is expected
    sure_px, sure   how well it must be known where a target is: px, or this share of its radius where that is more
    beside_px  between two discs that are fitted together, besides their radii
    at_most    discs in one fit
    rounds     of the search, at most
    apart      samples: two that are nearer than this share of the sampling interval are of one moment
    lasting    samples over which an acceleration is taken to be known
    same       of the radius, from what the camera has measured of another target: what is found there is that
    """

    beyond: float = 4.0
    sure_px: float = 1.5
    sure: float = 0.5
    beside_px: float = 3.0
    at_most: int = 4
    rounds: int = 4
    apart: float = 0.02
    lasting: float = 3.0
    same: float = 0.5


SEEKING = Seeking()


class Looks(NamedTuple):
    """What the tracklets (n,) of a camera look like, by their numbers: pixels, grey levels over the background."""

    pixels: Array
    contrast: Array


class Found(NamedTuple):
    """Samples (n,) that were found in one camera."""

    target: Ints
    sample: Ints
    b: Array  # (n, 2) px
    sd: Array  # (n, 2) px


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
) -> list[Found]:
    """What each camera shows where the other cameras expect targets.

    times    (T,) s of each view, corrected; at (M,) s: common moments, at which b, sd (n_cameras, m, M, 2) px are known
    """
    bias = match.bias_px if np.isfinite(match.bias_px) else 0.0
    cameras = [view.camera for view in views]
    bridged = bridged_gaps(located_by_all(cameras, b, sd, bias))
    out = []
    for i, view in enumerate(views):
        own = kept.get(view.name)
        nothing = Found(np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros((0, 2)))
        if own is None or not own.time.size or not match.labels or view.name not in looks:
            out.append(nothing)
            continue
        day = 86400.0 * round((view.t[0] - own.time[0]) / 86400.0)  # a view's time goes on past midnight
        sample = np.clip(np.searchsorted(view.t, own.time + day - SAME_S), 0, view.t.size - 1)
        moment = moments_of(sample, times[i], at)
        gap = SEEKING.apart * float(np.median(np.diff(at))) if at.size > 1 else 0.0
        same = np.abs(view.t[sample] - own.time - day) < SAME_S
        usable = np.flatnonzero(same & (np.abs(at[moment] - times[i][sample]) <= gap))
        if not usable.size:
            out.append(nothing)
            continue
        some, column = np.unique(moment[usable], return_inverse=True)
        near = np.unique(np.clip(some[:, None] + (-1, 0, 1), 0, at.size - 1)) if own.exposure else some
        about = in_picture(view.camera, expected(cameras, b, sd, i, bias, near, bridged))
        own_steps = at[near] / float(np.median(np.diff(view.t))) if own.exposure else np.zeros(near.size)
        late = _late(about, own_steps, own.exposure, bias)
        place = np.searchsorted(near, some)
        where, late = InPicture(about.at[:, place], about.S[:, place]), late[:, :, place]
        discs = _discs(view, match.trajectory[i], looks[view.name], len(match.labels))
        out.append(
            _in_camera(own, usable, sample[usable], column, where, late, discs, b[i][:, some], sd[i][:, some], bias)
        )
    return out


def _late(where: InPicture, steps: Array, exposure: float, bias: float) -> Array:
    """px by which what is drawn out by motion is off its place in the middle of the exposure, and one sd of that,
    (2, m, k, 2); NaN where no motion is known; steps (k,): when, in samples of the camera.
    """
    late = np.zeros((2, *where.at.shape))
    if not exposure:
        return late
    late[:] = np.nan
    before, after = np.diff(steps)[:-1, None], np.diff(steps)[1:, None]
    way = np.diff(where.at, axis=1)
    first, second = way[:, :-1] / before, way[:, 1:] / after
    acceleration = 2 * (second - first) / (before + after)
    middle, sd = lateness((first + second) / 2, acceleration, exposure)
    unsure = np.sqrt(np.maximum(np.einsum("...ii->...i", where.S[:, 1:-1]), 0.0) + bias**2)
    late[:, :, 1:-1] = middle, np.hypot(sd, exposure**2 / 24 * np.sqrt(6) * unsure)
    late[:, :, 1:-1][:, :, (before + after)[:, 0] > SEEKING.lasting] = np.nan
    known = np.isfinite(late[1])
    if known.any():  # elsewhere it is as it usually is
        late[1] = np.where(known, late[1], np.sqrt(np.mean(late[:, known] ** 2) * 2))
        late[0] = np.nan_to_num(late[0])
    return late


def _discs(view: View, trajectory: Ints, looks: Looks, m: int) -> Array:
    """Radius, px, and contrast of each target (2, m), as the median of its samples; NaN where it is not known."""
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


def _in_camera(
    kept: Kept,
    usable: Ints,
    sample: Ints,
    moment: Ints,
    where: InPicture,
    late: Array,
    discs: Array,
    b: Array,
    sd: Array,
    bias: float,
) -> Found:
    """What the usable pieces of one camera show.

    sample, moment   (n_usable,) of each: its number in the camera, and its place in where, late, b and sd (m, k, 2) px,
                     the camera's own samples
    """
    spread = np.sqrt(np.maximum(np.einsum("...ii->...i", where.S), 0.0) + bias**2)
    rows: dict[tuple[int, int], tuple[Array, Array]] = {}
    tried: set[tuple[int, ...]] = set()
    for w, number, k in zip(usable.tolist(), sample.tolist(), moment.tolist(), strict=True):
        grey, lines = kept.grey[w], int(kept.lines[w])
        corner, scale = np.array([kept.left[w], kept.top[w]]), np.array([1, lines])
        radius = np.sqrt(discs[0] * lines / np.pi)
        place = (where.at[:, k] - (0, kept.parity[w])) / scale - corner
        room = radius[:, None] / scale
        with np.errstate(invalid="ignore"):
            inside = ((place >= room) & (place + room <= np.array(grey.shape[::-1]) - 1)).all(-1)
            sure = (spread[:, k] < np.maximum(SEEKING.sure_px, SEEKING.sure * radius)[:, None]).all(-1)
        able = np.flatnonzero(inside & sure & np.isfinite(discs).all(0))
        seen = np.isfinite(b[:, k, 0])
        off = np.abs(b[:, k] - where.at[:, k]) > SEEKING.beyond * np.hypot(spread[:, k], sd[:, k])
        wanted = ~seen | off.any(-1)
        for group in _touching(where.at[able, k], radius[able]):
            own = able[group]
            if not wanted[own].any() or own.size > SEEKING.at_most or (number, *own.tolist()) in tried:
                continue
            tried.add((number, *own.tolist()))
            beside = np.setdiff1d(np.flatnonzero(np.isfinite(where.at[:, k, 0]) & np.isfinite(radius)), own)
            hidden = (grey == 0) | _covered(grey.shape, place[beside], (radius[beside] + 2)[:, None] / scale)
            fit = _fitted(grey, hidden, place[own], discs[:, own], lines, kept.noise)
            if fit is None:
                continue
            found = (fit[0] + corner) * scale + (0, kept.parity[w]) - late[0, own, k]
            own_sd = np.hypot(fit[1] * scale * kept.grown, late[1, own, k])
            far = np.abs(found - where.at[own, k]) > SEEKING.beyond * np.hypot(spread[own, k], own_sd)
            others = np.setdiff1d(np.flatnonzero(seen), own)
            taken = np.linalg.norm(found[:, None] - b[others, k], axis=-1) < SEEKING.same * radius[own, None]
            if not (far | np.isnan(found)).any() and not taken.any():
                rows |= {(int(t), number): (f, s) for t, f, s in zip(own, found, own_sd, strict=True)}
    both = np.array(sorted(rows), np.intp).reshape(-1, 2)
    values = np.array([rows[int(t), int(s)] for t, s in both]).reshape(-1, 2, 2)
    return Found(both[:, 0], both[:, 1], values[:, 0], values[:, 1])


def _touching(at: Array, radius: Array) -> list[Ints]:
    """Discs (n,) in groups of those that touch."""
    apart = np.linalg.norm(at[:, None] - at, axis=-1) - radius[:, None] - radius
    label = np.arange(len(at))
    for _ in range(len(at)):
        label = np.where(apart < SEEKING.beside_px, label, len(at)).min(axis=1, initial=len(at))
    return [np.flatnonzero(label == one) for one in np.unique(label)]


def _covered(shape: tuple[int, ...], middle: Array, half: Array) -> Bools:
    """Pixels (rows, columns) within ellipses about middles (n, 2), x and y, with half axes (n, 2)."""
    out = np.zeros(shape, bool)
    row, column = np.ogrid[: shape[0], : shape[1]]
    for (x, y), (a, c) in zip(middle, half, strict=True):
        out |= ((column - x) / a) ** 2 + ((row - y) / c) ** 2 < 1
    return out


def _fitted(
    grey: NDArray[np.uint8], hidden: Bools, place: Array, discs: Array, lines: int, noise: float
) -> tuple[Array, Array] | None:
    """Places (m, 2) and their sd in the piece's own px, of discs expected at `place` (m, 2); None: no fit."""
    from vidtrack.tracking.measurement.fit_apart import fit_apart
    from vidtrack.tracking.measurement.joint_fit import shapes_of

    pixels, contrast = discs
    known = shapes_of(pixels, np.stack([np.full(pixels.size, float(lines) * 1e3), np.full(pixels.size, 1e3)]), contrast)
    fit, _ = fit_apart(grey.astype(np.float32), np.asarray(hidden), place[:, 0], place[:, 1], known, noise)
    if fit is None:
        return None
    return np.stack([fit.x, fit.y], -1), np.stack([fit.sd_x, fit.sd_y], -1)


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
    for _ in range(SEEKING.rounds if any(own.time.size for own in pieces.values()) else 0):
        seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
        b, sd = by_target(seen, match.trajectory, len(match.labels))
        found = second_search(views, times, at, match, b, sd, pieces, looks)
        if not any(f.target.size for f in found):
            break
        counts = [n + f.target.size for n, f in zip(counts, found, strict=True)]
        several = zip(views, match.trajectory, match.reason, found, strict=True)
        views, trajectory, reason = zip(*(with_found(*own) for own in several), strict=True)
        match = match._replace(trajectory=trajectory, reason=reason, ties=())
    return list(views), match, dict(zip((view.name for view in views), counts, strict=True))
