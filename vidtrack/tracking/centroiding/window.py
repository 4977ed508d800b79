"""Window segmentation: one small window a target and sample where it should be, all measured at once.

The windows are as small as the targets allow; a target that is not
plainly itself in its window is reported as not clear, and a wider search decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.centroid import measure
from vidtrack.tracking.centroiding.components import Components, Windows, components, cut
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import VALUES


@dataclass(frozen=True)
class Segmenting:
    """The windows that are segmented, and when what they show is the target.

    clear_px   between a target and its window's border, which its soft edge needs
    room_px    about a target in its window: its soft edge and the background, or room for it to be off by four
    same_size  |log| of the ratio of pixel counts up to which a patch is the target: between 0.55 and 1.8
    grain      pixels that the count of a tiny target changes by as it moves over the grid: the tolerance grows by
               grain/count
    pull_px    that the background's unrest may cost before a window is segmented in every sample
    step_px    windows are as wide and as high as multiples of this, so that targets of about one size share them
    """

    clear_px: int = 3
    room_px: float = 7.5
    same_size: float = 0.6
    grain: float = 3.0
    pull_px: float = 0.01
    step_px: int = 4


WINDOW = Segmenting()


class Seen(NamedTuple):
    """What each window showed.

    values     (VALUES, k samples, n targets), see X to SHIFT_Y (those of the first sample); meaningless where
               not clear
    clear      (k, n) this is the target, whole and alone; saturated: part of it is at full scale
    """

    values: Array
    clear: Bools
    saturated: Bools


def segment_windows(
    samples: Sequence[Sample],
    predicted: Array,
    *,
    size: Array,
    pixels: Array,
    threshold: Array,
    detection: Detection,
) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields).

    predicted  (k, n, 2) px where each should be; size (n, 2) width px and height in rows of the sample, and
    pixels     (n,) of the target when last seen; threshold (n,) grey levels on pictures turned bright
    """
    k, n = predicted.shape[:2]
    rows, columns = samples[0].luma.shape
    need = size + 2 * WINDOW.room_px
    kind = _sorts(need)
    groups: list[Any] = (
        [slice(None)] if not kind.any() else [np.flatnonzero(kind == group) for group in np.unique(kind)]
    )
    parts = []
    for who in groups:
        wide, high = (np.ceil(need[who].max(axis=0) / WINDOW.step_px) * WINDOW.step_px).astype(int).tolist()
        width, height = min(wide, columns), min(high, rows)
        parts.append(_measure_alike(samples, predicted[:, who], width, height, pixels[who], threshold[who], detection))
    if len(parts) == 1:
        return parts[0]
    whole = Seen(np.empty((VALUES, k, n)), np.empty((k, n), bool), np.empty((k, n), bool))
    for who, seen in zip(groups, parts, strict=True):
        for values, piece in zip(whole, seen, strict=True):
            values[..., who] = piece
    return whole


def _sorts(need: Array) -> Ints:
    """Targets of about the same size share windows: one sort unless the largest is twice the smallest."""
    side = need.max(axis=1)
    least = side.min()
    if side.max() <= 2 * least:
        return np.zeros(side.size, np.intp)
    sort: Ints = np.ceil(np.log2(side / least) - 1e-9).astype(np.intp)
    return sort


def _measure_alike(
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
    parity = np.repeat(np.array([sample.parity for sample in samples]), n)
    at_x, at_y = predicted.reshape(k * n, 2).T
    at_y = (at_y - parity) / lines
    left = np.clip(np.rint(at_x - (width - 1) / 2), 0, columns - width).astype(np.intp)
    top = np.clip(np.rint(at_y - (height - 1) / 2), 0, rows - height).astype(np.intp)
    raw = np.empty((height, k * n, width), samples[0].luma.dtype)
    for j, sample in enumerate(samples):
        some = slice(j * n, j * n + n)
        raw[:, some] = cut(sample.luma, left[some], top[some], width, height)
    windows = Windows(detection.bright(raw), left, top, detection.scale)
    level, before = np.tile(threshold, k), np.tile(pixels, k)
    found = components(windows, level)
    chosen = _nearest(found, at_x, at_y, before, detection.min_pixels)
    c = measure(windows, found, chosen, noise=detection.noise, kind=detection.centroid, threshold=level, surfaces=n)
    box = np.stack([found.left, found.top, found.width, found.height])
    box = box[:, chosen] if box.size else np.zeros((4, k * n), np.intp)
    # Where the background is too restless for a template's plain plane, the next sample is segmented as well.
    soft = np.where(c.pull > WINDOW.pull_px, np.nan, c.soft)
    values = np.stack(
        [
            c.x,
            c.y * lines + parity,
            c.sd_x,
            c.sd_y * lines,
            c.pixels,
            c.mass,
            c.contrast,
            c.background,
            c.xx,
            c.yy * lines * lines,
            c.xy * lines,
            box[2],
            box[3],
            soft,
            c.unrest,
            c.plateau,
            *np.tile(c.shift * [[1], [lines]], k),
        ]
    )
    clear = _clear(chosen, box, windows, c.pixels, before) & np.isfinite(c.mass) & np.isfinite(c.x)
    if n > 1:
        clear &= _alone(box, np.repeat(np.arange(k), n))
    return Seen(values.reshape(VALUES, k, n), clear.reshape(k, n), c.saturated.reshape(k, n))


def _nearest(found: Components, x: Array, y: Array, pixels: Array, min_pixels: int) -> Ints:
    """For each window the patch that is nearest to the prediction and most alike in size; -1 for none."""
    chosen = np.full(x.size, -1, np.intp)
    enough = found.pixels >= min_pixels
    which = np.arange(found.window.size) if enough.all() else np.flatnonzero(enough)
    window = found.window[which]
    if window.size > 1 and np.bincount(window).max() > 1:
        off = np.hypot(found.x[which] - x[window], found.y[which] - y[window])
        off += 4 * np.abs(np.log(found.pixels[which] / pixels[window]))
        order = np.lexsort((off, window))
        window, first = np.unique(window[order], return_index=True)
        which = which[order[first]]
    chosen[window] = which
    return chosen


def _clear(chosen: Ints, box: Ints, windows: Windows, now: Ints, before: Array) -> Bools:
    """Of about the same size as before, and with room for its soft edge in the window."""
    height, _, width = windows.raw.shape
    left, top, wide, high = box
    inside = (left - windows.left >= WINDOW.clear_px) & (windows.left + width - left - wide >= WINDOW.clear_px)
    inside &= (top - windows.top >= WINDOW.clear_px) & (windows.top + height - top - high >= WINDOW.clear_px)
    alike = np.abs(np.log(np.maximum(now, 1) / before)) < WINDOW.same_size + WINDOW.grain / before
    clear: Bools = (chosen >= 0) & inside & alike
    return clear


def _alone(box: Ints, sample: Ints) -> Bools:
    """False where two targets of one sample chose the same patch."""
    key = (sample << 40) + (box[1] << 20) + box[0]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(np.diff(key[order]) == 0)
    alone = np.ones(key.size, bool)
    alone[order[same]] = alone[order[same + 1]] = False
    return alone


def doubled(centre: Ints, k: int, n: int) -> Bools | None:
    """Where two targets of one sample have the same middle pixel, or nearly, (k, n); None: nowhere."""
    key = ((centre[1] // 2 << 20) + centre[0] // 2).reshape(k, n)
    ordered = np.sort(key, axis=1)
    if not (ordered[:, 1:] == ordered[:, :-1]).any():
        return None
    order = np.argsort(key, axis=1, kind="stable")
    same = np.diff(np.take_along_axis(key, order, axis=1), axis=1) == 0
    out = np.zeros((k, n), bool)
    sample, place = np.nonzero(same)
    out[sample, order[sample, place]] = out[sample, order[sample, place + 1]] = True
    return out
