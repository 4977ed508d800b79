"""Bad points among good: found, named, and no others with them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.calibration.camera.outliers import ENOUGH, limit_for, majority, mixups, robust_scale, trusted
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig


def sightings(seed=0, noise=0.1):
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    rng = np.random.default_rng(seed)
    return camera, p, project(camera, p) + rng.normal(0, noise, (64, 2)), rng


@pytest.mark.parametrize("bad", [0, 6, 16, 24])
def test_the_majority_holds_no_bad_point(bad):
    _, p, b, rng = sightings(bad)
    wrong = rng.choice(64, bad, replace=False)
    b[wrong] += rng.uniform(10, 60, (bad, 2)) * rng.choice([-1, 1], (bad, 2))
    keep = majority(p, b, rng=np.random.default_rng(0))
    assert keep.sum() == np.ceil(0.6 * 64)
    assert not keep[wrong].any()


def test_the_same_seed_gives_the_same_majority():
    _, p, b, _ = sightings()
    one, two = (majority(p, b, rng=np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_points_in_one_plane_have_a_majority_too():
    camera, _, _, rng = sightings()
    p = np.stack([*rng.uniform(-20, 20, (2, 40)), np.zeros(40)], -1)
    b = project(camera, p) + rng.normal(0, 0.1, (40, 2))
    b[:6] += 15
    assert not majority(p, b, rng=np.random.default_rng(0))[:6].any()


def test_too_few_points_have_no_majority():
    with pytest.raises(ValueError, match=f"11 points.*{ENOUGH}"):
        majority(np.zeros((11, 3)), np.zeros((11, 2)), rng=np.random.default_rng(0))


@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 100), st.integers(0, 5))
def test_the_robust_scale_is_the_noise_of_one_coordinate(sd, seed):
    """2000 normal points, a fifth of them thrown far: within 15 % from below and above."""
    rng = np.random.default_rng(seed)
    r = np.linalg.norm(rng.normal(0, sd, (2000, 2)), axis=1)
    assert robust_scale(r) == pytest.approx(sd, rel=0.06)
    r[:200] *= 1000
    assert sd * 0.98 < robust_scale(r) < sd * 1.15


def test_the_limit_for_64_points_is_near_six_sigma():
    # sqrt(2 ln 64000) = 4.70, by 1.25 for heavy tails
    assert limit_for(64) == pytest.approx(5.88, abs=0.01)


def test_points_can_come_back_into_trust():
    """A start that leaves out half of the good points ends with all of them."""
    x = np.random.default_rng(0).normal(0, 1, 100)
    x[:5] = 50

    def distances(keep):
        return np.abs(x - x[keep].mean())

    start = np.zeros(100, bool)
    start[20:60] = True
    keep, _, scale = trusted(start, distances, n_parameters=1)
    np.testing.assert_array_equal(np.flatnonzero(~keep), np.arange(5))
    assert 0.3 < scale < 1.2


def test_exact_points_are_not_rejected_over_rounding():
    r = np.zeros(50)
    r[7] = 1e-9
    keep, _, _ = trusted(np.ones(50, bool), lambda _: r, n_parameters=11)
    assert keep.all()


def test_two_points_at_each_other_s_places_are_a_swap():
    camera, p, b, _ = sightings()
    b[[3, 40]] = b[[40, 3]]
    bad = np.zeros(64, bool)
    bad[[3, 40]] = True
    found = mixups(project(camera, p), b, bad, tolerance=1.0)
    assert [(m.point, m.place, m.mutual) for m in found] == [(3, 40, True), (40, 3, True)]


def test_a_point_at_a_good_point_s_place_is_no_swap():
    camera, p, b, _ = sightings()
    b[3] = b[40]
    bad = np.zeros(64, bool)
    bad[3] = True
    assert [(m.place, m.mutual) for m in mixups(project(camera, p), b, bad, tolerance=1.0)] == [(40, False)]


def test_three_tags_handed_round_are_each_named_but_no_swap():
    camera, p, b, _ = sightings()
    b[[3, 20, 40]] = b[[20, 40, 3]]
    bad = np.zeros(64, bool)
    bad[[3, 20, 40]] = True
    found = mixups(project(camera, p), b, bad, tolerance=1.0)
    assert {(m.point, m.place) for m in found} == {(3, 20), (20, 40), (40, 3)}
    assert not any(m.mutual for m in found)


def test_a_stray_point_is_nobody_s_place():
    camera, p, b, _ = sightings()
    b[3] = [5.0, 5.0]
    bad = np.zeros(64, bool)
    bad[3] = True
    assert mixups(project(camera, p), b, bad, tolerance=1.0) == []
