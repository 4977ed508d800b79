"""Pixels of a whole sample on the targets' side of the threshold."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Picture
from vidtrack.tracking.detect_settings import Detection


class PixelCounter:
    """Counts pixels beyond a level, grey level of pictures turned bright; keeps one picture to work in."""

    def __init__(self, detection: Detection, level: float) -> None:
        self._level, self._kind = level / detection.scale, cv2.THRESH_BINARY
        if detection.dark:  # BINARY_INV keeps what is not above: a dark pixel lies below the level
            self._level = float(np.ceil(detection.full - self._level)) - 1
            self._kind = cv2.THRESH_BINARY_INV
        self._marked: NDArray[Any] | None = None

    def count(self, luma: Picture) -> int:
        """Of a picture as stored. Done as a sample comes: its windows are then cut from the processor's caches."""
        if self._marked is None or self._marked.shape != luma.shape or self._marked.dtype != luma.dtype:
            self._marked = np.empty(luma.shape, luma.dtype)
        cv2.threshold(luma, self._level, 1, self._kind, dst=self._marked)
        return cv2.countNonZero(self._marked)
