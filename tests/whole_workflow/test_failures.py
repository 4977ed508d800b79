"""A job that fails costs what depends on it, and no more: the rest, the verdict and the report finish, exit code 1."""

import json
import shutil

import pandas as pd
import pytest

from tests.whole_workflow.conftest import CONFIG, REPO, configure, planned, snakemake
from tests.whole_workflow.test_reruns import ONE_PAGE, changed

OUTSIDE = "camera,target,Xf,Yf\ncam1,t1,5000,5000\n"


def verdict(folder):
    return json.loads((folder / "results/verdict.json").read_text())


def test_a_run_that_fails_costs_that_run(laboratory):
    configure(laboratory, changed("runs.pluck.reference", {"value": "x_in", "axis": "auto"}))
    targets = laboratory / "runs/still/targets.csv"
    targets.write_text(OUTSIDE)
    answer = snakemake(laboratory)
    assert answer.returncode == 1
    own = verdict(laboratory)["runs"]
    assert own["still"]["verdict"] == "failed"
    assert "runs/still/targets.csv, line 2" in own["still"]["reasons"][0]["text"]
    assert own["pluck"]["verdict"] != "failed"
    comparison = json.loads((laboratory / "results/runs/pluck/comparison.json").read_text())
    assert comparison["provenance"]["settings"]["axis"] == "auto"
    assert "runs/still/targets.csv, line 2" in (laboratory / "results/report.html").read_text()
    last = [line for line in answer.stderr.splitlines() if line.startswith("vidtrack: ")][-5:]
    assert last[0].startswith("vidtrack: run still: failed: runs/still/targets.csv, line 2")
    assert last[-2:] == [
        "vidtrack: results/runs/still/trajectories.csv and 9 more files are of an earlier call, not of this one: do "
        "not use them (see OUTDATED.txt there).",
        "vidtrack: report: results/report.html",
    ]
    assert not (laboratory / "results/runs/still/centroids/cam1.parquet").exists()

    follows = {"steadiness": 1, "locate": 1, "kinematics": 1, "compare": 1, **ONE_PAGE}
    assert planned(laboratory) == {"track": 1, **follows}
    targets.unlink()
    jobs = planned(laboratory)
    assert jobs == {"track": 2, **follows}


@pytest.fixture
def house_that_fails(tmp_path):
    """The repo's code, copied, in which job compare does what a test writes there."""

    def built(line):
        house = tmp_path / "house"
        for name in ("vidtrack", "workflow", "profiles"):
            shutil.copytree(REPO / name, house / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(REPO / "Snakefile", house)
        job = house / "vidtrack/jobs/compare.py"
        job.write_text(job.read_text().replace("    order = job.settings\n", f"    {line}\n    order = job.settings\n"))
        return house / "Snakefile"

    return built


def test_an_unexpected_error_and_a_job_that_is_killed_stand_in_the_verdict(laboratory, house_that_fails):
    """Of run still the job raises what nobody expected, of run pluck it is killed."""
    by_run = 'exec("raise RuntimeError(\'three is no colour\')" if job.settings["run"] == "still" else KILLED)'
    killed = 'KILLED = "import os; os.kill(os.getpid(), 9)"'
    answer = snakemake(laboratory, "-s", str(house_that_fails(f"{killed}; {by_run}")))
    assert answer.returncode == 1
    assert "Traceback" not in answer.stderr
    log = (laboratory / "results/logs/compare/still.log").read_text()
    assert "Traceback (most recent call last)" in log
    runs = verdict(laboratory)["runs"]
    assert "three is no colour" in runs["still"]["reasons"][0]["text"]
    assert "results/logs/compare/still.log" in runs["still"]["reasons"][0]["text"]
    assert "compare pluck ended without a message" in runs["pluck"]["reasons"][0]["text"]
    for run in ("pluck", "still"):
        assert (laboratory / f"results/runs/{run}/kinematics.parquet").exists()


def test_a_calibration_that_fails_is_told_of_the_runs_that_use_it(laboratory):
    configure(laboratory, changed("calibration.fix", {"f": -3.0}))
    points = laboratory / "calibration/points.csv"
    lines = points.read_text().splitlines()
    points.write_text("\n".join([*lines[:5], *(f"{line.split(',')[0]},0,0,0,0.03" for line in lines[5:]), ""]))
    answer = snakemake(laboratory)
    assert answer.returncode == 1
    said = verdict(laboratory)
    assert said["calibration"]["verdict"] == "failed"
    assert {own["verdict"] for own in said["runs"].values()} <= {"bad", "failed"}
    assert "Traceback" not in answer.stdout + answer.stderr

    # what an earlier call located is kept, and said to be of an earlier call wherever it may be read
    old = laboratory / "results/runs/pluck/trajectories.csv"
    assert old.exists()
    assert "runs/pluck/trajectories.csv" in said["outdated"]
    assert not any("centroids" in place for place in said["outdated"])
    assert "results-outdated" in [reason["code"] for reason in said["runs"]["pluck"]["reasons"]]
    assert "of an earlier call" in (laboratory / "results/report.html").read_text()
    assert "of an earlier call, not of this one" in answer.stderr
    note = old.with_name("OUTDATED.txt")
    assert "runs/pluck/trajectories.csv" in note.read_text().splitlines()

    configure(laboratory, CONFIG)
    points.write_text("\n".join([*lines, ""]))
    assert snakemake(laboratory).returncode == 0
    assert "outdated" not in verdict(laboratory)
    assert not note.exists()
    assert old.exists()


def test_a_camera_whose_points_cannot_be_named_costs_that_camera_where_two_others_are_left(laboratory):
    """A third camera that stands where the second does, and whose picks are wrong."""
    for film in [*laboratory.glob("calibration/*/cam2.mov"), *laboratory.glob("runs/*/cam2.mov")]:
        shutil.copy(film, film.with_name("cam3.mov"))
    configure(laboratory, changed("cameras.cam3", {"sensor": [8.8, 6.6]}))
    picks = next(laboratory.glob("calibration/*/picks.csv"))
    head, *rows = [line.split(",") for line in picks.read_text().splitlines()]
    camera, x = head.index("camera"), head.index("Xf")
    wrong = [[*row] for row in rows if row[camera] == "cam2"]
    for row in wrong:
        row[camera], row[x] = "cam3", "99999"
    picks.write_text("".join(",".join(row) + "\n" for row in [head, *rows, *wrong]))
    before = pd.read_parquet(laboratory / "results/runs/pluck/trajectories.parquet")
    answer = snakemake(laboratory)
    assert answer.returncode == 1
    said = verdict(laboratory)
    assert {name: own["verdict"] == "failed" for name, own in said["calibration"]["cameras"].items()} == {
        "cam1": False,
        "cam2": False,
        "cam3": True,
    }
    texts = [reason["text"] for reason in said["calibration"]["cameras"]["cam3"]["reasons"]]
    assert f"calibration/{picks.parent.name}/picks.csv, line" in texts[0]
    assert "outside the picture" in texts[0]
    assert len(texts) == len(set(texts))
    assert "outside the picture" in (laboratory / "results/report.html").read_text()
    for name, own in said["runs"].items():
        assert own["verdict"] == "doubtful"
        (reason,) = [reason for reason in own["reasons"] if reason["code"] == "camera-left-out"]
        assert "without cam3: its calibration failed" in reason["text"]
        assert "without cam3" in (laboratory / f"results/report/run_{name}.html").read_text()
    after = pd.read_parquet(laboratory / "results/runs/pluck/trajectories.parquet")
    pd.testing.assert_frame_equal(after, before)
    last = [line for line in answer.stderr.splitlines() if line.startswith("vidtrack: ")]
    assert "vidtrack: run pluck: going on without cam3: its calibration failed" in last
    assert last[-1] == "vidtrack: report: results/report.html"
    assert planned(laboratory)["locate"] == 2
