"""Discs, streaks and halves are found in pieces where they are expected, beside what only this camera has measured."""

import numpy as np
import pytest

from tests.location.lost_targets.test_second_search import CONTRAST, NOISE, RADIUS, grey
from vidtrack.location.lost_targets.expected import InPicture
from vidtrack.location.lost_targets.kept_pieces import Kept
from vidtrack.location.lost_targets.piece_search import Motion, found_in_pieces, motion_of, or_measured, usual_discs

ONE = np.zeros(1, np.intp)


def sought(piece, expected, *, measured=None, way=None, spread=0.3, exposure=0.0, lit=(0.0, 0.0, 0.0)):
    """What is found in a piece of targets expected at (m, 2) px; NaN: nothing is expected of one."""
    expected = np.asarray(expected, float)
    m = len(expected)
    kept = Kept(np.zeros(1), ONE, ONE, ONE, ONE + 1, [piece], NOISE, np.ones(2), exposure, np.array([lit]).T)
    where = InPicture(expected[:, None], np.tile(spread**2 * np.eye(2), (m, 1, 1, 1)))
    usual = np.array([[RADIUS] * m, [CONTRAST] * m])[..., None]
    nothing = np.zeros((m, 1, 2))
    motion = Motion(nothing, nothing, nothing if way is None else np.asarray(way, float)[:, None], nothing)
    b = np.full((m, 1, 2), np.nan) if measured is None else np.asarray(measured, float)[:, None]
    return found_in_pieces(kept, ONE, ONE, ONE, where, motion, usual, b, np.full(b.shape, 0.05), 0.0, set())


@pytest.mark.parametrize(
    ("measured", "n"), [((35.2, 34.9), 0), ((33.5, 34.9), 0), ((31.0, 35.0), 1), ((np.nan,) * 2, 1)]
)
def test_what_the_camera_has_measured_of_another_target_is_not_found_again(measured, n):
    """One blob, that of the first target or of both; nothing is expected of the first one, the second is 0.8 px off."""
    piece = grey([(35.0, 35.0)], np.random.default_rng(2))
    found = sought(piece, [(np.nan, np.nan), (35.8, 35.0)], measured=[measured, (np.nan, np.nan)], spread=0.5)
    assert found.target.tolist() == [1] * n


def test_a_target_that_touches_what_only_this_camera_has_measured_is_fitted_with_it():
    at = np.array([(31.0, 34.0), (39.5, 36.0)])
    piece = grey(at, np.random.default_rng(3))
    nan = (np.nan, np.nan)
    found = sought(piece, [at[0] + 0.2, nan], measured=[nan, at[1]])
    assert found.target.tolist() == [0]
    assert np.abs((found.b[0] - at[0]) / found.sd[0]).max() < 4
    assert found.sd.max() < 0.2
    assert not sought(piece, [at[0] + 0.2, nan]).target.size


def test_what_only_this_camera_has_measured_near_a_target_is_no_part_of_its_fit():
    """4 px apart they are fitted alone."""
    at = np.array([(28.0, 34.0), (41.8, 36.0)])
    piece = grey(at, np.random.default_rng(3))
    nan = (np.nan, np.nan)
    found = sought(piece, [at[0] + 0.2, nan], measured=[nan, at[1]])
    assert found.target.tolist() == [0]
    assert found.sd.max() < 0.05
    rough = sought(piece, [at[0] + 0.2, nan])
    assert not rough.target.size or rough.sd.min() > 2 * found.sd.max()


@pytest.mark.parametrize("at", [[(30.0, 36.0), (35.0, 37.6), (38.0, 37.5)], [(30.0, 36.0), (32.8, 42.9), (32.5, 44.9)]])
def test_of_a_blob_of_three_nothing_is_found_where_it_is_not_known_well_where_two_are(at):
    """Two discs take up most of their light, 1 to 2 px from where they are."""
    seen = grey(at, np.random.default_rng(1))
    expected = np.add(at[:2], [(0.4, -0.5), (0.3, 0.4)])
    assert not sought(seen, expected, spread=1.0).target.size
    two = sought(grey(at[:2], np.random.default_rng(0)), expected, spread=1.0)
    assert two.target.tolist() == [0, 1]
    assert np.abs(two.b - at[:2]).max() < 0.2


def streaks(at, way, rng):
    t = ((np.arange(24) + 0.5) / 24 - 0.5)[:, None, None]
    return grey(np.asarray(at) + t * np.asarray(way), rng)


def test_streaks_that_touch_are_measured_by_one_fit():
    z = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        at = np.array([(29.0, 34.0), (40.0, 36.0)]) + rng.uniform(-1, 1, (2, 2))
        way = np.array([(9.0, 5.0), (8.0, -6.0)]) * rng.uniform(0.8, 1.2)
        piece = streaks(at, way, rng)
        found = sought(piece, at + 0.2, way=way)
        assert found.target.tolist() == [0, 1]
        assert not sought(piece, at + 0.2).target.size, "as discs they are not explained"
        z.append((found.b - at) / found.sd)
    z = np.array(z)
    assert np.sqrt(np.mean(z**2)) < 1.5
    assert np.abs(z).max() < 5


def test_a_ball_behind_something_dark_is_measured_by_what_is_left_of_it():
    rng = np.random.default_rng(4)
    piece = grey([(35.0, 35.0)], rng).astype(float)
    piece[:, 35:39] = rng.normal(38, NOISE, (70, 4))
    found = sought(np.rint(piece).astype(np.uint8), [(35.3, 34.8)])
    assert found.target.tolist() == [0]
    assert np.abs((found.b[0] - 35.0) / found.sd[0]).max() < 4


def test_a_whole_ball_beside_something_dark_is_measured():
    rng = np.random.default_rng(4)
    piece = grey([(35.0, 35.0)], rng).astype(float)
    near = int(35 - RADIUS) - 4
    piece[:, near : near + 4] = rng.normal(6, NOISE, (70, 4))
    found = sought(np.clip(np.rint(piece), 1, 255).astype(np.uint8), [(35.3, 34.8)])
    assert found.target.tolist() == [0]
    assert np.abs((found.b[0] - 35.0) / found.sd[0]).max() < 4


@pytest.mark.parametrize(("apart", "spread", "tried"), [(0.3, 0.05, False), (0.3, 1.0, True), (1.3, 0.05, True)])
def test_balls_that_are_known_to_be_nearly_behind_each_other_are_not_fitted(monkeypatch, apart, spread, tried):
    fits = []
    monkeypatch.setattr("vidtrack.location.lost_targets.piece_search._fitted", lambda *own: fits.append(own))
    at = np.array([(35.0, 35.0), (35.0 + apart * RADIUS, 35.0)])
    assert not sought(grey(at, np.random.default_rng(2)), at, spread=spread).target.size
    assert bool(fits) is tried


@pytest.mark.parametrize("far", [0.0, 37.0])
def test_a_ball_that_touches_two_nearly_behind_each_other_is_measured_beside_them(far):
    """Also where one of the two is beyond the edge of the piece."""
    first = 40.0 - far
    at = np.array([(first + 2.3 * RADIUS, 35.0), (first + 0.5 * RADIUS, 35.0), (first, 35.0)])
    found = sought(grey(at, np.random.default_rng(2)), at + 0.1)
    assert found.target.tolist() == [0]
    assert np.abs((found.b[0] - at[0]) / found.sd[0]).max() < 4


def test_a_fit_is_tried_again_when_it_is_known_what_is_beside():
    at = np.array([(2.0 + 1.7 * RADIUS, 35.0), (2.0, 35.0)])  # this one is never fitted: the piece cuts it
    piece = grey(at, np.random.default_rng(2))
    kept = Kept(np.zeros(1), ONE, ONE, ONE, ONE + 1, [piece], NOISE, np.ones(2), 0.0, np.zeros((3, 1)))
    still, looks = Motion(*np.zeros((4, 2, 1, 2))), np.array([[RADIUS] * 2, [CONTRAST] * 2])[..., None]
    nothing, vain = np.full((2, 1, 2), np.nan), set[tuple[int, ...]]()
    for unsure, off, n in ((60.0, 30.0, 0), (0.1, 0.0, 1)):
        S = np.array([0.1, unsure])[:, None, None, None] ** 2 * np.eye(2)
        where = InPicture(at[:, None] + np.array([0.0, off])[:, None, None], S)
        found = found_in_pieces(kept, ONE, ONE, ONE, where, still, looks, nothing, nothing, 0.0, vain)
        assert found.target.size == n


def test_what_discs_alone_explain_is_not_taken_for_half_hidden(monkeypatch):
    """Two that overlap by more than can be separated; that they seem dark in part may come of a size that is wrong."""
    fits = []
    monkeypatch.setattr("vidtrack.tracking.discs.half_hidden.fit_half_hidden", lambda *a, **k: (fits.append(a), 0))
    monkeypatch.setattr("vidtrack.location.lost_targets.piece_search._half_dark", lambda *_: True)
    at = np.array([(35.0, 35.0), (35.0 + 0.55 * RADIUS, 35.0)])
    assert not sought(grey(at, np.random.default_rng(2)), at, spread=0.6).target.size
    assert not fits


def test_a_fit_that_was_tried_in_vain_is_not_tried_again():
    piece = grey([(35.0, 35.0)], np.random.default_rng(2), covered=True)
    kept = Kept(np.zeros(1), ONE, ONE, ONE, ONE + 1, [piece], NOISE, np.ones(2), 0.0, np.zeros((3, 1)))
    where = InPicture(np.full((1, 1, 2), 35.0), np.tile(0.1 * np.eye(2), (1, 1, 1, 1)))
    still, looks = Motion(*np.zeros((4, 1, 1, 2))), np.array([[RADIUS], [CONTRAST]])[..., None]
    vain: set[tuple[int, ...]] = set()
    b = np.full((1, 1, 2), np.nan)
    found_in_pieces(kept, ONE, ONE, ONE, where, still, looks, b, b, 0.0, vain)
    assert len(vain) == 1
    seen = kept._replace(grey=[grey([(35.0, 35.0)], np.random.default_rng(2))])
    assert not found_in_pieces(seen, ONE, ONE, ONE, where, still, looks, b, b, 0.0, vain).target.size
    assert found_in_pieces(seen, ONE, ONE, ONE, where, still, looks, b, b, 0.0, set()).target.size


def test_the_motion_during_an_exposure_is_that_of_a_parabola():
    """x = 3 t + t^2: in half an exposure of 0.8 samples it goes 2.4 px, and bends by a t^2 / 2 with a = 2."""
    t = np.arange(-1.0, 2.0)
    where = InPicture(np.stack([3 * t + t**2, 0 * t], axis=-1)[None], np.tile(1e-8 * np.eye(2), (1, 3, 1, 1)))
    motion = motion_of(where, t, 0.8, 0.0)
    assert motion.way[0, 1] == pytest.approx([2.4, 0.0])
    assert motion.bend[0, 1] == pytest.approx([0.64, 0.0])
    assert motion.late[0, 1] == pytest.approx([0.64 / 12, 0.0])
    assert np.isnan(motion.way[0, [0, 2]]).all()
    assert not np.any(motion_of(where, t, 0.0, 0.0))


def test_the_motion_at_the_begin_of_a_gap_is_that_from_where_the_camera_itself_saw_it_last():
    t = np.arange(4.0)
    true = np.stack([5 * t, 0 * t], axis=-1)[None]
    gap = np.array([False, True, True, False])
    S = np.where(gap[:, None, None], 0.04 * np.eye(2), np.nan)[None]
    where = InPicture(np.where(gap[:, None], true, np.nan), S)
    course = or_measured(where, np.where(gap[:, None], np.nan, true), np.full(true.shape, 0.1))
    assert course.at.tolist() == true.tolist()
    assert course.S[0, :, 0, 0] == pytest.approx([0.01, 0.04, 0.04, 0.01])
    assert np.isnan(motion_of(where, t, 0.5, 0.0).way).all()
    assert motion_of(course, t, 0.5, 0.0).way[0, 1:3] == pytest.approx(np.array([[2.5, 0.0]] * 2))


def test_discs_that_are_drawn_out_are_smaller_and_brighter_than_they_look():
    """At 10 px a sample, half of which it is exposed, a radius of 4 px covers 16 pi + 2 * 4 * 5 pixels."""
    steps = np.array([0.0, 1.0, 2.0, 4.0])
    b = np.stack([10 * steps, 0 * steps], axis=-1)[None]
    pixels = 16 * np.pi + 40
    looks = np.array([[pixels], [100.0]])
    radius, light = usual_discs(looks, b, steps, 0.5)[:, 0]
    assert radius == pytest.approx(np.sqrt(4 * np.sqrt(pixels / np.pi)))
    assert light * np.pi * radius**2 == pytest.approx(100 * pixels)
    assert usual_discs(looks, np.full(b.shape, np.nan), steps, 0.5)[0, 0] == pytest.approx(np.sqrt(pixels / np.pi))


def test_a_target_that_is_lit_from_one_side_is_where_its_outline_is():
    piece = grey([(35.0, 35.0)], np.random.default_rng(4))
    plain, lit = (sought(piece, [(36.0, 35.0)], lit=way) for way in ((0.0, 0.0, 0.0), (0.2, -0.1, 0.05)))
    assert lit.b[0] - plain.b[0] == pytest.approx([0.2 * RADIUS, -0.1 * RADIUS], abs=0.02)
    assert (lit.sd[0] > 0.05 * RADIUS).all()
    assert (plain.sd[0] < 0.05 * RADIUS).all()
