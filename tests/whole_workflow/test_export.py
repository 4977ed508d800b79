"""`export` in config.yaml and `vidtrack export`, on the laboratory that is processed once."""

import copy
import subprocess
import sys

import ezc3d
import numpy as np
import pandas as pd
import pytest

from tests.whole_workflow.conftest import CONFIG, configure, planned, snakemake

EXPORT = ("c3d", "csv")


def exporting(folder, *formats, **runs):
    config = copy.deepcopy(CONFIG) | {"export": list(formats)}
    for run, own in runs.items():
        config["runs"].setdefault(run, {}).update(own)
    configure(folder, config)


def command(folder, *arguments):
    return subprocess.run(
        [sys.executable, "-m", "vidtrack.command", "export", str(folder), *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_exports_are_made_by_the_workflow_and_again_only_where_the_run_changed(laboratory):
    exporting(laboratory, *EXPORT)
    assert planned(laboratory) == {"export_c3d_0": 2, "export_csv_1": 2}
    answer = snakemake(laboratory)
    assert answer.returncode == 0, answer.stderr
    folder = laboratory / "results/runs/pluck/export"
    c3d = ezc3d.c3d(str(folder / "pluck.c3d"))
    own = pd.read_parquet(laboratory / "results/runs/pluck/trajectories.parquet")
    np.testing.assert_allclose(c3d["data"]["points"][:3, 0].T, own[["x", "y", "z"]] * 25.4, rtol=1e-6)
    assert (folder / "csv/pluck_trajectories.csv").is_file()
    assert planned(laboratory) == {}

    exporting(laboratory, *EXPORT, still={"max_miss": 5.0})
    assert planned(laboratory)["locate"] == 1
    before = (folder / "pluck.c3d").stat().st_mtime_ns
    assert snakemake(laboratory).returncode == 0
    assert (folder / "pluck.c3d").stat().st_mtime_ns == before

    direct = command(laboratory, "--to", "c3d", "--run", "pluck", "--output", str(laboratory / "own.c3d"))
    assert direct.returncode == 0, direct.stderr
    assert (laboratory / "own.c3d").read_bytes() == (folder / "pluck.c3d").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "--to FORMAT is missing"),
        (("--to", "c4d"), "did you mean 'c3d'?"),
        (("--to", "c3d", "--run", "plukc"), "did you mean 'pluck'?"),
        (("--to", "mot", "--run", "pluck"), "the config names no bodies for it"),
    ],
)
def test_what_cannot_be_exported_is_one_line(processed, arguments, said):
    answer = command(processed, *arguments)
    assert answer.returncode == 1
    assert said in answer.stderr
    assert len(answer.stderr.splitlines()) <= 2


def test_results_that_are_not_there_are_named(laboratory):
    (laboratory / "results/runs/still/trajectories.parquet").unlink()
    answer = command(laboratory, "--to", "c3d")
    assert answer.returncode == 1
    assert "still/trajectories.parquet: not there yet" in answer.stderr
    assert not (laboratory / "results/runs/pluck/export").exists()
