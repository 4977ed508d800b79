"""The movement that patches agree upon: right within its sigma, deaf to people and water, silent where it must be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.steadiness.scenes import F, Wall, camera
from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.steadiness.patches import chosen_patches, spread_over
from vidtrack.steadiness.registration import Reference
from vidtrack.steadiness.turn import Agreement, fitted, law_of_camera, law_of_picture, slopes

SIZE = (320, 240)
LAW = law_of_camera(camera())
angle = st.floats(-0.06, 0.06)


def patches(rng, n=36):
    return rng.uniform(20, np.array(SIZE) - 20, (n, 2))


@given(angle, angle, angle)
def test_the_law_is_that_of_the_camera_turned(x, y, z):
    own = camera()
    R = rotation_from_vector([x, y, z])
    after = own.with_(R=R @ own.R, T=R @ own.T)
    p = np.array([[0.0, 0, 0], [12, 3, 1], [-9, 20, 4]])
    assert LAW(project(own, p), np.array([x, y, z, 0])) == pytest.approx(project(after, p), abs=1e-8)


@given(st.lists(st.floats(-0.03, 0.03), min_size=8, max_size=8))
def test_two_movements_are_one(values):
    first, second = np.array(values[:4]), np.array(values[4:])
    first[3] = second[3] = 0
    b = patches(np.random.default_rng(0), 6)
    assert LAW(LAW(b, first), second) == pytest.approx(LAW(b, LAW.after(second, first)), abs=0.03)
    law, px = law_of_picture(SIZE), np.array([300, 300, 1, 1])
    assert law(law(b, px * first), px * second) == pytest.approx(law(b, law.after(px * second, px * first)), abs=0.03)


def test_a_picture_shifts_rolls_and_grows_about_its_middle():
    law, middle = law_of_picture(SIZE), np.array([159.5, 119.5])
    assert law(middle, np.array([3.0, -2, 0.1, 0.2])) == pytest.approx(middle + np.array([3, -2]))
    assert law(middle + np.array([100, 0]), np.array([0, 0, np.pi / 2, 0.1])) == pytest.approx(
        middle + np.array([0, 110])
    )


def test_slopes_are_those_of_the_law():
    b = np.array([[50.0, 60.0]])
    J = slopes(LAW, b, np.zeros(4))[0]
    step = np.array([1e-4, -2e-4, 3e-4, 1e-4])
    assert J @ step == pytest.approx((LAW(b, step) - b)[0], rel=1e-2)


@pytest.mark.parametrize("size_px", [0.0, 0.05, 2.0, 30.0])
def test_the_movement_is_right_within_its_sigma(size_px):
    rng, z = np.random.default_rng(3), []
    for _ in range(40):
        theta = rng.normal(0, 1, 4) * [1, 1, 1, 0.3] * size_px / F
        b = patches(rng)
        shift = LAW(b, theta) - b + rng.normal(0, 0.03, b.shape)
        # the patches themselves show that 0.01 is too small; they know nothing of what they share
        turn = fitted(LAW, b, shift, np.full(b.shape, 0.01), SIZE, Agreement(common_px=0.0))
        assert not turn.why
        z.append((turn.theta - theta) / np.sqrt(np.diag(turn.covariance)))
    assert np.sqrt(np.mean(np.square(z), axis=0)) == pytest.approx(np.ones(4), abs=0.35)


def test_a_third_that_walks_away_does_not_count():
    rng = np.random.default_rng(4)
    b = patches(rng)
    theta = np.array([0.004, -0.002, 0.001, 0])
    shift = LAW(b, theta) - b + rng.normal(0, 0.03, b.shape)
    shift[:12] = [9.0, -4.0]
    turn = fitted(LAW, b, shift, np.full(b.shape, 0.03), SIZE)
    assert not turn.agree[:12].any()
    assert turn.agree[12:].mean() > 0.9
    assert turn.theta == pytest.approx(theta, abs=2e-4)


def test_where_less_than_half_agree_nothing_is_known():
    rng = np.random.default_rng(5)
    b = patches(rng)
    shift = rng.normal(0, 5, b.shape)
    shift[:10] = 0
    turn = fitted(LAW, b, shift, np.full(b.shape, 0.03), SIZE)
    assert np.isnan(turn.theta).all()
    assert "agree" in turn.why


@pytest.mark.parametrize("seed", range(40))
def test_whatever_the_patches_say_is_a_movement_or_a_reason(seed):
    rng = np.random.default_rng(seed)
    b = rng.uniform(-5, np.array(SIZE) + 5, (int(rng.integers(6, 12)), 2))
    shift = rng.normal(0, 10 ** rng.uniform(0, 3.5), b.shape)
    turn = fitted(LAW, b, shift, np.full(b.shape, 0.03), SIZE)
    assert np.isfinite(turn.theta).all() or turn.why


def test_few_patches_or_all_in_one_place_tell_nothing():
    rng = np.random.default_rng(6)
    b = patches(rng)
    shift = np.full(b.shape, np.nan)
    shift[:4] = 0
    assert "found" in fitted(LAW, b, shift, np.ones(b.shape), SIZE).why
    huddled = 100 + rng.uniform(0, 25, (20, 2))
    assert spread_over(huddled, SIZE) < 0.1
    assert "one place" in fitted(LAW, huddled, np.zeros((20, 2)), np.ones((20, 2)), SIZE).why


def test_a_wall_that_the_camera_sees_gives_its_turn():
    wall = Wall(np.random.default_rng(7))
    picture, theta = wall.clean(), np.array([10, -14, 8, 2]) / F
    middles = chosen_patches(picture)
    shifts = Reference(picture, middles).shifts(wall.clean(theta))
    turn = fitted(wall.law, middles.astype(float), shifts.shift, shifts.sd, SIZE)
    assert F * turn.theta == pytest.approx(F * theta, abs=0.05)
