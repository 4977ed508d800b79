"""Two microphones hear one room."""

import numpy as np
import pytest

from vidtrack.timing.sound import TAPER, _tapered, timing_from_sound

HZ = 8000


def room(seconds, rng):
    """A room's sound: coloured noise, and a clap now and then."""
    sound = rng.normal(size=seconds * HZ)
    sound[rng.integers(0, sound.size, 5)] += 40
    return np.convolve(sound, np.hanning(9), "same")


def heard(sound, start, seconds, rate_ppm, noise, rng, gain=1.0):
    at = (start + np.arange(seconds * HZ) / HZ * (1 + rate_ppm * 1e-6)) * HZ
    return gain * np.interp(at, np.arange(sound.size), sound) + noise * rng.normal(size=at.size)


def test_offset_and_rate_are_found_whatever_level_and_polarity():
    rng = np.random.default_rng(0)
    sound = room(32, rng)
    a = heard(sound, 0.5, 30, 0, 0.5, rng)
    b = heard(sound, 1.23456, 28, 50, 0.2, rng, gain=-0.3)
    timing = timing_from_sound(a, b, HZ, start_a=10.5, start_b=11.0)
    # b begins when a's clock shows 11.23456; a tenth of a sample is 12 us
    assert timing.clock.offset_s == pytest.approx(0.23456, abs=1.2e-5)
    assert timing.clock.rate_ppm == pytest.approx(50, abs=1)
    assert 5e-6 < timing.sd.offset_s < 3e-5
    assert timing.n == timing.of == 14


def test_the_error_is_as_large_as_is_said():
    off = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        sound = room(22, rng)
        late = rng.uniform(0.2, 0.3)
        a, b = heard(sound, 0.3, 20, 0, 3.0, rng), heard(sound, 0.3 + late, 20, 0, 3.0, rng)
        timing = timing_from_sound(a, b, HZ)
        assert timing.sd.offset_s < 1e-4
        off.append((timing.clock.offset_s - late) / timing.sd.offset_s)
    assert 0.2 < np.mean(np.square(off)) < 2.5


def test_a_camera_that_was_muted_for_a_while_is_still_timed():
    rng = np.random.default_rng(1)
    sound = room(32, rng)
    a, b = (heard(sound, s, 30, 0, 0.3, rng) for s in (0.0, 0.1))
    b[10 * HZ : 16 * HZ] = 0
    timing = timing_from_sound(a, b, HZ)
    assert timing.clock.offset_s == pytest.approx(0.1, abs=1e-5)
    assert timing.n < timing.of


def test_rooms_that_have_nothing_in_common_tell_nothing():
    rng = np.random.default_rng(2)
    timing = timing_from_sound(rng.normal(size=20 * HZ), rng.normal(size=20 * HZ), HZ)
    assert np.isnan(timing.sd.offset_s)
    assert np.isnan(timing_from_sound(np.zeros(20 * HZ), np.zeros(20 * HZ), HZ).sd.offset_s)
    assert np.isnan(timing_from_sound(np.ones(10), np.ones(10), HZ).sd.offset_s)


def test_sound_in_stereo_is_refused():
    with pytest.raises(ValueError, match="sound must be"):
        timing_from_sound(np.zeros((2, 10)), np.zeros(10), HZ)


def test_one_clap_is_enough_though_each_microphone_hisses_and_leaves_the_rate_open():
    rng = np.random.default_rng(3)
    t = np.arange(42 * HZ) / HZ
    clap = np.where(t > 17.3, 20 * np.exp(-np.maximum(t - 17.3, 0) / 0.01), 0) * rng.normal(size=t.size)
    a, b = (heard(clap, s, 40, 0, 0.3, rng) for s in (0.0, 0.1234))
    timing = timing_from_sound(a, b, HZ)
    assert timing.clock.offset_s == pytest.approx(0.1234, abs=2e-4)
    assert (timing.n, timing.of) == (1, 19)
    assert timing.sd.rate_ppm == pytest.approx(100, rel=0.01)
    at_the_clap = timing.moved(17.3)
    assert at_the_clap.sd.offset_s < 1e-4 < timing.sd.offset_s


def test_cameras_switched_on_a_minute_apart_are_timed():
    rng = np.random.default_rng(4)
    sound = room(110, rng)
    timing = timing_from_sound(heard(sound, 0, 100, 0, 0.5, rng), heard(sound, 61.5, 40, 0, 0.5, rng), HZ)
    assert timing.clock.offset_s == pytest.approx(61.5, abs=1e-4)


def test_a_tape_that_runs_half_a_thousandth_slow_is_followed():
    rng = np.random.default_rng(5)
    sound = room(130, rng)
    timing = timing_from_sound(heard(sound, 0, 125, 0, 0.5, rng), heard(sound, 0.7, 120, 500, 0.5, rng), HZ)
    assert timing.clock.rate_ppm == pytest.approx(500, abs=2)
    assert timing.clock.offset_s == pytest.approx(0.7, abs=1e-4)


def test_mains_hum_tells_nothing_and_hides_nothing():
    rng = np.random.default_rng(6)
    t = np.arange(30 * HZ) / HZ
    hum = sum(np.cos(2 * np.pi * 60.02 * k * t + k) / k for k in range(1, 12))
    for hiss in (0.5, 0.05, 0.005):
        a, b = (hum + hiss * rng.normal(size=t.size) for _ in range(2))
        assert np.isnan(timing_from_sound(a, b, HZ).sd.offset_s)
    room_too = 0.2 * room(32, rng)
    a, b = (hum + 0.05 * rng.normal(size=t.size) + heard(room_too, start, 30, 0, 0, rng) for start in (0.0, 0.321))
    assert timing_from_sound(a, b, HZ).clock.offset_s == pytest.approx(0.321, abs=1e-4)


@pytest.mark.parametrize("fraction", np.linspace(-0.5, 0.5, 9))
def test_a_lag_between_samples_is_found_to_a_twentieth_of_one(fraction):
    """Sound as sharp as the sampling allows, delayed in its spectrum."""
    rng = np.random.default_rng(8)
    sound = rng.normal(size=8 * HZ)
    f = np.fft.rfftfreq(sound.size)
    later = np.fft.irfft(np.fft.rfft(sound) * np.exp(-2j * np.pi * f * (100 + fraction)), sound.size)
    timing = timing_from_sound(sound, later, HZ)
    assert -timing.clock.offset_s * HZ == pytest.approx(100 + fraction, abs=0.05)


def test_a_likeness_elsewhere_does_not_outvote_the_clap_by_which_the_lag_was_found():
    rng = np.random.default_rng(9)
    t = np.arange(30 * HZ) / HZ
    clap = np.where(t > 21.3, 20 * np.exp(-np.maximum(t - 21.3, 0) / 0.01), 0) * rng.normal(size=t.size)
    a, b = (heard(clap, 0, 30, 0, 0.05, rng) for _ in range(2))
    for at in (5, 9):  # s; something that reaches one microphone 25 ms after the other
        a[at * HZ : (at + 1) * HZ] = rng.normal(0, 0.05, HZ)
        b[at * HZ + 200 : (at + 1) * HZ + 200] = a[at * HZ : (at + 1) * HZ]
    timing = timing_from_sound(a, b, HZ)
    assert np.isnan(timing.sd.offset_s) or timing.moved(21.3).clock.offset_s == pytest.approx(0, abs=1e-4)


def test_a_window_in_which_one_microphone_heard_something_else_does_not_count():
    """For two seconds of 28 one camera's sound comes 20 ms late, as from a loudspeaker."""
    rng = np.random.default_rng(6)
    sound = room(32, rng)
    a, b = heard(sound, 0.5, 30, 0, 0.2, rng), heard(sound, 1.5, 28, 0, 0.2, rng)
    late = slice(4 * HZ, 6 * HZ)
    b[late] = np.roll(b, HZ // 50)[late]
    timing = timing_from_sound(a, b, HZ)
    assert timing.clock.offset_s == pytest.approx(1.0, abs=2e-5)
    assert timing.clock.rate_ppm == pytest.approx(0, abs=2)
    assert timing.n < timing.of


def test_a_hum_that_is_cut_off_leaks_into_no_other_frequency():
    n = 4096
    hum = np.sin(2 * np.pi * 20.5 * np.arange(n) / n)
    cut, tapered = (np.abs(np.fft.rfft(x)) for x in (hum, _tapered(hum)))
    beyond = slice(int(40 / TAPER), None)
    assert tapered[beyond].max() < 0.01 * cut[beyond].max()
    assert tapered.max() == pytest.approx(cut.max(), rel=2 * TAPER + 0.1)
