"""Where in packets the units lie that hold pictures, and the same packets with another end of such a unit."""

from __future__ import annotations

import numpy as np

from vidtrack.video.coded.bitstream import Bitstream, unit_places

SHORTEST = 16
"""Bytes of a unit that holds a picture: shorter ones show another once more."""


class CodedUnits:
    """The units of one stream.

    codec      libavcodec's name of it
    extradata  of the stream
    """

    def __init__(self, codec: str, extradata: bytes | None) -> None:
        self._codec = codec
        self.bitstream = Bitstream(codec, extradata)

    def places(self, data: bytes, *, any_type: bool = False) -> list[tuple[int, int]]:
        """Where units of a packet that hold pictures begin and end, without what an encoder puts behind them.

        any_type  of MPEG-4, also pictures that are built on others
        """
        if self._codec in ("h264", "hevc"):
            return [
                (begin, begin + len(_without_stuffing(data[begin:end])))
                for begin, end in self.bitstream.places(data)
                if self._holds_picture(data[begin])
            ]
        if self._codec == "mpeg4":
            return _alone_in_mpeg4(data, any_type=any_type)
        return [_last_of_superframe(data)] if self._codec == "vp9" else unit_places(data)

    def _holds_picture(self, head: int) -> bool:
        return 1 <= head & 31 <= 5 if self._codec == "h264" else head >> 1 & 63 < 32

    def with_tail(self, data: bytes, place: tuple[int, int], length: int, seed: int) -> bytes:
        """The packet with other bytes at the end of a unit."""
        return data[: place[1] - length] + _noise(length, seed) + data[place[1] :]

    def longer(self, data: bytes, places: list[tuple[int, int]], more: int, seed: int) -> bytes | None:
        """The packet with so many bytes behind each of these units, which count as longer, and which no whole picture
        needs; None where that cannot be written, as of H.264, whose last macroblock may be the one before the last bit.
        """
        for place in reversed(places):
            longer = self._longer(data, place, self._unread(more, seed))
            if longer is None:
                return None
            data = longer
        return data

    def _unread(self, n: int, seed: int) -> bytes:
        """Of VP9 and AV1 it begins with zeros: they are what is read behind the end, and an encoder may leave them out
        (AV1 specification, section 8.2.2)."""
        return _noise(n, seed) if self._codec == "hevc" else bytes(_ZEROS) + _noise(n, seed)

    def _longer(self, data: bytes, place: tuple[int, int], fresh: bytes) -> bytes | None:
        begin, end = place
        whole, more = data[:end] + fresh + data[end:], len(fresh)
        if self._codec == "hevc":
            size = self.bitstream.length
            return whole[: begin - size] + (end - begin + more).to_bytes(size) + whole[begin:] if size else whole
        if self._codec == "vp9":
            return _with_longer_superframe(whole, len(data) - end, more)
        return None if self._codec in ("h264", "mpeg4") else _with_longer_obu(data, place, fresh)


_ZEROS = 3
"""Bytes behind the end that a decoder's window may reach into."""


def _noise(length: int, seed: int) -> bytes:
    """Bytes that begin no start code, of which the last is none of VP9's markers."""
    return np.random.default_rng(seed).integers(4, 192, length, dtype=np.uint8).tobytes()


def _without_stuffing(unit: bytes) -> bytes:
    """A unit without the zeros that an encoder may put behind it."""
    while unit.endswith((b"\0", b"\0\0\3")):
        unit = unit[: -3 if unit.endswith(b"\0\0\3") else -1]
    return unit


def _alone_in_mpeg4(data: bytes, *, any_type: bool) -> list[tuple[int, int]]:
    """Where the picture of an MPEG-4 packet lies, if it is one alone, and built on no other.

    Where B pictures are held back or packed with others, a packet's time stamp is not that of its picture.
    any_type  whether it may be built on others
    """
    begin = data.find(_VOP)
    if begin < 0 or data.count(_VOP) > 1 or len(data) < begin + 5 or (data[begin + 4] >> 6 and not any_type):
        return []
    return [(begin, len(data.rstrip(b"\0")))]


_VOP = b"\0\0\1\xb6"
"""Before each picture of MPEG-4 part 2 (ISO/IEC 14496-2, 6.2.1); the two bits behind it are 0 in key frames."""


def _last_of_superframe(data: bytes) -> tuple[int, int]:
    """Where the last frame of a VP9 packet, the one that is shown, lies: before an index of sizes, if there is one."""
    last = data[-1]
    if last & 0xE0 == 0xC0:
        frames, width = (last & 7) + 1, (last >> 3 & 3) + 1
        size = 2 + frames * width
        if len(data) > size and data[-size] == last:
            index = data[1 - size : -1]
            sizes = [int.from_bytes(index[at : at + width], "little") for at in range(0, len(index), width)]
            return sum(sizes[:-1]), min(sum(sizes), len(data) - size)
    return 0, len(data)


def _with_longer_superframe(whole: bytes, index: int, more: int) -> bytes | None:
    """A packet of VP9 whose last frame has become longer, with its size in the index, the last `index` bytes, put
    right (VP9 specification, annex B)."""
    if not index:
        return whole
    width = (whole[-1] >> 3 & 3) + 1
    size = int.from_bytes(whole[-1 - width : -1], "little") + more
    return whole[: -1 - width] + size.to_bytes(width, "little") + whole[-1:] if size < 256**width else None


def _with_longer_obu(data: bytes, place: tuple[int, int], fresh: bytes) -> bytes | None:
    """A packet of AV1 whose last unit has become longer: its size, in groups of seven bits, is written anew."""
    begin, end = place
    first = begin - 1
    while first > 0 and data[first - 1] & 128:  # the bytes of a size but for its last one
        first -= 1
    size, written = end - begin + len(fresh), bytearray()
    while size >= 128:
        written.append(size & 127 | 128)
        size >>= 7
    written.append(size)
    old = data[first:begin]
    if sum((byte & 127) << 7 * k for k, byte in enumerate(old)) != end - begin:
        return None  # a unit that bears no size, or a header before it that looks like a byte of it
    return data[:first] + bytes(written) + data[begin:end] + fresh + data[end:]
