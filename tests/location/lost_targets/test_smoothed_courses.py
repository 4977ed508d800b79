"""Where a target is on the line of sight of the one camera that sees it, and how well that is known."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.lost_targets.expected import Expected
from vidtrack.location.lost_targets.smoothed_courses import SMOOTHING, smoothed_gaps, usual_jerk
from vidtrack.simulate.rig import thesis_rig

N = 200
T = np.arange(N) / 30
SD = 0.05


def waves(rng, m=3):
    hz, phase = rng.uniform(0.3, 1.2, (m, 1, 3)), rng.uniform(0, 6, (m, 1, 3))
    return rng.uniform(-4, 4, (m, 1, 3)) + 3 * np.sin(2 * np.pi * hz * T[:, None] + phase)


def smoothed(gap, *, seen=True, wrong=(), wanted=None, seed=0):
    """Errors (m, gap, 3) and sd of what is smoothed over a gap that one of two cameras sees or no camera."""
    rng = np.random.default_rng(seed)
    cameras, p = thesis_rig(2), waves(rng)
    b = np.stack([project(camera, p) for camera in cameras]) + rng.normal(0, SD, (2, len(p), N, 2))
    b[0, :, gap] = np.nan
    if not seen:
        b[1, :, gap] = np.nan
    b[1, :, list(wrong)] += 30.0
    S = np.tile(1e-4 * np.eye(3), (len(p), N, 1, 1))
    place = p + rng.normal(0, 0.01, p.shape)
    place[:, gap], S[:, gap] = np.nan, np.nan
    some = np.ones(N, bool) if wanted is None else np.isin(np.arange(N), wanted)
    out = smoothed_gaps(cameras, b, np.full(b.shape, SD), 0.02, T, Expected(place, S), some)
    return (out.p - p)[:, gap], np.sqrt(np.einsum("...ii->...i", out.S[:, gap])), out


def test_the_jerk_of_a_cubic_is_six_times_its_leading_coefficient():
    t = np.arange(40.0)
    p = np.stack([2 * t**3, -2 * t**3, 2 * t**3 + t], axis=-1)[None]
    assert usual_jerk(p, t) == pytest.approx(12.0)
    uneven = np.sort(np.r_[t, 3.5, 20.2])
    assert usual_jerk(np.stack([2 * uneven**3] * 3, axis=-1)[None], uneven) == pytest.approx(12.0)
    assert np.isnan(usual_jerk(p[:, :5], t[:5]))


@pytest.mark.parametrize("gap", [slice(90, 96), slice(80, 115), slice(0, 10), slice(188, 200)])
def test_what_one_camera_sees_of_a_gap_says_where_a_target_is_within_its_sd(gap):
    error, sd, out = smoothed(gap)
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean((error / sd) ** 2)) < 1.3
    assert np.abs(error / sd).max() < 5
    inside = np.ones(N, bool)
    inside[gap] = False
    assert np.isnan(out.p[:, inside]).all()


def test_across_the_line_of_sight_a_target_is_known_in_the_middle_of_a_long_gap():
    """Along it, and without it, no better than its motion says."""
    sd = []
    for seen in (True, False):
        error, own, out = smoothed(slice(80, 110), seen=seen)
        assert np.abs(error / own).max() < 5
        sd.append(np.sqrt(np.linalg.eigvalsh(out.S[:, 95])))
    assert (20 * sd[0][:, 1] < sd[1][:, 0]).all()
    assert (sd[0][:, 2] > 0.5 * sd[1][:, 2]).all()


def test_a_line_of_sight_to_something_else_is_left_out():
    error, sd, _ = smoothed(slice(80, 100), wrong=(88, 89))
    assert np.abs(error / sd).max() < 5


def test_gaps_of_no_wanted_moment_and_short_courses_are_left():
    _, _, out = smoothed(slice(80, 100), wanted=[120])
    assert np.isnan(out.p).all()
    _, _, out = smoothed(slice(1, N))
    assert np.isnan(out.p).all()


def test_of_a_very_long_gap_both_ends_are_smoothed():
    _, _, out = smoothed(slice(50, 150))
    half = SMOOTHING.longest // 2
    assert np.flatnonzero(np.isfinite(out.p[0, :, 0])).tolist() == [*range(50, 50 + half), *range(150 - half, 150)]
