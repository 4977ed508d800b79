from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.time_column import Counting, counting_of, regular, seconds_from_cells
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
    labels = label_from_frame(frames, NTSC, drop)
    assert counting_of(labels.tolist(), frames * 1001 / 30000) == Counting(NTSC, drop)
    assert counting_of(labels.tolist(), frames / 30) == (None if drop else Counting(Fraction(30), False))


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
