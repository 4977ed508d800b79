"""Surveyed points judged by all cameras: what lies elsewhere is found, what one camera mistook is not blamed on it."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.calibration.rigs import ring, seen, wires
from vidtrack.calibration.surveys.judging_camera import View
from vidtrack.calibration.surveys.survey import lines_of, placed
from vidtrack.simulate.rig import thesis_points, thesis_rig

FEW = settings(max_examples=4, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def judged(survey, b, cameras):
    return placed(survey, np.zeros(len(survey)), [View(s, c.image_size) for s, c in zip(b, cameras, strict=True)])


@pytest.mark.slow
@FEW
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_a_wire_that_hangs_elsewhere_is_found_whole_and_its_good_neighbours_are_kept(seed, m):
    rng = np.random.default_rng(seed)
    _, p = wires()
    cameras, shift = ring(m, rng), rng.normal(size=3)
    shift *= 115 / np.linalg.norm(shift)
    b = seen(cameras, p, rng, 0.3)
    own = slice(5 * (k := int(rng.integers(5))), 5 * k + 5)
    survey = p + rng.normal(0, 2, p.shape)
    survey[own] -= shift
    found = judged(survey, b, cameras)
    wanted = np.zeros(25, bool)
    wanted[own] = True
    assert (found.misplaced == wanted).all()
    assert not found.mistaken.any()
    assert not found.unclear.any()
    z = (found.place - p)[own] / np.hypot(found.sd[own], 2 * found.spread)
    assert np.sqrt((z**2).mean()) < 2.5


@pytest.mark.slow
@FEW
@given(st.integers(0, 10_000), st.integers(2, 4))
def test_a_point_misplaced_in_the_survey_is_seen_elsewhere_by_all(seed, m):
    rng = np.random.default_rng(seed)
    p, cameras = thesis_points()[1], thesis_rig(m)
    b = seen(cameras, p, rng, 0.1)
    survey = p + rng.normal(0, 0.02, p.shape)
    j, shift = int(rng.integers(64)), rng.normal(size=3)
    survey[j] -= shift * 2 / np.linalg.norm(shift)
    found = judged(survey, b, cameras)
    assert np.flatnonzero(found.misplaced).tolist() == [j]
    assert not found.mistaken.any()
    assert np.linalg.norm(found.place[j] - p[j]) < 0.3


@pytest.mark.slow
@FEW
@given(st.integers(0, 10_000), st.integers(3, 4))
def test_a_sight_that_one_camera_mistook_is_that_camera_s_alone(seed, m):
    rng = np.random.default_rng(seed)
    p, cameras = thesis_points()[1], thesis_rig(m)
    b = seen(cameras, p, rng, 0.1)
    i, j = int(rng.integers(m)), int(rng.integers(64))
    angle = rng.uniform(0, 2 * np.pi)
    b[i, j] += 25 * np.array([np.cos(angle), np.sin(angle)])
    found = judged(p + rng.normal(0, 0.02, p.shape), b, cameras)
    assert np.argwhere(found.mistaken).tolist() == [[i, j]]
    assert not found.misplaced.any()


@pytest.mark.slow
def test_the_names_of_two_points_exchanged_in_the_survey_are_seen_by_all_and_in_one_camera_by_one():
    rng = np.random.default_rng(3)
    p, cameras = thesis_points()[1], thesis_rig(3)
    b = seen(cameras, p, rng, 0.1)
    survey = p.copy()
    survey[[4, 30]] = p[[30, 4]]
    found = judged(survey, b, cameras)
    assert np.flatnonzero(found.misplaced).tolist() == [4, 30]
    b[1, [7, 50]] = b[1, [50, 7]]
    alone = judged(p, b, cameras)
    assert np.argwhere(alone.mistaken).tolist() == [[1, 7], [1, 50]]
    assert not alone.misplaced.any()


def test_a_good_survey_is_left_alone_and_its_error_is_estimated():
    rng = np.random.default_rng(5)
    p, cameras = thesis_points()[1], thesis_rig(4)
    found = judged(p + rng.normal(0, 0.1, p.shape), seen(cameras, p, rng, 0.02), cameras)
    assert not found.misplaced.any()
    assert not found.mistaken.any()
    assert found.spread == pytest.approx(0.1, rel=0.4)


def test_one_camera_alone_judges_no_survey():
    p, cameras = thesis_points()[1], thesis_rig(2)
    b = seen(cameras, p, np.random.default_rng(0), 0.1)
    b[1, 11:] = np.nan
    assert judged(p, b, cameras) is None


def test_lines_are_the_wires_and_rows_on_which_three_or_more_points_lie():
    tags, p = wires()
    lines = [[tags[j] for j in np.flatnonzero(line)] for line in lines_of(p)]
    assert [f"A{k}" for k in range(1, 6)] in lines
    assert [f"E{k}" for k in range(1, 6)] in lines
    assert ["A3", "B3", "D3"] in lines  # a diagonal through the middle wire
    assert lines_of(np.random.default_rng(0).uniform(size=(12, 3))) == []
