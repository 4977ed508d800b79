from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.timing.timebase import (
    LEAST_SCATTER,
    Anchor,
    TimeBase,
    base_from_labels,
    code_rate_of,
    grid_rate,
    scatters,
    time_base,
)
from vidtrack.timing.timecode import parse

NTSC = Fraction(30000, 1001)
TEN = parse("10:00:00;00", NTSC)


def stamps(n: int, rate: Fraction, tick: float = 0.0) -> np.ndarray:
    times = np.arange(n) / float(rate)
    return np.round(times / tick) * tick if tick else times


def test_frames_count_on_from_the_code_of_the_first():
    base = time_base(NTSC, TEN)
    times = stamps(40, NTSC)
    assert base.labels(times)[[0, 29, 30]].tolist() == ["10:00:00;00", "10:00:00;29", "10:00:01;00"]
    np.testing.assert_allclose(base.seconds(times), float(TEN.seconds) + times, atol=1e-9)


def test_second_fields_are_half_a_frame_later():
    base = time_base(NTSC, TEN)
    times = stamps(5, NTSC)
    np.testing.assert_allclose(base.seconds(times, 0.5) - base.seconds(times), 0.5 * 1001 / 30000, atol=1e-10)


def test_without_time_code_seconds_count_from_the_first_frame_and_there_are_no_labels():
    base = time_base(Fraction(25))
    np.testing.assert_array_equal(base.seconds([0.0, 0.04, 0.08]), [0.0, 0.04, 0.08])
    assert base.labels([0.0, 0.04]).tolist() == ["", ""]
    assert base.timecode(0.0) is None


@settings(max_examples=40)
@given(st.sampled_from([24, 25, 30, 50, 60]), st.booleans(), st.integers(0, 100_000))
def test_stamps_rounded_to_a_millisecond_do_no_harm(n, ntsc, first):
    rate = Fraction(n * 1000, 1001) if ntsc else Fraction(n)
    base = time_base(rate, parse("01:00:00:00", rate))
    exact = (first + np.arange(50)) / float(rate)
    rounded = np.round(exact, 3)
    np.testing.assert_array_equal(base.seconds(rounded), base.seconds(exact))
    assert (base.labels(rounded) == base.labels(exact)).all()


def test_cameras_that_share_a_label_share_the_very_same_time():
    late = time_base(NTSC, TEN + 7)
    early = time_base(NTSC, TEN)
    times = stamps(100, NTSC)
    np.testing.assert_array_equal(early.seconds(times)[7:], late.seconds(times)[:-7])


def test_a_lost_frame_leaves_its_gap():
    times = np.delete(stamps(20, NTSC, 0.001), 8)
    base = time_base(NTSC, TEN).fitted(times)
    assert base.constant
    steps = np.diff(base.seconds(times)) * float(NTSC)
    np.testing.assert_allclose(steps, [1] * 7 + [2] + [1] * 10, atol=1e-6)
    assert base.labels(times)[8] == "10:00:00;09"


def test_a_rate_that_varies_takes_the_stamps_as_they_are():
    times = np.cumsum([0, 0.033, 0.05, 0.033, 0.041, 0.033, 0.07, 0.036, 0.033, 0.058])
    base = time_base(NTSC, TEN).fitted(times)
    assert not base.constant
    np.testing.assert_allclose(base.seconds(times) - float(TEN.seconds), times, atol=1e-9)
    assert base.labels(times)[0] == "10:00:00;00"


def test_a_wrongly_stated_rate_gives_way_to_the_stamps():
    assert grid_rate(stamps(500, Fraction(30), 0.001), Fraction(25)) == 30
    assert grid_rate(stamps(500, NTSC, 0.001), Fraction(60000, 1001)) == NTSC  # fields counted as frames
    assert grid_rate(stamps(200_000, Fraction(2996, 100), 0.001), NTSC) == Fraction(2996, 100)


def test_nearly_the_same_rates_are_told_apart_in_a_long_recording():
    assert grid_rate(stamps(2_000, NTSC, 0.001), Fraction(30)) == NTSC
    assert grid_rate(stamps(2_000, Fraction(30), 0.001), NTSC) == 30


def test_jumps_of_the_code_hold_from_their_anchor_on():
    base = TimeBase(NTSC, NTSC, True, (Anchor(0.0, TEN.frame), Anchor(10 / float(NTSC), TEN.frame + 1000)))
    labels = base.labels(stamps(12, NTSC, 0.001))
    assert labels[[0, 9]].tolist() == ["10:00:00;00", "10:00:00;09"]
    assert labels[[10, 11]].tolist() == ["10:00:33;10", "10:00:33;11"]


def test_a_recording_played_at_half_speed_counts_half_as_fast():
    base = TimeBase(NTSC, NTSC, True, (Anchor(0.0, TEN.frame, speed=0.5),))
    times = stamps(5, NTSC)
    np.testing.assert_allclose(base.seconds(times) - float(TEN.seconds), times / 2, atol=1e-9)
    np.testing.assert_allclose(base.seconds(times, 0.5) - base.seconds(times), 0.25 / float(NTSC), atol=1e-9)
    assert base.labels(times)[[0, 2, 4]].tolist() == ["10:00:00;00", "10:00:00;01", "10:00:00;02"]


def test_a_camera_off_the_beat_of_the_code_keeps_its_distance_to_it():
    base = TimeBase(NTSC, NTSC, True, (Anchor(0.0, TEN.frame, phase=0.37),))
    assert base.seconds(0.0) - float(TEN.seconds) == pytest.approx(0.37 / float(NTSC), abs=1e-10)
    assert base.labels(0.0) == "10:00:00;00"


def test_fast_video_repeats_its_labels():
    base = time_base(Fraction(240), parse("10:00:00:00", code_rate_of(Fraction(240))))
    assert base.code_rate == 30
    labels = base.labels(stamps(17, Fraction(240)))
    assert labels[[0, 7, 8, 15, 16]].tolist() == [f"10:00:00:0{k}" for k in (0, 0, 1, 1, 2)]
    np.testing.assert_allclose(np.diff(base.seconds(stamps(17, Fraction(240)))), 1 / 240, atol=1e-10)


def test_the_time_of_a_code_is_found_back():
    base = TimeBase(NTSC, NTSC, True, (Anchor(0.0, TEN.frame), Anchor(5.0, TEN.frame + 3000)))
    for time in (0.0, 1.5, 4.9, 5.0, 9.0):
        at = round(time * float(NTSC)) / float(NTSC)
        assert base.time_of(base.timecode(at)) == pytest.approx(at, abs=0.02)
    with pytest.raises(ValueError, match="without time code"):
        time_base(NTSC).time_of(TEN)


@pytest.mark.parametrize("rate", [NTSC, Fraction(24000, 1001), Fraction(60000, 1001)])
def test_non_drop_code_begins_as_its_label_reads_and_goes_on_in_true_seconds(rate):
    """A logger set by the same clock has 36054.5 there; counted from midnight the label would be 36090.05 s."""
    n = round(rate)
    base = time_base(rate, parse(f"10:00:54:{n // 2:02d}", rate))
    times = stamps(100 * n, rate)
    np.testing.assert_allclose(base.seconds(times), 36054.5 + times, atol=1e-6)
    assert base.timecode(times[50]) == parse(str(base.labels(times[50])), rate)
    assert base.time_of(base.timecode(times[50])) == pytest.approx(times[50], abs=1e-6)


@pytest.mark.parametrize("label", ["10:00:54;15", "10:00:54:15"])
def test_drop_frame_and_whole_rates_are_counted_from_midnight_as_ever(label):
    rate = NTSC if ";" in label else Fraction(25)
    code = parse(label, rate)
    assert code.clock == code.seconds
    assert float(time_base(rate, code).seconds(0.0)) == pytest.approx(float(code.seconds), abs=1e-9)


def test_an_unreadable_label_gives_way_to_the_next_and_a_gop_from_zero_is_no_code():
    assert base_from_labels({"tmcd": "rubbish", "sei": "01:00:00:00"}, Fraction(25)).source == "sei"
    assert base_from_labels({"gop": "00:00:00:01"}, Fraction(25)).source == "none"
    assert base_from_labels({"gop": "01:00:00:01"}, Fraction(25)).source == "gop"


def test_unknown_time_stays_unknown():
    base = time_base(NTSC, TEN)
    assert np.isnan(base.seconds([0.0, np.nan])[1])
    assert base.labels([0.0, np.nan]).tolist() == ["10:00:00;00", ""]


def test_a_time_lapse_of_less_than_a_picture_a_second_has_labels():
    rate = Fraction(1, 10)
    base = time_base(rate, parse("10:00:00:00", code_rate_of(rate)))
    times = stamps(3, rate)
    np.testing.assert_allclose(base.seconds(times), 36000 + times, atol=1e-9)
    assert base.labels(times).tolist() == ["10:00:00:00", "10:00:10:00", "10:00:20:00"]


@pytest.mark.parametrize("tick", [1e-6, 1 / 90_000])
def test_stamps_finer_than_they_scatter_are_the_time(tick):
    true = np.arange(200) / 30 + np.random.default_rng(0).uniform(-0.2, 0.2, 200) / 30
    times = np.round(true / tick) * tick
    base = TimeBase(Fraction(30), Fraction(30), tick=tick).fitted(times)
    assert not base.constant
    np.testing.assert_allclose(base.seconds(times), times, atol=1e-9)


@pytest.mark.parametrize("coarse", [1e-3, 1 / 600, 1 / 1200])
def test_stamps_that_a_coarser_container_rounded_once_lie_on_their_grid(coarse):
    times = np.round(np.round(stamps(400, NTSC) / coarse) * coarse * 90_000) / 90_000
    assert TimeBase(NTSC, NTSC, tick=1 / 90_000).fitted(times).constant
    assert TimeBase(NTSC, NTSC, tick=1e-3).fitted(stamps(400, NTSC, 0.001)).constant


@pytest.mark.parametrize(
    ("rate", "labels"),
    [
        (Fraction(1, 2), 30),
        (Fraction(7, 10), 30),
        (Fraction(1), 1),
        (Fraction(25, 2), 25),
        (Fraction(15, 2), 30),
        (Fraction(15), 15),
        (Fraction(2983, 100), NTSC),
        (Fraction(11987, 100), 30),
        (NTSC, NTSC),
    ],
)
def test_time_code_counts_by_a_rate_that_time_codes_have(rate, labels):
    rate_of_code = code_rate_of(rate)
    assert rate_of_code == labels or abs(rate_of_code / labels - 1) < 0.002
    ten = parse("10:00:00:00", rate_of_code)
    assert time_base(rate, ten).seconds(0.0) == pytest.approx(36000, abs=1e-6)


def test_a_first_stamp_that_is_late_by_less_than_a_scatter_makes_none():
    """All others are early by as much beside it; it alone is off."""
    rate = Fraction(30)
    times = np.arange(40) / 30
    times[0] += 0.75 * LEAST_SCATTER / 30
    assert not scatters(times, rate, 1e-7)
    times[0] += 0.75 * LEAST_SCATTER / 30
    assert scatters(times, rate, 1e-7)
