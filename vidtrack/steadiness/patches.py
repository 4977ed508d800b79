"""Patches of texture whose place can be measured to a small part of a pixel, spread all over a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools


@dataclass(frozen=True)
class Choice:
    """Which patches are good enough.

    half        px from a patch's middle to its edge
    across      patches along the picture's longer side: one in each square cell; most: of the steepest
    blur        px, sigma: takes what no interpolation renders, and most of the noise
    noise_ratio how many times steeper than noise a patch must be in its flattest direction
    least_slope grey levels a px, rms, in its flattest direction: less is a change of light, or compression
    """

    half: int = 14
    across: int = 8
    most: int = 40
    blur: float = 1.2
    noise_ratio: float = 4.0
    least_slope: float = 0.35


CHOICE = Choice()


def smooth(picture: NDArray[Any], choice: Choice = CHOICE) -> NDArray[np.float32]:
    """The picture (h, w) blurred a little, as patches are compared in it."""
    answer: NDArray[np.float32] = cv2.GaussianBlur(np.asarray(picture, np.float32), (0, 0), choice.blur)
    return answer


def chosen_patches(
    picture: NDArray[Any], *, scale: float = 1.0, shut: Bools | None = None, choice: Choice = CHOICE
) -> NDArray[np.intp]:
    """The middles (n, 2), column and row, of patches whose texture runs in both directions; n is 0 without texture.

    scale  grey levels (0 to 255) of one of the picture's levels
    shut   (h, w) what no patch may cover: targets and calibration balls
    The measure is the smaller eigenvalue of the mean product of slopes (Shi and Tomasi 1994).
    """
    h, w = picture.shape
    size = 2 * choice.half + 1
    if min(h, w) < 3 * size:
        return np.empty((0, 2), np.intp)
    image = smooth(picture, choice) * np.float32(scale)
    gx, gy = (cv2.Sobel(image, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    xx, yy, xy = (cv2.boxFilter(a, -1, (size, size)) for a in (gx * gx, gy * gy, gx * gy))
    flattest = (xx + yy) / 2 - np.sqrt(((xx - yy) / 2) ** 2 + xy * xy)
    allowed = np.zeros((h, w), bool)
    edge = choice.half + 3
    allowed[edge : h - edge, edge : w - edge] = True
    if shut is not None and shut.any():
        allowed &= cv2.dilate(shut.astype(np.uint8), np.ones((size, size), np.uint8)) == 0
    noise = _slope_noise(picture, choice) * scale
    least = max(choice.least_slope, choice.noise_ratio * noise) ** 2
    flattest = np.where(allowed, flattest, 0.0)
    found = []
    cell = max(size + 1, int(np.ceil(max(h, w) / choice.across)))
    for top in range(0, h, cell):
        for left in range(0, w, cell):
            part = flattest[top : top + cell, left : left + cell]
            at = np.unravel_index(int(part.argmax()), part.shape)
            if part[at] > least:
                found.append((float(part[at]), left + int(at[1]), top + int(at[0])))
    steepest = sorted(found, reverse=True)[: choice.most]
    return np.array([at[1:] for at in steepest], np.intp).reshape(-1, 2)


def _slope_noise(picture: NDArray[Any], choice: Choice) -> float:
    """The rms slope that white noise alone would give the smoothed picture, levels a px."""
    image = np.asarray(picture[::2], np.float32)
    high = image[:, 2:] - 2 * image[:, 1:-1] + image[:, :-2]
    noise = float(np.median(np.abs(high))) / 0.6745 / 6**0.5
    return float(noise / (8**0.5 * np.pi**0.5 * choice.blur**2))


def spread_over(b: Array, size: tuple[int, int]) -> float:
    """How far positions (n, 2), px, of a picture (width, height) lie about their mean, as a share of its longer side.

    Evenly spread over the longer side it is 0.29; on one thing, little.
    """
    return float(np.sqrt(np.var(b, axis=0).max()) / max(size)) if len(b) else 0.0
