"""Several estimates of one clock."""

import numpy as np
import pytest

from vidtrack.timing.agreement import NOT_ESTIMATED, Timing, agreed
from vidtrack.timing.clock import Clock


def said(offset_s, sd_s, rate_ppm=0.0, rate_sd=100.0):
    """The estimate of a clock by a method, at its first sample."""
    return Timing(Clock(offset_s, rate_ppm), np.diag([sd_s**2, rate_sd**2]))


def test_two_that_are_equally_sure_meet_half_way_and_know_it_better():
    both = agreed({"a": said(0.010, 0.001, rate_sd=1e-3), "b": said(0.012, 0.001, rate_sd=1e-3)}, 0.0)
    assert both.timing.clock.offset_s == pytest.approx(0.011)
    assert both.timing.sd.offset_s == pytest.approx(0.001 / np.sqrt(2), rel=1e-3)
    assert set(both.used) == {"a", "b"}
    assert not both.contradicting


def test_the_motion_tells_the_offset_and_the_sound_the_rate():
    """Sound needs time to travel, always the same: over a minute it knows the rate fifty times as well as motion."""
    motion = said(0.0123, 0.0001, rate_ppm=30, rate_sd=50)
    sound = said(0.020, 1e-5, rate_ppm=50, rate_sd=0.5).doubted(0.009)
    both = agreed({"motion": motion, "sound": sound}, 60.0)
    assert both.timing.clock.rate_ppm == pytest.approx(50, abs=0.1)
    assert both.timing.clock.offset_s == pytest.approx(0.0123, abs=1e-4)
    assert both.timing.moved(60).sd.offset_s < 2e-4  # alone, the motion would know its end to 3 ms
    assert set(both.used) == {"motion", "sound"}


def test_one_that_contradicts_a_better_one_is_left_out_and_named():
    both = agreed({"sound": said(0.5, 0.01), "motion": said(0.01, 0.0001), "flash": said(0.012, 0.005)}, 0.0)
    assert both.timing.clock.offset_s == pytest.approx(0.01, abs=1e-5)
    assert ("motion", "sound") in both.contradicting
    assert ("flash", "sound") in both.contradicting
    assert both.used[0] == "motion"
    assert "sound" not in both.used


def test_who_does_not_tell_is_not_heard():
    one = agreed({"motion": said(0.01, 0.001), "sound": NOT_ESTIMATED}, 10.0)
    assert one.used == ("motion",)
    assert one.timing.clock.offset_s == pytest.approx(0.01)
    assert not agreed({"sound": NOT_ESTIMATED}, 10.0).timing.is_known


@pytest.mark.parametrize("apart", [0.0, 3.0])
def test_errors_are_as_large_as_is_said(apart):
    """Over many trials the combined offset is off by its own standard error, wherever it is held."""
    rng = np.random.default_rng(0)
    off = []
    for _ in range(400):
        told = {}
        for name, sd, rate in (("motion", 0.002, 60.0), ("sound", 0.006, 2.0), ("flash", 0.003, 90.0)):
            noise = rng.normal(size=2)
            told[name] = said(0.01 + sd * noise[0], sd, 40 + rate * noise[1], rate)
        timing = agreed(told, 30.0).timing.moved(apart)
        off.append((timing.clock.offset_s - 0.01 - 40e-6 * apart) / timing.sd.offset_s)
    assert np.mean(np.square(off)) == pytest.approx(1, abs=0.2)


def test_a_clock_moved_along_its_own_line_is_the_same_clock():
    here = said(0.01, 0.001, 50, 10)
    there = here.moved(100.0)
    assert there.clock.offset_s == pytest.approx(0.015)
    assert there.sd.offset_s == pytest.approx(np.hypot(0.001, 100 * 10e-6))
    back = there.moved(-100.0)
    assert back.covariance == pytest.approx(here.covariance)
