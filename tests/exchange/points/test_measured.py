import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.measured import Measured, as_reference, as_truth

P = np.array([[[25.4, 50.8, 0.0], [1.0, 2, 3]], [[np.nan] * 3, [4, 5, 6]]])
OWN = Measured("C3D", ("a", "b"), P, np.array([0.0, 0.01]), "mm", 36000.0)


def test_truth_has_a_row_for_each_point_that_was_seen_in_the_unit_of_the_experiment():
    table = as_truth(OWN, "in", None, "runs.a.truth")
    assert table["target"].tolist() == ["a", "b", "b"]
    assert table["time_s"].tolist() == [36000.0, 36000.0, 36000.01]
    assert table.loc[0, ["x", "y", "z"]].tolist() == pytest.approx([1, 2, 0])


def test_a_reference_has_three_columns_a_point():
    table = as_reference(OWN, "mm", None, "runs.a.reference")
    assert list(table) == ["time_s", "a_x", "a_y", "a_z", "b_x", "b_y", "b_z"]
    assert as_reference(OWN, "mm", 5.0, "here")["time_s"].tolist() == [0.0, 0.01]


def test_when_a_file_began_is_asked_for_by_its_key_and_so_is_its_unit():
    none = Measured("C3D", OWN.names, P, OWN.time_s, "mm", None)
    with pytest.raises(VidtrackError, match=r"config.yaml: runs\.a\.truth\.offset_s: "):
        as_truth(none, "in", None, "runs.a.truth")
    assert as_truth(none, "mm", 7.0, "runs.a.truth")["time_s"].iloc[0] == 7
    with pytest.raises(VidtrackError, match="states no unit of length"):
        as_truth(Measured("C3D", OWN.names, P, OWN.time_s, None, 0.0), "in", None, "runs.a.truth")
