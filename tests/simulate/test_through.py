import numpy as np
import pytest

from tests.geometry.underwater import ABOVE, LEFT
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.simulate.render import outlines
from vidtrack.simulate.scenario import scenario_from

TANK = {
    "interfaces": {"window": {"point": [0, -5, 0], "normal": [0, 1, 0], "indices": [1, 1.49, 1.333], "thickness": 0.3}},
    "cameras": {"cam1": {"position": [0, -15, 0], "field": 10, "through": ["window"]}},
    "calibration": {"points": {"1": [0, 0, 0]}, "clips": {}},
}


def test_a_scenarios_camera_sees_through_its_window():
    camera = scenario_from(TANK).camera("cam1")
    assert [i.name for i in camera.through] == ["window"]
    wet, straight = project(camera, [2.0, 0, 0]), project(camera.with_(through=()), [2.0, 0, 0])
    assert abs(wet[0] - straight[0]) > 5


def test_a_window_that_is_not_described_is_refused():
    with pytest.raises(VidtrackError, match="no such interface"):
        scenario_from({**TANK, "interfaces": {}})


@pytest.mark.parametrize("camera", [LEFT, ABOVE])
def test_a_balls_outline_holds_its_tangent_rays(camera):
    # independent of the outline: of many points of the sphere's surface none is seen outside of it
    centre, r = np.array([50.0, 30, 20]), 8.0
    (outline,) = outlines(camera, centre[None], r)
    n = np.random.default_rng(0).normal(size=(4000, 3))
    surface = project(camera, centre + r * n / np.linalg.norm(n, axis=1, keepdims=True))
    middle = outline.mean(0)
    angle = np.arctan2(*(outline - middle).T[::-1])
    reach = np.linalg.norm(outline - middle, axis=1)
    order = np.argsort(angle)
    seen = surface - middle
    limit = np.interp(np.arctan2(seen[:, 1], seen[:, 0]), angle[order], reach[order], period=2 * np.pi)
    over = np.linalg.norm(seen, axis=1) - limit
    assert over.max() < 0.02
    assert over.max() > -0.1  # and it is no larger than need be
    assert np.linalg.norm(middle - project(camera, centre)) < 0.02
