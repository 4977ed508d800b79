"""Recordings: every picture of a video or still image, in order, with its own time stamp.

    with open_video("runs/pluck/cam1.mov") as video:
        for frame in video.frames():
            frame.luma          # a view, valid until the next frame is asked for
    video.account               # how the reading went

PyAV decodes (OpenCV's reader gives black or stale pictures for interlaced video and stretches grey levels; a test
bans it). Packets are decoded one by one, so that a damaged one costs its own pictures only. Container frame
counts are never relied on. Memory does not grow with length but for 8 bytes a frame of time stamps.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from fractions import Fraction
from types import TracebackType
from typing import Any

import av

from vidtrack.errors import VidtrackError
from vidtrack.files.damage import Watch
from vidtrack.files.embedded_timecode import code_of_dv_packet, embedded_timecodes, first_code
from vidtrack.files.luma import bits_of, luma_reader
from vidtrack.frame import Frame, ReadAccount, VideoInfo
from vidtrack.timebase import time_base
from vidtrack.timecode import exact_rate

_FIELD_ORDER = {1: "progressive", 2: "top", 3: "bottom", 4: "bottom", 5: "top"}
"""libavcodec's AVFieldOrder, by which field is shown first; 0 is unknown."""


class Video:
    """An open recording; see `open_video`."""

    def __init__(self, path: str, threads: int = 1) -> None:
        self.path = path
        self._container = _opened(path)
        try:
            self._stream = _picture_stream(self._container, path)
            self._stream.codec_context.thread_count = threads
            self._stream.codec_context.thread_type = "AUTO"
            self._watch = Watch()
            self._codes: dict[int | None, str] = {}
            self._pictures = self._decoded()
            self._first = next(self._pictures, None)
            if self._first is None:
                raise VidtrackError(
                    f"{path}: no picture in it can be decoded. Is the file whole? {self._watch.reason()}"
                )
            self.info = self._described(self._first)
        except BaseException:
            self._container.close()
            raise

    def __enter__(self) -> Video:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let the file go; frames that were given become invalid."""
        self._first = None
        self._pictures.close()
        self._container.close()

    @property
    def account(self) -> ReadAccount:
        """How the reading went; complete once `frames` has come to its end."""
        return self._watch.account(self.info)

    def frames(self) -> Iterator[Frame]:
        """Every picture that can be decoded, in order of time. Once per opening: raises ValueError the second time.

        Frame.luma is a view into the decoder's picture, valid until the next frame is asked for.
        """
        if self._first is None:
            raise ValueError("frames() reads a recording once; open it again to read it again")
        picture, self._first = self._first, None
        size = (picture.width, picture.height)
        name, read = picture.format.name, luma_reader(picture.format)
        start, step, scale = picture.pts or 0, self.info.rate, self._stream.time_base
        time = Fraction(0)
        index = 0
        while picture is not None:
            if picture.pts is not None:
                time = (picture.pts - start) * scale
            elif index:
                time += 1 / step
            if (picture.width, picture.height) != size:
                self._watch.other_size(index, picture.width, picture.height)
            else:
                if picture.format.name != name:
                    name, read = picture.format.name, luma_reader(picture.format)
                luma = read(picture)
                corrupt = picture.is_corrupt
                self._watch.picture(index, time, luma, corrupt)
                yield Frame(index, time, luma, corrupt, self._codes.pop(picture.pts, None) if self._codes else None)
                index += 1
            picture = next(self._pictures, None)

    def _decoded(self) -> Generator[Any, None, None]:
        """Pictures, packet by packet, past every packet that fails."""
        decode = self._stream.codec_context.decode
        tape = self._stream.codec_context.name == "dvvideo"
        for packet in self._packets():
            if tape and packet.size:
                self._codes[packet.pts] = code_of_dv_packet(packet) or ""
            try:
                yield from decode(packet)
            except (av.error.FFmpegError, EOFError) as error:
                self._watch.failed_packet(error)

    def _packets(self) -> Iterator[Any]:
        try:
            yield from self._container.demux(self._stream)
        except av.error.FFmpegError as error:
            self._watch.broken_off(error)

    def _described(self, first: Any) -> VideoInfo:
        stream, codec = self._stream, self._stream.codec_context
        still = self._container.format.name.endswith("_pipe") or self._container.format.name == "image2"
        rate = exact_rate(_stated_rate(self._container, stream))
        codes = {} if still else embedded_timecodes(self._container, stream, first, self._codes.get(first.pts))
        source, code = first_code(codes, rate)
        return VideoInfo(
            width=first.width,
            height=first.height,
            rate=rate,
            sample_aspect=codec.sample_aspect_ratio or stream.sample_aspect_ratio or Fraction(1),
            rotation=int(first.rotation),
            codec=codec.name,
            pix_fmt=first.format.name,
            bits=bits_of(first.format),
            field_order=_flagged_order(codec, first),
            timecodes=codes,
            n_frames_hint=stream.frames or None,
            is_still=still,
            start=(first.pts or 0) * stream.time_base,
            time=time_base(rate, code, source=source),
        )


def open_video(path: str, threads: int = 1) -> Video:
    """Open a video, or a still image as a video of one frame.

    threads  of the decoder, 0 for as many as there are processors; when several videos are read side by side, one
             each is best
    Raises VidtrackError naming the file when it is missing, empty, no video, or has no picture that can be decoded.
    """
    return Video(str(path), threads)


def _opened(path: str) -> Any:
    try:
        return av.open(f"file:{path}")
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Check the name, or put the recording there.") from None
    except (av.error.FFmpegError, OSError) as error:
        raise VidtrackError(f"{path}: {_why_not_opened(path, error)}") from None


def _why_not_opened(path: str, error: Exception) -> str:
    try:
        with open(path, "rb") as file:
            head = file.read(12)
    except OSError as refused:
        return f"cannot be read ({refused.strerror}). Check that it is a file and may be read."
    if not head:
        return "is empty (0 bytes). Copy the recording again."
    if head[4:8] in (b"ftyp", b"mdat", b"wide", b"free"):
        return (
            "an MP4 or MOV without its index (moov): the recorder was stopped before it closed the file. "
            "Copy it again, or rebuild it with a repair tool."
        )
    return f"not a video or image that can be read ({getattr(error, 'strerror', None) or error})."


def _picture_stream(container: Any, path: str) -> Any:
    pictures = [stream for stream in container.streams.video if stream.codec_context is not None]
    if not pictures:
        found = ", ".join(sorted({stream.type for stream in container.streams})) or "nothing"
        raise VidtrackError(f"{path}: holds no pictures, only {found}. Give the file that has the video.")
    return pictures[0]


def _stated_rate(container: Any, stream: Any) -> Fraction:
    # raw DV has an average of 60000/1 (its time base); base and guessed are right there
    rates = (stream.base_rate, stream.guessed_rate) if container.format.name == "dv" else ()
    for rate in (*rates, stream.average_rate, stream.guessed_rate, stream.base_rate):
        if rate:
            return Fraction(rate)
    return Fraction(25)


def _flagged_order(codec: Any, first: Any) -> str:
    if codec.name == "dvvideo" and first.interlaced_frame:
        return "bottom"  # IEC 61834: the lower field comes first, at 525 and 625 lines; DV flags neither
    order = _FIELD_ORDER.get(codec.field_order, "unknown")
    return "unknown" if order == "progressive" and first.interlaced_frame else order
