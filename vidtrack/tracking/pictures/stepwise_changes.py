"""Changes of the background between pictures that are coded one after the other, with others shown between them.

Pictures that are shown before the one that they are built on (B pictures) show damage of that one in part: the
background changes in steps, of which none is sudden. From one picture that is coded before those shown between to the
next such one it changes at once. How much usually changes between two of these is more than from picture to picture,
since what moves goes further, so that they have a measure of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.timing.frame import Coded, Luma


@dataclass(frozen=True)
class Steps:
    """When so much changed that a picture gets a second look; blocks and grey levels as in `damaged_pictures`.

    change, times  grey levels, mean over a block, and multiples of what is usual, that a block changes
    few, more      blocks, and multiples of how many usually do and did last
    apart          blocks far from those of the last time, and as many multiples of how many usually are
    memory         share of the latest picture in what is usual
    most           pictures between two, at most: behind more of them what moves is elsewhere
    """

    change: float = 4.0
    times: float = 4.0
    few: int = 2
    more: float = 1.4
    apart: int = 3
    memory: float = 0.2
    most: int = 16


STEPS = Steps()
_BESIDE = np.ones((3, 3), np.uint8)


class StepwiseChanges:
    """Given the pictures in the order in which they are shown, finds those up to which the background changed in steps.

    by_block  makes of the pixels looked at of two pictures by how much each block differs
    """

    def __init__(self, by_block: Callable[[Luma, Luma], Array]) -> None:
        self._by_block = by_block
        self._last: Luma | None = None  # of the latest picture that was coded before those shown between
        self._between = 0  # shown since then
        self._complete = -1  # all pictures up to this number in the order of coding have been shown
        self._ahead: set[int] = set()  # and these behind it
        self._usual: Array | None = None
        self._out: Bools | None = None
        self._crowd, self._many, self._apart = 0.0, np.inf, 0.0

    def seen(self, few: Luma, coded: Coded | None) -> float:
        """How many times as many blocks changed as expected up to this picture, from the last one that is coded before
        those shown between; 0 where none is, 1 of the first one.

        few  the pixels that are looked at
        """
        if coded is None:
            self._last = None
            return 0.0
        if not coded.key and coded.number > self._complete + 1:  # built on pictures that are shown later
            self._ahead.add(coded.number)
            self._between += 1
            if self._between > STEPS.most:  # one never came
                self._last, self._complete, self._ahead = None, max(self._ahead), set()
            return 0.0
        self._complete = max(self._complete, coded.number)
        while self._complete + 1 in self._ahead:
            self._complete += 1
        self._ahead = {number for number in self._ahead if number > self._complete}
        last, self._last = self._last, few
        between, self._between = self._between, 0
        if last is None or not between or last.shape != few.shape:
            return 0.0
        return self._changed(self._by_block(few, last))

    def _changed(self, change: Array) -> float:
        known, usual = self._usual is not None, np.ones_like(change) if self._usual is None else self._usual
        self._usual = usual
        out = change > np.maximum(STEPS.change, STEPS.times * usual)
        usual += STEPS.memory * (np.minimum(change, 2 * usual + 1) - usual)
        many, apart = int(np.count_nonzero(out)), 0
        if self._out is not None:
            apart = int(np.count_nonzero(out & ~around(self._out)))
        expected = STEPS.few + STEPS.more * max(self._crowd, self._many)
        by_place = STEPS.apart * (1 + self._apart)
        self._crowd += STEPS.memory * (min(many, 2 * self._crowd + STEPS.few) - self._crowd)
        self._apart += STEPS.memory * (min(apart, 2 * self._apart + STEPS.apart) - self._apart)
        self._many, self._out = many, out
        return max(many / expected, apart / by_place) if known else 1.0


def around(blocks: Bools) -> Bools:
    """Those blocks, and the ones beside them."""
    return np.asarray(cv2.dilate(blocks.view(np.uint8), _BESIDE).view(bool))
