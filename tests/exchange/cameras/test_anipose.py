import cv2
import numpy as np
import pytest

from tests.exchange.cameras.rig import BROWN, RVEC, SIZE, TVEC, K, points, said, seen
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.geometry.camera import project


def toml(distortions=BROWN, extra="") -> str:
    """As aniposelib's toml.dumps writes it."""

    def numbers(values):
        return "[ " + ", ".join(repr(float(v)) for v in values) + ",]"

    def section(k, name, shift):
        return (
            f'[cam_{k}]\nname = "{name}"\nsize = [ {SIZE[0]}, {SIZE[1]},]\n'
            f"matrix = [ {numbers(K[0])}, {numbers(K[1])}, {numbers(K[2])},]\ndistortions = {numbers(distortions)}\n"
            f"rotation = {numbers(RVEC)}\ntranslation = {numbers(TVEC + shift)}\n{extra}\n"
        )

    return section(0, "cam1", 0) + section(1, "cam10", 9) + "[metadata]\nadjusted = false\nerror = 0.2\n"


@pytest.mark.parametrize("distortions", [BROWN, BROWN[:4], np.zeros(5), np.array([-0.15, 0, 0, 0, 0])])
def test_the_camera_sees_points_where_opencv_does(tmp_path, distortions):
    (tmp_path / "cam1.toml").write_text(toml(distortions))
    given = read_camera(tmp_path / "cam1.toml", said())
    theirs = seen(np.append(distortions, [0.0])[:5])
    assert given.largest_px < 0.15
    np.testing.assert_allclose(project(given.camera, points()), theirs, atol=given.largest_px + 1e-6)
    assert given.camera.image_size == SIZE


def test_a_fisheye_lens_is_read_as_opencv_has_it(tmp_path):
    k = np.array([0.02, -0.004, 0.001, -2e-4])
    (tmp_path / "cam1.toml").write_text(toml(k, "fisheye = true"))
    given = read_camera(tmp_path / "cam1.toml", said())
    theirs = cv2.fisheye.projectPoints(points()[:, None], RVEC, TVEC, K, k)[0][:, 0]
    np.testing.assert_allclose(project(given.camera, points()), theirs, atol=given.largest_px + 1e-6)
    assert given.largest_px < 0.05


def test_a_camera_is_chosen_by_its_name_and_not_by_the_order_of_the_file(tmp_path):
    (tmp_path / "x.toml").write_text(toml())
    other = read_camera(tmp_path / "x.toml", said(camera="cam10")).camera
    np.testing.assert_allclose(other.position, -cv2.Rodrigues(RVEC)[0].T @ (TVEC + 9), atol=1e-9)
    with pytest.raises(VidtrackError, match=r"cameras\.left\.camera_file\.camera: .* has cameras cam1, cam10"):
        read_camera(tmp_path / "x.toml", said(name="left"))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda t: t[:150], "not TOML|has no"),
        (lambda t: "a = " + "[" * 20_000, "nested|not TOML"),
        (lambda t: "a = " + "{a=" * 20_000, "nested|not TOML"),
        (lambda t: t.replace("rotation", "rotatio"), "has no rotation"),
        (lambda t: t.replace("matrix", "matrx"), "no camera with a matrix"),
        (lambda t: t.replace("size = [ 1280, 960,]", "size = [ 1280,]"), "size of camera cam1 is not 2 numbers"),
    ],
)
def test_a_file_that_is_not_whole_is_refused_in_one_line(tmp_path, change, what):
    (tmp_path / "cam1.toml").write_text(change(toml()))
    with pytest.raises(VidtrackError, match=what) as error:
        read_camera(tmp_path / "cam1.toml", said())
    assert "\n" not in str(error.value)
