"""What stands out of the background and is none of the targets that are followed: candidates for new tracks.

The background begins as the opening shows it and only gets darker: where a picture is plainly darker than it, what
was taken for background had been something in front of it. So nothing is hidden for good by what the first pictures
showed. The static clutter loses the same pixels.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs, above, in_frame_buffer, no_blobs, rough_blobs
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.detection.threshold import THRESHOLD
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Unexplained:
    """When pixels count as unexplained.

    room_px  about a target that is followed, in which whatever stands out is its own
    crowded  share of the picture above which what stands out is a change of light, not targets
    share    of the contrast of the faintest target, by which a pixel stands out at least
    darker   sigmas by which a picture is darker than the background where that had been something in front of it
    uncovered  share of a thing in the clutter that is seen dark, beside which as much, times `moved`, has become
               bright: then it was the ghost of something that moves, and no part of it stands there
    nearest_px  that the bright pixels beside it are from it: a camera that shakes moves what stands by less
    largest    of the picture's height or width, the smaller: what is longer is scenery
    """

    room_px: float = 4.0
    crowded: float = 0.05
    share: float = 0.3
    darker: float = 9.0
    uncovered: float = 0.04
    moved: float = 0.25
    nearest_px: int = 3
    largest: float = 0.5


UNEXPLAINED = Unexplained()
_SQUARE2 = np.ones((2, 2), np.uint8)
_NEAREST = np.ones((2 * UNEXPLAINED.nearest_px + 1,) * 2, np.uint8)


class WholePicture:
    """Seeks candidates in whole samples; `static` is the clutter as it is known by now.

    backgrounds  as `background_of` makes them, by parity
    """

    def __init__(
        self, backgrounds: Mapping[int, NDArray[Any]], detection: Detection, static: StaticClutter | None
    ) -> None:
        self.static = static
        self._background = {parity: picture.copy() for parity, picture in backgrounds.items()}
        self._detection = detection
        self._least = max(THRESHOLD.sigmas * detection.moving_noise, THRESHOLD.least_contrast)
        self._drop = max(UNEXPLAINED.darker * detection.moving_noise, THRESHOLD.least_contrast) / detection.scale

    def candidates(self, sample: Sample, middle: Array, size: Array, contrast: float) -> Blobs:
        """Blobs of a sample away from targets at middles (n, 2) px of these sizes (n, 2) px.

        contrast  grey levels, of the faintest target; NaN where none is known
        """
        image, background = self._detection.bright(sample.luma), self._background[sample.parity]
        self._uncover(image, sample.parity)
        level = max(self._least, UNEXPLAINED.share * contrast)  # the first, where the contrast is NaN
        mask = above(cv2.subtract(image, background), level / self._detection.scale)
        half = size / 2 + UNEXPLAINED.room_px
        low, high = middle - half, middle + half
        edges = np.stack([low[:, 0], high[:, 0], sample.row(low[:, 1]), sample.row(high[:, 1])], axis=1)
        edges = np.maximum(np.rint(edges), 0).astype(np.intp)
        for left, right, top, bottom in edges.tolist():
            mask[top : bottom + 1, left : right + 1] = 0
        lit = cv2.countNonZero(mask)
        if lit < self._detection.min_pixels or lit > UNEXPLAINED.crowded * mask.size:
            return no_blobs()
        if not cv2.countNonZero(cv2.erode(mask, _SQUARE2)):  # nothing but specks
            return no_blobs()
        found = rough_blobs(image, mask, scale=self._detection.scale, min_pixels=self._detection.min_pixels)
        return in_frame_buffer(Blobs._make(column[~found.edge] for column in found), sample)

    def _uncover(self, image: NDArray[Any], parity: int) -> None:
        """Lower the background where this picture is plainly darker, and take that off the static clutter; of what has
        moved on, all.
        """
        background = self._background[parity]
        darker = above(cv2.subtract(background, image), self._drop)
        if self.static is not None and parity in self.static.ticking:
            darker[self.static.ticking[parity] > 0] = 0
        if not cv2.countNonZero(darker):
            return
        gone = darker
        if self.static is not None:
            gone = darker.copy()
            for here, own, level in _moved_on(self.static.piece(parity, 0, 0, *image.shape), darker, image, background):
                gone[here] |= own
                background[here][own > 0] = level
            self.static = self.static.without(parity, gone)
        cv2.copyTo(image, darker, background)


def _moved_on(
    static: NDArray[np.uint8], darker: NDArray[np.uint8], image: NDArray[Any], background: NDArray[Any]
) -> Iterator[tuple[tuple[slice, slice], NDArray[np.uint8], float]]:
    """Things in the static clutter that were ghosts: a window, 1 on the thing in it, and the level beside it.

    darker  1 where the picture is darker than the background
    """
    n, labels, stats, _ = cv2.connectedComponentsWithStats(static, connectivity=8)
    lost = np.bincount(labels[darker > 0], minlength=n)
    longest = UNEXPLAINED.largest * min(static.shape)
    some = (lost > UNEXPLAINED.uncovered * stats[:, cv2.CC_STAT_AREA]) & (stats[:, 2:4].max(axis=1) < longest)
    for i in np.flatnonzero(some[1:]) + 1:
        left, top, width, height = stats[i, :4].tolist()
        room = max(width, height)
        here = slice(max(0, top - room), top + height + room), slice(max(0, left - room), left + width + room)
        own, now, left_bare = (labels[here] == i).astype(np.uint8), image[here], darker[here] > 0
        bare = float(np.median(now[left_bare & (own > 0)]))
        level = (bare + float(np.median(background[here][own > 0]))) / 2
        _, patches = cv2.connectedComponents(above(now, level), connectivity=8)
        touching = np.unique(patches[(own > 0) & ~left_bare])
        beside = np.isin(patches, touching[touching > 0]) & (cv2.dilate(own, _NEAREST) == 0)
        if np.count_nonzero(beside) > UNEXPLAINED.moved * lost[i]:
            yield here, own, bare
