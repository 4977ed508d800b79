"""Writing a film: pictures one after the other into an MP4 that every browser plays."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import IO, Any

import av
import numpy as np
from numpy.typing import NDArray

TICKS = 90_000
"""Steps of a film's time in a second."""

CODECS: tuple[tuple[str, dict[str, str]], ...] = (
    ("libx264", {"crf": "23", "preset": "veryfast"}),
    ("libopenh264", {}),
    ("mpeg4", {"qscale": "4"}),
)
"""Encoders, best first; builds of FFmpeg without the first have one of the others."""


def write_film(
    file: IO[bytes],
    pictures: Iterable[tuple[Fraction, NDArray[np.uint8]]],
    rate: Fraction,
    *,
    sample_aspect: Fraction = Fraction(1),
) -> int:
    """Write an MP4 and return how many pictures it has; there must be one at least.

    file            binary, to be written from its beginning
    pictures        time (s, rising) and picture (h, w, 3) of blue, green and red, all of one size
    rate            pictures a second, as players show it
    sample_aspect   width of a pixel over its height
    Raises ValueError for no picture.
    """
    codec, options = next((c, o) for c, o in CODECS if c in av.codecs_available)
    count, last = 0, -1
    with av.open(file, "w", format="mp4") as film:
        stream: Any = None
        first = Fraction(0)
        for time, picture in pictures:
            even = _even(picture)
            if stream is None:
                stream = film.add_stream(codec, rate=rate, options=options)
                stream.height, stream.width = even.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.codec_context.sample_aspect_ratio = sample_aspect
                stream.codec_context.time_base = Fraction(1, TICKS)
                stream.codec_context.thread_count = 1  # the same film, whatever the computer
                first = time
            frame = av.VideoFrame.from_ndarray(even, format="bgr24")
            last = max(last + 1, round((time - first) * TICKS))
            frame.pts, frame.time_base = last, Fraction(1, TICKS)
            film.mux(stream.encode(frame))
            count += 1
        if stream is None:
            raise ValueError("a film needs one picture at least")
        film.mux(stream.encode())
    return count


def _even(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture with its last row or column repeated where their number is odd: yuv420p has pairs."""
    odd = [size % 2 for size in picture.shape[:2]]
    return np.pad(picture, ((0, odd[0]), (0, odd[1]), (0, 0)), mode="edge") if any(odd) else picture
