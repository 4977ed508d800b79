import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.whole_workflow.conftest import laboratory, processed  # noqa: F401

pytestmark = pytest.mark.slow
REPO = Path(__file__).parents[2]
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(REPO)}


def vidtrack(*arguments, **options):
    command = [sys.executable, "-m", "vidtrack.command", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, check=False, **options)


def test_a_run_says_the_verdict_last_and_keeps_snakemakes_text_in_a_log(laboratory):  # noqa: F811
    (laboratory / "results/runs/still/trajectories.parquet").unlink()
    done = vidtrack("run", laboratory)
    assert done.returncode == 0, done.stderr
    *_, still, report = done.stderr.splitlines()
    assert still.startswith(("run still: ", "run pluck: ", "calibration: "))
    assert report == f"report: {laboratory / 'results/report.html'}"
    assert "Finished jobid" not in done.stderr
    assert "Finished jobid" in (laboratory / ".snakemake/vidtrack.log").read_text()
    assert (laboratory / "results/runs/still/trajectories.parquet").exists()


def test_one_run_alone_is_processed_and_judged(laboratory):  # noqa: F811
    for run in ("still", "pluck"):
        (laboratory / f"results/runs/{run}/trajectories.parquet").unlink()
    done = vidtrack("run", laboratory, "--run", "still")
    assert done.returncode == 0, done.stderr
    assert (laboratory / "results/runs/still/trajectories.parquet").exists()
    assert not (laboratory / "results/runs/pluck/trajectories.parquet").exists()
    assert "run still: " in done.stderr
    assert "run pluck: " not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "line"),
    [(["--run", "stil"], "no run 'stil'; did you mean 'still'?"), (["--cores", "0"], "not a number of cores")],
)
def test_what_cannot_be_is_refused_before_snakemake_starts(laboratory, arguments, line):  # noqa: F811
    done = vidtrack("run", laboratory, *arguments)
    assert done.returncode == 1
    assert line in done.stderr
    assert not (laboratory / ".snakemake/vidtrack.log").exists()


@pytest.mark.parametrize("content", [b"no video at all" * 99, b""], ids=["no video", "empty"])
def test_a_failure_is_said_in_one_line_and_the_log_is_named(laboratory, content):  # noqa: F811
    (laboratory / "results/report.html").unlink(missing_ok=True)
    (laboratory / "runs/still/cam1.mov").write_bytes(content)
    done = vidtrack("run", laboratory)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    lines = done.stderr.splitlines()
    assert 1 <= sum("runs/still/cam1.mov: " in line for line in lines) <= 2
    assert lines[-1].endswith(".snakemake/vidtrack.log")
    assert (laboratory / "results/runs/pluck/trajectories.parquet").exists()
    assert (laboratory / "results/report.html").exists()


def test_a_run_that_is_stopped_says_what_is_left_and_goes_on_when_called_again(laboratory):  # noqa: F811
    import shutil

    shutil.rmtree(laboratory / "results")
    command = [sys.executable, "-m", "vidtrack.command", "run", str(laboratory), "--run", "still", "--cores", "1"]
    log = laboratory / ".snakemake/vidtrack.log"
    # a suite that a shell began in the background ignores interrupts, and so would the child
    heard = signal.signal(signal.SIGINT, signal.SIG_DFL)
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    signal.signal(signal.SIGINT, heard)
    with child:
        for _ in range(600):
            if log.exists() and " steps (" in log.read_text():
                break
            time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        said = child.stderr.read()
    assert child.returncode == 130
    assert "jobs were done and are kept; what was under way is dropped." in said
    assert not any((laboratory / ".snakemake/locks").glob("*"))
    done = vidtrack("run", laboratory, "--run", "still")
    assert done.returncode == 0, done.stderr
