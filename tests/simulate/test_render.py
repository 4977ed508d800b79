"""Balls drawn by exact area: laws that any renderer must hold, and an ellipse derived another way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.render import FINE, Patches, coverage, outlines, shading, softened, vertices_needed
from vidtrack.simulate.rig import look_at, thesis_points, thesis_rig


def circle(x, y, r, n=400):
    a = 2 * np.pi * np.arange(n) / n
    return np.stack([x + r * np.cos(a), y + r * np.sin(a)], -1)[None]


def polygon_area_and_centroid(b):
    x, y = b[..., 0], b[..., 1]
    x1, y1 = np.roll(x, -1, -1), np.roll(y, -1, -1)
    cross = x * y1 - x1 * y
    area = cross.sum(-1) / 2
    centroid = np.stack([((x + x1) * cross).sum(-1), ((y + y1) * cross).sum(-1)], -1) / (6 * area[..., None])
    return np.abs(area), centroid


def centre_of_light(patches: Patches):
    mass = patches.coverage.sum((1, 2))
    at = np.arange(patches.coverage.shape[1])
    X = (patches.coverage.sum(1) * at).sum(1) / mass + patches.left
    Y = (patches.coverage.sum(2) * at).sum(1) / mass + patches.top
    return np.stack([X, Y], -1)


def test_a_square_over_four_pixels_fills_each_by_its_share():
    square = np.array(
        [[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [0.5, 1.0], [0.0, 1.0], [0.0, 0.5]]]
    )
    patches = coverage(square + np.array([10.25, 20.0]))
    assert (patches.left[0], patches.top[0]) == (10, 20)
    shares = patches.coverage[0][:2, :2]
    assert shares == pytest.approx(np.array([[0.125, 0.375], [0.125, 0.375]]))


@settings(max_examples=50, deadline=None)
@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(0.3, 20))
def test_the_shares_of_a_circle_add_up_to_its_area(x, y, r):
    b = circle(x, y, r)
    area, _ = polygon_area_and_centroid(b)
    assert coverage(b).coverage.sum() == pytest.approx(area[0], rel=1e-9)


def test_each_share_agrees_with_counting_fine_samples():
    b = circle(3.3, 2.1, 2.7)
    patches = coverage(b)
    size, fine = patches.coverage.shape[1], 200
    at = (np.arange(size * fine) + 0.5) / fine - 0.5
    inside = (at[None, :] + patches.left[0] - 3.3) ** 2 + (at[:, None] + patches.top[0] - 2.1) ** 2 < 2.7**2
    counted = inside.reshape(size, fine, size, fine).mean((1, 3))
    assert patches.coverage[0] == pytest.approx(counted, abs=2e-3)


def test_an_outline_that_is_not_wholly_in_front_of_the_camera_draws_nothing():
    R = look_at([-10, 0, 0], [0, 0, 0])
    camera = Camera(50, 50, 0.01, 0.01, 1, 10, 0, R, -R @ [-10, 0, 0], (100, 100))
    b = outlines(camera, [[-10.5, 0, 0], [-30, 0, 0]], 1.0)
    assert np.isnan(b).any((-1, -2)).all()
    assert coverage(b).coverage.sum() == 0


def test_on_the_optical_axis_a_ball_is_a_circle_of_the_tangent_cones_radius():
    R = look_at([-10, 0, 0], [0, 0, 0])
    camera = Camera(50, 50, 0.01, 0.01, 1, 10, 0, R, -R @ [-10.0, 0, 0], (100, 100))
    radius = np.hypot(*(outlines(camera, [0, 0, 0], 0.5) - 50).T)
    exact = 10 / 0.01 * 0.5 / np.sqrt(100 - 0.25)
    assert radius == pytest.approx(exact, rel=1e-3)  # the polygon is widened to hold the circle's area
    assert polygon_area_and_centroid(outlines(camera, [0, 0, 0], 0.5))[0] == pytest.approx(np.pi * exact**2, rel=1e-9)


def test_a_balls_ellipse_is_centred_where_the_cones_quadric_says():
    """The outline is the conic u^T (c c^T - (|c|^2 - r^2) I) u = 0 in the picture plane: its centre is where the
    gradient vanishes, and its area pi f^2 det3 / (-det2)^(3/2). No polygon, no tangent circle."""
    R = look_at([-10, 0, 0], [0, 0, 0])
    camera = Camera(0, 0, 0.01, 0.01, 1, 10, 0, R, -R @ [-10.0, 0, 0], (1000, 1000))
    c, r = np.array([3.0, -2.0, 9.0]), 1.2
    Q = np.outer(c, c) - (c @ c - r * r) * np.eye(3)
    centre = np.linalg.solve(Q[:2, :2], -Q[:2, 2])
    area = np.pi * abs(np.linalg.det(Q)) / abs(np.linalg.det(Q[:2, :2])) ** 1.5
    world = camera.R.T @ (c - camera.T)
    got_area, got_centre = polygon_area_and_centroid(outlines(camera, world, r, 2048))
    assert got_centre / 1000 == pytest.approx(centre, rel=1e-6)
    assert got_area / 1000**2 == pytest.approx(area, rel=1e-6)
    assert np.linalg.norm(got_centre - project(camera, world)) > 5  # px: near by, the offset is no small matter


def test_the_centre_of_light_of_a_far_ball_is_its_projection():
    camera = thesis_rig()[0]
    _, places = thesis_points()
    near, far = (centre_of_light(softened(outlines(camera, places, r), 0.6)) for r in (1.0, 0.4))
    truth = project(camera, places)
    assert np.abs(far - truth).max() < 0.002
    assert 0.003 < np.abs(near - truth).max() < 0.01  # the thesis's 2 in balls, seen as ellipses: a few mpx


@settings(max_examples=30, deadline=None)
@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(1, 6))
def test_blur_conserves_light_and_takes_off_the_samplings_error(x, y, r):
    soft = softened(circle(x, y, r), 0.6)
    assert soft.coverage.sum() == pytest.approx(coverage(circle(x, y, r)).coverage.sum())
    assert centre_of_light(soft)[0] == pytest.approx([x, y], abs=1e-3 / r)


def test_without_blur_the_shares_are_the_sharp_ones():
    assert (softened(circle(7.2, 9.9, 3.0), 0.0).coverage == coverage(circle(7.2, 9.9, 3.0)).coverage).all()


def test_blur_adds_its_variance():
    def variance(p):
        at = np.arange(p.coverage.shape[1]) + p.left[0] - 7.2
        return (p.coverage[0].sum(0) * at**2).sum() / p.coverage.sum()

    added = variance(softened(circle(7.2, 9.9, 3.0), 1.5)) - variance(coverage(circle(7.2, 9.9, 3.0)))
    assert added == pytest.approx(1.5**2, rel=0.01)


def test_a_shaded_ball_darkens_toward_its_rim_by_the_share_that_is_asked():
    radii, weights = shading(0.4)
    assert weights.sum() == pytest.approx(1)
    assert weights[radii >= 0.999].sum() == pytest.approx(0.6)
    half = weights[radii > 0.6].sum()  # 1 - 0.4 (1 - sqrt(1 - 0.36)) = 0.92
    assert half == pytest.approx(0.92, abs=0.03)
    assert shading(0.0)[0].tolist() == [1.0]


def test_an_exposure_is_the_mean_of_its_stations():
    stations = np.stack([circle(x, 5.0, 2.0)[0] for x in (4.0, 5.0, 6.0)])[None]
    patches = coverage(stations)
    assert patches.coverage.sum() == pytest.approx(polygon_area_and_centroid(circle(0, 0, 2.0))[0][0])
    assert centre_of_light(patches) == pytest.approx(np.array([[5.0, 5.0]]), abs=1e-6)


def test_an_outline_of_too_few_vertices_is_refused():
    with pytest.raises(ValueError, match="more vertices"):
        coverage(circle(0, 0, 5, n=16))


def test_edges_stay_under_a_fine_pixel_even_for_a_ball_that_fills_the_picture():
    camera = thesis_rig()[0]
    wide = camera.with_(f=3.0, kappa1=0.0)
    far_off = wide.position + wide.R.T @ [70.0, 50.0, 60.0]  # 55 degrees off the axis
    assert np.abs(np.diff(outlines(wide, far_off, 4.0), axis=0)).max() < 1 / FINE
    for r in (1.0, 6.0, 30.0):
        b = outlines(camera, [0, 0, 0], r, vertices_needed(camera, [0, 0, 0], r))
        assert np.abs(np.diff(b, axis=0)).max() < 1 / FINE
