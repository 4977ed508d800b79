import numpy as np

from tests.geometry.underwater import LEFT, RIGHT, places
from tests.preview.conftest import lab, rendered  # noqa: F401
from vidtrack.geometry.camera import project
from vidtrack.picking.space import epipolar_curve


def cameras():
    import yaml

    from tests.whole_workflow.conftest import SCENARIO
    from vidtrack.simulate.scenario import CameraPlan, camera_from_plan

    plans = yaml.safe_load(yaml.safe_dump(SCENARIO["cameras"]))
    return [camera_from_plan(CameraPlan.model_validate(plan), name) for name, plan in plans.items()]


def test_the_curve_runs_through_what_the_other_camera_sees_of_the_same_point():
    a, b = cameras()
    check(a, b, np.random.default_rng(1).uniform(-20, 20, (40, 3)))


def test_under_water_the_curve_is_bent_through_what_the_other_camera_sees():
    check(LEFT, RIGHT, places(40))
    bent = epipolar_curve(LEFT, RIGHT, seen_by(LEFT, places(40)[0]), places(40))
    straight = epipolar_curve(LEFT.with_(through=()), RIGHT.with_(through=()), seen_by(LEFT, places(40)[0]), places(40))
    assert np.abs(np.array(bent[0][40]) - straight[0][40]).max() > 5


def seen_by(camera, p):
    x, y = project(camera, p)
    return float(x), float(y)


def check(a, b, about):
    for p in about[:10]:
        x, y = project(a, p)
        (curve,) = epipolar_curve(a, b, (float(x), float(y)), about)
        line, seen = np.array(curve), project(b, p)
        step = np.diff(line, axis=0)
        t = np.clip(((seen - line[:-1]) * step).sum(1) / (step**2).sum(1), 0, 1)
        away = np.hypot(*(line[:-1] + t[:, None] * step - seen).T)
        assert away.min() < 0.05  # px; the curve is drawn in straight pieces, rounded to 0.01 px
        width, height = b.image_size
        assert (line > -0.11 * width).all()
        assert (line < (1.11 * width, height + 0.11 * width)).all()
