"""Every file under results/ goes to its place, whatever cameras and runs are called, and is read once."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.files import results_files
from vidtrack.files.records import write_json
from vidtrack.files.results_files import is_of_run, read_results
from vidtrack.files.tables import write_parquet
from vidtrack.files.timestack_file import write_timestacks


@pytest.mark.parametrize("lab", ["lab", "runs", "report", "calibration", "results/runs", "results/report"])
@pytest.mark.parametrize("name", ["cam1", "calibration", "runs", "centroids", "results", "report"])
def test_each_file_goes_to_its_place_whatever_the_experiment_its_runs_and_its_cameras_are_called(tmp_path, lab, name):
    root = tmp_path / lab / "results"
    records = [
        f"calibration/{name}/camera.json",
        f"calibration/{name}/labelling.json",
        f"calibration_after/{name}/camera.json",
        "calibration/backprojection.json",
        "calibration_after/stability.json",
        f"runs/{name}/centroids/{name}.json",
        f"runs/{name}/locate.json",
        "verdict.json",
    ]
    tables = [f"calibration/{name}/points.parquet", f"runs/{name}/centroids/{name}.parquet"]
    tables.append(f"runs/{name}/trajectories.parquet")
    for path in (*records, *tables):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
    for path in records:
        write_json(root / path, {"path": path}, {})
    for path in tables:
        write_parquet(root / path, pd.DataFrame({"x": [1.0], "Xf": 2.0}), units="m", provenance={})
    stack = {"grey": np.zeros((2, 3), np.uint8), "time_s": np.zeros(2), "s": np.zeros(3)}
    write_timestacks(
        root / f"runs/{name}/waterline.npz", {"a": {**stack, "p": np.zeros((3, 3)), "b": np.zeros((3, 2))}}
    )
    overlay = root / f"calibration/overlay_{name}.png"
    pictures = [f"runs/{name}/overlay_{name}.jpg", f"runs/{name}/background/{name}.png", "report/campaign.html"]
    read = (*records, *tables, f"runs/{name}/waterline.npz", overlay, *pictures)
    results = read_results([str(root / p) for p in read])

    own, run = results.cameras[name], results.runs[name]
    assert own.record["path"] == records[0]
    assert own.labelling["path"] == records[1]
    assert results.after[name].record["path"] == records[2]
    assert results.back["path"] == records[3]
    assert results.stability["path"] == records[4]
    assert run.readings[name]["path"] == records[5]
    assert run.records["locate"]["path"] == records[6]
    assert results.verdict["path"] == records[7]
    assert (list(results.runs), list(results.cameras)) == ([name], [name])
    assert run.posters == {name: str(root / pictures[0])}
    assert run.pictures == {name: str(root / pictures[1])}
    assert (results.campaign_page, results.calibration_page) == (True, False)
    assert len(own.points) == len(run.centroids[name]) == len(run.tables["trajectories"]) == 1
    assert list(run.timestacks) == ["a"]
    assert own.overlay == str(overlay)


def test_a_file_without_a_place_is_an_error(tmp_path):
    write_json(tmp_path / "other.json", {}, {})
    with pytest.raises(ValueError, match="not a file"):
        read_results([str(tmp_path / "other.json")])


def test_each_file_is_read_once(tmp_path, monkeypatch):
    path = tmp_path / "results" / "runs" / "a" / "locate.json"
    path.parent.mkdir(parents=True)
    write_json(path, {}, {})
    reads = []
    monkeypatch.setitem(results_files.READERS, ".json", lambda p: reads.append(p) or {})
    read_results([str(path)])
    assert reads == [str(path)]


@pytest.mark.parametrize("lab", ["lab", "runs", "results/runs"])
@pytest.mark.parametrize("name", ["cam1", "calibration", "runs", "centroids", "background", "report"])
def test_what_belongs_to_a_run_is_known_by_its_path(lab, name):
    for path in (
        f"runs/{name}/locate.json",
        f"runs/{name}/centroids/{name}.json",
        f"runs/{name}/background/{name}.png",
    ):
        assert is_of_run(f"{lab}/results/{path}")
    others = (f"calibration/{name}/camera.json", "calibration/survey.json", ".failures/locate/a.json", "verdict.json")
    for path in others:
        assert not is_of_run(f"{lab}/results/{path}")


def test_a_calibration_that_was_read_before_is_neither_read_again_nor_changed_by_a_run(tmp_path, monkeypatch):
    paths = [str(tmp_path / "results" / path) for path in ("calibration/survey.json", "runs/a/locate.json")]
    for path in paths:
        write_json(path, {"path": path}, {})
    known = read_results(paths[:1])
    monkeypatch.setitem(results_files.READERS, ".json", lambda path: path)
    both = read_results(paths[1:], known)
    assert both.survey is known.survey
    assert both.runs["a"].records == {"locate": paths[1]}
    assert not known.runs


def test_of_the_long_tables_of_a_run_what_the_page_shows_is_read(tmp_path):
    columns = ["time_s", "timecode", "target", "x", "vx", "Xf", "Yf", "miss", "flag"]
    table = pd.DataFrame({name: ["a"] if name in ("timecode", "target", "flag") else [1.0] for name in columns})
    places = ["centroids/kinematics", "trajectories", "kinematics", "bodies"]
    paths = [tmp_path / f"results/runs/pluck/{place}.parquet" for place in places]
    paths[0].parent.mkdir(parents=True)
    for path in paths:
        write_parquet(path, table, units="m", provenance={})
    run = read_results(map(str, paths)).runs["pluck"]
    assert list(run.centroids["kinematics"]) == ["time_s", "target", "Xf", "Yf"]
    assert list(run.tables["trajectories"]) == ["time_s", "target", "x"]
    assert list(run.tables["kinematics"]) == ["time_s", "target", "vx", "flag"]
    assert list(run.tables["bodies"]) == columns
