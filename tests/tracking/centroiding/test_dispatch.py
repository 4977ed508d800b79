"""Which targets a template measures and which are segmented: the positions must not depend on it."""

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.centroiding.dispatch import measure_targets
from vidtrack.tracking.centroiding.template import Known, apply_template
from vidtrack.tracking.centroiding.window import segment_windows
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import VALUES, Appearance, X, Y

DETECTION = Detection(noise=2.0)
PLACE = np.array([[30.3, 30.1], [80.0, 30.4], [130.2, 31.0], [180.4, 29.6]])
RADIUS = np.array([4.0, 4.0, 9.0, 4.0])


def sample(place=PLACE, radius=RADIUS, **settings):
    discs = [(*p, r) for p, r in zip(place, radius, strict=True)]
    return Sample(picture((60, 220), discs, noise=2.0, rng=np.random.default_rng(1), **settings), 0.0)


def appearance(radius=RADIUS, soft=1.7):
    """Of discs on paper; soft NaN: not known yet."""
    one = np.ones(len(radius))
    size = 2 * radius
    soft = np.broadcast_to(soft, len(radius))
    return Appearance(np.stack([np.pi * radius**2, 200 * one, 30 * one, size, size, soft, 2 * one, 200 * one]))


def level(n=4):
    return np.full(n, 130.0)


def measured(one, looks, *, detection=DETECTION, place=PLACE):
    return measure_targets([one], place[None], appearance=looks, threshold=level(len(place)), detection=detection)


def segmented(one, looks, *, detection=DETECTION, place=PLACE):
    return segment_windows(
        [one], place[None], size=looks.size.T, pixels=looks.pixels, threshold=level(len(place)), detection=detection
    )


def test_targets_of_several_sizes_are_each_measured_where_they_are():
    seen = measured(sample(), appearance())
    assert seen.clear.all()
    assert np.abs(seen.values[[X, Y], 0].T - PLACE).max() < 0.04


@pytest.mark.parametrize("unknown", [[0], [2], [0, 1, 2, 3]])
def test_where_the_soft_edge_is_not_known_the_window_is_segmented_and_the_rest_keep_the_template(unknown):
    soft = np.full(4, 1.7)
    soft[unknown] = np.nan
    one, looks = sample(), appearance(soft=soft)
    seen, by_template = measured(one, looks), measured(one, appearance())
    by_segments = segmented(one, looks.of(np.array(unknown)), place=PLACE[unknown])
    rest = np.setdiff1d(np.arange(4), unknown)
    assert seen.values[:2, 0, rest] == pytest.approx(by_template.values[:2, 0, rest], abs=1e-11)
    assert np.array_equal(seen.values[:2, 0, unknown], by_segments.values[:2, 0])
    assert (by_template.values[:2, 0, unknown] != by_segments.values[:2, 0]).all(), "their numbers distinguish the two"


def test_what_is_not_clear_to_the_template_is_segmented_in_the_same_sample():
    """A neighbour on the ring of the mask spoils the plane of the template, but is a patch of its own."""
    place, looks = PLACE[:1], appearance(RADIUS[:1])
    one = sample(np.vstack([place, place + np.array([9.5, 0.0])]), (4.0, 2.0))
    known = Known(looks.size.T, looks.soft, looks.unrest, looks.pixels, level(1))
    assert not apply_template([one], place[None], known, DETECTION).clear.any()
    seen = measured(one, looks, place=place)
    assert seen.clear.all()
    assert np.abs(seen.values[[X, Y], 0].T - place).max() < 0.04


@pytest.mark.parametrize("kind", ["binary", "ellipse"])
def test_centroids_of_another_kind_are_always_segmented(kind):
    detection = Detection(noise=2.0, centroid=kind)
    one, looks = sample(), appearance()
    seen = measured(one, looks, detection=detection)
    assert np.array_equal(seen.values, segmented(one, looks, detection=detection).values)
    assert seen.values.shape == (VALUES, 1, 4)


def test_targets_smaller_than_most_are_measured_by_the_template_like_the_rest():
    """Those whose half axes are more than one px below the median were segmented in every sample."""
    radius = np.array([9.0, 9.0, 4.0, 9.0])
    one, looks = sample(radius=radius), appearance(radius)
    seen, some = measured(one, looks), np.array([2])
    small = looks.of(some)
    known = Known(small.size.T, small.soft, small.unrest, small.pixels, level(1))
    by_template = apply_template([one], PLACE[None, some], known, DETECTION)
    assert np.array_equal(seen.values[:2, 0, some], by_template.values[:2, 0])
    assert (seen.values[:2, 0, some] != segmented(one, small, place=PLACE[some]).values[:2, 0]).all()
