"""What a start box shows half-way up: the target, where at a low threshold it is one with the wall behind it.

A target that has not been seen yet has a threshold just above the noise. A pattern of the wall stands out of that too,
so that a ball before it is one blob with its strokes and goes on beyond the box, while strokes beside it lie wholly in
the box. Half-way from what is usual there to what is brightest, where a target is followed later, the ball is alone. A
glint on a ball is alone there as well: most of what is about it is the ball.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs, above, joined
from vidtrack.tracking.detection.candidates import blobs_near
from vidtrack.tracking.detection.threshold import background_level
from vidtrack.tracking.sample import Sample

Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class HalfWayUp:
    """Which things half-way up are no part of a larger one.

    own      share of the light of what it is a part of at the low threshold, at least; or
    beside   share of the ring about it that is above the low threshold too, at most; soft_px, ring_px: its edges
    """

    own: float = 0.5
    beside: float = 0.6
    soft_px: int = 2
    ring_px: int = 4


HALF_WAY_UP = HalfWayUp()


class Things(NamedTuple):
    """Things that lie wholly in a piece of a picture, half-way up.

    level  as stored, of pictures turned bright; boxes (n, 4): left, top, width, height of each in the piece
    """

    level: float
    boxes: NDArray[np.int32]


def things_in(piece: Picture, low: Mask, usual: float, fewest: int) -> Things:
    """The things of a piece of a picture, turned bright, that are no part of a larger one.

    low  1 where it is above a low threshold; usual: level, as stored, of the whole picture; fewest: pixels of a thing
    """
    s, none = HALF_WAY_UP, np.zeros((0, 4), np.int32)
    light = piece.astype(np.float32)
    few = min(max(fewest, 1), light.size)
    peak = float(np.partition(light.ravel(), -few)[-few:].mean())
    base = min(float(np.median(light)), usual)
    level = (base + peak) / 2
    if not low.any() or level <= float(light[low > 0].min()):
        return Things(level, none)
    mask = above(piece, level)
    n, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    light = np.maximum(light - base, 0)
    whole, whose = np.bincount(labels.ravel(), light.ravel(), n), cv2.connectedComponents(low, connectivity=8)[1]
    parts = np.bincount(whose.ravel(), light.ravel())
    left, top, width, height, pixels = stats.T
    inside = (left > 0) & (top > 0) & (left + width < piece.shape[1]) & (top + height < piece.shape[0])
    good = []
    for i in np.flatnonzero(inside & (pixels >= fewest)).tolist():
        if i == 0:
            continue
        own = (labels == i).view(np.uint8)
        near, far = (cv2.dilate(own, np.ones((2 * px + 1,) * 2, np.uint8)) for px in (s.soft_px, s.ring_px))
        ring = (far > near) & (mask == 0)
        part_of = int(whose[labels == i].max())
        if whole[i] >= s.own * parts[part_of] or (ring.any() and low[ring].mean() <= s.beside):
            good.append(i)
    return Things(level, stats[good, :4])


def with_half_way_up(
    near: Blobs, sample: Sample, boxes: Array, levels: Sequence[float] | Array, detection: Detection
) -> Blobs:
    """Blobs of start boxes with what these show half-way up, instead of what that is a part of.

    near    at low levels, grey levels (n,) of pictures turned bright; boxes (n, 4): left, top, width, height px
    """
    if not len(boxes) or detection.level is not None:
        return near
    rows, columns = sample.luma.shape
    usual = background_level(detection.bright(sample.luma), scale=1.0)
    found: list[Blobs] = []
    for (x, y, w, h), low in zip(boxes.tolist(), np.asarray(levels).tolist(), strict=True):
        first, last = sample.row(np.array([y, y + h])).tolist()
        left, right = (int(np.clip(v, 0, columns)) for v in (np.floor(x), np.ceil(x + w)))
        top, bottom = (int(np.clip(v, 0, rows)) for v in (np.floor(first), np.ceil(last)))
        if right - left < 3 or bottom - top < 3:
            continue
        piece = detection.bright(sample.luma[top:bottom, left:right])
        things = things_in(piece, above(piece, low / detection.scale), usual, detection.min_pixels)
        if not len(things.boxes):
            continue
        some = blobs_near(sample, detection, np.array([[x, y, w, h]]), np.array([things.level * detection.scale]))
        is_one = (
            (some.left[:, None] == things.boxes[:, 0] + left)
            & (some.top[:, None] == (things.boxes[:, 1] + top) * sample.lines + sample.parity)
            & (some.pixels[:, None] <= things.boxes[:, 2] * things.boxes[:, 3])
        ).any(axis=1)
        found.append(Blobs._make(column[is_one] for column in some))
    if not found:
        return near
    every = joined(found)
    lines = sample.lines
    covers = (every.Xf > near.left[:, None] - 1) & (every.Xf < (near.left + near.width)[:, None])
    covers &= (every.Yf > near.top[:, None] - lines) & (every.Yf < (near.top + near.height * lines)[:, None])
    return joined([every, Blobs._make(column[~covers.any(axis=1)] for column in near)])
