"""The edge of a shadow that goes over a ball moves its centroid, and not its rim."""

from fractions import Fraction

import numpy as np
from scipy.special import ndtr

from tests.discs import picture as discs
from vidtrack.stages import track as stage
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.outlines.uneven_light import UNEVEN_LIGHT, Ways

SHAPE, RADIUS = (80, 140), 7.0


def film(dim, n=60):
    """Errors and sd of a ball over which the soft edge of a shadow goes for half of the film."""
    rng, frames, truth = np.random.default_rng(3), [], []
    column = np.arange(SHAPE[1])
    for k in range(n):
        x, y = 25 + 1.4 * k, 40 + 5 * np.sin(k / 5)
        edge = max(x - 1.0, 65.0) if k < 50 else x - 25  # it stays, then it goes along with the ball, then it is gone
        light = dim + (1 - dim) * ndtr((edge - column) / 5.0)
        luma = discs(SHAPE, [(x, y, RADIUS, 90.0)], level=40.0, dtype=float, rng=rng) * light
        luma = np.clip(np.rint(luma + rng.normal(0, 1.5, SHAPE)), 0, 255).astype(np.uint8)
        frames.append(Frame(k, Fraction(k, 25), luma, False, None))
        truth.append((x, y))
    return measured(frames, truth)


def measured(frames, truth):
    """Errors and sd of the samples with an empty flag."""
    table = track(frames, VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive"), targets=1).centroids
    good = (table["flag"] == "").to_numpy()
    return (table[["Xf", "Yf"]].to_numpy() - truth)[good], table.loc[good, ["sd_x", "sd_y"]].to_numpy()


def wrong(error, sd):
    return int(((np.abs(error) > 5 * sd) & (np.abs(error) > 0.1)).any(axis=1).sum())


def test_a_shadow_along_the_course_is_in_the_sd(monkeypatch):
    error, sd = film(0.5)
    assert np.abs(error).max() > 0.4
    assert wrong(error, sd) == 0
    monkeypatch.setattr(stage, "lighting", lambda *given, **more: None)  # a shadow that stays looks like a lamp's
    assert wrong(*film(0.5)) == 0
    monkeypatch.setattr(Ways, "grown", lambda self, sd, own, place=None: sd)
    assert wrong(*film(0.5)) >= 3  # what surfaces show holds some of it


def lit(steps, n=40):
    """Errors and sd of a ball with the edge of a shadow on it all the time."""
    rng, frames, truth = np.random.default_rng(3), [], []
    column = np.arange(SHAPE[1])
    for k in range(n):
        x, y = 70 + np.sin(k / 5), 16 + 1.2 * k
        light = 1 - steps * ndtr((column - 70.0) / 2.0)
        luma = discs(SHAPE, [(x, y, RADIUS, 90.0)], level=40.0, dtype=float, rng=rng) * light
        luma = np.clip(np.rint(luma + rng.normal(0, 1.5, SHAPE)), 0, 255).astype(np.uint8)
        frames.append(Frame(k, Fraction(k, 25), luma, False, None))
        truth.append((x, y))
    return measured(frames, truth)


def test_a_shadow_that_stays_on_one_side_of_a_ball_is_in_the_sd(monkeypatch):
    error, sd = lit(0.2)
    assert len(error) > 35
    assert np.abs(np.median(error[:, 0])) < 0.05  # its outline is fitted
    assert wrong(error, sd) == 0
    monkeypatch.setattr(stage, "lighting", lambda *given, **more: None)
    error, sd = lit(0.2)
    assert np.median(error[:, 0]) < -0.3
    assert wrong(error, sd) == 0
    monkeypatch.setattr(Ways, "grown", lambda self, sd, own, place=None: sd)
    assert wrong(*lit(0.2)) > 30


def test_a_plain_ball_keeps_its_sd(monkeypatch):
    _, sd = film(1.0)
    monkeypatch.setattr(Ways, "grown", lambda self, sd, own, place=None: sd)
    np.testing.assert_array_equal(sd, film(1.0)[1])


def seen(ways_of, noise=0.01):
    """Ways of one target in every fourth sample, and what they add to an sd of 0.02 px."""
    ways, yes = Ways(1), np.ones(1, bool)
    for k, way in enumerate(ways_of):
        ways.seen(4 * k, np.zeros(1, int), np.array(way, float)[:, None], np.full(1, noise), yes)
    sd = np.full((2, 4 * len(ways_of), 1), 0.02)
    return np.sqrt(np.maximum(ways.grown(sd, sd) ** 2 - sd**2, 0))[:, :, 0]


def test_by_hand_a_lamp_that_is_always_at_one_side_is_in_the_sd_of_all_samples_alike():
    assert np.allclose(seen([(0.3, 0.4)] * 10), UNEVEN_LIGHT.from_one_side * 0.5)
    assert not seen([(0.0, 0.0), (0.5, 0.0)]).any()  # too few looks


def test_what_the_grid_of_pixels_and_noise_part_is_no_light_from_one_side():
    assert not seen([(0.03, 0.01)] * 10).any()
    assert not seen([(0.1, 0.0)] * 10, noise=0.1).any()
    assert seen([(0.1, 0.0)] * 400, noise=0.1).all()


def test_by_hand_what_parts_light_and_rim_more_than_usual_is_in_the_sd_about_that_look():
    added = seen([(0.0, 0.0)] * 5 + [(0.0, 0.6)] + [(0.0, 0.0)] * 4)
    assert np.flatnonzero(added[1]).tolist() == list(range(17, 24))
    assert np.allclose(added[:, 17:24], UNEVEN_LIGHT.whole * 0.6)
    both = seen([(0.3, 0.1)] * 5 + [(0.3, 0.7)] + [(0.3, 0.1)] * 4)
    steady = UNEVEN_LIGHT.from_one_side * np.hypot(0.3, 0.1)
    assert np.allclose(both, np.hypot(added, steady))


def test_looks_that_are_kept_together_say_the_same():
    many = [(0.0, 0.0)] * 300 + [(0.0, 0.6)] + [(0.0, 0.0)] * 300
    assert len(many) > 2 * UNEVEN_LIGHT.together
    added = seen(many)
    assert np.flatnonzero(added[0]).tolist() == list(range(1197, 1204))
    assert np.allclose(added[:, 1197:1204], UNEVEN_LIGHT.whole * 0.6)


def test_smaller_ways_count_about_a_plain_one_only():
    some = [(0.0, 0.0)] * 20 + [(0.08, 0.0)] + [(0.0, 0.0)] * 20
    plain = [(0.0, 0.0)] * 6 + [(0.5, 0.0)] + [(0.0, 0.0)] * 6 + [(0.08, 0.0)] + [(0.0, 0.0)] * 6
    assert not seen(some).any()
    added = seen(plain + some)[0]
    assert np.flatnonzero(added).max() == 4 * 14 - 1
    assert np.allclose(added[4 * 13], UNEVEN_LIGHT.whole * 0.08)


def test_ways_of_the_way_back_count_as_if_they_had_been_in_order():
    rng, yes, sd = np.random.default_rng(6), np.ones(1, bool), np.full((2, 40, 1), 0.02)
    forward, whole, back = Ways(1), Ways(1), Ways(2)
    for k in range(0, 40, 4):
        way = rng.normal(0, 0.3, (2, 1))
        whole.seen(k, np.zeros(1, int), way, np.full(1, 0.02), yes)
        some, number, place = (forward, k, 0) if k >= 20 else (back, 19 - k, 1)
        some.seen(number, np.full(1, place), way, np.full(1, 0.02), yes)
    forward.followed_back(back, lambda sample, place: (19 - sample, place - 1, np.ones(sample.size, bool)))
    assert (forward.grown(sd, sd) > sd).any()
    assert np.allclose(forward.grown(sd, sd), whole.grown(sd, sd), rtol=1e-6)
