"""`export` in config.yaml and `vidtrack export`, on the laboratory that is processed once."""

import contextlib
import copy
import io
import re
import shutil
from types import SimpleNamespace

import ezc3d
import numpy as np
import pandas as pd
import pytest

from tests.whole_workflow.conftest import CONFIG, configure, planned, snakemake
from vidtrack.command import main
from vidtrack.exchange.formats import FORMATS, Layout, places

EXPORT = ("c3d", "dltdv8")


def exporting(folder, *formats, **runs):
    config = copy.deepcopy(CONFIG) | {"export": list(formats)}
    for run, own in runs.items():
        config["runs"].setdefault(run, {}).update(own)
    configure(folder, config)


def command(folder, *arguments):
    """The command within this process, which has loaded its libraries."""
    said, complained = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        code = main(["export", str(folder), *arguments])
    return SimpleNamespace(returncode=code, stdout=said.getvalue(), stderr=complained.getvalue())


def reprojected(start, own):
    """How far, world units, points by DLT from the digitised ones lie from where they were located; the median."""
    coefs = np.loadtxt(f"{start}dltcoefs.csv", delimiter=",")
    uv = pd.read_csv(f"{start}undistorted_xypts.csv").to_numpy().reshape(-1, 2, 2)
    xyz = pd.read_csv(f"{start}xyzpts.csv").to_numpy()
    assert np.isfinite(xyz).all(-1).sum() > 0.9 * len(own) / 2
    off = []
    for row, p in zip(uv, xyz, strict=True):
        both = list(zip(row, coefs.T, strict=True))
        A = np.concatenate([np.outer(b, L[8:11]) - L[:8].reshape(2, 4)[:, :3] for b, L in both])
        y = np.concatenate([L[[3, 7]] - b for b, L in both])
        if np.isfinite(A).all():
            off.append(np.linalg.norm(np.linalg.lstsq(A, y)[0] - p))
    return np.median(off)


@pytest.mark.slow
def test_exports_are_made_by_the_workflow_and_again_only_where_the_run_changed(laboratory):
    exporting(laboratory, *EXPORT)
    answer = snakemake(laboratory)  # a job for each run and format, which need no other: they run beside each other
    assert answer.returncode == 0, answer.stderr
    jobs = sorted(re.findall(r"Writing (\S+ as \S+)", answer.stdout + answer.stderr))
    assert jobs == sorted(f"{run} as {name}" for run in ("pluck", "still") for name in EXPORT)
    folder = laboratory / "results/runs/pluck/export"
    c3d = ezc3d.c3d(str(folder / "pluck.c3d"))
    own = pd.read_parquet(laboratory / "results/runs/pluck/trajectories.parquet")
    np.testing.assert_allclose(c3d["data"]["points"][:3, 0].T, own[["x", "y", "z"]] * 25.4, rtol=1e-6)
    assert reprojected(folder / "dltdv8/pluck_", own) < 0.01

    exporting(laboratory, *EXPORT, still={"max_miss": 5.0})
    again = planned(laboratory)
    of_still = {"locate": 1, "export_c3d_0": 1, "export_dltdv8_1": 1}
    assert {name: again[name] for name in of_still} == of_still
    before = (folder / "pluck.c3d").stat().st_mtime_ns
    assert snakemake(laboratory).returncode == 0
    assert (folder / "pluck.c3d").stat().st_mtime_ns == before

    direct = command(laboratory, "--to", "c3d", "--run", "pluck", "--output", str(laboratory / "own.c3d"))
    assert direct.returncode == 0, direct.stderr
    assert (laboratory / "own.c3d").read_bytes() == (folder / "pluck.c3d").read_bytes()


def test_every_format_that_a_run_without_bodies_suits_is_written_by_the_command(processed, tmp_path):
    layout = Layout("pluck", "space", ("cam1", "cam2"))
    names = [name for name, form in FORMATS.items() if form.suits(layout)]
    asked = [word for name in names for word in ("--to", name)]
    answer = command(processed, *asked, "--run", "pluck", "--output", str(tmp_path / "out"))
    assert answer.returncode == 0, answer.stderr
    out = tmp_path / "out/pluck"  # files of two formats have one name: each format has a folder
    made = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert made == {place for name in names for place in places(name, layout)}


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


def test_a_format_that_no_run_can_give_is_refused_in_one_line(laboratory):
    exporting(laboratory, "mot")
    answer = snakemake(laboratory, "-n")
    assert answer.returncode == 1
    assert (
        "vidtrack: config.yaml: export: no run can be written as mot; run pluck: the config names no" in answer.stderr
    )


def test_several_runs_do_not_go_into_one_file(processed, tmp_path):
    answer = command(processed, "--to", "c3d", "--output", str(tmp_path / "all.c3d"))
    assert answer.returncode == 1
    assert "2 files do not fit in one" in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_results_are_enough_where_the_recordings_are_gone(laboratory):
    shutil.rmtree(laboratory / "runs")
    answer = command(laboratory, "--to", "netcdf", "--run", "still")
    assert answer.returncode == 0, answer.stderr
    assert (laboratory / "results/runs/still/export/still.nc").is_file()


def test_results_that_are_not_there_are_named(laboratory):
    (laboratory / "results/runs/still/trajectories.parquet").unlink()
    answer = command(laboratory, "--to", "c3d", "--run", "still")
    assert answer.returncode == 1
    assert "still/trajectories.parquet: not there yet" in answer.stderr
    assert not (laboratory / "results/runs/still/export").exists()
    of_all = command(laboratory, "--to", "c3d")
    assert "still/trajectories.parquet: not there yet" in of_all.stderr
    assert list((laboratory / "results/runs/pluck/export").glob("*.c3d"))
