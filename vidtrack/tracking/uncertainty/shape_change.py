"""What the shape of a target's light says of its centroid: something before it, something beside it, motion blur.

Second moments of the light, over their sum, do not depend on how bright or how far away a target is. Where they differ
from what is usual of the target, by far more than they scatter, a part of it is hidden (a rope) or something is added
(glitter, a neighbour): what changes the second moments by D at the distance r from the middle moves the middle by D/r.
Where something bright is beside the target a disc is fitted, which has no second moments. Then its light and its pixels
say what is hidden: a part of the share s of a disc that is hidden at its rim moves the middle by about 0.85 s radii.

What motion draws out during the exposure (`exposure_time`) is taken off first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.order_statistics import median, middle_and_nearest, quantile, row_medians
from vidtrack.tracking.centroiding.streak import drawn_out
from vidtrack.tracking.state import CONTRAST, MASS, PIXELS, SD_X, XX, XY, X, Y
from vidtrack.tracking.uncertainty.exposure_time import EXPOSURE, UNSEEN, Blur, exposure_of
from vidtrack.tracking.uncertainty.leaning import UNKNOWN, Lean, leaning


@dataclass(frozen=True)
class Shapes:
    """When a shape says something.

    fewest     samples of a target that say what is usual of it
    nearest    share of the samples whose shapes are nearest to the usual one: they say how much it scatters, since in
               many of the others a part may be hidden; nearest_sd: of a normal distribution within which so many are
    beyond     standard deviations from the usual shape that are no chance; doubtful: up to which they may well be;
               between the two a change counts in part
    lasting    samples whose median shape is looked at as well
    like_rest  a target's own scatter counts for so many times that of the others at most: it may be hidden often;
               apart: of that scatter, by which its usual shape may differ from theirs by being hidden
    arm        of its radius, at which a change of the second moments is taken to be
    whole      share of the area that it has at most, `but_few` of its samples left out, from which on a target is taken
               to be seen whole: those samples say what is usual of it
    aside      of the width that is added to light that is spread, by which its middle moves: half, where half of the
               light lies aside
    cut        of its radius, by which the middle moves where all but nothing of it is hidden
    about      samples with second moments about one without, whose light and pixels are usual there
    grain      scatter of the logarithms of light and pixels, at least
    at_once    tracks that are looked at together; in_cache: numbers, about, of which the processor's caches hold a few
    """

    fewest: int = 16
    nearest: float = 0.25
    nearest_sd: float = 0.3186
    beyond: float = 5.0
    doubtful: float = 4.5
    lasting: int = 5
    like_rest: float = 2.0
    apart: float = 2.0
    arm: float = 0.6
    whole: float = 0.6
    but_few: float = 0.95
    aside: float = 0.5
    cut: float = 0.85
    about: int = 15
    grain: float = 0.01
    at_once: int = 64
    in_cache: int = 12_000


SHAPES = Shapes()


class ShapeEvidence(NamedTuple):
    """What shapes say.

    position  (2, k, n) px, in the middle of the exposure; sd (2, k, n) px, what shapes add to that of x and y
    exposure  samples; 0: too short to be seen
    mixed     samples by which what moves is seen late at most, where pictures are mixed: no exposure is seen in them
    drawn     over so many samples targets are drawn out where that is longer than any exposure; else 0
    lean      how the picture is read, of frames
    usual     (5, 2) of the targets' shapes, and of two of their running medians, median and scatter; NaN: not known
    """

    position: Array
    sd: Array
    exposure: float
    usual: Array
    mixed: float = 0.0
    drawn: float = 0.0
    lean: Lean = UNKNOWN

    @property
    def blur(self) -> Blur:
        """What motion does to what is seen."""
        return Blur(self.exposure, self.mixed, self.drawn, self.lean)


def shape_evidence(
    values: Array,
    time: Array,
    lines: int = 1,
    of: ShapeEvidence | None = None,
    mixed: float = 0.0,
    *,
    columns: bool = False,
) -> ShapeEvidence:
    """What the shapes in values (MEASURED, k, n) say.

    time  (k,) samples, or (k, n); lines: of the frame buffer to a row of a sample
    of    what other targets of the recording show: its exposure, and its usual shape for those of few samples; mixed:
          as of `ShapeEvidence`
    columns  of a picture that lies on its side: it was read by them, not by rows
    """
    second, position = values[XX : XY + 1], values[[X, Y]]
    velocity, acceleration = _motion(position, time.reshape(len(time), -1))
    seen = np.isfinite(second).all(axis=0) & (values[PIXELS] > 0)
    exposure = UNSEEN if of else exposure_of(second, velocity, acceleration, seen, lines)
    lean = UNKNOWN if of or lines > 1 else leaning(second, position, velocity, seen, columns=columns)
    mixed = max(mixed, exposure.late)
    sd = mixed * np.abs(np.nan_to_num(velocity)) if mixed else np.zeros(velocity.shape)
    if not seen.any():
        return ShapeEvidence(position, sd, 0.0, np.full((5, 2), np.nan), mixed)
    square = of.exposure**2 if of else 0.0 if mixed else exposure.square
    if square:  # in place: the system fills each new array with zeros first
        late = np.multiply(acceleration, square / 24, out=acceleration)
        position -= np.nan_to_num(late)
        sd, ends, streak = np.abs(late), np.abs(velocity), np.nan_to_num(drawn_out(velocity), copy=False)
        sd *= EXPOSURE.unknown
        np.copyto(sd, _rms(late), where=~np.isfinite(late))
        ends *= EXPOSURE.ends * np.sqrt(square)
        np.hypot(sd, np.nan_to_num(ends, copy=False), out=sd)
        second = np.subtract(second, np.multiply(streak, square, out=streak), out=streak)
    area = np.where(seen, values[PIXELS], np.nan) * lines
    shift, usual = _shift(second, area, values[[SD_X, CONTRAST]], None if of is None else of.usual)
    shift = np.where(seen, shift, _hidden(values[[PIXELS, MASS]], seen & ~(shift > 0), lines))
    np.hypot(sd, np.nan_to_num(shift, copy=False), out=sd)
    return ShapeEvidence(position, sd, float(np.sqrt(square)), usual, mixed, exposure.drawn, lean)


def shape_evidence_of_others(
    values: Array, track: Ints, sample: Ints, time: Array, of: ShapeEvidence, lines: int = 1
) -> tuple[Array, Array]:
    """Position and sd (2, N), as `ShapeEvidence` has them, of samples (N,) of tracks in values (MEASURED, N).

    time  (k,) of all samples; of: what the targets show
    """
    position, sd = values[[X, Y]].copy(), np.zeros((2, track.size))
    order = np.lexsort((sample, track))
    cuts = np.flatnonzero(np.diff(track[order])) + 1
    tracks = sorted(np.split(order, cuts), key=len)
    for first in range(0, len(tracks) if track.size else 0, SHAPES.at_once):
        several = tracks[first : first + SHAPES.at_once]
        most = len(several[-1])
        block = np.full((len(values), most, len(several)), np.nan)
        when = np.tile(np.arange(most, dtype=float)[:, None], len(several))
        for i, rows in enumerate(several):
            block[:, : len(rows), i], when[: len(rows), i] = values[:, rows], time[sample[rows]]
            when[len(rows) :, i] += when[len(rows) - 1, i]
        found = shape_evidence(block, when, lines, of, of.mixed)
        for i, rows in enumerate(several):
            position[:, rows], sd[:, rows] = found.position[:, : len(rows), i], found.sd[:, : len(rows), i]
    return position, sd


def _rms(late: Array) -> Array:
    """The rms of each target (2, 1, n), that of all where nothing is known of one; 0 where nothing is of any."""
    known = np.isfinite(late)
    square, count = np.where(known, late**2, 0.0).sum(axis=1, keepdims=True), known.sum(axis=1, keepdims=True)
    every = square.sum(axis=2, keepdims=True) / np.maximum(count.sum(axis=2, keepdims=True), 1)
    return np.asarray(np.sqrt(np.where(count > 0, square / np.maximum(count, 1), every)))


def _motion(position: Array, time: Array) -> tuple[Array, Array]:
    """Velocity and acceleration (2, k, n), px a sample and its square, NaN where a neighbour is missing, the velocity
    where both are; time (k, n) or (k, 1).
    """
    velocity, acceleration = np.full((2, *position.shape), np.nan)
    if len(time) < 2:
        return velocity, acceleration
    step, rate = np.diff(time, axis=0), np.diff(position, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate /= step
    if len(time) > 2:
        before, after, mean, bend = step[:-1], step[1:], velocity[:, 1:-1], acceleration[:, 1:-1]
        np.multiply(rate[:, :-1], after, out=mean)
        np.multiply(rate[:, 1:], before, out=bend)
        mean += bend
        mean /= before + after
        np.subtract(rate[:, 1:], rate[:, :-1], out=bend)
        bend *= 2
        bend /= before + after
    for side in (slice(1, None), slice(None, -1)):
        np.copyto(velocity[:, side], rate, where=~np.isfinite(velocity[:, side]))
    return velocity, acceleration


def _shift(second: Array, area: Array, looks: Array, known: Array | None) -> tuple[Array, Array]:
    """px (k, n), by which a part that is hidden or added may have moved the middle, 0 where the shape is the usual; and
    what is usual (5, 2); known: of other targets; looks (2, k, n): noise, px, of the middle, and contrast.
    """
    size, (noise, contrast) = second[0] + second[1], looks
    with np.errstate(divide="ignore", invalid="ignore"):
        shape = np.stack([(second[0] - second[1]) / size, 2 * second[2] / size, 2 * np.pi * size / area])
        radius = np.sqrt(area / np.pi)
    spread = _spread(size, contrast)
    part = (spread > 0) | (area < SHAPES.whole * _most(np.where(spread > 0, np.nan, area)))
    whole = np.where(part, np.nan, shape) if part.any() else shape
    noise = noise / radius
    far, usual = _from_usual(shape, whole, None if known is None else known[:3], noise)
    several = _middle_ones(shape[:2])
    of_whole = several if whole is shape else _middle_ones(whole[:2])
    lasting, of_several = _from_usual(several, of_whole, None if known is None else known[3:], noise)
    far = np.maximum(far, lasting)
    shift = far * np.nan_to_num(size / (SHAPES.arm * radius))
    return np.maximum(shift, spread), np.concatenate([usual, of_several])


def _spread(size: Array, contrast: Array) -> Array:
    """px (k, n), by which light that lies farther off may have moved the middle, 0 where there is none. What is dimmer
    and wider than at its brightest is seen through something (a drop on the lens). Other light changes no size.
    """
    with np.errstate(invalid="ignore"):
        dim = contrast < SHAPES.whole * _most(contrast)
        if not dim.any():
            return np.zeros(size.shape)
        usual = median(np.where(dim, np.nan, size))
        wide = dim & (size * SHAPES.whole > usual)
        return np.where(wide, SHAPES.aside * np.sqrt(np.maximum(size - usual, 0.0)), 0.0)


def _middle_ones(shape: Array) -> Array:
    """Shapes (c, k, n) as medians of each sample and those about it, NaN where one of them is: what is hidden for
    several samples shows in them before it shows in any one, and a flash of light in none.
    """
    whole, half = SHAPES.lasting, SHAPES.lasting // 2
    middle = np.full(shape.shape, np.nan)
    ends = max(shape.shape[1] - whole + 1, 0)
    each = max(1, SHAPES.in_cache // max(shape[:, 0].size, 1))
    for first in range(0, ends, each):
        n = min(each, ends - first)
        those = [shape[:, first + k : first + k + n].copy() for k in range(whole)]
        spare = np.empty_like(those[0])
        for last in range(whole - 1, half - 1, -1):  # the largest of what is left goes to the end; NaN goes to both
            for j in range(last):
                np.minimum(those[j], those[j + 1], out=spare)
                np.maximum(those[j], those[j + 1], out=those[j + 1])
                those[j], spare = spare, those[j]
        middle[:, first + half : first + half + n] = those[half]
    return middle


def _most(area: Array) -> Array:
    """How large each target (k, n) is but for a few samples, (n,)."""
    seen = np.isfinite(area).any(axis=0)
    most = np.full(area.shape[1], np.nan)
    most[seen] = quantile(area[:, seen], SHAPES.but_few)
    return most


def _from_usual(shape: Array, whole: Array, known: Array | None, noise: Array) -> tuple[Array, Array]:
    """How far shapes (c, k, n) are from what is usual of each target (k, n), 0 where that is chance; and the usual
    shape and scatter of them all (c, 2), those of `known` where it is given, NaN where nothing is known.

    whole  (c, k, n) the shapes of samples that show a target whole, the others NaN
    noise  (k, n) of the middle, in radii: shapes scatter in proportion to it
    What scatters more than the others' shapes is hidden often, and what is usual of it may be a part: as far as it can
    be, its usual shape is theirs.
    """
    count = np.isfinite(whole[0]).sum(axis=0)
    enough = count >= SHAPES.fewest
    usual, scatter = np.full((2, len(shape), shape.shape[2]), np.nan)
    all_of = np.full((len(shape), 2), np.nan)
    if enough.any():
        usual[:, enough], nearest = middle_and_nearest(whole if enough.all() else whole[:, :, enough], SHAPES.nearest)
        scatter[:, enough] = nearest / SHAPES.nearest_sd
        all_of = np.stack([np.nanmedian(usual, axis=1), np.nanmedian(scatter, axis=1)], axis=1)
    if known is not None and np.isfinite(known).all():
        all_of = known
    if not np.isfinite(all_of).all():
        return np.zeros(shape.shape[1:]), all_of
    own_noise = median(np.where(np.isfinite(shape[0]), noise, np.nan))
    noisier = np.fmax(own_noise / np.nanmedian(own_noise), 1.0) if np.isfinite(own_noise).any() else 1.0
    most = SHAPES.like_rest * all_of[:, 1:] * noisier
    theirs = ~enough | ((scatter > most) & (np.abs(usual - all_of[:, :1]) < SHAPES.apart * scatter))
    np.abs(off := shape - np.where(theirs, all_of[:, :1], usual)[:, None], out=off)
    scatter = np.maximum(np.where(enough, np.minimum(scatter, most), most), 1e-6)
    far = np.zeros(shape.shape[1:])
    odd = (off > SHAPES.doubtful * scatter[:, None]).any(axis=0)  # few
    off, scatter = off[:, odd], np.broadcast_to(scatter[:, None], off.shape)[:, odd]
    doubt = (off / scatter - SHAPES.doubtful) / (SHAPES.beyond - SHAPES.doubtful)
    far[odd] = np.max(np.nan_to_num(off * np.clip(doubt, 0.0, 1.0)), axis=0)
    return far, all_of


def _hidden(light: Array, usual: Bools, lines: int) -> Array:
    """px (k, n), by which a part that is hidden or added may have moved the middle of what has no second moments.

    light  (2, k, n) pixels and mass, NaN where not measured; usual (k, n): where the shape is the usual one
    Both must have changed: where two touch, the pixels are shared out as it comes, and a lamp that flickers changes the
    mass alone. In what sense does not matter: a disc that is fitted to the half of one may be larger than the whole.
    """
    shift = np.zeros(usual.shape)
    odd = np.isfinite(light).all(axis=0) & (light > 0).all(axis=0) & ~usual
    who = np.flatnonzero(odd.any(axis=0) & (usual.sum(axis=0) > SHAPES.about // 2))
    if not who.size:
        return shift
    i, at = np.nonzero(odd[:, who].T)
    i, near = who[i], np.empty((at.size, SHAPES.about), np.intp)
    for one in who.tolist():
        own, here = np.flatnonzero(usual[:, one]), i == one
        first = np.clip(np.searchsorted(own, at[here]) - SHAPES.about // 2, 0, max(own.size - SHAPES.about, 0))
        near[here] = own[np.minimum(first[:, None] + np.arange(SHAPES.about), own.size - 1)]
    middle, grain = _trend(near, np.log(light[:, near, i[:, None]]), at)
    change = np.log(light[:, at, i]) - middle
    beyond = np.abs(change[1]) > SHAPES.beyond * np.maximum(grain[1], SHAPES.grain)
    share = -np.expm1(-np.abs(change).min(axis=0))
    radius = np.sqrt(np.exp(middle[0]) * lines / np.pi)
    shift[at, i] = np.where(beyond, SHAPES.cut * share * radius, 0.0)
    return shift


def _trend(near: Ints, about: Array, at: Ints) -> tuple[Array, Array]:
    """What values (2, m, about) of samples `near` (m, about) lead to at samples (m,), and their scatter about that.

    A target that comes nearer gets larger from sample to sample: its light is no scatter. Along a line from the earlier
    half of the samples to the later one, no further beyond them than they reach themselves.
    """
    half = near.shape[1] // 2
    middle = near[:, [half]]
    early, late = row_medians(np.stack([about[..., :half], about[..., -half:]]))
    steps = near[:, -half + half // 2] - near[:, half // 2]
    slope = ((late - early) / np.maximum(steps, 1))[..., None]
    flat = about - slope * (near - middle)
    level = row_medians(flat)
    ahead = np.clip(at - middle[:, 0], 2 * (near[:, 0] - middle[:, 0]), 2 * (near[:, -1] - middle[:, 0]))
    grain = 1.4826 * row_medians(np.abs(flat - level[..., None]))
    return level + slope[..., 0] * ahead, grain
