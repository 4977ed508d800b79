import numpy as np
import pytest

from vidtrack.calibration.refraction.interfaces import interfaces_from_settings
from vidtrack.errors import VidtrackError

WINDOW = {"name": "window", "point": [0, -500, 0], "normal": [0, 2, 0], "thickness": 30, "indices": [1.0, 1.49, 1.333]}
SURFACE = {"name": "surface", "point": [0, 0, 120], "normal": [0, 0, 1], "indices": [1.0, 1.333]}


def test_what_is_not_said_is_known_as_a_tape_and_a_level_know_it():
    (window,) = interfaces_from_settings("cameras.cam1", [WINDOW], "mm")
    known = dict(zip(window.parameters, window.sigma, strict=True))
    assert known["window.position"] == pytest.approx(5)
    assert known["window.tilt_1"] == known["window.tilt_2"] == pytest.approx(np.radians(0.5))
    own = [known[f"window.{name}"] for name in ("thickness_1", "index_1", "index_2")]
    assert own == pytest.approx([0.9, 0.005, 0.001])
    assert interfaces_from_settings("", [SURFACE], "m")[0].sigma[0] == pytest.approx(0.005)


def test_what_is_said_counts():
    sigma = {"position": 0, "tilt": 2.0, "thickness": 0.1, "index": 0.01}
    (window,) = interfaces_from_settings("", [WINDOW | {"sigma": sigma}], "mm")
    np.testing.assert_allclose(window.sigma, [0, np.radians(2), np.radians(2), 0.1, 0.01, 0.01])
    assert "window.position" not in window.free
    assert interfaces_from_settings("", [WINDOW | {"sigma": dict.fromkeys(sigma, 0)}], "mm")[0].free == ()


def test_media_that_do_not_follow_each_other_are_refused():
    with pytest.raises(
        VidtrackError, match=r"cameras.cam1: behind interface window the index is 1.333, before surface 1"
    ):
        interfaces_from_settings("cameras.cam1", [WINDOW, SURFACE], "mm")
    back = SURFACE | {"indices": [1.333, 1.0]}
    assert len(interfaces_from_settings("", [WINDOW, back], "mm")) == 2


def test_an_interface_that_cannot_be_is_a_line():
    with pytest.raises(VidtrackError, match="two indices more"):
        interfaces_from_settings("cameras.cam1", [WINDOW | {"thickness": None}], "mm")
