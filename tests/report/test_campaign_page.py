"""The page of a campaign: what its tables and curves show of the record."""

import pytest

from tests.analysis.test_campaign import RECORDS, ROWS
from vidtrack.analysis.campaign import campaign
from vidtrack.files.records import plain
from vidtrack.report.campaign_page import _curves, campaign_page

MADE = {"vidtrack": "1"}


@pytest.fixture(scope="module")
def page():
    return campaign_page(plain(campaign(ROWS, RECORDS)), units="m", title="tank", provenance=MADE)


def tables(page):
    return {table.caption: table for table in page.sections[0].tables}


def test_every_run_is_a_line_with_its_conditions_and_a_link_where_it_was_analysed(page):
    table = tables(page)["All runs"]
    assert [row[0] for row in table.rows] == [row["run"] for row in ROWS]
    assert table.header[:4] == ["run", "H asked (m)", "T asked (s)", "scale"]
    first = dict(zip(table.header, table.rows[0], strict=True))
    assert (first["H (m)"], first["T (s)"], first["notes"]) == ("0.100 ± 0.010", "1.200 ± 0.010", "calm")
    assert "run-w1" in page.links
    assert "run-later" not in page.links
    assert page.verdict is None


def test_curves_show_bodies_over_period_with_a_figure_for_each_unit(page):
    assert [figure.caption.rsplit("(", 1)[1] for figure in page.sections[0].figures] == ["m/m)", "deg/m)"]


def test_repeatability_pooled_decays_and_full_scale_have_their_tables(page):
    found = tables(page)
    heave = next(row for row in found["Repeatability"].rows if row[1] == "b.heave, RAO")
    assert heave[0] == "w1, w2, w3"
    assert (heave[2], heave[3], heave[5]) == ("3", "1.00", "0.1")
    assert found["Free decay, pooled over repeats"].rows[0][0] == "d1, d2"
    whole = found["At full scale, by Froude's law"]
    assert dict(zip(whole.header, whole.rows[0], strict=True))["T (s)"] == "6"
    each = found["Response at full scale, by Froude's law"]
    assert each.header == ["run", "scale", "motion", "RAO", "unit"]
    assert {row[2] for row in each.rows} == {"b.heave", "b.pitch"}
    assert {row[4] for row in each.rows} == {"m/m", "deg/m"}


def test_a_campaign_of_nothing_analysed_still_has_its_list():
    rows = [{"run": "a", "H": 0.1}]
    (table,) = campaign_page(plain(campaign(rows, {})), units="m", title="t", provenance=MADE).sections[0].tables
    assert table.rows == [["a", "0.1"]]


def test_each_body_has_its_curves_and_turns_are_shown_once():
    response = {"rao": {"value": 1.0, "half_width": 0.1}, "phase_deg": {"value": 20.0, "half_width": 1.0}}
    motions = {
        f"b{i}{at}.{dof}": unit
        for i in range(4)
        for at in ("", "@CoG")
        for dof, unit in (("heave", "m"), ("pitch", "deg"))
    }
    own = {name: {"unit": unit, **response} for name, unit in motions.items()}
    runs = {run: {"measured": {"T_s": {"value": T}}, "responses": own} for run, T in (("a", 1.0), ("b", 2.0))}
    found = _curves(runs, "m")
    assert list(found) == [(unit, f"b{i}") for unit in ("m/m", "deg/m") for i in range(4)]
    assert list(found["m/m", "b3"]) == ["b3.heave", "b3@CoG.heave"]
    assert list(found["deg/m", "b3"]) == ["b3.pitch"]
