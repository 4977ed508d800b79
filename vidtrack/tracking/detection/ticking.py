"""Places where something changes at rest, to and fro: digits of a running time that are written into the pictures.

No target moves there, but each new digit looks like one that has just come or moved a little. A target that passes by
lights a pixel once, and a lamp that flickers lights all of its pixels at once; digits light theirs to and fro, and not
together. A ball that swings as fast as that has a middle that is always lit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.threshold import THRESHOLD


@dataclass(frozen=True)
class Ticking:
    """When pixels tick.

    pictures   fewer say nothing
    sigmas     standard deviations of a pixel that its levels differ by, at least: noise has 10 in a million pixels
    changes    from dark to bright or back of a pixel, at least: what passes makes two; restless: of some pixels in the
               thing, at least; often: and that share of the steps from picture to picture
    largest    of the picture's smaller side: what is longer is the way of targets that follow each other
    dark, bright  shares of the way from its darkest to its brightest, up to which and from which it is that
    crowded    share of the picture above which what changes is the scene
    apart_px   between pixels of one digit
    together   correlation with the mean of all, above which (in the mean) they change at once: a lamp
    lit        pixels that are always lit, over those that tick, above which it is a thing that swings
    room_px    about them, for soft edges
    """

    pictures: int = 8
    sigmas: float = 12.0
    changes: int = 3
    restless: int = 5
    often: float = 0.5
    largest: float = 0.12
    dark: float = 0.25
    bright: float = 0.75
    crowded: float = 0.05
    apart_px: int = 5
    together: float = 0.8
    lit: float = 0.5
    room_px: int = 1


TICKING = Ticking()
_NEAR = np.ones((TICKING.apart_px, TICKING.apart_px), np.uint8)


def ticking(pictures: Sequence[NDArray[Any]], detection: Detection) -> NDArray[np.uint8] | None:
    """1 in the boxes of things that change at rest, of pictures (rows, columns) in order of time; None: nothing does.

    pictures  of one field, turned bright
    """
    if len(pictures) < TICKING.pictures:
        return None
    low, high = darkest_and_brightest(pictures)
    least = max(TICKING.sigmas * detection.moving_noise, 2 * THRESHOLD.least_contrast) / detection.scale
    row, column = np.nonzero(cv2.subtract(high, low) > least)
    if not 0 < row.size < TICKING.crowded * low.size:
        return None
    dark, whole = low[row, column].astype(np.float32), high[row, column].astype(np.float32)
    part = np.stack([(picture[row, column] - dark) / (whole - dark) for picture in pictures])
    state, changes = part[0] > (TICKING.dark + TICKING.bright) / 2, np.zeros(row.size, np.intp)
    for now in part[1:]:
        changed = np.where(state, now < TICKING.dark, now > TICKING.bright)
        changes += changed
        state = state ^ changed
    ticks = changes >= TICKING.changes
    restless = changes[ticks] >= max(TICKING.restless, TICKING.often * (len(pictures) - 1))
    if np.count_nonzero(restless) < detection.min_pixels:
        return None
    return _digits(part[:, ticks], (row[ticks], column[ticks]), restless, low, high, detection.min_pixels)


def darkest_and_brightest(pictures: Sequence[NDArray[Any]]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Each pixel at its darkest and at its brightest."""
    low = high = pictures[0]
    for picture in pictures[1:]:
        low, high = cv2.min(low, picture), cv2.max(high, picture)
    return low, high


def _digits(
    part: Array, at: tuple[NDArray[np.intp], NDArray[np.intp]], restless: Bools, low: Any, high: Any, fewest: int
) -> NDArray[np.uint8] | None:
    """The boxes of things with a few restless pixels that do not change together, and about nothing that is always lit.

    part  (pictures, m) of the way from darkest to brightest, of pixels at rows and columns `at` (m,) that tick
    """
    mask = np.zeros(low.shape, np.uint8)
    mask[at] = 1
    joined = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _NEAR)
    n, labels, stats, _ = cv2.connectedComponentsWithStats(joined, connectivity=8)
    own, boxes = labels[at], np.zeros_like(mask)
    for i in np.flatnonzero(np.bincount(own[restless], minlength=n) >= fewest).tolist():
        some = np.flatnonzero(own == i)
        left, top, width, height = stats[i, :4].tolist()
        if max(width, height) > TICKING.largest * min(mask.shape):
            continue
        each = part[:, some] - part[:, some].mean(axis=0)
        mean = each.mean(axis=1)
        size = np.sqrt(np.square(each).sum(axis=0) * np.square(mean).sum())
        if float(((mean @ each) / np.maximum(size, 1e-9)).mean()) > TICKING.together:
            continue
        here = slice(top, top + height), slice(left, left + width)
        ticks, inside = mask[here] > 0, labels[here] == i
        level = (float(low[here][ticks].mean()) + float(high[here][ticks].mean())) / 2
        if np.count_nonzero(low[here][inside & ~ticks] > level) > TICKING.lit * some.size:
            continue
        room = TICKING.room_px
        boxes[max(0, top - room) : top + height + room, max(0, left - room) : left + width + room] = 1
    return boxes if boxes.any() else None
