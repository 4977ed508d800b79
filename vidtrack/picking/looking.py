"""One picture as the stages see it: grey levels, what is above the threshold, every blob, measured by their code."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Picture
from vidtrack.settings.detection import Detect
from vidtrack.timing.fields import PARITY, split
from vidtrack.tracking.detection.blobs import (
    Blobs,
    in_frame_buffer,
    measure_mask,
    thresholded,
)
from vidtrack.tracking.detection.contrast_stretch import LEVELS, Stretch, stretch
from vidtrack.tracking.detection.threshold import grey_scale
from vidtrack.tracking.sample import Sample

DETECT = ("polarity", "threshold", "min_pixels", "centroid", "fields", "gain", "offset")
"""The detect settings that change what is seen in one picture."""


class Look(NamedTuple):
    """A picture, or the first field of it, with the settings in force.

    image   stretched where the clip needs it; scale: grey levels 0 to 255 of one of its levels
    lines   px of the frame buffer to a row: 2 for a field; parity: its first row
    mask    1 where the image is above the threshold
    """

    image: Picture
    bits: int
    scale: float
    parity: int
    lines: int
    mask: NDArray[np.uint8]
    blobs: Blobs


def levels_of(luma: Picture, bits: int, detect: Mapping[str, Any]) -> Stretch | None:
    """How a clip's grey levels are stretched, from one picture of it."""
    wish = {name: detect[name] for name in ("gain", "offset") if detect.get(name) is not None}
    return stretch([luma], bits, dark=detect.get("polarity") == "dark", **wish)


def look_at(luma: Picture, bits: int, levels: Stretch | None, detect: Mapping[str, Any], flagged: str) -> Look:
    """Find and measure every blob of a picture.

    flagged   the order of fields that the file states; used where detect.fields is auto
    """
    order = detect.get("fields") or "auto"
    order = flagged if order == "auto" else order
    parity, lines = 0, 1
    if order in PARITY:
        parity, lines = PARITY[order], 2
        luma = split(luma, order)[0].luma
    if levels is not None:
        luma, bits = levels.over(luma), LEVELS.bits
    luma = np.ascontiguousarray(luma)
    scale = grey_scale(luma.dtype, bits)
    by = Detect().model_dump() | {name: value for name, value in detect.items() if value is not None}
    # find_blobs in its two steps: the page shows the mask as well
    image, mask, noise = thresholded(luma, scale, polarity=by["polarity"], threshold=by["threshold"])
    blobs = measure_mask(image, mask, scale=scale, noise=noise, min_pixels=by["min_pixels"], centroid=by["centroid"])
    if lines == 2:
        blobs = in_frame_buffer(blobs, Sample(luma, 0.0, parity, lines))
    return Look(luma, bits, scale, parity, lines, mask, blobs)


def mask_of(look: Look) -> NDArray[np.uint8]:
    """255 where a pixel belongs to something, in the frame buffer's rows."""
    return np.repeat(look.mask * np.uint8(255), look.lines, axis=0)


def grey_of(luma: Picture, bits: int, low: float, high: float) -> NDArray[np.uint8]:
    """A picture for the screen: grey levels from low to high spread over 0 to 255."""
    scale = 255.0 / (2**bits - 1)
    levels = np.arange(2**bits if luma.dtype != np.uint8 else 256, dtype=np.float32) * np.float32(scale)
    table = np.clip((levels - low) * (255.0 / max(high - low, 1.0)), 0, 255).astype(np.uint8)
    if luma.dtype == np.uint8:
        return np.asarray(cv2.LUT(luma, table), np.uint8)
    return np.asarray(table[np.minimum(luma, len(table) - 1)], np.uint8)


def nearest(look: Look, x: float, y: float, reach: float) -> dict[str, Any] | None:
    """The blob nearest to a place, or under it; None where none is within `reach` px of its rim."""
    b = look.blobs
    if not len(b.Xf):
        return None
    outside_x = np.maximum(np.maximum(b.left - x, x - (b.left + b.width - 1)), 0)
    outside_y = np.maximum(np.maximum(b.top - y, y - (b.top + b.height * look.lines - 1)), 0)
    rim = np.hypot(outside_x, outside_y)
    away = np.hypot(b.Xf - x, b.Yf - y)
    i = int(np.lexsort((away, rim))[0])
    return described(look, i) if rim[i] <= reach else None


def inside(look: Look, left: float, top: float, width: float, height: float) -> list[dict[str, Any]]:
    """The blobs whose middles lie in a box, the heaviest first."""
    b = look.blobs
    here = (b.Xf >= left) & (b.Xf < left + width) & (b.Yf >= top) & (b.Yf < top + height)
    chosen = np.flatnonzero(here)
    return [described(look, int(i)) for i in chosen[np.argsort(-b.mass[chosen])][:20]]


def described(look: Look, i: int) -> dict[str, Any]:
    """One blob in plain values: px, grey levels."""
    b = look.blobs
    pixels = int(b.pixels[i])
    return {
        "Xf": float(b.Xf[i]),
        "Yf": float(b.Yf[i]),
        "sd_x": float(b.sd_x[i]) if np.isfinite(b.sd_x[i]) else None,
        "sd_y": float(b.sd_y[i]) if np.isfinite(b.sd_y[i]) else None,
        "pixels": pixels,
        "contrast": _contrast(look, i),
        "edge": bool(b.edge[i]),
        "saturated": bool(b.saturated[i]),
        "left": int(b.left[i]),
        "top": int(b.top[i]),
        "width": int(b.width[i]),
        "height": int(b.height[i]) * look.lines,
    }


def _contrast(look: Look, i: int) -> float:
    """Grey levels of a blob's middle above (dark: below) the median of what surrounds it."""
    b, (rows, columns) = look.blobs, look.image.shape
    row = int(np.clip(round((b.Yf[i] - look.parity) / look.lines), 0, rows - 1))
    column = int(np.clip(round(float(b.Xf[i])), 0, columns - 1))
    reach_y, reach_x = int(b.height[i]) + 4, int(b.width[i]) + 4
    about = look.image[max(0, row - reach_y) : row + reach_y + 1, max(0, column - reach_x) : column + reach_x + 1]
    return abs(float(look.image[row, column]) - float(np.median(about))) * look.scale
