"""Frames made of the levels that a decoder gives: the time of each, and which are pieces of others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from typing import Any

from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.video.faults.account import ReadingLog
from vidtrack.video.faults.damage import DamageWatch
from vidtrack.video.faults.picture_end import PictureEnds, WholePictures, ends_are_checked
from vidtrack.video.processes.shares import Given, Report
from vidtrack.video.times.packet_times import Forward


class Framing:
    """Makes frames, and notes in `log` and `damage` what is to be known of the reading.

    info   of the recording; start: the stamp of its first picture; unit: s of the container's time from stamp to stamp
    own    times of its pictures, s, where its format has stamps of its own, or None
    extradata  of the decoder; guessed: as of `Forward`
    """

    def __init__(
        self,
        info: VideoInfo,
        log: ReadingLog,
        damage: DamageWatch,
        *,
        start: int,
        unit: Fraction,
        own: Sequence[Any] | None,
        extradata: bytes | None,
        guessed: bool,
    ) -> None:
        self.log, self._damage, self._info, self._own, self._start = log, damage, info, own, start
        self._ticks, self._second = (unit * info.pace).as_integer_ratio()
        self._forward = Forward(1 / info.rate, guessed=guessed)
        self._ends = PictureEnds(info.bits) if ends_are_checked(info.codec, extradata) else None
        self._whole = WholePictures(info.codec if not info.is_still else "")

    def reported(self, said: Report) -> None:
        """The decoder has said so until now."""
        self._damage.said, self._damage.refused, self.log.could_not_read = said

    def frames(self, given: Iterable[Given]) -> Iterator[Frame]:
        """The frames of what a decoder gives."""
        log, own, ends, start, pace = self.log, self._own, self._ends, self._start, self._info.pace
        step = 1 / self._info.rate
        time, index, hurt = -step, 0, False
        for luma, what in given:
            if isinstance(what, Report):
                self.reported(what)
                continue
            pts, corrupt, code, packet, coded = what
            if own and pts is not None and 0 <= pts - start < len(own):
                time = own[pts - start] * pace
            else:
                time = Fraction((pts - start) * self._ticks, self._second) if pts is not None else time + step
            if luma is None:
                log.other_size()
                continue
            corrupt |= ends is not None and not corrupt and ends.spoilt(luma)
            time, backwards = self._forward(time, damaged=hurt)
            corrupt |= backwards
            hurt |= corrupt
            luma = self._whole(luma, corrupt=corrupt)
            log.picture(index, time.numerator / time.denominator, luma, corrupt, packet)
            yield Frame(index, time, luma, corrupt, code, coded)
            index += 1
