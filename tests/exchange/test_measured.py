"""Tables as arrays, and what counts as even in time."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.exchange.runs import RATE, run, times, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import evenly, filled_gaps, series


def test_a_table_becomes_arrays_over_moments_and_targets():
    s = series(trajectories())
    assert s.names == ("bow", "Bälle é", "stern")
    assert s.time.shape == (55,)
    assert s.present.sum() == 55 * 3 - 1
    own = trajectories().query("target == 'stern'")
    np.testing.assert_array_equal(s.stacked("x", "y", "z")[:, 2], own[["x", "y", "z"]])
    assert s.columns["flag"][5, 1] == "lost;cam1:edge"


def test_a_target_without_a_row_is_missing():
    s = series(trajectories())
    assert not s.present[7, 0]
    assert np.isnan(s.stacked("x")[7, 0])


def test_two_rows_of_a_target_at_one_moment_are_refused():
    table = trajectories()
    with pytest.raises(VidtrackError, match="two rows at one moment"):
        series(pd.concat([table, table.iloc[:1]]))


def test_rows_at_moments_that_are_not_wanted_are_refused_and_not_dropped():
    with pytest.raises(VidtrackError, match=r"at moments that trajectories\.parquet lacks"):
        series(trajectories(), "target", times(60)[:30])


def test_a_table_without_rows_has_no_moments():
    s = series(trajectories(names=()))
    assert s.time.shape == (0,)
    assert s.names == ()


@given(
    st.floats(1.0, 2000.0),
    st.lists(st.integers(1, 40), min_size=1, max_size=60),
    st.floats(0.0, 86400.0),
)
def test_the_grid_gives_each_moment_its_place_whatever_the_gaps(rate, steps, start):
    index = np.concatenate([[0], np.cumsum([1, 1, 1, *steps, 1, 1, 1, 1])])
    if np.median(np.diff(index)) != 1:
        return
    even = evenly(np.round(start + index / rate, 6), "r", "C3D")
    np.testing.assert_array_equal(even.index, index)
    assert even.rate == pytest.approx(rate, rel=3e-6 * rate)
    assert even.length == index[-1] + 1


def test_a_long_record_keeps_its_rate():
    t = np.round(40000 + np.arange(100_000) / RATE, 6)
    even = evenly(t, "r", "C3D")
    assert even.rate == pytest.approx(RATE, rel=1e-10)
    assert even.length == 100_000


@pytest.mark.parametrize("bad", ["jitter", "two rates", "half a frame late"])
def test_samples_that_are_not_even_are_refused(bad):
    t = times(60)
    if bad == "jitter":
        t = t + np.random.default_rng(0).normal(scale=1e-4, size=60)
    elif bad == "two rates":
        t = np.concatenate([t, t[-1] + np.arange(1, 30) / 25])
    else:
        t = np.concatenate([t[:30], t[30:] + 0.5 / RATE])
    with pytest.raises(VidtrackError, match="not even in time"):
        evenly(t, "r", "C3D")


@pytest.mark.parametrize(("n", "said"), [(0, "no sample"), (1, "one sample")])
def test_fewer_than_two_samples_have_no_rate(n, said):
    with pytest.raises(VidtrackError, match=said):
        evenly(times(60)[:n], "r", "C3D")


def test_gaps_are_filled_with_missing_values_and_said():
    s = series(trajectories())
    even = evenly(s.time, "r", "C3D")
    whole = even.filled(s.stacked("x"))
    assert whole.shape == (60, 3, 1)
    assert np.isnan(whole[20:25]).all()
    np.testing.assert_allclose(even.times()[[0, 59]], s.time[[0, -1]], atol=1e-6)
    assert filled_gaps(even, s.time) == ["5 moments at which there is no sample are missing points"]


@pytest.mark.parametrize(("units", "mm"), [("m", 1000.0), ("cm", 10.0), ("mm", 1.0), ("in", 25.4), ("ft", 304.8)])
def test_a_unit_is_worth_exactly_what_it_is_defined_to_be(units, mm):
    assert run(units).in_unit("mm") == mm
