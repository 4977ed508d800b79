"""A recorder's clock from a lamp that switches, against clocks that were put in."""

import numpy as np
import pytest

from vidtrack.timing.pulses import switchings, timing_from_lamp

SWITCHES = np.array([1.03, 1.71, 2.94, 3.33, 5.12, 5.87, 8.01, 8.29])


def lamp(t):
    """On after an odd number of switchings."""
    return np.searchsorted(SWITCHES, t, "right") % 2


def exposed(rate=30.0, length=10.0, fine=400):
    """A camera with its shutter open all the time: the mean light of each exposure."""
    t = np.arange(0, length, 1 / rate)
    within = np.arange(fine) / fine / rate
    return t, 40 + 60 * lamp(t[:, None] + within).mean(1)


def sampled(offset, rate=1000.0, ppm=0.0, length=10.0, noise=0.02, rng=None):
    """A recorder that samples the voltage; its times are true time less the offset."""
    rng = rng or np.random.default_rng(0)
    true = np.arange(0.4 + rng.uniform() / rate, length, 1 / rate)
    volts = 5.0 * lamp(true) + rng.normal(0, noise, true.size)
    return (true - offset) / (1 + ppm * 1e-6), volts


def test_switchings_lie_between_the_samples_on_either_side():
    t, volts = sampled(0.0)
    at, sign, sd = switchings(t, volts)
    assert at == pytest.approx(SWITCHES, abs=0.00051)
    assert sign.tolist() == [1, -1] * 4
    assert sd == pytest.approx(0.001 / np.sqrt(12), rel=1e-6)


def test_what_does_not_switch_has_no_switchings():
    t = np.arange(0, 5, 0.01)
    assert switchings(t, np.random.default_rng(1).normal(0, 1, t.size))[0].size == 0
    assert switchings(t, np.full(t.size, 3.0))[0].size == 0
    assert switchings(t[:2], [0, 5])[0].size == 0


def test_missing_samples_widen_the_switching_that_they_hide():
    t, volts = sampled(0.0)
    volts[(t > 1.02) & (t < 1.06)] = np.nan
    at, _, sd = switchings(t, volts)
    assert abs(at[0] - SWITCHES[0]) < 2 * sd[0]
    assert sd[0] > 10 * sd[1]


@pytest.mark.parametrize("inverted", [False, True])
def test_the_recorder_is_joined_to_the_camera_to_a_small_part_of_a_picture(inverted):
    t, volts = sampled(-36000.0123)
    found = timing_from_lamp(*exposed(), t, -volts if inverted else volts)
    assert found.rivals == ()
    assert found.timing.n == 8
    late = found.timing.clock.offset_s + 36000.0123
    assert abs(late) < 3 * found.timing.sd.offset_s < 0.02
    assert abs(late) < 0.003


def test_the_stated_error_of_the_offset_is_honest():
    rng = np.random.default_rng(5)
    worse = []
    for _ in range(30):
        offset = rng.uniform(-50, 50)
        camera, level = exposed(rate=rng.uniform(24, 60), fine=100)
        found = timing_from_lamp(camera, level + rng.normal(0, 0.3, level.size), *sampled(offset, 200, rng=rng)).timing
        worse.append(abs(found.clock.offset_s - offset) / found.sd.offset_s)
    assert np.mean(np.array(worse) < 2) > 0.85


def test_a_recorder_that_drives_the_lamp_in_step_with_its_samples_is_within_its_error():
    true = np.arange(0, 10, 0.01)  # all switchings lie on a sample
    found = timing_from_lamp(*exposed(), true - 3.0, 5.0 * lamp(true)).timing
    assert abs(found.clock.offset_s - 3.0) < 2.5 * found.sd.offset_s
    assert found.sd.offset_s > 0.01 / np.sqrt(12)


def test_a_lamp_that_blinks_evenly_over_a_longer_record_is_ambiguous():
    t = np.arange(0, 6, 1 / 30)
    level = 50.0 + 40 * (np.floor(t / 0.5) % 2)
    long = np.arange(0, 20, 0.001)
    found = timing_from_lamp(t, level, long, np.floor(long / 0.5) % 2)
    assert len(found.rivals) > 3


def test_a_lamp_that_the_camera_does_not_see_gives_no_clock():
    t, volts = sampled(0.0)
    found = timing_from_lamp(np.arange(0, 10, 1 / 30), np.full(300, 60.0), t, volts)
    assert not found.timing.is_known
    assert found.timing.of == 8
