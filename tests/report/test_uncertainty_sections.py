"""The uncertainty statement as tables."""

from tests.analysis.test_uncertainty import AXES, BUDGET, motions
from vidtrack.analysis.uncertainty import uncertainty_statement
from vidtrack.report.uncertainty_sections import uncertainty_tables


def test_there_is_a_table_of_positions_and_one_of_each_point():
    stated = uncertainty_statement(BUDGET, motions(point=0.26), AXES)
    positions, origin, cog = uncertainty_tables(stated, "m")
    assert [row[0] for row in positions.rows] == ["x (m)", "y (m)", "z (m)"]
    assert positions.rows[0][1:4] == ["0.3", "0.1", "0.2"]
    assert positions.header[-2:] == ["what dominates", "what would halve it"]
    assert "lever arm" not in origin.header
    assert "lever arm" in cog.header
    assert "CoG" in cog.caption
    assert [row[0] for row in cog.rows][3] == "roll (deg)"


def test_what_is_not_stated_has_no_table():
    assert uncertainty_tables(uncertainty_statement(None, {}, {}), "m") == []
