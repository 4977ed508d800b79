"""Any picture of a recording by its number, for people who look through it; stages read from beginning to end.

The numbers are those of `Video.frames` where nothing is damaged: pictures in order of their time stamps. A picture is
found from the key frame before it; single pictures (numbered files, pages) by their place; files that follow each other
by their own numbers. Recordings whose packets have no stamps of their own are read from the beginning.
"""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import accumulate, islice
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, Luma, VideoInfo
from vidtrack.video.container import open_container, picture_stream
from vidtrack.video.decoded import DecodedVideo
from vidtrack.video.from_key_frame import Decoder
from vidtrack.video.reader import open_video
from vidtrack.video.recording import Video
from vidtrack.video.stills.picture_stack import PictureStack, Stack

_SEEKABLE = ("mov", "matroska", "avi", "dv", "mxf", "mpegts", "cine")
"""Containers in which packets may have stamps of their own."""

NEIGHBOURS = 8
"""Pictures before the wanted one that are kept of those that are decoded on the way to it."""

KEPT_BYTES = 256_000_000
"""Pictures of one recording that are kept."""

ON = 4
"""Pictures that are read on rather than looked for anew."""

PEEK = 6
"""Pictures whose stamps are compared with those of the packets."""

Keep = Callable[[int, Luma], None]
GiveUp = Callable[[], bool]


def never() -> bool:
    """The picture is wanted until it is there."""
    return False


class Pictures:
    """The pictures of one recording, each copied out of the decoder; may be used from several threads.

    path, options   as of `reader.open_video`
    counted         is called with the number of pictures so far while they are counted, where the file does not say it
    """

    def __init__(self, path: str, counted: Callable[[int], object] = lambda n: None, **options: Any) -> None:
        self.path = path
        self._lock = threading.RLock()
        self._closed = False
        self._kept: OrderedDict[int, Luma] = OrderedDict()
        self.info, self._source = _source(path, options, counted)

    def __len__(self) -> int:
        return len(self._source)

    def time(self, number: int) -> float:
        """s after the first picture."""
        return float(self._source.time(number) - self._source.time(0))

    def picture(self, number: int, give_up: GiveUp = never) -> Luma:
        """One picture, (height, width), levels as stored; the nearest there is for a number beyond either end.

        give_up   asked after each picture that is decoded on the way: whether the wanted one is no longer wanted
        VidtrackError where it cannot be decoded, or the recording is closed meanwhile.
        """
        number = min(max(number, 0), len(self) - 1)
        if (kept := self._kept.get(number)) is not None:  # at once, though another thread is decoding
            return kept
        with self._lock:
            if number not in self._kept and not self._closed:
                self._source.read(number, self._keep, lambda: self._closed or give_up())
            if number not in self._kept:
                raise VidtrackError(f"{self.path}: picture {number} cannot be decoded. Look at another one.")
            self._kept.move_to_end(number)
            return self._kept[number]

    def has(self, number: int) -> bool:
        """Whether a picture is at hand without decoding."""
        return number in self._kept

    def close(self) -> None:
        """Let the file go; who waits for a picture of it waits no longer."""
        self._closed = True
        with self._lock:
            self._source.close()

    def _keep(self, number: int, luma: Luma) -> None:
        self._kept[number] = luma
        most = max(8, KEPT_BYTES // max(luma.nbytes, 1))
        while len(self._kept) > most:
            self._kept.popitem(last=False)


class _Source(ABC):
    """Where pictures come from, by their numbers."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def time(self, number: int) -> Fraction:
        """s, on a scale of the source's own."""

    @abstractmethod
    def read(self, number: int, keep: Keep, give_up: GiveUp) -> None:
        """Decode a picture, and hand it and what comes on the way to `keep`, copied."""

    @abstractmethod
    def close(self) -> None: ...


def _source(path: str, options: dict[str, Any], counted: Callable[[int], object]) -> tuple[VideoInfo, _Source]:
    if options.get("parts"):
        rest = {name: value for name, value in options.items() if name != "parts"}
        paths = [path, *(os.path.join(os.path.dirname(path), part) for part in options["parts"])]
        each = [_source(one, rest, counted) for one in paths]
        return each[0][0], _Joined([source for _, source in each], 1 / each[0][0].rate)
    with open_video(path, **options) as video:
        info = video.info
        if isinstance(video, PictureStack):
            return info, _ByPlace(video.stack, info.rate)
        seekable = isinstance(video, DecodedVideo) and not info.is_still
    stamps = _stamps(path, options.get("stream")) if seekable else None
    if stamps is not None:
        source = _ByKeyFrame(path, options, info, *stamps)
        if source.counts_as_decoded():
            return info, source
        source.close()
    return info, _FromBeginning(path, options, info, counted)


def _stamps(path: str, number: int | None) -> tuple[list[int], list[int], Fraction] | None:
    """Stamps of all pictures in order, which of them are key frames, their unit; None where they do not say enough."""
    with open_container(path) as container:
        stream, _ = picture_stream(container, path, number)
        if container.format.name.split(",")[0] not in _SEEKABLE:
            return None
        tick = Fraction(stream.time_base)
        packets = [(p.pts, p.is_keyframe) for p in container.demux(stream) if p.size and not p.is_discard]
    stamps = sorted(pts for pts, _ in packets if pts is not None)
    if len(stamps) < len(packets) or len(set(stamps)) < len(stamps) or not stamps:
        return None
    place = {pts: i for i, pts in enumerate(stamps)}
    keys = sorted(place[pts] for pts, key in packets if key)
    return (stamps, keys, tick) if keys and keys[0] == 0 else None


class _ByKeyFrame(_Source):
    """A file whose packets have stamps: decoding begins at the key frame before a picture."""

    def __init__(
        self, path: str, options: dict[str, Any], info: VideoInfo, stamps: list[int], keys: list[int], tick: Fraction
    ) -> None:
        self._path, self._colour, self._number = path, options.get("colour"), options.get("stream")
        self._stamps, self._keys, self._tick = stamps, keys, tick * info.pace
        self._key = frozenset(keys)
        self._place = {stamp: i for i, stamp in enumerate(stamps)}
        self._decoder: Decoder | None = None

    def __len__(self) -> int:
        return len(self._stamps)

    def time(self, number: int) -> Fraction:
        return self._stamps[number] * self._tick

    def counts_as_decoded(self) -> bool:
        """Whether the first pictures that come have the first stamps: else packets are no measure of pictures."""
        first = [stamp for stamp, _ in islice(self._from(0), PEEK)]
        self._close()
        return first == self._stamps[: len(first)]

    def read(self, number: int, keep: Keep, give_up: GiveUp) -> None:
        k = max(bisect_right(self._keys, number) - 1, 0)
        decoder = self._decoder
        if decoder is None or not (self._keys[k] <= decoder.next <= number or 0 <= number - decoder.next <= ON):
            decoder = self._from(k)
        for earlier in (max(k - 2, 0), 0):
            if self._decoded(decoder, number, keep, give_up):
                return
            decoder = self._from(earlier)  # the seek ended too late
        self._decoded(decoder, number, keep, give_up)

    def _decoded(self, decoder: Decoder, number: int, keep: Keep, give_up: GiveUp) -> bool:
        """Whether it came by the picture, or gave up."""
        for stamp, picture in decoder:
            i = self._place.get(stamp)
            if i is None or (decoder.fresh and i not in self._key):  # those before a key frame lack what they rest on
                continue
            if i > number and decoder.fresh:
                return False
            decoder.fresh = False
            decoder.next = i + 1
            if i > number - NEIGHBOURS:
                keep(i, np.array(decoder.levels(picture)))
            if i >= number or give_up():
                return True
        decoder.next = len(self) + 1
        return not decoder.fresh

    def _from(self, k: int) -> Decoder:
        self._close()
        self._decoder = Decoder(self._path, self._number, self._colour, self._stamps[self._keys[k]] if k else None)
        self._decoder.next = self._keys[k]
        return self._decoder

    def _close(self) -> None:
        if self._decoder:
            self._decoder.close()
        self._decoder = None

    def close(self) -> None:
        self._close()


class _ByPlace(_Source):
    """Single pictures, each read by itself."""

    def __init__(self, stack: Stack, rate: Fraction) -> None:
        self._stack, self._rate = stack, rate

    def __len__(self) -> int:
        return len(self._stack.numbers)

    def time(self, number: int) -> Fraction:
        return self._stack.numbers[number] / self._rate

    def read(self, number: int, keep: Keep, give_up: GiveUp) -> None:
        keep(number, np.array(self._stack.picture(number)[0]))

    def close(self) -> None:
        """Nothing stays open."""


class _FromBeginning(_Source):
    """A recording that can be read in order only."""

    def __init__(self, path: str, options: dict[str, Any], info: VideoInfo, counted: Callable[[int], object]) -> None:
        self._path, self._options, self._rate = path, options, info.rate
        self._running: tuple[Video, int, Iterator[Frame]] | None = None  # the number of the picture that comes next
        with open_video(path, **{**options, "threads": 0}) as video:
            self._n = 0
            for self._n, _ in enumerate(video.frames(), 1):
                counted(self._n)

    def __len__(self) -> int:
        return self._n

    def time(self, number: int) -> Fraction:
        return number / self._rate

    def read(self, number: int, keep: Keep, give_up: GiveUp) -> None:
        if self._running is None or number < self._running[1]:
            self.close()
            video = open_video(self._path, **self._options)
            self._running = video, 0, video.frames()
        video, _, frames = self._running
        for frame in frames:
            self._running = video, frame.index + 1, frames
            if frame.index > number - NEIGHBOURS:
                keep(frame.index, np.array(frame.luma))
            if frame.index >= number or give_up():
                return

    def close(self) -> None:
        if self._running:
            self._running[0].close()
        self._running = None


class _Joined(_Source):
    """Files that follow each other."""

    def __init__(self, parts: list[_Source], step: Fraction) -> None:
        self._parts, self._step = parts, step
        self._ends = list(accumulate(len(part) for part in parts))

    def __len__(self) -> int:
        return self._ends[-1]

    def _at(self, number: int) -> tuple[int, int]:
        k = bisect_right(self._ends, number)
        return k, self._ends[k] - len(self._parts[k])

    def time(self, number: int) -> Fraction:
        k, before = self._at(number)
        return before * self._step + self._parts[k].time(number - before) - self._parts[k].time(0)

    def read(self, number: int, keep: Keep, give_up: GiveUp) -> None:
        k, before = self._at(number)
        self._parts[k].read(number - before, lambda i, luma: keep(before + i, luma), give_up)

    def close(self) -> None:
        for part in self._parts:
            part.close()
