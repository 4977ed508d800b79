"""Why what is there is not the target: several things, or more than it; `test_reacquisition` has the other reasons."""

import numpy as np
import pytest

from tests.tracking.recovery.test_reacquisition import RADIUS, SCENE, lost, sample
from vidtrack.tracking.detection.candidates import blobs_of
from vidtrack.tracking.following.own_size import OwnSize
from vidtrack.tracking.recovery.separation import Separation
from vidtrack.tracking.recovery.unmeasured import covering, two_in_one
from vidtrack.tracking.state import HEIGHT, MEASURED, PIXELS, WIDTH, XX, XY, YY, Found, Searched, X, Y


def found(picture):
    """What a search finds of the one blob in a picture."""
    blob = blobs_of(picture, SCENE.detection, 120.0)
    values = np.zeros((MEASURED, 1))
    names = {X: "Xf", Y: "Yf", PIXELS: "pixels", XX: "xx", YY: "yy", XY: "xy"}
    for row, name in names.items():
        values[row] = getattr(blob, name)
    size = np.stack([blob.width, blob.height]).astype(float)
    assert HEIGHT == WIDTH + 1
    values[6] = blob.mass / blob.pixels
    return Found(np.array([0]), values, size, values[6], np.zeros(1, np.int64))


@pytest.mark.parametrize(
    ("discs", "two"), [([(60.0, 50.0, 6.0)], False), ([(60.0, 50.0, 6.0), (67.0, 53.0, 6.0)], True)]
)
def test_a_blob_of_two_is_what_two_discs_explain(discs, two):
    now, _ = lost((60.0, 50.0))
    one = sample(*discs)
    one = one._replace(luma=np.minimum(one.luma, 212))  # balls are opaque
    assert two_in_one(now, one, found(one), Separation(1, OwnSize(1)), SCENE).tolist() == [two]


@pytest.mark.parametrize(("at", "more"), [((60.2, 50.1), False), ((63.0, 50.0), True), ((75.0, 50.0), False)])
def test_a_blob_beside_whose_middle_another_track_was_measured_is_more_than_that(at, more):
    now, _ = lost((60.0, 50.0), (60.0, 50.0))
    values = now.values.copy()
    values[[X, Y], 1] = at
    one = sample((60.0, 50.0, 6.0))
    now, separation = Searched(now.state, values, now.flag), Separation(2, OwnSize(2))
    assert two_in_one(now, one, found(one), separation, SCENE).tolist() == [more]


def test_what_covers_a_target_is_the_largest_blob_about_it_that_is_more_than_itself():
    now, _ = lost((60.0, 50.0), (30.0, 90.0), (100.0, 40.0))
    blobs = blobs_of(sample((58.0, 49.0, 7.0), (30.0, 90.0, RADIUS)), SCENE.detection, 120.0)
    at = np.array([[60.0, 50.0], [30.0, 90.0], [100.0, 40.0]])
    pixels = covering(now, 1, np.arange(3), at, blobs)
    assert pixels[0] == blobs.pixels.max()
    assert np.isnan(pixels[1:]).all()
