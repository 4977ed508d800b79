"""How much more centroids scatter than noise and contrast explain, from their own tracks.

The sd of a centroid comes from the noise of the background about it. A codec keeps less noise there than it leaves
at the rim of what moves; noise that reached the codec correlated counts more than the same noise from pixel to pixel;
and a sharp edge is sampled by pixels. All of that shows in the track: the d-th differences of smooth motion sampled
at a high rate vanish, those of independent errors have the variance

    sum_i binomial(d, i)^2 sd^2

so the rms of differences over their sd is the factor that sd falls short by. Any motion that is left in them adds,
so the least factor of several d counts. What does not depend on motion at all is the light of the target: errors of
its pixels change its mass too. A track that scatters far more than the mass bears out moves roughly by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints


@dataclass(frozen=True)
class Differences:
    """How the noise of tracks is estimated from their differences.

    orders             d: of motion that swings w rad a sample (2 sin(w/2))^d is left over; of its noise, all
    fewest             differences from which a factor is estimated
    later              samples apart at which errors are compared with those of neighbours
    at_most            differences of all targets that are used, about
    long_tail          sd that one difference counts for at most, the sd by the median: errors of codecs have long tails
    knock              sd beyond which a difference is that of a knock or a bounce, and does not count at all
    position_to_light  largest ratio of a track's scatter to that of its light still taken as noise; seen: at most 3.3
                       with any codec, and 1.9 with none
    lasting            times that errors grow over `later` samples, at most: light that does so by more flickers
    soft_edge_px       about the pixels above the threshold that belong to the centroid
    creeping_px        a sample: what moves less is coded once and copied from then on, errors included
    uneven, often      share of the usual step by which steps differ, and of all steps, where the rate varies
    steps              share of the usual step by which steps may differ that are compared at such a rate
    at_rest            # ASSUME: share of moving targets' factor that those at rest have (measured 0.4 to 1.2 with
                       H.264, 1 with MPEG-2)
    """

    orders: tuple[int, ...] = (4, 6, 8, 10)
    fewest: int = 5
    later: int = 4
    at_most: int = 20_000
    long_tail: float = 4.0
    knock: float = 30.0
    position_to_light: float = 4.0
    lasting: float = 6.0
    soft_edge_px: float = 1.25
    creeping_px: float = 0.1
    uneven: float = 0.05
    often: float = 0.1
    steps: float = 1.1
    at_rest: float = 0.8


DIFFERENCES = Differences()


class Scatter(NamedTuple):
    """Of each target.

    factor  (2, n) what sd_x and sd_y are to be multiplied with; never below 1, and 1 where nothing can be estimated
    track   (2, n) rms of the track's differences over what sd explains; NaN where there are too few
    light   (n,) the same of the mass
    rough   (n,) the track scatters, and the light does not: the factor is that of the light
    lasting times that errors of samples that lie apart differ more than those of neighbours, of all targets together
    """

    factor: Array
    track: Array
    light: Array
    rough: Bools
    lasting: float = 1.0


def scatter(position: Array, sd: Array, mass: Array, pixels: Array, time: Array, lines: int = 1) -> Scatter:
    """Estimate the errors of n targets in k samples from their tracks.

    position, sd  (2, k, n) px, NaN where not measured; mass (k, n) grey levels; pixels (k, n) above the threshold
    time          (k,) samples; differences across a gap in it do not count. lines: of the frame buffer to a row
    """
    of_mass = mass_sd(sd[0], mass, pixels, lines)
    light, later = (least_over_sd(mass[None], of_mass[None], time, stride)[0] for stride in (1, DIFFERENCES.later))
    track = least_over_sd(position, sd, time)
    borne_out = np.fmax(light, 1.0)
    rough = (track > DIFFERENCES.position_to_light * borne_out).any(axis=0)
    track = track * (lasting := _lasting(light, later))
    factor = np.fmax(np.where(rough, np.minimum(track, borne_out), track), 1.0)
    usable = moves(position) & np.isfinite(track).all(axis=0) & ~rough
    return Scatter(_with_silent(factor, usable | rough, usable), track, light, rough, lasting)


def rms_error(position: Array, time: Array) -> Array:
    """The rms error of tracks, px (2, n), as their differences show it: positions (2, k, n) px at times (k,), samples.

    NaN where a track has too few samples in a row.
    """
    return least_over_sd(position, np.ones(position.shape), time)


class Changes(NamedTuple):
    """Differences of one order of values (c, k, n).

    starts  (m,) samples at which they begin; stride: samples from one to the next; weights (order + 1,) of these, or
            (order + 1, m, 1) where samples are uneven; squares (c, m, n)
    """

    starts: Ints
    stride: int
    weights: Array
    squares: Array

    def of(self, i: int) -> Ints | slice:
        """The i-th sample of each."""
        return in_a_row(self.starts + i * self.stride)


def in_a_row(at: Ints) -> Ints | slice:
    """Places that rise, as a slice where they can be: then nothing need be copied out."""
    return slice(at[0], at[-1] + 1) if at.size and at[-1] - at[0] + 1 == at.size else at


def changes_of(values: Array, time: Array, stride: int = 1) -> list[Changes]:
    """The differences of values (c, k, n) of samples `stride` apart, of all orders that are looked at.

    Where the steps of time differ, those of the times as they are follow: which of the two are the moments of the
    exposures is not known here (stamps of arrival scatter, those of a rate that varies are true).
    """
    breaks, most = _breaks(time), max(DIFFERENCES.fewest, DIFFERENCES.at_most // max(values.shape[2], 1))
    found = [_changes(values, breaks, order, stride, most) for order in DIFFERENCES.orders]
    step = np.diff(time)
    if step.size and (np.abs(step / np.median(step) - 1) > DIFFERENCES.uneven).mean() > DIFFERENCES.often:
        breaks = _breaks(time, DIFFERENCES.steps)
        found += [_changes(values, breaks, order, stride, most, time) for order in DIFFERENCES.orders]
    return found


def _changes(
    values: Array, breaks: Ints, order: int, stride: int = 1, most: int | None = None, time: Array | None = None
) -> Changes:
    starts = _unbroken(breaks, order * stride)
    starts = starts if most is None else spread(starts, most)
    weights = np.array([(-1) ** i * comb(order, i) for i in range(order + 1)], float)
    if time is not None:
        weights = _divided(time, starts, order, stride) * np.sqrt((weights**2).sum())
    change = np.zeros((values.shape[0], starts.size, values.shape[2]))
    found, spare = Changes(starts, stride, weights, change), np.empty(change.shape)
    for i, weight in enumerate(weights):  # in place: the system fills each new array with zeros first
        change += np.multiply(values[:, found.of(i)], weight, out=spare)
    np.multiply(change, change, out=change)
    return found


def _divided(time: Array, starts: Ints, order: int, stride: int) -> Array:
    """Weights (order + 1, m, 1) of divided differences, of which the squares of each sum to 1: polynomials of a degree
    below `order` vanish in them at any times.
    """
    at = time[starts[None] + stride * np.arange(order + 1)[:, None]]
    apart = (at[:, None] - at[None]) / max(float(np.median(np.diff(time))) * stride, 1e-300)
    apart[np.arange(order + 1), np.arange(order + 1)] = 1.0
    weights = 1 / apart.prod(axis=1)
    return np.asarray((weights / np.sqrt((weights**2).sum(axis=0)))[..., None])


def least_over_sd(values: Array, sd: Array, time: Array, stride: int = 1) -> Array:
    """rms of the differences of values (c, k, n) of samples `stride` apart, over what sd (c, k, n) lets expect: the
    least by all orders (c, n), NaN where there are too few.
    """
    return least_of(changes_of(values, time, stride), sd)


def least_of(changes: Sequence[Changes], sd: Array) -> Array:
    """The same from the differences."""
    return np.asarray(np.fmin.reduce([over_sd(one, sd) for one in changes]))


def over_sd(changes: Changes, sd: Array) -> Array:
    """rms over k of differences, over what sd (c, k, n) lets expect: (c, n)."""
    share = _over_variance(changes, sd)
    known = np.isfinite(share)
    count = _count(known)
    square = _median(share, count) / 0.6745**2
    known &= share <= DIFFERENCES.knock**2 * square[:, None]  # NaN is never less
    if not known.all():
        count, share = _count(known), np.where(known, share, 0.0)
    square = np.minimum(share, DIFFERENCES.long_tail**2 * square[:, None]).sum(axis=1) / np.maximum(count, 1)
    return np.where(count >= DIFFERENCES.fewest, np.sqrt(square), np.nan)


def differences(values: Array, sd: Array, time: Array, order: int) -> tuple[Ints, Array, Array]:
    """Differences of values (c, k, n) squared, over what their sd (c, k, n) lets expect; NaN where it says nothing.

    First the samples (m,) at which they begin, then the differences (c, m, n), then the weights of the samples in each.
    """
    found = _changes(values, _breaks(time), order)
    return found.starts, _over_variance(found, sd), found.weights


def _over_variance(changes: Changes, sd: Array) -> Array:
    """The squares (c, m, n) over what sd (c, k, n) lets expect of them; NaN where it says nothing."""
    variance, spare = np.zeros(changes.squares.shape), np.empty(changes.squares.shape)
    for i, weight in enumerate(changes.weights):
        np.multiply(sd[:, changes.of(i)], weight, out=spare)
        variance += np.multiply(spare, spare, out=spare)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.divide(changes.squares, variance, out=spare)
    if (nothing := variance == 0).any():
        share[nothing] = np.nan
    return share


def _lasting(light: Array, later: Array) -> float:
    """By how much errors of samples that are `later` apart differ more than those of neighbours: codecs repeat errors.

    Of all targets together; their light shows it without any motion. A light that itself flickers says nothing of
    errors: it scatters more than those of any codec. A slow flicker looks like a still pattern beside the course, which
    does move the middle, and grows them as much.
    """
    ratio = later / np.where(light > 0, light, np.nan)
    known = ratio[np.isfinite(ratio) & (light < DIFFERENCES.position_to_light)]
    return min(max(1.0, float(np.median(known))), DIFFERENCES.lasting) if known.size else 1.0


def _breaks(time: Array, share: float = 0.25) -> Ints:
    """How many steps that are longer or shorter than most, by more than a share of these, lie before each sample
    (k,)."""
    step = np.diff(time)
    usual = np.median(step) if step.size else 0.0
    return np.concatenate([[0], np.cumsum(np.abs(step - usual) > share * usual)])


def _unbroken(breaks: Ints, span: int) -> Ints:
    """First samples of all stretches of span + 1 samples that follow each other in step."""
    return np.flatnonzero(breaks[span:] == breaks[: max(breaks.size - span, 0)])


def spread(starts: Ints, most: int) -> Ints:
    """At most so many of them, all over the recording, in step with no group of pictures."""
    if starts.size <= most:
        return starts
    golden = np.modf(np.arange(1, most + 1) * 0.6180339887)[0]
    chosen = np.zeros(starts.size, bool)
    chosen[(golden * starts.size).astype(np.intp)] = True
    return starts[chosen]


def _count(known: Bools) -> Ints:
    """How many (c, n) of the second axis are known."""
    return np.full((len(known), known.shape[2]), known.shape[1]) if known.all() else known.sum(axis=1)


def _median(values: Array, count: Ints) -> Array:
    """Medians over the second axis, NaN left out; count (c, n) of the others."""
    if not values.size:
        return np.full(count.shape, np.nan)
    middle = np.maximum(count - 1, 0) // 2
    if (middle == middle[0, 0]).all():  # no order of the others is needed
        return np.asarray(np.partition(values, middle[0, 0], axis=1)[:, middle[0, 0]])
    ordered = np.sort(values, axis=1)  # NaN come last
    return np.asarray(np.take_along_axis(ordered, middle[:, None], axis=1)[:, 0])


def mass_sd(sd_x: Array, mass: Array, pixels: Array, lines: int) -> Array:
    """Grey levels, what the noise that makes sd_x does to the mass of an elliptical target.

    sd_x = noise sqrt(sum x^2) / mass, and sum x^2 = lines A^2 / (4 pi) over an area of A pixels that is a circle in
    the frame buffer. What the background's plane adds to both is nearly the same.
    """
    return np.asarray(sd_x * mass * np.sqrt(4 * np.pi / (lines * _area(pixels, lines))))


def per_grey_level(mass: Array, pixels: Array, lines: int) -> Array:
    """px that the centroid of an elliptical target is off by for one grey level of noise in each pixel, as above."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(lines / (4 * np.pi)) * _area(pixels, lines) / mass)


def _area(pixels: Array, lines: int) -> Array:
    """Pixels that belong to a centroid of so many above the threshold."""
    return np.asarray(np.pi * (np.sqrt(lines * pixels / np.pi) + DIFFERENCES.soft_edge_px) ** 2 / lines)


def moves(position: Array) -> Bools:
    """Which targets do more than creep, (n,)."""
    step = np.abs(np.diff(position, axis=1)).max(axis=0)
    return np.asarray(_median(step[None], np.isfinite(step).sum(axis=0)[None])[0] > DIFFERENCES.creeping_px)


def _with_silent(factor: Array, own: Bools, usable: Bools) -> Array:
    """The factors (2, n), those that are not a target's own grown to what others of the recording show.

    Where a codec copies a block from picture to picture its error stays: no difference shows it at rest.
    """
    if not usable.any() or own.all():
        return factor
    usual = np.median(factor[:, usable], axis=1, keepdims=True)
    return np.where(own, factor, np.maximum(factor, DIFFERENCES.at_rest * usual))
