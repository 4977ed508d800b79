"""Decoding that begins at a key frame within a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vidtrack.timing.frame import Luma
from vidtrack.video.container import open_container, picture_stream
from vidtrack.video.luma import luma_reader
from vidtrack.video.orientation import STORED, Orientation, orientation_of
from vidtrack.video.times.packet_times import Shown, coded_stamps


class Decoder:
    """Pictures from the key frame with a stamp on, or from the beginning: (time stamp, PyAV's picture).

    next    the number of the picture that comes next; fresh: none has come yet
    """

    def __init__(self, path: str, number: int | None, colour: Any, stamp: int | None) -> None:
        self.next, self.fresh = 0, True
        self._path, self._colour = path, colour
        self._container = open_container(path)
        self._stream, _ = picture_stream(self._container, path, number)
        self._stream.codec_context.thread_count = 0  # a person waits: all cores
        self._stream.codec_context.thread_type = "AUTO"
        self._coded = coded_stamps(self._container, self._stream.codec_context)
        self._shown: Shown | None = None
        self._last = 0
        if stamp is not None:
            self._container.seek(stamp, stream=self._stream, backward=True)
        self._pictures = self._container.decode(self._stream)
        self._turn: Orientation | None = None
        self._read: dict[str, Callable[[Any], Luma]] = {}

    def __iter__(self) -> Decoder:
        return self

    def __next__(self) -> tuple[int, Any]:
        while True:
            try:
                picture = next(self._pictures)
            except StopIteration:
                raise
            except Exception as error:  # a damaged packet costs its own picture only
                if not type(error).__module__.startswith("av"):
                    raise
                continue
            return self._stamp(picture), picture

    def _stamp(self, picture: Any) -> int:
        if not self._coded:
            own: int = picture.pts
            return own
        self._shown = self._shown or Shown(picture)
        stamp = self._shown(picture)
        self._last = self._last + 1 if stamp is None else stamp
        return self._last

    def levels(self, picture: Any) -> Luma:
        """What the stages read of a picture."""
        if self._turn is None:
            self._turn = orientation_of(picture, self._path) or STORED
        name = picture.format.name
        if name not in self._read:
            self._read[name] = self._turn.applied(self._reader(picture))
        return self._read[name](picture)

    def _reader(self, picture: Any) -> Callable[[Any], Luma]:
        if self._colour is None:
            return luma_reader(picture.format)
        from vidtrack.video.colour import colour_reader  # cv2, for colour alone

        return colour_reader(picture, self._stream.codec_context.name, self._colour, self._path)

    def close(self) -> None:
        self._stream.codec_context.flush_buffers()  # the decoder's threads are at rest before it is freed
        self._container.close()
