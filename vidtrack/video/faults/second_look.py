"""Whether coded pictures that look suspicious are damaged, by decoding them again with another end of their data.

Decoders of H.264, HEVC, VP9 and AV1 read on behind a damaged byte as if nothing had happened, and are content when the
picture is full. But garbage does not end where the data end. What is read as garbage is full before its last bytes are
read, so that they do not matter, whereas in a whole picture they do; or it needs more than there are, and then bytes
that are put behind them matter, which a whole picture never reads. So other endings are tried. Of H.264 the end itself
can be seen: in a picture that is taller than its data, a whole slice still ends where it ended (`taller`).

What is looked at again costs a decoding from its key frame on, so the caller names few pictures, and there is a limit.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

import av
import numpy as np
from av.logging import get_last_error

from vidtrack.video.coded.coded_groups import Coded, Look, groups_of, looks_at, size_of
from vidtrack.video.coded.coded_units import SHORTEST, CodedUnits
from vidtrack.video.coded.kept_packets import KeptPackets
from vidtrack.video.coded.taller import taller_headers, taller_packet
from vidtrack.video.container import open_container
from vidtrack.video.luma import bits_of
from vidtrack.video.processes.looks_beside import LooksBeside

TESTED = ("h264", "hevc", "vp9", "av1", "libdav1d", "mpeg4")
"""Codecs whose units are read serially to their last bytes."""


@dataclass(frozen=True)
class Limits:
    """How it is looked.

    tail      bytes at the end of a unit that are replaced: three times as many as did not matter in any whole picture
    boolean   the same of VP9 and AV1: four times
    block     so many times the bytes of the smallest block more: of the last one most may lie below the picture
    tries     other endings that are tried
    other     of them, such as may give another picture of a damaged one: garbage may use memory that nothing was
              written to; and such as may give the same of the whole one beside it
    shown     of the last macroblock, share from which on what is cut off of it does not count: else it has most of the
              last bytes
    shortest  bytes of a unit whose tail is replaced: of shorter ones the tail is the header
    vp9       bytes of VP9's units, at least
    end       bytes that hold the end of a slice of H.264
    more      bytes that are put behind a unit; longer: how often others
    beside    pictures with which one is compared, at most
    units     of a picture that are tested, at most
    far, room pictures and bytes from a key frame on in which it is looked
    held      bytes of groups of which the most doubtful picture is looked at first, as soon as there are more than two
    """

    tail: int = 24
    boolean: int = 16
    block: float = 0.5
    tries: int = 6
    other: int = 1
    shown: float = 0.5
    shortest: int = 72
    vp9: int = 256
    end: int = 4
    more: int = 6
    longer: int = 1
    beside: int = 3
    units: int = 8
    far: int = 300
    room: int = 64_000_000
    held: int = 128_000_000


LIMITS = Limits()


class _Decoded(NamedTuple):
    """A picture: how many errors were logged of it; whether the decoder filled in what is missing; its levels."""

    errors: int
    filled_in: bool
    levels: bytes


class SecondLook:
    """Looks at some pictures of a recording again.

    path     its file
    stream   number of the stream in the file
    most     pictures that are decoded for those that turn out to be in order; the look that takes it beyond is the last
    flagged  time stamps of pictures that the decoder found damaged: it may have given some built on them before
    """

    def __init__(self, path: str, stream: int, most: int, flagged: Collection[int] = ()) -> None:
        self._path, self._stream, self._left, self._flagged = path, stream, most, frozenset(flagged)
        self._name, self._whole = "", set[int]()  # _whole: pictures that were looked at, and are in order
        self._share = 0.0  # of a picture that is the smallest block
        self._shown = 1.0  # of the last macroblock
        self._extradata: bytes | None = None
        self._taller: bytes | None = None  # the same of pictures that are taller
        self._units = CodedUnits("", None)

    def damaged(self, suspects: Sequence[int]) -> set[int]:
        """Time stamps of pictures that are damaged or built on such, where those of `suspects` changed suddenly.

        suspects  the most doubtful one first: as long as pictures may be decoded, they are looked at in this order
        """
        found: set[int] = set()
        container = open_container(self._path)
        try:
            codec = container.streams[self._stream].codec_context
            self._name, self._extradata = codec.name, codec.extradata
            if self._name not in TESTED:
                return set()
            self._units = CodedUnits(self._name, self._extradata)
            self._taller = taller_headers(self._extradata) if self._name == "h264" else None
            block = 256 if self._name in ("h264", "mpeg4") else 64  # px that are coded at once, though none is shown
            self._share = block / max(codec.width * codec.height, block)
            self._shown = (-codec.width % 16 - 16) * (-codec.height % 16 - 16) / 256
            for groups, looked in self._batches(container, set(suspects)):
                self._look_at(groups, looked, suspects, found)
                if self._left <= 0:
                    break
        finally:
            container.close()
        return found

    def _batches(self, container: Any, wanted: set[int]) -> Iterator[tuple[list[list[Coded]], range]]:
        """As many groups as are looked at at once, and which of them are: the others were, or come again.

        Of groups that are not beside one with a picture that is wanted the packets are not kept; of the others only the
        last two are in memory, where they cannot be read again from where they lie.
        """
        kept = KeptPackets(self._path)
        batch, held, begin, latest = list[list[Coded]](), 0, 0, max(wanted, default=-1)
        for group in groups_of(container, self._stream, LIMITS.far, LIMITS.room, kept.keep):
            batch.append(group)
            held += size_of(group)
            if len(batch) > 1 and not any(one.pts in wanted for near in batch[-3:] for one in near):
                held -= size_of(batch[-2])
                batch[-2] = [one._replace(packet=None) for one in batch[-2]]
            elif len(batch) > 1:
                kept.put_aside(one.packet for one in batch[-2] if one.packet is not None)
            if len(batch) > 2 and group[0].pts > latest and batch[-2][0].pts > latest:
                break
            if held > LIMITS.held and len(batch) > 2:
                yield batch, range(begin, len(batch) - 1)
                batch, begin = batch[-2:], 1
                held = sum(map(size_of, batch))
        yield batch, range(begin, len(batch))

    def _look_at(self, groups: list[list[Coded]], looked: range, suspects: Sequence[int], found: set[int]) -> None:
        """Add what is found damaged in those of the groups that are looked at, half of it by another process."""
        looks = list(looks_at(groups, looked, suspects))
        first = {look.coded.pts: look for look in reversed(looks)}
        row = [pts for pts in dict.fromkeys(look.coded.pts for look in looks) if self._is_asked(first[pts])]
        beside = LooksBeside(row, lambda pts: self._alone_at(first[pts]), self._path)
        try:
            for look in looks:
                self._look(look, found, beside)
                if found:
                    beside.close()  # what it looks at next may be found already
        finally:
            beside.close()

    def _is_asked(self, look: Look) -> bool:
        """Whether only a look at the packet may say whether it is damaged."""
        return look.coded.packet is not None and look.coded.pts not in self._flagged | self._whole

    def _alone_at(self, look: Look) -> tuple[bool, int]:
        """Whether a packet is damaged, and how many pictures are decoded for that if it is not."""
        self._left = most = 1_000_000
        return self._is_damaged(look), most - self._left

    def _look(self, look: Look, found: set[int], beside: LooksBeside[tuple[bool, int]]) -> None:
        """Add a packet, if it is damaged, and what may be built on it."""
        pts, packet, group = look.coded.pts, look.coded.packet, look.group
        if pts in found or pts in self._whole or packet is None:
            return
        alone = self._units.bitstream.is_reference(packet) is False
        if pts in self._flagged:  # what is shown after it is flagged too
            found.update(one.pts for one in group[look.i :] if one.pts < pts and not alone)
        elif not self._found_damaged(look, beside):
            self._whole.add(pts)
        elif alone:
            found.add(pts)
        else:
            found.update(one.pts for one in group[look.i :])
            found.update(one.pts for one in look.after if one.pts < look.after[0].pts)

    def _found_damaged(self, look: Look, beside: LooksBeside[tuple[bool, int]]) -> bool:
        """Whether the packet is damaged, as one of the processes sees it, as long as pictures may be decoded."""
        if self._left <= 0:
            return False
        if (seen := beside.at(look.coded.pts)) is None:
            return self._is_damaged(look)
        damaged, decoded = seen
        self._left -= decoded
        return damaged

    def _is_damaged(self, look: Look) -> bool:
        """Whether the packet ends elsewhere than its data, and those of `control` do not."""
        group, i, control, _ = look
        left = self._left
        shown = self._ends_where_it_should if self._taller else self._needs_no_more
        whole = shown(group, i)
        if whole is False:
            last = {*range(len(control))[-LIMITS.beside :], 0}
            damaged = any(control[j].pts != group[i].pts and shown(control, j) for j in sorted(last, reverse=True))
        else:
            damaged = not (whole and self._taller) and self._ends_early(group, i, control)
        if damaged:
            self._left = left  # damage is looked for as long as there is any
        return damaged

    def _ends_where_it_should(self, group: list[Coded], i: int) -> bool | None:
        """Whether the last slice of H.264 ends with the picture; None where that is not shown."""
        places = self._places(group[i], SHORTEST)
        if not places:
            return None
        data = group[i].data
        for few in (self._read_with(group, i), group[: i + 1]):
            taller = self._decoded(few, data, taller=True)
            if taller is not None and not taller.errors:
                break
            own = self._decoded(few, data)
            if taller and own and not own.errors and not own.filled_in:
                return False
        else:  # what it is built on is not at hand
            return None
        if not taller.filled_in:
            return False
        tails = (self._units.with_tail(data, places[-1], LIMITS.end, seed) for seed in range(LIMITS.tries))
        return any(self._decoded(few, other, taller=True) != taller for other in tails)  # else it ends by chance

    def _needs_no_more(self, group: list[Coded], i: int) -> bool | None:
        """Whether bytes behind the units of packet i do not matter; None where that is not shown."""
        places = self._places(group[i], SHORTEST)
        data = group[i].data if places else b""
        longer = [self._units.longer(data, places, LIMITS.more, seed) for seed in range(LIMITS.longer if places else 0)]
        others = [other for other in longer if other]
        if not others:
            return None
        few = self._read_with(group, i)
        if len(few) <= i and (own := self._decoded(few, data)) and self._all_are(own, few, others):
            return True  # at little cost
        own = self._decoded(group[: i + 1], data)
        if own is None or own.errors or own != self._decoded(group[: i + 1], data):
            return None
        return self._all_are(own, group[: i + 1], others)

    def _all_are(self, own: _Decoded, group: list[Coded], others: list[bytes]) -> bool:
        return all(self._decoded(group, other) == own for other in others)

    def _read_with(self, group: list[Coded], i: int) -> list[Coded]:
        """Packet i of a group, and those before it without which it is read otherwise.

        How H.264 and HEVC are read does not depend on the pictures before, but for the headers of the key frame.
        """
        return [group[0], group[i]] if i and self._name in ("h264", "hevc") else group[: i + 1]

    def _ends_early(self, group: list[Coded], i: int, control: list[Coded]) -> bool:
        """Whether the last bytes of packet i of the group do not matter, but those of the last of `control` do.

        control  packets from their key frame on, of which the last one that is long enough is taken
        """
        shortest = LIMITS.vp9 if self._name == "vp9" else LIMITS.shortest
        if not any(self._unread(group, i, end) for end in self._places(group[i], shortest)):
            return False
        for j in reversed(range(len(control))):
            if ends := self._places(control[j], shortest, any_type=True):
                others = self._others(control[: j + 1], ends[-1], LIMITS.tries)
                return others is not None and others >= LIMITS.tries - LIMITS.other
        return False

    def _unread(self, group: list[Coded], i: int, place: tuple[int, int]) -> bool:
        """Whether the end of a unit of packet i does not matter."""
        few = self._read_with(group, i)
        if len(few) <= i:  # at little cost
            others = self._others(few, place, LIMITS.other)
            if others is not None and others > LIMITS.other:
                return False
        others = self._others(group[: i + 1], place, LIMITS.other, in_order=True)
        return others is not None and others <= LIMITS.other

    def _places(self, one: Coded, shortest: int, *, any_type: bool = False) -> list[tuple[int, int]]:
        """Where units of a packet that hold pictures begin and end, those that are long enough."""
        places = [] if one.packet is None else self._units.places(one.data, any_type=any_type)
        return [place for place in places if place[1] - place[0] >= shortest][-LIMITS.units :]

    def _others(self, group: list[Coded], place: tuple[int, int], enough: int, *, in_order: bool = False) -> int | None:
        """How many other endings of one of its units, up to one more than `enough`, make another picture of a group's
        last; None where that is not shown, as where it has errors and should be in order."""
        data, (begin, end) = group[-1].data, place
        own, others = self._decoded(group, data), 0
        if own is None or (in_order and own.errors):
            return None
        fixed = LIMITS.boolean if self._name in ("vp9", "av1", "libdav1d") else LIMITS.tail
        length = min(fixed + round(LIMITS.block * len(data) * self._share), (end - begin) // 3)
        for seed in range(LIMITS.tries):
            others += self._decoded(group, self._units.with_tail(data, place, length, seed)) != own
            if others > enough:
                break
        return others

    def _decoded(self, group: list[Coded], data: bytes, *, taller: bool = False) -> _Decoded | None:
        """The last picture of a group, coded as `data`, built on the others but B that nothing is built on; or None."""
        self._left -= len(group)
        codec = av.CodecContext.create(self._name, "r")
        codec.extradata, codec.thread_count = self._taller if taller else self._extradata, 1
        codec.options = _OPTIONS | {"apply_cropping": str(int(self._shown >= LIMITS.shown))}
        codec.skip_frame = "NONREF" if self._name in ("h264", "mpeg4") else "DEFAULT"
        before = [one.packet for one in group[:-1] if one.packet]
        sent = (self._packet(bytes(one), one.pts, taller) if taller else one.packet() for one in before)
        last, decoded, earlier = self._packet(data, group[-1].pts, taller), None, 0
        for packet in chain(sent, (last, None)):
            if packet is last:
                earlier, codec.skip_frame = get_last_error()[0], "DEFAULT"
            with suppress(av.error.FFmpegError, EOFError):
                for picture in codec.decode(packet):
                    if picture.pts == last.pts:
                        deep = bits_of(picture.format) > 8
                        levels = b"".join(_levels(plane, deep) for plane in picture.planes)
                        decoded = _Decoded(0, bool(picture.is_corrupt), levels)
        errors, _ = get_last_error()
        return decoded and decoded._replace(errors=errors - earlier)

    def _packet(self, data: bytes, pts: int, taller: bool) -> Any:
        packet = av.Packet((taller and taller_packet(data, self._units.bitstream)) or data)
        packet.pts = pts
        return packet


_OPTIONS = {"flags": "+output_corrupt", "skip_loop_filter": "all"}  # they come though what they are built on is missing


def _levels(plane: Any, deep: bool) -> bytes:
    rows = np.frombuffer(plane, np.uint8)[: plane.height * plane.line_size].reshape(plane.height, plane.line_size)
    return rows[:, : min((1 + deep) * plane.width, plane.line_size)].tobytes()
