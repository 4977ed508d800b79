"""Whether coded pictures that look suspicious are damaged, by decoding them again with their last bytes changed.

Decoders of H.264, HEVC, VP9 and AV1 read on behind a damaged byte as if nothing had happened, and are content when the
picture is full. But garbage does not end where the data end: a damaged picture is full before its last bytes are read,
so that they do not matter, whereas in a whole one they do. So a few other endings are tried: if each of them gives the
very same picture, these bytes were never read and the picture is damaged.

What is looked at again costs a decoding from its key frame on, so the caller names few pictures, and there is a limit.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import av
import numpy as np
from av.logging import get_last_error

from vidtrack.video.bitstream import Bitstream, unit_places
from vidtrack.video.container import open_container
from vidtrack.video.luma import bits_of

TESTED = ("h264", "hevc", "vp9", "av1", "libdav1d", "mpeg4")
"""Codecs whose units are read serially to their last bytes."""


@dataclass(frozen=True)
class Limits:
    """How it is looked.

    tail      bytes at the end of a unit that are replaced: three times as many as did not matter in any whole picture
    block     so many times the bytes of a macroblock more: of the last one most may lie below the picture
    tries     other endings that are tried
    other     of them, such as may give another picture of a damaged one: garbage may use memory that nothing was
              written to; and such as may give the same of the whole one beside it
    shown     of the last macroblock, share from which on what is cut off of it does not count: else it has most of the
              last bytes
    shortest  bytes of a unit that is tested: of shorter ones the tail is the header
    vp9       bytes of VP9's units, at least, and of their tails more: its last 4 are padding
    units     of a picture that are tested, at most
    far, room pictures and bytes from a key frame on in which it is looked
    """

    tail: int = 24
    block: float = 0.5
    tries: int = 6
    other: int = 1
    shown: float = 0.5
    shortest: int = 72
    vp9: tuple[int, int] = (256, 4)
    units: int = 8
    far: int = 300
    room: int = 64_000_000


LIMITS = Limits()


class _Coded(NamedTuple):
    """A packet, and its time stamp; None for a packet that is too far from its key frame to be looked at."""

    packet: Any
    pts: int


class SecondLook:
    """Looks at some pictures of a recording again.

    path    its file
    stream  number of the stream in the file
    most    pictures that are decoded for those that turn out to be in order; the look that takes it beyond is the last
    """

    def __init__(self, path: str, stream: int, most: int) -> None:
        self._path, self._stream, self._left = path, stream, most
        self._name, self._spoilt = "", False  # _spoilt: what the next group's leading pictures are built on
        self._share = 0.0  # of a picture that is a macroblock
        self._shown = 1.0  # of the last macroblock
        self._extradata: bytes | None = None
        self._bitstream = Bitstream("", None)

    def damaged(self, suspects: Collection[int]) -> set[int]:
        """Time stamps of pictures that are damaged or built on such, where those of `suspects` changed suddenly."""
        found: set[int] = set()
        before: list[_Coded] = []
        container = open_container(self._path)
        try:
            codec = container.streams[self._stream].codec_context
            self._name, self._extradata = codec.name, codec.extradata
            if self._name not in TESTED:
                return set()
            self._bitstream = Bitstream(self._name, self._extradata)
            self._share = 256 / max(codec.width * codec.height, 256)
            self._shown = (-codec.width % 16 - 16) * (-codec.height % 16 - 16) / 256
            wanted, latest = set(suspects), max(suspects, default=-1)
            for group in self._groups(container):
                found |= self._of_group(group, before, wanted)
                if (self._left <= 0 or group[0].pts > latest) and not self._spoilt:
                    break
                before = group
        finally:
            container.close()
        return found

    def _groups(self, container: Any) -> Iterator[list[_Coded]]:
        """Packets from key frame to key frame, in the order of coding."""
        group, room = list[_Coded](), LIMITS.room
        try:
            for packet in container.demux(container.streams[self._stream]):
                if not packet.size or packet.pts is None:
                    continue
                if packet.is_keyframe and group:
                    yield group
                    group, room = [], LIMITS.room
                room -= packet.size
                group.append(_Coded(packet if room > 0 and len(group) < LIMITS.far else None, packet.pts))
        except (av.error.FFmpegError, IndexError):
            pass  # what is behind was not read the first time either, or is flagged
        if group:
            yield group

    def _of_group(self, group: list[_Coded], before: list[_Coded], wanted: set[int]) -> set[int]:
        leading = {one.pts for one in group if one.pts < group[0].pts}
        found = leading if self._spoilt else set[int]()
        self._spoilt = False
        begins = wanted & {group[0].pts, *leading}  # here what was damaged up to now comes back
        if begins and before and before[0].pts not in wanted and self._ends_early(before, 0, group[:1]):
            found |= {one.pts for one in before} | leading
        at = sorted({i for j, one in enumerate(group) if one.pts in wanted for i in _behind(group, j)})
        for i in at:
            if group[i].pts not in found and self._ends_early(group, i, group[:i] or before[:1] or group[:2]):
                reference = self._bitstream.is_reference(group[i].packet) is not False
                found |= {one.pts for one in group[i:]} if reference else {group[i].pts}
                self._spoilt |= reference
        return found

    def _ends_early(self, group: list[_Coded], i: int, control: list[_Coded]) -> bool:
        """Whether the last bytes of packet i of the group do not matter, but those of the last of `control` do.

        control  packets from their key frame on, of which the last one that is long enough is taken
        """
        left = self._left
        if left <= 0 or not any(self._unread(group, i, end) for end in self._ends(group[i])):
            return False
        for j in reversed(range(len(control))):
            if ends := self._ends(control[j], beside=True):
                others = self._others(control[: j + 1], ends[-1], LIMITS.tries)
                if others is None or others < LIMITS.tries - LIMITS.other:
                    return False
                self._left = left  # damage is looked for as long as there is any
                return True
        return False

    def _unread(self, group: list[_Coded], i: int, place: tuple[int, int]) -> bool:
        """Whether the end of a unit of packet i does not matter.

        How H.264 and HEVC are read does not depend on the pictures before: with the key frame alone the same bytes are
        read, at little cost.
        """
        if i > 1 and self._name in ("h264", "hevc"):
            others = self._others([group[0], group[i]], place, LIMITS.other)
            if others is not None and others > LIMITS.other:
                return False
        others = self._others(group[: i + 1], place, LIMITS.other)
        return others is not None and others <= LIMITS.other

    def _ends(self, one: _Coded, *, beside: bool = False) -> list[tuple[int, int]]:
        """Where units of a packet that hold pictures begin and end; beside: of one that others are compared with."""
        if one.packet is None:
            return []
        data = bytes(one.packet)
        if self._name in ("h264", "hevc"):
            places = []
            for begin, end in self._bitstream.places(data):
                kind = data[begin] & 31 if self._name == "h264" else data[begin] >> 1 & 63
                if (1 <= kind <= 5) if self._name == "h264" else kind < 32:
                    places.append((begin, begin + len(_without_stuffing(data[begin:end]))))
        elif self._name == "mpeg4":
            places = _alone_in_mpeg4(data, any_type=beside)
        elif self._name == "vp9":
            places = [_last_of_superframe(data)]
        else:
            places = unit_places(data)
        shortest = LIMITS.vp9[0] if self._name == "vp9" else LIMITS.shortest
        return [place for place in places if place[1] - place[0] >= shortest][-LIMITS.units :]

    def _others(self, group: list[_Coded], place: tuple[int, int], enough: int) -> int | None:
        """How many other endings of one of its units, up to one more than `enough`, make another picture of a group's
        last; None where that is not shown."""
        data, (begin, end) = bytes(group[-1].packet), place
        own, others = self._decoded(group, data), 0
        if own is None:
            return None
        length = LIMITS.tail + round(LIMITS.block * len(data) * self._share)
        length = min(length + (LIMITS.vp9[1] if self._name == "vp9" else 0), (end - begin) // 3)
        for seed in range(LIMITS.tries):
            tail = np.random.default_rng(seed).integers(4, 256, length, dtype=np.uint8).tobytes()
            others += self._decoded(group, data[: end - length] + tail + data[end:]) != own
            if others > enough:
                break
        return others

    def _decoded(self, group: list[_Coded], data: bytes) -> tuple[int, bytes] | None:
        """The levels of the last picture of a group, coded as `data`, and how many errors were logged; None where there
        is none."""
        self._left -= len(group)
        codec = av.CodecContext.create(self._name, "r")
        codec.extradata, codec.thread_count = self._extradata, 1
        codec.options = {"apply_cropping": str(int(self._shown >= LIMITS.shown))}
        last = av.Packet(data)
        last.pts = group[-1].pts
        before, _ = get_last_error()
        levels = None
        for packet in [*(one.packet for one in group[:-1]), last, None]:
            try:
                for picture in codec.decode(packet):
                    if picture.pts == last.pts:
                        deep = bits_of(picture.format) > 8
                        levels = b"".join(_levels(plane, deep) for plane in picture.planes)
            except (av.error.FFmpegError, EOFError):
                continue
        errors, _ = get_last_error()
        return None if levels is None else (errors - before, levels)


def _behind(group: list[_Coded], j: int) -> list[int]:
    """The packets of which damage may first show in picture j: it, those before it that are shown later, the key."""
    return [i for i in range(j + 1) if i == 0 or group[i].pts >= group[j].pts]


def _levels(plane: Any, deep: bool) -> bytes:
    rows = np.frombuffer(plane, np.uint8)[: plane.height * plane.line_size].reshape(plane.height, plane.line_size)
    return rows[:, : min((1 + deep) * plane.width, plane.line_size)].tobytes()


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
