"""How large a target must be, how many pixels it gives, and how well its centroid can then be found.

The thesis found these by filming ten black circles (appendix A); here they follow from geometry and noise, and its
table A.3 is what they are compared with.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array

SHARE_OF_HEIGHT = 0.009
"""Least diameter of a target as a share of the vertical field of view, for it to be found every time (thesis A.3)."""

LEAST_PIXELS = 4
"""Least number of pixels for the same (thesis A.3); less than that and some samples are lost."""

SOFT_EDGE_PX = 1.0
"""px that blur and the pixels' own size add to a target's radius."""

SYSTEMATIC_PX = 0.02
"""px; ASSUME: pixel locking, uneven light and paint keep a centroid's error above this, however many its frames."""


def least_diameter(vertical_field: float) -> float:
    """The smallest diameter that is tracked without loss, in the unit of the vertical field of view (thesis A.3)."""
    return SHARE_OF_HEIGHT * vertical_field


def pixels_found(diameter_px: ArrayLike, *, fields: int = 2) -> Array:
    """Pixels (...) above a threshold at half contrast that a disc of this diameter gives.

    fields  1 where a single field of an interlaced frame is looked at, as the thesis did: half the rows
    ASSUME: the outermost half pixel all round falls below the threshold of a frame grabber of 1990.
    A disc of 9.2 px gives 26 pixels of one field; the thesis counted 26.4 (table A.3).
    """
    d = np.maximum(np.asarray(diameter_px, float) - 1, 0)
    return np.asarray(np.pi / 4 * d * d * fields / 2)


def centroid_noise(
    diameter_px: ArrayLike,
    *,
    contrast: float,
    noise: float,
    frames: int = 1,
    centroid: str = "weighted",
    systematic_px: float = SYSTEMATIC_PX,
) -> Array:
    """Standard deviation (...) of a centroid's X or Y, px.

    diameter_px  (...) px, of the target's image
    contrast     grey levels between target and background; noise: standard deviation of a grey level, white
    frames       how many are averaged; what is systematic does not average out
    centroid     weighted (intensity above the background, over the target and its soft edge) or binary (4.2.1, 4.2.2)
    Weighted: each pixel's noise n moves the centroid by n x / (A N), N pixels of contrast A, so that over a disc of
    radius w = r + 1 the sum of x^2 is pi w^4 / 4 and sd = (n/A) w^2 / (2 sqrt(pi) r^2), hardly depending on r.
    Binary: the about 8 r pixels that the edge crosses are each taken or left whole, an error of 1/sqrt(12) of a pixel
    at distance r: sd = .18/sqrt(r), which a target at rest repeats in every frame.
    A ball of 8 px at contrast 200 and noise 3: 0.007 px, and 0.02 systematic; binary, 0.09 px.
    Raises ValueError for an unknown kind of centroid or a contrast that is not positive.
    """
    if not contrast > 0:
        raise ValueError(f"contrast must be positive, not {contrast}")
    r = np.asarray(diameter_px, float) / 2
    levels = np.hypot(noise, 1 / np.sqrt(12))  # grey levels are whole numbers
    random = levels / contrast * (r + SOFT_EDGE_PX) ** 2 / (2 * np.sqrt(np.pi) * r**2)
    if centroid == "weighted":
        fixed: Array = np.full(r.shape, systematic_px)
    elif centroid == "binary":
        fixed = np.hypot(systematic_px, np.sqrt(8 * r * r**2 / 2 / 12) / (np.pi * r**2))
    else:
        raise ValueError(f"no such centroid: {centroid!r}; there are weighted, binary")
    return np.asarray(np.hypot(random / np.sqrt(frames), fixed))
