"""From the light that falls on a sensor to grey levels: background, paint, gain, noise, quantisation, saturation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from statistics import NormalDist
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from vidtrack.arrays import Array
from vidtrack.simulate.plan import NotNegative, Plan

Scene = NDArray[np.float32]
Levels = NDArray[np.uint8] | NDArray[np.uint16]


class Patch(Plan):
    """Something still and bright (or dark) in one camera's picture: a sign, a metre stick, a reflection."""

    camera: str
    left: float = Field(description="px, position of the first column's centre")
    top: float
    width: Annotated[float, Field(gt=0)]
    height: Annotated[float, Field(gt=0)]
    level: float = Field(description="grey level")


class Picture(Plan):
    """How a camera turns light into grey levels. Levels are those of 8 bits, whatever the depth recorded."""

    background: float = Field(24.0, description="grey level of the empty scene")
    gradient: tuple[float, float] = Field(
        (0.0, 0.0), description="grey levels that it rises across, and down the picture"
    )
    contrast: float = Field(200.0, description="grey levels of a target above the background; below 0: dark targets")
    limb: Annotated[float, Field(ge=0, le=1)] = Field(0.0, description="share of the contrast lost at a ball's rim")
    blur_px: NotNegative = Field(0.5, description="px, sigma of the lens's and the sensor's blur")
    noise: NotNegative = Field(3.0, description="grey levels, sigma, white")
    gain: float = 1.0
    offset: float = 0.0
    light_drift_per_s: float = Field(0.0, description="share by which all light grows each second")
    flicker: float = Field(0.0, description="share by which all light swings")
    flicker_hz: float = 0.5
    bits: Literal[8, 10, 12, 16] = 8


def empty_scene(picture: Picture, size: tuple[int, int], clutter: Sequence[Patch] = ()) -> Scene:
    """The picture (height, width) before any ball, grey levels: background, gradient, clutter."""
    width, height = size
    across = picture.gradient[0] * ((np.arange(width) + 0.5) / width - 0.5)
    down = picture.gradient[1] * ((np.arange(height) + 0.5) / height - 0.5)
    scene = (picture.background + down[:, None] + across[None, :]).astype(np.float32)
    for patch in clutter:
        share = np.outer(_filled(height, patch.top, patch.height), _filled(width, patch.left, patch.width))
        scene = scene + share * (patch.level - scene)
    return scene


def _filled(n: int, first: float, length: float) -> Array:
    """The share (n,) of each pixel that lies between `first` - 0.5 and that plus `length`."""
    edge = np.arange(n) - 0.5
    begin, end = first - 0.5, first - 0.5 + length
    share: Array = np.clip(np.minimum(edge + 1, end) - np.maximum(edge, begin), 0.0, 1.0)
    return share


def paint(scene: Scene, share: Array, left: int, top: int, level: float, field: int | None = None) -> None:
    """Cover part of `scene` (height, width), in place, with a ball: `share` (size, size) of each pixel is its `level`.

    left, top   px, where the piece's first pixel lies; any part outside the picture is left out
    field       0 or 1: only rows 0, 2, 4, ... or 1, 3, 5, ... of the picture; None: all
    """
    height, width = scene.shape
    x0, x1 = max(left, 0), min(left + share.shape[1], width)
    y0, y1 = max(top, 0), min(top + share.shape[0], height)
    step = 1 if field is None else 2
    if field is not None:
        y0 += (field - y0) % 2
    if x0 < x1 and y0 < y1:
        here = scene[y0:y1:step, x0:x1]
        here += share[y0 - top : y1 - top : step, x0 - left : x1 - left] * (level - here)


def developed(picture: Picture, scene: Scene, t: float, rng: np.random.Generator) -> Levels:
    """The recorded grey levels (height, width) of a scene at t s: light, gain, offset, noise, rounded and clipped.

    uint8 for 8 bits; uint16, scaled to the depth, for more.
    """
    light = 1 + picture.light_drift_per_s * t + picture.flicker * np.sin(2 * np.pi * picture.flicker_hz * t)
    image = _white_noise(scene.shape, rng)
    image *= np.float32(picture.noise)
    image += scene * np.float32(picture.gain * light) + np.float32(picture.offset)
    scale = 2 ** (picture.bits - 8)
    if scale > 1:
        image *= np.float32(scale)
    np.rint(image, out=image)
    np.clip(image, 0, 255 if scale == 1 else 2**picture.bits - 1, out=image)
    return image.astype(np.uint8) if scale == 1 else image.astype(np.uint16)


def _white_noise(shape: tuple[int, ...], rng: np.random.Generator) -> Scene:
    """Normal noise of unit variance from a table of 65536 quantiles: fast, at the price of tails beyond 4.3 sigma."""
    draws = np.frombuffer(rng.bytes(2 * math.prod(shape)), "<u2")
    return _quantiles().take(draws).reshape(shape)


@lru_cache(maxsize=1)
def _quantiles() -> Scene:
    upper = np.array([NormalDist().inv_cdf((k + 0.5) / 65536) for k in range(32768, 65536)])
    upper /= np.sqrt(np.mean(upper**2))
    return np.concatenate([-upper, upper]).astype(np.float32)
