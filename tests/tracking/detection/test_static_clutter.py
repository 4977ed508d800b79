"""What stands about: no target is measured while it touches it, and no piece of it is taken for a target."""

from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.discs import picture
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.static_clutter import StaticClutter, start_places, static_clutter
from vidtrack.tracking.sample import Sample

RATE = Fraction(30000, 1001)
SHAPE = (160, 240)
INFO = VideoInfo(SHAPE[1], SHAPE[0], RATE, field_order="progressive")
DETECTION = Detection(noise=3.0)
X = np.arange(SHAPE[1])


def things():
    """A metre stick, marked every 10 px, and a rope across, of half the contrast of the target."""
    grey = np.full(SHAPE, 40.0)
    grey[64:74] += 60.0 * (X % 10 > 0)
    for x in X:
        y = 10 + x // 2
        grey[max(0, y - 2) : y + 3, x] = 110.0
    return grey


def swings(k):
    return np.array([120 + 70 * np.sin(0.02 + k / 18), 80 + 55 * np.sin(2.6 + k / 23)])


def filmed(at, n, ground):
    rng = np.random.default_rng(0)
    pictures = (picture(SHAPE, [(*at(k), 4.0, 120.0)], level=ground, noise=3.0, rng=rng) for k in range(n))
    return [Frame(k, k / RATE, luma, False, None) for k, luma in enumerate(pictures)]


@pytest.mark.slow
@pytest.mark.parametrize("boxed", [False, True])
def test_a_target_that_crosses_a_stick_and_a_rope_is_measured_right_or_not_at_all(boxed):
    """Half-way up the target lies the stick: they make one blob, and its pieces are of the target's size. The start
    box holds some of them too.
    """
    columns = ["target", "Xf", "Yf", "width", "height"]
    boxes = pd.DataFrame([["t1", *swings(0), 94, 94]], columns=columns) if boxed else None
    table = track(filmed(swings, 260, things()), INFO, start_boxes=boxes).centroids
    truth = np.array([swings(k) for k in range(260)])
    error = np.abs(table[["Xf", "Yf"]].to_numpy() - truth).max(axis=1)
    assert np.nanmax(error) < 0.15
    assert np.isfinite(error).mean() > 0.5
    box = np.array([[*(p - 4), *(p + 4)] for p in np.rint(truth)]).astype(int)
    ground = things() > 70
    apart = np.array([not ground[y0 - 3 : y1 + 4, x0 - 3 : x1 + 4].any() for x0, y0, x1, y1 in box])
    assert np.isfinite(error[apart]).mean() > 0.85
    touching = np.array([ground[y0 : y1 + 1, x0 : x1 + 1].sum() > 2 for x0, y0, x1, y1 in box])
    z = error / table[["sd_x", "sd_y"]].max(axis=1).to_numpy()
    assert not (z[touching] > 5).any()  # what is hidden in part is fitted, or not measured
    missing = touching & (apart.cumsum() > 0) & ~np.isfinite(error)
    flags = table.loc[missing, "flag"]
    assert flags.str.contains("merged").mean() > 0.25  # where its box has gone astray it is only lost


def test_a_speck_that_a_target_brushes_does_not_pull_it():
    """So small that target and speck together still pass for the target."""
    ground = np.full(SHAPE, 40.0)
    ground[84:88, 100::24] = ground[84:88, 101::24] = ground[84:88, 102::24] = 160.0

    def at(k):
        return np.array([20.0 + 1.5 * k, 80.2])

    table = track(filmed(at, 120, ground), INFO).centroids
    error = np.abs(table[["Xf", "Yf"]].to_numpy() - np.array([at(k) for k in range(120)]))
    assert np.nanmax(error) < 0.1
    assert table["Xf"].notna().mean() > 0.4
    assert (error.max(axis=1) / table[["sd_x", "sd_y"]].max(axis=1).to_numpy())[table["Xf"].notna()].max() < 5


@pytest.mark.parametrize("boxed", [False, True])
def test_a_target_at_rest_is_not_what_stands_about(boxed):
    boxes = pd.DataFrame([["t1", 150.0, 40.0]], columns=["target", "Xf", "Yf"]) if boxed else None
    rests = np.array([148.3, 38.6])
    frames = filmed(lambda k: rests + np.array([0, max(0, 0.5 * (k - 70))]), 110, np.full(SHAPE, 40.0))
    table = track(frames, INFO, start_boxes=boxes).centroids
    assert table["Xf"].notna().all()


def samples(ground, parity=0, lines=1):
    return [Sample(np.clip(np.rint(ground), 0, 255).astype(np.uint8), float(k), parity, lines) for k in range(5)]


def standing(ground, own=(), detection=DETECTION, alone=False, **kind):
    shown = samples(ground, **kind)
    parity = shown[0].parity
    boxes = np.reshape(np.asarray(own, float), (-1, 4))
    return static_clutter(shown, {parity: shown[0].luma}, detection, boxes, alone=alone)


def test_boxes_that_reach_a_thing_touch_it():
    ground = np.full((60, 80), 40.0)
    ground[20:30, 40:50] = 200
    things = standing(ground)
    here = samples(ground)[:1]
    # the soft edge of a box 10 px wide about x reaches 6 px: the thing begins at 39.5
    for x, y in ((33.6, 25), (55.4, 25), (45, 14)):
        assert things.touched(here, [[x]], [[y]], 10, 10)[0, 0], (x, y)
    for x, y in ((33.4, 25), (55.6, 25), (45, 13)):
        assert not things.touched(here, [[x]], [[y]], 10, 10)[0, 0], (x, y)
    assert not things.touched(here, [[np.nan]], [[np.nan]], 10, 10)[0, 0]


def test_a_field_s_things_lie_at_its_own_rows():
    ground = np.full((30, 80), 40.0)
    ground[10:15, 40:50] = 200  # rows 21 to 29 of the frame
    things = standing(ground, parity=1, lines=2)
    here = samples(ground, parity=1, lines=2)[:1]
    assert things.touched(here, [[45]], [[25]], 4, 2)[0, 0]
    assert not things.touched(here, [[45]], [[13]], 4, 2)[0, 0]
    assert not things.touched(here, [[45]], [[37]], 4, 2)[0, 0]


def test_nothing_stands_about_in_an_even_picture_and_scenery_is_no_thing():
    assert standing(np.full((60, 80), 40.0)) is None
    scenery = np.full((60, 80), 40.0)
    scenery[::4] = scenery[1::4] = 160
    assert standing(scenery) is None
    assert isinstance(standing(np.where(np.arange(80) < 10, 200.0, 40.0) + np.zeros((60, 1))), StaticClutter)


@pytest.mark.parametrize(("max_clutter", "scenery"), [(0.25, False), (0.01, True)])
def test_bright_things_that_cover_more_than_max_clutter_are_scenery(max_clutter, scenery):
    ground = np.full((60, 80), 40.0)
    ground[20:30, 40:50] = 200  # a forty-eighth of the picture
    found = standing(ground, detection=replace(DETECTION, max_clutter=max_clutter))
    assert (found is None) == scenery


def test_what_lies_wholly_in_a_target_s_own_place_is_the_target():
    ground = np.full((60, 80), 40.0)
    ground[20:30, 40:50] = 200
    assert standing(ground, [38, 18, 52, 32]) is None
    ground[24, 50:] = 200  # a stalk: the target is not seen apart, so its place is left to it, the stalk beyond is not
    things = standing(ground, [38, 18, 52, 32])
    assert not things.touched(samples(ground)[:1], [[45]], [[25]], 4, 4)[0, 0]
    assert things.touched(samples(ground)[:1], [[65]], [[25]], 4, 4)[0, 0]


def test_a_rope_through_the_place_where_a_target_was_seen_to_move_stays_clutter():
    ground = np.full((60, 80), 40.0)
    ground[24:27] = 200
    here = samples(ground)[:1]
    assert standing(ground, [38, 18, 52, 32], alone=True).touched(here, [[45]], [[25]], 4, 4)[0, 0]
    assert not standing(ground, [38, 18, 52, 32]).touched(here, [[45]], [[25]], 4, 4)[0, 0]


def test_the_target_of_a_start_box_is_what_lies_nearest_to_its_middle():
    ground = np.full((100, 120), 40.0)
    ground[40:50, 50:60] = ground[40:50, 70:76] = 200
    (box,) = start_places(samples(ground)[0], np.array([[35.0, 25, 85, 75]]), DETECTION)
    assert box.tolist() == [54.5 - 19, 44.5 - 19, 54.5 + 19, 44.5 + 19]
    empty = np.array([[0.0, 60, 30, 90]])
    assert start_places(samples(ground)[0], empty, DETECTION).tolist() == empty.tolist()


def test_a_target_is_taken_out_of_the_clutter_and_what_lies_elsewhere_is_not():
    marked = np.zeros((20, 30), np.uint8)
    marked[4:8, 5:9] = marked[12:15, 20:24] = 1
    clutter = StaticClutter({0: cv2.integral(marked, sdepth=cv2.CV_32S)})
    own = np.zeros_like(marked)
    own[3:9, 4:10] = 1
    left = clutter.without(0, own).piece(0, 0, 0, 20, 30)
    assert left.sum() == 12
    assert not left[own > 0].any()
    elsewhere = np.roll(own, 10, axis=1)
    assert clutter.without(0, elsewhere) is clutter
    assert clutter.without(1, own) is clutter
