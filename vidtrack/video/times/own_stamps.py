"""Time stamps that recorders write beside their pictures, where libavformat only counts: Phantom CINE, SER.

Sources: Vision Research, "Cine File Format", tagged block 1002; SER file format 3 (Wookey, Grafton), trailer.
"""

from __future__ import annotations

import struct
from fractions import Fraction
from typing import BinaryIO

import numpy as np

from vidtrack.timing.timecode import exact_rate

TICK = 1e-7
"""s: SER counts in it, CINE in less."""

LONGEST_STEP = 3600
"""s between two pictures; stamps that lie further apart are damaged."""

_TIMES = 1002
"""CINE's tag of a block of times, eight bytes each."""

_MOST = 50_000_000
"""Pictures; more are claimed by damage alone."""

_LONGEST = 64 << 20
"""Bytes of a CINE's tagged block that are looked through."""


def own_stamps(path: str, kind: str) -> list[Fraction] | None:
    """s after the first picture of each picture of a container of that kind; None where the file has none.

    Stamps that do not rise are none.
    """
    find = {"cine": _of_cine, "ser": _of_ser}.get(kind)
    if find is None:
        return None
    with open(path, "rb") as file:
        try:
            counted, second = find(file)
        except (struct.error, ValueError, OverflowError, OSError):
            return None
    if len(counted) < 2 or not (np.diff(counted.astype(np.int64)) > 0).all():
        return None
    if np.median(np.diff(counted.astype(np.int64))) > LONGEST_STEP * second:
        return None
    return [Fraction(int(value) - int(counted[0]), second) for value in counted]


def rate_of(stamps: list[Fraction] | None) -> Fraction | None:
    """Pictures a second by the usual step between stamps; None without any."""
    if not stamps:
        return None
    usual = float(np.median(np.diff([float(stamp) for stamp in stamps])))
    return exact_rate(Fraction(1 / usual).limit_denominator(10_000))


def _of_cine(file: BinaryIO) -> tuple[np.ndarray, int]:
    """Counts of 1/2**32 s; the two lowest bits are flags of events and synchronisation."""
    head = file.read(44)
    count, _, setup, offsets = struct.unpack_from("<4I", head, 20)
    file.seek(setup + 140)
    mark, length = struct.unpack("<2sH", file.read(4))
    if mark != b"ST" or count > _MOST:
        raise ValueError("no setup block")
    place = setup + length
    while place + 8 <= offsets:
        file.seek(place)
        size, tag = struct.unpack("<IH", file.read(6))
        if size < 8 or size > _LONGEST + 8 * count:
            break
        if tag == _TIMES and size >= 8 + 8 * count:
            file.seek(place + 8)
            halves = np.frombuffer(file.read(8 * count), "<u4").reshape(-1, 2).astype(np.int64)
            since = halves[:, 1] - halves[0, 1]  # whole seconds, so that the counts fit
            return since * (1 << 32) + (halves[:, 0] & ~3), 1 << 32
        place += size
    raise ValueError("no times")


def _of_ser(file: BinaryIO) -> tuple[np.ndarray, int]:
    """Counts of 100 ns since the year 1."""
    head = file.read(178)
    colour, _, width, height, bits, count = struct.unpack_from("<6i", head, 18)
    planes = 3 if colour >= 100 else 1
    place = 178 + count * width * height * planes * (2 if bits > 8 else 1)
    if min(width, height, bits, count) <= 0 or count > _MOST:
        raise ValueError("no pictures")
    file.seek(place)
    data = file.read(8 * count)
    if len(data) < 8 * count:
        raise ValueError("no trailer")
    return np.frombuffer(data, "<u8").astype(np.int64), 10_000_000
