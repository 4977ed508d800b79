"""A camera for notebooks is the camera that was written."""

import numpy as np

from tests.exchange.runs import camera
from vidtrack.files.camera_json import write_camera
from vidtrack.geometry.camera import project
from vidtrack.notebook.camera import CalibratedCamera


def loaded(tmp_path, own):
    write_camera(tmp_path / "camera.json", own, None, {"units": "cm", "model": "tsai"})
    return CalibratedCamera(str(tmp_path / "camera.json"))


def test_it_projects_as_the_camera_and_looks_back_along_the_line(tmp_path):
    own = camera()
    got = loaded(tmp_path, own)
    p = np.array([[0.0, 0.0, 0.0], [10.0, -5.0, 3.0]])
    px = got.project(p)
    np.testing.assert_allclose(px, project(own, p), rtol=1e-12)
    start, direction = got.line_of_sight(px)
    t = np.linalg.norm(p - start, axis=-1, keepdims=True)
    np.testing.assert_allclose(start + t * direction, p, atol=1e-9)
    np.testing.assert_allclose(start, got.position)


def test_undistorted_pixels_are_those_of_a_pinhole(tmp_path):
    own = camera(kappa1=1e-3, skew=1e-4)
    p = np.array([[10.0, -15.0, 3.0]])
    pinhole = own.without_lens().with_(skew=own.skew)
    np.testing.assert_allclose(loaded(tmp_path, own).undistorted(project(own, p)), project(pinhole, p), atol=1e-9)


def test_it_says_what_it_is(tmp_path):
    got = loaded(tmp_path, camera())
    assert repr(got).startswith("<vidtrack camera cam1: 512 x 480 px")
    assert got.units == "cm"
