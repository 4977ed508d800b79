"""Which decoded pictures may be damaged.

A decoder hides most damage: it fills in from the picture before and says so, at best, in its log. So three things
are followed: packets that it refuses, errors that it logs (they belong to the packet in hand, or with several threads
to one of the last few), and packets whose own structure is broken. Whatever may be built on a damaged picture is
suspect too, up to the next key frame in the order of coding, and behind that frame what is shown before it; unless the
stream says that no picture is built on the damaged one.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from vidtrack.video.coded.bitstream import Bitstream

_B = 3
"""AV_PICTURE_TYPE_B: in codecs called MPEG and in VC-1, of pictures that no others are built on."""


class DamageWatch:
    """Follows damage from packets to pictures, at a cost that hides behind the decoder.

    bitstream          finds whether pictures are built on a packet's
    packets_in_flight  how many packets the decoder may be at work on at once
    groups             key frames that damage may reach over: 2 where a container (MPEG-PS, TS) gives few packets a time
                       stamp of their own, so that a lost one moves those behind it in time; else 1
    """

    def __init__(self, bitstream: Bitstream, packets_in_flight: int, groups: int = 1) -> None:
        self._bitstream = bitstream
        self._in_flight: deque[Any] = deque(maxlen=packets_in_flight)
        self._damaged: deque[list[int]] = deque([[]], maxlen=groups + 1)  # by group, what others may be built on
        self._groups = groups
        self._key: int | None = None
        self._suspects: dict[int, tuple[int, ...]] = {}  # time stamp -> those of the damage that it may come from
        self._harmless: set[int] = set()
        self._spreads_over = (
            0  # so many key frames as they are shown: damage without a time stamp, or in no packet seen
        )
        self.said = ""
        """What the decoder said first."""
        self.refused = 0
        """Packets that it refused."""

    def sent(self, packet: Any) -> None:
        """A packet goes to the decoder."""
        self._in_flight.append(packet)
        pts = packet.pts
        if packet.is_keyframe:
            self._damaged.append([])
            self._key = pts
        leads = self._key is not None and pts is not None and pts < self._key
        groups = list(self._damaged)[-(self._groups + leads) :]
        if any(groups) and pts is not None:
            self._suspects[pts] = tuple(origin for group in groups for origin in group)

    def complained(self, why: str, *, refused: bool = False, alone: bool = False) -> None:
        """The decoder logged an error while it worked on the packets in flight, or refused the last one altogether.

        alone  whether it is known to be the last one, by what is broken in it
        """
        self.said = self.said or why.strip()
        self.refused += refused
        for packet in list(self._in_flight)[-1:] if alone else self._in_flight:
            pts = packet.pts
            if pts is None:
                self._spreads_over = 2  # the next one may have been in flight already
                continue
            self._suspects[pts] = (*self._suspects.get(pts, ()), pts)
            if refused or self._groups > 1 or self._bitstream.is_reference(packet) is not False:
                self._damaged[-1].append(pts)

    def may_be_damaged(self, picture: Any) -> bool:
        """Whether a decoded picture is damaged, or may be built on one that is."""
        corrupt = bool(picture.is_corrupt)
        if not (corrupt or self._suspects or self._spreads_over):
            return False
        pts = picture.pts
        origins = self._suspects.pop(pts, ())
        built_on = self._groups > 1 or picture.pict_type != _B or not self._bitstream.b_is_no_reference
        if pts in origins and not built_on:
            self._harmless.add(pts)
            for group in self._damaged:
                group[:] = [origin for origin in group if origin != pts]
        if picture.key_frame and not corrupt:
            self._spreads_over = max(0, self._spreads_over - 1)
        found = corrupt or self._spreads_over or any(at == pts or at not in self._harmless for at in origins)
        if corrupt and built_on and pts not in origins:
            self._spreads_over = max(1, self._spreads_over)
        return bool(found)
