"""How bright each picture of a recording is: what a lamp that is switched on shows in every camera.

A picture's brightness is the mean of some 64 rows all over it, half of either field: the noise of its pixels averages
out to 0.01 of a grey level or so, and the cost is 0.02 ms a picture.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.timing.frame import Frame, Luma
from vidtrack.timing.timebase import TimeBase

PAIRS = 32
"""Pairs of neighbouring rows that are looked at."""


class LightMeter:
    """Notes the time and the brightness of frames as they pass.

    bits   levels of the pictures reach from 0 to 2**bits - 1
    """

    def __init__(self, bits: int) -> None:
        self._scale = 255 / (2**bits - 1)
        self._stamps, self._levels = array("d"), array("d")

    def over(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames unchanged."""
        for frame in frames:
            self._stamps.append(float(frame.time))
            self._levels.append(float("nan") if frame.corrupt else self._scale * brightness(frame.luma))
            yield frame

    def columns(self, clock: TimeBase, *, in_fields: bool) -> dict[str, NDArray[Any]]:
        """Every picture that has passed, (n,) each: its number, when it was taken, and its brightness.

        stamp_s counts from the first picture; time_s, and middle_s of the middle of its one or two exposures, are by
        the time code.
        """
        stamps = self.stamps
        time = clock.seconds(stamps)
        middle = clock.seconds(stamps, fields=np.full(len(stamps), 0.25)) if in_fields else time
        moments = {"frame": np.arange(len(stamps)), "stamp_s": stamps, "time_s": time, "middle_s": middle}
        return moments | {"brightness": self.levels}

    @property
    def stamps(self) -> Array:
        """Times (n,), s after the first picture, of the frames that have passed."""
        return np.array(self._stamps)

    @property
    def levels(self) -> Array:
        """Mean brightness (n,), grey levels 0 to 255 whatever the depth; NaN for damaged pictures."""
        return np.array(self._levels)


def brightness(luma: Luma) -> float:
    """Mean of some rows of a picture (height, width), in its own levels."""
    step = 2 * max(1, luma.shape[0] // (2 * PAIRS))
    rows = [luma[first::step] for first in (0, 1) if luma.shape[0] > first]
    return sum(float(cv2.mean(some)[0]) for some in rows) / len(rows)
