"""Packets of a recording from key frame to key frame, and which of them are looked at again, beside which others."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import av

from vidtrack.video.coded.kept_packets import KeptPacket


class Coded(NamedTuple):
    """A packet, and its time stamp; None for a packet that is too far from its key frame to be looked at."""

    packet: KeptPacket | None
    pts: int

    @property
    def data(self) -> bytes:
        """The packet's bytes, where there is one."""
        return b"" if self.packet is None else bytes(self.packet)


class Look(NamedTuple):
    """A look at packet i of a group.

    control  packets from their key frame on, of which the last ones that are long enough are taken
    after    the group behind
    """

    group: list[Coded]
    i: int
    control: list[Coded]
    after: list[Coded]

    @property
    def coded(self) -> Coded:
        return self.group[self.i]


def groups_of(
    container: Any, stream: int, far: int, room: int, keep: Callable[[Any], KeptPacket] = KeptPacket
) -> Iterator[list[Coded]]:
    """Packets of a stream from key frame to key frame, in the order of coding.

    far, room  packets of a group, and bytes of them, that are kept: the others are too far from their key frame
    keep       makes of a packet one that is kept; otherwise each is held
    """
    group, left = list[Coded](), room
    try:
        for packet in container.demux(container.streams[stream]):
            if not packet.size or packet.pts is None:
                continue
            if packet.is_keyframe and group:
                yield group
                group, left = [], room
            left -= packet.size
            group.append(Coded(keep(packet) if left > 0 and len(group) < far else None, packet.pts))
    except (av.error.FFmpegError, IndexError):
        pass  # what is behind was not read the first time either, or is flagged
    if group:
        yield group


def looks_at(groups: list[list[Coded]], looked: range, suspects: Sequence[int]) -> Iterator[Look]:
    """The looks at those of the groups that are looked at, where pictures of `suspects` changed suddenly, in order."""
    places = {one.pts: (g, j) for g in looked for j, one in enumerate(groups[g])}
    for g, j in (places[pts] for pts in suspects if pts in places):
        group, before, after = groups[g], groups[g - 1] if g else [], groups[g + 1] if g + 1 < len(groups) else []
        if before and group[j].pts <= group[0].pts:  # here what was damaged up to now comes back
            yield Look(before, 0, group[:1], group)
        for i in _behind(group, j):
            begin = before[:1] if group[i].pts < group[0].pts else []  # it is shown where that is decoded too
            control = group[:i] or before[:1] or after[:1] or group[:2]
            yield Look(begin + group, len(begin) + i, control, after)


def size_of(group: list[Coded]) -> int:
    return sum(one.packet.size for one in group if one.packet is not None)


def _behind(group: list[Coded], j: int) -> list[int]:
    """The packets of which damage may first show in picture j: it, those before it that are shown later, the key."""
    return [i for i in range(j + 1) if i == 0 or group[i].pts >= group[j].pts]
