"""Balls that are lit from one side are located where their outline is, by tracks and in all."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.special import ndtr

from tests.lit_balls import noisy, picture
from vidtrack.stages import track as stage
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.detection.blobs import find_blobs
from vidtrack.tracking.outlines import ball_outline
from vidtrack.tracking.outlines import lighting as module
from vidtrack.tracking.outlines.ball_outline import Outline, piece_of
from vidtrack.tracking.outlines.lighting import (
    Lighting,
    _lit_alike,
    _steady,
    light_record,
    lighting,
    lit_findings,
)

SHAPE = (90, 130)


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def film(n=40, hidden=False, deep=None, **how):
    """Errors and sd of a ball that goes its way, its flags, and what the stage gives.

    deep  of its radius: how far below its middle water covers it
    """
    rng, frames, truth = np.random.default_rng(5), [], []
    for k in range(n):
        x, y = 65 + 30 * np.sin(k / 9), 45 + 15 * np.cos(k / 7)
        light = picture(SHAPE, [(x, y, 6.0)], **how)
        if deep is not None:
            light += ndtr((np.arange(SHAPE[0])[:, None] - y - deep * 6.0) / 0.6) * (40.0 - light)
        luma = noisy(light, rng)
        if hidden:
            luma[:, 70:74] = noisy(np.full((SHAPE[0], 4), 30.0), rng)
        frames.append(Frame(k, Fraction(k, 25), luma, False, None))
        truth.append((x, y))
    found = track(frames, VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive"), targets=1)
    table = found.centroids
    return table[["Xf", "Yf"]].to_numpy() - truth, table[["sd_x", "sd_y"]].to_numpy(), table["flag"], found


def test_a_ball_lit_from_one_side_is_where_its_outline_is(monkeypatch):
    error, sd, flag, found = film(lamp=(1, 0.3, 0.5), ambient=0.3)
    assert (flag == "").all()
    assert np.abs(error).max() < 0.2
    assert (np.abs(error) < 5 * sd).all()
    assert [one.code for one in found.findings] == ["lit-from-one-side"]
    own = found.diagnostics["lighting"]
    assert own["way_px"] == pytest.approx(1.9, abs=0.4)
    assert own["without"] == 0
    assert abs(np.log(own["height"])) < 4 * np.hypot(own["height_sd"], 0.005)
    widths = found.diagnostics["widths"]["t1"]
    assert np.median(widths["width"]) == pytest.approx(12.0, abs=0.4)
    monkeypatch.setattr(stage, "lighting", lambda *given, **more: None)
    assert np.median(np.abs(film(lamp=(1, 0.3, 0.5), ambient=0.3)[0][:, 0])) > 0.6
    error, sd, _, found = film(lamp=(1, 0.3, 1.5), ambient=0.6)  # less of it: no rim is uneven
    assert found.findings == []
    assert np.median(np.abs(error[:, 0])) > 0.3
    assert np.median(np.abs(error[:, 0]) / sd[:, 0]) > 3


@pytest.mark.parametrize("deep", [0.1, 0.4])
def test_a_ball_that_swims_half_under_water_is_not_lit_by_a_lamp(deep, monkeypatch):
    error, sd, flag, found = film(lamp=None, deep=deep)
    assert "lighting" not in found.diagnostics
    assert (flag == "").mean() > 0.9
    assert np.nanmedian(np.abs(error[:, 1])) < 0.12
    assert not (np.abs(error) > 5 * sd).any()
    monkeypatch.setattr(ball_outline, "is_cut", lambda *given, **more: False)
    error, sd, _, _ = film(lamp=None, deep=deep)
    assert (np.abs(error) > 5 * sd).any(axis=1).mean() > 0.5, "the fit of a lit ball is off where it is cut"


def test_where_water_covers_one_of_several_balls_the_lamp_counts_for_the_others(rng):
    def pieces(x, y, deep):
        for _ in range(8):
            light = picture(SHAPE, [(x, y, 6.0)], lamp=(1, 0.2, 0.6), ambient=0.3)
            if deep is not None:
                light += ndtr((np.arange(SHAPE[0])[:, None] - y - deep * 6.0) / 0.6) * (40.0 - light)
            grey = noisy(light, rng)
            over = np.clip(grey.astype(float) - 60, 0, None)
            at = (over.sum(0) @ np.arange(SHAPE[1]) / over.sum(), over.sum(1) @ np.arange(SHAPE[0]) / over.sum())
            yield piece_of(grey, at, float((over > 0).sum()))

    places = [(30 + 30 * k, 40 + 5 * k) for k in range(3)]
    balls = [list(pieces(*at, None)) for at in places[:2]] + [list(pieces(*places[2], 0.0))]
    found = lighting(balls, 1.5)
    assert [len(own) > 0 for own in found.found] == [True, True, False]


def test_little_light_from_one_side_is_enough():
    error, sd, _, found = film(lamp=(1, 0.3, 1.5), ambient=0.6)
    assert [one.code for one in found.findings] == ["lit-from-one-side"]
    assert np.median(np.abs(error)) < 0.05
    assert (np.abs(error) < 5 * sd).all()


def test_a_shadow_that_comes_and_goes_is_no_lamp():
    found = [outlines([(0.1 * (k > 3), 0.0) for k in range(8)])]
    assert not _steady(found[0])
    assert _steady(outlines([(0.1 + 0.005 * k, 0.0) for k in range(8)]))


def test_a_ball_lit_from_everywhere_is_as_it_was(monkeypatch):
    error, sd, _, found = film(lamp=None)
    assert found.findings == []
    assert "lighting" not in found.diagnostics
    monkeypatch.setattr(stage, "lighting", lambda *given, **more: None)
    before = film(lamp=None)
    np.testing.assert_array_equal(error, before[0])
    np.testing.assert_array_equal(sd, before[1])


def test_what_hides_a_part_of_a_lit_ball_is_in_its_sd_or_its_flag():
    error, sd, flag, _ = film(lamp=(1, 0.3, 0.5), ambient=0.3, hidden=True)
    plain = (flag == "").to_numpy()
    assert plain.sum() > 15
    assert not ((np.abs(error) > 5 * sd) & (np.abs(error) > 0.15))[plain].any()


def test_a_ball_that_water_cuts_and_mirrors_is_not_lit_from_one_side():
    """Above the water it is bright, below it stands its dim image: all that is a ball has the same height."""
    rng = np.random.default_rng(3)
    pieces = []
    for k in range(24):
        deep = 2.0 + 1.2 * np.sin(k / 3)
        light = picture((60, 80), [(40.3, 30.2, 6.0)], lamp=None)
        row = np.arange(60)
        below = np.clip(row - (30.2 + deep) + 0.5, 0, 1)[:, None]
        mirrored = light[np.clip(np.rint(2 * (30.2 + deep) - row), 0, 59).astype(int)]
        grey = noisy(light * (1 - below) + below * (30 + 0.5 * (mirrored - 30)), rng)
        over = np.where(grey > 45, grey - 30.0, 0)
        down, across = np.mgrid[:60, :80]
        at = ((over * across).sum() / over.sum(), (over * down).sum() / over.sum())
        pieces.append(piece_of(grey, at, float((over > 60).sum()), shown=(at[1] + 3 * deep, k)))
    assert lighting([pieces], 1.5) is None


def outlines(ways, sd=0.01, held=True):
    places = np.linspace(0, 400, len(ways))
    return [
        Outline(np.array([x, 50.0]), 5.0, np.array(way, float), sd, held, 10.0 if held else np.nan, k)
        for k, (x, way) in enumerate(zip(places, ways, strict=True))
    ]


def test_ways_change_with_the_place():
    lit = Lighting([outlines([(0.2 + 0.02 * k, 0) for k in range(6)])])
    way, sd = lit.ways(0, np.array([[0.0, 400.0], [50.0, 50.0]]), np.full(2, 10.0))
    assert way[0] == pytest.approx([2.0, 3.0], abs=0.15)
    assert sd.max() < 0.25


def test_a_ball_with_few_outlines_takes_those_of_all():
    others = [outlines([(0.2, 0.1)] * 4) for _ in range(5)]
    lit = Lighting([*others, []])
    way, sd = lit.ways(5, np.array([[100.0], [50.0]]), np.array([5.0]))
    assert way[:, 0] == pytest.approx([1.0, 0.5], abs=0.02)
    assert 0 < sd[0] < 0.2


def test_an_outline_that_is_unlike_all_others_does_not_change_theirs():
    lit = Lighting([outlines([way]) for way in [(0.2, 0.0)] * 12 + [(-0.4, 0.3)]])
    way, _ = lit.ways(-1, np.array([[100.0], [50.0]]), np.array([5.0]))
    assert way[:, 0] == pytest.approx([1.0, 0.0], abs=0.05)
    own, _ = lit.ways(12, np.array([[0.0], [50.0]]), np.array([5.0]))
    assert own[:, 0] == pytest.approx([-2.0, 1.5], abs=0.1)


def test_a_ball_that_is_further_off_than_the_others_scatter_has_its_own_outline_whatever_its_fit_claims(rng):
    ways = [(0.2 + 0.01 * a, 0.01 * b) for a, b in rng.normal(size=(30, 2))]
    lit = Lighting([outlines([way], sd=0.06) for way in [*ways, (0.3, 0.0)]])
    own, sd = lit.ways(30, np.array([[0.0], [50.0]]), np.array([5.0]))
    assert own[0, 0] == pytest.approx(1.5, abs=0.1)
    assert 0.3 < sd[0] < 0.6
    same, sd = lit.ways(0, np.array([[0.0], [50.0]]), np.array([5.0]))
    assert same[0, 0] == pytest.approx(1.0, abs=0.1)
    assert sd[0] < 0.1


@pytest.mark.filterwarnings("error")
def test_samples_that_are_measured_at_another_threshold_are_less_sure_of_their_way():
    """A ball began with 59 and 38 pixels, dark side and all, where later ones had 20: 6 sigma off."""
    lit = Lighting([outlines([(0.2, 0.1)] * 8)])
    pixels = np.array([59.0, 38, *[20, 21, 19, 22] * 10, np.nan, 20])[:, None]
    where = np.broadcast_to(np.array([100.0, 50.0])[:, None, None], (2, *pixels.shape))
    way, sd = lit.ways_of_all(where, pixels, np.full(pixels.shape, 0.05), 1)
    size = np.hypot(*way[:, :, 0])
    assert (sd[:2, 0] > 0.25 * size[:2]).all()
    assert sd[0, 0] > sd[1, 0]
    assert sd[4:40, 0] == pytest.approx(lit.ways(0, where[:, 4:40, 0], np.full(36, np.sqrt(20.5 / np.pi)))[1], rel=0.1)
    assert np.isfinite(sd[:, 0]).all()


@pytest.mark.filterwarnings("error")
def test_a_sample_that_is_measured_much_worse_than_usual_may_be_of_another_part_of_the_light():
    """The first of 60 in its crescent's arc alone, 1.1 px off with three times the usual sd."""
    lit = Lighting([outlines([(0.4, 0.25)] * 8)])
    pixels = np.full((60, 1), 33.0)
    where = np.broadcast_to(np.array([100.0, 50.0])[:, None, None], (2, *pixels.shape))
    measured = np.array([0.2, *[0.07, 0.08, 0.065, 0.09] * 14, np.nan, 0.0, 0.07])[:, None]
    way, sd = lit.ways_of_all(where, pixels, measured, 1)
    assert sd[0, 0] > 0.3 * np.hypot(*way[:, 0, 0])
    assert np.ptp(sd[1:, 0]) < 1e-9


@pytest.mark.filterwarnings("error")
def test_of_samples_without_a_centroid_no_way_is_known_and_nothing_is_warned_of():
    lit = Lighting([outlines([way]) for way in [(0.2, 0.0)] * 12 + [(-0.4, 0.3)]])
    way, _ = lit.ways(12, np.full((2, 3), np.nan), np.full(3, 5.0))
    assert np.isnan(way).all()


def test_where_no_outline_can_be_fitted_the_sd_is_large():
    lit = Lighting([outlines([(0, 0)] * 3, sd=0.3, held=False)])
    assert lit.one_sided
    way, sd = lit.ways(0, np.array([[100.0], [50.0]]), np.array([5.0]))
    assert not way.any()
    assert sd[0] == pytest.approx(1.5)
    assert "no outline can be fitted" in lit_findings(lit)[0].text


def many(n, rng, **how):
    """Pieces of n balls, each in a picture of its own, from places of a large one."""
    found = []
    for _ in range(n):
        x, y = rng.uniform(29.5, 30.5, 2)
        luma = noisy(picture((60, 60), [(x, y, 4.5)], **how), rng)
        blobs = find_blobs(luma, bits=8)
        piece = piece_of(luma, (float(blobs.Xf[0]), float(blobs.Yf[0])), float(blobs.pixels[0]))
        found.append([piece._replace(where=tuple(rng.uniform(0, 400, 2)))])
    return found


def test_of_many_balls_that_no_lamp_lights_the_outlines_of_some_are_enough(rng, monkeypatch):
    calls = []

    def counted(*args, **how):
        calls.append(1)
        return ball_outline.outline_of(*args, **how)

    monkeypatch.setattr(module, "outline_of", counted)
    falls_off = iter([True])  # as light does over a target: its middles lie aside, outlines do not
    monkeypatch.setattr(module, "agreed", lambda ways, least: next(falls_off, False))
    assert lighting(many(70, rng, lamp=(0.0, 0.0, 1.0), ambient=0.5), 1.5, most=70) is None
    assert len(calls) <= 35
    monkeypatch.undo()
    monkeypatch.setattr(module, "outline_of", counted)
    calls.clear()
    lit = lighting(many(70, rng, lamp=(0.7, 0.2, 0.4), ambient=0.2), 1.5, most=70)
    assert lit is not None
    assert sum(len(own) for own in lit.found) == 70
    assert len(calls) >= 70


def test_balls_that_a_lamp_beside_the_camera_lights_are_moved_to_their_outlines(rng):
    shape, at = (300, 420), [(x, y) for y in (50.0, 150.0, 250.0) for x in (50.0, 130.0, 210.0, 290.0, 370.0)]
    light = np.full(shape, 30.0)
    for x, y in at:
        lamp = ((210 - x) / 400, (150 - y) / 400, 1)
        one = picture((60, 60), [(30 + 0.3, 30 - 0.2, 4.5)], lamp=lamp, ambient=0.3)
        light[int(y) - 30 : int(y) + 30, int(x) - 30 : int(x) + 30] = one
    luma, truth = noisy(light, rng), np.array(at) + np.array([0.3, -0.2])
    blobs = find_blobs(luma, bits=8)
    seen = np.stack([blobs.Xf, blobs.Yf], axis=1)
    pieces = [[piece_of(luma, where, count)] for where, count in zip(seen, blobs.pixels, strict=True)]
    lit = lighting(pieces, 1.5, most=len(pieces))
    assert lit is not None
    true = truth[[int(np.argmin(np.hypot(*(truth - where).T))) for where in seen]]
    ways = [lit.ways(i, seen[i][:, None], np.sqrt(blobs.pixels[i : i + 1] / np.pi)) for i in range(len(seen))]
    way, sd = np.array([one[0][:, 0] for one in ways]), np.array([one[1][0] for one in ways])
    assert np.median(np.hypot(*(seen - true).T)) > 0.3
    assert np.median(np.hypot(*(seen + way - true).T)) < 0.09
    assert (np.hypot(*(seen + way - true).T) < 4 * sd).all()


def test_a_thin_rim_of_light_from_behind_shows_in_many_balls_laid_over_each_other(rng):
    def balls(n, lamp, ambient):
        for x, y in zip(rng.uniform(25, 35, n), rng.uniform(25, 35, n), strict=True):
            luma = noisy(picture((60, 60), [(x, y, 4.8)], lamp=lamp, ambient=ambient, level=140.0), rng, 2.0)
            blobs = find_blobs(luma, bits=8)
            at = np.array([blobs.Xf[0], blobs.Yf[0]])
            yield piece_of(luma, at, float(blobs.pixels[0])), at - (x, y)

    pieces, off = zip(*balls(36, (0.1, 1.0, -1.2), 0.65), strict=True)
    lit = lighting([[piece] for piece in pieces], 2.0, most=36)
    assert np.mean(off, axis=0)[1] > 0.05
    assert lit is not None
    ways = [lit.ways(i, np.full((2, 1), 30.0), np.array([4.8])) for i in range(36)]
    left = np.array([way[:, 0] for way, _ in ways]) + off
    assert np.abs(left.mean(axis=0)).max() < 0.03
    assert 0.008 < ways[0][1][0] < 0.03
    assert lit.as_record()["lasting_px"] == pytest.approx(ways[0][1][0], rel=0.1)
    assert lit.widths(0)[0][0, 2] == pytest.approx(9.6, abs=0.3)
    assert lighting([[piece] for piece in pieces[:12]], 2.0, most=36) is None, "of a few it may be chance"
    pieces, _ = zip(*balls(36, None, 1.0), strict=True)
    assert _lit_alike([[]], [[piece] for piece in pieces], 2.0, 1) is None


def test_the_record_says_how_far_light_may_lie_aside_where_no_lamp_is_seen(rng):
    def pieces(lamp, ambient):
        for x, y in zip(rng.uniform(25, 65, 24), rng.uniform(25, 65, 24), strict=True):
            luma = noisy(picture((90, 90), [(x, y, 4.8)], lamp=lamp, ambient=ambient, level=110.0), rng, 2.0)
            blobs = find_blobs(luma, bits=8)
            yield piece_of(luma, (blobs.Xf[0], blobs.Yf[0]), float(blobs.pixels[0]))

    plain, behind = list(pieces(None, 1.0)), list(pieces((0.0, 1.0, -1.5), 0.6))
    assert lighting([plain], 2.0) is None
    even = light_record(None, [plain], 2.0)["light_aside_px"]
    rim = light_record(None, [behind], 2.0)["light_aside_px"]
    assert even < 0.06
    assert rim > 1.5 * even
    assert light_record(None, [plain[:4]], 2.0) == light_record(None, [], 2.0) == {}


def test_nothing_is_said_of_no_ball():
    assert lighting([], 1.0) is None
    assert lighting([[]], 1.0) is None
    assert lit_findings(None) == []
