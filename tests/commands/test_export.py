"""vidtrack export, of results that are there in part."""

import pandas as pd
import pytest
import yaml

from vidtrack.command import main
from vidtrack.files.outdated_note import write_note
from vidtrack.files.tables import write_parquet


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Two runs of which one has results."""
    for run in ("good", "failed"):
        (tmp_path / f"runs/{run}").mkdir(parents=True)
        for camera in ("cam1", "cam2"):
            (tmp_path / f"runs/{run}/{camera}.mov").write_bytes(b"")
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"units": "mm", "cameras": {"cam1": {}, "cam2": {}}}))
    time = [0.0, 0.1, 0.2]
    table = pd.DataFrame({"time_s": time, "target": "t1", "x": 1.0, "y": 2.0, "z": 3.0, "flag": ""})
    table = table.assign(sigma_x=0.1, sigma_y=0.1, sigma_z=0.1)
    (tmp_path / "results/runs/good").mkdir(parents=True)
    write_parquet(str(tmp_path / "results/runs/good/trajectories.parquet"), table, units="mm", provenance={})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_run_that_failed_costs_that_run_and_is_named(lab, capsys):
    assert main(["export", ".", "--to", "c3d"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == ["results/runs/good/export/good.c3d"]
    assert "run failed failed" in said.err
    assert not (lab / "results/runs/failed").exists()


def test_a_run_that_is_asked_for_by_name_and_has_no_results_is_refused(lab, capsys):
    assert main(["export", ".", "--to", "c3d", "--run", "good", "--run", "failed"]) == 1
    assert "runs/failed/trajectories.parquet: not there yet" in capsys.readouterr().err
    assert not list(lab.rglob("*.c3d"))


def test_a_run_that_is_named_twice_is_one(lab):
    assert main(["export", ".", "--to", "c3d", "--run", "good", "--run", "good", "--output", "one.c3d"]) == 0
    assert (lab / "one.c3d").stat().st_size > 512


def test_a_file_with_the_ending_of_another_format_is_refused(lab, capsys):
    assert main(["export", ".", "--to", "c3d", "--run", "good", "--output", "one.mat"]) == 1
    assert "--output one.mat: what is written is a .c3d file" in capsys.readouterr().err
    assert not list(lab.rglob("one.*"))


def test_results_of_an_earlier_call_are_not_handed_on(lab, capsys):
    write_note(str(lab / "results/runs/good"), ["runs/good/trajectories.parquet"])
    assert main(["export", ".", "--to", "c3d", "--run", "good"]) == 1
    assert "results/runs/good/trajectories.parquet: of an earlier call" in capsys.readouterr().err
    assert not list(lab.rglob("*.c3d"))
