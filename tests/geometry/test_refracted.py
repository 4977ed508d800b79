import numpy as np
import pytest

from tests.geometry.underwater import CAMERAS, LEFT, places
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, columns, derivatives, parameters, stepped

STEP = {"kappa1": 1e-7, "kappa2": 1e-8, "kappa3": 1e-9}
PIVOT = np.array([20.0, -30, 10])


@pytest.mark.parametrize("camera", CAMERAS)
def test_every_derivative_is_that_of_finite_differences(camera):
    p = places()
    at = derivatives(camera, p, PIVOT)
    np.testing.assert_array_equal(at.projected, project(camera, p))
    for k, name in enumerate(parameters(camera)):
        h = STEP.get(name, 1e-6)
        after, before = (project(stepped(camera, PIVOT, {name: s * h}), p) for s in (1, -1))
        by_name = (after - before) / (2 * h)
        np.testing.assert_allclose(
            at.by_parameter[..., k], by_name, rtol=1e-4, atol=2e-5 * np.abs(by_name).max() + 1e-6
        )
    for k, axis in enumerate(np.eye(3) * 1e-3):
        moved = (project(camera, p + axis) - project(camera, p - axis)) / 2e-3
        np.testing.assert_allclose(at.by_point[..., k], moved, atol=1e-7)


def test_without_interfaces_there_are_no_more_parameters_than_ever():
    plain = LEFT.with_(through=())
    assert parameters(plain) == PARAMETERS
    assert derivatives(plain, places(), PIVOT).by_parameter.shape == (60, 2, len(PARAMETERS))
    assert columns(LEFT, ("f", "window.position")) == [PARAMETERS.index("f"), len(PARAMETERS)]


def test_equal_indices_give_the_derivatives_of_a_camera_without_interfaces():
    clear = LEFT.with_(
        through=tuple(i.stepped({f"{i.name}.index_1": -0.49, f"{i.name}.index_2": -0.333}) for i in LEFT.through)
    )
    plain = LEFT.with_(through=())
    a, b = derivatives(clear, places(), PIVOT), derivatives(plain, places(), PIVOT)
    np.testing.assert_allclose(a.by_parameter[..., : len(PARAMETERS)], b.by_parameter, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(a.by_point, b.by_point, rtol=1e-9, atol=1e-12)


def test_points_seen_directly_do_not_depend_on_the_interface():
    above = CAMERAS[2]
    at = derivatives(above, np.array([[0.0, 0, 150]]), PIVOT)
    np.testing.assert_array_equal(at.by_parameter[..., len(PARAMETERS) :], 0)
