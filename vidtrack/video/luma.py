"""The luma plane of a decoded picture as an array, without converting it.

Every grey or BGR conversion of video stretches levels 16-235 to 0-255 (220 of 256 survive, whiter than white is
clipped, colour leaks in), so the stored plane is taken as it is: planar formats whole, packed ones every second
sample. Only pictures that hold no luma (RGB, palettes) are converted, by BT.601 at full range.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from av.video.plane import VideoPlane

from vidtrack.timing.frame import Luma

_PACKED = {  # pixel format -> (where the first luma sample is, how far apart they are), in samples
    "yuyv422": (0, 2),
    "yvyu422": (0, 2),
    "uyvy422": (1, 2),
    "y210le": (0, 2),
    "y212le": (0, 2),
    "y216le": (0, 2),
    "ya8": (0, 2),
    "ya16le": (0, 2),
    "ya16be": (0, 2),
}
_HIGH_BITS = ("p010", "p012", "p210", "p212", "p410", "p412", "y210", "y212")
"""Formats whose 10 or 12 bits are the upper ones of 16: as stored, they fill 16."""


def bits_of(pixel_format: Any) -> int:
    """How many bits the levels of `luma_reader` fill, 8 to 16."""
    bits = int(pixel_format.components[0].bits)
    converted = pixel_format.name not in _PACKED and not _has_a_luma_plane(pixel_format)
    if bits > 8 and (converted or pixel_format.name.startswith(_HIGH_BITS)):
        return 16
    return max(8, bits)


def colour_bits_of(picture: Any) -> int:
    """How many bits the levels of `colour.colour_reader` fill: 8, or 16 for deeper pictures."""
    return 8 if picture.format.components[0].bits <= 8 else 16


def luma_reader(pixel_format: Any) -> Callable[[Any], Luma]:
    """A function from a PyAV picture of that pixel format to its luma, (height, width) uint8 or uint16, read only.

    A view wherever luma is stored on its own; big-endian samples are copied into native order.
    """
    name = pixel_format.name
    if name in _PACKED:
        start, step = _PACKED[name]
    elif name == "pal8":
        return _through_palette
    elif _has_a_luma_plane(pixel_format):
        start, step = 0, 1
    else:
        return _converter(name, deep=bits_of(pixel_format) > 8)
    big = name.endswith("be")
    dtype = np.dtype(np.uint8 if bits_of(pixel_format) == 8 else (">u2" if big else "<u2"))

    def read(picture: Any) -> Luma:
        view = _view(picture, dtype, start, step)
        return view.astype("=u2") if big and dtype.itemsize == 2 else view

    return read


def _view(picture: Any, dtype: np.dtype[Any], start: int = 0, step: int = 1) -> Luma:
    """Every `step`-th sample of the first plane's lines from `start` on, without the padding at their ends.

    One array made at once, and one plane (picture.planes would make all): behind a decoder every step counts.
    """
    plane: Any = VideoPlane(picture, 0)
    stride, height = plane.line_size, picture.height
    first = start * dtype.itemsize - (stride * (height - 1) if stride < 0 else 0)  # a buffer begins at its lowest line
    view: Luma = np.ndarray((height, picture.width), dtype, plane, first, (stride, step * dtype.itemsize))
    view.setflags(write=False)
    return view


def _has_a_luma_plane(pixel_format: Any) -> bool:
    parts = pixel_format.components
    plain = not (pixel_format.is_rgb or pixel_format.has_palette or pixel_format.is_bit_stream or pixel_format.is_bayer)
    alone = sum(part.plane == 0 for part in parts) == 1
    return plain and alone and parts[0].bits <= 16


def _through_palette(picture: Any) -> Luma:
    """Frame grabbers store grey as indices of a palette of greys: most often they are the levels themselves."""
    indices = _view(picture, np.dtype(np.uint8))
    palette: Any = VideoPlane(picture, 1)  # a word each of alpha, red, green and blue, blue lowest
    blue, green, red = (np.frombuffer(palette, np.uint32) >> shift & 255 for shift in (0, 8, 16))
    grey = np.rint(0.299 * red + 0.587 * green + 0.114 * blue).astype(np.uint8)
    used = grey[: int(indices.max()) + 1]
    return indices if np.array_equal(used, np.arange(len(used))) else grey[indices]


def _converter(name: str, *, deep: bool) -> Callable[[Any], Luma]:
    """For pictures without a luma plane: BT.601 grey of RGB; packed 4:4:4 video is only unpacked."""
    from av.video.reformatter import VideoReformatter

    reformatter = VideoReformatter()
    unpacked = name.startswith(("vuy", "vyu", "ayuv", "xyuv", "uyva", "uyyvyy", "xv3", "xv4", "v30x"))
    target = ("yuv444p" if unpacked else "gray") + ("16le" if deep else "")
    dtype = np.dtype("<u2" if deep else np.uint8)

    def read(picture: Any) -> Luma:
        # one thread: with several, libswscale 9 leaves half-grey gaps in 16-bit grey where their parts meet
        grey = reformatter.reformat(picture, format=target, threads=1)
        return _view(grey, dtype)

    return read


def is_swapped(luma: Luma) -> bool:
    """Whether the two bytes of deep levels are exchanged: neighbours then differ by far more."""
    if luma.dtype.itemsize == 1:
        return False
    other = luma.byteswap()
    apart, apart_other = (np.abs(np.diff(a.astype(np.int64), axis=1)).sum() for a in (luma, other))
    return bool(apart_other < apart)
