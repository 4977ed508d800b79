"""How large a body is shows itself wherever more than one plane in one camera does."""

import numpy as np
import pytest

from tests.motion.tags import SQUARE, poses, rig, seen
from vidtrack.motion.planar_start import planar_start
from vidtrack.motion.scale import scale_of
from vidtrack.motion.sighted_pose import sighted_pose


def scale(n, factor, T=40):
    origin, R = poses(T=T)
    given = SQUARE / factor
    sightings = seen(rig(n), SQUARE, origin, R, sd=0.05)._replace(body=given)
    pose = sighted_pose(sightings, planar_start(sightings.cameras[0], sightings.b[0], given))
    return scale_of(sightings, pose, given), pose


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.1])
def test_two_cameras_show_the_true_size(factor):
    own, _ = scale(2, factor)
    assert own.factor == pytest.approx(factor, abs=1e-3)
    assert (own.off(5.0, 0.005) is None) == (factor == 1.0)


def test_one_tag_in_one_camera_says_nothing_of_its_size():
    own, _ = scale(1, 1.1)
    assert own.sd == np.inf
    assert own.off(5.0, 0.005) is None
    assert own.as_record() == {"factor": None, "factor_sd": None}


def test_a_tag_that_may_be_larger_may_be_farther_away():
    """One camera: 1 % of the size is 1 % of the distance."""
    own, pose = scale(1, 1.0)
    sd = np.sqrt(own.covariance_of(0.01)[:, 5, 5])
    np.testing.assert_allclose(sd, 0.01 * pose.origin[:, 2], rtol=0.02)
