import numpy as np
import pytest

from vidtrack.motion.straight import fit_line


def rod(skew_deg=1.909, n=600, noise=0.01, vibration=0.0):
    """A target that runs 24 in to either side along a rod that is off by one inch in thirty (thesis figure 6.12)."""
    rng, t = np.random.default_rng(1), np.arange(n) / 30
    s = 24 * np.exp(-0.05 * t) * np.cos(2 * np.pi * 0.9 * t)
    a = np.radians(skew_deg)
    p = np.stack([s * np.cos(a), s * np.sin(a) + 2 + vibration * np.sin(9 * t), 0 * s + 5], -1)
    return s, p + rng.normal(0, noise, p.shape)


def test_an_inch_in_thirty_is_1_9_degrees():
    line = fit_line(rod()[1], 0)
    assert line.skew_deg == pytest.approx(np.degrees(np.arctan(1 / 30)), abs=0.01)
    assert 0 < line.skew_sd_deg < 0.01
    assert line.straight > 0.9999


def test_distance_along_the_rod_is_what_its_sensor_measures():
    s, p = rod(skew_deg=10)
    line = fit_line(p)
    assert line.axis == 0
    assert line.foot[0] == pytest.approx(0, abs=1e-9)
    assert line.along(p) == pytest.approx(s, abs=0.05)


def test_the_line_points_the_way_its_axis_does():
    assert fit_line(-rod()[1]).direction[0] > 0.99


def test_vibration_across_the_rod_makes_its_angle_less_sure():
    calm, shaken = fit_line(rod()[1], 0), fit_line(rod(vibration=0.7)[1], 0)
    assert shaken.skew_sd_deg > 3 * calm.skew_sd_deg
    assert shaken.skew_deg == pytest.approx(1.909, abs=3 * shaken.skew_sd_deg)
    assert shaken.rms_off == pytest.approx(0.7 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize("rounding", [-1e-13, 0.0, 1e-13])
def test_half_way_between_two_axes_the_first_one_counts_whatever_rounding_does(rounding):
    t = np.sin(np.arange(200) / 7)
    line = fit_line(np.stack([np.zeros(200), t, -t * (1 + rounding)], 1))
    assert line.axis == 1
    assert line.direction == pytest.approx([0, np.sqrt(0.5), -np.sqrt(0.5)])


def test_in_a_plane_the_missing_axis_is_left_out():
    s, p = rod(skew_deg=5)
    p[:, 2] = np.nan
    line = fit_line(p)
    assert line.direction[2] == 0
    assert line.skew_deg == pytest.approx(5, abs=0.02)
    assert line.along(p) == pytest.approx(s, abs=0.2)


def test_a_circle_is_not_straight():
    t = np.linspace(0, 2 * np.pi, 100)
    assert fit_line(np.stack([np.cos(t), np.sin(t), 0 * t], -1)).straight < 0.6


def test_a_target_at_rest_has_no_line():
    assert np.isnan(fit_line(np.ones((10, 3))).skew_deg)
    assert np.isnan(fit_line(np.full((10, 3), np.nan)).skew_deg)
