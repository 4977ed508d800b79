"""From start to end, both included, by frame number or time code."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.labelling.excerpt import between
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import Anchor, TimeBase

RATE = Fraction(30000, 1001)
CODED = VideoInfo(8, 8, RATE, time=TimeBase(RATE, RATE, drop=True, anchors=(Anchor(0.0, 0),), source="test"))
PLAIN = VideoInfo(8, 8, RATE)


def indices(info, start, end):
    frames = (Frame(k, k / RATE, np.zeros((8, 8), np.uint8), False, None) for k in range(100))
    return [f.index for f in between(frames, info, start, end, where="detect")]


def test_frame_numbers_are_both_included():
    assert indices(PLAIN, 5, 8) == [5, 6, 7, 8]
    assert indices(PLAIN, None, 2) == [0, 1, 2]
    assert indices(PLAIN, 97, None) == [97, 98, 99]


def test_time_codes_name_the_frames_that_carry_them():
    assert indices(CODED, "00:00:01;00", "00:00:01;02") == [30, 31, 32]
    assert indices(CODED, "00:00:03;08", None) == [98, 99]


def test_a_time_code_is_refused_where_the_recording_has_none_or_it_is_no_time_code():
    with pytest.raises(
        VidtrackError, match=r"detect.start: '00:00:01:00' is a time code, but the recording carries none"
    ):
        indices(PLAIN, "00:00:01:00", None)
    with pytest.raises(VidtrackError, match=r"^detect.end: "):
        indices(CODED, None, "half past")
