"""Ways from the middle of light to the middle of the outline: chance, one lamp for all, or a lamp beside the camera."""

import numpy as np

from vidtrack.tracking.outlines.ball_outline import Outline
from vidtrack.tracking.outlines.light_ways import agreed, suspected, turning
from vidtrack.tracking.outlines.lighting import Lighting


def ways(rng, n, mean=(0.0, 0.0), sd=0.05):
    return [[np.array(mean) + rng.normal(0, sd, 2)] for _ in range(n)]


def test_ways_of_chance_are_hardly_ever_agreed_upon_and_seldom_suspected():
    rng = np.random.default_rng(1)
    made = [ways(rng, 36) for _ in range(400)]
    assert sum(agreed(own, 0.0) for own in made) <= 1
    share = np.mean([suspected(own) for own in made])
    assert abs(share - np.exp(-(1.6**2))) < 0.05  # the mean of two coordinates over its chance


def test_a_lamp_is_agreed_upon_by_all_balls_or_by_one_that_was_seen_often():
    rng = np.random.default_rng(2)
    assert agreed(ways(rng, 36, (0.08, 0.0)), 0.01)
    assert not agreed(ways(rng, 36, (0.08, 0.0)), 0.2)
    often = [np.array([0.3, 0.0]) + rng.normal(0, 0.01, 2) for _ in range(6)]
    assert agreed([often, *ways(rng, 36)], 0.01)
    assert not agreed([], 0.01)


def test_a_third_of_the_balls_still_suspects_what_all_of_them_agree_upon():
    rng = np.random.default_rng(3)
    passed = []
    for _ in range(200):
        own = ways(rng, 105, (0.05, 0.0), sd=0.08)
        if agreed(own, 0.01):
            passed.append(suspected(own[::3]))
    assert np.mean(passed) > 0.98


def test_ways_that_turn_with_the_place_are_a_lamp_beside_the_camera():
    rng = np.random.default_rng(4)
    place = rng.uniform(-200, 200, (40, 2))
    turned = [[0.1 * p / 200 + rng.normal(0, 0.03, 2)] for p in place]
    where = [[p] for p in place]
    assert turning(turned, where, 0.01)
    assert not turning(turned, where, 0.2)
    assert not turning(turned[:11], where[:11], 0.01)
    chance = [turning(ways(rng, 40), where, 0.0) for _ in range(200)]
    assert sum(chance) <= 1
    assert 5 < sum(turning(ways(rng, 40), where, 0.0, beyond=2.56) for _ in range(200)) < 50


def test_what_the_grid_of_pixels_does_to_many_balls_is_no_lamp():
    rng = np.random.default_rng(11)
    ways = [[0.012 * np.array([np.cos(a), np.sin(a)])] for a in rng.uniform(0, 2 * np.pi, 60)]
    assert not agreed(ways, 0.01)
    assert agreed([[np.add(way, (0.012, 0.0))] for (way,) in ways], 0.01)
    assert agreed([[np.array([0.2, 0.0])]], 0.01)
    assert not agreed([[np.array([0.03, 0.0])]], 0.01)
    assert not agreed([[], []], 0.01)


def test_many_balls_are_lit_all_ways_by_a_lamp_beside_the_camera():
    """Each on the side that is turned to the lamp: as many to the left as to the right, on the whole none."""
    rng = np.random.default_rng(11)
    places = [[rng.uniform(0, 400, 2)] for _ in range(24)]
    chance = rng.normal(0, 0.012, (24, 1, 2))
    ways = [[1e-4 * (where[0] - 200) + off[0]] for where, off in zip(places, chance, strict=True)]
    assert not agreed(ways, 0.01)
    assert turning(ways, places, 0.01)
    assert not turning(ways, places, 0.03), "too little to matter"
    assert not turning(list(chance), places, 0.0)
    assert not turning(ways[:8], places[:8], 0.01), "of a few balls chance may make as much"
    assert not turning([[], []], [[], []], 0.01)
    found = [
        [Outline(np.array(where[0]), 4.5, way[0], 0.01, True, 9.0, 0)] for where, way in zip(places, ways, strict=True)
    ]
    assert Lighting(found).one_sided
