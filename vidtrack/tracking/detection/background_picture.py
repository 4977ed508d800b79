"""The background picture: what is bright wherever nothing moves.

A target that moves by less than its own size while the background is taken leaves its ghost in it: the part of the
picture that it covers in every sample. A ghost hides most of the target, and looks like a thing that stands still.
So what is compact in the background, and has shifted between the pictures that it was taken from, is filled up with
the grey levels about it. Of targets that touch meanwhile no picture shows the ghost alone: there it counts that the
ghost's outline is no edge: at most of it, what covers the ghost goes on beyond it in some picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Bools, Picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import above, above_local_background
from vidtrack.tracking.detection.ticking import darkest_and_brightest, ticking
from vidtrack.tracking.sample import Sample

Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class Ghosts:
    """What counts as the ghost of a target that moved by less than its size.

    shift_px  between two of the pictures, at least: less is what noise does to a blob's middle
    alike     log of the ratio of its pixel counts in them, at most: what changes more is joined with something else
    joined    the same, and twice the error of a count, whose share is rim_px of its rim: where it is larger in some
              pictures, what touches it there has moved its middle, and only the others count. 0.05 more at the rim of
              a patch of 15 px moves it by 0.8 px
    largest   of the picture's height or width, the smaller: a patch of more is scenery
    slim      shorter over longer side of its box, at least; fill: share of the box that it covers, at least, with the
              holes in it: of what is as large as the surroundings that it is compared with only the rim stands out
    outlined  px, of its shorter side, at least, where its outline counts
    standing  share of the outline beyond which all pictures are dark, at most: 0.75 to 1 for things that stand still,
              up to 0.3 for ghosts
    """

    shift_px: float = 0.8
    alike: float = 0.4
    joined: float = 0.05
    rim_px: float = 0.45
    largest: float = 0.5
    slim: float = 0.5
    fill: float = 0.45
    outlined: int = 16
    standing: float = 0.4


GHOSTS = Ghosts()
_SOFT = np.ones((9, 9), np.uint8)  # four px about a patch for its soft edge
_ROUND5, _ROUND9 = (cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)).astype(np.uint8) for size in (5, 9))


def background_of(samples: Sequence[Sample], detection: Detection) -> dict[int, NDArray[Any]]:
    """What stands still, turned bright: for each parity the second darkest of five pictures from first to last.

    Not their median, in which what moves slowly would leave a ghost of itself; what ghosts remain are filled up. Where
    something changes at rest (`ticking`) the brightest of all pictures counts.
    """
    pictures: dict[int, NDArray[Any]] = {}
    for parity in {sample.parity for sample in samples}:
        stack = [sample.luma for sample in samples if sample.parity == parity]
        five = [detection.bright(stack[k]) for k in np.rint(np.linspace(0, len(stack) - 1, 5)).astype(int)]
        a, b, c, d, e = five
        # seven comparisons, as cv2 compares 16 pixels at once
        low, other = cv2.min(a, b), cv2.min(c, d)
        darkest = cv2.min(low, other)
        second = cv2.min(cv2.max(low, other), cv2.min(cv2.max(a, b), cv2.max(c, d)))
        own = without_ghosts(cv2.min(second, cv2.max(darkest, e)), five, detection, samples[0].lines)
        pictures[parity] = with_ticking(own, [detection.bright(luma) for luma in stack], detection)
    return pictures


def with_ticking(background: NDArray[Any], pictures: Sequence[NDArray[Any]], detection: Detection) -> NDArray[Any]:
    """The background, as bright as it ever is in the pictures where something changes at rest; all turned bright."""
    where = ticking(pictures, detection)
    if where is None:
        return background
    return np.where(where > 0, darkest_and_brightest(pictures)[1], background)


def without_ghosts(
    background: Picture, pictures: Sequence[Picture], detection: Detection, lines: int = 1
) -> NDArray[Any]:
    """The background, taken from some pictures, with the ghosts in it filled up; all are turned bright.

    lines  px of the frame buffer to a row: 2 for fields
    """
    mask = bright_mask(background, detection)
    mask = _without_holes(mask)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    filled = background
    small = stats[:, 2:4].max(axis=1) < GHOSTS.largest * min(mask.shape)
    for i in np.flatnonzero(_compact(stats, mask.shape, lines) & small).tolist():
        here = _window(stats[i], mask.shape, int(max(stats[i, 2:4])))
        own, lit, about = labels[here] == i, mask[here] > 0, background[here]
        if lit.all():
            continue
        beside = float(np.median(about[~lit]))
        level = (beside + float(about[own].mean())) / 2
        pieces, bright = [picture[here] for picture in pictures], own & (about > level)
        if _shifted(pieces, bright, level, lines) or _no_edge(pieces, bright, level):
            filled = background.copy() if filled is background else filled
            soft = cv2.dilate(own.astype(np.uint8), _SOFT) > 0
            filled[here][soft & (own | ~lit)] = beside
    return filled


def _without_holes(mask: Mask) -> Mask:
    """The mask with the holes filled of what is large enough to have any."""
    filled = mask
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    for outline in outlines:
        _, _, width, height = cv2.boundingRect(outline)
        high, low = max(width, height), min(width, height)
        if low >= max(GHOSTS.outlined, GHOSTS.slim * high) and high < GHOSTS.largest * min(mask.shape):
            filled = mask.copy() if filled is mask else filled
            cv2.drawContours(filled, [outline], 0, 1, cv2.FILLED)
    return filled


def bright_mask(image: Picture, detection: Detection) -> Mask:
    """1 where a picture, turned bright, is above the user's threshold, or the automatic one."""
    if detection.level is not None:
        return above(image, detection.level / detection.scale)
    return above_local_background(image, detection.scale, detection.noise)


def _compact(stats: NDArray[np.int32], shape: tuple[int, ...], lines: int) -> Bools:
    """Which patches (m,) have the shape of a target, whole in the picture; the first is what is around them."""
    left, top, width, height, pixels = stats.T
    high = height * lines
    slim = np.minimum(width, high) >= GHOSTS.slim * np.maximum(width, high)
    inside = (left > 0) & (top > 0) & (left + width < shape[1]) & (top + height < shape[0])
    good: Bools = slim & inside & (pixels >= GHOSTS.fill * width * height)
    good[0] = False
    return good


def _window(stats: NDArray[np.int32], shape: tuple[int, ...], room: int) -> tuple[slice, slice]:
    """Rows and columns about one patch, with so many px of room where there are."""
    left, top, width, height = stats[:4].tolist()
    rows = slice(max(0, top - room), min(shape[0], top + height + room))
    return rows, slice(max(0, left - room), min(shape[1], left + width + room))


def _shifted(pictures: Sequence[Picture], own: Bools, level: float, lines: int) -> bool:
    """Whether a patch of the background, `own` above a level, moves through these pictures, itself and alone."""
    rows, columns = np.nonzero(own)
    nearest = int(np.argmin(np.hypot(rows - rows.mean(), columns - columns.mean())))
    at = rows[nearest], columns[nearest]
    middles, counts = [], []
    for picture in pictures:
        _, labels, stats, middle = cv2.connectedComponentsWithStats(above(picture, level), connectivity=8)
        one = int(labels[at])
        if one == 0:
            return True
        if not _compact(stats, picture.shape, lines)[one]:
            return False
        middles.append(middle[one])
        counts.append(stats[one, cv2.CC_STAT_AREA])
    least, more = min(counts), np.log(np.array(counts) / min(counts))
    alone = more < GHOSTS.joined + 2 * GHOSTS.rim_px * np.sqrt(2 * np.sqrt(np.pi * least)) / least
    place = np.array(middles)[alone if alone.sum() > 1 else more >= 0]
    return bool(more.max() < GHOSTS.alike and np.ptp(place, axis=0).max() > GHOSTS.shift_px)


def _no_edge(pictures: Sequence[Picture], own: Bools, level: float) -> bool:
    """Whether in these pieces of pictures something bright goes on beyond the patch `own` at most of its outline."""
    core = own.astype(np.uint8)
    rows, columns = np.nonzero(core)
    if not rows.size or min(np.ptp(rows), np.ptp(columns)) < GHOSTS.outlined:
        return False
    beyond = cv2.dilate(core, _ROUND9) > cv2.dilate(core, _ROUND5)
    dark = np.ones(own.shape, bool)
    for picture in pictures:
        dark &= above(picture, level) == 0
    return bool(dark[beyond].mean() < GHOSTS.standing)
