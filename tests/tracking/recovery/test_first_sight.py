"""What a target is taken for at first: the thing with much light near the middle of its box, or nothing."""

import numpy as np
import pytest

from vidtrack.tracking.detection.blobs import no_blobs
from vidtrack.tracking.recovery.first_sight import FirstSights, by_light

INF = np.inf


def test_the_brightest_thing_costs_nothing_and_what_has_no_light_three():
    assert by_light(np.array([999.0, 0.0, -5.0])).tolist() == pytest.approx([0.0, 3.0, 3.0])
    assert by_light(np.array([99.0, 999.0]))[0] == pytest.approx(1.0)
    assert by_light(np.zeros(0)).shape == (0,)


def things(*places_and_light):
    x, y, mass = np.array(places_and_light, float).T
    return no_blobs()._replace(Xf=x, Yf=y, mass=mass)


def outdone(mass, off, *, cost=(INF, 0.5), unseen=True, sights=None, at=((5.0, 5.0), (9.0, 5.0))):
    seen = things(*((*place, light) for place, light in zip(at, mass, strict=True)))
    sights = FirstSights(3) if sights is None else sights
    new = sights.without_outdone(np.array([cost]), np.array([off]), seen, np.array([2]), np.array([unseen]))
    return bool(np.isinf(new[0, 1]))


def test_a_lesser_thing_beside_one_that_cannot_be_measured_is_none():
    assert outdone([900.0, 100.0], [0.1, 0.6])


def test_it_is_one_where_the_other_is_farther_or_outside_or_has_little_more_light_or_can_be_measured():
    assert not outdone([900.0, 100.0], [0.7, 0.6])
    assert not outdone([900.0, 100.0], [INF, 0.6])
    assert not outdone([150.0, 100.0], [0.1, 0.6])
    assert not outdone([900.0, 100.0], [0.1, 0.6], cost=(0.0, 0.5))
    assert not outdone([900.0, 100.0], [0.1, 0.6], unseen=False)


def test_what_was_outdone_once_is_no_target_later_either_where_it_stands():
    sights = FirstSights(3)
    assert outdone([900.0, 100.0], [0.1, 0.6], sights=sights)
    gone = {"cost": (INF, 0.5), "sights": sights}
    assert outdone([900.0, 100.0], [INF, 0.6], **gone)
    assert not outdone([900.0, 100.0], [INF, 0.6], at=((5.0, 5.0), (12.0, 5.0)), **gone)
    assert not outdone([900.0, 100.0], [INF, 0.6])


def test_what_was_seen_once_in_a_box_says_nothing_of_what_to_seek_elsewhere():
    sights, who = FirstSights(2), np.array([0, 1])
    sights.seen(np.array([0]), 3.0)
    assert sights.confirmed(who, np.array([2, 2]), 5.0).tolist() == [False, True]
    assert sights.confirmed(who, np.array([2, 2]), 6.0).tolist() == [True, True]
