"""A point lies where its lines of sight come nearest, and sigma says how well that is known."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from vidtrack.geometry.camera import line_of_sight, project, undistorted_from_frame_buffer
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.triangulate import locate_points, places_of
from vidtrack.simulate.rig import thesis_rig


def seen(cameras, p):
    return np.stack([project(camera, p) for camera in cameras])


def noisy(cameras, p, sd, rng):
    b = seen(cameras, p)
    return b + rng.normal(0, sd, b.shape)


def inside(n, rng):
    """Points where the thesis's target moves, in."""
    return rng.uniform(-1, 1, (n, 3)) * (27, 6, 9)


def nearest(origins, directions):
    """The point nearest to lines by least squares, as in a textbook, and its rms distance; (n, 3) unit vectors."""
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    point = np.linalg.solve(across.sum(0), (across @ origins[..., None]).sum(0)[:, 0])
    return point, np.sqrt((((across @ (point - origins)[..., None]) ** 2).sum()) / len(origins))


def test_crossing_lines_two_apart_meet_midway():
    point, miss = nearest(np.array([[0, 0, 0], [0, 0, 2.0]]), np.array([[1.0, 0, 0], [0, 1, 0]]))
    assert point == pytest.approx([0, 0, 1])
    assert miss == pytest.approx(1)


def test_a_camera_that_lost_the_target_does_not_count():
    cameras = thesis_rig(3)
    b = seen(cameras, np.array([[3.0, 2.0, 1.0]]))
    b[2] = np.nan
    two = locate_points(cameras, b, sd=0.1)
    assert two.point == pytest.approx(np.array([[3.0, 2.0, 1.0]]), abs=1e-7)
    assert two.n_cameras == 2
    b[1] = np.nan
    one = locate_points(cameras, b, sd=0.1)
    assert np.isnan(one.point).all()
    assert one.n_cameras == 0


def test_places_alone_are_those_of_whole_fixes():
    rng = np.random.default_rng(6)
    cameras = thesis_rig(3)
    b = noisy(cameras, inside(40, rng), 0.1, rng)
    b[0, :10] = b[1, 5:15] = np.nan
    sd = rng.uniform(0.05, 0.2, b.shape)
    sd[2, 20:30] = np.inf
    for most_unsure in (0.25, 1e-4, np.inf):
        alone = places_of(cameras, b, sd, most_unsure=most_unsure)
        assert np.array_equal(alone, locate_points(cameras, b, sd=sd, most_unsure=most_unsure).point, equal_nan=True)
        assert np.isnan(alone[5:10]).all()
    assert np.isfinite(alone[30:]).all()


@settings(max_examples=40)
@given(
    st.integers(2, 4),
    st.tuples(st.floats(-30, 30), st.floats(-15, 15), st.floats(-15, 15)),
    st.floats(-1e4, 1e4),
    st.booleans(),
)
def test_what_cameras_see_of_a_point_locates_it_wherever_the_origin_lies(n, p, shift, refine):
    cameras = [c.with_(T=c.T - c.R @ np.full(3, shift)) for c in thesis_rig(n)]
    p = np.array(p) + shift
    located = locate_points(cameras, seen(cameras, p), refine=refine)
    assert np.abs(located.point - p).max() < 1e-9 * (1 + abs(shift) / 10)
    assert located.miss < 1e-8
    assert located.n_cameras == n


def test_lines_of_sight_and_frame_buffer_positions_locate_alike():
    cameras = thesis_rig(3)
    rng = np.random.default_rng(0)
    b = noisy(cameras, inside(50, rng), 0.1, rng)
    lines = [line_of_sight(camera, x) for camera, x in zip(cameras, b, strict=True)]
    centres, rays = np.stack([o for o, _ in lines]), np.stack([d for _, d in lines])
    located = locate_points(cameras, b, sd=0.1)
    # two ways to weigh the same 0.1 px (0.02 in) of noise
    for i, (point, miss) in enumerate(nearest(centres, rays[:, i]) for i in range(50)):
        assert np.abs(point - located.point[i]).max() < 0.02
        assert miss == pytest.approx(located.miss[i], abs=2e-3)


def test_the_refined_point_is_the_one_of_least_reprojection_error():
    cameras = thesis_rig(3)
    rng = np.random.default_rng(1)
    sd = np.array([0.3, 0.1, 0.5])
    p = inside(5, rng)
    b = seen(cameras, p) + rng.normal(0, 1, (3, 5, 2)) * sd[:, None, None]
    located = locate_points(cameras, b, sd=sd)
    for i in range(len(p)):
        found = least_squares(
            lambda q, i=i: ((seen(cameras, q) - b[:, i]) / sd[:, None]).ravel(), p[i], xtol=1e-14, ftol=1e-14
        )
        # the lens is linearised at the measured pixel: second order in 0.5 px of a lens that bends over 300
        assert located.point[i] == pytest.approx(found.x, abs=2e-4)
        information = found.jac.T @ found.jac
        assert located.covariance[i] == pytest.approx(np.linalg.inv(information), rel=0.01, abs=1e-7)


def test_the_error_is_what_was_measured_minus_what_is_projected():
    # a lens with every term, and points near the corners, where it bends most
    rng = np.random.default_rng(8)
    cameras = [c.with_(kappa1=2e-3, kappa2=2e-5, p1=5e-4, p2=-4e-4, skew=0.02) for c in thesis_rig(2)]
    p = rng.uniform(-1, 1, (50, 3)) * (35, 35, 10)
    b = noisy(cameras, p, 0.5, rng)
    for refine in (True, False):
        located = locate_points(cameras, b, sd=0.5, refine=refine)
        assert located.error == pytest.approx(b - seen(cameras, located.point), abs=0.005)
    # a lens that is linearised the wrong way leaves a larger sum of squares than the best point does
    i = 0
    best = least_squares(lambda q: (seen(cameras, q) - b[:, i]).ravel(), p[i], xtol=1e-14, ftol=1e-14)
    refined = locate_points(cameras, b, sd=0.5).point[i]
    assert np.sum((seen(cameras, refined) - b[:, i]) ** 2) == pytest.approx(2 * best.cost, rel=1e-4)


@pytest.mark.parametrize("refine", [True, False])
def test_the_covariance_is_the_noise_carried_by_the_pixels_to_the_point(refine):
    cameras = [c.with_(kappa1=2e-3, p1=5e-4, p2=-4e-4, skew=0.1) for c in thesis_rig(3)]
    sd = np.array([0.1, 0.2, 0.4])
    b = seen(cameras, np.array([33.0, -30, 9]))
    step = 0.01
    moved = np.stack([b + step * e.reshape(3, 2) for e in np.eye(6)], 1)
    by_pixel = (locate_points(cameras, moved, sd=sd, refine=refine).point - [33, -30, 9]) / step
    carried = np.einsum("ki,k,kj->ij", by_pixel, np.repeat(sd, 2) ** 2, by_pixel)
    assert locate_points(cameras, b, sd=sd, refine=refine).covariance == pytest.approx(carried, rel=0.01, abs=1e-5)


def test_the_linear_point_is_opencvs():
    cameras = thesis_rig(2)
    rng = np.random.default_rng(2)
    b = noisy(cameras, inside(20, rng), 0.1, rng)
    matrices = [np.column_stack([c.R, c.T]) for c in cameras]
    tangents = [undistorted_from_frame_buffer(c, x) / c.f for c, x in zip(cameras, b, strict=True)]
    homogeneous = cv2.triangulatePoints(*matrices, *(u.T for u in tangents))
    theirs = (homogeneous[:3] / homogeneous[3]).T
    ours = locate_points(cameras, b, sd=0.1, refine=False)
    # the same rows under another norm (theirs holds the homogeneous vector to length 1)
    assert np.abs(ours.point - theirs).max() < 5e-3


def test_two_cameras_err_by_what_their_centroids_noise_costs():
    # the notes on calibration measured 0.366 in per px on this rig: the floor of a perfect calibration
    cameras = thesis_rig(2)
    rng = np.random.default_rng(3)
    p = inside(20_000, rng)
    error = np.linalg.norm(locate_points(cameras, noisy(cameras, p, 0.1, rng), sd=0.1).point - p, axis=-1)
    assert error.mean() == pytest.approx(0.0366, rel=0.03)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_no_unbiased_answer_could_be_better(n):
    # Cramer and Rao: the information that the pixels hold, from the camera model's own derivatives
    cameras = thesis_rig(n)
    rng = np.random.default_rng(3)
    p = inside(10_000, rng)
    by_point = np.stack([derivatives(c, p, np.zeros(3)).by_point for c in cameras])
    information = np.einsum("cnki,cnkj->nij", by_point, by_point) / 0.1**2
    bound = np.sqrt(np.mean(np.trace(np.linalg.inv(information), axis1=-2, axis2=-1)))
    error = locate_points(cameras, noisy(cameras, p, 0.1, rng), sd=0.1).point - p
    assert np.sqrt(np.mean(np.sum(error**2, -1))) == pytest.approx(bound, rel=0.02)


@pytest.mark.parametrize("refine", [True, False])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_sigma_is_honest(n, refine):
    cameras = thesis_rig(n)
    rng = np.random.default_rng(4)
    p = inside(10_000, rng)
    sd = rng.uniform(0.05, 0.3, (n, 1, 1)) * np.ones((n, len(p), 2))
    b = seen(cameras, p) + rng.normal(0, 1, sd.shape) * sd
    located = locate_points(cameras, b, sd=sd, refine=refine)
    error = located.point - p
    assert np.mean((error / located.sigma) ** 2, 0) == pytest.approx(np.ones(3), abs=0.06)
    mahalanobis = np.einsum("ni,nij,nj->n", error, np.linalg.inv(located.covariance), error)
    assert mahalanobis.mean() == pytest.approx(3, abs=0.15)


def test_noise_that_nobody_knows_is_found_from_the_reprojection_errors():
    cameras = thesis_rig(2)
    rng = np.random.default_rng(5)
    p = inside(2000, rng)
    b = noisy(cameras, p, 0.1, rng)
    b[0, :40] += 15  # mistaken centroids are not noise
    located = locate_points(cameras, b)
    assert located.sd == pytest.approx(0.1, rel=0.06)
    assert np.mean(((located.point - p) / located.sigma)[40:] ** 2) == pytest.approx(1, abs=0.15)
    assert np.isnan(locate_points(cameras, b[:, :9]).sigma).all()  # 9 redundant measurements tell no noise
    assert np.isfinite(locate_points(cameras, b[:, :9]).point).all()


def test_a_lost_camera_makes_sigma_larger_and_a_lost_target_gives_nan():
    cameras = thesis_rig(3)
    b = seen(cameras, np.zeros((3, 3)))
    b[2, 1:] = np.nan
    b[1, 2] = np.nan
    located = locate_points(cameras, b, sd=0.1)
    assert located.n_cameras.tolist() == [3, 2, 0]
    assert (located.sigma[1] > located.sigma[0]).all()
    assert np.isnan(located.point[2]).all()
    assert np.isnan(located.sigma[2]).all()
    assert np.isnan(located.miss[2])
    assert np.isnan(located.error[2, 1:]).all()


def test_a_measurement_without_a_standard_deviation_is_not_used():
    cameras = thesis_rig(3)
    b = seen(cameras, np.zeros(3))
    b[2] += 50
    located = locate_points(cameras, b, sd=[0.1, 0.1, np.nan])
    assert located.point == pytest.approx(np.zeros(3), abs=1e-9)
    assert located.n_cameras == 2


def test_a_point_behind_a_camera_is_no_fix():
    a, b = thesis_rig(2)
    behind = 3 * a.position - 2 * b.position  # on the lines of sight backwards, beside the cameras
    backwards = [a.with_(R=np.diag([-1.0, -1.0, 1.0]) @ a.R, T=np.diag([-1.0, -1.0, 1.0]) @ a.T), b]
    lines = [[262.0, 240.0], project(b, behind)]
    assert np.isnan(locate_points(backwards, np.array(lines)).point).all()


def test_a_fix_at_a_cameras_own_centre_is_none_whatever_the_last_bit_says():
    """Lines of sight that diverge send the fit to a perspective centre, a rounding error before or behind it."""
    cameras = thesis_rig(2)
    for share in (0.0, 1e-15, 1e-6, -1e-6):
        near = cameras[0].position + share * cameras[0].R[2] * 100
        lines = np.stack([[[256.0, 240.0]], project(cameras[1], near)[None]])
        assert np.isnan(locate_points(cameras, lines).point).all()


def test_leading_axes_are_free():
    cameras = thesis_rig(2)
    p = np.random.default_rng(6).uniform(-10, 10, (4, 5, 3))
    located = locate_points(cameras, seen(cameras, p), sd=0.1)
    assert located.point.shape == (4, 5, 3)
    assert located.covariance.shape == (4, 5, 3, 3)
    assert located.left_out.shape == (2, 4, 5)
    assert np.abs(located.point - p).max() < 1e-9
    assert locate_points(cameras, np.zeros((2, 0, 2))).point.shape == (0, 3)


def test_blocks_do_not_show():
    cameras = thesis_rig(2)
    rng = np.random.default_rng(7)
    b = noisy(cameras, inside(20_000, rng), 0.1, rng)
    whole = locate_points(cameras, b, sd=0.1)
    part = locate_points(cameras, b[:, 8000:9000], sd=0.1)
    # where a block ends decides at most whether one step more is taken
    assert whole.point[8000:9000] == pytest.approx(part.point, abs=1e-6)


def test_a_clocks_standard_error_widens_sigma_along_the_motion_only():
    cameras = thesis_rig(2)
    p = np.zeros(3)
    velocity = np.array([90.0, 0, 0])  # in/s
    late = 0.001  # s, of camera 2
    slips = np.stack([np.zeros(2), project(cameras[1], p + velocity * late) - project(cameras[1], p)])
    still = locate_points(cameras, seen(cameras, p), sd=0.01)
    moving = locate_points(cameras, seen(cameras, p), sd=0.01, slips=slips)
    moved = locate_points(cameras, seen(cameras, p) + slips, sd=0.01).point
    assert moving.covariance - still.covariance == pytest.approx(np.outer(moved, moved), rel=0.01, abs=1e-6)


@pytest.mark.parametrize(
    ("cameras", "b", "kwargs"),
    [
        (1, np.zeros((1, 5, 2)), {}),
        (2, np.zeros((3, 5, 2)), {}),
        (2, np.zeros((2, 5, 3)), {}),
        (2, np.zeros((2, 5, 2)), {"sd": 0.0}),
        (2, np.zeros((2, 5, 2)), {"uncertainties": [None]}),
    ],
)
def test_shapes_that_do_not_match_are_refused(cameras, b, kwargs):
    with pytest.raises(ValueError, match=r"must be|uncertainties for"):
        locate_points(thesis_rig(cameras), b, **kwargs)


def test_a_small_base_line_far_away_is_located_as_well_as_its_sigma_says():
    """Two parallel cameras 4 in apart, 160 in away: lines of sight within 1.5 degrees of parallel."""
    first = thesis_rig(2)[0]
    R = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    cameras = [first.with_(R=R, T=np.array([x, 0.0, 160])) for x in (2.0, -2.0)]
    rng = np.random.default_rng(3)
    p = rng.uniform(-20, 20, (400, 3))
    b = np.stack([project(c, p) for c in cameras]) + rng.normal(0, 0.02, (2, 400, 2))
    located = locate_points(cameras, b, sd=0.02)
    z = (located.point - p) / located.sigma
    assert np.mean(z**2, 0) == pytest.approx(np.ones(3), abs=0.25)


def test_lines_so_nearly_parallel_that_sigma_is_a_large_share_of_the_distance_are_no_fix():
    first = thesis_rig(2)[0]
    for apart, found in ((0.5, True), (0.05, False)):
        cameras = [first.with_(R=np.eye(3), T=np.array([x, 0.0, 160])) for x in (apart / 2, -apart / 2)]
        b = np.stack([project(c, np.zeros(3)) for c in cameras])
        assert np.isfinite(locate_points(cameras, b, sd=0.2).point).all() == found
    same = [first, first]
    assert np.isnan(locate_points(same, np.stack([project(c, np.zeros(3)) for c in same]), sd=0.1).point).all()


def test_one_mistaken_camera_is_left_out_here_too():
    cameras = thesis_rig(4)
    p = np.zeros((3, 3))
    b = seen(cameras, p)
    b[2, 1] += 30.0
    located = locate_points(cameras, b, sd=0.1, reject=3.0)
    np.testing.assert_array_equal(located.left_out[:, 1], [False, False, True, False])
    assert located.left_out.sum() == 1
    assert located.n_cameras.tolist() == [4, 3, 4]
    assert located.point == pytest.approx(p, abs=1e-6)


def test_the_noise_that_is_found_is_the_median_of_many_mistakes_no_part_of_it():
    """A tenth of the points off by 2 to 40 px: the noise of the others is found."""
    cameras = thesis_rig(3)
    rng = np.random.default_rng(11)
    b = noisy(cameras, inside(3000, rng), 0.2, rng)
    b[1, :300, 0] += rng.uniform(2, 40, 300)
    assert locate_points(cameras, b).sd == pytest.approx(0.2, rel=0.05)


def test_a_sigma_of_a_quarter_of_the_distance_is_the_most():
    first = thesis_rig(2)[0]
    cameras = [first.with_(R=np.eye(3), T=np.array([x, 0.0, 160])) for x in (0.5, -0.5)]
    b = np.stack([project(c, np.zeros(3)) for c in cameras])
    sigma = np.linalg.norm(locate_points(cameras, b, sd=0.01).sigma) / 0.01
    for share, found in ((0.24, True), (0.26, False)):
        assert np.isfinite(locate_points(cameras, b, sd=share * 160 / sigma).point).all() == found
