"""Only what depends on a change runs again (section 5 of the experiment folder's contract)."""

import copy
import os
import shutil

import pytest

from tests.whole_workflow.conftest import CONFIG, REPO, configure, planned, snakemake

CALIBRATED_ANEW = {
    "calibrate": 1,
    "back_project": 1,
    "overlay": 2,
    "locate": 2,
    "kinematics": 2,
    "compare": 2,
    "verdict": 1,
    "report": 1,
}


JUDGED_ANEW = {"verdict": 1, "report": 1}


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


@pytest.mark.parametrize(
    ("path", "value", "jobs"),
    [
        ("cameras.cam1.Cx", 250, CALIBRATED_ANEW),
        (
            "runs.pluck.threshold",
            90,
            {"track": 2, "locate": 1, "kinematics": 1, "compare": 1, **JUDGED_ANEW},
        ),
        (
            "cameras.cam1.clock",
            {"offset_s": 0.1},
            {"locate": 2, "kinematics": 2, "compare": 2, **JUDGED_ANEW},
        ),
        ("runs.pluck.reference", {"value": "x_in", "axis": "y"}, {"compare": 1, **JUDGED_ANEW}),
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
    assert planned(laboratory) == {"track": 2, "locate": 1, "kinematics": 1, "compare": 1, **JUDGED_ANEW}


def test_a_run_taken_away_leaves_the_report_to_be_written(laboratory):
    shutil.rmtree(laboratory / "runs/still")
    assert planned(laboratory) == {"verdict": 1, "report": 1}


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
    assert planned(laboratory) == {"kinematics": 1, **JUDGED_ANEW}


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
    assert planned(laboratory, "-s", str(another_house / "Snakefile")) == {"compare": 2, **JUDGED_ANEW}
