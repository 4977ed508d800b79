"""What a refitted lens leaves is what is stated, by OpenCV's own projection."""

import cv2
import numpy as np
import pytest

from tests.exchange.runs import camera, run
from vidtrack.errors import VidtrackError
from vidtrack.exchange.ideal_to_distorted import notes_of, refitted
from vidtrack.exchange.opencv_yaml import coefficients, matrix
from vidtrack.geometry.camera import line_of_sight, project


def seen_by(camera, depth=150.0, n=21):
    """World points that the camera sees all over its picture, and where."""
    width, height = camera.image_size
    b = np.stack(np.meshgrid(np.linspace(0, width - 1, n), np.linspace(0, height - 1, n)), -1).reshape(-1, 2)
    at, along = line_of_sight(camera, b)
    return at + depth * along, b


def by_opencv(own, p):
    given = own.camera.R, own.camera.T, matrix(own)
    k = np.array(coefficients(own))
    rvec = cv2.Rodrigues(given[0])[0]
    if own.lens.fisheye:
        return cv2.fisheye.projectPoints(p[None], rvec, given[1], given[2], k)[0][0]
    return cv2.projectPoints(p, rvec, given[1], given[2], k)[0][:, 0]


@pytest.mark.parametrize(
    "own",
    [
        camera(),
        camera(kappa1=-6e-4, kappa2=1e-6, p1=1e-5, p2=-2e-5),
        camera(kappa1=0.0),
        camera(projection="equidistant", kappa1=1e-4),
        camera(skew=2e-4),
    ],
    ids=["tsai", "affine", "pinhole", "fisheye", "skew"],
)
def test_the_stated_error_is_the_largest_that_opencv_shows(own):
    (one,) = refitted(run(cameras={"cam1": own}))
    p, b = seen_by(own)
    np.testing.assert_allclose(project(own, p), b, atol=1e-6)
    off = np.linalg.norm(by_opencv(one, p) - b, axis=-1).max()
    assert off <= 1.05 * one.largest_px + 1e-6
    assert one.largest_px < (0.5 if own.skew else 0.05)
    assert f"{one.largest_px:.3g} px" in notes_of([one])[0]


def test_a_lens_that_the_format_does_not_have_is_refused():
    with pytest.raises(VidtrackError, match="equidistant"):
        refitted(run(cameras={"cam1": camera(projection="equidistant")}), wide=False)
    with pytest.raises(VidtrackError, match="no calibrated camera"):
        refitted(run())
