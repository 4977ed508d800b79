"""Only what depends on a change runs again (section 5 of the experiment folder's contract)."""

import base64
import copy
import json
import os
import re
import shutil
import subprocess
import sys
import time

import pandas as pd
import pyarrow.parquet as pq
import pytest

from tests.whole_workflow.conftest import CONFIG, REPO, configure, planned, snakemake
from vidtrack.workflow.direct_jobs import command_of
from vidtrack.workflow.fingerprint import REMEMBERED, Checksums

CALIBRATED_ANEW = {
    "calibrate": 1,
    "back_project": 1,
    "overlay": 2,
    "locate": 2,
    "kinematics": 2,
    "compare": 2,
    "verdict": 1,
    "report": 1,
    "report_run": 2,
    "report_calibration": 1,
    "steadiness": 2,
}


JUDGED_ANEW = {"verdict": 1, "report": 1}
ONE_PAGE = {**JUDGED_ANEW, "report_run": 1}
ALL_PAGES = {**JUDGED_ANEW, "report_run": 2}


def changed(path, value):
    config = copy.deepcopy(CONFIG)
    *way, last = path.split(".")
    place = config
    for part in way:
        place = place.setdefault(part, {})
    place[last] = value
    return config


def test_nothing_to_do_plans_nothing(laboratory):
    assert planned(laboratory) == {}


def test_what_is_finished_is_not_gone_through_again_and_can_be_asked_for(laboratory):
    assert snakemake(laboratory).returncode == 0  # notes that nothing is to be done
    assert snakemake(laboratory, "-n", "--debug-dag").stderr.count("candidate job") <= 1
    assert planned(laboratory, "--forceall")["track"] == 4
    assert planned(laboratory, "--forcerun", "compare")["compare"] == 2
    os.remove(laboratory / "results/runs/pluck/kinematics.parquet")
    assert planned(laboratory)["kinematics"] == 1


def test_that_nothing_is_to_be_done_is_noted_in_the_folder_that_is_named(laboratory, tmp_path, monkeypatch):
    """Named relative to where Snakemake is called, which it has come back to when the note is written."""
    note, away = laboratory / ".snakemake/vidtrack/finished", tmp_path / "desk"
    note.unlink(missing_ok=True)
    away.mkdir()
    monkeypatch.chdir(away)
    rooms = tmp_path / "rooms"
    rooms.mkdir()
    os.utime(rooms, (0, 0))
    with monkeypatch.context() as there:
        there.setenv("TMPDIR", str(rooms))
        assert snakemake(os.path.relpath(laboratory)).returncode == 0
    assert note.exists()
    # the server of small jobs is started while Snakemake plans: it was there, though no job was to be done
    assert rooms.stat().st_mtime > 0
    assert list(rooms.iterdir()) == []
    # of files that were only touched since, the checksums are computed once, not in each call
    os.utime(laboratory / "runs/pluck/cam1.mov")
    assert snakemake(os.path.relpath(laboratory)).returncode == 0
    monkeypatch.chdir(laboratory)
    assert Checksums(REMEMBERED).knows("runs/pluck/cam1.mov")
    assert list(away.iterdir()) == []


def test_jobs_that_decode_nothing_are_asked_of_the_server_without_a_shell(laboratory):
    said = snakemake(laboratory, "-n", "-p", "--forceall").stdout
    commands = re.findall(r"^Shell command: (.*?)(?=^\[|^$|^Job stats|\Z)", said, re.MULTILINE | re.DOTALL)
    understood = [command_of(f"set -euo pipefail;  {command.strip()}") for command in commands if "vidtrack" in command]
    assert {"track", "calibrate", "locate", "report_run", "verdict"} <= {command.arguments[0] for command in understood}
    benchmarks = [pd.read_csv(path, sep="\t") for path in laboratory.glob("results/.benchmarks/*/still.tsv")]
    most = max(table["max_rss"].max() for table in benchmarks)
    assert most > 40  # MB: of the job itself, and not of one that waits for it


def test_an_edited_rule_runs_again(laboratory, another_house):
    assert snakemake(laboratory).returncode == 0
    rules = another_house / "workflow/rules/comparison.smk"
    rules.write_text(rules.read_text().replace("python -m vidtrack compare ", "python -m vidtrack compare  "))
    assert planned(laboratory, "-s", str(another_house / "Snakefile"))["compare"] == 2


@pytest.mark.parametrize(
    ("path", "value", "jobs"),
    [
        ("cameras.cam1.Cx", 250, CALIBRATED_ANEW),
        (
            "runs.pluck.threshold",
            90,
            {"track": 2, "steadiness": 1, "locate": 1, "kinematics": 1, "compare": 1, **ONE_PAGE},
        ),
        (
            "cameras.cam1.clock",
            {"offset_s": 0.1},
            {"locate": 2, "kinematics": 2, "compare": 2, **ALL_PAGES},
        ),
        ("runs.pluck.reference", {"value": "x_in", "axis": "y"}, {"compare": 1, **ONE_PAGE}),
    ],
)
def test_a_setting_reruns_what_uses_it_and_what_follows(laboratory, path, value, jobs):
    configure(laboratory, changed(path, value))
    assert planned(laboratory) == jobs


def test_reordered_keys_and_whole_numbers_for_decimals_rerun_nothing(laboratory):
    config = {key: CONFIG[key] for key in reversed(CONFIG)}
    config["cameras"] = {name: {"sensor": [8.8, 6.60]} for name in ("cam2", "cam1")}
    config["detect"] = {"box": [50, 50], "threshold": "auto"}
    configure(laboratory, config)
    assert planned(laboratory) == {}


def test_touched_and_copied_files_rerun_nothing(laboratory):
    for folder, _, names in os.walk(laboratory):
        for name in names:
            if ".snakemake" not in folder:
                os.utime(os.path.join(folder, name))
    video = laboratory / "runs/pluck/cam1.mov"
    shutil.copyfile(video, laboratory / "copy.mov")
    os.replace(laboratory / "copy.mov", video)
    assert planned(laboratory) == {}


def test_a_moved_folder_reruns_nothing(laboratory, tmp_path):
    elsewhere = tmp_path / "another shelf" / "lab"
    elsewhere.parent.mkdir()
    shutil.move(laboratory, elsewhere)
    assert planned(elsewhere) == {}


def test_a_run_dropped_into_runs_is_processed_and_nothing_else(laboratory):
    shutil.copytree(laboratory / "runs/still", laboratory / "runs/again")
    assert planned(laboratory) == {"track": 2, "steadiness": 1, "locate": 1, "kinematics": 1, "compare": 1, **ONE_PAGE}


def test_a_run_taken_away_leaves_the_first_page_to_be_written_and_takes_its_own_with_it(laboratory):
    shutil.rmtree(laboratory / "runs/still")
    assert planned(laboratory) == JUDGED_ANEW
    others = laboratory / "results/report/run_pluck.html", laboratory / "results/report/calibration.html"
    before = [page.read_bytes() for page in others]
    answer = snakemake(laboratory)
    assert answer.returncode == 0, answer.stderr
    assert not (laboratory / "results/report/run_still.html").exists()
    assert [page.read_bytes() for page in others] == before


def test_an_edited_survey_recalibrates_and_decodes_no_run(laboratory):
    points = laboratory / "calibration/points.csv"
    lines = points.read_text().splitlines()
    tag, x, *rest = lines[1].split(",")
    points.write_text("\n".join([lines[0], ",".join([tag, str(float(x) + 0.01), *rest]), *lines[2:], ""]))
    jobs = planned(laboratory)
    assert "track" not in jobs
    assert jobs["calibration_points"] == 2
    assert jobs["calibrate"] == 2


def test_an_edited_recording_reruns_its_camera(laboratory):
    video = laboratory / "runs/pluck/cam1.mov"
    video.write_bytes(video.read_bytes() + b"\0")
    assert planned(laboratory)["track"] == 1


def test_a_lost_output_is_made_again(laboratory):
    (laboratory / "results/runs/still/kinematics.parquet").unlink()
    assert planned(laboratory) == {"kinematics": 1, **ONE_PAGE}


def test_results_do_not_depend_on_the_day(laboratory):
    table = laboratory / "results/runs/still/trajectories.parquet"
    record = laboratory / "results/calibration/cam1/camera.json"
    before = table.read_bytes(), record.read_bytes()
    targets = [str(path.relative_to(laboratory)) for path in (table, record)]
    answer = snakemake(laboratory, "--forceall", *targets)
    assert answer.returncode == 0, answer.stderr
    assert (table.read_bytes(), record.read_bytes()) == before


@pytest.fixture
def another_house(tmp_path):
    """The repo's code, copied, so that a test may edit it."""
    house = tmp_path / "house"
    for name in ("vidtrack", "workflow", "profiles"):
        shutil.copytree(REPO / name, house / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(REPO / "Snakefile", house)
    return house


def test_editing_a_stage_reruns_it_and_what_follows_and_a_comment_reruns_nothing(laboratory, another_house):
    stage = another_house / "vidtrack/stages/compare.py"
    stage.write_text("# a remark\n" + stage.read_text())
    assert planned(laboratory, "-s", str(another_house / "Snakefile")) == {}
    stage.write_text(stage.read_text() + "\nEDITED = True\n")
    assert planned(laboratory, "-s", str(another_house / "Snakefile")) == {"compare": 2, **ALL_PAGES}


def test_an_edited_template_rewrites_every_page(laboratory, another_house):
    template = another_house / "vidtrack/report/templates/page.html"
    template.write_text(template.read_text() + "<!-- edited -->")
    assert planned(laboratory, "-s", str(another_house / "Snakefile")) == {
        "report": 1,
        "report_run": 2,
        "report_calibration": 1,
    }


def test_another_version_of_a_library_reruns_the_rules_that_use_it(laboratory, tmp_path, monkeypatch):
    """PyAV reads recordings: no calibration is computed with it, but all of them begin with one."""
    installed = tmp_path / "site/av-99.0.dist-info"
    installed.mkdir(parents=True)
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: av\nVersion: 99.0\n")
    monkeypatch.setenv("PYTHONPATH", str(installed.parent))
    targets = ["results/runs/still/centroids/cam1.parquet", "results/report.html"]
    assert planned(laboratory, targets[0]) == {"track": 1}
    jobs = planned(laboratory, targets[1])
    assert (jobs["track"], jobs["calibration_points"]) == (4, 2)


def contents(folder):
    """Every file outside of .snakemake, with its date and what it holds."""
    return {
        str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.read_bytes())
        for path in folder.rglob("*")
        if path.is_file() and ".snakemake" not in path.parts
    }


@pytest.mark.parametrize("call", ["-n", "--list", "--lint", "--unlock", "--summary", "--dag"])
def test_reading_the_workflow_writes_nothing(laboratory, call):
    shutil.rmtree(laboratory / ".snakemake")
    configure(laboratory, changed("runs.pluck.threshold", 90))
    before = contents(laboratory)
    snakemake(laboratory, call)
    assert contents(laboratory) == before
    assert not (laboratory / ".snakemake/vidtrack").exists()


def threshold_used(folder, table):
    provenance = json.loads(pq.read_schema(folder / table).metadata[b"provenance"])
    return provenance["settings"]["detect"]["threshold"]


def test_an_edit_while_a_job_runs_is_done_afterwards(laboratory):
    """The job that runs was asked with the old settings and ends after the edit: its output is newer than all."""
    table = "results/runs/still/centroids/cam1.parquet"
    configure(laboratory, changed("runs.still.threshold", 90))
    command = [sys.executable, "-m", "snakemake", "-s", str(REPO / "Snakefile"), "--directory", str(laboratory)]
    with subprocess.Popen([*command, "--cores", "1", table], stderr=subprocess.PIPE, text=True) as running:
        assert any("Following the targets of still" in line for line in running.stderr)
        configure(laboratory, changed("runs.still.threshold", 120))
        planned(laboratory)
        running.communicate()
    assert running.returncode == 0
    assert threshold_used(laboratory, table) == 90
    assert planned(laboratory, table) == {"track": 1}
    assert snakemake(laboratory, table).returncode == 0
    assert threshold_used(laboratory, table) == 120
    assert planned(laboratory, table) == {}


def test_a_call_that_is_locked_out_changes_nothing(laboratory):
    locks = laboratory / ".snakemake/locks"
    locks.mkdir(exist_ok=True)
    (locks / "0.output.lock").write_text("results/report.html\n")
    configure(laboratory, changed("runs.pluck.reference", {"value": "x_in", "axis": "y"}))
    before = contents(laboratory)
    answer = snakemake(laboratory)
    assert answer.returncode == 1
    assert answer.stderr.splitlines()[-1].startswith("vidtrack: a snakemake that worked in this folder was killed")
    assert contents(laboratory) == before
    assert planned(laboratory) == {"compare": 1, **ONE_PAGE}


def test_another_spelling_of_the_folder_reruns_nothing(laboratory, tmp_path):
    """From another folder, whose Snakemake has no record of these results, by a path that begins elsewhere."""
    elsewhere = tmp_path / "desk"
    elsewhere.mkdir()
    for spelling in (str(laboratory), "../desk/../lab/"):
        configure(elsewhere, {"experiment": spelling, **CONFIG})
        assert planned(elsewhere) == {}
    configure(elsewhere, {"experiment": "../lab", **changed("cameras.cam1.Cx", 250)})
    assert planned(elsewhere) == CALIBRATED_ANEW


@pytest.fixture
def a_copy(laboratory, tmp_path):
    """The laboratory copied without Snakemake's records, every file with the date of the copy, newest inputs last."""
    folder = tmp_path / "copied"
    shutil.copytree(laboratory, folder, copy_function=shutil.copyfile, ignore=shutil.ignore_patterns(".snakemake"))
    for path in (*folder.glob("calibration/*/*"), *folder.glob("results/calibration/cam1/*")):
        path.touch()
    return folder


def test_a_folder_copied_without_snakemakes_records_reruns_nothing(a_copy):
    assert planned(a_copy) == {}


def test_a_setting_changed_in_a_copied_folder_reruns_what_uses_it(a_copy):
    configure(a_copy, changed("cameras.cam1.Cx", 250))
    assert planned(a_copy) == CALIBRATED_ANEW


def test_a_recording_changed_in_a_copied_folder_reruns_its_camera(a_copy):
    video = a_copy / "runs/pluck/cam1.mov"
    video.write_bytes(video.read_bytes() + b"\0")
    assert planned(a_copy) == {"track": 1, "steadiness": 1, "locate": 1, "kinematics": 1, "compare": 1, **ONE_PAGE}


def test_dates_from_the_future_hide_no_edit(laboratory):
    for path in laboratory.joinpath("results").rglob("*"):
        os.utime(path, (4e9, 4e9))
    assert planned(laboratory) == {}
    configure(laboratory, changed("cameras.cam1.Cx", 250))
    assert planned(laboratory) == CALIBRATED_ANEW


def test_what_an_interrupted_call_left_to_do_is_done_whatever_the_dates(laboratory):
    configure(laboratory, changed("cameras.cam1.Cx", 250))
    for path in laboratory.joinpath("results").rglob("*"):
        os.utime(path, (4e9, 4e9))
    assert snakemake(laboratory, "results/calibration/cam1/camera.json").returncode == 0
    jobs = planned(laboratory)
    assert jobs == {rule: n for rule, n in CALIBRATED_ANEW.items() if rule != "calibrate"}


def test_a_result_that_was_altered_is_made_again(laboratory):
    camera = laboratory / "results/calibration/cam1/camera.json"
    camera.write_text(camera.read_text().replace("cam1", "cam2"))
    os.utime(camera, (1e9, 1e9))
    assert planned(laboratory) == CALIBRATED_ANEW


def test_the_setting_that_changed_is_printed(laboratory):
    configure(laboratory, changed("runs.pluck.reference", {"value": "x_in", "axis": "y"}))
    said = snakemake(laboratory, "-n").stdout
    (line,) = [line for line in said.splitlines() if "Params have changed" in line]
    before, now = line.split(" now: ")
    assert '"axis":"x"' in before
    assert '"axis":"y"' in now


def test_what_lived_on_when_snakemake_was_killed_runs_again_and_all_that_rests_on_it(laboratory):
    """The job's account is good, Snakemake's own mark says that it never ended: readers that miss were passed over."""
    marks = laboratory / ".snakemake/incomplete"
    marks.mkdir(exist_ok=True)
    for name in ("camera.json", "points.parquet", "search.parquet"):
        key = base64.b64encode(f"results/calibration/cam1/{name}".encode()).decode()
        (marks / key).write_text("{}")
    shutil.rmtree(laboratory / "results/runs")
    (laboratory / "results/verdict.json").unlink()
    jobs = planned(laboratory)
    assert jobs["calibrate"] == 1
    assert {"track", "locate", "back_project", "verdict", "report"} <= set(jobs)


def test_after_a_snakemake_that_was_killed_a_plain_call_finishes(laboratory):
    (laboratory / "results/report/run_pluck.html").unlink()
    holder = laboratory / ".snakemake/locks/holder.json"
    command = [sys.executable, "-m", "snakemake", "-s", str(REPO / "Snakefile"), "--directory", str(laboratory)]
    with subprocess.Popen([*command, "--cores", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as killed:
        until = time.monotonic() + 60
        while not holder.exists():
            assert killed.poll() is None
            assert time.monotonic() < until
            time.sleep(0.01)
        killed.kill()
    again = snakemake(laboratory)
    assert again.returncode == 0, again.stderr
    assert f"vidtrack: removed the lock of a snakemake that was killed (process {killed.pid})" in again.stderr
    assert (laboratory / "results/report/run_pluck.html").exists()
    assert not list(laboratory.rglob(".*.partial"))
