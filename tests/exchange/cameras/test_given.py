import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.exchange.cameras.rig import said
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.given import Said, chosen, lens_findings, needed_size, of_lens, rotation
from vidtrack.geometry.brown import BrownLens


def test_a_rotation_is_read_from_nine_numbers_or_three():
    R = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    np.testing.assert_allclose(rotation(R.ravel(), "x"), R, atol=1e-12)
    np.testing.assert_allclose(rotation([0.1, -0.2, 0.3], "x"), R, atol=1e-12)
    rounded = rotation(np.round(R, 4), "x")
    np.testing.assert_allclose(rounded @ rounded.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("values", [np.diag([1, 1, -1.0]), np.ones((3, 3)), np.zeros(4)])
def test_a_mirror_and_what_is_no_rotation_are_refused(values):
    with pytest.raises(VidtrackError, match="rotation"):
        rotation(values, "x")


def test_a_camera_is_the_named_one_the_one_of_its_name_or_the_only_one():
    assert chosen(["a", "cam1"], said(), "x") == 1
    assert chosen(["a", "cam1"], said(camera="a"), "x") == 0
    assert chosen(["a"], said(), "x") == 0
    with pytest.raises(VidtrackError, match="has cameras a, b"):
        chosen(["a", "b"], said(), "x")


def test_a_size_that_is_not_known_is_asked_for():
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.size"):
        needed_size(said(), "DLT")


def test_a_lens_that_is_not_met_is_reported_from_a_tenth_of_a_pixel():
    assert lens_findings("x", "cam1", 0.05) == ()
    assert lens_findings("x", "cam1", 0.4)[0].code == "lens-converted"


def test_a_lens_that_folds_within_the_picture_is_said():
    lens = BrownLens(770.0, 770.0, 639.5, 511.5, (1280, 1024), (-0.285,))
    codes = [finding.code for finding in of_lens("anipose", lens, np.eye(3), np.zeros(3), Said("cam1", "m")).findings]
    assert codes == ["lens-converted", "lens-folds"]
    mild = lens._replace(k=(-0.05,))
    assert of_lens("anipose", mild, np.eye(3), np.zeros(3), Said("cam1", "m")).findings == ()
