"""A look at where targets should be: one small window a target and sample, all measured at once.

This is what happens in nearly every frame. The windows are as small as the targets allow; a target that is not
plainly itself in its window is reported as not clear, and a wider search (`seek`) decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.centroids import Components, Windows, components, cut, measure
from vidtrack.detection import Detection
from vidtrack.sample import Sample

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

CLEAR = 3
"""px between a target and its window's border that its soft edge needs."""
ROOM = 11
"""px about a target in its window: the soft edge, the background, and room for it to be off by five."""
LIKE = 0.6
"""|log| of the ratio of pixel counts up to which a patch is taken for the target itself: between 0.55 and 1.8."""
_GRAIN = 8


class Seen(NamedTuple):
    """What each window showed, (k samples, n targets), frame-buffer px and grey levels; NaN where nothing was measured.

    height is in rows of the sample; clear: this is the target, whole and alone.
    """

    x: Array
    y: Array
    sd_x: Array
    sd_y: Array
    pixels: Array
    mass: Array
    contrast: Array
    background: Array
    width: Array
    height: Array
    clear: Bools
    saturated: Bools


def look(
    samples: Sequence[Sample],
    predicted: Array,
    *,
    size: Array,
    pixels: Array,
    threshold: Array,
    detection: Detection,
) -> Seen:
    """Look for n targets in k samples of one kind (frames or fields).

    predicted  (k, n, 2) px where each should be; size (n, 2) width px and height in rows of the sample, and
    pixels     (n,) of the target when last seen; threshold (n,) grey levels on pictures turned bright
    """
    k, n = predicted.shape[:2]
    rows, columns = samples[0].luma.shape
    need = size + 2 * ROOM
    kind = _sorts(need)
    parts = []
    for group in np.unique(kind):
        who = np.flatnonzero(kind == group)
        side = (np.ceil(need[who].max(axis=0) / _GRAIN) * _GRAIN).astype(int)
        width, height = min(int(side[0]), columns), min(int(side[1]), rows)
        parts.append(
            (who, _look_alike(samples, predicted[:, who], width, height, pixels[who], threshold[who], detection))
        )
    if len(parts) == 1:
        return parts[0][1]
    whole = Seen._make(np.empty((k, n), values.dtype) for values in parts[0][1])
    for who, seen in parts:
        for values, piece in zip(whole, seen, strict=True):
            values[:, who] = piece
    return whole


def _sorts(need: Array) -> Ints:
    """Targets of about the same size share windows: one sort unless the largest is twice the smallest."""
    side = need.max(axis=1)
    if side.size == 0 or side.max() <= 2 * side.min():
        return np.zeros(side.size, np.intp)
    sort: Ints = np.ceil(np.log2(side / side.min()) - 1e-9).astype(np.intp)
    return sort


def _look_alike(
    samples: Sequence[Sample],
    predicted: Array,
    width: int,
    height: int,
    pixels: Array,
    threshold: Array,
    detection: Detection,
) -> Seen:
    k, n = predicted.shape[:2]
    rows, columns = samples[0].luma.shape
    lines = samples[0].lines
    parity = np.array([sample.parity for sample in samples])[:, None]
    at_x, at_y = predicted[..., 0], (predicted[..., 1] - parity) / lines
    left = np.clip(np.rint(at_x - (width - 1) / 2), 0, columns - width).astype(np.intp)
    top = np.clip(np.rint(at_y - (height - 1) / 2), 0, rows - height).astype(np.intp)
    raw = np.empty((height, k * n, width), samples[0].luma.dtype)
    for j, sample in enumerate(samples):
        raw[:, j * n : (j + 1) * n] = cut(sample.luma, left[j], top[j], width, height)
    windows = Windows(detection.bright(raw), left.ravel(), top.ravel(), detection.scale)
    found = components(windows, np.tile(threshold, k))
    chosen = _nearest(found, at_x.ravel(), at_y.ravel(), np.tile(pixels, k), detection.min_pixels)
    c = measure(windows, found, chosen, noise=detection.noise, kind=detection.centroid)
    box = [np.where(chosen >= 0, values[chosen] if values.size else 0, 0) for values in found[4:8]]
    clear = _clear(chosen, box, windows, c.pixels, np.tile(pixels, k)) & np.isfinite(c.x) & np.isfinite(c.y)
    clear &= _alone(box, np.repeat(np.arange(k), n))
    shaped = [
        np.asarray(v, float).reshape(k, n) for v in (*c[:4], c.pixels, c.mass, c.contrast, c.background, *box[2:])
    ]
    seen = Seen._make([*shaped, clear.reshape(k, n), c.saturated.reshape(k, n)])
    return seen._replace(y=seen.y * lines + parity, sd_y=seen.sd_y * lines)


def _nearest(found: Components, x: Array, y: Array, pixels: Array, min_pixels: int) -> Ints:
    """For each window the patch that is nearest to the prediction and most alike in size; -1 for none."""
    chosen = np.full(x.size, -1, np.intp)
    enough = found.pixels >= min_pixels
    which = np.arange(found.window.size) if enough.all() else np.flatnonzero(enough)
    window = found.window[which]
    if window.size > 1 and (np.diff(np.sort(window)) == 0).any():
        off = np.hypot(found.x[which] - x[window], found.y[which] - y[window])
        off += 4 * np.abs(np.log(found.pixels[which] / pixels[window]))
        order = np.lexsort((off, window))
        window, first = np.unique(window[order], return_index=True)
        which = which[order[first]]
    chosen[window] = which
    return chosen


def _clear(chosen: Ints, box: list[Ints], windows: Windows, now: Ints, before: Array) -> Bools:
    """Of about the same size as before, and with room for its soft edge in the window."""
    height, _, width = windows.raw.shape
    left, top, wide, high = box
    inside = (left - windows.left >= CLEAR) & (windows.left + width - left - wide >= CLEAR)
    inside &= (top - windows.top >= CLEAR) & (windows.top + height - top - high >= CLEAR)
    alike = np.abs(np.log(np.maximum(now, 1) / before)) < LIKE
    clear: Bools = (chosen >= 0) & inside & alike
    return clear


def _alone(box: list[Ints], sample: Ints) -> Bools:
    """False where two targets of one sample chose the same patch."""
    key = (sample << 40) + (box[1] << 20) + box[0]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    alone = np.ones(key.size, bool)
    alone[order[same]] = alone[order[same + 1]] = False
    return alone
