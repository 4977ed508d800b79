import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from tests.geometry.underwater import ABOVE, AIR, CAMERAS, GLASS, LEFT, SURFACE, WATER, WEDGE, WINDOW, places
from vidtrack.geometry.camera import line_of_sight, project
from vidtrack.geometry.interface import Interface, planes_of
from vidtrack.geometry.refraction import apparent, crossed, paths

WALL = Interface("wall", np.array([0.0, 0, 50]), np.array([0.0, 0, 1]), (AIR, GLASS, WATER), (10.0,))


def beside(q, d, p):
    """Distance of points from lines."""
    return np.linalg.norm(np.cross(p - q, d), axis=-1)


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_point_lies_on_the_line_of_sight_of_its_picture(camera):
    p = places(300)
    wet = crossed(planes_of(camera.through, camera.position), p.T) == len(planes_of(camera.through, camera.position))
    q, d = line_of_sight(camera, project(camera, p[wet]))
    assert wet.sum() > 100
    assert beside(q, d, p[wet]).max() < 1e-9


@pytest.mark.parametrize("camera", [LEFT, ABOVE, WEDGE])
def test_light_takes_the_quickest_way(camera):
    # Fermat: of all ways through the planes the optical length is least along the one that is traced
    planes = planes_of(camera.through, camera.position)
    index = 1 / np.cumprod([1.0, *(plane.ratio for plane in planes)])
    p = places(4)
    axes = [np.linalg.svd(plane.normal[None])[2][1:] for plane in planes]
    for point in p[crossed(planes, p.T) == len(planes)]:
        path = [rays.q[:, 0] for rays in paths(camera.through, camera.position, _direction(camera, point))]
        start = np.concatenate(
            [axis @ (q - plane.point) for axis, q, plane in zip(axes, path[1:], planes, strict=True)]
        )

        def length(x, point=point):
            on = [plane.point + x[2 * k : 2 * k + 2] @ axes[k] for k, plane in enumerate(planes)]
            way = np.array([camera.position, *on, point])
            return float(index @ np.linalg.norm(np.diff(way, axis=0), axis=1))

        found = minimize(length, start + 20.0, method="BFGS", options={"gtol": 1e-9})
        np.testing.assert_allclose(found.x, start, atol=2e-2)
        assert length(start) <= found.fun + 1e-9


def _direction(camera, point):
    seen = apparent(camera.through, camera.position, point[None]) - camera.position
    return seen / np.linalg.norm(seen)


@given(
    angle=st.floats(0, 1.5),
    height=st.floats(1e-3, 1e3),
    depth=st.floats(1e-3, 1e3),
    indices=st.tuples(st.floats(1, 2.5), st.floats(1, 2.5), st.floats(1, 2.5)),
)
def test_a_traced_ray_is_found_again(angle, height, depth, indices):
    wall = Interface("wall", np.zeros(3), np.array([0, 0, 1.0]), indices, (5.0,))
    camera = LEFT.with_(R=np.eye(3), T=np.array([0, 0, height]), through=(wall,))
    d = np.array([[np.sin(angle), 0, np.cos(angle)]])
    last = paths(camera.through, camera.position, d)[-1]
    if not np.isfinite(last.q + last.d).all():
        return  # total reflection
    p = (last.q + depth / last.d[2] * last.d).T
    seen = apparent((wall,), camera.position, p) - camera.position
    np.testing.assert_allclose(seen / np.linalg.norm(seen), d, atol=1e-9)


def test_equal_indices_bend_nothing():
    plain = Interface("air", WINDOW.point, WINDOW.normal, (1.0, 1.0, 1.0), (30.0,))
    p = places()
    np.testing.assert_allclose(apparent((plain,), LEFT.position, p), p, atol=1e-9)


def test_a_depth_of_water_appears_three_quarters_as_deep():
    # on paper: seen from right above, apparent depth = depth / n
    p = np.array([[1e-3, 0, -999.0]])
    surface = Interface("surface", np.zeros(3), np.array([0, 0, 1.0]), (1.0, 1.333))
    eye = np.array([0.0, 0, 1.0])
    seen = apparent((surface,), eye, p) - eye
    assert seen[0, 0] / -seen[0, 2] == pytest.approx(1e-3 / (1 + 999 / 1.333), rel=1e-6)


def test_points_on_the_cameras_side_are_seen_directly():
    p = np.array([[10.0, 20, 130], [10.0, 20, 110]])
    seen = apparent(ABOVE.through, ABOVE.position, p)
    np.testing.assert_array_equal(seen[0], p[0])
    assert np.abs(seen[1] - p[1]).max() > 0.1


def test_what_is_seen_does_not_jump_at_the_surface():
    p = np.array([[10.0, 20, 120 + 1e-6], [10.0, 20, 120 - 1e-6]])
    b = project(ABOVE, p)
    assert np.abs(b[0] - b[1]).max() < 1e-5


def test_total_reflection_and_lost_points_are_nan():
    diver = LEFT.with_(
        R=np.eye(3), T=np.array([0, 0, 10.0]), through=(Interface("s", [0, 0, 0], [0, 0, 1], (1.333, 1.0)),)
    )
    flat = paths(diver.through, diver.position, np.array([[np.sin(1.0), 0, np.cos(1.0)]]))[-1]
    assert np.isnan(flat.d).all()
    assert np.isnan(project(ABOVE, [np.nan, 0, 0])).all()
    assert np.isnan(line_of_sight(ABOVE, [np.nan, 0])[0]).all()


def test_two_interfaces_in_order_are_one_of_two_layers():
    first = Interface("one", np.array([0.0, 0, 50]), np.array([0, 0, 1.0]), (AIR, GLASS))
    second = Interface("two", np.array([0.0, 0, 40]), np.array([0, 0, 1.0]), (GLASS, WATER))
    eye, p = np.array([10.0, 20, 900]), places()
    np.testing.assert_allclose(apparent((first, second), eye, p), apparent((WALL,), eye, p), atol=1e-9)


def test_planes_that_are_nearly_parallel_are_as_parallel_ones():
    eye, p = np.array([10.0, 20, 900]), places()
    tilted = Interface("two", np.array([0.0, 0, 40]), np.array([1e-9, 0, 1.0]), (GLASS, WATER))
    first = Interface("one", np.array([0.0, 0, 50]), np.array([0, 0, 1.0]), (AIR, GLASS))
    np.testing.assert_allclose(apparent((first, tilted), eye, p), apparent((WALL,), eye, p), atol=1e-5)
    assert SURFACE.indices == (AIR, WATER)
