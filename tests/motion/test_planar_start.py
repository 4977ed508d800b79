"""A square's first pose from one picture."""

import numpy as np

from tests.motion.tags import SQUARE, errors, poses, rig, seen
from vidtrack.motion.planar_start import planar_start
from vidtrack.motion.sighted_pose import SightedPose


def as_pose(origin, R):
    return SightedPose(origin, R, *[None] * 7)


def test_without_noise_it_is_the_pose():
    origin, R = poses(T=30)
    sightings = seen(rig(1), SQUARE, origin, R, sd=1e-12)
    found = planar_start(sightings.cameras[0], sightings.b[0], SQUARE)
    assert np.abs(errors(as_pose(*found), origin, R)).max() < 1e-4


def test_a_square_that_lies_anywhere_in_the_body_is_found_as_well():
    origin, R = poses(T=10)
    turn = np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]])
    face = SQUARE @ turn.T + [200.0, -50, 30]
    R = R @ turn.T  # so that this face looks at the camera
    sightings = seen(rig(1), face, origin, R, sd=1e-12)
    found = planar_start(sightings.cameras[0], sightings.b[0], face)
    assert np.abs(errors(as_pose(*found), origin, R)).max() < 1e-4


def test_a_corner_that_is_missing_leaves_none():
    origin, R = poses(T=3)
    sightings = seen(rig(1), SQUARE, origin, R)
    sightings.b[0, 1, 2] = np.nan
    found, _ = planar_start(sightings.cameras[0], sightings.b[0], SQUARE)
    assert np.isfinite(found).all(-1).tolist() == [True, False, True]
