"""A campaign: runs.csv beside the runs makes one more page, and only that; all pages as one file on request."""

import json

from tests.whole_workflow.conftest import planned, snakemake

RUNS = "run,H,T,heading,scale,repeat,notes\npluck,2.5,1.25,0,50,1,first\nstill,,,,,,\nlater,3,1.25,0,50,,not made yet\n"


def test_a_list_of_runs_makes_a_page_and_leaves_the_others_alone(laboratory):
    (laboratory / "runs.csv").write_text(RUNS)
    pages = {path: path.read_bytes() for path in laboratory.glob("results/report/*.html")}
    assert planned(laboratory) == {"campaign": 1, "report": 1}
    answer = snakemake(laboratory, "all", "results/report_one_file.html")
    assert answer.returncode == 0, answer.stderr
    assert {path: path.read_bytes() for path in pages} == pages
    record = json.loads((laboratory / "results/campaign.json").read_text())
    assert list(record["runs"]) == ["pluck", "still", "later"]
    assert record["runs"]["pluck"]["full_scale"]["H"] == 125
    assert record["runs"]["later"]["notes"] == "not made yet"
    assert 'href="report/campaign.html"' in (laboratory / "results/report.html").read_text()
    whole = (laboratory / "results/report_one_file.html").read_text()
    assert all(f'id="{name}"' in whole for name in ("report", "campaign", "calibration", "run_pluck", "run_still"))
    assert planned(laboratory) == {}


def test_a_name_that_is_nearly_that_of_a_run_is_refused(laboratory):
    (laboratory / "runs.csv").write_text("run,H\nplucks,1\n")
    answer = snakemake(laboratory, "-n")
    assert answer.returncode == 1
    assert "runs.csv: no run 'plucks' in runs/; did you mean 'pluck'?" in answer.stderr
