"""What a recording's microphone recorded, on the camera's own time, at a low sampling rate; time code is no sound.

Samples are averaged over even steps of the camera's time, so that tracks of any sampling rate can be compared with
each other, and a tape that ran too fast sounds as the room did.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.timing.ltc import read_words
from vidtrack.video.sound import SoundBlock, sound_blocks, sound_tracks

RATE_HZ = 8000
"""Samples a second: claps and room noise lie below half of it."""

PATIENCE = 3
"""Blocks of 10 s in which a channel may prove to be time code."""

WORDS = 3
"""So many words of time code are no accident."""


class RoomSound(NamedTuple):
    """A camera's sound on its own time.

    start    s, camera time of the first sample's middle
    samples  (n,) float32 at RATE_HZ, full scale 1; 0 where nothing was recorded
    note     which track it is, or why there is none
    """

    start: float
    samples: NDArray[np.float32]
    note: str


def room_sound(path: str, start: Fraction, stamps: Array, times: Array, *, pace: Fraction | float = 1) -> RoomSound:
    """The sound of the first track that has a channel without time code; its channels' mean.

    start   s, of the first picture on the container's scale: VideoInfo.start
    stamps  (n,) s after the first picture, rising, of pictures whose camera time `times` (n,), s, is known
    pace    of slow motion is not 1: its sound is not stretched as its pictures are, and is not used
    Empty, with a note, where there is none, or where the camera's time jumps.
    """
    nothing = np.zeros(0, np.float32)
    if pace != 1:
        return RoomSound(0.0, nothing, "not used: the rate of the pictures was given")
    n_tracks = sound_tracks(path)
    if not n_tracks or len(stamps) < 2:
        return RoomSound(0.0, nothing, "no sound")
    for track in range(n_tracks):
        channels = _channels_without_code(sound_blocks(path, track, start=start))
        if channels:
            break
    else:
        return RoomSound(0.0, nothing, "time code alone")
    pieces: list[tuple[int, NDArray[np.float32]]] = []
    origin, recorded = None, 0.0
    for block in sound_blocks(path, track, start=start):
        mean = block.samples[:, channels].mean(1)
        edges = _camera_time(block.time + (np.arange(len(mean) + 1) - 0.5) / block.rate, stamps, times)
        if not edges[-1] > edges[0]:
            return RoomSound(0.0, nothing, "its time code jumps back")
        origin = float(edges[0]) if origin is None else origin
        recorded += len(mean) / block.rate
        pieces.append(_averaged(mean, (edges - origin) * RATE_HZ))
    first = min(k for k, _ in pieces)
    last = max(k + len(values) for k, values in pieces)
    if (last - first) / RATE_HZ > 2 * recorded + 10:
        return RoomSound(0.0, nothing, "its time code jumps")
    samples = np.zeros(last - first, np.float32)
    for k, values in pieces:
        samples[k - first : k - first + len(values)] += values
    assert origin is not None
    name = f"track {track + 1}" + ("" if len(channels) == 1 else f", mean of {len(channels)} channels")
    return RoomSound(origin + (first + 0.5) / RATE_HZ, samples, name)


def _channels_without_code(blocks: Iterator[SoundBlock]) -> list[int]:
    """The channels in which the first blocks show no time code; none for a track without any sample."""
    code: set[int] = set()
    n = 0
    for k, block in enumerate(blocks):
        n = block.samples.shape[1]
        code |= {
            c for c in range(n) if c not in code and len(read_words(block.samples[:, c], block.rate).start) >= WORDS
        }
        if k + 1 >= PATIENCE:
            break
    return [c for c in range(n) if c not in code]


def _camera_time(at: Array, stamps: Array, times: Array) -> Array:
    """Camera time (n,), s, of moments `at` (n,), s after the first picture; straight on beyond the first and last."""
    inside = np.interp(at, stamps, times)
    beyond = np.where(at < stamps[0], at - stamps[0], np.where(at > stamps[-1], at - stamps[-1], 0.0))
    # by the usual speed, near 1 but for tapes that were played at another
    return np.asarray(inside + beyond * float(np.median(np.diff(times) / np.diff(stamps))))


def _averaged(samples: NDArray[np.floating], edges: Array) -> tuple[int, NDArray[np.float32]]:
    """Samples (n,) between edges (n + 1,), steps, as their integral over whole steps: the first step, and values."""
    first, last = int(np.floor(edges[0])), int(np.ceil(edges[-1]))
    total = np.concatenate([[0.0], np.cumsum(samples * np.diff(edges))])
    return first, np.diff(np.interp(np.arange(first, last + 1), edges, total)).astype(np.float32)
