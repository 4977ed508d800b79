"""Small recordings for tests: a bright ball on noise, in any codec and container, with time code and sound."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

NTSC = Fraction(30000, 1001)


@contextmanager
def same_priority() -> Iterator[None]:
    """SVT's AV1 encoder gives the thread that calls it real-time priority, where it may, and leaves it there."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)


def ball(
    width: int, height: int, x: float, y: float, *, radius: float = 6.0, row0: int = 0, step: int = 1
) -> np.ndarray:
    """A soft ball, levels 40 to 200 float, on rows row0, row0 + step, ... of the frame buffer."""
    Y, X = np.mgrid[row0:height:step, :width]
    return 40 + 160 / (1 + np.exp(np.clip(1.2 * (np.hypot(X - x, Y - y) - radius), -50, 50)))


def moving_ball(width: int, height: int, speed: float = 2.0, noise: float = 2.0) -> Callable[[int], np.ndarray]:
    """Pictures of a ball that moves right by `speed` px a frame, the same for the same frame every time."""

    def picture(i: int) -> np.ndarray:
        rng = np.random.default_rng(i)
        levels = ball(width, height, 30 + speed * i, height / 2 + 0.3) + rng.normal(0, noise, (height, width))
        return np.clip(np.rint(levels), 16, 235).astype(np.uint8)

    return picture


def video_frame(levels: np.ndarray, pix_fmt: str) -> Any:
    """A frame whose luma plane holds exactly these levels; planar and grey formats only."""
    height, width = levels.shape
    frame = av.VideoFrame(width, height, pix_fmt)
    lines = np.frombuffer(frame.planes[0], levels.dtype).reshape(height, -1)
    lines[:, :width] = levels
    for plane in frame.planes[1:]:
        np.frombuffer(plane, levels.dtype)[:] = 128 << 8 * (levels.itemsize - 1) >> (8 - 2) * (levels.itemsize - 1)
    return frame


def make_clip(
    path: Path,
    codec: str,
    pix_fmt: str,
    *,
    n: int = 12,
    size: tuple[int, int] = (160, 120),
    rate: Fraction = NTSC,
    picture: Callable[[int], np.ndarray] | None = None,
    stamps: list[int] | None = None,
    stamp_base: Fraction | None = None,
    options: dict[str, str] | None = None,
    timecode: str | None = None,
    sound: np.ndarray | None = None,
    sound_rate: int = 48000,
    sound_start: int = 0,
    sound_codec: str = "pcm_s16le",
    muxer: str | None = None,
) -> Path:
    """Encode `picture(i)` (uint8 or uint16) for i < n; `stamps` in units of `stamp_base` for a rate that varies.

    sound  (samples,) or (channels, samples), full scale 1, starting `sound_start` samples after the first picture
    """
    picture = picture or moving_ball(*size)
    with same_priority(), av.open(str(path), "w", format=muxer) as container:
        stream = container.add_stream(codec, rate=rate)
        stream.width, stream.height = size
        stream.pix_fmt, stream.options = pix_fmt, options or {}
        stream.codec_context.thread_count = 1
        if stamp_base:
            stream.codec_context.time_base = stamp_base
        if timecode:
            stream.metadata["timecode"] = container.metadata["timecode"] = timecode
        track = None
        if sound is not None:
            sound = np.atleast_2d(sound)
            track = container.add_stream(sound_codec, rate=sound_rate, layout="mono" if len(sound) == 1 else "stereo")
        for i in range(n):
            frame = video_frame(picture(i), pix_fmt)
            frame.pts = stamps[i] if stamps else i
            frame.time_base = stamp_base or 1 / rate
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        if track is not None:
            samples = np.rint(np.clip(sound, -1, 1) * 32767).astype(np.int16)
            for at in range(0, samples.shape[1], 1024):
                block = np.ascontiguousarray(samples[:, at : at + 1024].T.reshape(1, -1))
                frame = av.AudioFrame.from_ndarray(block, "s16", track.layout.name)
                frame.sample_rate, frame.pts, frame.time_base = sound_rate, sound_start + at, Fraction(1, sound_rate)
                container.mux(track.encode(frame))
            container.mux(track.encode(None))
    return path
