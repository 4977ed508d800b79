"""Frames onto tape: one video file, its codec, its time code, its lost frames; the same bytes every time.

Grey levels go into the luma plane as they are, without conversion. One thread encodes, and nothing that differs
from one run to the next (dates, random identifiers) is written.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable
from fractions import Fraction
from typing import Any, Literal, Self

import av
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from vidtrack.errors import VidtrackError
from vidtrack.simulate.picture import Levels
from vidtrack.simulate.plan import NotNegative, Plan
from vidtrack.simulate.recording import Interlace
from vidtrack.timing.timecode import Timecode

Codec = Literal["mjpeg", "ffv1", "h264", "mpeg2", "dv", "png"]

_ENCODERS: dict[str, tuple[str, str, dict[str, str]]] = {
    "mjpeg": ("mjpeg", "yuvj420p", {"qmin": "1", "qmax": "2"}),
    "ffv1": ("ffv1", "gray", {"level": "3", "context": "0"}),
    # x264's rate tree gives other bytes from one call to the next (720x480, AVX-512)
    "h264": ("libx264", "yuv420p", {"crf": "18", "preset": "veryfast", "mbtree": "0"}),
    "mpeg2": ("mpeg2video", "yuv420p", {"qmin": "2", "qmax": "3", "g": "12"}),
    "dv": ("dvvideo", "yuv411p", {}),
    "png": ("png", "gray", {}),
}
_DEEP = {10: "gray10le", 12: "gray12le", 16: "gray16le"}


class Tape(Plan):
    """What the recordings are kept on."""

    codec: Codec = Field("mjpeg", description="ffv1 loses nothing; png is a still picture")
    container: str = Field("mov", description="the file's ending: mov, mkv, mp4, avi, mpg, dv, png")
    timecode: Literal["none", "file", "ltc", "both"] = Field(
        "file", description="in the file's own track or tags, as sound (longitudinal), both or none"
    )
    options: dict[str, str | int | float] = Field({}, description="further options of the encoder, such as crf: 23")
    sound_rate: int = Field(48000, description="samples a second")
    sound_level: float = Field(0.5, description="amplitude of the time code; below 0: the other polarity")
    sound_noise: NotNegative = Field(0.0, description="sigma, of full scale 1")

    @model_validator(mode="after")
    def _container_holds_it(self) -> Self:
        if (self.codec == "png") != (self.container == "png"):
            raise ValueError("a still picture has codec png and container png")
        if self.timecode in ("ltc", "both") and self.container not in ("mov", "mkv", "avi"):
            raise ValueError(f"time code as sound goes into mov, mkv or avi, not into {self.container}")
        return self


class Sound(Plan):
    """An audio track: samples (n,) int16, and how many of them a second."""

    samples: Any
    rate: int = 48000


def write_tape(
    path: str,
    frames: Iterable[Levels],
    tape: Tape,
    *,
    rate: Fraction,
    bits: int = 8,
    interlace: Interlace = "none",
    start: Timecode | None = None,
    lost: Collection[int] = (),
    sound: Sound | None = None,
) -> None:
    """Write frames (height, width) as a video file, making its folder; frames numbered in `lost` leave a gap in time.

    start   time code of the first frame, written into the file where the tape keeps time codes there
    The file appears under its name only when it is whole. Raises VidtrackError for what the codec does not take.
    """
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    root, ending = os.path.splitext(path)
    partial = f"{root}.partial{ending}"
    try:
        with av.open(partial, "w", container_options={"fflags": "+bitexact"}) as container:
            _write(container, frames, tape, rate, bits, interlace, start, lost, sound)
        os.replace(partial, path)
    except av.error.ArgumentError as error:  # sizes, rates and fields that a codec does not have, as DV
        raise VidtrackError(
            f"{path}: the codec {tape.codec} does not take this size, rate or field order ({error.strerror}). Change "
            "them, or recording.tape.codec."
        ) from None
    finally:
        if os.path.exists(partial):
            os.unlink(partial)


def _write(
    container: Any,
    frames: Iterable[Levels],
    tape: Tape,
    rate: Fraction,
    bits: int,
    interlace: Interlace,
    start: Timecode | None,
    lost: Collection[int],
    sound: Sound | None,
) -> None:
    stream, audio = None, None
    for k, levels in enumerate(frames):
        if stream is None:
            stream = _video_stream(container, tape, levels.shape, rate, bits, interlace)
            if start is not None and tape.timecode in ("file", "both"):
                stream.metadata["timecode"] = str(start)
                container.metadata["timecode"] = str(start)
            audio = _audio_stream(container, sound)
        if k not in lost:
            frame = _video_frame(levels, stream.pix_fmt)
            frame.pts, frame.time_base = k, 1 / rate
            container.mux(stream.encode(frame))
    if stream is not None:
        container.mux(stream.encode(None))
    if audio is not None and sound is not None:
        _write_sound(container, audio, sound)


def _video_stream(container: Any, tape: Tape, shape: tuple[int, ...], rate: Fraction, bits: int, interlace: str) -> Any:
    encoder, pix_fmt, options = _ENCODERS[tape.codec]
    flags = "+bitexact"
    if interlace != "none":
        options = {**options, "field_order": {"top": "tt", "bottom": "bb"}[interlace]}
        flags += "+ildct+ilme" if tape.codec in ("h264", "mpeg2") else ""
        if tape.codec == "h264":
            options["x264-params"] = {"top": "tff=1", "bottom": "bff=1"}[interlace]
    stream = container.add_stream(encoder, rate=rate)
    stream.height, stream.width = shape[:2]
    stream.pix_fmt = _DEEP[bits] if bits > 8 else pix_fmt
    stream.time_base = 1 / rate
    stream.codec_context.thread_count = 1
    stream.options = {**options, "flags": flags, **{name: str(value) for name, value in tape.options.items()}}
    return stream


def _video_frame(levels: Levels, pix_fmt: str) -> Any:
    height, width = levels.shape
    frame = av.VideoFrame(width, height, pix_fmt)
    plane = frame.planes[0]
    rows: NDArray[Any] = np.frombuffer(plane, np.uint8).reshape(height, plane.line_size)
    rows[:, : width * levels.itemsize] = levels.view(np.uint8).reshape(height, -1)
    for colour in frame.planes[1:]:
        np.frombuffer(colour, np.uint8)[:] = 128
    return frame


def _audio_stream(container: Any, sound: Sound | None) -> Any:
    if sound is None:
        return None
    stream = container.add_stream("pcm_s16le", rate=sound.rate, layout="mono")
    stream.options = {"flags": "+bitexact"}
    return stream


def _write_sound(container: Any, stream: Any, sound: Sound, block: int = 4096) -> None:
    samples = np.ascontiguousarray(sound.samples, np.int16)
    for first in range(0, len(samples), block):
        frame = av.AudioFrame.from_ndarray(samples[None, first : first + block], format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = sound.rate, first, Fraction(1, sound.rate)
        container.mux(stream.encode(frame))
    container.mux(stream.encode(None))
