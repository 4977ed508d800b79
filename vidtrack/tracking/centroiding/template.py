"""The quickest measurement: one matrix product for all targets that stand alone where they are expected.

With a mask that is centred on the target's pixel and a plane fitted to the ring about it, the background-subtracted
mass and first moments are linear in the pixels: the same weights for every target of one size. So the windows of
all targets, one a row, times a matrix of a few columns is the measurement. What is not plainly alone in its window,
at the size it had, is reported as not clear and its window is segmented.

    mass = sum_disc(I) - n b0      m_x = sum_disc(x I) - sum_disc(x^2) b1      x = centre + m_x / (mass - c)
    b0 + b1 x + b2 y: the least-squares plane of the ring, itself linear in I
    c = closed integral over the mask's outline of x I n_x ds: as the target moves out of the middle, the mask cuts off
        light on that side and takes in as much on the other, and m_x grows by mass - c only
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.centroiding.components import CUTTING
from vidtrack.tracking.centroiding.template_weights import MASK, Weights, cut_light, weights
from vidtrack.tracking.centroiding.window import WINDOW, Seen, doubled
from vidtrack.tracking.detect_settings import Detection
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
    SHIFT_X,
    SHIFT_Y,
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
    level = _stored(known.threshold, bright, detection)
    count = _counted(bright, level, w).reshape(k, n)
    noise = _noise(bright, w, detection, n) if careful else known.unrest
    saturated = _at_full_scale(bright, count, w, detection)
    mass, m_x, m_y, background, uneven, *second, inner, outer = moments.reshape(10, k, n)
    mass = np.where(mass > 0, mass, np.nan)
    seen_off = np.stack([m_x / mass, m_y / mass])
    whole_mass = mass - np.minimum(cut_light(inner, outer, seen_off, noise * w.cut_noise), MASK.most_cut * mass)
    off = np.stack([m_x / whole_mass, m_y / whole_mass])
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
    np.divide(noise * w.x_noise, whole_mass, out=values[SD_X])
    np.divide(noise * w.y_noise, whole_mass, out=values[SD_Y])
    if samples[0].lines == 2:
        values[Y] *= 2
        values[Y] += np.array([[sample.parity] for sample in samples])
        values[SD_Y] *= 2
    for row, along, across in ((XX, 0, 0), (YY, 1, 1), (XY, 0, 1)):
        np.subtract(second[row - XX] / mass, seen_off[along] * seen_off[across], out=values[row])
    if samples[0].lines == 2:
        values[YY] *= 4
        values[XY] *= 2
    count = np.maximum(count, 1)
    scaled = np.sqrt(count / known.pixels)
    values[PIXELS], values[MASS], values[BACKGROUND] = count, mass, background
    np.divide(mass, count, out=values[CONTRAST])
    np.multiply(known.size.T[:, None], scaled, out=values[WIDTH : HEIGHT + 1])
    values[SOFT], values[UNREST] = known.soft, known.unrest
    values[SHIFT_X:] = _shift(bright, level, w, detection, whole_mass[0], off[:, 0], mass[0])[:, None]
    values[SHIFT_Y] *= samples[0].lines
    values[PLATEAU] = _lit(bright, level, detection) / count[0] - background[0]
    return Seen(values, clear, saturated)


def _centred(
    samples: Sequence[Sample], predicted: Array, w: Weights, detection: Detection
) -> tuple[NDArray[Any], Array, Ints, NDArray[np.bool_]]:
    """Windows (k n, pixels), turned bright, moved onto their targets; their moments (10, k n); their middle pixels
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


class _Laid:
    """Memory as NumPy asks for it: an array of it is made in half the time of `as_strided`."""

    def __init__(self, how: dict[str, Any], of: NDArray[Any]) -> None:
        self.__array_interface__, self._of = how, of


def _views(luma: NDArray[Any], w: Weights) -> NDArray[Any]:
    """Every window of the picture, (rows - height + 1, columns - width + 1, height), as a view: a row of one is one
    element of a void type, which is quicker to copy, or where pixels are not side by side a last axis more.
    """
    rows, columns = luma.shape
    down, across = luma.strides
    shape, strides = (rows - w.height + 1, columns - w.width + 1, w.height), (down, across, down)
    if across != luma.itemsize:
        return np.lib.stride_tricks.as_strided(luma, (*shape, w.width), (*strides, across), writeable=False)
    how = {"version": 3, "shape": shape, "strides": strides, "typestr": f"|V{w.width * across}"}
    return np.asarray(_Laid(how | {"data": (luma.__array_interface__["data"][0], True)}, luma))


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
    cut = np.empty((corner.shape[1], w.height * w.width), pictures[0].dtype)
    for picture, view, a, b in zip(pictures, views, first[:-1], first[1:], strict=True):
        if a != b:
            cut[a:b] = view[row[a:b], column[a:b]].view(picture.dtype).reshape(b - a, -1)
    beyond = corner - inside
    if beyond.any():  # what is repeated lies in the window of the picture that is nearest
        some = np.flatnonzero(beyond.any(axis=0))
        across, down = beyond[:, some]
        across = np.minimum(np.maximum(across[:, None] + np.arange(w.width), 0), w.width - 1)
        down = np.minimum(np.maximum(down[:, None] + np.arange(w.height), 0), w.height - 1)
        pixel = (down * w.width)[:, :, None] + across[:, None]
        cut[some] = cut[some[:, None], pixel.reshape(some.size, -1)]
    return detection.bright(cut)


def _moments(bright: NDArray[Any], w: Weights, detection: Detection) -> Array:
    """Mass, m_x, m_y and background of windows, grey levels and px, the sum of the harmonics squared, the second
    moments about the window's middle, and what the outline cuts, (10, m).
    """
    found = np.empty((len(bright), w.linear.shape[1]))
    for some in _chunks(bright):
        np.matmul(bright[some].astype(float), w.linear, out=found[some])
    moments = np.empty((10, len(bright)))
    np.multiply(found[:, :4].T, detection.scale, out=moments[:4])
    np.multiply(found[:, 8:].T, detection.scale, out=moments[5:])
    np.einsum("mu,mu->m", found[:, 4:8], found[:, 4:8], out=moments[4])
    moments[4] *= detection.scale * detection.scale
    return moments


def _chunks(bright: NDArray[Any]) -> list[slice]:
    m, pixels = bright.shape
    each = max(1, MASK.pixels_as_floats // pixels)
    return [slice(a, a + each) for a in range(0, m, each)]


def _counted(bright: NDArray[Any], level: NDArray[Any], w: Weights) -> Array:
    """Pixels of k n windows above stored levels (n,) within the mask, and MASK.stray for each without, (k n,)."""
    level = np.concatenate([level] * (len(bright) // level.size))[:, None]
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


def _lit(bright: NDArray[Any], level: NDArray[Any], detection: Detection) -> Array:
    """Sum of the pixels above stored levels (n,) in the windows of the first sample, grey levels, (n,)."""
    first = bright[: level.size]
    lit = first * (first > level[:, None])
    return np.asarray(lit.astype(float) @ np.ones(lit.shape[1]) * detection.scale)


def _shift(
    bright: NDArray[Any], level: NDArray[Any], w: Weights, detection: Detection, whole: Array, off: Array, mass: Array
) -> Array:
    """What their surfaces show of the targets (n,) in the first sample, (2, n) px, as `surface` has it.

    level       (n,) stored levels
    whole, off  what of the mass moves with a target, and where its middle is (2, n) px from the window's
    """
    lowered = np.minimum(bright[: level.size], level[:, None])
    light, along, down = (lowered.astype(float) @ w.moments * detection.scale).T
    light = light - (mass - whole)  # what the outline cuts lies below the threshold
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = off - np.stack([along, down]) / np.where(light > 0, light, np.nan)
        return np.asarray(apart * light / whole)


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
