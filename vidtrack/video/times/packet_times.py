"""Time stamps of packets put right, for containers that only count them: raw DV and AVI.

Behind a damaged frame the count is short, and only the packet's place in the file, and in AVI the index, say which
frame it is.
"""

from __future__ import annotations

import os
import re
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from operator import attrgetter
from typing import Any

from av.logging import get_last_error

from vidtrack.video.times.avi_index import HEADER, are_chunks, index_at_end

_CHUNK = re.compile(rb"[0-9A-Za-z]{3}[0-9A-Za-z ]")
"""How a chunk of an AVI begins."""

LOOKED_AT = 8
"""Chunks behind one that seems cut that are looked for at their places."""

FARTHEST = 300
"""Frames ahead in which a chunk that lies elsewhere than the index says is looked for by its size."""

COMPLETE = 0.9
"""Share of the pictures that the header states, at least, that an index of the file has."""

AS_WELL = 4
"""Chunks behind it whose sizes are compared as well."""


LOST = "pictures before it are missing"
"""What is wrong with a packet that may be built on others that were lost."""


BROKEN = "a place at which the file is broken"

SPOILT = "bytes behind it with which no chunk begins"
"""What is wrong with a packet behind which the file is spoilt, and perhaps before that."""


def retimer(container: Any, stream: Any) -> Callable[[Any], str]:
    """A function that puts a packet's time stamp right and answers what is wrong with its place ("" for nothing)."""
    if container.format.name == "dv":
        return _by_size
    if container.format.name == "avi":
        return _ByIndex(stream, container.name.removeprefix("file:"))
    if container.format.name == "mxf":
        return _Counted()
    return lambda packet: ""


def with_next(packets: Iterator[tuple[Any, str]], container: str) -> Iterator[tuple[Any, str, str]]:
    """Packets, what is wrong with their places, and whether that, or the container of this name, is broken behind them.

    Where bytes are missing in a file, the packet before them has bytes of what follows.
    """
    logged, _ = get_last_error()
    held: tuple[Any, str] | None = None
    for packet, misplaced in packets:
        now, last = get_last_error()
        broken = bool(now != logged and last and last[1] == container)
        wrong = misplaced or (BROKEN if broken and packet.size else "")
        if held is not None:
            yield *held, BROKEN if broken or (misplaced and misplaced != SPOILT) else ""
        held = packet, wrong
        logged, _ = get_last_error()
    if held is not None:
        yield *held, ""


def _by_size(packet: Any) -> str:
    packet.pts = round(packet.pos / packet.size) * packet.duration
    return ""


class _Counted:
    """Notices where packets are missing in MXF, which counts its pictures by their places and never leaves one out."""

    def __init__(self) -> None:
        self._last: int | None = None

    def __call__(self, packet: Any) -> str:
        last, now = self._last, packet.dts
        self._last = now
        behind = last is not None and now is not None and now > last + (packet.duration or 1)
        return LOST if behind else ""


class _ByIndex:
    """Finds packets of an AVI in its index: by their place, and behind a cut by their sizes, all shifted alike."""

    def __init__(self, stream: Any, path: str) -> None:
        self._stream = stream
        self._file = open(path, "rb", buffering=0)  # noqa: SIM115 (as long as packets come)
        self._size = os.fstat(self._file.fileno()).st_size
        self._hole = False
        self._ends_match: bool | None = None  # whether the ends of packets say anything: those of the first must
        self._firsts = set[bytes]()  # with which chunks begin
        self._spoilt = False  # the byte behind the packet in hand
        self._places, self._numbers, self._sizes = array("q"), array("q"), array("q")
        self._ended: int | None = None
        self._shift, self._at = 0, -1
        self._made_up = False  # the index, by libavformat, of what it has read
        self._first: int | None = None
        self._before: int | None = None  # places of the first packet, and of the one before

    def __call__(self, packet: Any) -> str:
        ended, self._ended = self._ended, packet.pos + packet.size + packet.size % 2 + HEADER
        apart = ended not in (None, packet.pos)
        self._spoilt = False
        if self._first is None:
            self._first = packet.pos
        cut, behind = self._is_cut(self._ended - HEADER), self._hole
        self._hole |= bool(cut)
        if apart:  # something lies between two pictures: sound, or one whose header is spoilt
            self._load()
            if ended and self._made_up:  # of what was read: it says nothing of what follows
                if not are_chunks(self._file, ended - HEADER, packet.pos - HEADER):
                    behind = self._hole = True
                self._places = array("q")
        if behind and (not self._places or self._places[-1] <= packet.pos):
            return "behind a hole in a file without an index"  # but libavformat's own, of what it has read
        before, self._before = self._before, packet.pos
        if not self._places:
            return cut
        if self._at < 0 and before is not None:
            self._at = bisect_left(self._places, before)
        at = self._found(packet)
        if at is None:
            return "a chunk that is not in the file's index"
        lost = self._at >= 0 and any(self._sizes[self._at + 1 : at])  # chunks of no bytes repeat a picture
        self._at = at
        frame, counted = self._numbers[at], packet.dts if packet.dts is not None else packet.pts
        if counted is not None and frame != counted:
            packet.dts = frame
            if packet.pts is not None:
                packet.pts += frame - counted
        return cut or (SPOILT if self._spoilt else LOST if lost and not packet.is_keyframe else "")

    def _is_cut(self, end: int) -> str:
        if self._ends_match is False or end + 4 > self._size:
            return ""
        good = self._begins(end)
        if self._ends_match is None:
            self._ends_match = good
            return ""
        if good:
            return ""
        self._load()
        next_ones = self._places[bisect_right(self._places, end + HEADER) :][:LOOKED_AT]
        if any(self._begins(place - HEADER) for place in next_ones):
            # all is in its place, but for the header of the chunk that follows: from where on is it spoilt?
            self._file.seek(end)
            self._spoilt = self._file.read(1) not in self._firsts
            return ""
        return "a chunk behind which none begins"

    def _begins(self, place: int) -> bool:
        self._file.seek(place)
        head = self._file.read(4)
        good = _CHUNK.fullmatch(head) is not None
        if good:
            self._firsts.add(head[:1])
        return good

    def _load(self) -> None:
        if self._places or self._made_up:
            return
        for entry in self._stream.index_entries:
            self._places.append(entry.pos + HEADER)
            self._numbers.append(entry.timestamp)
            self._sizes.append(entry.size)
        chunks = index_at_end(self._file, self._first) if self._first is not None else None
        if chunks is not None and len(chunks.places) > len(self._places):
            self._places, self._sizes = array("q", chunks.places.tolist()), array("q", chunks.sizes.tolist())
            self._numbers = array("q", range(len(self._places)))
        self._made_up = chunks is None and len(self._places) < max(1, COMPLETE * self._stream.frames)

    def _found(self, packet: Any) -> int | None:
        at = bisect_left(self._places, packet.pos + self._shift)
        if at < len(self._places) and self._places[at] == packet.pos + self._shift:
            return at
        ahead = range(self._at + 1, min(self._at + FARTHEST, len(self._places)))
        alike = [k for k in ahead if self._sizes[k] == packet.size]
        if not alike:
            return None
        k = min(alike, key=lambda k: (-self._followed(packet.pos, k), abs(self._places[k] - packet.pos)))
        self._shift = self._places[k] - packet.pos
        return k

    def _followed(self, place: int, k: int) -> int:
        """How many chunks are behind the one at `place` as they are behind number k of the index."""
        behind = range(k + 1, min(k + 1 + AS_WELL, len(self._places)))
        return sum(self._size_at(self._places[j] - self._places[k] + place) == self._sizes[j] for j in behind)

    def _size_at(self, place: int) -> int:
        self._file.seek(place - 4)
        return int.from_bytes(self._file.read(4), "little")


class Shown:
    """When pictures are shown, in containers that give packets the stamps of decoding alone, as AVI does.

    The decoder gives pictures in the order in which they are shown, and the stamp of the packet that brings one out
    rises with them. The first picture's own stamp is right: none that is shown later is coded before it.
    """

    def __init__(self, first: Any) -> None:
        self._shift = 0 if first.pts is None or first.dts is None else first.pts - first.dts

    def __call__(self, picture: Any) -> int | None:
        """The stamp; None for those that come when no packet is left."""
        return None if picture.dts is None else picture.dts + self._shift


PACKED = ("mpeg4", "msmpeg4v1", "msmpeg4v2", "msmpeg4v3")
"""Codecs whose B pictures old programs packed into the packet of another one."""

ONE_BEHIND = (*PACKED, "mpeg1video", "mpeg2video")
"""Codecs whose decoders hold one picture, where there are B pictures."""

Stamps = tuple[int | None, int | None]
"""Of a packet: when its picture is shown, and when it is decoded."""


def scale_of(
    container: Any, codec: Any, pictures: Sequence[Any], sent: Sequence[Stamps], *, damaged: bool
) -> tuple[Callable[[Any], int | None], int]:
    """When a picture is shown, as a function of it, and the stamp of the recording's beginning.

    pictures  the first that the decoder gives
    sent      stamps of the packets that it was given until then; damaged: whether some may be missing among them
    """
    first, coded = pictures[0], coded_stamps(container, codec)
    if coded and damaged and codec.name in ONE_BEHIND and sent:
        return attrgetter("dts"), (sent[0][1] or 0) + bool(codec.has_b_frames)  # other stamps are made up over holes
    zero = min([*(pts for pts, _ in sent if pts is not None), first.pts or 0])
    return Shown(first) if coded or coded_order(pictures) else attrgetter("pts"), zero


SLIPS = 12
"""Pictures that stamps may fall back by, and for which they may do so."""


class Forward:
    """Holds the times of pictures against those before: time does not run backwards.

    step     s from picture to picture
    guessed  whether most stamps are the demuxer's guesses (MPEG-PS, TS): where small pictures lie in one packet of the
             container, some come early by a few pictures, until the next stamp that is written there. Then pictures are
             counted, unless some were left out shortly before, or damage was found
    """

    def __init__(self, step: Fraction, *, guessed: bool) -> None:
        self._step, self._guessed = step, guessed
        self._latest = -step
        self._slipped = self._since_gap = 0

    def __call__(self, time: Fraction, *, damaged: bool) -> tuple[Fraction, bool]:
        """The time of the next picture, and whether it is none: pieces of two pictures, or of another moment."""
        latest, behind = self._latest, time - self._latest
        self._since_gap += 1
        if behind > 0:
            self._slipped = 0
            if 2 * behind > 3 * self._step and latest >= 0:
                self._since_gap = 0
            self._latest = time
            return time, False
        slip = self._guessed and not damaged and self._slipped < SLIPS <= self._since_gap
        if not (slip and behind > -SLIPS * self._step):
            return time, True
        self._slipped += 1
        self._latest += self._step
        return self._latest, False


def coded_stamps(container: Any, codec: Any) -> bool:
    """Whether packets have stamps of decoding alone, and pictures of this codec may come in another order."""
    return container.format.name == "avi" and not codec.codec.intra_only


def coded_order(pictures: Sequence[Any]) -> bool:
    """Whether presentation stamps are those of the order of coding, as in AVI with packed B pictures.

    The decoder gives pictures in the order in which they are shown, and the stamps of decoding rise with them.
    """
    shown, decoded = [picture.pts for picture in pictures], [picture.dts for picture in pictures]
    if None in shown or None in decoded:
        return False
    return any(b <= a for a, b in pairwise(shown)) and all(b > a for a, b in pairwise(decoded))
