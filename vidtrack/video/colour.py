"""One plane of levels from the colours of a picture, for targets that luma does not distinguish.

    a channel           "r", "g" or "b"
    a projection        three weights of red, green and blue, such as (1, -1, 0)
    a hue and a width   degrees, as on the colour wheel: 0 red, 60 yellow, 120 green, 240 blue. Level: the part of the
                        chroma vector along the hue, less what lies across it by the cotangent of half the width, so
                        that grey is in the middle of the scale, and so is a colour that is off by half the width

All are linear in the colours, but for the last across the hue, so that a pixel that an edge divides gets the mean of
both sides and a centroid is not drawn to either. Chroma that is stored at half the resolution is interpolated to where
its samples lie between those of luma (ITU-T H.264, annex E; JFIF; each field by itself where pictures are interlaced).
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from av.video.plane import VideoPlane
from av.video.reformatter import VideoReformatter

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Luma
from vidtrack.video.luma import colour_bits_of

Colour = str | Sequence[float] | Mapping[str, float]

_CHANNELS = {"r": (1.0, 0.0, 0.0), "g": (0.0, 1.0, 0.0), "b": (0.0, 0.0, 1.0)}
_KR_KB = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 6: (0.299, 0.114), 7: (0.212, 0.087), 9: (0.2627, 0.0593)}
"""Weights of red and blue in luma by libavutil's number of the matrix: BT.709, BT.601 twice, SMPTE 240M, BT.2020."""

_HD = 720
"""Lines from which BT.709 is meant where the matrix is not stated."""

_CENTRED = ("mjpeg", "mpeg1video", "h261", "h263", "flv1", "webp")
"""Codecs whose chroma samples lie between two of luma along a line; in others they lie on the first of the two."""

_PLANAR = {
    "nv12": "yuv420p",
    "nv21": "yuv420p",
    "nv16": "yuv422p",
    "nv24": "yuv444p",
    "p010le": "yuv420p10le",
    "p210le": "yuv422p10le",
    "yuyv422": "yuv422p",
    "uyvy422": "yuv422p",
    "yvyu422": "yuv422p",
    "uyyvyy411": "yuv411p",
    "y210le": "yuv422p10le",
}
"""Formats that only need unpacking, without a change of any sample."""


class Combination(NamedTuple):
    """level = constant + (weights of Y, Cb, Cr) of normalised values - across |(weights of Cb, Cr)|, 0 to 1.

    Y is 0 to 1, Cb and Cr -0.5 to 0.5.
    """

    constant: float
    weights: tuple[float, float, float]
    across: tuple[float, float] = (0.0, 0.0)


def combination(colour: Colour, kr: float, kb: float) -> Combination:
    """What makes a plane of levels of Y, Cb and Cr whose luma weighs red by `kr` and blue by `kb`."""
    if isinstance(colour, Mapping):
        red, green, blue = colorsys.hsv_to_rgb(colour["hue"] / 360 % 1, 1, 1)
        y = kr * red + (1 - kr - kb) * green + kb * blue
        along = np.array([(blue - y) / (2 * (1 - kb)), (red - y) / (2 * (1 - kr))])
        cb, cr = along / np.hypot(*along)
        slope = 1 / np.tan(np.radians(max(colour.get("width") or 180.0, 1.0) / 2))
        slope = 0.0 if slope < 1e-9 else float(slope)
        return Combination(0.5, (0.0, float(cb), float(cr)), (float(-cr * slope), float(cb * slope)))
    weights = _CHANNELS[colour] if isinstance(colour, str) else tuple(float(w) for w in colour)
    red, green, blue = weights
    below, size = sum(-w for w in weights if w < 0), sum(abs(w) for w in weights)
    kg = 1 - kr - kb
    cb = 2 * (1 - kb) * (blue - green * kb / kg)
    cr = 2 * (1 - kr) * (red - green * kr / kg)
    return Combination(below / size, ((red + green + blue) / size, cb / size, cr / size))


def colour_reader(picture: Any, codec: str, colour: Colour, path: str) -> Callable[[Any], Luma]:
    """A function from PyAV pictures like this one to their levels, (height, width) uint8 or uint16.

    codec  libavcodec's name, which says where chroma samples lie
    Raises VidtrackError naming `path` where pictures have no colour.
    """
    name = picture.format.name
    if name.startswith(("gray", "mono", "ya8", "ya16", "y400")):
        raise VidtrackError(f"{path}: detect.colour is set, and the pictures are grey. Remove it for this camera.")
    deep = colour_bits_of(picture) == 16
    if name.startswith(("yuv", "yuvj", "yuva")) and not name.endswith("be") and "p" in name:
        target = name
    else:
        target = _PLANAR.get(name) or ("gbrp16le" if deep else "gbrp")
    unpack = None if target == name else VideoReformatter()
    rgb = target.startswith("gbrp")
    kr, kb = (0.299, 0.114) if rgb else _KR_KB.get(picture.colorspace, _usual(picture.height))
    how = combination(colour, kr, kb)
    full = rgb or picture.color_range == 2 or name.startswith("yuvj")
    centred = codec in _CENTRED

    def read(picture: Any) -> Luma:
        planar = picture if unpack is None else unpack.reformat(picture, format=target, threads=1)
        bits = planar.format.components[0].bits
        planes = [_plane(planar, k) for k in range(3)]
        if rgb:
            green, blue, red = (plane.astype(np.float32) / (2**bits - 1) for plane in planes)
            y = kr * red + (1 - kr - kb) * green + kb * blue
            cb, cr = (blue - y) / (2 * (1 - kb)), (red - y) / (2 * (1 - kr))
        else:
            unit = 2.0 ** (bits - 8)
            black, white, swing = (0.0, 2.0**bits - 1, 2.0**bits - 1) if full else (16 * unit, 219 * unit, 224 * unit)
            size = planes[0].shape
            y = (planes[0].astype(np.float32) - np.float32(black)) / np.float32(white)
            cb, cr = (
                (_as_luma(plane, size, centred, picture.interlaced_frame) - np.float32(128 * unit)) / np.float32(swing)
                for plane in planes[1:]
            )
        return _levels(how, y, cb, cr, deep=deep)

    return read


def colour_of_bgr(picture: Luma, colour: Colour) -> Luma:
    """Levels of a picture (height, width, 3 or more) of blue, green and red, uint8 or uint16."""
    kr, kb = 0.299, 0.114
    blue, green, red = (picture[..., k].astype(np.float32) / np.iinfo(picture.dtype).max for k in range(3))
    y = kr * red + (1 - kr - kb) * green + kb * blue
    parts = y, (blue - y) / (2 * (1 - kb)), (red - y) / (2 * (1 - kr))
    return _levels(combination(colour, kr, kb), *parts, deep=picture.dtype.itemsize == 2)


def _levels(how: Combination, y: Any, cb: Any, cr: Any, *, deep: bool) -> Luma:
    a, b, c = how.weights
    level = how.constant + b * cb + c * cr
    if a:
        level += a * y
    if any(how.across):
        level -= np.abs(how.across[0] * cb + how.across[1] * cr)
    top = 65535 if deep else 255
    levels: Luma = np.rint(np.clip(level, 0, 1) * top).astype(np.uint16 if deep else np.uint8)
    levels.setflags(write=False)
    return levels


def _usual(height: int) -> tuple[float, float]:
    return _KR_KB[1] if height >= _HD else _KR_KB[6]


def _plane(picture: Any, k: int) -> Any:
    part = next(c for c in picture.format.components[:3] if c.plane == k)
    plane: Any = VideoPlane(picture, k)
    dtype = np.dtype(np.uint8 if part.bits <= 8 else "<u2")
    first = -plane.line_size * (plane.height - 1) if plane.line_size < 0 else 0
    return np.ndarray((plane.height, plane.width), dtype, plane, first, (plane.line_size, dtype.itemsize))


def _as_luma(plane: Any, size: tuple[int, int], centred: bool, interlaced: bool) -> Any:
    """A plane of chroma at each sample of luma (height, width), linear between its own."""
    rows, columns = (round(want / have) if have else 1 for want, have in zip(size, plane.shape, strict=True))
    if rows == columns == 1:
        return plane.astype(np.float32)
    across = (columns - 1) / 2 if centred else 0.0
    if not interlaced or rows == 1:
        return _spread(plane, size, columns, across, rows, (rows - 1) / 2)
    whole = np.empty(size, np.float32)
    for field in (0, 1):  # a field's chroma lies a quarter of its lines below its first line of luma, or three quarters
        part = whole[field::2]
        part[:] = _spread(plane[field::2], part.shape, columns, across, rows, (rows - 1) * (0.25 + 0.5 * field))
    return whole


def _spread(plane: Any, size: tuple[int, ...], columns: int, left: float, rows: int, top: float) -> Any:
    back = np.array([[1 / columns, 0, -left / columns], [0, 1 / rows, -top / rows]])
    return cv2.warpAffine(
        np.ascontiguousarray(plane, np.float32),
        back,
        (size[1], size[0]),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
