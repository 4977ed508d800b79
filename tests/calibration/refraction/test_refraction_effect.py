import numpy as np
import pytest

from tests.geometry.underwater import LEFT, RIGHT, places
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.calibration.refraction.refraction_effect import Effect, effect_finding, refraction_effect
from vidtrack.geometry.camera import project

FREE = [free_parameters("tsai")] * 2


def test_straight_light_would_put_points_elsewhere_and_farther_from_the_survey():
    p = places(120)
    b = np.array([project(camera, p) for camera in (LEFT, RIGHT)]) + np.random.default_rng(0).normal(
        0, 0.05, (2, 120, 2)
    )
    effect = refraction_effect([LEFT, RIGHT], p, b, FREE)
    assert effect.interfaces == ("window",)
    assert effect.mean_3d_without > 1.5 * effect.mean_3d
    assert 0.3 < effect.shift_rms < effect.shift_max
    assert effect.rms_px_without > effect.rms_px


def test_without_interfaces_or_with_one_camera_there_is_no_effect():
    p = places(30)
    b = np.array([project(camera, p) for camera in (LEFT, RIGHT)])
    assert refraction_effect([LEFT.with_(through=())] * 2, p, b, FREE) is None
    assert refraction_effect([LEFT], p, b[:1], FREE[:1]) is None


@pytest.mark.parametrize(("without", "code"), [(2.0, "refraction-matters"), (0.5, "interface-wrong")])
def test_the_finding_says_how_much_it_matters(without, code):
    finding = effect_finding(Effect(("window",), 1.25, 3.0, 1.0, without, 0.1, 0.3), "mm")
    assert finding.code == code
    assert "1.25 mm" in finding.text
