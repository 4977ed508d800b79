"""One video picture, and what is known of the recording that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.timing.timebase import TimeBase

Luma = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[Any]


class Coded(NamedTuple):
    """A picture's place in the order of coding, which says what it may be built on.

    number  of its packet
    group   of the key frame that its packet follows, by count
    key     it is built on no other picture
    alone   no other picture is built on it
    """

    number: int
    group: int
    key: bool
    alone: bool


class Frame(NamedTuple):
    """One picture of a video.

    index     0 for the first picture that was read, 1 for the next: a count of pictures, not of time
    time      s after the recording's first picture, exact, from the picture's own time stamp; not 0 for the first that
              is given where those before it could not be decoded
    luma      (height, width) uint8 or uint16, read only: a view of the decoder's own picture. It may be held over the
              next frames, but every one that is held keeps a whole picture in memory: copy the part that must last.
              Levels are as stored: 16 to 235 stays 16 to 235, and `bits` of the recording says how far they reach
    corrupt   the decoder found damage in it, or in a picture that it is built on
    timecode  the label that the frame itself carries (DV), None where it carries none
    coded     None where pictures are not built on each other, or nothing is known
    """

    index: int  # type: ignore[assignment]  # a column here, not tuple.index
    time: Fraction
    luma: Luma
    corrupt: bool
    timecode: str | None
    coded: Coded | None = None


@dataclass(frozen=True)
class VideoInfo:
    """What a recording says of itself.

    width, height  px of the frame buffer: the picture turned as a player turns it, its pixels as stored
    rate           exact frames a second; of variable-rate video the mean; as given by the user where the file is wrong
    sample_aspect  width of a pixel of the frame buffer over its height (8/9 for 720x480 tape); 1 where nothing is said.
                   Positions are in pixels as stored, never stretched by it
    rotation       degrees, anticlockwise, by which the stored picture was turned to give the frame buffer: 0, 90, ...
    mirrored       whether left and right were exchanged after that
    bits           levels reach from 0 to 2**bits - 1
    field_order    what the flags say: "progressive", "top" or "bottom" (the field that came first) or "unknown"
    timecodes      where a time code was found -> label of the first frame
    code_bases     where one was found -> labels a second, where the file says how its code counts
    n_frames_hint  how many pictures the container states; it is often wrong
    length_hint    s that the container states or that are estimated from it; for displays alone
    duration       s that the container states, None where it only estimates it; shows where a recording is cut off
    is_still       one picture, no time
    start          s, the time stamp of the recording's first picture on the container's scale, which its sound shares
    first_shown    s after `start`: the time of the first picture that could be decoded, most often 0
    time           from time stamps to seconds since midnight and labels
    pace           s that passed in front of the camera in a second of the file's own time stamps: 1, or 1/8 for 240
                   frames a second that are stored as 30. `rate`, `duration` and times of frames are of the former kind
    """

    width: int
    height: int
    rate: Fraction
    sample_aspect: Fraction = Fraction(1)
    rotation: int = 0
    mirrored: bool = False
    codec: str = ""
    pix_fmt: str = ""
    bits: int = 8
    field_order: str = "unknown"
    timecodes: dict[str, str] = field(default_factory=dict)
    code_bases: dict[str, Fraction] = field(default_factory=dict)
    n_frames_hint: int | None = None
    length_hint: Fraction | None = None
    duration: Fraction | None = None
    is_still: bool = False
    start: Fraction = Fraction(0)
    first_shown: Fraction = Fraction(0)
    time: TimeBase = field(default_factory=lambda: TimeBase(Fraction(25), Fraction(25)))
    pace: Fraction = Fraction(1)

    @property
    def n_expected(self) -> int | None:
        """About how many pictures there are, for a display of progress; MPEG program and transport streams and
        Matroska do not count theirs.
        """
        return self.n_frames_hint or (round(self.length_hint * self.rate) if self.length_hint else None)

    @property
    def stated_rate(self) -> Fraction:
        """Frames a second as the file states them, which is how its time code counts."""
        return self.rate * self.pace

    @property
    def shape(self) -> dict[str, Any]:
        """Size, shape of a pixel and turn of the picture, as records have them: other pictures are compared with it."""
        aspect = str(self.sample_aspect)
        return {"width": self.width, "height": self.height, "sample_aspect": aspect, "rotation": self.rotation}


BLANK = "the picture is blank"
"""How a problem of reading begins that says so."""


class ReadAccount(NamedTuple):
    """How a recording was read, from its first picture to its last.

    frames    pictures given
    lost      pictures that the time stamps, or the container, say should be there and are not
    corrupt   pictures given that the decoder found damaged (of `frames`)
    problems  what a person should know, one line each; empty when all is well
    """

    frames: int
    lost: int
    corrupt: int
    problems: tuple[str, ...]

    def after_tracking(self, *, measured: float, damaged: int) -> ReadAccount:
        """The account with what tracking showed: pictures in which targets are measured are not blank.

        measured  share of the samples in which targets were measured
        damaged   pictures that the decoder took for good and the tracker did not
        """
        kept = tuple(line for line in self.problems if not (measured and line.startswith(BLANK)))
        return self._replace(problems=kept, corrupt=self.corrupt + damaged)
