"""What the verdict, the pages and the files of other programs get of the settings."""

import dataclasses

import pytest

from tests.workflow.test_orders import PLANE, config, experiment
from vidtrack.workflow import report_orders


def test_the_verdict_is_asked_of_each_run_that_lies_in_the_folder_by_its_mode():
    asked = report_orders.verdict(config(r1=PLANE), experiment(r1=["cam1"], r2=["cam1", "cam2"]))["runs"]
    assert (asked["r1"]["mode"], asked["r2"]["mode"]) == ("plane", "space")
    assert asked["r2"]["cameras"] == ["cam1", "cam2"]
    assert asked["r2"]["targets"] == 1


def test_the_verdict_knows_of_runs_that_are_still_to_be_made():
    asked = report_orders.verdict(config(r1=PLANE, later=PLANE), experiment(r1=["cam1"]))
    assert (list(asked["runs"]), asked["awaited"]) == (["r1"], ["later"])


def test_a_page_without_a_title_has_one():
    assert report_orders.report(config(), experiment(r1=["cam1"])) == {
        "title": "Experiment",
        "units": "in",
        "runs": ["r1"],
    }


def test_runs_that_no_table_lists_are_of_the_campaign_all_the_same():
    rows = report_orders.campaign_rows(config(), experiment(r1=["cam1"]))
    assert [(row["run"], row["listed"], row.get("H")) for row in rows] == [("r1", False, None)]


def test_a_table_of_runs_gives_their_conditions_and_blank_cells_are_none(tmp_path):
    table = tmp_path / "runs.csv"
    table.write_text("run,H,T\nr1,4.5,\n")
    found = dataclasses.replace(experiment(r1=["cam1"], r2=["cam1"]), campaign=str(table))
    first, second = report_orders.campaign_rows(config(), found)
    assert (first["run"], first["H"], first["T"], first["listed"]) == ("r1", 4.5, None, True)
    assert (second["run"], second["listed"]) == ("r2", False)


@pytest.mark.parametrize(("own", "wanted"), [({}, ("c3d",)), ({"export": ["trc"]}, ("trc",)), ({"export": []}, ())])
def test_a_run_that_names_formats_has_those_in_place_of_all_runs(own, wanted):
    settings = config(r1=own).model_copy(update={"export": ("c3d",)})
    assert tuple(report_orders.exported(settings, "r1")) == wanted
