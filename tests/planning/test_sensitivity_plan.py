"""A rig on paper becomes cases: as planned, and one for each value of each sweep."""

import numpy as np
import pytest

from vidtrack.calibration.assessment.target_design import SYSTEMATIC_PX
from vidtrack.errors import VidtrackError
from vidtrack.planning.sensitivity_plan import changed, read_sensitivity, sensitivity_cases

RIG = {
    "cameras": {
        "cam1": {"position": [-60, 40, 30], "field": 60, "size": [512, 480]},
        "cam2": {"position": [-60, -40, 30], "field": 60, "size": [512, 480]},
        "cam3": {"position": [60, -40, 30], "field": 60, "size": [512, 480]},
    },
    "calibration": {"points": {"rows": 2, "wires": 2, "balls": 3, "spacing": [10, 8, 6]}},
}


def cases(**changes):
    return sensitivity_cases({**RIG, **changes}, "rig.yaml")[1]


def refused(**changes):
    with pytest.raises(VidtrackError) as caught:
        cases(**changes)
    return str(caught.value)


def test_the_rig_as_planned_comes_first_and_then_each_value():
    found = cases(sweeps={"camera_count": [2, 3], "cameras.*.field": [80]})
    assert [(case.sweep, case.value) for case in found] == [
        ("", "as planned"),
        ("camera_count", 2),
        ("camera_count", 3),
        ("cameras.*.field", 80),
    ]
    assert [len(case.layout.cameras) for case in found] == [3, 2, 3, 3]
    f = [case.layout.cameras[0].f for case in found]
    assert f[3] == pytest.approx(f[0] * 60 / 80)


def test_the_volume_is_the_box_of_the_points_cut_into_equal_cells():
    q = cases()[0].layout.q
    assert len(q) == 7**3
    np.testing.assert_allclose(q.max(0), np.array([5, 4, 6]) * 6 / 7)
    np.testing.assert_allclose(q.mean(0), 0, atol=1e-12)
    flat = cases(volume={"low": [0, 0, 1], "high": [2, 2, 1], "samples": 2})[0].layout.q
    np.testing.assert_allclose(sorted(map(tuple, flat)), [(0.5, 0.5, 1), (0.5, 1.5, 1), (1.5, 0.5, 1), (1.5, 1.5, 1)])


@pytest.mark.parametrize(("distribution", "sigma"), [("normal", 0.3), ("uniform", 0.3 / np.sqrt(3))])
def test_a_tolerance_is_a_standard_deviation_or_root_3_of_them(distribution, sigma):
    survey = {"error": 0.3, "distribution": distribution}
    found = cases(calibration={**RIG["calibration"], "survey": survey})[0]
    assert found.layout.sigma == pytest.approx(sigma)


def test_a_stated_centroid_noise_is_that_of_every_camera_and_an_averaged_one_is_smaller():
    stated = cases(light={"centroid_px": 0.07})[0].layout
    np.testing.assert_array_equal(stated.target_sd, [0.07] * 3)
    np.testing.assert_array_equal(stated.calibration_sd, [0.07] * 3)
    free = cases()[0].layout
    assert (free.calibration_sd < free.target_sd).all()  # 20 frames averaged against one
    assert (free.calibration_sd >= SYSTEMATIC_PX).all()


def test_a_camera_that_looks_away_is_left_to_the_prediction():
    away = {**RIG["cameras"], "cam1": {**RIG["cameras"]["cam1"], "target": [-200, 100, 30]}}
    assert np.isfinite(cases(cameras=away)[0].layout.target_sd[1:]).all()


def test_points_may_be_given_by_name():
    named = {"points": {"a": [0, 0, 0], "b": [1, 2, 3]}}
    np.testing.assert_array_equal(cases(calibration=named)[0].layout.p, [[0, 0, 0], [1, 2, 3]])


def test_a_default_may_be_swept_and_the_plan_stays_as_it_was():
    values = {"cameras": {"a": {"field": 1}, "b": {"field": 2}}, "sweeps": {"x": [1]}}
    varied = changed(values, "light.noise", [5], "here")
    assert varied == {"cameras": values["cameras"], "light": {"noise": [5]}}
    every = changed(values, "cameras.*.field", 9, "here")
    assert [camera["field"] for camera in every["cameras"].values()] == [9, 9]
    assert [camera["field"] for camera in values["cameras"].values()] == [1, 2]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"sweeps": {"cameras.cam9.field": [1]}}, "sweeps.cameras.cam9.field: no camera 'cam9'"),
        ({"sweeps": {"camera_count.x": [1]}}, "camera_count"),
        ({"camera_count": 4}, "rig.yaml: camera_count is 4; the plan has 3. Take 2 or more."),
        ({"volume": {"low": [1, 0, 0], "high": [0, 1, 1]}}, "rig.yaml: volume: low [1.0, 0.0, 0.0] is above high"),
        ({"calibration": {"points": {}}}, "rig.yaml: calibration.points: there is none."),
        ({"volume": {"samples": 2**31}}, "rig.yaml: volume.samples: Input should be less than or equal to 100"),
        ({"calibration": {**RIG["calibration"], "fix": ["kapa"]}}, "calibration.fix: no parameter 'kapa'"),
        ({"light": {"contrst": 1}}, "rig.yaml: light.contrst: no such setting; did you mean 'contrast'?"),
    ],
)
def test_a_mistake_is_named_by_its_place(changes, says):
    assert says in refused(**changes)


def test_a_camera_that_looks_at_itself_is_named():
    at_itself = {**RIG["cameras"], "cam1": {**RIG["cameras"]["cam1"], "target": [-60, 40, 30]}}
    assert "Move the camera or its target" in refused(cameras=at_itself)


def test_a_file_is_read_and_named_in_messages(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text("cameras: {cam1: {position: [0, 0, 1]}}\n")
    with pytest.raises(VidtrackError, match=r"rig\.yaml"):
        read_sensitivity(str(path))
