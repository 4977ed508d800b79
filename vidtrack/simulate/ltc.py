"""Longitudinal time code, the sound that a laboratory's recorder puts on an audio track.

Every frame of code is a word of 80 bits: hours, minutes, seconds and frames in binary-coded decimal, least
significant bit first, with user bits between them, and a sync word that occurs nowhere else. The signal turns over
at the start of every bit, and once more in the middle of a 1 (biphase mark), so that its level and polarity carry
nothing and it can be read at any speed.

Source: SMPTE ST 12-1, sections 9.2 to 9.5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.timing.timecode import Timecode, nominal, parts_from_frame

_SYNC = (0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 1)


def words(frames: ArrayLike, code: Timecode, *, user_bits: int = 0) -> NDArray[np.uint8]:
    """The bits (n, 80), 0 or 1, of the words of frames (n,), numbers since midnight.

    code       gives the rate and whether the count is drop-frame; its own number is not used
    user_bits  32 bits that go into every word
    The polarity bit makes the zeros of each word even in number, so that all words begin at the same level.
    """
    parts = parts_from_frame(frames, code.rate, code.drop)
    bits = np.zeros((*parts.frames.shape, 80), np.uint8)
    for at, width, part in ((0, 2, parts.frames), (16, 3, parts.seconds), (32, 3, parts.minutes), (48, 2, parts.hours)):
        for bit in range(4):
            bits[..., at + bit] = part % 10 >> bit & 1
        for bit in range(width):
            bits[..., at + 8 + bit] = part // 10 >> bit & 1
    bits[..., 10] = code.drop
    for group in range(8):
        for bit in range(4):
            bits[..., 4 + 8 * group + bit] = user_bits >> (4 * group + bit) & 1
    bits[..., 64:] = _SYNC
    polarity = 59 if nominal(code.rate) == 25 else 27
    bits[..., polarity] = (80 - bits.sum(-1)) % 2
    return bits


def ltc_signal(
    times: ArrayLike,
    first: Timecode,
    *,
    start: float = 0.0,
    speed: float = 1.0,
    level: float = 0.5,
    rise: float = 40e-6,
    user_bits: int = 0,
) -> Array:
    """The sound of longitudinal time code, sampled at `times`.

    times      (n,) s, rising
    first      the code whose word begins at `start`, s; words run on before and after it
    speed      of the tape: 2 is twice as many words a second
    level      amplitude, negative for the other polarity; full scale is 1
    rise       s that an edge takes from -63 % to +63 % or so; the standard asks for 25e-6 +- 5e-6, tape gives more
    user_bits  32 bits carried in every word
    Edges lie exactly where they should, between samples too, so that a decoder's placing can be judged.
    """
    times = np.asarray(times, float)
    position = (times - start) * float(first.rate) * speed  # in words
    low, high = int(np.floor(position[0])) - 1, int(np.ceil(position[-1])) + 2
    bits = words(first.frame + np.arange(low, high), first, user_bits=user_bits)
    turns = np.ones((len(bits), 80, 2), bool)
    turns[:, :, 1] = bits == 1
    edges = np.flatnonzero(turns) / 160 + low
    after = np.searchsorted(edges, position, side="right")
    width = rise * float(first.rate) * speed
    since, until = position - edges[after - 1], edges[after] - position
    return np.asarray(level * np.where(after % 2, 1.0, -1.0) * np.tanh(2 * since / width) * np.tanh(2 * until / width))
