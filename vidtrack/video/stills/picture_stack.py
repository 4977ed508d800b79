"""A recording that is stored as single pictures, each of which is read when its turn comes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, Luma, ReadAccount, VideoInfo
from vidtrack.timing.timebase import TimeBase
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.faults.account import ReadingLog
from vidtrack.video.faults.damage import DamageWatch
from vidtrack.video.processes.read_ahead import read_ahead
from vidtrack.video.recording import Monitor, Video

ASSUMED_RATE = Fraction(25)
"""ASSUME: pictures a second where neither the files nor the user say."""

NO_RATE = "pictures that carry no times: 25 a second assumed; give rate"

LINES_AT_MOST = 3
"""Pictures that cannot be read of which the reason is given."""

AHEAD = 8
"""Pictures that are read while those before them are in use."""


@dataclass(frozen=True)
class StackInfo:
    """What the first picture says of all; rate: pictures a second where the files state it; still: there is one."""

    width: int
    height: int
    bits: int
    codec: str
    pix_fmt: str
    rate: Fraction | None = None
    rotation: int = 0
    mirrored: bool = False
    still: bool = False


class Stack(Protocol):
    """Pictures by their place.

    numbers  of the pictures, rising; a number that is left out is a picture that is missing
    notes    what a user should know of the files
    """

    path: str
    info: StackInfo
    numbers: list[int]
    notes: list[str]

    def picture(self, place: int) -> tuple[Luma, bool]:
        """Its levels, (height, width), and whether it is damaged; VidtrackError where it cannot be read."""
        ...


class PictureStack(Video):
    """A stack of pictures as a recording; `stack` gives each by its place."""

    def __init__(self, stack: Stack, rate: Fraction | None) -> None:
        self.stack, self.path = stack, stack.path
        self._log, self._used, self._ended = ReadingLog(), False, False
        for note in stack.notes:
            self._log.noted(note)
        own = stack.info
        if not own.width * own.height:
            raise VidtrackError(f"{self.path}: its header gives pictures of {own.width} x {own.height}. Copy it again.")
        if rate is None and own.rate is None and not own.still:
            self._log.noted(NO_RATE)
        stated = own.rate or ASSUMED_RATE
        rate = rate or stated
        self.info = VideoInfo(
            width=own.width,
            height=own.height,
            rate=rate,
            rotation=own.rotation,
            mirrored=own.mirrored,
            codec=own.codec,
            pix_fmt=own.pix_fmt,
            bits=own.bits,
            field_order="progressive",
            n_frames_hint=len(stack.numbers),
            time=TimeBase(rate, rate),
            pace=stated / rate,
            is_still=own.still,
        )

    def close(self) -> None:
        """Nothing stays open."""

    def frames(
        self, *, ahead: bool = False, apart: bool = False, monitor: Monitor | None = None, targets: int = 0
    ) -> Iterator[Frame]:
        """As `Video.frames`."""
        if self._used:
            raise ValueError("frames() reads a recording once; open it again to read it again")
        self._used = True
        each = read_ahead(self._pictures(), AHEAD) if ahead or apart else self._pictures()
        for index, (number, luma, corrupt) in enumerate(each):
            time = (number - self.stack.numbers[0]) / self.info.rate
            self._log.picture(index, float(time), luma, corrupt)
            yield Frame(index, time, luma, corrupt, None)
        self._ended = True

    @property
    def account(self) -> ReadAccount:
        """As `Video.account`."""
        return self._log.account(self.info, DamageWatch(Bitstream("", None), 1), ended=self._ended)

    def _pictures(self) -> Iterator[tuple[int, Luma, bool]]:
        unread, size = 0, (self.info.height, self.info.width)
        for place, number in enumerate(self.stack.numbers):
            try:
                luma, corrupt = self.stack.picture(place)
            except VidtrackError as error:
                unread += 1
                if unread <= LINES_AT_MOST:
                    self._log.noted(f"a picture cannot be read: {error}")
                continue
            if luma.shape != size:
                self._log.other_size()
                continue
            luma.setflags(write=False)
            yield number, luma, corrupt
        if unread > LINES_AT_MOST:
            self._log.noted(f"{unread} pictures in all cannot be read")
