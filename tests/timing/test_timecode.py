from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.timing.timecode import (
    Parts,
    Timecode,
    drops_of,
    exact_rate,
    frame_from_label,
    frame_from_parts,
    frames_in_day,
    label_from_frame,
    parse,
    parts_from_frame,
)

NTSC = Fraction(30000, 1001)
NTSC60 = Fraction(60000, 1001)
COUNTS = [
    (Fraction(24000, 1001), False),
    (Fraction(24), False),
    (Fraction(25), False),
    (NTSC, True),
    (NTSC, False),
    (Fraction(30), False),
    (Fraction(50), False),
    (NTSC60, True),
    (NTSC60, False),
    (Fraction(60), False),
]


def every_label_of_a_day(n: int, dropped: int) -> Parts:
    """By the words of the standard, not by arithmetic: write all labels, strike out those left out."""
    hour = np.indices((60, 60, n), np.int16).reshape(3, -1)
    hour = hour[:, ~((hour[0] % 10 != 0) & (hour[1] == 0) & (hour[2] < dropped))]
    hours = np.repeat(np.arange(24, dtype=np.int16), hour.shape[1])
    return Parts(hours, *(np.tile(part, 24) for part in hour))


@pytest.mark.parametrize(("rate", "drop"), COUNTS)
def test_the_whole_day_agrees_with_labels_written_out_one_by_one(rate, drop):
    day = every_label_of_a_day(round(rate), {30: 2, 60: 4}[round(rate)] if drop else 0)
    numbers = np.arange(len(day.frames))
    assert len(numbers) == frames_in_day(rate, drop)
    for counted, written in zip(parts_from_frame(numbers, rate, drop), day, strict=True):
        assert (counted == written).all()
    assert (frame_from_parts(day, rate, drop) == numbers).all()


@pytest.mark.parametrize(("rate", "drop"), COUNTS)
def test_text_of_hours_all_over_the_day_reads_back(rate, drop):
    day = frames_in_day(rate, drop)
    for first in (0, day // 3, day - 40_000):
        numbers = np.arange(first, first + 40_000)
        np.testing.assert_array_equal(frame_from_label(label_from_frame(numbers, rate, drop), rate, drop), numbers)


def test_drop_frame_has_as_many_labels_as_the_standard_says():
    assert frames_in_day(NTSC, True) == 2_589_408
    assert frames_in_day(NTSC) == 2_592_000


def test_drop_frame_leaves_out_two_labels_of_a_minute_but_none_of_the_tenth():
    assert label_from_frame([1799, 1800], NTSC, True).tolist() == ["00:00:59;29", "00:01:00;02"]
    assert label_from_frame([17981, 17982], NTSC, True).tolist() == ["00:09:59;29", "00:10:00;00"]


def test_drop_frame_keeps_near_the_clock_all_day():
    numbers = np.arange(0, frames_in_day(NTSC, True), 997)
    h, m, s, f = parts_from_frame(numbers, NTSC, True)
    clock = numbers / float(NTSC)
    assert np.abs(3600 * h + 60 * m + s + f / float(NTSC) - clock).max() < 0.15
    h, m, s, f = parts_from_frame(frames_in_day(NTSC) - 1, NTSC)
    assert 3600 * h + 60 * m + s - frames_in_day(NTSC) / float(NTSC) == pytest.approx(-86.4, abs=1.1)


@settings(max_examples=50)
@given(st.sampled_from(COUNTS), st.integers(0, 10_000_000))
def test_counting_on_a_frame_moves_the_label_on_by_one(count, frame):
    rate, drop = count
    now = Timecode(frame, rate, drop)
    assert parse(str(now), rate, drop).frame == frame % frames_in_day(rate, drop)
    assert (now + 1).seconds - now.seconds == 1 / rate


def test_past_midnight_the_label_wraps_and_the_time_runs_on():
    late = parse("23:59:59:24", Fraction(25)) + 1
    assert str(late) == "00:00:00:00"
    assert late.seconds == 86400


@pytest.mark.parametrize("text", ["10:00:59:15", "10:00:59.15", " 10:00:59:15 "])
def test_the_ways_of_writing_a_label_mean_the_same(text):
    assert parse(text, Fraction(30)).frame == (36000 + 59) * 30 + 15


def test_a_semicolon_says_drop_frame_and_a_colon_does_not():
    assert parse("10:00:54;00", NTSC).drop
    assert not parse("10:00:54:00", NTSC).drop
    assert parse("10:00:54:00", NTSC, drop=True).drop
    apart = parse("10:00:54:00", NTSC).seconds - parse("10:00:54;00", NTSC).seconds
    assert float(apart) == pytest.approx(36.04, abs=0.01)  # the 36 s that careless packages lose at ten o'clock


def test_ten_o_clock_drop_frame_is_exact():
    assert parse("10:00:00;00", NTSC).seconds == Fraction(1_078_920 * 1001, 30_000)


@pytest.mark.parametrize(
    ("text", "rate", "said"),
    [
        ("10:01:00;01", NTSC, "leaves out 2 labels"),
        ("10:01:00;03", NTSC60, "leaves out 4 labels"),
        ("24:00:00:00", Fraction(25), "24:00:00:00"),
        ("10:00:00:25", Fraction(25), "at 25 frames a second"),
        ("10:60:00:00", Fraction(25), "does not exist"),
        ("10:00:60:00", Fraction(25), "10:00:60:00 does not exist"),
        ("ten o'clock", Fraction(25), "is not a time code"),
        ("10:00:00", Fraction(25), "is not a time code"),
        ("10:00:00;00", Fraction(25), "not for 25"),
    ],
)
def test_what_is_no_time_code_is_named(text, rate, said):
    with pytest.raises(ValueError, match=said):
        parse(text, rate)


def test_a_drop_frame_label_in_a_recording_that_does_not_drop_is_refused():
    with pytest.raises(ValueError, match="does not count in drop-frame"):
        parse("10:00:00;02", NTSC, drop=False)


def test_one_wrong_label_among_many_is_the_one_named():
    labels = ["00:00:59;29", "00:01:00;02", "00:02:00;00"]
    with pytest.raises(ValueError, match="00:02:00;00"):
        frame_from_label(labels, NTSC, True)
    with pytest.raises(ValueError, match="not all of these"):
        frame_from_label(["00:00:59;29", "00-01-00;02"], NTSC, True)


def test_drop_frame_at_a_rate_without_it_is_refused():
    with pytest.raises(ValueError, match=r"29\.97"):
        drops_of(Fraction(24000, 1001), True)
    with pytest.raises(ValueError, match=r"29\.97"):
        Timecode(0, Fraction(30), True)


@pytest.mark.parametrize(
    ("given_rate", "exact"),
    [
        (29.97, NTSC),
        (Fraction(2997, 100), NTSC),
        (Fraction(19001, 634), NTSC),
        (23.976, Fraction(24000, 1001)),
        (23.98, Fraction(24000, 1001)),
        ("59.94", NTSC60),
        (25.0, Fraction(25)),
        (119.88, Fraction(120000, 1001)),
        (Fraction(15), Fraction(15)),
        (Fraction(1003, 100), Fraction(1003, 100)),
    ],
)
def test_a_rounded_rate_stands_for_the_exact_one(given_rate, exact):
    assert exact_rate(given_rate) == exact


def test_a_rate_of_nothing_is_refused():
    with pytest.raises(ValueError, match="positive"):
        exact_rate(0)


def test_high_rates_take_three_digits():
    assert str(Timecode(119, Fraction(120))) == "00:00:00:119"
    assert frame_from_label(np.array(["00:00:00:119"]), Fraction(120)) == 119


def test_labels_keep_the_shape_of_the_numbers():
    assert label_from_frame(np.zeros((2, 3), int), Fraction(25)).shape == (2, 3)
    assert frame_from_label(np.full((2, 3), "00:00:01:00"), Fraction(25)).shape == (2, 3)
    assert label_from_frame(0, Fraction(25)).shape == ()


@pytest.mark.parametrize("labels", [24, 30, 60, 120, 480, 960])
def test_rates_that_are_written_rounded_are_ntscs_however_high(labels):
    assert exact_rate(round(labels * 1000 / 1001, 2)) == Fraction(labels * 1000, 1001)
