"""A recording that other processes decode: several, each a few pictures in turn, or one.

Where every picture stands for itself (motion JPEG, whose decoder has no threads of its own), each process goes through
all packets and decodes its own ones. The pictures are given in order, by the numbers of their packets. Wherever it is
not certain that this is what one pass gives, each process says so and stops: one pass then goes on from there.
The decoders of tapes and discs are so quick that one of them has a process of its own where it has one thread.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from itertools import chain, islice, repeat
from typing import Any, NamedTuple, Protocol

from numpy.typing import DTypeLike

from vidtrack.timing.frame import Coded, Luma
from vidtrack.video.processes.read_apart import CAN_FORK, ReadApart

SHARED = ("mjpeg",)
"""Codecs whose pictures stand for themselves, and whose decoder has no threads."""

QUICK = ("dvvideo", "mpeg1video", "mpeg2video")
"""Codecs whose pictures are decoded so quickly that a thread of their own waits as long for Python's lock."""

STRETCH = 4
"""Packets that follow each other in one share."""

_HUFFMAN, _QUANTISATION, _SCAN = 0xC4, 0xDB, 0xDA
"""Markers of a JPEG: of its tables, and of the data that they stand before."""


class Stamped(NamedTuple):
    """What is known of a picture.

    pts      when it is shown
    corrupt  whether it is suspect of damage
    code     its own label
    packet   the time stamp of its packet; coded as `Frame.coded`
    """

    pts: int | None
    corrupt: bool
    code: str | None
    packet: int | None = None
    coded: Coded | None = None


class Report(NamedTuple):
    """What a decoder has said of damage until now, and why the file could not be read everywhere."""

    said: str
    refused: int
    could_not_read: str


Levels = tuple[Luma | None, Stamped]
"""Levels of a picture, None for one of another size than the first, and what is known of it."""


Given = tuple[Luma | None, Stamped | Report]
"""The same, or what is said of damage before the pictures behind it."""


class Decoding(Protocol):
    """A recording that is being decoded.

    first   its first pictures, which came while it was opened
    sent    the number of the last packet that was read; mine: which packets, by their number, are decoded
    tables  of its packets that were decoded
    """

    first: list[tuple[Any, bool]] | None
    sent: int
    mine: Callable[[int], bool] | None
    tables: Tables

    def levels(self, *, ahead: bool = False) -> Iterator[Levels]: ...

    def reported(self) -> Report: ...

    def rest(self) -> None: ...

    def close(self) -> None: ...


class Share(NamedTuple):
    """Every so many stretches of packets, beginning with stretch `first`."""

    first: int
    of: int

    def has(self, number: int) -> bool:
        """Whether packet `number` is in it."""
        return number // STRETCH % self.of == self.first


class Tables:
    """Whether JPEGs stand alone: each has the tables of its quantisation, and all have Huffman's or none has."""

    def __init__(self) -> None:
        self.own = True
        self._usual: bool | None = None

    def saw(self, packet: Any) -> None:
        """Look at one more packet."""
        seen = _markers(packet)
        huffman = _HUFFMAN in seen
        if self._usual is None:
            self._usual = huffman
        self.own = self.own and _QUANTISATION in seen and _SCAN in seen and huffman == self._usual


def _markers(packet: Any) -> set[int]:
    """The markers of a JPEG up to its data."""
    data, at, seen = memoryview(packet), 2, set[int]()
    while at + 4 <= len(data) and data[at] == 0xFF and _SCAN not in seen:
        seen.add(data[at + 1])
        at += 2 + (data[at + 2] << 8 | data[at + 3])
    return seen


class _Part(NamedTuple):
    """What a share gives besides a picture: the number of its packet, and what is known of the picture.

    At the end of the recording that is None, and the number how many packets there were.
    """

    number: int
    what: Stamped | None


_UNSURE = _Part(-1, None)


class _Unsure(Exception):
    """One pass might give something else from here on."""


def how_apart(codec: Any, first: Any, threads: int) -> Callable[..., Generator[Given]] | None:
    """Which of the two below reads a recording, by its decoder, its first picture and the threads that it may have;
    None: neither. Fields may lie in packets of their own.
    """
    if CAN_FORK and threads > 1 and codec.name in SHARED and not first.interlaced_frame:
        return partial(levels_in_shares, threads)
    return levels_apart if CAN_FORK and threads == 1 and codec.name in QUICK else None


def levels_in_shares(
    n: int, opened: Callable[[], Decoding], shape: Sequence[int], dtype: DTypeLike, memory: int, path: str
) -> Generator[Given]:
    """What the recording's `levels` gives, from n processes, and from one pass as soon as that is not sure.

    opened  opens the recording
    shape, dtype, memory, path  as `ReadApart` has them; memory is that of all processes
    """
    readers: list[ReadApart] = []
    given = 0
    try:
        for k in range(n):
            read = partial(_share, opened, Share(k, n))
            readers.append(ReadApart(read, shape, dtype, memory // n, path))
        for item in _in_order(readers):
            given += 1
            yield item
    except (OSError, _Unsure):  # too many processes, too little memory for another; or damage
        for reader in readers:
            reader.close()
        yield from gone_on_with(opened, given)
    finally:
        for reader in readers:
            reader.close()


def levels_apart(
    opened: Callable[[], Decoding],
    shape: Sequence[int],
    dtype: DTypeLike,
    memory: int,
    path: str,
    here: Decoding | None = None,
) -> Generator[Given]:
    """What the recording's `levels` gives, from one pass in a process of its own, and what is said of damage before
    each picture. The decoder of quick codecs would wait for Python's lock for as long as it works.

    Parameters as those of `levels_in_shares`
    here    the recording as it is open, by a decoder without threads: the new process goes on with it, and this one
            reads no more of it
    """
    try:
        reader = ReadApart(partial(with_reports, opened if here is None else lambda: here), shape, dtype, memory, path)
    except OSError:  # too many processes, or too little memory for another
        yield from gone_on_with(opened, 0)
        return
    finally:
        if here is not None:
            here.first = None
    try:
        yield from reader
    finally:
        reader.close()


def with_reports(opened: Callable[[], Decoding]) -> Iterator[Given]:
    """One pass, in a process of its own: what is said of damage before the pictures behind it, where it is new."""
    video, said = opened(), Report("", 0, "")
    for item in video.levels():
        if (now := video.reported()) != said:
            yield None, now
            said = now
        yield item
    yield None, video.reported()


def gone_on_with(opened: Callable[[], Decoding], given: int) -> Generator[Given]:
    """What the `levels` of another opening gives from picture `given` on, and what is said of damage before each."""
    again = opened()
    try:
        for item in islice(again.levels(ahead=True), given, None):
            yield None, again.reported()
            yield item
        yield None, again.reported()
    finally:
        again.close()


def as_by_one_thread(video: Decoding, opened: Callable[[], Decoding] | None, *, ahead: bool) -> Generator[Given]:
    """What the recording's `levels` gives, and from the first damage on what another opening of it gives.

    Of several packets that a decoder's threads work on at once it is not known which is damaged, and how many these are
    depends on the computer.
    opened  opens the recording for decoding in one thread; None: it is
    """
    clean, given, damaged = Report("", 0, ""), 0, False
    for item in video.levels(ahead=ahead):
        damaged = item[1].corrupt or video.reported() != clean
        if damaged and opened:
            break
        yield item
        given += 1
    if opened and (damaged or video.reported() != clean):
        video.rest()  # what decoders log is one list for all
        yield from gone_on_with(opened, given)


def _in_order(readers: Sequence[ReadApart]) -> Generator[Levels]:
    """Pictures and what is known of them from the readers of all shares. Raises _Unsure where they do not agree."""
    each, number = [iter(reader) for reader in readers], 0
    while True:
        luma, part = next(each[number // STRETCH % len(each)])
        if part.number != number:
            raise _Unsure
        if part.what is None:
            return
        yield luma, part.what
        number += 1


def _share(opened: Callable[[], Decoding], share: Share) -> Iterator[tuple[Luma | None, _Part]]:
    """One share, in a process of its own."""
    video = opened()
    clean, first = Report("", 0, ""), video.first or []
    sure = video.reported() == clean and video.sent + 1 == len(first)
    own = [number for number in range(len(first)) if share.has(number)]
    video.first, video.mine = [first[number] for number in own], share.has
    numbers = chain(own, repeat(None))
    for luma, what in video.levels() if sure else ():
        number = next(numbers)
        sure = video.reported() == clean and video.tables.own and not what.corrupt
        if not sure:
            break
        yield luma, _Part(video.sent if number is None else number, what)
    yield None, _Part(video.sent + 1, None) if sure and video.reported() == clean else _UNSURE
