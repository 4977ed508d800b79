"""What brings a reference's times to the video's, and how finely they are written."""

import numpy as np
import pytest

from vidtrack.motion.lag import Lag
from vidtrack.motion.reference_clock import (
    no_common_time,
    offset_by_correlation,
    resolution_of,
    too_sparse,
    with_rounding,
)

T = np.arange(0, 20, 1 / 30)


def swing(t):
    return np.exp(-0.05 * t) * np.sin(2 * np.pi * 0.5 * t)


def test_a_record_that_counts_from_its_start_is_found_by_its_motion():
    offset, finding = offset_by_correlation(T - 2.5, swing(T), 36000 + T, swing(T))
    assert offset == pytest.approx(36002.5, abs=0.005)
    assert finding.code.startswith("reference-offset")


def test_a_record_at_rest_gives_no_offset():
    offset, finding = offset_by_correlation(T, 0 * T, 36000 + T, swing(T))
    assert np.isnan(offset)
    assert finding.level == "bad"


@pytest.mark.parametrize(
    ("reference", "cure"),
    [
        (36000 * 1.001 + T, "Set reference.offset_s: -36.0"),
        (T, "seems to count from its own start"),
        (40000 + T, "Put both on one clock"),
    ],
)
def test_records_that_share_no_time_are_told_what_is_likeliest(reference, cure):
    text, advice = no_common_time(reference, 36000 + T)
    assert "share no time" in text
    assert cure in advice


@pytest.mark.parametrize(
    ("off", "words"),
    [
        (3600, "one hour off"),
        (-7200, "2 hours off"),
        (86400 * 3, "another date, 3 days off"),
        (86400, "another date, one day off"),
        (86400 * 19000 + 3600, "one hour off, and of another date"),
    ],
)
def test_another_zone_or_date_is_named_with_the_offset_that_cures_it(off, words):
    text, advice = no_common_time(36000 + T + off + 2.5, 36000 + T)
    assert words in text
    assert advice == f"Set reference.offset_s: {-off}."


def test_no_hour_is_named_that_brings_nothing_together():
    assert "zone" not in no_common_time(36000 + T + 1800, 36000 + T)[0]
    assert "zone" not in no_common_time(T, 36000 + T)[0]


@pytest.mark.parametrize(
    ("times", "coincide", "step"),
    [
        (np.floor(T), True, 1.0),
        (np.arange(20.0), False, 1.0),
        (np.round(T, 2), False, 0.0),
        (np.round(T, 1), True, 0.1),
    ],
)
def test_only_whole_seconds_and_times_that_coincide_are_rounded(times, coincide, step):
    assert resolution_of(times, coincide) == step


def test_rounding_opens_the_interval_by_half_a_step():
    lag = with_rounding(Lag(0.486, 0.014, 0.459, 0.514, 1.0, (), 9), 1.0)
    assert lag.low < 0 < lag.high
    assert with_rounding(lag, 0.0) == lag


@pytest.mark.parametrize(
    ("reference", "unit"),
    [
        ((36000 + T) * 1e3, "milliseconds"),
        ((36000 + T) / 60, "minutes"),
        ((1_760_054_400 - 1_760_054_400 % 86400 + 36000 + T) * 1e3, "milliseconds"),
        (46354 + (36000 + T) / 86400, "days, as spreadsheets do"),
    ],
)
def test_times_in_another_unit_are_called_so(reference, unit):
    text, cure = no_common_time(reference, 36000 + T)
    assert f"seems to count in {unit}" in text
    assert cure == "Write the reference's times in seconds."


def test_a_reference_too_sparse_for_the_video_is_named_before_any_lag_is_sought():
    text, _ = too_sparse(T * 1e6, T)
    assert "a sample every 33333.3 s" in text
    assert "microseconds" in text
    assert too_sparse(T, T) is None
    text, _ = too_sparse(T[:1], T)
    assert "all samples of the reference have one time" in text
    assert "nan" not in text


@pytest.mark.parametrize("start", [0.0, 36054.25, 61234.25, 86399.25])
def test_the_hour_of_the_day_has_no_part_in_how_finely_times_are_written(start):
    assert resolution_of(start + np.arange(0, 20, 0.0125), coincide=False) == 0.0
