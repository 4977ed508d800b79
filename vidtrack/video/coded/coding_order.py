"""Where pictures stand in the order of coding, by the packets that were sent to the decoder."""

from __future__ import annotations

from typing import Any

from vidtrack.timing.frame import Coded
from vidtrack.video.coded.bitstream import Bitstream

_B = 3
"""AV_PICTURE_TYPE_B."""

WAITING = 1000
"""Packets whose pictures have not come, at most: of some, none comes."""


class CodingOrder:
    """Notes packets, and gives each picture what is known of its own.

    bitstream  finds whether pictures are built on a packet's
    alone      every picture of this codec is coded by itself: nothing is noted
    """

    def __init__(self, bitstream: Bitstream, *, alone: bool) -> None:
        self._bitstream, self._off = bitstream, alone
        self._number, self._group = -1, -1
        self._waiting: dict[int, Coded] = {}

    def sent(self, packet: Any) -> None:
        """A packet goes to the decoder."""
        if self._off:
            return
        self._number += 1
        self._group += bool(packet.is_keyframe)
        if packet.pts is None:
            return
        reference = self._bitstream.is_reference(packet)
        alone = reference is False
        self._waiting[packet.pts] = Coded(self._number, self._group, bool(packet.is_keyframe), alone)
        if len(self._waiting) > WAITING:
            for pts in list(self._waiting)[: WAITING // 2]:
                self._waiting.pop(pts, None)

    def waiting(self) -> list[int]:
        """Time stamps of the packets whose pictures have not come."""
        return list(self._waiting)

    def of(self, picture: Any) -> Coded | None:
        """What is known of a decoded picture's packet; of each it is given once."""
        coded = self._waiting.pop(picture.pts, None)
        if coded is not None and self._bitstream.b_is_no_reference:
            return coded._replace(alone=picture.pict_type == _B)
        return coded


class LongWaits:
    """Packets of MPEG-PS whose pictures wait longer than any before, from their decoding until they are shown.

    Where a packet bears no stamp, libavformat shows a reference when the next one is decoded: where that is lost, at
    the one behind it, with a stamp that is not its own.
    `odd`: their time stamps; container: libavformat's name of it
    """

    def __init__(self, container: str) -> None:
        self._off, self._longest, self._n = container != "mpeg", 0, 0
        self.odd = set[int]()

    def sent(self, packet: Any) -> None:
        """A packet goes to the decoder."""
        if self._off or packet.pts is None or packet.dts is None:
            return
        wait = packet.pts - packet.dts
        self._n += 1
        if wait > self._longest and self._n > _USUAL:
            self.odd.add(packet.pts)
        self._longest = max(self._longest, wait)


_USUAL = 6
"""Packets that show how long pictures wait."""
