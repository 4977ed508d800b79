"""What a lossy coder adds to the errors of centroids, as their tracks show it.

A coder rounds what it stores: behind it a flat background is smooth, and what it left out is missing at the rim of what
moves. The noise of the background then varies from place to place and says little of the errors of a target. Those are
estimated instead: a level c, grey levels, the same for all samples of a target, so that with

    variance = sd^2 + c^2 g^2 h^2,    g = what one grey level of noise in each pixel moves the centroid by, px

the differences of its track are as large as they should be. Along x and y c is much the same, so that short tracks
share it. h is 1 but where the track shows more than that: the differences about a sample, or a few, are larger.

Where pictures are built on others an error is copied with what it belongs to and goes on until the target has moved to
other pixels: the errors of a target that does v px a sample resemble those of the sample before by exp(-v / L), and the
differences of neighbours show only tanh(v / 2L) of their variance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.side_by_side import side_by_side
from vidtrack.tracking.centroiding.order_statistics import median
from vidtrack.tracking.uncertainty.empirical_sd import (
    DIFFERENCES,
    Changes,
    Scatter,
    changes_of,
    differences,
    in_a_row,
    least_of,
    least_over_sd,
    mass_sd,
    moves,
    over_sd,
    per_grey_level,
)


@dataclass(frozen=True)
class CodingNoise:
    """How the level is estimated.

    light        a track that scatters so many times as much as its light, by one level of noise for all its samples,
                 moves roughly by itself; seen: at most 4.5 in 540 films of five coders
    falls_short  times the sd that a track scatters by from which on there is something to estimate
    alike        samples of a track at which its own level counts as much as the mean of x and y
    copied_px    L; errors of x264, mpeg2video and mpeg4 at 0.3 to 0.6 px a sample resemble their neighbours by 0.4,
                 at 1 to 1.5 by 0.15
    of_light     times that errors of light seem to last where pictures copy nothing and errors of places do not: blocks
                 of Motion JPEG do so by 1.0 to 1.8, nine films of ten by up to 1.5; a still pattern beside the course,
                 which moves the middle, by 3 to 6
    unseen       of the variance of errors to that of differences, at most: what creeps may say anything
    over         samples before and after, over which a target's speed is taken
    about        samples before and after one, over which its differences are compared with the others'
    motionless   times the least scatter by all orders of differences, up to which one of them holds no motion
    usual        differences as they should be that are counted with those, so that a few say little
    chance       times that the differences about a sample, squared, exceed the others' by chance
    at_most      times the level that a sample may have
    rounds       of the estimate at most; close: times that the differences may be off by then
    at_once      numbers of a table that are worked on together; in_cache: of which the processor's caches hold a few
    """

    light: float = 5.0
    falls_short: float = 1.2
    alike: float = 100.0
    copied_px: float = 0.7
    of_light: float = 1.5
    unseen: float = 16.0
    over: int = 4
    about: int = 3
    motionless: float = 1.15
    usual: float = 4.0
    chance: float = 1.5
    at_most: float = 6.0
    rounds: int = 8
    close: float = 1.02
    at_once: int = 200_000
    in_cache: int = 60_000


CODING_NOISE = CodingNoise()


class Coded(NamedTuple):
    """What was found.

    level  (2, n) grey levels, c; 0 where the sd explains the scatter
    left   (2, n) factor by which errors are larger still; 1 where they are not
    seen   as `scatter` finds it, its factor the median growth of the sd
    """

    level: Array
    left: Array
    seen: Scatter


def with_coding_noise(
    position: Array, sd: Array, mass: Array, pixels: Array, time: Array, seen: Scatter, *, lines: int, copied: bool
) -> tuple[Array, Coded]:
    """The sd (2, k, n) px of n targets in k samples, with what a coder adds, and what was found; all as `scatter` has
    it, which has found `seen`.

    copied  whether pictures are built on others
    """
    factor, level = seen.factor, np.zeros(seen.factor.shape)
    short = (np.nan_to_num(seen.track) > CODING_NOISE.falls_short).any(axis=0)
    if not short.any():
        return sd * factor[:, None], Coded(level, factor, seen)
    g = per_grey_level(mass, pixels, lines)
    rough = seen.rough & _still_rough(position, sd, mass, pixels, time, g, lines, seen.rough)
    every, left, grown = np.flatnonzero(short & ~rough), factor.copy(), sd * factor[:, None]
    several = max(1, CODING_NOISE.at_once // max(len(time), 1))

    def grow(own: Ints) -> None:
        level[:, own], left[:, own], grown[:, :, own] = _grown(
            position[:, :, own], sd[:, :, own], g[:, own], time, seen.lasting, copied=copied
        )

    side_by_side(grow, [every[first : first + several] for first in range(0, every.size, several)])
    rest = ~moves(position) & ~rough
    if rest.any() and (usable := ~rest & ~rough & np.isfinite(seen.track).all(axis=0)).any():
        usual = DIFFERENCES.at_rest * np.median(level[:, usable], axis=1, keepdims=True)
        own = np.flatnonzero(rest & (usual > level).any(axis=0))
        level[:, own] = np.maximum(level[:, own], usual)
        left[:, own] = np.maximum(DIFFERENCES.at_rest * np.median(left[:, usable], axis=1, keepdims=True), 1.0)
        grown[:, :, own] = _with_level(sd[:, :, own], level[:, own], g[:, own], left[:, own])
    with np.errstate(invalid="ignore", divide="ignore"):
        growth = grown / sd
        usual = np.stack([_middle(values) for values in growth])
    seen = seen._replace(factor=np.where(np.isfinite(usual), usual, factor), rough=rough)
    return grown, Coded(level, left, seen)


def others_with_level(sd: Array, mass: Array, pixels: Array, of: Coded, lines: int) -> Array:
    """The sd (2, N) px of samples of other tracks, with what is usual of the targets in it."""
    if not of.level.shape[1]:
        return sd
    level, left = (np.median(values, axis=1, keepdims=True) for values in (of.level, of.left))
    return np.asarray(np.hypot(sd, level * per_grey_level(mass, pixels, lines)) * left)


def _still_rough(
    position: Array, sd: Array, mass: Array, pixels: Array, time: Array, g: Array, lines: int, rough: Bools
) -> Bools:
    """Which of the rough ones (n,) scatter more than their light where one level of noise is taken for all samples.

    A background that a coder has made smooth at some places makes sd that differ by more than errors do.
    """
    out = rough.copy()
    for i in np.flatnonzero(rough).tolist():
        level = sd[..., i] / g[:, i]
        common = np.sqrt(np.nanmean(level**2)) * g[:, i]
        even = np.broadcast_to(common, (2, *common.shape))[..., None]
        track = least_over_sd(position[..., [i]], even, time)
        of_mass = mass_sd(even[0], mass[:, [i]], pixels[:, [i]], lines)
        light = least_over_sd(mass[None, :, [i]], of_mass[None], time)[0]
        out[i] = bool((track > CODING_NOISE.light * np.fmax(light, 1.0)).any())
    return out


def _grown(
    position: Array, sd: Array, g: Array, time: Array, lasting: float, *, copied: bool
) -> tuple[Array, Array, Array]:
    """Level (2, n), the factor that is left (2, n) and the sd (2, k, n) px of some targets."""
    k = len(time)
    shown = _shown(position, time) if copied else np.ones(g.shape)
    raw, light = sd * sd, g * g
    level, over = np.zeros((2, sd.shape[2])), np.ones((2, sd.shape[2]))
    changes = changes_of(position, time)
    with np.errstate(invalid="ignore", divide="ignore"):
        of_noise = np.stack([_middle(values) for values in raw / (shown * light)])
        for _ in range(CODING_NOISE.rounds):
            expected = raw + (level**2)[:, None] * light * shown
            over = np.nan_to_num(least_of(changes, np.sqrt(expected)), nan=1.0)
            if (over < CODING_NOISE.close).all():
                break
            level = np.sqrt(level**2 + np.maximum(over**2 - 1, 0) * (of_noise + level**2))
        mean = (level**2).mean(axis=0)
        level = np.sqrt((k * level**2 + CODING_NOISE.alike * mean) / (k + CODING_NOISE.alike))
        coded = (level**2)[:, None] * light
        uneven = _uneven(position, np.sqrt(raw + coded * shown), time, changes)
        known = np.sqrt(_middle(shown)) if copied else 1 / CODING_NOISE.of_light
        known = np.where(level > 0, known, 1.0)  # what a coder explains of light whose errors last
        left = np.fmax(over * np.fmax(lasting * known, 1.0), 1.0)
        return level, left, np.sqrt(raw + coded * uneven) * left[:, None]


def _shown(position: Array, time: Array) -> Array:
    """Share (k, n) of the variance of copied errors that differences of neighbours show, by how fast targets move."""
    at = np.arange(len(time))
    first, last = np.maximum(at - CODING_NOISE.over, 0), np.minimum(at + CODING_NOISE.over, len(time) - 1)
    with np.errstate(invalid="ignore"):
        speed = np.hypot(*(position[:, last] - position[:, first])) / (time[last] - time[first])[:, None]
    speed = np.where(np.isfinite(speed), speed, np.nan_to_num(_middle(speed), nan=np.inf))
    return np.asarray(np.maximum(np.tanh(speed / (2 * CODING_NOISE.copied_px)), 1 / CODING_NOISE.unseen))


def _uneven(position: Array, sd: Array, time: Array, changes: Sequence[Changes]) -> Array:
    """Times (k, n) that the variance of samples is larger than of most, 1 and more: h^2.

    By the differences of the track of which a sample is part, each weighted by its share in it; and by those of the
    samples about. Of the lowest order in which no motion is left: one of a higher order has a share of more samples.
    """
    uneven = np.ones(position.shape[1:])
    by_order = np.stack([over_sd(one, sd).max(axis=0) for one in changes[: len(DIFFERENCES.orders)]])
    order = np.argmax(by_order <= CODING_NOISE.motionless * np.fmin.reduce(by_order), axis=0)
    for of in np.unique(order).tolist():
        own = np.flatnonzero(order == of)
        several = max(1, CODING_NOISE.in_cache // max(len(time), 1))
        for first in range(0, own.size, several):
            some = own[first : first + several]
            uneven[:, some] = _uneven_by(position[..., some], sd[..., some], time, DIFFERENCES.orders[of])
    return uneven


def _uneven_by(position: Array, sd: Array, time: Array, order: int) -> Array:
    """The same, by differences of one order."""
    found, count = np.zeros((2, *position.shape[1:]))
    number, share, weight = differences(position, sd, time, order)
    known = np.isfinite(share) & (share < DIFFERENCES.knock**2)
    share[~known] = 0.0
    total, some = share.sum(axis=0), known.sum(axis=0).astype(float)
    del share, known
    for i, part in enumerate(weight**2 / (weight**2).sum()):
        at = in_a_row(number + i)
        found[at] += part * total
        count[at] += part * some
    here = (found + CODING_NOISE.usual / 4) / (count + CODING_NOISE.usual / 4)
    about = (_about(found) + CODING_NOISE.usual) / (_about(count) + CODING_NOISE.usual)
    return np.asarray(np.clip(np.maximum(here, about) / CODING_NOISE.chance, 1.0, CODING_NOISE.at_most**2))


def _about(values: Array) -> Array:
    """Sums (k, n) of the samples about each."""
    total, k, about = np.zeros((len(values) + 1, values.shape[1])), len(values), CODING_NOISE.about
    np.cumsum(values, axis=0, out=total[1:])
    sums = np.empty(values.shape)
    sums[: max(k - about, 0)], sums[max(k - about, 0) :] = total[about + 1 :], total[-1]
    sums[about:] -= total[: max(k - about, 0)]
    return sums


def _with_level(sd: Array, level: Array, g: Array, left: Array) -> Array:
    return np.asarray(np.hypot(sd, level[:, None] * g) * left[:, None])


def _middle(values: Array) -> Array:
    """Medians of columns (k, n), NaN left out."""
    return np.asarray(median(values) if len(values) else np.full(values.shape[1], np.nan))
