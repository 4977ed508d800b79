import numpy as np
import pytest

from tests.geometry.underwater import SURFACE, WINDOW
from vidtrack.geometry.interface import Interface, parameters_of, planes_of


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"normal": np.zeros(3)}, "normal"),
        ({"indices": (1.0,)}, "two indices more"),
        ({"indices": (1.0, 0.2)}, "indices"),
        ({"indices": (1.0, 1.5, 1.3), "thickness": (-1.0,)}, "thickness"),
    ],
)
def test_an_interface_that_cannot_be_is_refused(change, says):
    with pytest.raises(ValueError, match=says):
        Interface(**{"name": "w", "point": np.zeros(3), "normal": np.ones(3), "indices": (1.0, 1.3), **change})


def test_the_sign_of_the_normal_does_not_matter():
    other = Interface("window", WINDOW.point, -WINDOW.normal, WINDOW.indices, WINDOW.thickness)
    for a, b in zip(planes_of([WINDOW], (0, -1500, 0)), planes_of([other], (0, -1500, 0)), strict=True):
        np.testing.assert_allclose(a.point, b.point)
        np.testing.assert_allclose(a.normal, b.normal)
        assert a.normal[1] > 0
        assert a.ratio == b.ratio


def test_a_camera_on_the_other_side_meets_the_same_indices_from_its_own_side():
    near, far = (planes_of([SURFACE], (0, 0, z))[0] for z in (1000.0, -1000.0))
    np.testing.assert_allclose(near.normal, -far.normal)
    assert near.ratio == far.ratio


def test_a_step_is_what_deviation_measures():
    step = dict(zip(WINDOW.parameters, (2.0, 1e-4, -2e-4, 0.5, 0.01, -0.002), strict=True))
    moved = WINDOW.stepped({**step, "f": 3.0})
    np.testing.assert_allclose(moved.deviation(WINDOW), list(step.values()), rtol=1e-3)
    assert WINDOW.stepped({"f": 1.0}) is WINDOW


def test_planes_follow_their_parameters_as_moves_says():
    centre, h = np.array([100.0, -1500, 30]), 1e-6
    for k, plane in enumerate(planes_of([WINDOW], centre)):
        for name in WINDOW.parameters:
            after, before = (planes_of([WINDOW.stepped({name: s * h})], centre)[k] for s in (1, -1))
            point, normal, ratio = plane.moves.get(name, (np.zeros(3), np.zeros(3), 0.0))
            np.testing.assert_allclose((after.normal - before.normal) / (2 * h), normal, atol=1e-8)
            np.testing.assert_allclose((after.ratio - before.ratio) / (2 * h), ratio, atol=1e-8)
            moved = (after.point - before.point) / (2 * h)
            np.testing.assert_allclose(moved, point, atol=1e-6)


def test_parameters_of_several_interfaces_come_one_after_the_other():
    assert parameters_of([WINDOW, SURFACE]) == WINDOW.parameters + SURFACE.parameters
    assert SURFACE.parameters == ("surface.position", "surface.tilt_1", "surface.tilt_2", "surface.index_1")
