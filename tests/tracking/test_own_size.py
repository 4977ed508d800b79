"""What is of another size than a target, at the same light, is not it alone."""

import numpy as np

from vidtrack.tracking.own_size import OwnSize
from vidtrack.tracking.state import CONTRAST, PIXELS, SD_X, SD_Y, VALUES

WHO = np.array([0])


def readings(pixels, contrast):
    values = np.zeros((VALUES, 1, 1))
    values[[PIXELS, CONTRAST, SD_X, SD_Y], 0, 0] = pixels, contrast, 0.01, 0.01
    return values


def known():
    own = OwnSize(1)
    own.follow(readings(80.0, 150.0), np.ones((1, 1), bool), WHO)
    return own


def test_two_in_one_and_a_part_are_odd_and_a_change_of_light_is_not():
    own = known()
    assert own.unlike(readings(130.0, 150.0), WHO).all()
    assert own.unlike(readings(40.0, 150.0), WHO).all()
    assert not own.unlike(readings(50.0, 100.0), WHO).any()
    assert not own.unlike(readings(82.0, 150.0), WHO).any()


def test_a_missing_part_grows_the_sd_by_what_it_may_have_moved_the_middle():
    own = known()
    part = own.doubted(readings(62.0, 150.0), WHO)[SD_X, 0, 0]
    assert 0.4 < part < 1.5
    assert own.doubted(readings(79.0, 150.0), WHO)[SD_X, 0, 0] == 0.01
    assert own.doubted(readings(62.0, 110.0), WHO)[SD_X, 0, 0] == 0.01


def test_whatever_is_not_known_or_forgotten_is_never_odd():
    own = known()
    own.forget(WHO)
    assert not own.unlike(readings(400.0, 150.0), WHO).any()
