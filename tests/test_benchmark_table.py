"""What the table of `python -m benchmarks` says of a row: ratios of neighbouring runs, and what became slower."""

import json

import pytest

from benchmarks.table import as_record, figure, lines, read_record, slower, verdict, write_record

MACHINE = {"cores": 2}


def row(ratio, spread=0.0, name="track"):
    return figure(
        name, "bare decode loop", [(ratio * (1 + s), 1.0) for s in (-2 * spread, -spread, 0.0, spread, 2 * spread)]
    )


def kept(*rows):
    return json.loads(json.dumps(as_record(rows, MACHINE)))


def test_a_ratio_is_of_each_round_and_not_of_the_medians():
    """The computer was three times as slow in the last round: both took longer."""
    measured = figure("track", "decode", [(2.0, 1.0), (2.0, 1.0), (6.0, 3.0)])
    assert measured.ratio == 2.0
    assert measured.spread == 0.0


@pytest.mark.parametrize(
    ("now", "last", "said"),
    [
        (1.0, 1.0, "as it was"),
        (1.14, 1.0, "as it was"),
        (1.2, 1.0, "SLOWER"),
        (1.0, 1.2, "faster"),
        (0.02, 0.01, "SLOWER"),
    ],
)
def test_a_row_is_slower_where_its_ratio_grew_by_more_than_a_seventh(now, last, said):
    before = kept(row(last))["figures"]["track / bare decode loop"]
    assert verdict(row(now), before) == said


def test_a_row_that_scatters_is_called_slower_only_beyond_its_scatter():
    before = kept(row(1.0, spread=0.1))["figures"]["track / bare decode loop"]
    assert verdict(row(1.3, spread=0.1), before) == "as it was"
    assert verdict(row(1.6, spread=0.1), before) == "SLOWER"


def test_the_table_shows_last_time_beside_it_and_names_what_is_new_slower_and_gone():
    last = kept(row(1.0), row(2.0, name="gone"))
    now = [row(1.5), row(3.0, name="other")]
    text = lines(now, last)
    assert "| 1 | +50 % | SLOWER |" in text[2]
    assert text[3].endswith("| - | - | new |")
    assert text[4] == "| gone / bare decode loop | | | | | 2 | | not measured |"
    assert slower(now, last) == ["track / bare decode loop"]


def test_the_first_table_of_all_has_nothing_to_be_compared_with():
    assert slower([row(1.0)], None) == []
    assert lines([row(1.0)], None)[2].endswith("new |")


def test_what_is_kept_is_read_again(tmp_path):
    assert read_record(tmp_path / "last.json") is None
    write_record(tmp_path / "last.json", as_record([row(1.23456789, spread=0.02)], MACHINE))
    record = read_record(tmp_path / "last.json")
    assert record["machine"] == MACHINE
    assert record["figures"]["track / bare decode loop"]["ratio"] == pytest.approx(1.235)
