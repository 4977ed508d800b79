"""What is of another size than a target, at the same light, is not it alone."""

import numpy as np
import pytest

from vidtrack.tracking.following.own_size import OWN_SIZES, OwnSize
from vidtrack.tracking.state import CONTRAST, HEIGHT, MEASURED, PIXELS, SD_X, SD_Y, VALUES, WIDTH, XX, YY, Found

WHO = np.array([0])


def readings(pixels, contrast, width=0.0, height=0.0):
    values = np.zeros((VALUES, 1, 1))
    values[[PIXELS, CONTRAST, SD_X, SD_Y], 0, 0] = pixels, contrast, 0.01, 0.01
    values[[WIDTH, HEIGHT], 0, 0] = width, height
    return values


def disc(radius, beside=0.0, away=1.0):
    """A disc on whole pixels, without what lies more than `beside` px beyond its middle where x + away y grows."""
    y, x = np.mgrid[-30:31, -30:31]
    inside = (x - 0.4) ** 2 + (y - 0.2) ** 2 < radius**2
    if beside:
        inside &= x + away * y < beside
    rows, columns = np.nonzero(inside)
    return readings(inside.sum(), 150.0, np.ptp(columns) + 1, np.ptp(rows) + 1)


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


def test_a_target_that_comes_nearer_and_goes_is_no_part_of_itself():
    own, clear, grown = OwnSize(1), np.ones((1, 1), bool), []
    for k in range(200):
        reading = readings(113.0 * np.exp(0.12 * np.sin(2 * np.pi * 0.8 * k / 30)), 150.0)
        own.follow(reading, clear, WHO)
        grown.append(own.doubted(reading, WHO)[SD_X, 0, 0])
    assert max(grown) == 0.01


def test_a_rope_that_takes_a_third_within_three_samples_is_still_seen():
    own, clear = OwnSize(1), np.ones((1, 1), bool)
    for _ in range(20):
        own.follow(readings(113.0, 150.0), clear, WHO)
    for share in (0.9, 0.8, 0.67):
        own.follow(readings(113.0 * share, 150.0), clear, WHO)
    assert own.doubted(readings(113.0 * 0.67, 150.0), WHO)[SD_X, 0, 0] > 0.3


def test_a_target_that_doubles_its_area_in_twelve_samples_is_followed_by_its_shape():
    own, clear = OwnSize(1), np.ones((1, 1), bool)
    own.follow(disc(4.0), clear, WHO)
    for radius in 4.0 * np.exp(0.03 * np.arange(1, 14)):
        reading = disc(radius)
        assert not own.unlike(reading, WHO).any()
        assert own.doubted(reading, WHO)[SD_X, 0, 0] == 0.01
        own.follow(reading, clear, WHO)


@pytest.mark.parametrize("slope", [0.0, 1.0])
def test_a_part_that_a_straight_edge_leaves_is_of_another_shape(slope):
    own, clear = OwnSize(1), np.ones((1, 1), bool)
    for _ in range(20):
        own.follow(disc(6.0), clear, WHO)
    for beside in (5.0, 4.0, 3.0, 2.0):
        reading = disc(6.0, beside * np.hypot(1, slope), slope)
        own.follow(reading, clear, WHO)
    assert own.doubted(reading, WHO)[SD_X, 0, 0] > 0.3


def found(pixels, contrast=150.0, width=10.0, height=10.0, xx=6.0, yy=6.0):
    values = np.zeros((MEASURED, 1))
    values[[PIXELS, CONTRAST, XX, YY], 0] = pixels, contrast, xx, yy
    return Found(WHO, values, np.array([[width], [height]]), np.array([contrast]), np.zeros(1, np.int64))


def test_after_long_what_is_found_may_be_nearer_or_in_another_light_but_not_several():
    own, missing = OwnSize(1), np.array([9])
    own.follow(readings(80.0, 150.0, 10.0, 10.0), np.ones((1, 1), bool), WHO)
    assert not own.several(found(160.0, width=20.0), missing)  # as long as its size is known, `odd` judges
    own.outdate(WHO)
    assert not own.unlike(readings(160.0, 150.0, 20.0, 10.0), WHO).any()
    assert own.several(found(160.0, width=20.0), missing)
    assert not own.several(found(160.0, width=14.0, height=14.0), missing)
    assert not own.several(found(160.0, contrast=60.0, width=20.0), missing)
    assert not own.several(found(40.0, width=5.0), missing)
    own.cover(WHO, np.array([170.0]))
    own.cover(WHO, np.array([np.nan]))  # not seen in it now
    assert own.several(found(160.0, width=14.0, height=14.0), missing)
    assert not own.several(found(100.0, width=11.0, height=11.0), missing)
    own.forget(WHO)
    assert not own.several(found(160.0, width=20.0), missing)


def test_a_half_that_a_rope_left_says_nothing_of_the_size_of_the_whole():
    own, missing, whole = OwnSize(1), np.array([9]), found(154.0, width=14.0, height=14.0)
    own.follow(readings(85.0, 150.0, 14.0, 8.0), np.ones((1, 1), bool), WHO)
    own.outdate(WHO)
    assert not own.several(whole, missing)
    own.forget(WHO)
    own.follow(readings(40.0, 150.0, 10.0, 5.0), np.ones((1, 1), bool), WHO)
    own.outdate(WHO, 2)  # a disc in a field
    assert own.several(found(80.0, width=20.0, height=5.0), missing)


def test_of_a_target_too_small_to_have_a_shape_what_is_found_is_round_and_grew_no_faster_than_it_can_come():
    own = OwnSize(1)
    own.follow(readings(20.0, 150.0, 5.0, 5.0), np.ones((1, 1), bool), WHO)
    own.outdate(WHO)
    assert own.several(found(48.0, xx=3.0, yy=3.0), np.array([9]))
    assert not own.several(found(48.0, xx=3.0, yy=3.0), np.array([40]))
    assert own.several(found(48.0, xx=6.0, yy=3.0), np.array([40]))


def test_a_size_is_sure_after_some_readings_that_are_not_those_of_a_part():
    own, clear = OwnSize(1), np.ones((1, 1), bool)
    for _ in range(OWN_SIZES.sure):
        assert np.isnan(own.usual(WHO)).all()
        own.follow(disc(8.0), clear, WHO)
    assert own.usual(WHO)[0, 0] == pytest.approx(64 * np.pi, abs=4)
    own.follow(disc(8.0, beside=3.0), clear, WHO)
    assert np.isnan(own.usual(WHO)).all()
