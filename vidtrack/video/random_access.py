"""Any picture of a recording by its number, for people who look through it; stages read from beginning to end.

The numbers are those of `Video.frames` where nothing is damaged: pictures in order of their time stamps. A picture is
found from the key frame before it. Recordings whose packets have no stamps of their own are read from the beginning.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, Luma, VideoInfo
from vidtrack.video.container import open_container, picture_stream
from vidtrack.video.decoded import DecodedVideo
from vidtrack.video.luma import luma_reader
from vidtrack.video.orientation import STORED, Orientation, orientation_of
from vidtrack.video.reader import open_video
from vidtrack.video.recording import Video

_SEEKABLE = ("mov", "matroska", "avi", "dv", "gif", "mxf")
"""Containers in which every packet has its stamp, and a seek ends where it should."""

NEIGHBOURS = 8
"""Pictures before the wanted one that are kept of those that are decoded on the way to it."""

KEPT_BYTES = 256_000_000
"""Pictures of one recording that are kept."""


class Pictures:
    """The pictures of one recording, each copied out of the decoder; may be used from several threads."""

    def __init__(self, path: str, **options: Any) -> None:
        self.path, self._options = path, options
        with open_video(path, **options) as video:
            self.info: VideoInfo = video.info
            # one file, one stream, levels as they are stored: the pictures can be decoded here
            self._plain = isinstance(video, DecodedVideo) and not {"stream", "colour"} & set(options)
        self._lock = threading.RLock()
        self._kept: OrderedDict[int, Luma] = OrderedDict()
        self._tick = Fraction(1)
        self._stamps, self._keys = self._index()
        self._decoder: _Decoder | None = None
        self._running: tuple[Video, int, Iterator[Frame]] | None = None  # the number of the picture that comes next

    def __len__(self) -> int:
        return len(self._stamps)

    def time(self, number: int) -> float:
        """s after the first picture."""
        return float((self._stamps[number] - self._stamps[0]) * self._tick)

    def picture(self, number: int) -> Luma:
        """One picture, (height, width), levels as stored; the nearest there is for a number beyond either end.

        VidtrackError where it cannot be decoded.
        """
        number = min(max(number, 0), len(self) - 1)
        with self._lock:
            if number not in self._kept:
                self._read(number)
            if number not in self._kept:
                raise VidtrackError(f"{self.path}: picture {number} cannot be decoded. Look at another one.")
            self._kept.move_to_end(number)
            return self._kept[number]

    def has(self, number: int) -> bool:
        """Whether a picture is at hand without decoding."""
        return number in self._kept

    def close(self) -> None:
        """Let the file go."""
        with self._lock:
            if self._decoder:
                self._decoder.close()
                self._decoder = None
            self._stop()

    def _index(self) -> tuple[list[int], list[int]]:
        """Time stamps of all pictures in order, and which of them are key frames; numbers where there are none."""
        if self.info.is_still:
            return [0], []
        if not self._plain:
            return self._counted()
        with open_container(self.path) as container:
            stream, _ = picture_stream(container, self.path)
            self._tick = stream.time_base * self.info.pace
            seekable = container.format.name.split(",")[0] in _SEEKABLE
            packets = [(p.pts, p.is_keyframe) for p in container.demux(stream) if p.size and not p.is_discard]
        stamps = sorted(pts for pts, _ in packets if pts is not None)
        if not seekable or len(stamps) < len(packets) or len(set(stamps)) < len(stamps) or not stamps:
            return self._counted()
        place = {pts: i for i, pts in enumerate(stamps)}
        return stamps, sorted(place[pts] for pts, key in packets if key)

    def _counted(self) -> tuple[list[int], list[int]]:
        with open_video(self.path, **self._options) as video:
            n = sum(1 for _ in video.frames())
        self._tick = 1 / self.info.rate
        return list(range(n)), []

    def _read(self, number: int) -> None:
        if not self._keys:
            self._read_from_beginning(number)
            return
        key = self._keys[max(bisect_right(self._keys, number) - 1, 0)]
        decoder = self._decoder
        if decoder is None or not (key <= decoder.next <= number or decoder.next <= number <= decoder.next + 4):
            if decoder:
                decoder.close()
            decoder = self._decoder = _Decoder(self.path, self._stamps[key])
        place = {stamp: i for i, stamp in enumerate(self._stamps[max(key - 1, 0) :], max(key - 1, 0))}
        for stamp, luma in decoder:
            i = place.get(stamp)
            if i is None:
                continue
            decoder.next = i + 1
            if i > number - NEIGHBOURS:
                self._keep(i, np.array(luma))
            if i >= number:
                return
        decoder.next = len(self) + 1

    def _read_from_beginning(self, number: int) -> None:
        if self._running is None or number < self._running[1]:
            self._stop()
            video = open_video(self.path, **self._options)
            self._running = video, 0, video.frames()
        video, _, frames = self._running
        for frame in frames:
            self._running = video, frame.index + 1, frames
            if frame.index > number - NEIGHBOURS:
                self._keep(frame.index, np.array(frame.luma))
            if frame.index >= number:
                return

    def _stop(self) -> None:
        if self._running:
            self._running[0].close()
        self._running = None

    def _keep(self, number: int, luma: Luma) -> None:
        self._kept[number] = luma
        most = max(8, KEPT_BYTES // max(luma.nbytes, 1))
        while len(self._kept) > most:
            self._kept.popitem(last=False)


class _Decoder:
    """Pictures from a key frame on: (time stamp, luma). next: the number of the one that comes next."""

    def __init__(self, path: str, stamp: int) -> None:
        self.next = 0
        self._container = open_container(path)
        stream, _ = picture_stream(self._container, path)
        stream.codec_context.thread_type = "SLICE"
        self._container.seek(stamp, stream=stream, backward=True)
        self._pictures = self._container.decode(stream)
        self._path = path
        self._turn: Orientation | None = None
        self._read: dict[str, Callable[[Any], Luma]] = {}

    def __iter__(self) -> _Decoder:
        return self

    def __next__(self) -> tuple[int, Luma]:
        while True:
            try:
                picture = next(self._pictures)
            except StopIteration:
                raise
            except Exception as error:  # a damaged packet costs its own picture only
                if not type(error).__module__.startswith("av"):
                    raise
                continue
            if self._turn is None:
                self._turn = orientation_of(picture, self._path) or STORED
            name = picture.format.name
            if name not in self._read:
                self._read[name] = self._turn.applied(luma_reader(picture.format))
            return picture.pts, self._read[name](picture)

    def close(self) -> None:
        self._container.close()
