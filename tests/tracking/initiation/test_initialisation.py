"""Targets are found by their motion, or else by their brightness, and what stands still besides is clutter."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discs import picture
from tests.tracking.test_tracker import DETECTION, SHAPE, circle, samples_of
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.initiation.initialisation import (
    INITIALISATION,
    _blobs_above,
    clutter_besides,
    find_movers,
    find_targets,
)
from vidtrack.tracking.sample import Sample

STILL = [(40.0, 40.0, 5.0), (260.0, 160.0, 5.0)]


def found_at(opening):
    return np.array([trail.position[0] for trail in opening.trails])


@pytest.mark.parametrize("n", [1, 3, 8])
def test_all_that_moves_is_found_before_anything_that_stands_still(n):
    path = circle(12, n, period=40.0)
    opening = find_targets(samples_of(path, still=STILL), n, DETECTION)
    assert opening.moving == len(opening.trails) == n
    off = np.linalg.norm(found_at(opening)[:, None] - path[0], axis=-1)
    assert sorted(off.argmin(1)) == list(range(n))
    assert off.min(1).max() < 1.0
    assert opening.clutter.Xf.size == 2


def test_names_go_from_top_to_bottom_and_then_from_left_to_right():
    path = circle(12, 6, period=40.0)
    at = found_at(find_targets(samples_of(path), 6, DETECTION)).round()
    assert [tuple(place) for place in at[:, ::-1]] == sorted(map(tuple, at[:, ::-1]))


def test_what_stands_still_is_taken_only_where_too_little_moves_and_the_brightest_first():
    path = circle(12, 1, period=40.0)
    samples = samples_of(path, still=[*STILL, (150.0, 20.0, 9.0)])
    opening = find_targets(samples, 2, DETECTION)
    assert (opening.moving, len(opening.trails)) == (1, 2)
    assert np.linalg.norm(found_at(opening) - [150, 20], axis=1).min() < 1
    assert opening.clutter.Xf.size == 2


def test_fewer_are_found_where_there_are_fewer():
    assert len(find_targets(samples_of(circle(12, 2, period=40.0)), 5, DETECTION).trails) == 2
    empty = [Sample(np.full(SHAPE, 30, np.uint8), float(k)) for k in range(6)]
    opening = find_targets(empty, 2, DETECTION)
    assert (opening.trails, opening.moving) == ([], 0)


def test_two_samples_are_too_few_for_motion_but_not_for_brightness():
    path = np.repeat(circle(1, 2), 2, axis=0)
    opening = find_targets(samples_of(path), 2, DETECTION)
    assert (opening.moving, len(opening.trails)) == (0, 2)


def test_a_target_that_begins_to_move_late_is_found_by_its_motion_of_then():
    rest = np.tile(circle(1)[0], (10, 1, 1))
    path = np.concatenate([rest, circle(14, period=40.0)])
    opening = find_targets(samples_of(path, still=STILL), 1, DETECTION)
    assert opening.moving == 1
    assert np.linalg.norm(found_at(opening)[0] - path[0, 0]) < 20
    assert opening.clutter.Xf.size >= 2


def test_a_target_that_creeps_is_not_lost_to_its_own_ghost_in_the_background():
    k = np.arange(12)[:, None]
    path = np.stack([100 + 0.4 * k, np.full_like(k, 100.0, dtype=float)], axis=-1)
    opening = find_targets(samples_of(path, still=STILL), 1, DETECTION)
    assert np.linalg.norm(found_at(opening)[0] - path[0, 0]) < 1.5


def test_a_part_of_what_moves_is_no_target_of_its_own():
    """Three large balls in one blob that creeps: parts of it stand out of surroundings that it makes bright itself."""
    rng, way = np.random.default_rng(3), np.array([(-4.0, -1.0), (-1.0, -2.0), (-3.0, 2.0)])
    at = np.array([(380.0, 230.0), (368.0, 212.0), (416.0, 280.0)])
    samples = []
    for k in range(10):
        light = picture((480, 640), [(*p, 38.0) for p in at + k * way], level=30, contrast=190, dtype=float)
        luma = np.clip(np.minimum(light, 220) + rng.normal(0, 2, light.shape), 0, 255).astype(np.uint8)
        samples.append(Sample(luma, float(k)))
    opening = find_targets(samples, 3, Detection(noise=2.0))
    assert opening.moving == 2
    assert min(trail.pixels.min() for trail in opening.trails) > 0.9 * np.pi * 38**2


def test_movers_are_the_best_where_there_are_more_than_are_asked_for():
    path = circle(INITIALISATION.samples + 1, 5, period=40.0)
    samples = samples_of(path)
    backgrounds = background_of(samples_of(circle(12, 5, period=40.0)), DETECTION)
    assert len(find_movers(samples, backgrounds, DETECTION, 5)) == 5
    assert len(find_movers(samples, backgrounds, DETECTION, 2)) >= 2


def test_what_begins_in_no_start_box_and_stays_is_clutter():
    path = circle(6, 1, period=40.0)
    samples = samples_of(path, still=STILL)
    box = np.array([[40.0, 40.0]])
    none = clutter_besides(samples, np.array([[40.0, 40.0]]), box, DETECTION)
    assert np.allclose(np.stack([none.Xf, none.Yf], -1), [[260, 160]], atol=0.5)
    both = clutter_besides(samples, np.array([[150.0, 100.0]]), box, DETECTION)
    assert sorted(both.Xf.round().tolist()) == [40, 260]


def test_a_thing_that_is_gone_by_the_last_sample_is_no_clutter():
    samples = samples_of(circle(6, 1, period=40.0), still=STILL)
    gone = samples_of(circle(6, 1, period=40.0), still=STILL[:1])
    left = clutter_besides([*samples[:5], gone[5]], np.array([[150.0, 100.0]]), np.array([[9.0, 9.0]]), DETECTION)
    assert left.Xf.round().tolist() == [40]


def test_what_lasts_is_a_target_before_what_glitters_more_brightly():
    """Spots of four samples each, brighter than the targets, drift all over the picture."""
    path = circle(12, 2, period=40.0)
    rng = np.random.default_rng(3)
    lit = []
    for sample in samples_of(path):
        lit.append(np.array(sample.luma))
    for first in range(-3, 12):
        for x, y in rng.uniform((15, 15), (SHAPE[1] - 15, SHAPE[0] - 15), (3, 2)):
            for j in range(max(first, 0), min(first + 4, 12)):
                column, row = round(x + 0.8 * (j - first)), round(y)
                lit[j][row - 3 : row + 4, column - 3 : column + 4] = 250
    samples = [Sample(luma, float(k)) for k, luma in enumerate(lit)]
    opening = find_targets(samples, 2, DETECTION)
    assert len(opening.trails) == 2
    for trail in opening.trails:
        off = np.linalg.norm(path[trail.sample] - trail.position[:, None], axis=-1)
        assert np.median(off.min(axis=1)) < 2


def test_of_more_blobs_than_can_be_linked_the_most_massive_are(monkeypatch):
    y, x = np.mgrid[5:200:10, 5:300:10].reshape(2, -1)
    light = np.random.default_rng(0).permutation(np.linspace(60, 200, x.size))
    dots = Sample(picture(SHAPE, np.column_stack([x, y, np.full(x.size, 2.0), light])), 0.0)
    found = _blobs_above(dots, dots.luma, DETECTION, 50.0)
    most = INITIALISATION.blobs_at_most
    monkeypatch.setattr(
        "vidtrack.tracking.initiation.initialisation.INITIALISATION", replace(INITIALISATION, blobs_at_most=9999)
    )
    every = _blobs_above(dots, dots.luma, DETECTION, 50.0)
    assert found.mass.size == most < every.mass.size
    assert sorted(found.mass) == sorted(every.mass)[-most:]


def test_a_stick_that_stands_still_is_no_target_however_bright_it_is():
    samples = samples_of(np.full((8, 1, 2), np.nan), still=STILL[:1])
    for sample in samples:
        sample.luma[20:22, 100:220] = 250
    (only,) = find_targets(samples, 2, DETECTION).trails
    assert only.position[0] == pytest.approx(STILL[0][:2], abs=0.5)


def test_a_stick_that_creeps_is_no_target():
    samples = samples_of(np.full((12, 1, 2), np.nan), still=STILL[:1])
    for k, sample in enumerate(samples):
        sample.luma[20:24, 100 + k // 2 : 140 + k // 2] = 250
    assert all(abs(trail.position[0, 1] - 21.5) > 5 for trail in find_targets(samples, 2, DETECTION).trails)


def test_dim_movers_are_found_where_their_pixels_together_stand_out():
    path = circle(12, 3, period=40.0)
    opening = find_targets(samples_of(path, contrast=14.0, noise=2.5), 3, Detection(noise=2.5))
    assert opening.moving == 3
    assert np.linalg.norm(found_at(opening)[:, None] - path[0], axis=-1).min(1).max() < 2


def test_where_nine_of_ten_move_no_later_samples_are_searched(monkeypatch):
    seen = []

    def counted(samples, *others):
        seen.append(len(samples))
        return find_movers(samples, *others)

    monkeypatch.setattr("vidtrack.tracking.initiation.initialisation.find_movers", counted)
    path = circle(24, 10, period=40.0)
    path[:, 9] = (20, 20)
    opening = find_targets(samples_of(path), 10, DETECTION)
    assert (len(seen), opening.moving, len(opening.trails)) == (1, 9, 10)
    path[:, 8] = (280, 180)
    find_targets(samples_of(path), 10, DETECTION)
    assert len(seen) > 2
