"""What the cameras see of a body's shape, against what the config says of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.calibration.body.body_shape import judge_shape
from vidtrack.calibration.body.body_sights import Body
from vidtrack.geometry.rotation import rotation_from_vector

P = np.array([[14.0, 0, 3], [-9.0, 10, 3], [-9.0, -10, 2], [1.0, 2, 14], [4.0, 6, -3]])
BODY = Body(("bow", "port", "starboard", "mast", "keel"), P, 0.005)
SEEN = 0.004
C = SEEN**2 * np.eye(15)


@settings(max_examples=25, deadline=None)
@given(turn=st.tuples(*[st.floats(-2, 2)] * 3), shift=st.floats(-50, 50), seed=st.integers(0, 10_000))
def test_a_body_anywhere_that_is_as_stated_gives_no_reason(turn, shift, seed):
    rng = np.random.default_rng(seed)
    p = P + rng.normal(0, BODY.sd, P.shape) + rng.normal(0, SEEN, P.shape)
    assert judge_shape(BODY, p @ rotation_from_vector(turn).T + shift, C).reasons == ()


def test_chi_squared_has_the_size_of_its_freedom():
    rng = np.random.default_rng(0)
    each = [judge_shape(BODY, P + rng.normal(0, np.hypot(BODY.sd, SEEN), P.shape), C) for _ in range(200)]
    assert {own.freedom for own in each} == {9}
    assert np.mean([own.chi2 for own in each]) == pytest.approx(9, rel=0.15)


@pytest.mark.parametrize("k", range(15))
def test_each_coordinate_that_is_mistyped_is_named_with_its_size(k):
    target, axis = BODY.targets[k // 3], "xyz"[k % 3]
    rng = np.random.default_rng(k)
    stated = P.copy()
    stated[k // 3, k % 3] += 0.2
    found = judge_shape(BODY._replace(p=stated), P + rng.normal(0, SEEN, P.shape), C)
    best = found.reasons[0]
    assert best.what == f"{target} {axis}"
    assert best.off == pytest.approx(-0.2, abs=0.05)
    assert best.deviate > 5


def test_a_body_measured_in_another_unit_is_wrong_in_all_its_lengths_alike():
    found = judge_shape(BODY._replace(p=P / 1.01), P, C)
    assert found.reasons[0].what == "scale"
    assert found.reasons[0].off == pytest.approx(0.01, rel=0.1)


def test_a_target_that_sits_elsewhere_in_all_three_axes_is_named_as_a_target():
    p = P.copy()
    p[1] += [0.3, -0.25, 0.4]
    assert judge_shape(BODY, p, C).reasons[0].what == "port"


def test_of_three_targets_all_coordinates_that_would_explain_a_distance_are_given():
    three = Body(BODY.targets[:3], P[:3] + 0.3 * np.eye(9)[0].reshape(3, 3), 0.005)
    found = judge_shape(three, P[:3], C[:9, :9])
    assert "bow x" in [reason.what for reason in found.reasons]
    stated, seen, sd = found.distances["bow-port"]
    assert stated - seen == pytest.approx(0.275, abs=0.01)
    assert sd == pytest.approx(np.sqrt(2 * (SEEN**2 + 0.005**2)), rel=0.01)
