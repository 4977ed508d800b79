"""The folder that a simulated laboratory leaves behind."""

import csv
import fcntl
import json
import os
from pathlib import Path

import av
import numpy as np
import pytest
import yaml

from vidtrack.geometry.camera import project
from vidtrack.simulate.__main__ import main
from vidtrack.simulate.films import moved
from vidtrack.simulate.laboratory import planned_files, set_up
from vidtrack.simulate.records import survey_sigma, surveyed
from vidtrack.simulate.scenario import random_stream, scenario_from

LAB = {
    "seed": 3,
    "cameras": {
        "left": {"position": [-60, 40, 30], "field": 60, "size": [128, 96]},
        "right": {"position": [-60, -40, 30], "field": 60, "size": [128, 96], "clock": {"offset_s": 0.01}},
    },
    "recording": {"drop_frame": True},
    "calibration": {
        "points": {"rows": 2, "wires": 2, "balls": 2, "spacing": [10, 8, 8]},
        "frames": 2,
        "survey": {"error": 0.1},
        "clips": {"front": {"tags": "1-4", "picks": "1-4"}, "rear": {"tags": "5-8"}},
    },
    "runs": {
        "swing": {
            "start": "01:00:00;00",
            "duration_s": 0.4,
            "first_frame": {"right": 3},
            "boxes": True,
            "targets": {"t1": {"motion": {"oscillations": [{"amplitude": 5, "hz": 1}]}}},
            "reference": {"target": "t1", "column": "x_in", "error": 0, "lead_s": 0.2},
        }
    },
}


def table(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def contents(folder: Path):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab") / "experiment"
    set_up(scenario_from(LAB), str(folder), threads=1)
    return folder


def test_the_folder_holds_what_was_planned_and_no_more(lab):
    assert set(contents(lab)) == set(planned_files(scenario_from(LAB)))
    assert "calibration/front/left.mov" in contents(lab)


def test_the_same_scenario_makes_the_same_bytes_on_any_number_of_threads(lab, tmp_path):
    set_up(scenario_from(LAB), str(tmp_path / "again"), threads=3)
    assert contents(tmp_path / "again") == contents(lab)


def test_another_seed_makes_other_noise_and_another_survey(lab, tmp_path):
    set_up(scenario_from({**LAB, "seed": 4}), str(tmp_path / "other"))
    other = contents(tmp_path / "other")
    for path in ("calibration/points.csv", "runs/swing/left.mov", "calibration/front/picks.csv"):
        assert other[path] != contents(lab)[path]
    assert other["runs/swing/truth.csv"] == contents(lab)["runs/swing/truth.csv"]


def test_one_more_run_changes_no_other_file(lab, tmp_path):
    more = {**LAB, "runs": {**LAB["runs"], "again": LAB["runs"]["swing"]}}
    set_up(scenario_from(more), str(tmp_path / "more"))
    new = contents(tmp_path / "more")
    assert all(new[path] == content for path, content in contents(lab).items() if path.startswith(("runs", "cal")))


@pytest.mark.parametrize(("distribution", "spread"), [("normal", 0.1), ("uniform", 0.1 / np.sqrt(3))])
def test_the_survey_errs_as_much_as_it_says(distribution, spread):
    points = {"rows": 10, "wires": 10, "balls": 10, "spacing": [1, 1, 1]}
    plan = {**LAB["calibration"], "points": points, "survey": {"error": 0.1, "distribution": distribution}}
    scenario = scenario_from({**LAB, "calibration": plan})
    error = surveyed(scenario) - scenario.points()[1]
    assert error.std() == pytest.approx(spread, rel=0.04)
    assert abs(error.mean()) < 4 * spread / np.sqrt(error.size)
    assert (np.abs(error).max() <= 0.1) == (distribution == "uniform")


def test_the_standard_deviation_of_a_tolerance_is_a_third_root_of_it():
    plan = {**LAB["calibration"], "survey": {"error": 0.3, "distribution": "uniform"}}
    assert survey_sigma(scenario_from({**LAB, "calibration": plan})) == pytest.approx(0.3 / 3**0.5)


def test_every_file_has_random_numbers_of_its_own():
    scenario = scenario_from(LAB)
    first = [random_stream(scenario, *names).integers(2**40) for names in (("a",), ("b",), ("a", "b"), ("a", "c"))]
    assert len(set(first)) == 4


def test_the_survey_is_what_the_laboratory_knows_and_the_truth_lies_apart(lab):
    told, true = table(lab / "calibration/points.csv"), table(lab / "truth/points.csv")
    assert [row["tag"] for row in told] == [row["tag"] for row in true] == [str(n) for n in range(1, 9)]
    assert all(float(row["sigma"]) == 0.1 for row in told)
    assert float(true[0]["x"]) == -5
    assert float(told[0]["x"]) != -5


def test_picks_are_near_their_balls(lab):
    scenario = scenario_from(LAB)
    tags, places = scenario.points()
    rows = table(lab / "calibration/front/picks.csv")
    assert [(row["camera"], row["tag"]) for row in rows] == [(c, t) for c in ("left", "right") for t in "1234"]
    for row in rows:
        b = project(scenario.camera(row["camera"]), places[tags.index(row["tag"])])
        assert np.hypot(float(row["Xf"]) - b[0], float(row["Yf"]) - b[1]) < 8


def test_boxes_are_where_each_camera_first_sees_the_target(lab):
    scenario = scenario_from(LAB)
    right = next(row for row in table(lab / "runs/swing/targets.csv") if row["camera"] == "right")
    at = [5 * np.cos(2 * np.pi * 3 * 1001 / 30000), 0, 0]
    assert [float(right["Xf"]), float(right["Yf"])] == pytest.approx(project(scenario.camera("right"), at), abs=0.06)


def test_truth_is_told_at_every_frames_own_time(lab):
    rows = table(lab / "runs/swing/truth.csv")
    n0 = 30 * 3600 - 2 * (60 - 6)  # drop-frame: the frame labelled 01:00:00;00
    assert len(rows) == 12 + 3  # right begins three frames later
    assert [float(row["time_s"]) for row in rows] == pytest.approx(
        [(n0 + k) * 1001 / 30000 for k in range(15)], abs=1e-8
    )
    t = np.arange(15) * 1001 / 30000
    assert [float(row["x"]) for row in rows] == pytest.approx(5 * np.cos(2 * np.pi * t), abs=1e-8)


def test_the_sensors_record_leads_the_video(lab):
    rows = table(lab / "runs/swing/reference.csv")
    start = (30 * 3600 - 2 * 54) * 1001 / 30000
    shown = 5 * np.cos(2 * np.pi * np.maximum(np.array([float(row["time_s"]) for row in rows]) + 0.2 - start, 0))
    assert [float(row["x_in"]) for row in rows] == pytest.approx(shown, abs=2e-3)  # written to 1e-4 s
    step = np.diff([float(row["time_s"]) for row in rows])
    assert step == pytest.approx(1 / 30, abs=2e-4)


def test_each_camera_shows_the_target_where_truth_has_it_at_its_time(lab):
    """right begins at frame 3 and must add 10 ms to its time: the picture shows the target 10 ms later."""
    scenario = scenario_from(LAB)
    for name, first, offset in (("left", 0, 0.0), ("right", 3, 0.01)):
        with av.open(str(lab / f"runs/swing/{name}.mov")) as container:
            assert container.streams.video[0].metadata["timecode"] == f"01:00:00;0{first}"
            for k, frame in enumerate(container.decode(video=0)):
                plane = frame.planes[0]
                image = np.frombuffer(plane, np.uint8).reshape(frame.height, -1)[:, : frame.width].astype(float)
                light = np.where(image > 60, image - 24, 0)
                X = light.sum(0) @ np.arange(frame.width) / light.sum()
                t = (first + k) * 1001 / 30000 + offset
                assert X == pytest.approx(
                    project(scenario.camera(name), [5 * np.cos(2 * np.pi * t), 0, 0])[0], abs=0.12
                )
        assert k == 11


def test_a_camera_that_moved_between_clips_sees_everything_shifted(tmp_path):
    plan = {**LAB["calibration"], "clips": {"after": {"moved": {"left": [[0, 0, 0], [0, 1, 0]]}}}}
    scenario = scenario_from({**LAB, "calibration": plan, "runs": {}})
    set_up(scenario, str(tmp_path / "moved"))
    set_up(scenario_from({**LAB, "calibration": {**plan, "clips": {"after": {}}}, "runs": {}}), str(tmp_path / "still"))
    after, before = contents(tmp_path / "moved"), contents(tmp_path / "still")
    assert after["calibration/after/left.mov"] != before["calibration/after/left.mov"]
    assert after["calibration/after/right.mov"] == before["calibration/after/right.mov"]


def test_a_camera_that_turned_to_its_right_sees_things_move_left():
    camera = scenario_from(LAB).camera("left")
    ahead = camera.position + 50 * camera.R[2]
    turned = moved(camera, ((0, 0, 0), (0, 2, 0)))  # about y, which points down
    left = project(camera, ahead)[0] - project(turned, ahead)[0]
    assert left == pytest.approx(np.tan(np.radians(2)) * camera.f / camera.dx)
    assert moved(camera, ((1, 2, 3), (0, 2, 0))).position == pytest.approx(camera.position + np.array([1, 2, 3]))


def test_longitudinal_time_code_lasts_as_long_as_the_film(tmp_path):
    tape = {"timecode": "both", "sound_level": 0.25}
    recording = {**LAB["recording"], "tape": tape}
    set_up(scenario_from({**LAB, "recording": recording, "calibration": {}}), str(tmp_path / "ltc"))
    with av.open(str(tmp_path / "ltc/runs/swing/right.mov")) as container:
        heard = np.concatenate([frame.to_ndarray()[0] for frame in container.decode(audio=0)]) / 32767
    assert len(heard) == int(12 * 1001 / 30000 * 48000)
    assert np.abs(heard).max() == pytest.approx(0.25, abs=0.01)
    turns = np.count_nonzero(np.diff(np.sign(heard)))  # 80 to 160 a word
    assert 80 * 12 < turns < 160 * 12


def test_cameras_truth_is_written_in_tsais_symbols(lab):
    told = json.loads((lab / "truth/cameras.json").read_text())
    camera = scenario_from(LAB).camera("left")
    assert told["left"]["f"] == camera.f
    assert np.allclose(told["left"]["R"], camera.R)


def test_the_command_line_writes_the_folder_and_leaves_others_alone(tmp_path, capsys):
    plan = tmp_path / "plan.yaml"
    plan.write_text(yaml.safe_dump({**LAB, "runs": {}}))
    own = tmp_path / "own"
    own.mkdir()
    (own / "thesis.txt").write_text("years of work")
    assert main([str(plan), str(own)]) == 1
    told = capsys.readouterr().err
    assert told.startswith("vidtrack: ")
    assert told.count("\n") == 1
    assert "not simulated" in told
    assert [p.name for p in own.iterdir()] == ["thesis.txt"]
    assert main([str(plan), str(tmp_path / "new")]) == 0
    assert main([str(plan), str(tmp_path / "new")]) == 0  # its own may be written again
    assert main([str(plan), str(tmp_path / "x"), "--list"]) == 0
    assert set(capsys.readouterr().out.split()) == set(contents(tmp_path / "new"))
    assert not (tmp_path / "x").exists()


def test_a_folder_whose_making_is_interrupted_does_not_appear(tmp_path, monkeypatch):
    def fails(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("vidtrack.simulate.films.write_tape", fails)
    with pytest.raises(KeyboardInterrupt):
        set_up(scenario_from(LAB), str(tmp_path / "lab"), threads=1)
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_making_left_is_removed_by_the_next_and_not_what_one_at_work_has(tmp_path):
    for name in ("lab-dead", "lab-alive", "other-dead"):
        (tmp_path / f".simulating-{name}/experiment").mkdir(parents=True)
    alive = os.open(tmp_path / ".simulating-lab-alive", os.O_RDONLY)
    fcntl.flock(alive, fcntl.LOCK_EX)
    set_up(scenario_from(LAB), str(tmp_path / "lab"), threads=1)
    os.close(alive)
    assert {path.name for path in tmp_path.iterdir()} == {"lab", ".simulating-lab-alive", ".simulating-other-dead"}


def test_a_bad_scenario_is_one_line_a_problem(tmp_path, capsys):
    plan = tmp_path / "plan.yaml"
    plan.write_text("cameras: {a: {position: [1, 2, 3], f: 8, sise: [10, 10]}}\nunits: furlong\n")
    assert main([str(plan), str(tmp_path / "out")]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"vidtrack: {plan}: ") for line in lines)
    assert not (tmp_path / "out").exists()
