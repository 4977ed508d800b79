import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.fitting import fitted
from vidtrack.geometry.camera import Camera, project

CAMERA = Camera(330.0, 235.0, 0.01, 0.0101, 1.003, 8.0, 1e-3, np.eye(3), np.zeros(3), (640, 480), p1=2e-4, name="a")


def test_a_camera_is_found_again_from_what_it_sees():
    start = CAMERA.with_(Cx=320.0, Cy=240.0, Sx=1.0, f=8.1, kappa1=0.0, p1=0.0)
    found, worst = fitted(start, lambda x: project(CAMERA, np.column_stack([x, np.ones(len(x))])))
    assert worst < 1e-6
    for name in ("Cx", "Cy", "Sx", "f", "kappa1", "p1"):
        assert getattr(found, name) == pytest.approx(getattr(CAMERA, name), rel=1e-5)


def test_what_no_lens_term_describes_is_measured_by_the_largest_error():
    def seen(x):
        b = project(CAMERA, np.column_stack([x, np.ones(len(x))]))
        return b + 0.5 * np.sin(b / 40)

    assert 0.2 < fitted(CAMERA, seen)[1] < 1.0


def test_a_lens_that_shows_nothing_in_the_picture_is_refused():
    with pytest.raises(VidtrackError, match="shows nothing"):
        fitted(CAMERA, lambda x: np.full(x.shape, 9999.0))
