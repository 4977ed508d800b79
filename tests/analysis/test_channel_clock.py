"""How another instrument's clock is joined to the video's, and what is said where it is not."""

import numpy as np
import pytest

from tests.timing.test_pulses import exposed, sampled
from vidtrack.analysis.channel_clock import begun_on_run, by_lamp, by_motion, by_offset

T = np.arange(0, 20, 1 / 60)


def motion(t):
    return np.sin(1.9 * t) * np.exp(-0.05 * t) + 0.3 * np.sin(4.1 * t + 1)


def test_exposures_begin_half_a_picture_before_their_middle_on_the_clock_that_was_found_for_the_camera():
    clocks = {"cameras": {"cam2": {"offset_s": 0.5, "rate_ppm": 1000.0}}}
    located = {"time": {"shift_s": {"cam2": 3600.0}}, "clocks": clocks}
    middle = np.arange(5) / 25
    expected = 3600.5 + middle - 0.02
    found = begun_on_run(middle, located, "cam2")
    assert found[0] == pytest.approx(expected[0], abs=0.001 * 3700)
    assert np.diff(found).tolist() == pytest.approx([1.001 / 25] * 4)
    assert begun_on_run(middle, {}, "cam1") == pytest.approx(middle - 0.02)


def test_an_offset_is_added_as_given():
    found = by_offset(T, 5.0)
    assert (found.times - T).tolist() == pytest.approx([5.0] * T.size)
    assert (found.offset_sd, found.findings) == (0.0, [])


def test_a_lamp_joins_the_clocks_by_the_camera_that_sees_it():
    t, volts = sampled(-7.5)
    dark = np.arange(0, 10, 1 / 30), np.full(300, 30.0)
    found = by_lamp(t, volts, {"cam1": dark, "cam2": exposed()}, "led")
    assert found.record["camera"] == "cam2"
    assert found.record["offset_s"] == pytest.approx(-7.5, abs=0.003)
    assert found.times == pytest.approx(t - 7.5, abs=0.004)
    assert found.findings == []


def test_cameras_that_contradict_each_other_are_a_finding():
    t, volts = sampled(0.0)
    times, level = exposed()
    found = by_lamp(t, volts, {"cam1": (times, level), "cam2": (times + 0.4, level)}, "led")
    assert [f.code for f in found.findings] == ["lamp-contradicted"]


def test_a_lamp_that_is_not_seen_leaves_the_times_and_says_so():
    t, volts = sampled(0.0)
    found = by_lamp(t, volts, {}, "led")
    assert [(f.level, f.code) for f in found.findings] == [("bad", "lamp-not-seen")]
    assert np.isnan(found.offset_sd)
    assert found.record["offset_s"] is None


@pytest.mark.parametrize("start", [0.0, -36000.0])
def test_a_motion_that_both_measure_joins_the_clocks_whatever_scale_and_bias(start):
    rng = np.random.default_rng(2)
    own = np.arange(2.0, 18.0, 0.01)
    volts = 3.0 - 0.7 * motion(own) + rng.normal(0, 0.003, own.size)
    found = by_motion(own + start, volts, T, motion(T) + rng.normal(0, 0.003, T.size), "pot", "t1.x")
    assert found.record["offset_s"] == pytest.approx(-start, abs=0.002)
    assert abs(found.record["offset_s"] + start) < 4 * found.offset_sd < 0.01


def test_records_that_do_not_show_one_motion_are_not_joined():
    rng = np.random.default_rng(3)
    found = by_motion(T, rng.normal(0, 1, T.size), T, motion(T), "pot", "t1.x")
    assert [(f.level, f.code) for f in found.findings] == [("bad", "channels-not-joined")]
    few = by_motion(T[:4], T[:4], T, motion(T), "pot", "t1.x")
    assert [f.code for f in few.findings] == ["channels-not-joined"]
