from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.frame import Frame
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.pictures.frame_times import Stamps, chosen_clock, sample_moments
from vidtrack.tracking.state import MEASURED, SD_X, SD_Y, Rows, X, Y

RATE = Fraction(30)
N = 240


def rows_of(taken, speed, sd=0.02):
    """A target that swings, `speed` px a frame at most, seen at the moments (n,) s in which pictures were taken."""
    rng = np.random.default_rng(3)
    values = np.full((MEASURED, len(taken), 1), np.nan)
    swing = speed * float(RATE) / 6
    values[X, :, 0] = 300 + swing * np.sin(6 * taken) + rng.normal(0, sd, len(taken))
    values[Y, :, 0] = 200 + rng.normal(0, sd, len(taken))
    values[[SD_X, SD_Y]] = sd
    return Rows(values, np.zeros((len(taken), 1, 2)), np.zeros((len(taken), 1), np.int64), np.zeros(len(taken)))


def stamps_with_jitter(share=0.15):
    even = np.arange(N) / float(RATE)
    return even, even + np.random.default_rng(1).uniform(-share, share, N) / float(RATE)


BASE = TimeBase(RATE, RATE, tick=1e-6)


def test_stamps_of_uneven_exposures_are_the_time():
    _, stamps = stamps_with_jitter()
    clock, said = chosen_clock(BASE, stamps, rows_of(stamps, 3.0), 1)
    np.testing.assert_allclose(clock.seconds(stamps), stamps, atol=1e-9)
    assert [finding.code for finding in said] == ["time-stamps-uneven"]
    assert "smoother by the stamps" in said[0].text


def test_stamps_of_arrival_give_way_to_the_even_rate_of_the_sensor():
    even, stamps = stamps_with_jitter()
    clock, said = chosen_clock(BASE, stamps, rows_of(even, 3.0), 1)
    np.testing.assert_allclose(clock.seconds(stamps), even, atol=1e-9)
    assert [finding.code for finding in said] == ["time-stamps-late"]


def test_each_sample_counts_by_its_own_sd():
    """Sd that differ by some per cent from sample to sample, as real ones do, are weights, not a scale of positions."""
    even, stamps = stamps_with_jitter()
    rows = rows_of(even, 3.0)
    rows.values[[SD_X, SD_Y]] *= np.random.default_rng(2).uniform(0.8, 1.25, (2, N, 1))
    clock, said = chosen_clock(BASE, stamps, rows, 1)
    assert [finding.code for finding in said] == ["time-stamps-late"]
    np.testing.assert_allclose(clock.seconds(stamps), even, atol=1e-9)


def test_where_nothing_moves_the_stamps_stand_and_it_is_said():
    even, stamps = stamps_with_jitter()
    clock, said = chosen_clock(BASE, stamps, rows_of(even, 0.0), 1)
    np.testing.assert_allclose(clock.seconds(stamps), stamps, atol=1e-9)
    assert "no track is fast enough to decide" in said[0].text


@pytest.mark.parametrize("lines", [1, 2])
def test_even_stamps_are_a_grid_without_a_word(lines):
    even = np.round(np.arange(N) / float(RATE), 3)
    clock, said = chosen_clock(TimeBase(RATE, RATE, tick=1e-3), even, rows_of(np.repeat(even, lines), 3.0), lines)
    assert clock.constant
    assert not said


def frame(index, time):
    return Frame(index, time, np.zeros((1, 1), np.uint8), False, None)


def test_a_frame_of_two_fields_is_two_samples_and_the_second_is_half_a_frame_later():
    stamps = Stamps()
    stamps.add([frame(4, Fraction(0)), frame(7, Fraction(1, 10))])
    both = sample_moments(stamps, "bottom")
    assert both.frame.tolist() == [4, 4, 7, 7]
    assert both.field.tolist() == ["bottom", "top", "bottom", "top"]
    assert both.offset.tolist() == [0, 0.5, 0, 0.5]
    assert both.time.tolist() == [0, 0, 0.1, 0.1]
    assert sample_moments(stamps, "frame").field.tolist() == ["frame", "frame"]


def test_a_rate_that_varies_is_said_with_its_steps():
    steps = np.random.default_rng(4).choice([25.0, 33.0, 33.0, 42.0, 67.0], N - 1) / 1000
    stamps = np.concatenate([[0.0], np.cumsum(steps)])
    clock, (said,) = chosen_clock(BASE, stamps, rows_of(stamps, 3.0), 1)
    np.testing.assert_allclose(clock.seconds(stamps), stamps, atol=1e-9)
    assert said.code == "picture-rate-varies"
    assert said.level == "note"
    assert "25 to 67 ms apart" in said.text
