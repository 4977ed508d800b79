import cv2
import numpy as np
import pytest

from tests.exchange.cameras.rig import BROWN, RVEC, SIZE, TVEC, K, points, said, seen
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.opencv import stored
from vidtrack.geometry.camera import project


def write(path, **values):
    """A file that cv2.FileStorage itself writes."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()


WHOLE = {
    "image_width": SIZE[0],
    "image_height": SIZE[1],
    "camera_matrix": K,
    "distortion_coefficients": BROWN.reshape(1, 5),
    "rvec": RVEC.reshape(3, 1),
    "tvec": TVEC.reshape(3, 1),
}


@pytest.mark.parametrize("ending", ["yaml", "yml", "xml"])
def test_what_filestorage_wrote_is_read_as_filestorage_reads_it(tmp_path, ending):
    path = tmp_path / f"cam1.{ending}"
    write(path, **WHOLE)
    own, theirs = stored(path), cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    for name in ("camera_matrix", "distortion_coefficients", "rvec", "tvec"):
        np.testing.assert_array_equal(own[name], theirs.getNode(name).mat())
    given = read_camera(path, said())
    np.testing.assert_allclose(project(given.camera, points()), seen(), atol=given.largest_px + 1e-6)
    assert given.largest_px < 0.05


def test_a_rotation_matrix_and_other_names_are_known(tmp_path):
    whole = {"K": K, "D": BROWN, "R": cv2.Rodrigues(RVEC)[0], "T": TVEC}
    write(tmp_path / "cam1.yml", **whole)
    given = read_camera(tmp_path / "cam1.yml", said(size=SIZE))
    np.testing.assert_allclose(project(given.camera, points()), seen(), atol=given.largest_px + 1e-6)
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.size"):
        read_camera(tmp_path / "cam1.yml", said())


@pytest.mark.parametrize(
    ("left_out", "what"),
    [
        ("camera_matrix", "no camera_matrix"),
        ("distortion_coefficients", "no distortion_coefficients"),
        ("rvec", "a lens without a pose"),
    ],
)
def test_what_is_missing_is_named_in_one_line(tmp_path, left_out, what):
    write(tmp_path / "cam1.yml", **{name: value for name, value in WHOLE.items() if name != left_out})
    with pytest.raises(VidtrackError, match=what) as error:
        read_camera(tmp_path / "cam1.yml", said())
    assert "\n" not in str(error.value)


def test_a_file_that_breaks_off_is_refused(tmp_path):
    path = tmp_path / "cam1.yml"
    write(path, **WHOLE)
    path.write_text(path.read_text()[:200])
    with pytest.raises(VidtrackError, match="not a file of OpenCV"):
        read_camera(path, said())
