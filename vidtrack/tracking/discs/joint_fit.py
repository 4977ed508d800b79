"""Discs that overlap, or that something hides in part, fitted together to the pixels that show them.

Each disc is that of `disc_fit`, s_i its share of a pixel, A_i its light. A disc in front covers those behind it:

    I = sum_i A_i (s_i - o_ij)   j in front of i;   o_ij = the share that both cover

Blurred straight edges with normals n_i, n_j cover together what the bivariate normal distribution of correlation
n_i n_j says: s_i s_j where they are at right angles, the lesser of both where they run alike, and s_i + s_j - 1 or
nothing where they face each other. Between those o_ij is interpolated by 2/pi asin |n_i n_j|, which is exact on the
edges themselves (Sheppard's formula).

Of discs as bright as each other it does not matter which is in front; of others each order is tried. What is known of
the discs from when they were alone (half axes, light, blur) is prior knowledge with its own sd, so that a rim of which
a part is hidden still says where the middle is. What moves during the exposure is the mean of such pictures over its
stations. Damped Gauss-Newton as in `disc_fit`; one window at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.disc_fit import DISC_FIT, Float32, grid_variance, soft_disc


@dataclass(frozen=True)
class JointFit:
    """How discs are fitted together.

    steps          of the iteration, at most; settled_px: a step of x and y that ends it; sharp_px: blur
                   below which pixels are cut into four
    first, again   sd of log half axes, of the light (share) and of log blur that are known from appearance alone, and
                   from an earlier fit
    alike          ratio of lights below which it does not matter which disc is in front
    reach_px       about a disc, in which pixels count
    overlap        of the smaller diameter, by which two discs may overlap and still be separated
    hidden         the same, up to which a course is known; course_px: largest sd of that
    steep          overlap at which the variance is twice the linearised one: it grows as its 8th power
    visible        share of a disc that must be seen; alone: of one that overlaps others by no more than `beside`, as
                   its sd says how little that is: 430 with 0.04 to 0.35 behind bright ropes, rms of error over sd 0.96
    cusp           of the blur, at radius 1, falling as 1 / sqrt(radius): error in x and y where two blurred outlines
                   meet; it grows as 1 + 40 overlap^4; measured on drawn discs
    misfit         of the light of the dimmest disc: rms that a fit may leave, besides three times the noise
    unlike         times the noise, that a fit of discs leaves at most: what is beyond is a shade, a neighbour, another
    of_one_cause   outline, and the pixels of this share of a disc err alike by it
    moved          of a half axis, by which a disc may be off where it was expected, and moved_px besides
    known_to       of a half axis: a larger sd is no measurement
    station_px     of what moves during the exposure, from one station to the next; stations: of them, at most
    """

    steps: int = 14
    sharp_px: float = 0.35
    settled_px: float = 1e-3
    first: tuple[float, float, float] = (0.12, 0.2, 0.6)
    again: tuple[float, float, float] = (0.02, 0.05, 0.15)
    alike: float = 1.08
    reach_px: float = 4.0
    overlap: float = 0.6
    hidden: float = 0.85
    course_px: float = 0.5
    steep: float = 0.48
    visible: float = 0.35
    alone: float = 0.06
    beside: float = 0.05
    cusp: float = 0.025
    misfit: float = 0.06
    unlike: float = 1.2
    of_one_cause: float = 0.25
    moved: float = 0.6
    moved_px: float = 2.0
    known_to: float = 0.2
    station_px: float = 2.0
    stations: int = 16


JOINT_FIT = JointFit()
SHAPE = 4
"""log half axes in x and y, log of the light (grey levels) and log of the blur (px): what is known of a disc."""


class Shapes(NamedTuple):
    """What is known of m discs before a fit: value (SHAPE, m), and sd (SHAPE, m) of it."""

    value: Array
    sd: Array


class Joint(NamedTuple):
    """Discs (m,): px as the window counts them; light (grey levels, summed); fitted shapes (SHAPE, m).

    good  every disc is where it was expected, seen well enough, and what is left is little
    left  rms that the fit leaves, grey levels
    course  the fit says well enough where each disc goes, though discs may overlap by more than allows a measurement
    """

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    mass: Array
    shape: Array
    good: bool
    left: float
    course: bool


def shapes_of(pixels: Array, size: Array, contrast: Array) -> Shapes:
    """What the looks (m,) of targets, size (2, m) px, say of their discs."""
    aspect = np.log(np.maximum(size[0], 1.0) / np.maximum(size[1], 1.0)) / 2
    radius = np.log(np.sqrt(np.maximum(pixels, 1.0) / np.pi))
    value = np.stack([radius + aspect, radius - aspect, np.log(np.maximum(contrast, 1.0)), np.full(radius.shape, -0.4)])
    log_axis, light, blur = JOINT_FIT.first
    return Shapes(value, np.repeat([[log_axis], [log_axis], [light], [blur]], radius.size, axis=1))


def shapes_again(fitted: Array) -> Shapes:
    """What an earlier fit (SHAPE, m) says of them."""
    log_axis, light, blur = JOINT_FIT.again
    return Shapes(fitted, np.repeat([[log_axis], [log_axis], [light], [blur]], fitted.shape[1], axis=1))


def fit_together(
    data: Float32,
    free: Bools,
    clipped: Bools,
    x: Array,
    y: Array,
    known: Shapes,
    noise: float,
    enough: float = 0.0,
    drawn: Array | None = None,
) -> Joint:
    """Fit m discs in one window.

    data     (height, width) grey levels above the background
    free     pixels that show the discs or their surroundings; clipped: those at full scale, which only say that the
             light is not below
    x, y     (m,) px, column and row, where they are expected; noise: grey levels, of a pixel
    enough   rms, grey levels: where less is left, the fit ends before its place has settled
    drawn    (2, 2, m) px: the ways of the discs during the exposure, and their bends, as `stations_of` has them; x, y
             are the middle of all; None: they stand still
    """
    m = x.size
    stations = np.zeros((1, 2, m)) if drawn is None else stations_of(drawn)
    begin = np.concatenate([[x, y], known.value])
    prior_sd = np.concatenate([np.full((2, m), np.inf), known.sd])
    height, width = data.shape
    rows, columns = np.arange(height, dtype=float)[:, None, None], np.arange(width, dtype=float)
    axes = np.exp(known.value[:2])
    reach = axes + JOINT_FIT.reach_px + np.abs(stations).max(axis=0)
    in_x, in_y = np.abs(columns - x[:, None]) < reach[0][:, None], np.abs(rows[:, :, 0] - y).T < reach[1][:, None]
    near = (in_x[:, None] & in_y[:, :, None]).any(axis=0)
    weight = (free & near).astype(float)
    light = np.exp(known.value[2])
    orders = [tuple(range(m))]
    if m > 1 and light.max() > JOINT_FIT.alike * light.min():
        orders = list(permutations(range(m)))[:6]
    spare = max(float(weight.sum()) - 6 * m, 1.0)
    little = enough**2 * spare
    fits = [
        _descend(data, weight, clipped, rows, columns, begin, prior_sd, noise, order, little, stations)
        for order in orders
    ]
    best, cost, normal, shares = min(fits, key=lambda fit: fit[1])
    scatter = np.sqrt(cost / spare)
    variance = np.diagonal(np.linalg.inv(normal + 1e-9 * np.eye(6 * m)))
    radius2 = np.exp(best[2] + best[3])
    beyond = max(float(scatter) ** 2 - (JOINT_FIT.unlike * noise) ** 2, 0.0)
    of_one_cause = np.maximum(np.pi * radius2 * JOINT_FIT.of_one_cause, 1)
    linear = (max(noise, scatter) ** 2 + beyond * of_one_cause) * np.maximum(variance.reshape(6, m)[:2], 0)
    size2 = radius2 + np.exp(2 * best[5])
    blur = np.exp(best[5])
    overlap = _overlap(best, np.sqrt(radius2))
    cusps = (JOINT_FIT.cusp * blur) ** 2 / np.sqrt(radius2) * np.nan_to_num(1 + 40 * overlap**4)
    linear = linear * (1 + np.nan_to_num(overlap / JOINT_FIT.steep) ** 8)
    sd = np.sqrt(linear * (1 + DISC_FIT.curved * linear / size2) + grid_variance(size2, blur) + cusps)
    mass = np.exp(best[4]) * np.pi * (size2 + 1 / 12)
    away = np.abs(best[:2] - begin[:2])
    good = bool((away < JOINT_FIT.moved * axes + JOINT_FIT.moved_px).all())
    good &= scatter < max(3 * noise, JOINT_FIT.misfit * float(np.exp(best[4]).min()))
    good &= bool((sd < JOINT_FIT.known_to * np.exp(best[2:4]) + 0.05).all())
    good &= bool((np.abs(best[2:5] - known.value[:3]) < 4 * known.sd[:3] + 0.05).all())
    course = good and bool((np.nan_to_num(overlap) < JOINT_FIT.hidden).all() and (sd < JOINT_FIT.course_px).all())
    good &= bool((np.nan_to_num(overlap) < JOINT_FIT.overlap).all())
    least = np.where(np.nan_to_num(overlap) > JOINT_FIT.beside, JOINT_FIT.visible, JOINT_FIT.alone)
    good &= bool((_seen(shares, weight) > least).all())
    return Joint(best[0], best[1], sd[0], sd[1], mass, best[2:], good, float(scatter), course)


def _overlap(best: Array, radius: Array) -> Array:
    """Of each disc (m,), the share of the smaller diameter by which another disc overlaps it at most; NaN where no disc
    touches it.
    """
    m = radius.size
    out = np.full(m, np.nan)
    for i in range(m):
        for j in range(m):
            if i != j:
                gap = float(np.hypot(*(best[:2, i] - best[:2, j]))) - radius[i] - radius[j]
                if gap < 3 * float(np.exp(best[5, i])):
                    out[i] = np.fmax(out[i], max(0.0, -gap) / (2 * min(radius[i], radius[j])))
    return out


def _seen(shares: Array, weight: Array) -> Array:
    """Share of each disc (m,) that pixels show; shares (height, m, width), what each disc covers and is not covered."""
    own, visible = shares
    return np.asarray((visible * weight[:, None]).sum(axis=(0, 2)) / np.maximum(own.sum(axis=(0, 2)), 1e-6))


def _descend(
    data: Float32,
    weight: Array,
    clipped: Bools,
    rows: Array,
    columns: Array,
    begin: Array,
    prior_sd: Array,
    noise: float,
    order: tuple[int, ...],
    little: float,
    stations: Array,
) -> tuple[Array, float, Array, Array]:
    """Best unknowns (6, m), their squares, the normal matrix (6 m, 6 m) and the shares of the discs; ends where the
    squares are below `little`.
    """
    m = begin.shape[1]
    pull = (noise / prior_sd) ** 2
    trial = best = begin
    cost, total, damping = np.inf, np.inf, 1e-3
    normal, gradient, shares = np.eye(6 * m), np.zeros(6 * m), np.zeros((2, *data.shape[:1], m, data.shape[1]))
    longest = np.array([1.0, 1.0, 0.3, 0.3, 0.3, 0.5])[:, None]
    for done in range(JOINT_FIT.steps):
        model, slopes, now = _scene_of_exposure(trial, rows, columns, order, stations)
        free = weight * ~(clipped & (model >= data))
        left = (data - model) * free
        squares = float((left * left).sum(dtype=float))
        behind = begin - trial
        with_prior = squares + float((pull * behind * behind).sum())
        if with_prior < total:
            best, cost, total, shares = trial, squares, with_prior, now
            damping = max(damping / 5, 1e-9)
            flat = (slopes * free).reshape(6 * m, -1)
            normal = flat @ flat.T + np.diag(pull.ravel())
            gradient = flat @ left.ravel() + (pull * behind).ravel()
        else:
            damping = min(damping * 10, 1e9)
        scale = np.maximum(np.diagonal(normal), 1e-6)
        step = np.linalg.solve(normal + np.diag(damping * scale), gradient).reshape(6, m)
        step = np.clip(step, -longest, longest)
        settled = done > 0 and np.abs(step[:2]).max() < JOINT_FIT.settled_px  # at first the shape is but known
        if with_prior == total and (cost < little or settled):
            break
        trial = best + step
        trial[5] = np.clip(trial[5], np.log(DISC_FIT.least_px), 1.5)
    return best, cost, normal, shares


def stations_of(drawn: Array) -> Array:
    """Places (k, 2, m) px of discs during an exposure, off their mean: t L + (t^2 - 1/12) B, t from -1/2 to 1/2.

    drawn  (2, 2, m) px: the ways L and the bends B, in x and y
    """
    longest = float(np.hypot(*drawn[0]).max())
    k = int(np.clip(np.ceil(longest / JOINT_FIT.station_px), 1, JOINT_FIT.stations))
    t = ((np.arange(k) + 0.5) / k - 0.5)[:, None, None]
    return np.asarray(t * drawn[0] + (t * t - 1 / 12) * drawn[1])


def _scene_of_exposure(
    unknowns: Array, rows: Array, columns: Array, order: tuple[int, ...], stations: Array
) -> tuple[Array, Array, Array]:
    """As `_scene`, the mean over the stations (k, 2, m) of an exposure."""
    if len(stations) == 1:
        return _scene(unknowns, rows, columns, order)
    total: list[Array] = []
    for off in stations:
        moved = unknowns.copy()
        moved[:2] += off
        scene = _scene(moved, rows, columns, order)
        total = [a + b for a, b in zip(total, scene, strict=True)] if total else list(scene)
    model, by, shares = (sums / len(stations) for sums in total)
    return model, by, shares


def _scene(unknowns: Array, rows: Array, columns: Array, order: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Light (height, width), its derivatives by x, y, log axes, log light and log blur of each disc (6, m, height,
    width), and the shares (2, height, m, width): what each disc covers, and what of that nothing covers.
    """
    m = unknowns.shape[1]
    light = np.exp(unknowns[4])
    single = unknowns.copy()
    single[4] = 1.0
    fine = bool((unknowns[5] < np.log(JOINT_FIT.sharp_px)).any())
    share, slopes = soft_disc(single, rows, columns, fine=fine)  # (h, m, w), (6, h, m, w)
    share = np.clip(share, 0.0, 1.0)
    across, down = columns - unknowns[0, :, None], rows - unknowns[1, :, None]
    away = np.hypot(across, down) + 1e-3
    across, down = across / away, down / away
    visible, own, fronts = share.copy(), np.ones_like(share), {}
    for rank, k in enumerate(order):
        for i in order[:rank]:
            both, by_front, by_back = _both(
                share[:, i], share[:, k], across[:, i] * across[:, k] + down[:, i] * down[:, k]
            )
            left = 1 - both / np.maximum(share[:, k], 1e-6)
            fronts[i, k] = by_front, left
            visible[:, k] *= left
            own[:, k] *= 1 - by_back
    model = (visible * light[None, :, None]).sum(axis=1)
    by = np.empty((6, m, *model.shape))
    for rank, i in enumerate(order):
        gain = light[i] * own[:, i]
        for k in order[rank + 1 :]:
            by_front, left = fronts[i, k]
            others = visible[:, k] / np.maximum(share[:, k] * left, 1e-6) if m > 2 else 1.0
            gain = gain - light[k] * by_front * others
        for q in (0, 1, 2, 3, 5):
            by[q, i] = slopes[q][:, i] * gain
        by[4, i] = light[i] * visible[:, i]
    return model, by, np.stack([share, visible])


def _both(front: Array, back: Array, alike: Array) -> tuple[Array, Array, Array]:
    """What both of two discs cover of pixels, given their shares and the cosine between their edges' normals, and its
    derivatives by the two shares.
    """
    f = np.arcsin(np.clip(np.abs(alike), 0, 1)) * (2 / np.pi)
    same, less = alike > 0, front < back
    beyond = front + back > 1
    bound = np.where(same, np.where(less, front, back), np.where(beyond, front + back - 1, 0))
    by_front = np.where(same, less, beyond)
    by_back = np.where(same, ~less, beyond)
    product = front * back
    return product + f * (bound - product), back + f * (by_front - back), front + f * (by_back - front)
