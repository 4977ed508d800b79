"""What is said of a body with tags, and its columns."""

import numpy as np

from tests.motion.tags import SQUARE, poses
from vidtrack.motion.scale import Scale
from vidtrack.motion.sighted_pose import SightedPose
from vidtrack.motion.tag_body import TagPose, body_columns, findings_of, record_of, tag_columns

T = 20
ORIGIN, R = poses(T=T)


def body(flag="", factor=1.0, scale=None):
    C = np.broadcast_to(np.diag([1e-6] * 3 + [0.01, 0.04, 0.09]), (T, 6, 6))
    ones = np.ones(T)
    pose = SightedPose(ORIGIN, R, C, [], ones, np.full(T, 2), 0.02 * ones, ones, np.zeros(T, bool))
    return TagPose("float", (7,), SQUARE, pose, C, factor, np.full(T, 4), np.ones(T, int), [flag] * T, scale)


def codes(own):
    return [(finding.code, finding.level) for finding in findings_of(own, 100.0, "runs.swing")]


def test_a_good_body_has_no_finding():
    assert codes(body()) == []
    assert record_of([body()])["float"]["located"] == T


def test_each_thing_that_is_wrong_has_one():
    assert codes(body("ambiguous")) == [("tag-ambiguous", "bad")]
    assert codes(body("misfit")) == [("tag-misfit", "doubtful")]
    assert codes(body(factor=100.0)) == [("tag-misfit", "doubtful")]
    assert codes(body(scale=Scale(1.05, 1e-3, np.zeros((T, 6))))) == [("tag-size", "bad")]
    assert codes(body(scale=Scale(0.99, 1e-3, np.zeros((T, 6))))) == [("tag-size", "doubtful")]
    assert codes(body(scale=Scale(1.05, 0.1, np.zeros((T, 6))))) == []


def test_a_wrong_size_explains_the_rest():
    assert codes(body("ambiguous", 100.0, Scale(1.05, 1e-3, np.zeros((T, 6))))) == [("tag-size", "bad")]


def test_a_corner_away_from_the_origin_has_the_arm_s_sigma():
    """sd of 1 mrad about z at an arm of 50 across: 0.05 world units more."""
    centre, *corners = tag_columns(body(), np.arange(T) / 30, np.full(T, "", object), corners=True)
    assert centre["target"] == "tag7"
    assert [own["target"] for own in corners] == ["tag7_1", "tag7_2", "tag7_3", "tag7_4"]
    np.testing.assert_allclose(centre["sigma_x"], 0.1, rtol=1e-6)
    assert (corners[0]["sigma_x"] > centre["sigma_x"]).all()
    np.testing.assert_allclose(corners[1]["x"], (ORIGIN + R @ SQUARE[1])[:, 0])


def test_bodies_have_the_number_of_cameras():
    own = body_columns(body(), np.arange(T) / 30, np.full(T, "", object))
    assert (own["n_cameras"] == 1).all()
    assert own["body"] == "float"
