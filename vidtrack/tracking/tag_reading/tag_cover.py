"""Coded tags out of the way of the other targets: their paper is painted over where targets are searched.

A tag is a bright sheet with dark squares, and moves as targets do: in the pictures in which targets are followed, each
tag that was read is replaced, its paper with it, by the level around it. What is found at the rim of such a patch may
have lost a part of itself, and is no measurement: `near`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools


@dataclass(frozen=True)
class CoverSettings:
    """Constants of the patch."""

    margin: float = 1.5
    """Squares of the code about the tag that are paper by its rules."""
    reach: float = 1.0
    """Sides about the tag within which its paper is looked for; a larger sheet is covered this far."""
    wider: int = 4
    """px that the patch is larger than the paper: as far as edges are blurred."""
    apart: float = 3.0
    """px between the rim of a patch and a target, below which the patch may have taken a part of it."""


SETTINGS = CoverSettings()
Hull = NDArray[np.float32]
"""(n, 2) px, the outline of a patch."""


def cover(picture: NDArray[np.generic], corners: Array, modules: int) -> Hull | None:
    """Paint over a tag (4, 2) px in a picture, in place; the outline of the patch, None where the tag is outside."""
    import cv2

    middle = corners.mean(0)
    half = (np.abs(corners - middle).max(0) * (1 + 2 * SETTINGS.reach)) + 2 * SETTINGS.wider + 2
    height, width = picture.shape
    left, top = np.clip(np.floor(middle - half), 0, [width, height]).astype(int).tolist()
    right, bottom = np.clip(np.ceil(middle + half) + 1, 0, [width, height]).astype(int).tolist()
    if right - left < 3 or bottom - top < 3:
        return None
    part = picture[top:bottom, left:right].astype(np.float32)
    quad = corners - [left, top]

    def inside(scale: float) -> NDArray[np.uint8]:
        mask = np.zeros(part.shape, np.uint8)
        grown = quad.mean(0) + scale * (quad - quad.mean(0))
        cv2.fillConvexPoly(mask, np.rint(grown).astype(np.int32), 1)
        return mask

    own, sheet = inside(1.0), inside(1 + 2 * SETTINGS.margin / modules)
    within = inside(1 + 2 * SETTINGS.reach)
    rim = (sheet > own) & (cv2.erode(own, np.ones((3, 3), np.uint8)) == 0)
    frame = np.ones(part.shape, bool)
    frame[1:-1, 1:-1] = False
    outside = float(np.median(part[frame]))
    white = float(np.median(part[rim])) if rim.any() else outside
    paper = np.abs(part - white) < np.abs(part - outside)
    _, labels = cv2.connectedComponents((paper & (within > 0) | (sheet > 0)).astype(np.uint8))
    patch = (labels == labels[sheet > 0][0]).astype(np.uint8) if sheet.any() else sheet
    patch = cv2.dilate(patch, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * SETTINGS.wider + 1,) * 2))
    rows, columns = np.nonzero(patch)
    if not len(rows):
        return None
    around = (cv2.dilate(patch, np.ones((5, 5), np.uint8)) > 0) & (patch == 0)
    level = np.median(part[around]) if around.any() else outside
    picture[top:bottom, left:right][patch > 0] = np.asarray(level).astype(picture.dtype)
    points = np.stack([columns + left, rows + top], -1).astype(np.float32)
    return np.asarray(cv2.convexHull(points)[:, 0], np.float32)


def near(b: Array, radius: Array, hulls: Iterable[Hull]) -> Bools:
    """Which targets at b (n, 2) px, of such radii (n,) px, any of the patches may have taken a part of."""
    import cv2

    found = np.zeros(len(b), bool)
    for hull in hulls:
        for i in np.flatnonzero(np.isfinite(b).all(-1) & ~found).tolist():
            inward = cv2.pointPolygonTest(hull, (float(b[i, 0]), float(b[i, 1])), True)
            found[i] = inward > -(radius[i] + SETTINGS.apart)
    return found
