"""A camera that sees nothing of a lamp that the others see counts what it may have missed."""

import numpy as np
import pytest

from vidtrack.location.cameras.light_aside import light_aside, with_light_aside


def test_what_one_camera_shows_plainly_may_be_in_the_others_too():
    lit, unseen = {"lighting": {"way_px": 0.6, "lasting_px": 0.02}}, {"light_aside_px": 0.08}
    found = light_aside({"cam1": lit, "cam2": unseen, "cam3": {}, "cam4": {"lighting": {"outlines": 0}}})
    assert list(found) == ["cam1", "cam2", "cam4"]
    assert found == pytest.approx({"cam1": 0.0, "cam2": 0.0566, "cam4": 0.0}, abs=1e-4)
    assert light_aside({"cam1": unseen, "cam2": unseen}) == light_aside({}) == {}


def test_the_sd_of_the_camera_that_sees_nothing_grows():
    sd = with_light_aside(np.full((3, 1, 5, 2), 0.03), [0.0, 0.04, None])
    assert sd[[0, 2]] == pytest.approx(0.03)
    assert sd[1] == pytest.approx(0.05)


def test_where_no_lamp_is_seen_nothing_changes():
    sd = np.full((2, 1, 5, 2), 0.03)
    assert with_light_aside(sd, [None, None]) is sd
