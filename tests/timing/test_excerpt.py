"""From start to end, both included, by frame number or time code."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.timing.excerpt import between
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


def test_nothing_asked_for_is_everything():
    assert indices(PLAIN, None, None) == list(range(100))


def test_nothing_behind_the_end_is_read():
    read = []

    def frames():
        for k in range(100):
            read.append(k)
            yield Frame(k, k / RATE, np.zeros((8, 8), np.uint8), False, None)

    assert len(list(between(frames(), PLAIN, None, 8, where="detect"))) == 9
    assert read[-1] == 9


def test_where_nothing_lies_between_that_is_said():
    with pytest.raises(VidtrackError, match=r"^detect.start: no .* between 100 and its end: it has frames 0 to 99\."):
        indices(PLAIN, 100, None)
    with pytest.raises(VidtrackError, match=r"it has frames 0 \(00:00:00;00\) to 99 \(00:00:03;09\)"):
        indices(CODED, "09:00:00;00", "09:00:01;00")


def test_an_end_before_the_start_and_a_number_below_0_are_no_stretch():
    with pytest.raises(VidtrackError, match=r"detect.end: 4 lies before start, 5"):
        indices(PLAIN, 5, 4)
    with pytest.raises(VidtrackError, match=r"detect.start: -5 is no frame: frames are counted from 0"):
        indices(PLAIN, -5, None)


def test_a_time_code_is_refused_where_the_recording_has_none_or_it_is_no_time_code():
    with pytest.raises(
        VidtrackError, match=r"detect.start: '00:00:01:00' is a time code, but the recording carries none"
    ):
        indices(PLAIN, "00:00:01:00", None)
    with pytest.raises(VidtrackError, match=r"^detect.end: "):
        indices(CODED, None, "half past")
