"""Balls of a run moved to where their middles are seen."""

import numpy as np
import pytest

from vidtrack.geometry.ball_perspective import SHARE, outline_offset
from vidtrack.location.cameras.ball_middles import (
    AtMiddles,
    BallSizes,
    ball_sizes_seen,
    larger_than_pixels,
    moved_columns,
    perspective_findings,
    sd_in_a_plane,
    sd_of_flat,
)
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]


def columns(pixels, flag=None, target="t1", **more):
    n = len(pixels)
    return {
        "time_s": np.arange(n) / 30,
        "target": np.full(n, target, object),
        "Xf": np.linspace(40, 500, n),
        "Yf": np.full(n, 60.0),
        "sd_x": np.full(n, 0.01),
        "sd_y": np.full(n, 0.01),
        "pixels": np.asarray(pixels, float),
        "flag": np.array(flag or [""] * n, object),
        **more,
    }


def test_a_ball_is_moved_by_the_offset_of_its_radius_and_its_sd_holds_a_share_of_that():
    own = columns([700.0] * 4)
    b, radius = np.stack([own["Xf"], own["Yf"]], -1), np.sqrt(700 / np.pi)
    moved, offset = moved_columns(own, CAMERA, AtMiddles(), {})
    np.testing.assert_allclose(offset, outline_offset(CAMERA, b, radius))
    np.testing.assert_allclose(moved["Xf"], own["Xf"] - offset[:, 0])
    np.testing.assert_allclose(moved["Yf"], own["Yf"] - offset[:, 1])
    np.testing.assert_allclose(moved["sd_x"], np.hypot(0.01, SHARE * offset[:, 0]))
    assert np.abs(offset).max() > 0.02
    assert own["Xf"][0] == 40.0


def test_a_part_of_a_ball_has_the_radius_of_its_neighbours():
    whole = moved_columns(columns([600, 600, 600, 600, 600]), CAMERA, AtMiddles(), {})[1]
    hidden = columns([600, 600, 90, 600, 600], ["", "recovered", "merged", "", "saturated"])
    np.testing.assert_allclose(moved_columns(hidden, CAMERA, AtMiddles(), {})[1], whole)
    only = columns([600, 600, 600, 600, 600], ["merged"] * 5)  # nothing better is known of it
    np.testing.assert_allclose(moved_columns(only, CAMERA, AtMiddles(), {})[1], whole)


def test_rows_of_two_tracks_do_not_mix():
    one, two = columns([600] * 3), columns([90, 90, 90], ["", "merged", ""], target="t2")
    both = {name: np.concatenate([one[name], two[name]]) for name in one}
    own = moved_columns(both, CAMERA, AtMiddles(), {})[1]
    np.testing.assert_allclose(own[:3], moved_columns(one, CAMERA, AtMiddles(), {})[1])
    np.testing.assert_allclose(own[3:], moved_columns(two, CAMERA, AtMiddles(), {})[1])


def test_a_field_has_half_of_the_lines():
    frames = moved_columns(columns([600] * 3), CAMERA, AtMiddles(), {})[1]
    fields = columns([300] * 3, field=np.array(["top", "bottom", "top"], object))
    np.testing.assert_allclose(moved_columns(fields, CAMERA, AtMiddles(), {})[1], frames)


def test_how_wide_a_track_looks_goes_before_its_pixels():
    own = columns([600.0] * 4)
    wide = 2 * np.sqrt(600 / np.pi)
    looks = {"t1": {"time_s": own["time_s"][[0, 2]].tolist(), "width": [1.1 * wide] * 2}}
    larger = larger_than_pixels(own, looks)
    assert larger == {"t1": pytest.approx(1.1)}
    plain, wider = (moved_columns(own, CAMERA, AtMiddles(), by)[1] for by in ({}, larger))
    np.testing.assert_allclose(wider, 1.21 * plain, rtol=1e-3)
    other = moved_columns(columns([600.0] * 4, target="t2"), CAMERA, AtMiddles(), larger)[1]
    np.testing.assert_allclose(other, wider)  # of a track that was not looked at, as others are
    assert larger_than_pixels(own, {"t1": {"time_s": [9.0], "width": [wide]}}) == {}
    assert larger_than_pixels(own, {"t1": {"time_s": [0.0], "width": [9 * wide]}}) == {"t1": 1.5}


def test_a_table_without_sizes_is_as_it_was():
    own = columns([np.nan] * 4)
    same, offset = moved_columns(own, CAMERA, AtMiddles(), {})
    assert not offset.any()
    assert (same["Xf"] == own["Xf"]).all()
    assert (same["sd_x"] == own["sd_x"]).all()
    without = {name: column for name, column in own.items() if name != "pixels"}
    assert not moved_columns(without, CAMERA, AtMiddles(), {})[1].any()
    assert larger_than_pixels(without, {"t1": {"time_s": [0.0], "width": [9.0]}}) == {}


def test_inwards_and_outwards_are_inverse_but_for_what_is_too_small():
    how, b = AtMiddles(), np.array([[30.0, 40.0], [600.0, 450.0]])
    there = how.outwards(CAMERA, b, 20.0)
    assert np.abs(there - b).max() > 0.05
    np.testing.assert_allclose(how.inwards(CAMERA, there, 20.0), b, atol=1e-3)


def test_what_was_taken_off_is_said_where_it_is_much_and_no_sooner():
    seen = {"cam1": BallSizes(20.0, 0.3, "points"), "cam2": BallSizes(3.0, 0.004, "points")}
    (said,) = perspective_findings(seen, "run")
    assert said.level == "note"
    assert said.code == "perspective-of-balls"
    assert "0.30 px" in said.text
    assert perspective_findings({"cam2": seen["cam2"]}, "run") == []


def test_a_calibration_by_outlines_is_used_by_outlines_and_that_is_said():
    own = columns([1200.0] * 4)
    sizes = ball_sizes_seen(own, CAMERA, "outlines", None)
    assert sizes.radius_px == pytest.approx(np.sqrt(1200 / np.pi))
    assert sizes.largest_px > 0.05
    (said,) = perspective_findings({"cam1": sizes}, "run")
    assert said.level == "doubtful"
    assert "cam1" in said.text
    assert "older version" in said.text
    small = ball_sizes_seen(columns([20.0] * 4), CAMERA, "outlines", None)
    assert perspective_findings({"cam1": small}, "run") == []


def test_in_a_plane_the_sd_grows_by_what_its_map_cannot_know():
    own = columns([np.pi * 20.0**2] * 4)
    wider = sd_in_a_plane(own, (641, 481), 5.0)
    share = (20.0**2 - 5.0**2) / 641**2
    np.testing.assert_allclose(wider["sd_x"], np.hypot(0.01, share * (own["Xf"] - 320)))
    np.testing.assert_allclose(wider["sd_y"], np.hypot(0.01, share * (own["Yf"] - 240)))
    alike = sd_in_a_plane(own, (641, 481), 20.0)  # the map takes it up
    np.testing.assert_allclose(alike["sd_x"], 0.01)
    without = {name: column for name, column in own.items() if name != "pixels"}
    assert sd_in_a_plane(without, (641, 481), 5.0) == {}


@pytest.mark.parametrize("angle", [0.3, 0.8, 1.2])
def test_the_outline_of_a_tilted_disc_has_its_middle_aside_by_no_more_than_the_sd_of_flat_targets_expects(angle):
    """Points of the disc's edge, projected: its middle is off by R^2 / f sin(a) cos(a)."""
    f, far, edge = 900.0, 160.0, 3.0
    turn = np.linspace(0, 2 * np.pi, 721)[:-1]
    y = f * edge * np.sin(turn) * np.cos(angle) / (far + edge * np.sin(turn) * np.sin(angle))
    off = (y.max() + y.min()) / 2
    assert abs(off) == pytest.approx((f * edge / far) ** 2 / f * np.sin(angle) * np.cos(angle), rel=0.01)
    assert abs(off) < 2 * 0.35 * (f * edge / far) ** 2 / f


def test_flat_targets_stay_and_their_sd_holds_how_they_may_be_turned():
    own = columns([100.0, 1200.0])
    flat = sd_of_flat(own, CAMERA, {})
    np.testing.assert_array_equal(flat["Xf"], own["Xf"])
    more = 0.35 * np.array([100.0, 1200.0]) / np.pi * CAMERA.dx / CAMERA.f
    np.testing.assert_allclose(flat["sd_y"], np.hypot(0.01, more))
    assert more[1] > 0.1
    assert own["sd_y"][1] == 0.01
    bare = {name: own[name] for name in ("time_s", "target", "Xf", "Yf")}
    assert sd_of_flat(bare, CAMERA, {}) == bare
