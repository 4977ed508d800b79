"""OpenCV's YAML, read by cv2.FileStorage."""

import cv2
import numpy as np
import pytest

from tests.exchange.runs import camera, run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.opencv_yaml import write


def read(tmp_path, own):
    (tmp_path / "cam1.yml").write_bytes(write(run(cameras={"cam1": own})).files["cam1.yml"])
    storage = cv2.FileStorage(str(tmp_path / "cam1.yml"), cv2.FILE_STORAGE_READ)
    names = ("camera_matrix", "distortion_coefficients", "R", "T", "position")
    found = {name: storage.getNode(name).mat() for name in names}
    found |= {name: storage.getNode(name).real() for name in ("image_width", "largest_error_px", "fisheye_model")}
    return found | {"units": storage.getNode("units").string()}


def test_opencv_projects_points_to_where_the_camera_sees_them(tmp_path):
    own = camera(kappa1=1e-3)
    got = read(tmp_path, own)
    p, b = seen_by(own)
    r = cv2.Rodrigues(got["R"])[0]
    px = cv2.projectPoints(p, r, got["T"], got["camera_matrix"], got["distortion_coefficients"])[0][:, 0]
    assert np.linalg.norm(px - b, axis=-1).max() <= 1.05 * got["largest_error_px"] + 1e-6
    assert got["units"] == "in"
    assert got["image_width"] == 512


def test_rotation_and_place_come_back_to_the_last_digit(tmp_path):
    got = read(tmp_path, camera())
    np.testing.assert_array_equal(got["R"], camera().R)
    np.testing.assert_array_equal(got["T"][:, 0], camera().T)
    np.testing.assert_array_equal(got["position"][:, 0], camera().position)


@pytest.mark.parametrize("own", [camera(kappa1=0.0), camera(kappa1=1e-20), camera(T=np.array([1e-17, 3.0, 1e12]))])
def test_numbers_of_any_size_are_read_as_reals(tmp_path, own):
    np.testing.assert_array_equal(read(tmp_path, own)["T"][:, 0], own.T)


def test_a_wide_lens_has_four_coefficients(tmp_path):
    got = read(tmp_path, camera(projection="equidistant", kappa1=1e-4))
    assert got["fisheye_model"] == 1
    assert got["distortion_coefficients"].size == 4
