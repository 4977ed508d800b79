from fractions import Fraction

import numpy as np
import pytest

from tests.timing import libltc
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.timing.ltc import Reading, _boxcar, _gathered, _numbers, chained, code_rate, joined, read_words
from vidtrack.timing.timecode import Timecode, frame_from_parts, label_from_frame, parse

FS = 48_000
NTSC = Fraction(30000, 1001)
WITNESS = libltc.load()
needs_libltc = pytest.mark.skipif(WITNESS is None, reason="libltc11 is not installed")


def sound(
    first: Timecode, seconds: float, *, snr: float | None = None, seed: int = 0, fs: int = FS, **how: float
) -> np.ndarray:
    """Code and white noise, snr dB of signal power over noise power in the whole band."""
    signal = ltc_signal(np.arange(int(seconds * fs)) / fs, first, **how)
    if snr is None:
        return signal
    sigma = np.sqrt(np.mean(signal**2) / 10 ** (snr / 10))
    return signal + np.random.default_rng(seed).normal(0, sigma, signal.shape)


def read(samples: np.ndarray, fs: int = FS, video_rate: Fraction | None = None) -> Reading:
    words = read_words(samples, fs)
    rate, drop = code_rate(words, 1 / fs, video_rate)
    return chained(words, words.start / fs, words.period / fs, rate, drop)


def errors(reading: Reading, first: Timecode, start: float = 0.0, speed: float = 1.0) -> np.ndarray:
    """By how many frames each word is placed late."""
    return (reading.time - start) * float(first.rate) * speed + first.frame - reading.frame


@pytest.mark.parametrize(
    ("rate", "drop"),
    [("24000/1001", False), ("24", False), ("25", False), ("30000/1001", True), ("30000/1001", False), ("30", False)],
)
@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_every_word_is_read_at_every_rate_and_speed(rate, drop, speed):
    first = parse("10:00:59;20" if drop else "10:00:59:20", Fraction(rate))
    reading = read(sound(first, 4, start=0.0123, speed=speed), video_rate=first.rate)
    assert (reading.rate, reading.drop) == (first.rate, drop)
    assert len(reading.time) >= int(4 * float(first.rate) * speed) - 2
    assert not reading.dropouts
    assert reading.refused == 0
    assert reading.speed == pytest.approx(speed, abs=1e-4)
    off = errors(reading, first, 0.0123, speed)
    assert np.abs(off).max() < 0.0005
    assert abs(off.mean()) < 0.0001  # a fifth of a sample: nothing is shifted on the way


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_noise_of_9_dB_makes_no_wrong_label_and_places_words_to_a_hundredth_of_a_frame(speed):
    first = parse("10:00:59;20", NTSC)
    reading = read(sound(first, 30, snr=9, speed=speed, seed=4))
    off = errors(reading, first, speed=speed)
    assert len(reading.time) > 0.98 * 30 * float(NTSC) * speed
    assert np.abs(off).max() < 0.01
    assert off.std() > 1e-5  # the noise is there


def test_in_ever_stronger_noise_words_are_lost_but_none_is_wrong():
    first = parse("10:00:59;20", NTSC)
    counts = []
    for snr in (6, 3, 1):
        reading = read(sound(first, 15, snr=snr))
        assert np.abs(errors(reading, first)).max(initial=0) < 0.01
        counts.append(len(reading.time))
    assert counts[0] > counts[1] > counts[2]
    assert counts[2] < 0.8 * 15 * 30


def test_even_before_neighbours_are_asked_hardly_a_word_is_wrong_in_heavy_noise():
    first = parse("10:17:35;11", NTSC)
    words = read_words(sound(first, 60, snr=2, seed=5, user_bits=0x5A5A5A5A), FS)
    frame = frame_from_parts(words.parts, NTSC, True)
    wrong = np.abs(words.start / FS * float(NTSC) + first.frame - frame) > 0.5
    assert len(words.start) > 300
    assert wrong.sum() <= 1


@pytest.mark.parametrize("level", [0.9, -0.9, 0.001, -0.00002])
def test_level_and_polarity_carry_nothing(level):
    first = parse("01:02:03:04", Fraction(25))
    reading = read(sound(first, 2, level=level))
    assert np.abs(errors(reading, first)).max() < 0.0005
    assert len(reading.time) >= 48


def test_hum_four_times_as_loud_as_the_code_is_no_matter():
    first = parse("01:02:03:04", NTSC)
    hum = 2 * np.sin(2 * np.pi * 60 * np.arange(4 * FS) / FS)
    reading = read(sound(first, 4) + hum + 0.3)
    assert len(reading.time) >= 118
    assert np.abs(errors(reading, first)).max() < 0.001


@pytest.mark.parametrize("fs", [16_000, 22_050, 32_000, 44_100, 96_000])
def test_sound_of_any_usual_rate_will_do(fs):
    first = parse("10:00:00;00", NTSC)
    reading = read(sound(first, 3, snr=20, fs=fs), fs)
    assert len(reading.time) >= 88
    assert np.abs(errors(reading, first)).max() < 0.002


def test_a_tape_whose_speed_swings_between_half_and_one_and_a_half_keeps_its_labels():
    first = parse("10:00:59;20", NTSC)
    speed = 1 + 0.5 * np.sin(0.8 * np.arange(15 * FS) / FS)
    played = np.cumsum(speed) / FS
    signal = ltc_signal(played, first) + np.random.default_rng(0).normal(0, 0.1, played.shape)
    reading = read(signal)
    at = np.interp(reading.time, np.arange(15 * FS) / FS, played)
    assert np.abs(at * float(NTSC) + first.frame - reading.frame).max() < 0.01
    assert set(reading.piece) == {0}


def test_dropouts_are_bridged_and_reported_and_jumps_begin_a_new_piece():
    first, second = parse("10:00:59;20", NTSC), parse("11:00:00;00", NTSC)
    signal = sound(first, 20)
    signal[3 * FS : 3 * FS + 9000] = 0
    signal[8 * FS : 10 * FS] = np.random.default_rng(0).normal(0, 0.3, 2 * FS)
    signal[12 * FS : 13 * FS] *= 0.004
    signal[15 * FS :] = sound(second, 20)[15 * FS :]
    reading = read(signal + np.random.default_rng(1).normal(0, 1e-4, signal.shape))
    for piece, code in ((0, first), (1, second)):
        at = reading.piece == piece
        off = (reading.time[at] * float(NTSC) + code.frame) - reading.frame[at]
        assert np.abs(off).max() < 0.01
    assert reading.piece[-1] == 1
    gaps = np.array(reading.dropouts)
    np.testing.assert_allclose(gaps[:2, 0], [3, 8], atol=0.04)
    np.testing.assert_allclose(gaps[:2, 1], [3.19, 10], atol=0.04)
    np.testing.assert_allclose(gaps[:, 2], (gaps[:, 1] - gaps[:, 0]) * float(NTSC), atol=0.01)


def test_words_that_follow_from_no_neighbour_are_refused():
    first = parse("01:00:00:00", Fraction(25))
    good = read_words(sound(first, 2), FS)
    odd = good._replace(
        parts=good.parts._replace(minutes=np.where(np.arange(len(good.start)) == 20, 33, good.parts.minutes))
    )
    reading = chained(odd, odd.start / FS, odd.period / FS, Fraction(25), False)
    assert reading.refused == 1
    assert reading.dropouts[0][2] == 1
    assert np.abs(errors(reading, first)).max() < 0.001


@pytest.mark.parametrize("kind", ["silence", "noise", "hiss of brown noise", "tone", "square wave", "random bits"])
def test_what_is_no_time_code_gives_no_words(kind):
    rng = np.random.default_rng(0)
    t = np.arange(5 * FS) / FS
    samples = {
        "silence": np.zeros(5 * FS),
        "noise": rng.normal(size=5 * FS),
        "hiss of brown noise": np.cumsum(rng.normal(size=5 * FS)),
        "tone": np.sin(2 * np.pi * 1200 * t),
        "square wave": np.sign(np.sin(2 * np.pi * 1200 * t)),
        "random bits": np.repeat(np.sign(rng.normal(size=24_000)), 10),
    }[kind]
    words = read_words(samples, FS)
    assert len(words.start) == 0
    assert len(joined([]).start) == 0


def test_less_than_a_word_gives_nothing():
    assert len(read_words(sound(parse("01:00:00:00", Fraction(25)), 0.03), FS).start) == 0
    assert len(read_words(np.empty(0), FS).start) == 0


def test_user_bits_come_through():
    first = parse("01:00:00:00", Fraction(25))
    words = read_words(sound(first, 1, user_bits=0x89ABCDEF), FS)
    assert set(words.user.tolist()) == {0x89ABCDEF}


def test_less_than_a_second_of_code_still_tells_its_rate():
    for rate in (Fraction(24), Fraction(25), Fraction(30), NTSC):
        first = parse("01:00:00:02", rate)
        reading = read(sound(first, 0.6), video_rate=rate)
        assert reading.rate == rate


@needs_libltc
@pytest.mark.parametrize(
    ("standard", "rate", "drop"),
    [
        (libltc.TV_625, Fraction(25), False),
        (libltc.TV_525, NTSC, True),
        (libltc.TV_525, Fraction(30), False),
        (libltc.FILM_24, Fraction(24), False),
    ],
)
def test_what_libltc_writes_is_read_with_its_labels(standard, rate, drop):
    signal = libltc.encode(WITNESS, (10, 0, 58, 5), 150, FS, float(rate), standard, drop)
    reading = read(signal, video_rate=rate)
    first = parse("10:00:58;05" if drop else "10:00:58:05", rate)
    assert (reading.rate, reading.drop) == (rate, drop)
    assert len(reading.time) >= 147
    np.testing.assert_array_equal(np.diff(reading.frame), 1)
    np.testing.assert_allclose(errors(reading, first), 0, atol=0.02)  # libltc sets its edges on whole samples
    assert str(label_from_frame(reading.frame[-1], rate, drop)).startswith("10:01:0")


@needs_libltc
@pytest.mark.parametrize("snr", [14, 9])
def test_in_noise_libltc_reads_the_same_labels_at_the_same_places(snr):
    first = parse("10:00:58:05", Fraction(25))
    signal = sound(first, 12, snr=snr, seed=2)
    ours = read(signal)
    ours_at = dict(zip(ours.frame.tolist(), (ours.time * FS).tolist(), strict=True))
    apart = []
    for (h, m, s, f, _), at in libltc.decode(WITNESS, 0.5 * signal, FS / 25):
        frame = ((h * 60 + m) * 60 + s) * 25 + f
        if abs((at / FS) * 25 + first.frame - frame) < 0.5 and frame in ours_at:  # in noise it errs itself
            apart.append(ours_at[frame] - at)
    assert len(apart) > 150  # at 9 dB it reads two words of three
    assert len(ours.time) >= len(apart)
    assert np.quantile(np.abs(apart), 0.9) < 0.01 * FS / 25  # theirs are whole samples, of one crossing each
    assert np.std(apart) > 0.2


@pytest.mark.parametrize("part", [0.5, 159.5 / 160])
def test_a_word_in_which_time_jumps_by_less_than_half_a_half_bit_is_left_out(part):
    """The tape stands still for 0.45 of a half bit, within a word and at its end: nothing else in it is wrong."""
    first, fs = parse("01:00:00:00", Fraction(30)), 96_000
    half = fs // (160 * 30)
    at = int((20 + part) * 160 * half) + half // 4
    signal = sound(first, 2, fs=fs)
    held = np.concatenate([signal[:at], np.full(int(0.45 * half), signal[at]), signal[at:]])
    words = read_words(held, fs)
    numbers = frame_from_parts(words.parts, Fraction(30), False) - first.frame
    assert 20 not in numbers
    assert {18, 19, 22, 23} <= set(numbers.tolist())


@pytest.mark.parametrize("samples", [np.zeros(FS), np.full(300, 0.5), np.zeros(0)])
def test_silence_and_a_moment_of_sound_have_no_words(samples):
    assert not read_words(samples, FS).start.size


def test_a_mean_over_neighbours_holds_the_ends():
    np.testing.assert_allclose(_boxcar(np.full(9, 3.0), 5), 3.0)


def test_labels_that_drop_frame_leaves_out_are_refused_in_every_minute_but_the_tenth():
    first = parse("10:00:59;20", NTSC)
    good = read_words(sound(first, 2), FS)
    for minute in (1, 9, 11):
        at = np.arange(len(good.start)) == 20
        parts = {"minutes": minute, "seconds": 0, "frames": 1}
        odd = good.parts._replace(**{key: np.where(at, n, getattr(good.parts, key)) for key, n in parts.items()})
        numbers, valid = _numbers(odd, NTSC, True)
        assert np.flatnonzero(~valid).tolist() == [20]
        assert valid.size == numbers.size


@pytest.mark.parametrize("group", [0, 16, 32, 48])
def test_a_word_with_a_digit_above_nine_is_no_label(group):
    bits = np.zeros((2, 80), np.uint8)
    bits[1, [group + 1, group + 3]] = 1  # ten
    words = _gathered(np.array([0.0, 1600.0]), np.full(2, 10.0), bits)
    assert words.start.tolist() == [0.0]
