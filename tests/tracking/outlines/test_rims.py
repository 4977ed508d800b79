"""Rims of targets, from films to centroids: a ball that water cuts, a thing beside it, a plain ball."""

from fractions import Fraction

import numpy as np
import pytest

from tests.discs import picture as discs
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.outlines.rims import UNEVEN_RIMS, Rims
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MEASURED, PIXELS, X, Y

SHAPE, LEVEL, LIGHT, RADIUS = (80, 100), 40.0, 100.0, 6.0


def picture(k, wet, rng):
    x, y = 30 + 0.7 * k, 40 + 6 * np.sin(k / 6)
    luma = discs(SHAPE, [(x, y, RADIUS, LIGHT)], level=LEVEL, rng=rng).astype(float)
    if wet:  # the water's edge goes up and down the ball, from its middle to two thirds below that
        row = np.arange(SHAPE[0])[:, None] - (y + 2 + 2 * np.sin(k / 4))
        luma += np.clip(row + 0.5, 0, 1) * (LEVEL - 8 - luma)
    return np.clip(np.rint(luma + rng.normal(0, 1.5, SHAPE)), 0, 255).astype(np.uint8), (x, y)


def film(wet, n=50):
    rng = np.random.default_rng(2)
    made = [picture(k, wet, rng) for k in range(n)]
    frames = [Frame(k, Fraction(k, 25), luma, False, None) for k, (luma, _) in enumerate(made)]
    info = VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive")
    table = track(frames, info, targets=1).centroids
    good = (table["flag"] == "").to_numpy()
    error = table[["Xf", "Yf"]].to_numpy() - [at for _, at in made]
    return error[good], table.loc[good, ["sd_x", "sd_y"]].to_numpy()


def wrong(error, sd):
    return int(((np.abs(error) > 5 * sd) & (np.abs(error) > 0.1)).any(axis=1).sum())


def test_a_ball_that_water_cuts_is_measured_where_the_whole_ball_is(monkeypatch):
    error, sd = film(wet=True)
    assert len(error) > 40
    assert wrong(error, sd) == 0
    assert np.quantile(np.abs(error[:, 1]), 0.75) < 0.15
    monkeypatch.setattr(Rims, "corrected", lambda self, position, sd, own, lit=None: (position, sd))
    error, sd = film(wet=True)
    assert wrong(error, sd) > 0
    assert np.quantile(np.abs(error[:, 1]), 0.75) > 0.5


def test_a_plain_ball_is_measured_as_if_no_rim_were_looked_at(monkeypatch):
    error, sd = film(wet=False)
    monkeypatch.setattr(Rims, "corrected", lambda self, position, sd, own, lit=None: (position, sd))
    plain = film(wet=False)
    np.testing.assert_array_equal(error, plain[0])
    np.testing.assert_array_equal(sd, plain[1])


def passed(wet, targets=1, searched=()):
    """Rims of so many targets, all of them the ball, after samples of which `wet` are cut; searched: samples in which
    it was not plainly itself.
    """
    rng, rims = np.random.default_rng(0), Rims(targets, Detection(noise=1.5))
    for k, cut in enumerate(wet):
        luma, (x, y) = picture(k, cut, rng)
        values = np.full((MEASURED, 1, targets), np.nan)
        if k not in searched:
            values[[X, Y, PIXELS]] = np.array([x, y - 1.5 * cut, 100.0])[:, None, None]
        rims.passed([Sample(luma, float(k))], k, values)
    return rims


def corrected(rims, n, targets):
    return rims.corrected(*(np.full((2, n, targets), value) for value in (0.0, 1.0, 1.0)))


def moved(rims, n, targets=1):
    return np.flatnonzero(corrected(rims, n, targets)[0][1].any(axis=1))


def test_samples_before_the_look_that_finds_it_are_looked_at_too_and_each_once():
    wet = [False] * 6 + [True] * 8 + [False] * 6
    np.testing.assert_array_equal(moved(passed(wet), len(wet)), np.arange(6, 14))
    way = corrected(passed(wet), 20, 1)[0][1, 6:14, 0]
    np.testing.assert_allclose(way, 1.5, atol=0.3)


def test_what_was_searched_for_beside_samples_that_were_moved_may_be_off_as_far():
    n, searched = 30, (0, 13, 14, 27)
    wet = [True] * 20 + [False] * 10
    position, sd = corrected(passed(wet, searched=searched), n, 1)
    assert (position[1, searched, 0] == 0).all()
    np.testing.assert_allclose(sd[:, searched[:3], 0], np.hypot(1.0, 1.5), rtol=0.1)
    assert (sd[:, 26:, 0] == 1).all(), "nothing is cut any more"


def test_of_many_targets_some_are_looked_at_in_turn():
    n = UNEVEN_RIMS.at_once + 3
    rims = passed([True] * (2 * UNEVEN_RIMS.every), n)
    assert (corrected(rims, 8, n)[1] > 1).any(axis=(0, 1)).all()


@pytest.mark.parametrize("targets", [0, 1])
def test_without_a_look_nothing_is_moved(targets):
    rims = Rims(targets, Detection())
    rims.passed([Sample(np.zeros(SHAPE, np.uint8), 0.0)], 0, np.full((MEASURED, 1, targets), np.nan))
    position, sd = corrected(rims, 1, targets)
    assert not position.any()
    assert (sd == 1).all()
