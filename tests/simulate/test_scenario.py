"""Scenarios: what they mean, and what is told of those that mean nothing."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.simulate.scenario import CameraPlan, camera_from_plan, scenario_from

ROOT = Path(__file__).parents[2]
AIMED = {"position": [-10, 0, 5], "f": 8}


def problems(values):
    with pytest.raises(VidtrackError) as caught:
        scenario_from(values, "plan.yaml")
    return caught.value.problems


@pytest.fixture(scope="module")
def demo():
    return scenario_from(read_config(str(ROOT / "data/demo.yaml")), "data/demo.yaml")


def test_the_demo_films_the_thesis_rig(demo):
    for camera in thesis_rig():
        planned = demo.camera(camera.name)
        for name in ("Cx", "Cy", "dx", "dy", "Sx", "f", "kappa1", "R", "T", "image_size"):
            assert np.allclose(getattr(planned, name), getattr(camera, name), rtol=1e-12), name


def test_the_demo_hangs_the_thesis_balls(demo):
    tags, places = demo.points()
    assert tags == thesis_points()[0]
    assert (places == thesis_points()[1]).all()
    assert [clip.tags for clip in demo.calibration.clips.values()] == [tuple(tags[i : i + 16]) for i in (0, 16, 32, 48)]


def test_the_demos_config_names_its_cameras_clips_and_runs(demo):
    config = read_config(str(ROOT / "config.yaml"))
    assert set(config["cameras"]) == set(demo.cameras)
    assert set(config["runs"]) == set(demo.runs)
    assert {name: tuple(clip["tags"].split("-")) for name, clip in config["calibration"]["clips"].items()} == {
        name: (clip.tags[0], clip.tags[-1]) for name, clip in demo.calibration.clips.items()
    }
    assert {tuple(camera["sensor"]) for camera in config["cameras"].values()} == {(8.8, 6.6)}


def test_a_field_of_view_gives_the_focal_length():
    camera = camera_from_plan(CameraPlan(position=(-160, 0, 0), field=128, sensor=(8.8, 6.6)))
    assert camera.f == pytest.approx(11)
    edges = project(camera, [[0, 64, 0], [0, -64, 0]])
    assert edges[:, 0] == pytest.approx([-0.5, 511.5])


def test_a_camera_may_look_straight_down():
    camera = camera_from_plan(CameraPlan(position=(1, 2, 50), target=(1, 2, 0), f=8))
    assert project(camera, [1, 2, 0]) == pytest.approx([255.5, 239.5])
    assert project(camera, [1, 3, 0])[1] < 239.5  # north is up


def test_a_cameras_own_picture_differs_only_where_it_says():
    scenario = scenario_from({"picture": {"noise": 1}, "cameras": {"a": {**AIMED, "picture": {"gain": 2}}, "b": AIMED}})
    assert scenario.picture_of("a").gain == 2
    assert scenario.picture_of("a").noise == scenario.picture_of("b").noise == 1


def test_a_rounded_rate_means_the_exact_one():
    scenario = scenario_from({"cameras": {"a": AIMED}, "recording": {"rate": 29.97}})
    assert scenario.recording.rate == Fraction(30000, 1001)


def test_a_misspelt_key_is_named_with_the_nearest_known():
    assert problems({"cameras": {"a": {**AIMED, "kapa1": 1}}}) == (
        "plan.yaml: cameras.a.kapa1: no such setting; did you mean 'kappa1'?",
    )


def test_every_problem_is_told_at_once():
    told = problems({"cameras": {"a": AIMED}, "picture": {"noise": -1}, "recording": {"rate": "fast"}})
    assert len(told) == 2
    assert all(line.startswith("plan.yaml: ") and "\n" not in line for line in told)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "cameras: missing"),
        ({"cameras": {"a": {"f": 8}}}, "give either position or"),
        ({"cameras": {"a": {"f": 8, "pan_deg": 4}}}, "belong together"),
        ({"cameras": {"a": {"position": [1, 0, 0]}}}, "give either f"),
        (
            {
                "cameras": {"a": AIMED},
                "clutter": [{"camera": "z", "left": 1, "top": 1, "width": 1, "height": 1, "level": 9}],
            },
            "'z'",
        ),
        ({"cameras": {"a": AIMED}, "runs": {"r": {"reference": {"target": "t9"}}}}, "'t9'"),
        ({"cameras": {"a": AIMED}, "runs": {"r": {"start": "25:00:00:00"}}}, "25:00:00:00"),
        ({"cameras": {"a": AIMED}, "calibration": {"clips": {"c": {"tags": "1-4"}}}}, "no ball has tag"),
        ({"cameras": {"a": {**AIMED, "picture": {"nois": 1}}}}, "nois"),
    ],
)
def test_a_scenario_that_means_nothing_is_refused_with_a_reason(values, said):
    assert any(said in line for line in problems(values))
