"""What one camera sees lies on a curve in another's picture."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.geometry.underwater import ABOVE, LEFT, RIGHT, SURFACE, looking, places
from vidtrack.geometry.camera import line_of_sight, project, undistorted_from_frame_buffer
from vidtrack.geometry.epipolar import epipolar_distance, essential
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.light import along_path
from vidtrack.simulate.rig import look_at, thesis_rig

PLAIN = LEFT.with_(through=())


def test_side_by_side_cameras_see_a_point_at_one_height():
    a = thesis_rig(1)[0].with_(kappa1=0.0, Cx=250.0, Cy=240.0)
    R = look_at([0, -100, 0], [0, 0, 0])
    a = a.with_(R=R, T=-R @ np.array([0.0, -100, 0]))
    b = a.with_(T=a.T - np.array([10.0, 0, 0]))  # 10 in to the right
    assert epipolar_distance(a, b, [300.0, 200.0], [280.0, 200.0]) == pytest.approx(0)
    assert epipolar_distance(a, b, [300.0, 200.0], [280.0, 203.0]) == pytest.approx(3)
    assert epipolar_distance(a, b, [300.0, 200.0], [280.0, 198.0]) == pytest.approx(-2)


@settings(max_examples=50)
@given(
    st.sampled_from([(0, 1), (1, 0), (0, 2), (3, 1)]),
    st.tuples(st.floats(-30, 30), st.floats(-20, 20), st.floats(-20, 20)),
)
def test_one_point_seen_twice_is_no_distance_from_its_curve(pair, p):
    cameras = thesis_rig(4)
    a, b = cameras[pair[0]].with_(skew=0.01, p1=1e-4), cameras[pair[1]].with_(p2=2e-4)
    assert abs(epipolar_distance(a, b, project(a, p), project(b, p))) < 1e-8


def test_the_distance_is_that_from_the_curve_itself():
    a, b = (c.with_(skew=0.3) for c in thesis_rig(2))
    rng = np.random.default_rng(0)
    p = rng.uniform(-25, 25, (100, 3))
    seen = project(b, p) + rng.normal(0, 1, (100, 2))
    # where b may see what a sees, 90 to 260 in from a; equal steps of 1/distance are nearly equal ones in the picture
    origin, direction = line_of_sight(a, project(a, p))
    curve = project(b, origin + direction[:, None] / np.linspace(1 / 90, 1 / 260, 20_000)[:, None])
    exact = np.linalg.norm(curve - seen[:, None], axis=-1).min(-1)
    # first order in a px or two of a lens that bends over hundreds; steps of the polyline are 0.02 px
    assert np.abs(epipolar_distance(a, b, project(a, p), seen)) == pytest.approx(exact, rel=0.01, abs=0.005)


def test_noise_in_both_pictures_shows():
    a, b = thesis_rig(2)
    rng = np.random.default_rng(1)
    p = rng.uniform(-25, 25, (5000, 3))
    d = epipolar_distance(
        a, b, project(a, p) + rng.normal(0, 0.1, (5000, 2)), project(b, p) + rng.normal(0, 0.1, (5000, 2))
    )
    assert d.std() == pytest.approx(0.14, rel=0.06)


def test_the_essential_matrix_is_opencvs():
    a, b = thesis_rig(2)
    rng = np.random.default_rng(2)
    p = rng.uniform(-25, 25, (30, 3))
    tangents = [undistorted_from_frame_buffer(c, project(c, p)) / c.f for c in (a, b)]
    theirs, _ = cv2.findEssentialMat(tangents[0], tangents[1], np.eye(3), method=cv2.LMEDS)
    ours = essential(a, b)
    ours, theirs = ours / np.linalg.norm(ours), theirs / np.linalg.norm(theirs)
    assert min(np.abs(ours - theirs).max(), np.abs(ours + theirs).max()) < 1e-6


def test_a_lost_target_has_no_distance():
    a, b = thesis_rig(2)
    d = epipolar_distance(a, b, [[np.nan, np.nan], [250.0, 240.0]], [[250.0, 240.0], [np.nan, 1.0]])
    assert np.isnan(d).all()


def test_all_pairs_of_tracks_come_in_one_call():
    a, b = thesis_rig(2)
    assert epipolar_distance(a, b, np.full((3, 1, 7, 2), 250.0), np.full((4, 7, 2), 240.0)).shape == (3, 4, 7)


def test_through_interfaces_what_two_cameras_see_of_a_point_lies_on_the_curve():
    p = places(200)[:, :3] - [0, 0, 100]
    for a, b in ((LEFT, RIGHT), (LEFT, ABOVE), (ABOVE, PLAIN)):
        there = p[p[:, 2] < 100] if a is not ABOVE else p
        d = epipolar_distance(a, b, project(a, there), project(b, there))
        assert np.abs(d).max() < 1e-8


def test_through_interfaces_the_distance_is_that_to_the_nearest_point_of_the_curve():
    p = np.array([50.0, 30, 20])
    seen = project(RIGHT, p) + np.array([0.4, 1.3])
    curve = project(RIGHT, along_path(LEFT, project(LEFT, p), np.linspace(1400, 1900, 20001)))
    nearest = np.linalg.norm(curve - seen, axis=-1).min()
    assert abs(epipolar_distance(LEFT, RIGHT, project(LEFT, p), seen)) == pytest.approx(nearest, rel=0.01)


def test_an_interface_that_bends_nothing_gives_the_distances_of_straight_lines():
    clear = Interface("clear", np.array([0.0, -500, 0]), np.array([0.0, 1, 0]), (1.0, 1.0))
    p = places(30)
    a, b = LEFT.with_(through=()), RIGHT.with_(through=())
    seen = project(a, p), project(b, p) + 0.7
    bent = epipolar_distance(a.with_(through=(clear,)), b.with_(through=(clear,)), *seen)
    np.testing.assert_allclose(bent, epipolar_distance(a, b, *seen), rtol=1e-3)


def test_above_and_in_the_water_a_point_lies_on_its_curve():
    other = looking((-600, -700, 1500), SURFACE)
    for z in (-150.0, 20.0, 200.0):
        p = np.array([40.0, -30, z])
        assert abs(epipolar_distance(ABOVE, other, project(ABOVE, p), project(other, p))) < 1e-8
