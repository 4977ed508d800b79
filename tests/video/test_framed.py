from fractions import Fraction

import numpy as np

from vidtrack.timing.frame import VideoInfo
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.faults.account import ReadingLog
from vidtrack.video.faults.damage import DamageWatch
from vidtrack.video.framed import Framing
from vidtrack.video.processes.shares import Report, Stamped


def framing(own=(), codec="dvvideo"):
    info = VideoInfo(8, 4, Fraction(25), codec=codec)
    damage = DamageWatch(Bitstream("", None), 1)
    unit = Fraction(1, 100)
    return Framing(info, ReadingLog(), damage, start=40, unit=unit, own=own, extradata=None, guessed=False), damage


def given(*stamps, corrupt=()):
    return [(np.full((4, 8), k, np.uint8), Stamped(pts, k in corrupt, None, pts)) for k, pts in enumerate(stamps)]


def test_times_are_those_of_the_stamps_from_the_first_one_on_and_go_on_where_there_is_none():
    made, _ = framing()
    frames = list(made.frames(given(40, 44, None, 56)))
    assert [frame.time for frame in frames] == [0, Fraction(4, 100), Fraction(8, 100), Fraction(16, 100)]
    assert [frame.index for frame in frames] == [0, 1, 2, 3]
    assert list(made.log.times) == [0.0, 0.04, 0.08, 0.16]


def test_a_picture_whose_time_runs_backwards_is_damaged():
    made, _ = framing()
    assert [frame.corrupt for frame in made.frames(given(40, 44, 42, 48, corrupt=[3]))] == [False, False, True, True]
    assert list(made.log.corrupt) == [2, 3]


def test_stamps_of_the_format_itself_come_before_those_of_the_container():
    own = [Fraction(0), Fraction(1, 3), Fraction(2, 3)]
    assert [frame.time for frame in framing(own)[0].frames(given(40, 41, 42))] == own


def test_pictures_of_another_size_and_what_decoders_say_are_noted_and_are_no_frames():
    made, damage = framing()
    items = given(40, 44)
    items[1:1] = [(None, Stamped(42, False, None)), (None, Report("no end", 2, "cut"))]
    assert [frame.index for frame in made.frames(items)] == [0, 1]
    assert (damage.said, damage.refused, made.log.could_not_read) == ("no end", 2, "cut")
    assert any("of another size" in line for line in made.log.account(VideoInfo(8, 4, Fraction(25)), damage).problems)
