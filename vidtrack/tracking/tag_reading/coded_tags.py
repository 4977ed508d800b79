"""Coded tags in a picture: squares that name themselves, found and read by OpenCV's detector.

Garrido-Jurado et al. (2014); the codes of AprilTag are those of Olson (2011). Corners go round from the upper left one
as the printed tag is read: upper left, upper right, lower right, lower left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array

FAMILIES = {
    "36h11": ("DICT_APRILTAG_36h11", 8),
    "36h10": ("DICT_APRILTAG_36h10", 8),
    "25h9": ("DICT_APRILTAG_25h9", 7),
    "16h5": ("DICT_APRILTAG_16h5", 6),
}
"""Family: its name in OpenCV, and the modules along a side, the black border included."""


@dataclass(frozen=True)
class Reading:
    """How tags are read.

    corrected   share of the bits that a code can correct which are: each more makes false tags likelier
    smallest    of the picture's longer side: perimeter of the smallest square that is looked at
    border      share of a border's modules that may be white: a wet or dirty tag
    """

    corrected: float = 0.3
    smallest: float = 0.01
    border: float = 0.2


READING = Reading()


class FoundTags(NamedTuple):
    """The n tags that a picture shows; a number may be there several times."""

    ids: NDArray[np.intp]  # (n,)
    corners: Array  # (n, 4, 2) px, roughly


class TagFinder:
    """Finds the tags of one family.

    family   one of FAMILIES
    Raises KeyError for another one.
    """

    def __init__(self, family: str) -> None:
        import cv2

        name, self.modules = FAMILIES[family]
        how: Any = cv2.aruco.DetectorParameters()
        how.errorCorrectionRate = READING.corrected
        how.minMarkerPerimeterRate = READING.smallest
        how.maxErroneousBitsInBorderRate = READING.border
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        self._detector: Any = cv2.aruco.ArucoDetector(dictionary, how)

    def found(self, picture: NDArray[np.uint8]) -> FoundTags:
        """The tags in a picture (rows, columns) of 8 bits."""
        corners, ids, _ = self._detector.detectMarkers(picture)
        if ids is None:
            return FoundTags(np.zeros(0, np.intp), np.zeros((0, 4, 2)))
        return _once(np.asarray(ids, np.intp).ravel(), np.asarray(corners, float).reshape(-1, 4, 2))


def _once(ids: NDArray[np.intp], corners: Array) -> FoundTags:
    """Each tag once: of two outlines of one number about the same place the larger."""
    middle = corners.mean(1)
    side = np.linalg.norm(np.roll(corners, -1, 1) - corners, axis=-1).mean(-1)
    near = np.linalg.norm(middle[:, None] - middle, axis=-1) < 0.5 * np.minimum(side[:, None], side)
    larger = (side > side[:, None]) | ((side == side[:, None]) & np.tri(len(side), k=-1, dtype=bool))
    kept = ~((ids[:, None] == ids) & near & larger).any(1)
    return FoundTags(ids[kept], corners[kept])
