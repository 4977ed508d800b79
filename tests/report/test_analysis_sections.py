"""What the page says of decay, waves and motions."""

import numpy as np

from tests.stages.test_analysis import AXES, body_in_waves, swinging
from vidtrack.files.records import plain
from vidtrack.report.analysis_sections import analysis_tables, warnings
from vidtrack.stages.analysis import analysis


def test_a_decay_is_one_table_rounded_to_its_interval():
    record = plain(analysis(swinging(np.random.default_rng(0)), decay={}, units="in").record)
    table, energy = analysis_tables(record, "in")
    value, width, _ = {row[0]: row[1:] for row in table.rows}["natural frequency fn (Hz)"]
    assert abs(float(value) - 0.8) < 2 * float(width)
    assert len(value) == len(width)  # as many digits as the interval has
    assert "t1.x" in table.caption
    assert [row[0] for row in energy.rows] == ["y", "z"]


def test_waves_and_motions_have_a_table_each():
    bodies, gauge = body_in_waves(np.random.default_rng(1))
    nothing = swinging(np.random.default_rng(2)).iloc[:0]
    done = analysis(nothing, bodies, gauge, axes=AXES, waves={"elevation": "eta"}, units="m")
    clock, motions, wave, responses, harmonics = analysis_tables(plain(done.record), "m")
    assert clock.rows[0] == ["joined by", "offset", ""]
    assert [row[0] for row in motions.rows][2] == "heave (m)"
    value, width = map(float, wave.rows[0][1].split(" ± "))
    assert abs(value - 2) < 2 * width < 1e-3
    assert [row[0] for row in responses.rows][2] == "float.heave (m)"
    assert [row[0] for row in harmonics.rows] == [row[0] for row in responses.rows]


def test_no_analysis_makes_no_table():
    assert analysis_tables({}, "m") == []


def test_few_samples_a_period_are_a_warning_above_the_tables_and_enough_are_none():
    few = {
        "waves": {"elevation": "eta", "samples_a_period": 120.0, "responses": {"b.heave": {"samples_a_period": 31.4}}}
    }
    (line,) = warnings(few)
    assert line.startswith("Warning: 31.4 samples a period of b.heave; 100")
    assert "and 1 more" in warnings({"waves": {**few["waves"], "samples_a_period": 50.0}})[0]
    assert warnings({"waves": {"elevation": "eta", "samples_a_period": 100.0}}) == []
    assert warnings({}) == []
