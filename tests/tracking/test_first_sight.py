"""What a target is taken for at first: the thing with much light near the middle of its box, or nothing."""

import numpy as np
import pytest

from vidtrack.tracking.first_sight import by_light, without_outdone

INF = np.inf


def test_the_brightest_thing_costs_nothing_and_what_has_no_light_three():
    assert by_light(np.array([999.0, 0.0, -5.0])).tolist() == pytest.approx([0.0, 3.0, 3.0])
    assert by_light(np.array([99.0, 999.0]))[0] == pytest.approx(1.0)
    assert by_light(np.zeros(0)).shape == (0,)


def outdone(mass, off, *, cost=(INF, 0.5), unseen=True):
    new = without_outdone(np.array([cost]), np.array([off]), np.array(mass), np.array([unseen]))
    return bool(np.isinf(new[0, 1]))


def test_a_lesser_thing_beside_one_that_cannot_be_measured_is_none():
    assert outdone([900.0, 100.0], [0.1, 0.6])


def test_it_is_one_where_the_other_is_farther_or_outside_or_has_little_more_light_or_can_be_measured():
    assert not outdone([900.0, 100.0], [0.7, 0.6])
    assert not outdone([900.0, 100.0], [INF, 0.6])
    assert not outdone([150.0, 100.0], [0.1, 0.6])
    assert not outdone([900.0, 100.0], [0.1, 0.6], cost=(0.0, 0.5))
    assert not outdone([900.0, 100.0], [0.1, 0.6], unseen=False)
