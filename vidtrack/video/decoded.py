"""A recording in one file that PyAV decodes: every picture, in order, with its own time stamp.

PyAV decodes (OpenCV's reader gives black or stale pictures for interlaced video and stretches grey levels; a test
bans it). Packets are decoded one by one, so that a damaged one costs its own pictures only. Container frame
counts are never relied on. Memory does not grow with length but for 8 bytes a frame of time stamps.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import chain, islice
from typing import Any

import av
import numpy as np
from av.codec.codec import Capabilities
from av.logging import PANIC, get_last_error, get_level, set_level

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo
from vidtrack.timing.timebase import base_from_labels
from vidtrack.timing.timecode import exact_rate
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.coded.coding_order import CodingOrder, LongWaits
from vidtrack.video.container import MOST_PIXELS, open_container, picture_stream, why_no_picture
from vidtrack.video.faults.account import ReadingLog
from vidtrack.video.faults.damage import DamageWatch
from vidtrack.video.faults.second_look import SecondLook
from vidtrack.video.framed import Framing
from vidtrack.video.luma import bits_of, colour_bits_of, is_swapped, luma_reader
from vidtrack.video.monitored import SPARE, frames_monitored
from vidtrack.video.orientation import STORED, Orientation, orientation_of
from vidtrack.video.processes.read_ahead import read_ahead
from vidtrack.video.processes.shares import (
    SHARED,
    Levels,
    Report,
    Stamped,
    Tables,
    as_by_one_thread,
    how_apart,
    levels_apart,
)
from vidtrack.video.recording import Monitor, Video
from vidtrack.video.times.embedded_timecode import code_bases, code_of_dv_packet, embedded_timecodes
from vidtrack.video.times.own_stamps import TICK, own_stamps, rate_of
from vidtrack.video.times.packet_times import PACKED, Stamps, coded_stamps, retimer, scale_of, with_next
from vidtrack.video.times.stated import flagged_order, rate_is_invented, stated_duration, stated_rate

_STREAMED = ("mpeg", "mpegts")
"""Containers in which few packets have a time stamp of their own."""

PEEK = 6
"""Pictures that are looked at to see whether time stamps are those of the order of coding."""

ERRORS = "crccheck+bitstream+buffer+careful+aggressive"
"""What decoders look for: check sums where a stream has them, wrong lengths, and what no encoder writes."""

_PATIENCE = 100
"""How often in a row reading is taken up again where a container is damaged."""

LOOKED_AGAIN = 100, 40
"""Pictures that are decoded for a second look at healthy ones: so many, and one for so many of the recording."""

AHEAD_BYTES = 32_000_000
"""Decoded pictures that wait while those before them are in use: as many as come while a tracker finds its targets."""

if get_level() is None:
    set_level(PANIC)  # prints nothing, but counts the errors that decoders log: for many their only word on damage


class DecodedVideo(Video):
    """A video, or a still picture as a video of one frame; the parameters are those of `reader.open_video`."""

    def __init__(
        self,
        path: str,
        threads: int = 1,
        rate: Fraction | None = None,
        stream: int | None = None,
        colour: Any = None,
    ) -> None:
        self.path, self._colour, self._asked = path, colour, (1, rate, stream, colour)
        self._threads = threads or os.cpu_count() or 1
        self._container = open_container(path)
        try:
            self._stream, others = picture_stream(self._container, path, stream)
            self._number = self._stream.index
            self._stream.codec_context.thread_count = threads
            self._stream.codec_context.thread_type = "AUTO"
            options = {"max_pixels": str(MOST_PIXELS)}
            if self._stream.codec_context.name == "h264" and self._container.format.name in _STREAMED:
                options["err_detect"] = ERRORS  # whose packets have no length before them
            self._stream.codec_context.options = options
            codec, kind = self._stream.codec_context, self._container.format.name
            self._bitstream = Bitstream(codec.name, codec.extradata)
            self._damage = DamageWatch(self._bitstream, self._packets_in_flight(threads), 2 if kind in _STREAMED else 1)
            self._order = CodingOrder(self._bitstream, alone=bool(codec.codec.intra_only))
            self._log = ReadingLog()
            if others:
                self._log.noted(others)
            self._codes: dict[int | None, str | None] = {}
            self._drained = self._ended = False  # by the decoder, and by who is given the pictures
            self._shown: Callable[[Any], int | None]
            self.mine: Callable[[int], bool] | None = None
            self.sent, self.tables = -1, Tables()
            self._pictures = self._decoded()
            self._source: Generator[Any] = self._pictures
            self._given: Generator[Any, None, Any] = self._source
            self._stamps: list[Stamps] | None = []  # of the packets that were sent before the first picture came
            self.first: list[tuple[Any, bool]] | None = list(
                islice(self._pictures, PEEK if codec.name in PACKED else 1)
            )
            if not self.first:
                raise VidtrackError(f"{path}: {why_no_picture(self._log.reason(self._damage))}")
            first = self.first[0][0]
            pictures = [picture for picture, _ in self.first]
            damaged = bool(self._damage.said)
            self._shown, self._zero = scale_of(self._container, codec, pictures, self._stamps or (), damaged=damaged)
            self._stamps = None
            self._size = first.width, first.height
            self._turn = self._orientation(first)
            self._own = own_stamps(path, kind)
            self._swapped = kind == "ser" and is_swapped(luma_reader(first.format)(first))
            self.info = self._described(first, rate)
            if rate is None and not self._own and rate_is_invented(self._container, self._stream):
                self._log.noted("a stream of pictures that states no rate: 25 a second assumed; give rate")
        except BaseException:
            self._container.close()
            raise

    def close(self) -> None:
        """Release the file; frames that were given become invalid."""
        self.first = None
        self._given.close()
        self.rest()
        self._container.close()

    def rest(self) -> None:
        """Decode no more: one of the decoder's threads that logs while its context is freed would wait for ever."""
        self._source.close()  # a thread or process that reads ahead ends with it
        if not self._drained:
            self._stream.codec_context.flush_buffers()
        self._pictures.close()

    def _packets_in_flight(self, threads: int) -> int:
        """How many packets the decoder may be at work on: one a thread, where its threads take whole pictures."""
        if not self._stream.codec_context.codec.capabilities & Capabilities.frame_threads:
            return 1
        return threads or 16

    @property
    def account(self) -> ReadAccount:
        """How the reading went; complete once `frames` has come to its end."""
        return self._log.account(self.info, self._damage, ended=self._ended)

    def look_again(self, indices: Sequence[int]) -> set[int]:
        """As `Video.look_again`: by other endings of their packets."""
        if not indices:
            return set()
        stamps, n = np.array(self._log.packets), len(self._log.packets)
        flagged, most = stamps[self._log.corrupt].tolist(), LOOKED_AGAIN[0] + n // LOOKED_AGAIN[1]
        damaged = SecondLook(self.path, self._number, most, flagged).damaged(stamps[list(indices)].tolist())
        return set(np.flatnonzero(np.isin(stamps, list(damaged))).tolist()) - set(self._log.corrupt)

    def frames(
        self, *, ahead: bool = False, apart: bool = False, monitor: Monitor | None = None, targets: int = 0
    ) -> Iterator[Frame]:
        """As `Video.frames`; ahead: AHEAD_BYTES of pictures are decoded while those before them are in use."""
        if self.first is None:
            raise ValueError("frames() reads a recording once; open it again to read it again")
        codec, info = self._stream.codec_context, self.info
        framing = Framing(
            info,
            self._log,
            self._damage,
            start=self._zero,
            unit=self._stream.time_base,
            own=self._own,
            extradata=codec.extradata,
            guessed=self._container.format.name in _STREAMED,
        )
        opened = partial(DecodedVideo, self.path, *self._asked)
        if apart and (given := how_apart(codec, self.first[0][0], self._threads)):
            how = (opened, (info.height, info.width), np.uint8 if info.bits == 8 else np.uint16, AHEAD_BYTES, self.path)
            if given is levels_apart and monitor is not None and targets >= SPARE[codec.name]:
                self._given = frames_monitored(self, framing, monitor, *how)
                if (looked := (yield from self._given)) is not None:
                    framing.log = self._log = looked.log
                    framing.reported(looked.said)
                    monitor.taken(looked.seen)
                self._ended = True
                return
            if given is levels_apart:
                given = partial(given, here=self)
            else:
                self.first = None
            self._given = given(*how)
        else:
            self._given = as_by_one_thread(self, opened if self._threads > 1 else None, ahead=ahead or apart)
        yield from framing.frames(self._given)
        self._ended = True

    def levels(self, *, ahead: bool = False) -> Iterator[Levels]:
        """Levels of each picture, None for one of another size than the first, and what was found with it."""
        assert self.first is not None
        first, self.first = self.first, None
        (width, height), name, codes = self._size, "", self._codes
        if ahead:
            size = width * height * (3 if self.info.bits == 8 else 6) // 2
            self._source = read_ahead(self._pictures, max(1, AHEAD_BYTES // size))
        for picture, corrupt in chain(first, self._source):
            luma, pts = None, picture.pts
            if picture.width == width and picture.height == height:
                if picture.format.name != name:
                    name, read = picture.format.name, self._turn.applied(self._reader(picture))
                luma = read(picture)
                if self._swapped:
                    luma = luma.byteswap()
            code = codes.pop(pts, None) if codes and luma is not None else None
            yield luma, Stamped(self._shown(picture), corrupt, code, pts, self._order.of(picture))

    def reported(self) -> Report:
        """What was said of damage until now."""
        return Report(self._damage.said, self._damage.refused, self._log.could_not_read)

    def _decoded(self) -> Generator[tuple[Any, bool]]:
        """Pictures, packet by packet, past every packet that fails; and whether each is suspect of damage.

        Everything that may run in a thread of its own is in here: it changes nothing that `frames` reads but _codes.
        """
        codec, damage, fault = self._stream.codec_context, self._damage, self._bitstream.fault
        decode, tape, jpeg = codec.decode, codec.name == "dvvideo", codec.name in SHARED
        waits, late = LongWaits(self._container.format.name), set[int]()  # brought out by packets behind lost ones
        logged, _ = get_last_error()
        for packet, misplaced, broken in with_next(self._packets(), self._container.format.name):
            if packet.size:
                self.sent += 1
                if self.mine is not None and not self.mine(self.sent):
                    continue
                if jpeg:
                    self.tables.saw(packet)
                if misplaced and coded_stamps(self._container, codec):
                    late.update(self._order.waiting())
                waits.sent(packet)
                damage.sent(packet)
                self._order.sent(packet)
                if self._stamps is not None and not packet.is_discard:
                    self._stamps.append((packet.pts, packet.dts))
                if packet.is_corrupt:
                    damage.complained("a packet that the container marks as corrupt", alone=True)
                if wrong := misplaced or broken or (fault(packet) if fault else ""):
                    damage.complained(wrong, alone=True)
                if tape:
                    self._codes[packet.pts] = code_of_dv_packet(packet)
            before, last = get_last_error()  # since the decoder was last at work: its other threads, or the container
            if before != logged and last and last[1] == codec.name:
                damage.complained(last[2])
            refused = None
            try:
                pictures = decode(packet)
            except (av.error.FFmpegError, EOFError) as error:
                pictures, refused = [], error
            logged, last = get_last_error()
            if refused or logged != before:
                said = last[2] if last and logged != before else str(refused)
                damage.complained(said, refused=refused is not None)
                late.update(waits.odd.intersection(self._order.waiting()))
            for picture in pictures:
                yield picture, damage.may_be_damaged(picture) or picture.pts in late
        self._drained = True

    def _packets(self) -> Iterator[tuple[Any, str]]:
        """Packets of the picture stream, and what is wrong with their place in the file.

        Where the container is damaged, reading is taken up again behind it.
        """
        failures, rightly_timed, at_end = 0, retimer(self._container, self._stream), False
        while failures < _PATIENCE and not at_end:
            try:
                for packet in self._container.demux(self._stream):
                    failures, at_end = 0, not packet.size
                    yield packet, "" if at_end else rightly_timed(packet)
                return
            except av.error.FFmpegError as error:
                failures += 1
                self._log.broken_off(error)
            except IndexError:  # PyAV has no place for streams that damage makes appear
                failures += 1
                self._log.broken_off(ValueError("packets of a stream that its header does not name"))

    def _reader(self, picture: Any) -> Any:
        """What makes levels of pictures like this one."""
        if self._colour is None:
            return luma_reader(picture.format)
        from vidtrack.video.colour import colour_reader  # cv2, for colour alone

        return colour_reader(picture, self._stream.codec_context.name, self._colour, self.path)

    def _orientation(self, first: Any) -> Orientation:
        turn = orientation_of(first, self.path)
        if turn is None:
            self._log.noted(f"the file asks players to turn the picture by {first.rotation} degrees: not obeyed")
        elif turn.transposed and flagged_order(self._stream.codec_context, first) in ("top", "bottom"):
            self._log.noted("interlaced pictures that stand on their side: their fields are not taken apart")
        return turn or STORED

    def _described(self, first: Any, given: Fraction | None) -> VideoInfo:
        stream, codec = self._stream, self._stream.codec_context
        still = self._container.format.name.endswith("_pipe") or self._container.format.name == "image2"
        stated = rate_of(self._own) or exact_rate(stated_rate(self._container, stream))
        rate = given or stated
        pace = stated / rate
        duration = None if still or self._own else stated_duration(self._container, stream, stated)
        length = None if still else self._container.duration
        tick = TICK if self._own else float(stream.time_base * pace)
        codes = {} if still else embedded_timecodes(self._container, stream, first, self._codes.get(first.pts))
        bases = code_bases(self._container, codes)
        shown = ((first.pts or 0) - self._zero) * stream.time_base * pace
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
            bits=bits_of(first.format) if self._colour is None else colour_bits_of(first),
            field_order=turn.field_order(flagged_order(codec, first), first.height),
            timecodes=codes,
            code_bases=bases,
            n_frames_hint=stream.frames or None,
            length_hint=length and Fraction(length, 1_000_000) * pace,
            duration=duration and duration * pace,
            is_still=still,
            start=self._zero * stream.time_base,
            first_shown=shown,
            time=replace(base_from_labels(codes, stated, bases, float(shown)), rate=rate, tick=tick),
            pace=pace,
        )
