"""What a user can correct is reported in one line, with exit code 1, and leaves nothing half-written."""

import copy
import shutil
import subprocess
import sys

import pytest

from tests.whole_workflow.conftest import CONFIG, configure, snakemake


def told(folder, *arguments):
    """The lines that vidtrack says; Snakemake must fail with exit code 1 and show no traceback."""
    answer = snakemake(folder, *arguments)
    assert answer.returncode == 1
    assert "Traceback" not in answer.stderr + answer.stdout
    return [line for line in answer.stderr.splitlines() if line.startswith("vidtrack: ")]


def spoilt(change):
    config = copy.deepcopy(CONFIG)
    change(config)
    return config


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda c: c["cameras"]["cam1"].update(treshold=3), "cam1.treshold: no such setting; did you mean 'threshold'"),
        (lambda c: c.pop("units"), "units: missing"),
        (lambda c: c["runs"].update(plukc={}), "runs.plukc: no such folder in runs/; did you mean 'pluck'?"),
        (lambda c: c["calibration"]["clips"]["front"].update(tags="1-99"), "tags 37, 38, 39, 40 and 59 more are not"),
    ],
)  # fmt: skip
def test_a_config_that_cannot_be_is_told_before_any_work(laboratory, change, line):
    configure(laboratory, spoilt(change))
    assert line in told(laboratory, "-n")[0]


def test_a_syntax_error_is_told_with_its_line(laboratory):
    text = (laboratory / "config.yaml").read_text()
    (laboratory / "config.yaml").write_text(text.replace("units: in", "units: [in"))
    (line,) = told(laboratory, "-n")
    assert line.startswith("vidtrack: config.yaml, line ")


def test_a_folder_without_a_config_is_told(tmp_path):
    (line,) = told(tmp_path, "-n")
    assert "config.yaml: no such file" in line


def test_a_missing_recording_is_told(laboratory):
    (laboratory / "runs/pluck/cam1.mov").unlink()
    (said,) = told(laboratory, "-n")
    assert "runs/pluck: only camera cam2 has a recording" in said


def test_results_that_cannot_be_written_are_told(laboratory):
    shutil.rmtree(laboratory / "results")
    (laboratory / "results").write_text("a file where a folder should be")
    (said,) = told(laboratory, "-n")
    assert said.startswith("vidtrack: results/.provenance: ")
    assert "cannot be written" in said


def test_too_few_points_end_the_job_in_one_line_and_leave_no_camera(laboratory):
    config = copy.deepcopy(CONFIG)
    config["calibration"] = {"clips": {"front": {"tags": "1-6"}, "middle": {"tags": []}, "rear": {"tags": []}}}
    for clip in ("middle", "rear"):
        for camera in ("cam1", "cam2"):
            (laboratory / f"calibration/{clip}/{camera}.mov").unlink()
        config["calibration"]["clips"].pop(clip)
    (laboratory / "calibration/front/picks.csv").write_text(
        "\n".join(
            line
            for line in (laboratory / "calibration/front/picks.csv").read_text().splitlines()
            if line.split(",")[1] in ("tag", "1", "2", "3", "4", "5", "6")
        )
    )
    before = (laboratory / "results/calibration/cam1/camera.json").read_bytes()
    configure(laboratory, config)
    lines = told(laboratory)
    assert lines
    after = laboratory / "results/calibration/cam1/camera.json"
    assert not after.exists() or after.read_bytes() == before
    assert not list(laboratory.rglob(".*.partial"))


def test_a_job_that_fails_writes_nothing(tmp_path):
    (tmp_path / "order.json").write_text('{"settings": {"units": "in", "camera": "cam1"}, "inputs": {}}')
    (tmp_path / "sightings.parquet").write_text("no table")
    (tmp_path / "labelling.json").write_text("{}")
    command = [sys.executable, "-m", "vidtrack", "calibrate", "--settings", str(tmp_path / "order.json")]
    command += ["--log", str(tmp_path / "log"), "--input", "sightings", str(tmp_path / "sightings.parquet")]
    command += ["--input", "labelling", str(tmp_path / "labelling.json")]
    command += [
        "--input",
        "picture",
        str(tmp_path / "sightings.parquet"),
        "--output",
        "camera",
        str(tmp_path / "c.json"),
    ]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 1
    (line,) = answer.stderr.splitlines()
    assert line.startswith("vidtrack: ")
    assert (tmp_path / "log").read_text() == answer.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["labelling.json", "log", "order.json", "sightings.parquet"]
