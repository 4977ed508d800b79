"""What a coded picture says of itself before it is decoded: whether others are built on it, and damage that shows.

Decoders take almost any bytes for a picture: zeros in an H.264 stream, where a copy has a hole, give a picture without
a word. So the rules that no encoder breaks are checked, those that cost little: no three zeros within a unit of H.264
or HEVC, whole units in a packet, the numbers that DV writes before every 80 bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

_DV_BLOCK, _DV_SEQUENCE = 80, 150
"""Bytes of a DIF block, and blocks of a DIF sequence (IEC 61834-2, SMPTE ST 314)."""


class Bitstream:
    """The packets of one stream.

    codec      libavcodec's name of it
    extradata  of the stream; says whether units have their length before them (MP4, MKV) or start codes
    """

    def __init__(self, codec: str, extradata: bytes | None) -> None:
        self._codec = codec
        self.b_is_no_reference = codec.startswith(("mpeg", "vc1", "wmv3"))
        """Whether no picture is built on those of type B."""
        place = {"h264": 4, "hevc": 21}.get(codec)  # of the low bits that say how long the lengths are
        counted = place is not None and extradata is not None and len(extradata) > place and extradata[0] == 1
        self._key = b"\x65" if codec == "h264" else b"\x26"  # how a unit of a key frame begins
        self.length = (extradata[place] & 3) + 1 if counted and extradata and place else 0
        """Bytes of the length before each unit of H.264 or HEVC; 0 where start codes part them."""
        self.fault = {"dvvideo": _dv_fault}.get(codec) or (self._unit_fault if self.length else None)
        """From a packet to what is wrong in it ("" where nothing is); None where nothing can be checked."""

    def is_reference(self, packet: Any) -> bool | None:
        """Whether other pictures may be built on this one; None where only the type of the decoded picture decides.

        A packet whose units do not fit into it counts as one of these: True.
        """
        if self._codec in ("h264", "hevc"):
            kinds = [unit[0] for unit in self._units(bytes(packet)) if unit]
            if self._codec == "h264":
                shown = [kind for kind in kinds if 1 <= kind & 31 <= 5]
                return not shown or any(kind & 0x60 for kind in shown)  # nal_ref_idc
            types = [kind >> 1 & 63 for kind in kinds]
            return not any(kind < 32 for kind in types) or any(kind < 32 and (kind > 14 or kind % 2) for kind in types)
        return None if self.b_is_no_reference else True

    def _units(self, data: bytes) -> Iterator[bytes]:
        """The beginnings of a packet's units."""
        if self.length:
            at = 0
            while at + self.length < len(data):
                size = int.from_bytes(data[at : at + self.length])
                at += self.length
                yield data[at : at + 2] if at + size <= len(data) else self._key
                at += size
            return
        for part in data.split(b"\0\0\1")[1:]:
            yield part[:2]

    def places(self, data: bytes) -> list[tuple[int, int]]:
        """Where the units of a packet of H.264 or HEVC begin and end; those that do not fit into it are left out."""
        out, at = list[tuple[int, int]](), 0
        while self.length and at + self.length < len(data):
            begin = at + self.length
            at = begin + int.from_bytes(data[at:begin])
            if begin < at <= len(data):
                out.append((begin, at))
        at = 0 if self.length else data.find(b"\0\0\1")
        while not self.length and at >= 0:
            begin, at = at + 3, data.find(b"\0\0\1", at + 3)
            if begin < (end := len(data) if at < 0 else at):
                out.append((begin, end))
        return out

    def _unit_fault(self, packet: Any) -> str:
        data, at = bytes(packet), 0
        while at < len(data):
            size = int.from_bytes(data[at : at + self.length])
            at += self.length
            if size == 0 or at + size > len(data):
                return "a unit of the stream does not fit its packet"
            if _NEVER_WRITTEN.search(data, at, at + size):
                return "zeros where no encoder writes any"
            at += size
        return ""


_NEVER_WRITTEN = re.compile(rb"\0\0[\0-\2]")
"""Behind two zeros of a unit encoders of H.264 and HEVC put a 3 (section 7.4.1 of H.264, 7.4.2 of HEVC)."""


def _dv_fault(packet: Any) -> str:
    """Every block begins with its kind, its sequence and its number, in a fixed order."""
    data = memoryview(packet)
    n = len(data) // _DV_BLOCK
    if len(data) % _DV_BLOCK or n % _DV_SEQUENCE:
        return ""  # of another size than one of DV's, such as DVCPRO HD
    heads = np.ndarray(n, "<u4", data, strides=(_DV_BLOCK,))
    seen, expected = _dv_heads(n // _DV_SEQUENCE)
    return "" if ((heads & seen) == expected).all() else "blocks of a DV frame that are not in their places"


@lru_cache(maxsize=4)
def _dv_heads(sequences: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Which bits of the first four bytes of each block of a frame are known, and what they are."""
    seen, expected = np.zeros((2, sequences, _DV_SEQUENCE), np.uint32)
    seen[:, _DV_SEEN] = 0xFFF0E0  # the low bits of the first two bytes are not
    number = np.arange(sequences, dtype=np.uint32)[:, None] % _sequences(sequences)
    expected[:, _DV_SEEN] = _DV_KIND.astype(np.uint32) << 5 | number << 12 | _DV_NUMBER.astype(np.uint32) << 16
    return seen.ravel(), expected.ravel()


def _sequences(n: int) -> int:
    """Sequences of a channel: 10 at 525 lines, 12 at 625; DVCPRO 50 has two channels."""
    return 12 if n % 12 == 0 else 10


_DV_SEEN = np.array([0, *(7 + 16 * sound + k for sound in range(9) for k in range(15))])
"""Blocks of a sequence that its pictures need: its header, and the 15 behind each of the 9 blocks of sound."""

_DV_KIND = np.array([0, *([4] * 135)], np.uint8)
_DV_NUMBER = np.array([0, *range(135)], np.uint8)


def unit_places(data: bytes) -> list[tuple[int, int]]:
    """Where the last unit of an AV1 packet begins and ends, if it holds a picture; else nothing.

    Only units that bear their size are followed (AV1 specification, section 5.3): those in files do.
    """
    at, last, kind = 0, (0, 0), 0
    while at < len(data):
        kind, extended, sized = data[at] >> 3 & 15, data[at] >> 2 & 1, data[at] >> 1 & 1
        at += 1 + extended
        size = len(data) - at
        if sized:
            size = shift = 0
            while at < len(data):
                byte, at = data[at], at + 1
                size |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
        last = at, min(at + size, len(data))
        at += size
    return [last] if kind in _AV1_PICTURES else []


_AV1_PICTURES = (4, 6)
"""Units of AV1 that hold tiles: a group of tiles, and a frame with its header."""
