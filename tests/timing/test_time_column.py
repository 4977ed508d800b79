from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.time_column import FEWEST_LABELS, Counting, counting_of, regular, seconds_from_cells
from vidtrack.timing.timecode import label_from_frame

NTSC = Fraction(30000, 1001)


def test_numbers_are_seconds():
    times = seconds_from_cells(["36054.55", 36054.56, "", None])
    assert times.written == "seconds"
    assert times.seconds == pytest.approx([36054.55, 36054.56, np.nan, np.nan], nan_ok=True)


@pytest.mark.parametrize(("label", "second"), [("00:00:01:00", 1), ("10:00:59:15", 36059.5), ("10:00:59.15", 36059.5)])
def test_time_codes_count_frames(label, second):
    times = seconds_from_cells([label], Counting(Fraction(30), False))
    assert times.written == "time code"
    assert times.seconds[0] == pytest.approx(second)


def test_a_point_begins_decimals_where_some_exceed_the_frame_rate():
    times = seconds_from_cells(["10:00:59.15", "10:00:59.65"], Counting(NTSC, False))
    assert times.written == "ISO"
    assert times.seconds == pytest.approx([36059.15, 36059.65])


@pytest.mark.parametrize(
    "texts",
    [
        ["2026-01-31T10:00:59.500", "2026-01-31T10:01:00.000"],
        ["2026-01-31 10:00:59,500", "2026-01-31 10:01:00,000"],
        ["2026-01-31T10:00:59.5Z", "2026-01-31T10:01:00Z"],
        ["10:00:59.500", "10:01:00.000"],
    ],
)
def test_iso_times_count_from_midnight(texts):
    assert seconds_from_cells(texts).seconds == pytest.approx([36059.5, 36060])


def test_midnight_is_passed_in_every_way_of_writing():
    assert seconds_from_cells(["86399", "0.5"]).seconds.tolist() == [86399, 86400.5]
    assert seconds_from_cells(["2026-01-31T23:59:59", "2026-02-01T00:00:01"]).seconds.tolist() == [86399, 86401]
    assert seconds_from_cells(["23:59:59.0", "00:00:01.0"]).seconds.tolist() == [86399, 86401]


@pytest.mark.parametrize("drop", [False, True])
def test_the_video_s_own_labels_tell_how_they_count(drop):
    frames = 1_079_000 + np.arange(0, 3000, 10)
    labels = label_from_frame(frames, NTSC, drop).tolist()
    behind = 0.0 if drop else 1_079_000 * (1 / 30 - 1001 / 30000)
    assert counting_of(labels, frames * 1001 / 30000 + behind) == (NTSC, drop, pytest.approx(behind, abs=1e-9))
    assert counting_of(labels, frames / 30) == (None if drop else Counting(Fraction(30), False))


def test_time_codes_of_a_reference_are_read_on_the_run_s_scale():
    """The run began 100 s before its first located sample: by then, non-drop labels are 0.1 s behind."""
    frames = 1_081_620 + np.arange(3000, 6000, 10)
    time_s = 36054 + (frames - 1_081_620) * 1001 / 30000
    counting = counting_of(label_from_frame(frames, NTSC, False).tolist(), time_s)
    assert counting == (NTSC, False, pytest.approx(36054 - 1_081_620 * 1001 / 30000, abs=1e-6))
    assert seconds_from_cells(["10:00:54:00", "10:02:34:00"], counting).seconds == pytest.approx([36054.0, 36154.1])


def test_without_labels_nobody_can_count():
    assert counting_of(["", ""], [0, 1]) is None
    with pytest.raises(ValueError, match="the video has none"):
        seconds_from_cells(["10:00:59:15"])


def test_a_cell_that_is_no_time_is_named():
    with pytest.raises(ValueError, match=r"row 2 is 'noon'"):
        seconds_from_cells(["10:00:59.5", "noon"])


def test_the_thesis_s_rounded_times_are_an_even_clock():
    printed = np.round(36054.55 + 0.005 * np.arange(38), 2)
    assert np.diff(regular(printed)) == pytest.approx(np.full(37, 0.005), abs=2e-4)
    assert regular(np.arange(10.0)) is None
    assert regular([0, 0, 5, 5, 5, 6.0]) is None


def test_true_time_is_counted_where_zones_are_stated_and_summer_time_ends():
    cells = ["2026-10-25T02:59:59+02:00", "2026-10-25T02:00:00+01:00", "2026-10-25T02:00:01+01:00"]
    assert seconds_from_cells(cells).seconds.tolist() == [10799, 10800, 10801]


def test_hours_of_one_digit_are_read():
    assert seconds_from_cells(["9:59:59.5", "10:00:00"]).seconds.tolist() == [35999.5, 36000]


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        (["00:10", "00:11"], "hours and minutes or minutes and seconds"),
        (["0.5", "abc", "1.5"], "row 2 is 'abc': no seconds as above it"),
        (["0.5", "inf"], "row 2 is 'inf'"),
        (["10:00:59", "11"], "row 2 is '11': not seconds, time code"),
        (["2026-11-28", "2026-11-29"], "row 1 is '2026-11-28': not seconds"),
    ],
)
def test_what_may_be_read_in_two_ways_or_is_no_time_is_named(cells, says):
    with pytest.raises(ValueError, match=r"row|hours") as error:
        seconds_from_cells(cells)
    assert says in str(error.value)


def test_codes_that_never_count_as_far_as_the_video_s_are_of_another_rate():
    labels = [f"10:00:{s:02d}:{f:02d}" for s in range(10, 14) for f in range(30)]
    with pytest.raises(ValueError, match="count to frame 29 and the video's to 119"):
        seconds_from_cells(labels, Counting(Fraction(120), False))
    with pytest.raises(ValueError, match="another rate"):
        seconds_from_cells(labels[:FEWEST_LABELS], Counting(Fraction(120), False))
    assert seconds_from_cells(labels, Counting(Fraction(30), False)).seconds[1] == pytest.approx(36010 + 1 / 30)
    assert seconds_from_cells(labels[:30], Counting(Fraction(120), False)).written == "time code"  # too few to say


def test_frames_of_three_digits_are_labels():
    found = seconds_from_cells(["10:00:59:119", "10:01:00:000"], Counting(Fraction(120), False))
    assert found.written == "time code"
    assert found.seconds == pytest.approx([36059 + 119 / 120, 36060])
