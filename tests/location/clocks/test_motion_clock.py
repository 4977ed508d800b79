"""The motion tells by how much a camera is late."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.clocks.motion_clock import estimate_clocks
from vidtrack.simulate.rig import thesis_rig
from vidtrack.timing.clock import Clock


def pluck(t):
    """The thesis's plucked rod (chapter 6), in: 24 in at first, 1.6 s, with a little motion across."""
    decay = np.exp(-0.1 * t)
    swing = [
        24 * np.cos(2 * np.pi * t / 1.6),
        0.6 * np.sin(2 * np.pi * t / 0.9),
        0.4 * np.cos(2 * np.pi * t / 1.1),
    ]
    return decay[:, None] * np.stack(swing, -1)


def forced(t):
    return np.stack(
        [10 * np.cos(2 * np.pi * t / 2.5), 1.0 * np.sin(2 * np.pi * t / 1.7), 0.5 * np.cos(2 * np.pi * t)], -1
    )


def recorded(motion, seconds, rate_hz, offset_s=0.0, rate_ppm=0.0, *, noise=0.03, rng, cameras=2):
    """Times and tracks; the last camera's clock needs these corrections to be right."""
    rig = thesis_rig(cameras)
    t = 36000 + np.arange(round(seconds * rate_hz)) / rate_hz
    right = [t] * (cameras - 1) + [Clock(offset_s, rate_ppm).corrected(t)]
    tracks = [
        project(c, motion(r - 36000))[None] + rng.normal(0, noise, (1, t.size, 2))
        for c, r in zip(rig, right, strict=True)
    ]
    return rig, [t] * cameras, tracks


def test_a_third_of_a_frame_is_found_to_a_hundredth():
    rig, times, tracks = recorded(pluck, 10, 30, 0.37 / 30, rng=np.random.default_rng(0))
    found = estimate_clocks(rig, times, tracks, free=[1])
    frames = 30 * found.clocks[1].offset_s
    assert frames == pytest.approx(0.37, abs=0.02)
    assert 30 * found.sd[1].offset_s < 0.005
    assert found.clocks[0] == Clock()
    # what is left is the noise of two pictures, one of them resampled; before, 0.37 frame of a fast target
    assert found.error_px == pytest.approx(0.03 * 1.25, rel=0.15)
    assert found.error_before_px > 1
    assert not any(found.ambiguous)
    middle = np.abs(found.offsets).argmin()
    assert found.error_by_offset[1].argmin() == middle


def test_fifty_parts_per_million_are_found_over_a_minute():
    rig, times, tracks = recorded(forced, 60, 30, -0.21 / 30, 50.0, rng=np.random.default_rng(1))
    found = estimate_clocks(rig, times, tracks, free=[1])
    assert found.clocks[1].rate_ppm == pytest.approx(50, abs=5)
    assert 30 * found.clocks[1].offset_s == pytest.approx(-0.21, abs=0.02)
    assert found.sd[1].rate_ppm < 6


@pytest.mark.parametrize(("seconds", "rate_ppm"), [(2, 5000.0), (8, -1000.0), (20, 3000.0)])
def test_a_rate_that_no_crystal_has_is_found_where_the_motion_shows_it(seconds, rate_ppm):
    rig, times, tracks = recorded(pluck, seconds, 30, 0.1 / 30, rate_ppm, rng=np.random.default_rng(1))
    found = estimate_clocks(rig, times, tracks, free=[1], bias_px=0.05)
    assert found.clocks[1].rate_ppm == pytest.approx(rate_ppm, abs=3 * found.sd[1].rate_ppm)
    assert found.sd[1].rate_ppm < 0.25 * abs(rate_ppm)


def test_fields_at_59_94_hz_tell_as_well():
    rig, times, tracks = recorded(pluck, 10, 60 / 1.001, 0.5 * 1.001 / 60, rng=np.random.default_rng(2))
    found = estimate_clocks(rig, times, tracks, free=[1])
    assert found.clocks[1].offset_s * 60 / 1.001 == pytest.approx(0.5, abs=0.02)


def test_an_offset_of_many_frames_is_searched_for():
    rig, times, tracks = recorded(pluck, 10, 30, 14.3 / 30, rng=np.random.default_rng(3))
    found = estimate_clocks(rig, times, tracks, free=[1])
    assert 30 * found.clocks[1].offset_s == pytest.approx(14.3, abs=0.02)


@pytest.mark.slow
def test_the_standard_error_is_honest():
    off = []
    for seed in range(25):
        rig, times, tracks = recorded(pluck, 6, 30, 0.3 / 30, noise=0.15, rng=np.random.default_rng(seed))
        found = estimate_clocks(rig, times, tracks, free=[1], rate=False, max_offset_s=0.05)
        # centroids so noisy that what they have in common (CENTROID_BIAS_PX) does not count
        off.append((found.clocks[1].offset_s - 0.01) / found.sd[1].offset_s)
    assert 0.6 < np.mean(np.square(off)) < 1.5  # 25 trials: one sd of the mean square is .28


def test_three_cameras_share_one_time():
    rng = np.random.default_rng(4)
    rig, times, tracks = recorded(pluck, 8, 30, 0.37 / 30, rng=rng, cameras=3)
    found = estimate_clocks(rig, times, tracks, free=[1, 2])
    assert 30 * found.clocks[1].offset_s == pytest.approx(0, abs=0.01)
    assert 30 * found.clocks[2].offset_s == pytest.approx(0.37, abs=0.01)


def test_a_lost_second_and_bad_centroids_do_no_harm():
    rig, times, tracks = recorded(pluck, 10, 30, 0.37 / 30, rng=np.random.default_rng(5))
    tracks[1][0, 100:130] = np.nan
    tracks[0][0, 50:55] += 30
    found = estimate_clocks(rig, times, tracks, free=[1])
    assert 30 * found.clocks[1].offset_s == pytest.approx(0.37, abs=0.02)


def test_a_calibration_error_does_not_pass_for_a_delay():
    rig, times, tracks = recorded(pluck, 10, 30, 0.37 / 30, rng=np.random.default_rng(6))
    tracks[1] = tracks[1] + [0.2, 0.3]  # px, all along
    found = estimate_clocks(rig, times, tracks, free=[1], bias_px=0.3)
    assert 30 * found.clocks[1].offset_s == pytest.approx(0.37, abs=0.01)


def test_a_target_at_rest_tells_nothing_and_says_so():
    rig, times, tracks = recorded(lambda t: np.zeros((t.size, 3)), 5, 30, rng=np.random.default_rng(7))
    found = estimate_clocks(rig, times, tracks, free=[1], rate=False)
    assert not found.sd[1].offset_s < 0.1 / 30


def test_a_steady_swing_fits_a_period_later_as_well_and_is_said_to():
    def steady(t):
        return np.stack([24 * np.cos(2 * np.pi * t / 0.8), 0 * t, np.sin(2 * np.pi * t / 0.8)], -1)

    rig, times, tracks = recorded(steady, 10, 30, 0.2 / 30, rng=np.random.default_rng(8))
    assert estimate_clocks(rig, times, tracks, free=[1], max_offset_s=1.0).ambiguous[1]
    near = estimate_clocks(rig, times, tracks, free=[1], max_offset_s=0.3)
    assert not near.ambiguous[1]
    assert 30 * near.clocks[1].offset_s == pytest.approx(0.2, abs=0.02)


def test_somebody_must_keep_the_time():
    rig, times, tracks = recorded(pluck, 1, 30, rng=np.random.default_rng(9))
    with pytest.raises(ValueError, match="keep its clock"):
        estimate_clocks(rig, times, tracks, free=[0, 1])
    with pytest.raises(ValueError, match="tracks must be"):
        estimate_clocks(rig, [times[0][:-1], times[1]], tracks, free=[1])


def test_of_two_free_cameras_one_that_never_saw_anything_leaves_the_other_its_clock():
    """The normal equations of a camera that shows nothing are rows of zeros."""
    cameras = thesis_rig(3)
    t = np.arange(300) / 30
    swing = np.stack([20 * np.sin(2 * t), 3 * np.cos(3.1 * t), 4 * np.sin(2.7 * t)], -1)
    late = np.stack([20 * np.sin(2 * (t + 0.01)), 3 * np.cos(3.1 * (t + 0.01)), 4 * np.sin(2.7 * (t + 0.01))], -1)
    rng, paths = np.random.default_rng(0), (swing, late, swing)
    tracks = [project(c, p)[None] + rng.normal(0, 0.05, (1, 300, 2)) for c, p in zip(cameras, paths, strict=True)]
    tracks[2][:] = np.nan
    found = estimate_clocks(cameras, [t] * 3, tracks, free=[1, 2], bias_px=0.05)
    assert found.clocks[1].offset_s == pytest.approx(0.01, abs=5 * found.sd[1].offset_s)
    assert found.sd[1].offset_s < 1e-3
    assert not found.sd[2].offset_s < 1
