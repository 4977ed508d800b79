"""Noise, background and threshold of a picture: what separates a target from what lies behind it.

Grey levels run from 0 to 255 whatever the depth of the video. Every function works on a sample of the pixels,
so that a 4K picture costs no more than a small one.

`automatic` is the rule; it is applied to a whole clip in `tracking/initiation/clip.py`, to each target while it is
followed in `target_threshold.py`, to the boxes of lost targets in `candidates.py`,
and to calibration balls in `blobs.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Picture
from vidtrack.tracking.centroiding.order_statistics import median_of


@dataclass(frozen=True)
class Threshold:
    """Where the threshold of a picture lies.

    sigmas          a pixel this many noise sigmas above the background belongs to something: chance gives one in 10^9
    share           between the background (0) and the brighter targets (1). Below a half, so that a target twice as dim
                    as the brightest is still found; the weighted centroid hardly depends on it
    least_contrast  grey levels: compression and shading leave patches of this size in a picture without targets
    """

    sigmas: float = 6.0
    share: float = 0.4
    least_contrast: float = 8.0


THRESHOLD = Threshold()


def grey_scale(dtype: np.dtype[Any], bits: int | None = None) -> float:
    """Grey levels (0-255) a stored value: 1 for 8 bit, 255/1023 for 10 bit; 1 for floats, which are grey levels.

    bits  significant bits of the stored integers; the whole integer when not given
    """
    if dtype.kind == "f":
        return 1.0
    return 255.0 / float(2 ** (bits or 8 * dtype.itemsize) - 1)


def sample(image: Picture, scale: float, most: int = 40_000) -> NDArray[np.float32]:
    """About `most` pixels on a regular grid, rows whole enough to keep neighbours, in grey levels, (rows, columns)."""
    step = max(1, int(image.size / most))
    return image[step // 2 :: step].astype(np.float32) * np.float32(scale)


def noise_sd(image: Picture, *, scale: float = 1.0) -> float:
    """Standard deviation of a pixel's noise, grey levels, from the differences of horizontal neighbours.

    Half of all differences are smaller than 0.6745 sqrt(2) sigma whatever the few edges do; whole levels are
    interpolated. Never below what rounding alone leaves, 1/sqrt(12) of a stored level.
    """
    step = np.abs(np.diff(sample(image, 1.0), axis=1)).ravel()
    floor = 12**-0.5 * (scale if image.dtype.kind == "u" else 1e-3)
    if step.size == 0:
        return float(floor)
    if image.dtype.kind == "f":
        return max(float(np.quantile(step, 0.6827)) * scale / 2**0.5, floor)
    counts = np.bincount(step.astype(np.intp))
    below = np.cumsum(counts) / step.size
    edges = np.arange(counts.size) + 0.5
    spread = float(np.interp(0.6827, np.concatenate([[0.0], below]), np.concatenate([[0.0], edges])))
    return max(spread * scale / 2**0.5, floor)


def background_level(image: Picture, *, scale: float = 1.0) -> float:
    """The picture's usual grey level: its median."""
    return median_of(sample(image, scale))


def automatic(above: Picture, noise: float) -> float:
    """How far above the background the threshold lies, grey levels.

    above  grey levels over the background, any shape: every pixel, or every bright one
    noise  grey levels, standard deviation of a pixel
    A share of the way to the brighter objects (the 90th percentile of all that stands out of the noise), so the
    number and size of targets do not matter, as they do for Otsu's method where the target is a ten-thousandth of
    the picture. Never nearer than THRESHOLD.sigmas.
    """
    least = max(THRESHOLD.sigmas * noise, THRESHOLD.least_contrast)
    strong = above[above > least]
    if strong.size == 0:
        return least
    return max(least, THRESHOLD.share * float(np.percentile(strong, 90)))
