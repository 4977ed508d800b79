"""Stretches of time that the refinement has not seen decide."""

import numpy as np

from tests.calibration.body.test_body_fit import BODY, _scene
from vidtrack.calibration.body.body_heldout import judge_held_out


def test_cameras_known_roughly_gain_and_cameras_known_exactly_do_not():
    truth, prior, sights, poses = _scene(1, noise=0.02)
    rough = judge_held_out(prior, sights, BODY, poses)
    assert rough.helps
    assert rough.distance[1] < 0.5 * rough.distance[0]
    exact = judge_held_out(
        type(prior)(truth, prior.names, prior.pivot, np.asarray(prior.covariance) * 1e-6), sights, BODY, poses
    )
    assert not exact.helps
    assert abs(exact.px[1] - exact.px[0]) < 1e-4
