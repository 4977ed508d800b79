"""The sound tracks of a recording, block by block, placed by their own time stamps.

Sample number over sampling rate is not the time of a sample: tracks begin before or after the picture, and have
gaps. So every block carries the time of its first sample on the picture's scale. Stamps that a container rounds
(Matroska: 1 ms) are averaged over the block.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import av
import numpy as np
from numpy.typing import NDArray

from vidtrack.video.container import open_container

_GAP = 0.004
"""s: stamps that stray further than this from the count of samples show a gap, not rounding."""


class SoundBlock(NamedTuple):
    """A stretch of sound without gaps.

    time     s after the first picture, of the first sample
    samples  (n, channels) float32, full scale 1
    rate     samples a second
    follows  whether it goes on where the block before it ended
    """

    time: float
    samples: NDArray[np.float32]
    rate: int
    follows: bool


def sound_tracks(path: str) -> int:
    """How many sound tracks a recording has; none where it is pictures without a container."""
    if str(path).lower().endswith(".mraw"):
        return 0
    with open_container(path) as container:
        return sum(1 for stream in container.streams.audio if stream.codec_context is not None)


def sound_blocks(
    path: str, track: int, *, start: Fraction = Fraction(0), seconds: float = 10.0
) -> Iterator[SoundBlock]:
    """The sound of one track in blocks of about `seconds`.

    start  s, the first picture's time stamp on the container's scale: VideoInfo.start
    Damaged packets leave a gap.
    """
    with open_container(path) as container:
        stream = container.streams.audio[track]
        parts: list[NDArray[np.float32]] = []
        stamps: list[tuple[int, float]] = []  # samples before it in the block, time stamp
        n, follows, rate = 0, False, 0
        for frame in _frames(container, stream):
            samples = _as_array(frame)
            now = float(frame.pts * frame.time_base - start) if frame.pts is not None else None
            expected = stamps[0][1] + n / rate if stamps else None
            jumped = now is not None and expected is not None and abs(now - expected) > _GAP + float(stream.time_base)
            if parts and (jumped or frame.sample_rate != rate or n >= seconds * rate):
                yield _block(parts, stamps, rate, follows)
                follows = not jumped and frame.sample_rate == rate
                parts, stamps, n = [], [] if now is not None or expected is None else [(0, expected)], 0
            rate = frame.sample_rate
            if now is not None or not (stamps or parts):
                stamps.append((n, now or 0.0))
            parts.append(samples)
            n += len(samples)
        if parts:
            yield _block(parts, stamps, rate, follows)


def _frames(container: Any, stream: Any) -> Iterator[Any]:
    try:
        for packet in container.demux(stream):
            try:
                yield from packet.decode()
            except (av.error.FFmpegError, EOFError):
                continue
    except av.error.FFmpegError:
        return


def _block(parts: list[NDArray[np.float32]], stamps: list[tuple[int, float]], rate: int, follows: bool) -> SoundBlock:
    before, times = np.array(stamps).T
    return SoundBlock(float(np.mean(times - before / rate)), np.concatenate(parts), rate, follows)


def _as_array(frame: Any) -> NDArray[np.float32]:
    """(n, channels), full scale 1."""
    values = frame.to_ndarray()
    columns = values.T if frame.format.is_planar else values.reshape(-1, frame.layout.nb_channels)
    if columns.dtype == np.uint8:
        return np.asarray((columns.astype(np.float32) - 128) / 128, np.float32)
    if columns.dtype.kind == "i":
        return np.asarray(columns.astype(np.float32) / float(1 << (8 * columns.dtype.itemsize - 1)), np.float32)
    return np.asarray(columns, np.float32)
