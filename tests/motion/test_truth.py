"""Names of the truth against places, and what the errors come to."""

import numpy as np
import pytest

from vidtrack.motion.truth import by_place, error_sizes, exchanged

T = np.arange(40) / 30


def paths(names, shift=0.0, z=0.0, late=0.0):
    places = {n: np.stack([10.0 * k + np.sin(3 * T), 2.0 * k + T, 0 * T + z], axis=-1) for k, n in enumerate(names)}
    return {n: (T + late, p + np.array([shift, 0, 0])) for n, p in places.items()}


SAME = {n: n for n in ("a", "b", "c")}


def test_names_that_agree_with_places_stay():
    assert by_place(paths("abc", 0.1), paths("abc"), SAME) is None


@pytest.mark.parametrize("z", [0.0, np.nan])
def test_names_that_contradict_places_are_matched_by_place(z):
    pairs = by_place(paths("bca", 0.05, z), paths("abc", z=0.0), SAME)
    assert pairs == {"b": "a", "c": "b", "a": "c"}
    finding = exchanged(pairs)
    assert (finding.level, finding.code) == ("doubtful", "truth-names-differ")
    assert "b is where truth.csv has a" in finding.text
    assert exchanged(pairs, named=False).level == "note"


def test_a_truth_of_another_place_or_time_is_not_matched():
    assert by_place(paths("abc", 300.0), paths("abc"), SAME) is None
    assert by_place(paths("abc", late=900.0), paths("abc"), SAME) is None


def test_sizes_of_errors_are_those_of_their_definition():
    e = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    z = np.array([[1.0, 2.0, np.nan], [1.0, 0.0, np.nan]])
    about = error_sizes(e, z, 100.0)
    assert (about["n"], about["mean"], about["max"], about["one_over"]) == (2, 2.5, 5.0, 40.0)
    assert about["rms"] == pytest.approx(np.sqrt(12.5))
    assert about["normalised_variance"] == pytest.approx({"x": 1.0, "y": 2.0})
