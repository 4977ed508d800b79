"""The widths of targets are collected at samples that are spread over the recording."""

import numpy as np
import pytest

from tests.tracking.outlines.test_apparent_width import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.outlines.ball_widths import LOOKS, BallWidths
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MEASURED, PIXELS, X, Y

SEEN = np.clip(picture((30.3, 22.6), 9.3), 0, 255).astype(np.uint8)


def passed(widths, first, count, *, dark=False, **sample):
    values = np.full((MEASURED, count, 2), np.nan)
    values[X, :, 0], values[Y, :, 0], values[PIXELS, :, 0] = 30.3, 22.6, 68
    luma = 255 - SEEN if dark else SEEN
    widths.passed([Sample(luma, float(first + j), **sample) for j in range(count)], first, values)


def test_each_target_has_the_moments_at_which_its_width_is_known():
    widths = BallWidths(2, Detection())
    passed(widths, 0, 3)
    record = widths.as_record(["t1", "t2"], np.array([10.0, 10.5, 11.0]))
    assert record["t1"]["time_s"] == [10.0, 10.5, 11.0]
    assert record["t1"]["width"] == pytest.approx([9.3] * 3, rel=0.02)
    assert (record["t1"]["Xf"][0], record["t1"]["Yf"][0]) == (30.3, 22.6)
    assert record["t2"] == {"time_s": [], "Xf": [], "Yf": [], "width": []}


def test_dark_targets_have_the_same_width():
    bright, dark = BallWidths(2, Detection()), BallWidths(2, Detection(dark=True))
    passed(bright, 0, 1)
    passed(dark, 0, 1, dark=True)
    assert dark.as_record(["t1"], np.zeros(1)) == bright.as_record(["t1"], np.zeros(1))


def test_a_long_recording_is_looked_at_evenly_and_not_more_often():
    widths = BallWidths(2, Detection())
    for first in range(0, 1000, 4):
        passed(widths, first, 4)
    moments = widths.as_record(["t1"], np.arange(1000.0))["t1"]["time_s"]
    assert LOOKS.samples / 2 <= len(moments) < 2 * LOOKS.samples
    assert len(set(np.diff(moments))) == 1
    assert moments[-1] > 900


def test_damaged_and_repeated_pictures_show_nothing():
    widths = BallWidths(2, Detection())
    passed(widths, 0, 2, corrupt=True)
    passed(widths, 2, 2, repeated=True)
    assert widths.as_record(["t1"], np.zeros(4))["t1"]["width"] == []


def test_of_many_targets_some_are_looked_at():
    widths = BallWidths(200, Detection())
    values = np.full((MEASURED, 1, 200), np.nan)
    values[X], values[Y], values[PIXELS] = 30.3, 22.6, 68
    widths.passed([Sample(SEEN, 0.0)], 0, values)
    record = widths.as_record([f"t{k}" for k in range(200)], np.zeros(1))
    assert len(record) == LOOKS.targets
    assert {"t0", "t199"} <= set(record)


def test_a_picture_of_ten_bits_shows_the_same_width():
    """What is saturated, and how flat the background is, is known in grey levels of eight bits."""
    usual, deep = BallWidths(2, Detection()), BallWidths(2, Detection(scale=255 / 1023, full=1023.0))
    values = np.full((MEASURED, 1, 2), np.nan)
    values[X], values[Y], values[PIXELS] = 30.3, 22.6, 68
    usual.passed([Sample(SEEN, 0.0)], 0, values)
    deep.passed([Sample((SEEN * (1023 / 255)).round().astype(np.uint16), 0.0)], 0, values)
    a, b = (widths.as_record(["t1"], np.zeros(1))["t1"]["width"] for widths in (usual, deep))
    assert a
    assert b == pytest.approx(a, rel=1e-3)


def test_of_many_targets_fewer_samples_are_looked_at():
    widths, values = BallWidths(200, Detection()), np.full((MEASURED, 1, 200), np.nan)
    values[X], values[Y], values[PIXELS] = 30.3, 22.6, 68
    for number in range(200):
        widths.passed([Sample(SEEN, float(number))], number, values)
    looks = len(widths.as_record(["t0"], np.arange(200.0))["t0"]["time_s"])
    assert LOOKS.in_all / 2 <= looks * LOOKS.targets < 2 * LOOKS.in_all
    assert looks < 2 * LOOKS.samples


def two_at(apart):
    values = np.full((MEASURED, 3, 2), np.nan)
    values[X], values[Y], values[PIXELS] = [30.3, 30.3 + apart], 22.6, 68
    return values


def test_a_ball_beside_another_shows_nothing_of_how_it_is_lit():
    """Two that touch look like one that is lit from the side."""
    for apart, pieces in ((12.0, 0), (20.0, 3)):
        widths = BallWidths(2, Detection())
        widths.passed([Sample(SEEN, float(j)) for j in range(3)], 0, two_at(apart))
        alone = np.full((MEASURED, 3, 2), np.nan)
        assert len(widths.pieces(alone, 1)[0]) == pieces


def test_what_two_showed_as_long_as_they_were_taken_for_one_is_left_out():
    widths = BallWidths(2, Detection())
    passed(widths, 0, 3)
    found = widths.pieces(two_at(60.0)[:, :, :1], 1)
    assert [len(own) for own in found] == [3]
    later = two_at(12.0)
    later[:, 2, 1] = np.nan
    assert [piece.sample for piece in widths.pieces(later, 1)[0]] == [2]
