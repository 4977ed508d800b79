"""camera.json: what is written is what is read, and what the contract promises is there."""

import json

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import Calibrated, camera_record, located_by, read_camera, write_camera
from vidtrack.geometry.camera import project
from vidtrack.geometry.interface import Interface
from vidtrack.simulate.rig import thesis_points, thesis_rig


@pytest.fixture
def fit():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    b = project(camera, p) + np.random.default_rng(0).normal(0, 0.1, (64, 2))
    return refine(camera, p, b, free=free_parameters("brown"))


def test_a_camera_comes_back_to_the_last_digit(fit, tmp_path):
    write_camera(tmp_path / "camera.json", fit.camera, fit.uncertainty, {"model": "brown"}, {"vidtrack": "0"})
    back = read_camera(tmp_path / "camera.json")
    p = thesis_points()[1]
    np.testing.assert_array_equal(project(back.camera, p), project(fit.camera, p))
    assert back.camera.name == fit.camera.name
    assert back.camera.image_size == (512, 480)
    assert back.uncertainty.names == fit.uncertainty.names
    np.testing.assert_array_equal(back.uncertainty.covariance, fit.uncertainty.covariance)
    np.testing.assert_array_equal(back.uncertainty.pivot, fit.uncertainty.pivot)
    assert back.record["provenance"] == {"vidtrack": "0"}


def test_a_camera_is_one_of_points_and_one_of_an_older_version_of_the_outlines_of_balls(fit, tmp_path):
    path = tmp_path / "camera.json"
    write_camera(path, fit.camera, fit.uncertainty, {"n_points": 64})
    assert read_camera(path).describes == "points"
    record = json.loads(path.read_text())
    del record["describes"], record["checksum"]
    path.write_text(json.dumps(record))
    old = read_camera(path)
    assert old.describes == "outlines"
    write_camera(path, fit.camera, fit.uncertainty, {**old.record, "describes": old.describes})  # as bundle does
    assert read_camera(path).describes == "outlines"
    del record["n_points"]  # of another program, which had no balls
    assert Calibrated(fit.camera, None, record).describes == "points"


def test_standard_errors_and_correlations_go_by_name(fit):
    record = camera_record(fit.camera, fit.uncertainty, {"model": "brown"})
    assert set(record["standard_errors"]) == set(fit.uncertainty.names)
    assert record["correlations"]["f"]["f"] == 1
    assert record["correlations"]["f"]["t_z"] == record["correlations"]["t_z"]["f"]
    assert record["det_R"] == pytest.approx(1)
    np.testing.assert_allclose(record["position"], fit.camera.position)


def test_richer_terms_are_written_where_the_model_has_them(fit):
    assert {"kappa2", "p1", "p2"} <= set(camera_record(fit.camera, None, {"model": "brown"}))
    assert "kappa2" not in camera_record(thesis_rig(1)[0], None, {"model": "tsai"})


def test_extra_keys_cannot_overwrite_the_camera(fit):
    assert camera_record(fit.camera, None, {"f": 1.0, "note": "x"})["f"] == fit.camera.f


def test_an_unknown_covariance_is_null_in_the_file_and_nan_when_read(fit, tmp_path):
    unknown = fit.uncertainty._replace(covariance=np.full_like(fit.uncertainty.covariance, np.nan))
    write_camera(tmp_path / "camera.json", fit.camera, unknown, {})
    assert json.loads((tmp_path / "camera.json").read_text())["standard_errors"]["f"] is None
    assert np.isnan(read_camera(tmp_path / "camera.json").uncertainty.covariance).all()


@pytest.mark.parametrize("text", ['{"f": 3}', '{"f": "long"}', "[]", "{"])
def test_a_file_without_a_camera_is_named(text, tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(VidtrackError, match=r"camera\.json"):
        read_camera(path)


def test_interfaces_come_back_to_the_last_digit(fit, tmp_path):
    window = Interface("window", np.array([0, 0, 1.0]) / 3, np.array([0.1, 0, 1]), (1.0, 1.49, 1.333), (0.5,))
    write_camera(tmp_path / "camera.json", fit.camera.with_(through=(window,)), fit.uncertainty, {})
    back = read_camera(tmp_path / "camera.json").camera.through[0]
    np.testing.assert_array_equal(back.point, window.point)
    np.testing.assert_array_equal(back.normal, window.normal)
    assert (back.name, back.indices, back.thickness) == ("window", window.indices, window.thickness)


def test_runs_are_located_by_the_refined_camera_where_the_config_asks_for_one_and_it_is_there(tmp_path):
    (tmp_path / "camera.json").write_text("{}")
    assert located_by(str(tmp_path), True) == str(tmp_path / "camera.json")
    (tmp_path / "refined.json").write_text("{}")
    assert located_by(str(tmp_path), True) == str(tmp_path / "refined.json")
    assert located_by(str(tmp_path), False) == str(tmp_path / "camera.json")
