"""What pieces of one camera's pictures show of targets that are expected there: discs, streaks, halves behind a rope.

What is expected in a piece is fitted to it, all that touches at once, with what the camera has measured of others; a
fit counts where it agrees with what was expected.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.location.lost_targets.expected import InPicture
from vidtrack.location.lost_targets.kept_pieces import Kept
from vidtrack.tracking.uncertainty.exposure_time import lateness


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
    again_px   by which a target must be expected elsewhere before it is sought again in a piece
    about      of a disc's half axes, on each side of it, and about_px besides, of which a piece is looked at
    dark       share of a disc that may be hidden by something dark: from, to
    smaller    of their radius: discs that overlap by too much even if they are as small are not fitted
    known_px   how well it is known where a target is, from which on a fit must explain all that is seen
    left       times the noise, that a fit leaves at most where it must explain all; misfit: of the light, where more
    streak     sd of log half axes, of the light (share) and of log blur of what is drawn out
    drawn_px   by which motion during the exposure draws a disc out, from which on it is fitted as a streak
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
    again_px: float = 0.5
    about: float = 0.5
    about_px: float = 12.0
    dark: tuple[float, float] = (0.03, 0.85)
    smaller: float = 0.75
    known_px: float = 0.5
    left: float = 1.5
    misfit: float = 0.02
    streak: tuple[float, float, float] = (0.3, 0.4, 0.6)
    drawn_px: float = 0.5


SEEKING = Seeking()


class Found(NamedTuple):
    """Samples (n,) that were found in one camera."""

    target: Ints
    sample: Ints
    b: Array  # (n, 2) px
    sd: Array  # (n, 2) px
    ball: Array | None = None  # (n, 3) px as `View.ball`, of balls that were moved to their middles


class Motion(NamedTuple):
    """What motion during the exposure does to targets, (m, k, 2) px each; NaN in way and bend where it is not known.

    late, late_sd  by which what is drawn out is off its place in the middle of the exposure, and one sd of that
    way, bend      L and B of `joint_fit.stations_of`
    """

    late: Array
    late_sd: Array
    way: Array
    bend: Array


def or_measured(where: InPicture, b: Array, sd: Array) -> InPicture:
    """Where targets are expected, or else where the camera itself measured them: b, sd (m, k, 2) px."""
    alone = np.isnan(where.at[..., :1]) & np.isfinite(b)
    own = sd[..., None] ** 2 * np.eye(2)
    return InPicture(np.where(alone, b, where.at), np.where(alone[..., None], own, where.S))


def motion_of(where: InPicture, steps: Array, exposure: float, bias: float) -> Motion:
    """The motion of targets that are expected at `steps` (k,), in samples of the camera; exposure in samples."""
    nothing = np.zeros(where.at.shape)
    if not exposure:
        return Motion(nothing, nothing, nothing, nothing)
    late, late_sd, drawn, bend = (np.full(where.at.shape, np.nan) for _ in range(4))
    before, after = np.diff(steps)[:-1, None], np.diff(steps)[1:, None]
    way = np.diff(where.at, axis=1)
    first, second = way[:, :-1] / before, way[:, 1:] / after
    acceleration = 2 * (second - first) / (before + after)
    middle, sd = lateness((first + second) / 2, acceleration, exposure)
    unsure = np.sqrt(np.maximum(np.einsum("...ii->...i", where.S[:, 1:-1]), 0.0) + bias**2)
    late[:, 1:-1], late_sd[:, 1:-1] = middle, np.hypot(sd, exposure**2 / 24 * np.sqrt(6) * unsure)
    drawn[:, 1:-1], bend[:, 1:-1] = exposure * (first + second) / 2, exposure**2 * acceleration / 2
    apart = np.r_[True, (before + after)[:, 0] > SEEKING.lasting, True]
    for column in (late, late_sd, drawn, bend):
        column[:, apart] = np.nan
    known = np.isfinite(late_sd)
    if known.any():  # elsewhere it is as it usually is
        usual = np.sqrt(np.mean([late[known] ** 2, late_sd[known] ** 2]) * 2)
        late_sd = np.where(known, late_sd, usual)
        late = np.nan_to_num(late)
    return Motion(late, late_sd, drawn, bend)


def found_in_pieces(
    kept: Kept,
    usable: Ints,
    sample: Ints,
    moment: Ints,
    where: InPicture,
    motion: Motion,
    usual: Array,
    b: Array,
    sd: Array,
    bias: float,
    vain: set[tuple[int, ...]],
) -> Found:
    """What the usable pieces of one camera show.

    sample, moment   (n_usable,) of each: its number in the camera, and its place in where, motion, b and sd (m, k, 2)
                     px, the camera's own samples
    usual            (2, m, k) radius, px, and light of targets, as `usual_discs`
    vain             which fits were tried in vain: in which piece, of which targets and where; takes others in
    """
    alone, most = np.isnan(where.at[..., 0]), _too_much()
    at, S = or_measured(where, b, sd)
    spread = np.sqrt(np.maximum(np.einsum("...ii->...i", S), 0.0) + bias**2)
    rows: dict[tuple[int, int], tuple[Array, Array]] = {}
    tried: set[tuple[int, ...]] = set()
    for w, number, k in zip(usable.tolist(), sample.tolist(), moment.tolist(), strict=True):
        grey, lines = kept.grey[w], int(kept.lines[w])
        corner, scale = np.array([kept.left[w], kept.top[w]]), np.array([1, lines])
        radius = usual[0, :, k] * np.sqrt(lines)
        way = np.nan_to_num(motion.way[:, k])
        reach = radius + np.hypot(*way.T) / 2
        aside = radius[:, None] * kept.lit[:, w]  # from the light, where it is sought, to the outline
        place = (at[:, k] - aside[:, :2] - (0, kept.parity[w])) / scale - corner
        room = radius[:, None] / scale
        with np.errstate(invalid="ignore"):
            inside = ((place >= room) & (place + room <= np.array(grey.shape[::-1]) - 1)).all(-1)
            sure = (spread[:, k] < np.maximum(SEEKING.sure_px, SEEKING.sure * radius)[:, None]).all(-1)
        able = np.flatnonzero(inside & sure & np.isfinite(usual[:, :, k]).all(0))
        seen = np.isfinite(b[:, k, 0])
        off = np.abs(b[:, k] - where.at[:, k]) > SEEKING.beyond * np.hypot(spread[:, k], sd[:, k])
        wanted = ~seen | off.any(-1)
        behind = _overlaps(at[:, k], np.where(sure, reach, np.nan)) > most
        for own, buried in _groups(at[:, k], reach, able, able[~alone[able, k]], behind):
            if not wanted[own].any() or own.size > SEEKING.at_most or (number, *own.tolist()) in tried:
                continue
            if any((int(t), number) in rows for t in own):
                continue
            tried.add((number, *own.tolist()))
            beside = np.union1d(np.setdiff1d(_beside(at[:, k], reach, own, alone[:, k]), own), buried)
            this = (w, *own.tolist(), *np.rint(at[[*own, *beside], k] / SEEKING.again_px).astype(int).ravel().tolist())
            if this in vain or _behind_each_other(place[own], usual[0, own, k], spread[own, k]):
                continue
            hidden = (grey == 0) | _covered(grey.shape, place[beside], (reach[beside] + 2)[:, None] / scale)
            drawn = np.nan_to_num(np.stack([motion.way[own, k], motion.bend[own, k]])) / scale
            # where they are not known well, a blob of others must not pass for them
            plain = bool((spread[own, k] > SEEKING.known_px).any())
            fit = _fitted(grey, hidden, place[own], usual[:, own, k], drawn.swapaxes(1, 2), lines, kept.noise, plain)
            if fit is None:
                vain.add(this)
                continue
            found = (fit[0] + corner) * scale + (0, kept.parity[w]) - motion.late[own, k] + aside[own, :2]
            own_sd = np.hypot(np.hypot(fit[1] * scale * kept.grown, motion.late_sd[own, k]), aside[own, 2:])
            far = np.abs(found - at[own, k]) > SEEKING.beyond * np.hypot(spread[own, k], own_sd)
            others = np.setdiff1d(np.flatnonzero(seen), own)
            taken = np.linalg.norm(found[:, None] - b[others, k], axis=-1) < SEEKING.same * radius[own, None]
            if not (far | np.isnan(found)).any() and not taken.any():
                each = zip(own, found, own_sd, strict=True)
                rows |= {(int(t), number): (f, s) for t, f, s in each if not alone[t, k]}
    both = np.array(sorted(rows), np.intp).reshape(-1, 2)
    values = np.array([rows[int(t), int(s)] for t, s in both]).reshape(-1, 2, 2)
    return Found(both[:, 0], both[:, 1], values[:, 0], values[:, 1])


def usual_discs(looks: Array, b: Array, steps: Array, exposure: float) -> Array:
    """Radius, px, and light (2, m) of discs that show so many pixels and grey levels (2, m) when motion draws them out.

    They cover pi r^2 + 2 r L pixels, over which the light of pi r^2 is spread; L is the exposure (samples) times the
    median speed of b (m, M, 2) px at `steps` (M,), samples. Fewer pixels are more than half-way up: r is taken half-way
    between that and sqrt(pixels / pi), on a scale of logarithms (on drawn streaks within 20 %).
    """
    pixels, contrast = looks
    speed = np.linalg.norm(np.diff(b, axis=1), axis=-1) / np.diff(steps)
    known = np.isfinite(speed)
    L = exposure * np.array([float(np.median(v[k])) if k.any() else 0.0 for v, k in zip(speed, known, strict=True)])
    radius = np.sqrt((np.sqrt(L * L + np.pi * pixels) - L) / np.pi * np.sqrt(pixels / np.pi))
    return np.stack([radius, contrast * pixels / (np.pi * radius**2)])


def _groups(at: Array, reach: Array, able: Ints, expected: Ints, behind: Bools) -> Iterator[tuple[Ints, Ints]]:
    """Which of the discs that can be fitted touch, and which of these are left out; first with those that only this
    camera sees, then without. Where some overlap others by more than can be separated (behind), the rest comes again.
    """
    none = np.zeros(0, np.intp)
    for some in (able, expected) if expected.size < able.size else (able,):
        for group in _touching(at[some], reach[some]):
            own = some[group]
            yield own, none
            left = own[~behind[own]]
            if left.size < own.size:
                for part in _touching(at[left], reach[left]):
                    yield left[part], own[behind[own]]


def _touching(at: Array, radius: Array) -> list[Ints]:
    """Discs (n,) in groups of those that touch."""
    apart = np.linalg.norm(at[:, None] - at, axis=-1) - radius[:, None] - radius
    label = np.arange(len(at))
    for _ in range(len(at)):
        label = np.where(apart < SEEKING.beside_px, label, len(at)).min(axis=1, initial=len(at))
    return [np.flatnonzero(label == one) for one in np.unique(label)]


def _beside(at: Array, reach: Array, own: Ints, alone: Bools) -> Ints:
    """Discs that hide what is beside `own`: what only this camera has measured (alone) may be a part of these, where it
    touches them, and hides nothing then.
    """
    apart = (np.linalg.norm(at[:, None] - at[own], axis=-1) - reach[:, None] - reach[own] > 0).all(axis=-1)
    return np.flatnonzero(np.isfinite(at[:, 0]) & np.isfinite(reach) & (apart | ~alone))


def _behind_each_other(at: Array, radius: Array, spread: Array) -> bool:
    """Whether discs (n,) at places (n, 2), px of a piece, that are known to `spread` (n, 2) px overlap by more than can
    be separated, even if they are smaller: no fit of them counts, and those take the longest."""
    if len(at) < 2:
        return False
    unsure = SEEKING.beyond * float(np.sort(np.hypot(*spread.T))[-2:].sum())
    return bool((_overlaps(at, SEEKING.smaller * radius - unsure / 2) > _too_much()).any())


def _overlaps(at: Array, radius: Array) -> Array:
    """Of discs (n,) at (n, 2), px, the share of the smaller diameter by which another one overlaps each at most, as of
    `JointFit.overlap`; 0 where none does, or where it is not known."""
    both = radius[:, None] + radius
    with np.errstate(invalid="ignore", divide="ignore"):
        over = (both - np.linalg.norm(at[:, None] - at, axis=-1)) / (2 * np.minimum(radius[:, None], radius))
    over[np.diag_indices(len(at))] = 0.0
    return np.asarray(np.maximum(np.nan_to_num(np.where(both > 0, over, 0.0)), 0.0).max(axis=1, initial=0.0))


def _too_much() -> float:
    """The overlap from which on discs are not separated."""
    from vidtrack.tracking.discs.joint_fit import JOINT_FIT

    return JOINT_FIT.overlap


def _covered(shape: tuple[int, ...], middle: Array, half: Array) -> Bools:
    """Pixels (rows, columns) within ellipses about middles (n, 2), x and y, with half axes (n, 2)."""
    out = np.zeros(shape, bool)
    row, column = np.ogrid[: shape[0], : shape[1]]
    for (x, y), (a, c) in zip(middle, half, strict=True):
        out |= ((column - x) / a) ** 2 + ((row - y) / c) ** 2 < 1
    return out


def _fitted(
    grey: NDArray[np.uint8],
    hidden: Bools,
    place: Array,
    usual: Array,
    drawn: Array,
    lines: int,
    noise: float,
    plain: bool,
) -> tuple[Array, Array] | None:
    """Places (m, 2) and their sd in the piece's own px, of discs expected at `place` (m, 2); None: no fit.

    usual  (2, m) radius, px of the frame buffer's columns, and light; drawn (2, 2, m) px as of `fit_apart`
    plain  whether the fit must explain what is seen with the recording's noise, whatever is beside it
    """
    from vidtrack.tracking.discs.fit_apart import fit_apart
    from vidtrack.tracking.discs.half_hidden import HALF_HIDDEN, fit_half_hidden
    from vidtrack.tracking.discs.joint_fit import JOINT_FIT, Shapes, shapes_of

    radius, light = usual
    n, pixels = radius.size, np.pi * radius**2
    known = shapes_of(pixels, np.stack([np.full(n, float(lines) * 1e3), np.full(n, 1e3)]), light)
    grey, hidden, corner = _about(grey, hidden, place, np.exp(known.value[:2]) + np.abs(drawn[0]) / 2)
    seen, (x, y) = grey.astype(np.float32), (place - corner).T
    still = np.hypot(*drawn[0]).max() < SEEKING.drawn_px
    if not still:
        axis, of_light, blur = SEEKING.streak
        known = Shapes(known.value, np.repeat([[axis], [axis], [of_light], [blur]], n, axis=1))
    fit, piece = fit_apart(seen, hidden, x, y, known, noise, drawn=None if still else drawn)
    alone = piece.left < JOINT_FIT.unlike * noise  # discs explain all that is seen: nothing else hides them
    if fit is None and still and not alone and _half_dark(seen, hidden, x, y, known.value, noise):
        halves = Shapes(known.value, np.repeat(np.array(HALF_HIDDEN.usual)[:, None], n, axis=1))
        fit, _ = fit_half_hidden(seen, hidden, x, y, halves, noise, beside=True)
    if fit is None or (plain and not fit.left < max(SEEKING.left * noise, SEEKING.misfit * float(light.min()))):
        return None
    return np.stack([fit.x, fit.y], -1) + corner, np.stack([fit.sd_x, fit.sd_y], -1)


def _about(grey: NDArray[np.uint8], hidden: Bools, place: Array, half: Array) -> tuple[NDArray[np.uint8], Bools, Array]:
    """What a piece and `hidden` show about places (m, 2) of discs with half axes (2, m), and its left top corner."""
    room = half.T * (1 + SEEKING.about) + SEEKING.about_px
    low = np.maximum(np.floor((place - room).min(axis=0)), 0).astype(int)
    high = np.ceil((place + room).max(axis=0)).astype(int) + 1
    part = slice(low[1], high[1]), slice(low[0], high[0])
    return grey[part], hidden[part], low


def _half_dark(seen: NDArray[np.float32], hidden: Bools, x: Array, y: Array, shape: Array, noise: float) -> bool:
    """Whether a part of some disc, but not all of it, is so dark that something in front may hide it, or something
    darker than the background is beside it: pixels that a fit of discs alone cannot explain."""
    from vidtrack.tracking.discs.half_hidden import below_background
    from vidtrack.tracking.discs.joint_fit import JOINT_FIT

    (a, c), light = np.exp(shape[:2]) - 1, np.exp(shape[2])
    row, column = np.ogrid[: seen.shape[0], : seen.shape[1]]
    ground, reach = float(np.percentile(seen, 20)), 1 + JOINT_FIT.reach_px
    black = ~hidden & (seen < ground - below_background(light, noise))
    for i in range(x.size):
        own = (((column - x[i]) / a[i]) ** 2 + ((row - y[i]) / c[i]) ** 2 < 1) & ~hidden
        dark = float((seen[own] < ground + light[i] / 2).mean()) if own.any() else 0.0
        if SEEKING.dark[0] < dark < SEEKING.dark[1]:
            return True
        if (black & (((column - x[i]) / (a[i] + reach)) ** 2 + ((row - y[i]) / (c[i] + reach)) ** 2 < 1)).any():
            return True
    return False
