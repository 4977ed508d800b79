"""The quickest measurement: one matrix product for all targets that stand alone where they are expected.

With a mask that is centred on the target's pixel and a plane fitted to the ring about it, the background-subtracted
mass and first moments are linear in the pixels: the same weights for every target of one size. So the windows of
all targets, one a row, times a matrix of a few columns is the measurement. What is not plainly alone in its window,
at the size it had, is reported as not clear and is left to `look`.

    mass = sum_disc(I) - n b0      m_x = sum_disc(x I) - sum_disc(x^2) b1      x = centre + m_x / mass
    b0 + b1 x + b2 y: the least-squares plane of the ring, itself linear in I
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.tracking.centroids import FULL_SCALE, QUANTISATION_SD
from vidtrack.tracking.detection import Detection
from vidtrack.tracking.look import GRAIN, LIKE, Seen
from vidtrack.tracking.sample import Sample

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Float32 = NDArray[np.float32]

SPARE = 0.25
"""px of the soft edge, as `look` grows it, that hold no light but only noise."""
RECENTRE = 2
"""Times that a window is moved onto its target, before the target counts as not there."""
RING = 4
"""px about the mask, for the background."""
NEAR_CENTRE = 0.6
"""px from the middle of its window's middle pixel up to which a target is well inside its mask."""
OFF_CENTRE = 0.9
"""px: a target further from the middle of its window's middle pixel is not where the mask is."""


class Weights(NamedTuple):
    """Windows (m, height * width) times `linear` (.., 4) are mass, m_x, m_y and the background; times `inside` the sums
    within and without the mask. x_noise, y_noise: sd of m_x, m_y for a noise of 1. ring: columns of the background's
    pixels; across (2, ring): their x and y, each of length 1.
    """

    width: int
    height: int
    linear: Float32
    inside: Float32
    x_noise: float
    y_noise: float
    ring: Ints
    across: Float32


@lru_cache(maxsize=256)
def weights(twice_a: int, twice_b: int) -> Weights:
    """Weights of an elliptical mask of half axes twice_a / 2 and twice_b / 2 px."""
    a, b = twice_a / 2, twice_b / 2
    half_w, half_h = int(np.ceil(a)) + RING, int(np.ceil(b)) + RING
    y, x = np.mgrid[-half_h : half_h + 1, -half_w : half_w + 1].reshape(2, -1).astype(float)
    disc = ((x / a) ** 2 + (y / b) ** 2 <= 1).astype(float)
    ring = ((x / (a + 1)) ** 2 + (y / (b + 1)) ** 2 > 1).astype(float)
    plane = np.linalg.pinv((np.stack([np.ones_like(x), x, y]) * ring).T)  # (3, pixels)
    mass = disc - disc.sum() * plane[0]
    m_x = disc * x - (disc * x * x).sum() * plane[1]
    m_y = disc * y - (disc * y * y).sum() * plane[2]
    linear = np.stack([mass, m_x, m_y, plane[0]], axis=1).astype(np.float32)
    inside = np.stack([disc, 1 - disc], axis=1).astype(np.float32)
    noise = float(np.sqrt((m_x * m_x).sum())), float(np.sqrt((m_y * m_y).sum()))
    columns = np.flatnonzero(ring)
    across = np.stack([x[columns] / np.sqrt((ring * x * x).sum()), y[columns] / np.sqrt((ring * y * y).sum())])
    return Weights(2 * half_w + 1, 2 * half_h + 1, linear, inside, *noise, columns, across.astype(np.float32))


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


def glance(
    samples: Sequence[Sample], predicted: Array, known: Known, detection: Detection, careful: bool = True
) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields), predicted (k, n, 2) px.

    careful  whether the unrest of the background is measured, or taken as known
    """
    k, n = predicted.shape[:2]
    half = known.size.max(axis=0) / 2 + known.soft.max() - SPARE
    w = weights(*np.rint(2 * half).astype(int).tolist())
    rows, columns = samples[0].luma.shape
    if w.width > columns or w.height > rows:
        return Seen(np.full((12, k, n), np.nan), np.zeros((k, n), bool), np.zeros((k, n), bool))
    raw, moments, centre, whole = _centred(samples, predicted, w, detection)
    bright = detection.bright(raw)
    count = _counted(bright, np.tile(known.threshold, k), w, detection)
    noise = _noise(bright, w, detection, n) if careful else known.unrest
    mass = np.where(moments[0] > 0, moments[0], np.nan)
    off = moments[1:3] / mass
    grown = np.maximum(count[0], 1) / np.tile(known.pixels, k)
    alike = np.abs(np.log(grown)) < LIKE + GRAIN / np.tile(known.pixels, k)
    clear = whole & (count[1] == 0) & alike & (count[0] >= detection.min_pixels)
    clear &= (np.abs(off) < OFF_CENTRE).all(axis=0)
    if n > 1:
        clear &= _alone(centre, k, n)
    rough = noise > 2 * np.maximum(known.unrest, max(detection.noise, QUANTISATION_SD))
    lines = samples[0].lines
    parity = np.repeat([sample.parity for sample in samples], n) if lines == 2 else 0
    x, y = centre.T + off
    sd = np.tile(noise, k) / mass
    scaled = np.sqrt(grown)
    size, soft, unrest = (np.tile(values, k) for values in (known.size.T, known.soft, known.unrest))
    values = [
        *(x, y * lines + parity, sd * w.x_noise, sd * w.y_noise * lines, count[0], mass),
        *(mass / np.maximum(count[0], 1), moments[3], size[0] * scaled, size[1] * scaled, soft, unrest),
    ]
    full = _at_full_scale(bright, count[0], w, detection)
    return Seen(np.stack(values).reshape(12, k, n), clear.reshape(k, n) & ~rough, full.reshape(k, n))


def _centred(
    samples: Sequence[Sample], predicted: Array, w: Weights, detection: Detection
) -> tuple[NDArray[Any], Array, Ints, NDArray[np.bool_]]:
    """Windows (k n, pixels) as stored, moved onto their targets; their moments (4, k n); their middle pixels (k n, 2),
    in rows of the sample; and whether they lie within the picture.
    """
    k, n = predicted.shape[:2]
    rows, columns = samples[0].luma.shape
    reach = np.array([w.width // 2, w.height // 2])
    low, high = reach - RING, np.array([columns, rows]) - 1 - reach + RING  # middles whose mask is in the picture
    at = predicted.reshape(k * n, 2).copy()
    if samples[0].lines == 2:
        at[:, 1] = (at[:, 1] - np.repeat([sample.parity for sample in samples], n)) / 2
    centre = np.rint(at).astype(np.intp)
    whole = ((centre >= low) & (centre <= high)).all(axis=1)
    centre = np.clip(centre, low, high)
    pictures = [sample.luma for sample in samples]
    if (centre < reach + 2 * RING).any() or (centre > high - 3 * RING).any():
        pictures = [_with_margin(p, 2 * RING) for p in pictures]
        margin = 2 * RING
    else:
        margin = 0
    raw = np.empty((k * n, w.height * w.width), samples[0].luma.dtype)
    strips = [_strips(picture, w.width) for picture in pictures]
    for j, one in enumerate(strips):
        raw[j * n : j * n + n] = _windows(one, centre[j * n : j * n + n] - reach + margin, w)
    moments = _grey(raw, detection) @ w.linear
    missed = np.arange(k * n)
    for _ in range(RECENTRE):
        off = moments[missed, 1:3] / np.maximum(moments[missed, :1], 1e-3)
        moving = ((np.abs(off) > NEAR_CENTRE) & (np.abs(off) <= reach)).any(axis=1)
        missed, off = missed[moving], off[moving]
        if not missed.size:
            break
        centre[missed] += np.rint(np.clip(off, -reach, reach)).astype(np.intp)
        whole[missed] &= ((centre[missed] >= low) & (centre[missed] <= high)).all(axis=1)
        centre[missed] = np.clip(centre[missed], low, high)
        if not margin and ((centre < reach) | (centre > high - RING)).any():
            whole[missed] &= ((centre[missed] >= reach) & (centre[missed] <= high - RING)).all(axis=1)
            centre[missed] = np.clip(centre[missed], reach, high - RING)
        for j, one in enumerate(strips):
            some = missed[(missed >= j * n) & (missed < j * n + n)]
            if some.size:
                raw[some] = _windows(one, centre[some] - reach + margin, w)
        moments[missed] = _grey(raw[missed], detection) @ w.linear
    return raw, np.ascontiguousarray(moments.T, float), centre, whole


def _with_margin(picture: NDArray[Any], margin: int) -> NDArray[Any]:
    """The picture with its outermost pixels repeated all round, so that a ring may reach beyond its edge."""
    wide = cv2.copyMakeBorder(picture, margin, margin, margin, margin, cv2.BORDER_REPLICATE)
    return np.asarray(wide)


def _counted(bright: NDArray[Any], threshold: Array, w: Weights, detection: Detection) -> Float32:
    """Pixels above the threshold within the mask and without, (2, windows)."""
    level = threshold / detection.scale
    if bright.dtype.kind == "u":
        level = np.clip(np.floor(level), 0, np.iinfo(bright.dtype).max)
    counted: Float32 = ((bright > level.astype(bright.dtype)[:, None]).astype(np.float32) @ w.inside).T
    return counted


def _at_full_scale(bright: NDArray[Any], count: Float32, w: Weights, detection: Detection) -> NDArray[np.bool_]:
    """Whether at least a twentieth of each target is at full scale."""
    if not bright.size or bright.max() * detection.scale < FULL_SCALE:
        return np.zeros(len(bright), bool)
    full = (bright >= FULL_SCALE / detection.scale).astype(np.float32) @ w.inside[:, 0]
    return np.asarray(full * 20 >= np.maximum(count, 1))


def _strips(luma: NDArray[Any], width: int) -> NDArray[Any]:
    """Every run of `width` pixels in a row of the picture, (rows, columns - width + 1, width), as a view."""
    rows, columns = luma.shape
    down, across = luma.strides
    shape = (rows, columns - width + 1, width)
    return np.lib.stride_tricks.as_strided(luma, shape, (down, across, across), writeable=False)


def _windows(strips: NDArray[Any], corner: Ints, w: Weights) -> NDArray[Any]:
    """Windows (m, height * width) whose first pixels are at corner (m, 2): column and row."""
    cut: NDArray[Any] = strips[corner[:, 1:] + np.arange(w.height), corner[:, :1]]
    return cut.reshape(len(corner), w.height * w.width)


def _grey(raw: NDArray[Any], detection: Detection) -> Float32:
    """Grey levels of pictures turned bright."""
    grey = detection.bright(raw).astype(np.float32)
    return grey if detection.scale == 1 else grey * np.float32(detection.scale)


def _noise(bright: NDArray[Any], w: Weights, detection: Detection, n: int) -> Array:
    """(n,) grey levels, what the background plane leaves in the ring of the first sample; the rest are like it."""
    values = bright[:n, w.ring].astype(np.float32) * np.float32(detection.scale)
    values -= values.mean(axis=1, keepdims=True)
    slopes = values @ w.across.T
    squares = np.einsum("nr,nr->n", values, values) - np.einsum("nc,nc->n", slopes, slopes)
    noise = np.sqrt(np.maximum(squares, 0) / (w.ring.size - 3))
    return np.asarray(np.maximum(noise, QUANTISATION_SD), float)


def _alone(centre: Ints, k: int, n: int) -> NDArray[np.bool_]:
    """False where two targets of one sample have the same middle pixel, or nearly."""
    key = ((np.repeat(np.arange(k), n) << 40) + (centre[:, 1] // 2 << 20)) + centre[:, 0] // 2
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    alone = np.ones(key.size, bool)
    alone[order[same]] = alone[order[same + 1]] = False
    return alone
