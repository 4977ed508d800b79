"""Static clutter: what stands in the picture, as bright as a target: a metre stick, a rope, a lamp, a reflection.

Where a target is in front of such a thing or beside it, both make one blob: its centroid is not the target's, and
pieces of the thing look like targets. So a blob that touches one is no target until it is seen apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import bright_mask
from vidtrack.tracking.detection.blobs import above, background_map
from vidtrack.tracking.detection.threshold import THRESHOLD, automatic, background_level
from vidtrack.tracking.detection.ticking import ticking
from vidtrack.tracking.sample import Sample

Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class Clutter:
    """What of a picture is static clutter.

    pulls          of a target's contrast above which a thing beside it pulls its centroid by more than its fit can
                   correct
    soft_edge_px   about a target's box in which its soft edge lies
    place_room_px  about a target's place in the opening that are its own
    """

    pulls: float = 0.2
    soft_edge_px: float = 1.0
    place_room_px: float = 4.0


CLUTTER = Clutter()


@dataclass(frozen=True)
class StaticClutter:
    """Summed-area tables (integral images) of the mask of static clutter; `sums` by parity of the field.

    ticking  1 where something changes at rest, as `ticking.ticking` has it: dark now is no sign that it is gone
    """

    sums: Mapping[int, NDArray[np.int32]]
    ticking: Mapping[int, Mask] = field(default_factory=dict)

    def touched(
        self, samples: Sequence[Sample], x: ArrayLike, y: ArrayLike, width: ArrayLike, height: ArrayLike
    ) -> Bools:
        """Whether boxes touch any: middles x, y (k samples, n) frame-buffer px, height in rows of the sample."""
        lines, parity = samples[0].lines, np.array([sample.parity for sample in samples])
        middle = np.asarray(y, float) if lines == 1 else (y - parity[:, None]) / lines
        wide, high = (
            np.asarray(width, float) / 2 + (CLUTTER.soft_edge_px + 0.5),
            np.asarray(height, float) / 2 + (CLUTTER.soft_edge_px / lines + 0.5),
        )
        edges = np.empty((4, *middle.shape))
        np.subtract(x, wide, out=edges[0])
        np.add(x, wide, out=edges[1])
        np.subtract(middle, high, out=edges[2])
        np.add(middle, high, out=edges[3])
        if lines == 1:
            return _any_within(self.sums[0], edges)
        hit = np.zeros(middle.shape, bool)
        for one, sums in self.sums.items():
            hit[parity == one] = _any_within(sums, edges[:, parity == one])
        return hit

    def piece(self, parity: int, left: int, top: int, height: int, width: int) -> Mask:
        """1 on static clutter in a piece (height, width) of the samples of this parity."""
        if parity not in self.sums:
            return np.zeros((height, width), np.uint8)
        sums = self.sums[parity][top : top + height + 1, left : left + width + 1]
        return np.diff(np.diff(sums, axis=0), axis=1).astype(np.uint8)

    def without(self, parity: int, mask: Mask) -> StaticClutter:
        """The clutter without the marked pixels (rows, columns) of the samples of this parity."""
        if parity not in self.sums:
            return self
        sums = self.sums[parity].astype(np.int64)
        own = np.diff(np.diff(sums, axis=0), axis=1).astype(np.uint8)
        if not (own & mask).any():
            return self
        return replace(self, sums={**self.sums, parity: cv2.integral(own & ~mask & 1, sdepth=cv2.CV_32S)})


def _any_within(sums: NDArray[np.int32], edges: Array) -> Bools:
    """Whether there are pixels from the first behind the edges (4, ...), left, right, top, bottom px, to their last."""
    rows, columns = sums.shape[0] - 1, sums.shape[1] - 1
    edges = np.fmax(np.ceil(edges), 0.0, out=edges)  # of fmax the number, where the edge is NaN
    x, y = np.fmin(edges[:2], columns).astype(np.intp), np.fmin(edges[2:], rows).astype(np.intp)
    corner = sums[y[:, None], x]
    hit: Bools = corner[1, 1] - corner[0, 1] > corner[1, 0] - corner[0, 0]
    return hit


def static_clutter(
    samples: Sequence[Sample],
    backgrounds: Mapping[int, NDArray[Any]],
    detection: Detection,
    own: Array,
    contrast: float = np.nan,
    *,
    alone: bool = False,
) -> StaticClutter | None:
    """Static clutter, found while the targets are elsewhere; None where there is none, or the whole scene is as bright.

    samples      the opening of the recording; backgrounds of it, turned bright, as `background_of` makes them
    own          (n, 4) left, top, right, bottom px: where the targets begin. What lies wholly in such a box is a
                 target at rest; where no target is seen apart in it, all of it is left to the target
    alone        the targets have been seen apart there, by their motion: what else lies in a box is not theirs
    contrast     grey levels, of the faintest target; NaN: not known, and what is brightest in the scene counts instead
    """
    sums, ticks = {}, {}
    for parity, background in backgrounds.items():
        first = next(sample for sample in samples if sample.parity == parity)
        boxes = own.copy()
        boxes[:, 1::2] = first.row(boxes[:, 1::2])
        mask = _bright_things(background, detection, contrast)
        seen = mask if alone else bright_mask(detection.bright(first.luma), detection)
        mask = _without(mask, seen, boxes, alone=alone)
        if mask.any() and mask.mean() < detection.max_clutter:
            sums[parity] = cv2.integral(mask, sdepth=cv2.CV_32S)
            stack = [detection.bright(sample.luma) for sample in samples if sample.parity == parity]
            if (where := ticking(stack, detection)) is not None:
                ticks[parity] = where
    return StaticClutter(sums, ticks) if sums else None


def start_places(sample: Sample, boxes: Array, detection: Detection) -> Array:
    """The boxes (n, 4) left, top, right, bottom px that targets take up, and room for them to stir, of start boxes.

    The target of a start box is what is nearest to its middle of all that lies wholly in it; where nothing does, the
    whole box is its place.
    """
    boxes = boxes.copy()
    own = boxes.copy()
    own[:, 1::2] = sample.row(own[:, 1::2])
    stats = cv2.connectedComponentsWithStats(bright_mask(detection.bright(sample.luma), detection), connectivity=8)[2]
    inside = _inside(stats, own) & (stats[:, cv2.CC_STAT_AREA, None] >= detection.min_pixels)
    for i in np.flatnonzero(inside.any(axis=0)):
        left, top, width, height = stats[inside[:, i], :4].astype(float).T
        x, y = left + (width - 1) / 2, (top + (height - 1) / 2) * sample.lines + sample.parity
        at = int(np.argmin(np.hypot(x - boxes[i, ::2].mean(), y - boxes[i, 1::2].mean())))
        room = np.array([1.5 * width[at], 1.5 * height[at] * sample.lines]) + CLUTTER.place_room_px
        boxes[i] = [x[at] - room[0], y[at] - room[1], x[at] + room[0], y[at] + room[1]]
    return boxes


def places(positions: Sequence[Array], sizes: Sequence[Array], lines: int) -> Array:
    """The boxes (n, 4) left, top, right, bottom px that trails take up.

    positions, sizes  of each trail (m, 2) px, heights in rows of a sample, each of which is `lines` px
    """
    boxes = np.empty((len(positions), 4))
    for i, (position, size) in enumerate(zip(positions, sizes, strict=True)):
        half = size.max(axis=0) * (1, lines) / 2 + CLUTTER.place_room_px
        boxes[i] = [*(position.min(axis=0) - half), *(position.max(axis=0) + half)]
    return boxes


def _bright_things(background: NDArray[Any], detection: Detection, contrast: float) -> Mask:
    """1 where the background picture stands out of its surroundings so much that a centroid would be pulled."""
    if detection.level is not None:
        return above(background, detection.level / detection.scale)
    even = background_map(background, detection.scale, detection.noise)
    grey = background.astype(np.float32) * np.float32(detection.scale)
    over = grey - (np.float32(background_level(background, scale=detection.scale)) if even is None else even)
    if np.isnan(contrast):
        contrast = automatic(over, detection.noise) / THRESHOLD.share
    least = max(THRESHOLD.sigmas * detection.noise, THRESHOLD.least_contrast, CLUTTER.pulls * contrast)
    return (over > np.float32(least)).view(np.uint8)


def _without(mask: Mask, first: Mask, boxes: Array, *, alone: bool) -> Mask:
    """The mask without the things that lie wholly in one of the boxes (n, 4), and without the boxes in which nothing
    does, neither in the mask nor in the first sample.
    """
    n, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    inside = _inside(stats, boxes)
    apart = inside.any(axis=0) | _inside(cv2.connectedComponentsWithStats(first, connectivity=8)[2], boxes).any(axis=0)
    kept = np.ones(n, np.uint8)
    kept[0] = 0
    kept[inside.any(axis=1)] = 0
    left = kept[labels]
    for x0, y0, x1, y1 in np.rint(boxes[~apart & (not alone)]).astype(int).tolist():
        left[max(0, y0) : max(0, y1 + 1), max(0, x0) : max(0, x1 + 1)] = 0
    return np.asarray(left, np.uint8)


def _inside(stats: NDArray[np.int32], boxes: Array) -> Bools:
    """Whether components (m, 5: left, top, width, height, pixels) lie wholly in boxes (n, 4): (m, n)."""
    left, top, width, height = (stats[:, i, None] for i in range(4))
    x0, y0, x1, y1 = boxes.T
    inside: Bools = (left >= x0) & (top >= y0) & (left + width - 1 <= x1) & (top + height - 1 <= y1)
    inside[0] = False
    return inside
