"""Recordings: every picture of a video or still image, in order, with its own time stamp.

    with open_video("runs/pluck/cam1.mov") as video:
        for frame in video.frames():
            frame.luma          # a view of the decoder's picture, levels as stored
    video.account               # how the reading went

PyAV decodes (OpenCV's reader gives black or stale pictures for interlaced video and stretches grey levels; a test
bans it). Packets are decoded one by one, so that a damaged one costs its own pictures only. Container frame
counts are never relied on. Memory does not grow with length but for 8 bytes a frame of time stamps.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Callable, Generator, Iterator
from fractions import Fraction
from itertools import chain
from types import TracebackType
from typing import Any

import av
from av.codec.codec import Capabilities
from av.logging import PANIC, get_last_error, get_level, set_level

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo
from vidtrack.timing.timebase import base_from_labels
from vidtrack.timing.timecode import exact_rate
from vidtrack.video.damage import Watch
from vidtrack.video.embedded_timecode import code_bases, code_of_dv_packet, embedded_timecodes
from vidtrack.video.luma import bits_of, luma_reader
from vidtrack.video.orientation import STORED, Orientation, orientation_of
from vidtrack.video.read_ahead import read_ahead

_FIELD_ORDER = {1: "progressive", 2: "top", 3: "bottom", 4: "bottom", 5: "top"}
"""libavcodec's AVFieldOrder, by which field is shown first; 0 is unknown."""

_PATIENCE = 100
"""How often in a row reading is taken up again where a container is damaged."""

AHEAD_BYTES = 32_000_000
"""Decoded pictures that wait while those before them are in use: as many as come while a tracker finds its targets."""

if get_level() is None:
    set_level(PANIC)  # prints nothing, but counts the errors that decoders log: for many their only word on damage

COMMON_RATES = {Fraction(n) for n in (24, 25, 30, 50, 60)} | {Fraction(n * 1000, 1001) for n in (24, 30, 60)}
LOST_SHARE = 0.4
"""Share of its frames that a recording may have lost and still be taken for one of the next common rate; one of every
second frame (fields counted as frames) is not."""


class Video:
    """An open recording; see `open_video`."""

    def __init__(self, path: str, threads: int = 1) -> None:
        self.path = path
        self._container = _opened(path)
        try:
            self._stream = _picture_stream(self._container, path)
            self._stream.codec_context.thread_count = threads
            self._stream.codec_context.thread_type = "AUTO"
            self._watch = Watch(self._in_hand(threads))
            self._codes: dict[int | None, str | None] = {}
            self._drained = self._ended = False  # by the decoder, and by who is given the pictures
            self._pictures = self._decoded()
            self._source = self._pictures
            self._first = next(self._pictures, None)
            if self._first is None:
                raise VidtrackError(
                    f"{path}: no picture in it can be decoded. Is the file whole? {self._watch.reason()}"
                )
            self._turn = self._orientation(self._first[0])
            self.info = self._described(self._first[0])
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
        self._source.close()  # a thread that reads ahead ends with it
        if not self._drained:
            # the decoder's threads must be at rest: one that logs while its context is freed would wait for ever
            self._stream.codec_context.flush_buffers()
        self._pictures.close()
        self._container.close()

    def _in_hand(self, threads: int) -> int:
        """How many packets the decoder may be at work on: one a thread, where its threads take whole pictures."""
        if not self._stream.codec_context.codec.capabilities & Capabilities.frame_threads:
            return 1
        return threads or 16

    @property
    def account(self) -> ReadAccount:
        """How the reading went; complete once `frames` has come to its end."""
        return self._watch.account(self.info, ended=self._ended)

    def frames(self, *, ahead: bool = False) -> Iterator[Frame]:
        """Every picture that can be decoded, in order of time. Once per opening: raises ValueError the second time.

        Frame.luma is a view into the decoder's picture; hold few of them.
        ahead  whether a thread of its own decodes the next ones, AHEAD_BYTES of them, while these are in use
        """
        if self._first is None:
            raise ValueError("frames() reads a recording once; open it again to read it again")
        first, self._first = self._first, None
        watch, codes = self._watch, self._codes
        width, height, name = first[0].width, first[0].height, ""
        if ahead:
            size = width * height * (3 if self.info.bits == 8 else 6) // 2
            self._source = read_ahead(self._pictures, max(1, AHEAD_BYTES // size))
        start, step = first[0].pts or 0, 1 / self.info.rate
        ticks, second = self._stream.time_base.as_integer_ratio()
        time, index = -step, 0
        for picture, corrupt in chain((first,), self._source):
            pts = picture.pts
            time = Fraction((pts - start) * ticks, second) if pts is not None else time + step
            if picture.width != width or picture.height != height:
                watch.other_size()
                continue
            if picture.format.name != name:
                name, read = picture.format.name, self._turn.applied(luma_reader(picture.format))
            luma = read(picture)
            watch.picture(index, time.numerator / time.denominator, luma, corrupt)
            yield Frame(index, time, luma, corrupt, codes.pop(pts, None) if codes else None)
            index += 1
        self._ended = True

    def _decoded(self) -> Generator[tuple[Any, bool]]:
        """Pictures, packet by packet, past every packet that fails; and whether each is suspect of damage.

        Everything that may run in a thread of its own is in here: it changes nothing that `frames` reads but _codes.
        """
        codec, watch = self._stream.codec_context, self._watch
        decode, tape = codec.decode, codec.name == "dvvideo"
        logged, _ = get_last_error()
        for packet in self._packets():
            if packet.size:
                watch.sent(packet.pts, packet.is_keyframe)
                if packet.is_corrupt:
                    watch.complained("a packet that the container marks as corrupt", refused=False)
                if tape:
                    self._codes[packet.pts] = code_of_dv_packet(packet)
            refused = None
            try:
                pictures = decode(packet)
            except (av.error.FFmpegError, EOFError) as error:
                pictures, refused = [], error
            errors, last = get_last_error()
            if refused or errors != logged:
                said = last[2] if last and errors != logged and last[1] == codec.name else None
                logged = errors
                if refused or said:  # what the container logs is told by gaps, not by this packet
                    watch.complained(said or str(refused), refused=refused is not None)
            for picture in pictures:
                yield picture, watch.is_suspect(picture)
        self._drained = True

    def _packets(self) -> Iterator[Any]:
        """Packets of the picture stream; where the container is damaged, reading is taken up again behind it."""
        failures, rightly_timed = 0, _retimer(self._container, self._stream)
        while failures < _PATIENCE:
            try:
                for packet in self._container.demux(self._stream):
                    failures = 0
                    if packet.size:
                        rightly_timed(packet)
                    yield packet
                return
            except av.error.FFmpegError as error:
                failures += 1
                self._watch.broken_off(error)

    def _orientation(self, first: Any) -> Orientation:
        turn = orientation_of(first, self.path)
        if turn is None:
            self._watch.noted(f"the file asks players to turn the picture by {first.rotation} degrees: not obeyed")
        elif turn.transposed and _flagged_order(self._stream.codec_context, first) in ("top", "bottom"):
            self._watch.noted("interlaced pictures that stand on their side: their fields are not taken apart")
        return turn or STORED

    def _described(self, first: Any) -> VideoInfo:
        stream, codec = self._stream, self._stream.codec_context
        still = self._container.format.name.endswith("_pipe") or self._container.format.name == "image2"
        rate = exact_rate(_stated_rate(self._container, stream))
        codes = {} if still else embedded_timecodes(self._container, stream, first, self._codes.get(first.pts))
        bases = code_bases(self._container, codes)
        aspect, turn = codec.sample_aspect_ratio or stream.sample_aspect_ratio or Fraction(1), self._turn
        width, height = (first.height, first.width) if turn.transposed else (first.width, first.height)
        return VideoInfo(
            width=width,
            height=height,
            rate=rate,
            sample_aspect=1 / aspect if turn.transposed else aspect,
            rotation=turn.rotation,
            mirrored=turn.mirrored,
            codec=codec.name,
            pix_fmt=first.format.name,
            bits=bits_of(first.format),
            field_order=turn.field_order(_flagged_order(codec, first), first.height),
            timecodes=codes,
            code_bases=bases,
            n_frames_hint=stream.frames or None,
            duration=None if still else _stated_duration(self._container, stream, rate),
            is_still=still,
            start=(first.pts or 0) * stream.time_base,
            time=base_from_labels(codes, rate, bases),
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


def _retimer(container: Any, stream: Any) -> Callable[[Any], None]:
    """A function that puts a packet's time stamp right, for containers that only count their packets.

    Raw DV and AVI carry no time stamps: behind a damaged frame the count is short, and only the packet's place in
    the file, and in AVI the index (which points at the chunks' headers of 8 bytes), say which frame it is.
    """
    if container.format.name == "dv":

        def by_size(packet: Any) -> None:
            packet.pts = round(packet.pos / packet.size) * packet.duration

        return by_size
    if container.format.name == "avi":
        places, numbers, ended = array("q"), array("q"), None

        def by_index(packet: Any) -> None:
            nonlocal ended
            apart, ended = ended not in (None, packet.pos), packet.pos + packet.size + packet.size % 2 + 8
            if apart and not places:  # something lies between two pictures: sound, or one whose header is spoilt
                places.extend(entry.pos + 8 for entry in stream.index_entries)
                numbers.extend(entry.timestamp for entry in stream.index_entries)
            at = bisect_left(places, packet.pos)
            if at == len(places) or places[at] != packet.pos:
                return
            frame, counted = numbers[at], packet.dts if packet.dts is not None else packet.pts
            if counted is not None and frame != counted:
                packet.dts = frame
                if packet.pts is not None:
                    packet.pts += frame - counted

        return by_index
    return lambda packet: None


def _stated_rate(container: Any, stream: Any) -> Fraction:
    # raw DV has an average of 60000/1 (its time base); base and guessed are right there
    rates = (stream.base_rate, stream.guessed_rate) if container.format.name == "dv" else ()
    # frames that were lost lower the average; the rate that was meant is a common one just above it
    if stream.average_rate and stream.guessed_rate and stream.guessed_rate in COMMON_RATES:
        meant = Fraction(stream.guessed_rate)
        if 0 < 1 - stream.average_rate / meant < LOST_SHARE:
            return meant
    for rate in (*rates, stream.average_rate, stream.guessed_rate, stream.base_rate):
        if rate:
            return Fraction(rate)
    return Fraction(25)


def _stated_duration(container: Any, stream: Any, rate: Fraction) -> Fraction | None:
    """What a header, not a guess from the size of the file, says of the length of the pictures, s."""
    kind = container.format.name
    if kind == "avi" and stream.frames:  # the duration is put right from what was found, the count is not
        return Fraction(stream.frames) / rate
    if kind in ("mov,mp4,m4a,3gp,3g2,mj2", "mxf") and stream.duration:
        return Fraction(stream.duration) * Fraction(stream.time_base)
    tag = stream.metadata.get("DURATION", "")  # Matroska, 00:01:02.345000000
    parts = tag.split(":")
    if len(parts) == 3 and tag.replace(":", "").replace(".", "").isdigit():
        return Fraction(parts[2]) + 60 * int(parts[1]) + 3600 * int(parts[0])
    return None


def _flagged_order(codec: Any, first: Any) -> str:
    if codec.name == "dvvideo" and first.interlaced_frame:
        return "bottom"  # IEC 61834: the lower field comes first, at 525 and 625 lines; DV flags neither
    order = _FIELD_ORDER.get(codec.field_order, "unknown")
    return "unknown" if order == "progressive" and first.interlaced_frame else order
