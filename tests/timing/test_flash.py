"""A light that goes on during an exposure says when."""

import numpy as np
import pytest

from vidtrack.timing.flash import _Change, _doubted, light_changes, timing_from_flash

HZ = 30
T = np.arange(300) / HZ


def level(t, changes, rng, *, flicker=0.2, shutter=1.0):
    """Mean brightness of exposures that begin at t; changes are (moment, grey levels)."""
    out = np.full(t.size, 40.0)
    for moment, size in changes:
        out += size * np.clip((t + shutter / HZ - moment) * HZ / shutter, 0, 1)
    return out + rng.normal(0, flicker, t.size)


def test_a_light_switched_on_is_timed_to_a_fraction_of_a_picture():
    rng = np.random.default_rng(0)
    for moment in np.linspace(2.0, 2.0 + 1 / HZ, 13):
        at, size, sd = light_changes(T, level(T, [(moment, 100)], rng))
        assert len(at) == 1
        assert at[0] * HZ == pytest.approx(moment * HZ, abs=0.02)
        assert size[0] == pytest.approx(100, abs=2)
        assert 0.001 < sd[0] * HZ < 0.02


def test_on_and_off_are_told_apart_and_flicker_is_no_change():
    rng = np.random.default_rng(1)
    at, size, _ = light_changes(T, level(T, [(2.013, 100), (4.555, -60)], rng))
    assert np.sign(size).tolist() == [1, -1]
    assert at == pytest.approx([2.013, 4.555], abs=0.001)
    assert len(light_changes(T, level(T, [], rng, flicker=3))[0]) == 0
    assert len(light_changes(T[:3], T[:3])[0]) == 0


def test_two_cameras_agree_on_when_the_light_went_on():
    rng = np.random.default_rng(2)
    changes = [(2.013, 100), (4.555, -100), (7.77, 100)]
    late = 0.37 / HZ
    a = level(T, changes, rng)
    b = 0.5 * level(T + late, changes, rng)  # another lens; its clock shows 0.37 of a picture less
    timing = timing_from_flash(T, a, T, b)
    assert timing.clock.offset_s * HZ == pytest.approx(0.37, abs=0.03)
    assert abs(timing.clock.offset_s - late) < 3 * timing.sd.offset_s
    assert timing.n == 3


def test_a_short_flash_tells_no_more_than_the_picture():
    rng = np.random.default_rng(3)
    a, b = level(T, [], rng), level(T, [], rng)
    a[120] += 80
    b[121] += 80
    timing = timing_from_flash(T, a, T, b)
    assert timing.clock.offset_s * HZ == pytest.approx(-1, abs=0.02)
    assert timing.sd.offset_s * HZ == pytest.approx(np.sqrt(2 / 12), rel=0.01)


@pytest.mark.parametrize("shutter", [1.0, 0.5])
def test_a_short_flash_is_put_in_the_middle_of_the_exposure_that_holds_it(shutter):
    flash = np.where(np.arange(T.size) == 60, 90.0, 40.0) + np.random.default_rng(8).normal(0, 0.2, T.size)
    at, _, sd = light_changes(T, flash, shutter=shutter)
    assert at == pytest.approx([T[60] + shutter / 2 / HZ], abs=0.01 / HZ)
    assert sd == pytest.approx([1 / HZ / np.sqrt(12)])


def test_a_shutter_that_is_shut_half_the_time_is_allowed_for():
    rng = np.random.default_rng(4)
    moments = 2 + rng.uniform(0, 1 / HZ, 40)
    off, sd = [], []
    for moment in moments:
        at, _, error = light_changes(T, level(T, [(moment, 100)], rng, shutter=0.5), shutter=0.5)
        off.append(at[0] - moment)
        sd.append(error[0])
    assert np.abs(off).max() < 0.52 / HZ
    assert np.sqrt(np.mean(np.square(off))) < 2.5 * np.mean(sd)


def test_cameras_that_saw_no_common_change_are_not_timed():
    rng = np.random.default_rng(5)
    on, off = level(T, [(2, 100)], rng), level(T, [(3, -100)], rng)
    assert np.isnan(timing_from_flash(T, on, T, off).sd.offset_s)
    assert np.isnan(timing_from_flash(T, on, T, level(T, [], rng)).sd.offset_s)


@pytest.mark.parametrize(
    ("shutters", "gamma", "n"),
    [((1.0, 1.0), 1.0, 4), ((0.5, 0.5), 1.0, 4), ((1.0, 0.3), 1.0, 4), ((1.0, 1.0), 0.45, 1)],
)
def test_what_nobody_knows_of_a_camera_is_in_the_error(shutters, gamma, n):
    """Errors are no larger than is told, whatever the shutters and the gamma; times are of the exposures' middles."""
    off, sd = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        changes = [(2 + 1.7 * k + rng.uniform(0, 1), 60 * (-1) ** k) for k in range(n)]
        late = rng.uniform(-0.5, 0.5) / HZ
        levels = []
        for shutter, by in zip(shutters, (0, late), strict=True):
            seen = level(T + by - shutter / 2 / HZ, changes, rng, flicker=0, shutter=shutter)
            levels.append(255 * (seen / 255) ** gamma + rng.normal(0, 0.05, T.size))
        timing = timing_from_flash(T, levels[0], T, levels[1], shutter=None)
        off.append((timing.clock.offset_s - late) * HZ)
        sd.append(timing.sd.offset_s * HZ)
    assert np.mean(np.square(np.array(off) / sd)) < 1.5
    if shutters == (1.0, 1.0) and gamma == 1:
        assert np.abs(off).max() < 0.02  # though it may be more, for all that is known


def test_gamma_counts_where_the_light_changes_by_much():
    small, large = (
        light_changes(T, level(T, [(2.013, size)], np.random.default_rng(0), flicker=0.01), shutter=None)[2][0]
        for size in (4, 200)
    )
    assert large > 1.5 * small


def test_a_lamp_that_blinks_steadily_is_paired_at_the_least_offset():
    rng = np.random.default_rng(6)
    blinks = [(1 + 0.5 * k, 60 * (-1) ** k) for k in range(16)]
    a, b = level(T, blinks, rng), level(T + 0.01, blinks, rng)
    assert timing_from_flash(T, a, T, b).clock.offset_s == pytest.approx(0.01, abs=0.002)


def test_four_pictures_show_a_change_and_three_do_not():
    at, size, _ = light_changes(T[:4], [40.0, 40, 140, 140])
    assert at * HZ == pytest.approx([2])
    assert size.tolist() == [100.0]
    assert light_changes(T[:3], [40.0, 140, 140])[0].size == 0


@pytest.mark.parametrize(("within", "other", "share"), [(1, 0, 1 / 6), (0, 1, 1 / 2), (3, 1, 1 / 7)])
def test_a_shutter_that_is_not_known_is_shut_as_long_as_the_changes_leave_likely(within, other, share):
    # S has a Beta(k + 1, n - k + 1) distribution; share is the mean of (1 - S)^2
    lit = _Change(1.0, 100.0, 0.0, 1, 0.5, 0.0)
    found = _doubted([lit] * within + [lit._replace(between=0)] * other, 1 / HZ)
    lost = 0.5 if within else 1 / np.sqrt(12)
    assert found[0].sd * HZ == pytest.approx(np.sqrt(share) * lost)
