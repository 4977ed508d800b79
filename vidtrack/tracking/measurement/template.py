"""The quickest measurement: one matrix product for all targets that stand alone where they are expected.

With a mask that is centred on the target's pixel and a plane fitted to the ring about it, the background-subtracted
mass and first moments are linear in the pixels: the same weights for every target of one size. So the windows of
all targets, one a row, times a matrix of a few columns is the measurement. What is not plainly alone in its window,
at the size it had, is reported as not clear and its window is segmented.

    mass = sum_disc(I) - n b0      m_x = sum_disc(x I) - sum_disc(x^2) b1      x = centre + m_x / mass
    b0 + b1 x + b2 y: the least-squares plane of the ring, itself linear in I
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.measurement.background import SURROUNDINGS
from vidtrack.tracking.measurement.components import CUTTING
from vidtrack.tracking.measurement.window import WINDOW, Seen, doubled
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import (
    BACKGROUND,
    CONTRAST,
    HEIGHT,
    MASS,
    PIXELS,
    PLATEAU,
    SD_X,
    SD_Y,
    SOFT,
    UNREST,
    VALUES,
    WIDTH,
    XX,
    XY,
    YY,
    X,
    Y,
)

Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class Mask:
    """The mask of a template, and where it is valid.

    spare_px          of the soft edge, as segmentation grows it, that hold no light but only noise
    recentred         times that a window is moved onto its target, before the target counts as not there
    ring_px           about the mask, for the background
    near_centre_px    from the centre of its window's middle pixel up to which a target is well inside its mask
    off_centre_px     a target further from the centre of its window's middle pixel is not where the mask is
    uneven_ring       sigmas by which four harmonics of a ring may differ from a plane by chance: at 5.5, two windows in
                      a thousand of compressed video did. A false neighbour costs a segmentation, but no accuracy
    stray             pixels that one outside of the mask counts as: more than any target has
    pixels_as_floats  made floats at once, about: more no longer fit the processor's caches
    """

    spare_px: float = 0.25
    recentred: int = 2
    ring_px: int = 3
    near_centre_px: float = 0.6
    off_centre_px: float = 0.9
    uneven_ring: float = 8.0
    stray: float = 2.0**20
    pixels_as_floats: int = 100_000


MASK = Mask()


class Weights(NamedTuple):
    """Windows (m, height * width) times `linear` (.., 11) are mass, m_x, m_y, the background; how the ring differs from
    a plane: its second and third harmonic about the target, each with a noise of 1 for a noise of 1; and the second
    moments of the light.

    pull           px by which one grey level of those may have moved the target, times its mass
    inside            weights of what is counted: 1 within the mask, MASK.stray without
    x_noise, y_noise  sd of m_x, m_y for a noise of 1
    ring              columns of the background's pixels; across (2, ring): their x and y, each of length 1
    """

    width: int
    height: int
    linear: Array
    pull: float
    inside: Float32
    x_noise: float
    y_noise: float
    ring: Ints
    across: Array


@lru_cache(maxsize=256)
def weights(twice_a: int, twice_b: int) -> Weights:
    """Weights of an elliptical mask of half axes twice_a / 2 and twice_b / 2 px."""
    a, b = twice_a / 2, twice_b / 2
    half_w, half_h = int(np.ceil(a)) + MASK.ring_px, int(np.ceil(b)) + MASK.ring_px
    y, x = np.mgrid[-half_h : half_h + 1, -half_w : half_w + 1].reshape(2, -1).astype(float)
    disc = ((x / a) ** 2 + (y / b) ** 2 <= 1).astype(float)
    ring = ((x / (a + 1)) ** 2 + (y / (b + 1)) ** 2 > 1).astype(float)
    plane = np.linalg.pinv((np.stack([np.ones_like(x), x, y]) * ring).T)  # (3, pixels)
    mass = disc - disc.sum() * plane[0]
    m_x = disc * x - (disc * x * x).sum() * plane[1]
    m_y = disc * y - (disc * y * y).sum() * plane[2]
    uneven = _harmonics(x / a, y / b, ring, plane, np.stack([np.ones_like(x), x, y]))
    second = [disc * along - (disc * along).sum() * plane[0] for along in (x * x, y * y, x * y)]
    linear = np.stack([mass, m_x, m_y, plane[0], *uneven, *second], axis=1)
    pull = float(np.hypot(m_x, m_y)[ring > 0].sum() / np.sqrt((uneven**2).sum(axis=0))[ring > 0].sum())
    inside = (disc + MASK.stray * (1 - disc)).astype(np.float32)
    noise = float(np.sqrt((m_x * m_x).sum())), float(np.sqrt((m_y * m_y).sum()))
    columns = np.flatnonzero(ring)
    across = np.stack([x[columns] / np.sqrt((ring * x * x).sum()), y[columns] / np.sqrt((ring * y * y).sum())])
    return Weights(2 * half_w + 1, 2 * half_h + 1, linear, pull, inside, *noise, columns, across)


def _harmonics(x: Array, y: Array, ring: Array, plane: Array, powers: Array) -> Array:
    """Weights (4, pixels) of length 1 for cos 2t, sin 2t, cos 3t and sin 3t over the ring, blind to any plane.

    x, y (pixels,) in half axes; ring: 1 on it; plane and powers (3, pixels) such that plane @ I are the coefficients
    of the powers. The outer pixels weigh more: a neighbour comes in from there
    """
    around = ((x + 1j * y) / np.hypot(x, y).clip(1e-9)) ** np.array([[2], [3]]) * ring * (np.hypot(x, y) - 1)
    bare = np.concatenate([around.real, around.imag])
    blind = bare - (bare @ powers.T) @ plane
    return np.asarray(blind / np.linalg.norm(blind, axis=1, keepdims=True))


class Known(NamedTuple):
    """What is known of n targets since they were last seen.

    size       (n, 2) width px and height in rows of the sample; soft (n,) px of soft edge
    unrest     (n,) grey levels, what the background is used to leave after its plane
    pixels     (n,) above the threshold (n,), grey levels on pictures turned bright
    """

    size: Array
    soft: Array
    unrest: Array
    pixels: Array
    threshold: Array


def apply_template(
    samples: Sequence[Sample], predicted: Array, known: Known, detection: Detection, careful: bool = True
) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields), predicted (k, n, 2) px.

    careful  whether the unrest of the background is measured, or taken as known
    """
    k, n = predicted.shape[:2]
    half = known.size.max(axis=0) / 2 + known.soft.max() - MASK.spare_px
    w = weights(*np.rint(2 * half).astype(int).tolist())
    rows, columns = samples[0].luma.shape
    if w.width > columns or w.height > rows:
        return Seen(np.full((VALUES, k, n), np.nan), np.zeros((k, n), bool), np.zeros((k, n), bool))
    bright, moments, centre, whole = _centred(samples, predicted, w, detection)
    count = _counted(bright, known.threshold, w, detection).reshape(k, n)
    noise = _noise(bright, w, detection, n) if careful else known.unrest
    saturated = _at_full_scale(bright, count, w, detection)
    mass, m_x, m_y, background, uneven, *second = moments.reshape(8, k, n)
    mass = np.where(mass > 0, mass, np.nan)
    off = np.stack([m_x / mass, m_y / mass])
    unlike = np.exp(WINDOW.same_size + WINDOW.grain / known.pixels)
    least = np.maximum(known.pixels / unlike, detection.min_pixels)
    clear = whole.reshape(k, n) & (count >= least) & (count < np.minimum(known.pixels * unlike, MASK.stray))
    clear &= (np.abs(off) < MASK.off_centre_px).all(axis=0)
    quiet = np.maximum(known.unrest, max(detection.noise, SURROUNDINGS.quantisation_sd))
    clear &= noise <= 2 * quiet
    clear &= uneven <= np.maximum(MASK.uneven_ring * quiet, mass * (WINDOW.pull_px / w.pull)) ** 2
    if n > 1 and (twice := doubled(centre, k, n)) is not None:
        clear &= ~twice
    values = np.empty((VALUES, k, n))
    np.add(centre.reshape(2, k, n), off, out=values[X : Y + 1])
    np.divide(noise * w.x_noise, mass, out=values[SD_X])
    np.divide(noise * w.y_noise, mass, out=values[SD_Y])
    if samples[0].lines == 2:
        values[Y] *= 2
        values[Y] += np.array([[sample.parity] for sample in samples])
        values[SD_Y] *= 2
    for row, along, across in ((XX, 0, 0), (YY, 1, 1), (XY, 0, 1)):
        np.subtract(second[row - XX] / mass, off[along] * off[across], out=values[row])
    if samples[0].lines == 2:
        values[YY] *= 4
        values[XY] *= 2
    count = np.maximum(count, 1)
    scaled = np.sqrt(count / known.pixels)
    values[PIXELS], values[MASS], values[BACKGROUND] = count, mass, background
    np.divide(mass, count, out=values[CONTRAST])
    np.multiply(known.size.T[:, None], scaled, out=values[WIDTH : HEIGHT + 1])
    values[SOFT], values[UNREST] = known.soft, known.unrest
    values[PLATEAU] = _lit(bright, known.threshold, detection) / count[0] - background[0]
    return Seen(values, clear, saturated)


def _centred(
    samples: Sequence[Sample], predicted: Array, w: Weights, detection: Detection
) -> tuple[NDArray[Any], Array, Ints, NDArray[np.bool_]]:
    """Windows (k n, pixels), turned bright, moved onto their targets; their moments (8, k n); their middle pixels
    (2, k n), column and row of the sample; and whether their masks lie within the picture (k n).
    """
    k, n = predicted.shape[:2]
    rows, columns = samples[0].luma.shape
    reach = np.array([[w.width // 2], [w.height // 2]])
    # middles whose mask is in the picture
    low, high = reach - MASK.ring_px, np.array([[columns], [rows]]) - 1 - reach + MASK.ring_px
    at = predicted.reshape(k * n, 2).T
    if samples[0].lines == 2:
        parity = np.repeat([sample.parity for sample in samples], n)
        at = np.stack([at[0], (at[1] - parity) / 2])
    wanted = np.rint(at).astype(np.intp)
    centre = np.minimum(np.maximum(wanted, low), high)
    whole = (wanted == centre).all(axis=0)
    pictures = [sample.luma for sample in samples]
    views = [_views(picture, w) for picture in pictures]
    each = list(range(0, k * n + 1, n))
    bright = _windows(pictures, views, each, centre - reach, w, detection)
    moments = _moments(bright, w, detection)
    missed = np.arange(k * n)
    for _ in range(MASK.recentred):
        here = moments if missed.size == k * n else moments[:, missed]
        off = here[1:3] / np.maximum(here[0], 1e-3)
        far = np.abs(off)
        moving = ((far > MASK.near_centre_px) & (far <= reach)).any(axis=0)
        if not moving.any():
            break
        missed, off = missed[moving], off[:, moving]
        wanted = centre[:, missed] + np.rint(np.minimum(np.maximum(off, -reach), reach)).astype(np.intp)
        moved = np.minimum(np.maximum(wanted, low), high)
        whole[missed] &= (wanted == moved).all(axis=0)
        centre[:, missed] = moved
        first = np.searchsorted(missed, each).tolist()
        again = _windows(pictures, views, first, moved - reach, w, detection)
        bright[missed] = again
        moments[:, missed] = _moments(again, w, detection)
    return bright, moments, centre, whole


def _views(luma: NDArray[Any], w: Weights) -> NDArray[Any]:
    """Every window of the picture, (rows - height + 1, columns - width + 1, height), as a view: a row of one is one
    element of a void type, which is quicker to copy, or where pixels are not side by side a last axis more.
    """
    rows, columns = luma.shape
    down, across = luma.strides
    shape = (rows - w.height + 1, columns - w.width + 1, w.height, w.width)
    views = np.lib.stride_tricks.as_strided(luma, shape, (down, across, down, across), writeable=False)
    return views.view(f"V{w.width * across}")[..., 0] if across == luma.itemsize else views


def _windows(
    pictures: Sequence[NDArray[Any]],
    views: Sequence[NDArray[Any]],
    first: Sequence[int],
    corner: Ints,
    w: Weights,
    detection: Detection,
) -> NDArray[Any]:
    """Windows (m, height * width), turned bright: those from first[j] to first[j + 1] are cut from picture j.

    corner  (2, m) column and row of their first pixels. Beyond the picture's edge, where a ring may reach, its
            outermost pixels are repeated
    """
    rows, columns = pictures[0].shape
    inside = np.minimum(np.maximum(corner, 0), [[columns - w.width], [rows - w.height]])
    column, row = inside
    beyond = (inside != corner).any(axis=0)
    outside = bool(beyond.any())
    cut = np.empty((corner.shape[1], w.height * w.width), pictures[0].dtype)
    for picture, view, a, b in zip(pictures, views, first[:-1], first[1:], strict=True):
        if a == b:
            continue
        cut[a:b] = view[row[a:b], column[a:b]].view(picture.dtype).reshape(b - a, -1)
        if outside and (some := a + np.flatnonzero(beyond[a:b])).size:
            x, y = corner[:, some]
            down = np.minimum(np.maximum(y[:, None] + np.arange(w.height), 0), rows - 1)
            across = np.minimum(np.maximum(x[:, None] + np.arange(w.width), 0), columns - 1)
            cut[some] = picture[down[:, :, None], across[:, None]].reshape(some.size, -1)
    return detection.bright(cut)


def _moments(bright: NDArray[Any], w: Weights, detection: Detection) -> Array:
    """Mass, m_x, m_y and background of windows, grey levels and px, the sum of the harmonics squared, and the second
    moments about the window's middle, (8, m).
    """
    found = np.empty((len(bright), w.linear.shape[1]))
    for some in _chunks(bright):
        np.matmul(bright[some].astype(float), w.linear, out=found[some])
    moments = np.empty((8, len(bright)))
    np.multiply(found[:, :4].T, detection.scale, out=moments[:4])
    np.multiply(found[:, 8:].T, detection.scale, out=moments[5:])
    np.einsum("mu,mu->m", found[:, 4:8], found[:, 4:8], out=moments[4])
    moments[4] *= detection.scale * detection.scale
    return moments


def _chunks(bright: NDArray[Any]) -> list[slice]:
    m, pixels = bright.shape
    each = max(1, MASK.pixels_as_floats // pixels)
    return [slice(a, a + each) for a in range(0, m, each)]


def _counted(bright: NDArray[Any], threshold: Array, w: Weights, detection: Detection) -> Array:
    """Pixels of k n windows above the thresholds (n,) within the mask, and MASK.stray for each without, (k n,)."""
    level = np.resize(_stored(threshold, bright, detection), len(bright))[:, None]
    count = np.empty(len(bright), np.float32)
    for some in _chunks(bright):
        np.matmul((bright[some] > level[some]).astype(np.float32), w.inside, out=count[some])
    return count.astype(float)


def _stored(threshold: Array, bright: NDArray[Any], detection: Detection) -> NDArray[Any]:
    """Thresholds (n,), grey levels, as stored values: integers compare fastest with their own kind."""
    level = threshold / detection.scale
    if bright.dtype.kind == "u":
        level = np.minimum(np.maximum(np.floor(level), 0), np.iinfo(bright.dtype).max)
    return np.asarray(level.astype(bright.dtype))


def _lit(bright: NDArray[Any], threshold: Array, detection: Detection) -> Array:
    """Sum of the pixels above the thresholds (n,) in the windows of the first sample, grey levels, (n,)."""
    first = bright[: threshold.size]
    lit = first * (first > _stored(threshold, bright, detection)[:, None])
    return np.asarray(lit.sum(axis=1, dtype=float) * detection.scale)


def _at_full_scale(bright: NDArray[Any], count: Array, w: Weights, detection: Detection) -> NDArray[np.bool_]:
    """Whether at least a twentieth of each target (k, n) is at full scale."""
    if not bright.size or bright.max() * detection.scale < CUTTING.full_scale:
        return np.zeros(count.shape, bool)
    within = (w.inside == 1).astype(np.float32)
    full = (bright >= CUTTING.full_scale / detection.scale).astype(np.float32) @ within
    return np.asarray(full.reshape(count.shape) * 20 >= np.maximum(count, 1))


def _noise(bright: NDArray[Any], w: Weights, detection: Detection, n: int) -> Array:
    """(n,) grey levels, what the background plane leaves in the ring of the first sample; the rest are like it."""
    values = bright[:n, w.ring] * detection.scale
    values -= values.mean(axis=1, keepdims=True)
    slopes = values @ w.across.T
    squares = np.einsum("nr,nr->n", values, values) - np.einsum("nc,nc->n", slopes, slopes)
    noise = np.sqrt(np.maximum(squares, 0) / (w.ring.size - 3))
    return np.asarray(np.maximum(noise, SURROUNDINGS.quantisation_sd), float)
