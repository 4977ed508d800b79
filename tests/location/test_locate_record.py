"""The record of a located run says what was used, by whom, and what is left over."""

import json

import numpy as np
import pytest

from tests.location.test_matching import CAMERAS, scene
from vidtrack.files.records import plain
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.cameras.views import brought
from vidtrack.location.clocks.motion_clock import Clocks
from vidtrack.location.clocks.run_clocks import RunClocks
from vidtrack.location.locate_record import (
    clock_record,
    match_record,
    noise_record,
    sample_record,
    sight_line_record,
    volume_record,
)
from vidtrack.location.matching import matched
from vidtrack.location.sight_lines.centroid_noise import Noise
from vidtrack.location.sight_lines.sight_causes import Cause
from vidtrack.location.sight_lines.sight_misses import Misses
from vidtrack.timing.agreement import Timing
from vidtrack.timing.clock import Clock


@pytest.fixture(scope="module")
def located():
    views = scene()
    views[1].b[2, :40] = np.nan
    views[1].piece[2, :40] = -1
    seen = [brought(v, v.t, v.t) for v in views]
    match = matched(views, seen, ["a", "b", "c"], 3, 3.0, [])
    return views, match, locate_points(CAMERAS, np.stack([v.b for v in views]), sd=0.1)


def test_each_target_says_its_tracks_and_when_it_is_located(located):
    views, match, found = located
    record = match_record(views, match, found, views[0].t, 3.0)
    assert record["targets"]["b"]["tracks"] == {"cam1": ["b"], "cam2": ["b"]}
    assert record["targets"]["a"]["start_s"] == views[0].t[0]
    assert record["targets"]["c"]["start_s"] == pytest.approx(views[0].t[40])
    assert record["targets"]["c"]["end_s"] == views[0].t[-1]
    assert record["targets"]["a"]["odds"] is None  # names are no odds
    assert record["bias_px"] is None
    assert record["unmatched"] == record["left_over"] == {}
    # 128 in over 480 or 512 px at the thesis's rig, the target in the middle
    assert record["world_per_px"] == pytest.approx(0.2, rel=0.15)
    assert record["tolerance"] == pytest.approx(3 * record["world_per_px"])
    json.dumps(plain(record), allow_nan=False)


def test_odds_are_said_up_to_where_they_are_as_good_as_certain(located):
    views, match, found = located
    odds = [
        match_record(views, match._replace(lead=np.full(3, lead)), found, views[0].t, 3.0)["targets"]["a"]["odds"]
        for lead in (np.log(1000.0), 500.0)
    ]
    assert odds == [pytest.approx(1000), pytest.approx(1e12)]


def test_a_track_of_no_target_is_unmatched_and_its_pieces_are_left_over_with_the_reason(located):
    views, match, found = located
    own = match.trajectory[1].copy()
    own[1] = -1
    reason = match.reason[1].copy()
    reason[1] = "alone"
    lost = match._replace(trajectory=(match.trajectory[0], own), reason=(match.reason[0], reason))
    record = match_record(views, lost, found, views[0].t, 3.0)
    assert record["unmatched"] == {"cam2": ["b"]}
    (left,) = record["left_over"]["cam2"]
    t = views[1].t[np.isfinite(views[1].b[1, :, 0])]
    assert left == {"track": "b", "start_s": t[0], "end_s": t[-1], "samples": t.size, "reason": "alone"}


def test_a_contested_piece_makes_its_target_ambiguous_and_no_other(located):
    views, match, found = located
    piece = views[1].piece.copy()
    piece[0, 50:] = np.where(piece[0, 50:] >= 0, 3, -1)
    cut = [views[0], views[1]._replace(piece=piece, number=np.arange(4), bound=np.zeros(4, bool))]
    reason = np.array(["", "", "", "contested"], object)
    open_ = match._replace(trajectory=(match.trajectory[0], np.array([0, 1, 2, -1])), reason=(match.reason[0], reason))
    record = match_record(cut, open_, found, views[0].t, 3.0)
    assert [record["targets"][k]["ambiguous"] for k in "abc"] == [True, False, False]


def test_samples_are_counted_by_their_cameras(located):
    views, _, found = located
    record = sample_record(views, found, views[0].t)
    n = found.n_cameras.size
    assert record["n"] == n
    assert record["by_n_cameras"]["2"] == record["located"] == int(np.isfinite(found.point[..., 0]).sum())
    assert record["by_n_cameras"]["0"] == n - record["located"]
    assert record["left_out"] == {"cam1": 0, "cam2": 0}
    assert record["mean_miss"] == pytest.approx(np.nanmean(found.miss))
    assert record["mean_miss_where_disagreed"] is None
    np.testing.assert_allclose(record["mean_sigma"], np.nanmean(found.sigma, (0, 1)))


def test_nothing_located_is_a_record_without_means(located):
    views = located[0]
    none = locate_points(CAMERAS, np.full((2, 4, 2), np.nan), sd=0.1)
    record = sample_record(views, none, np.arange(4.0))
    assert (record["located"], record["mean_miss"], record["mean_sigma"]) == (0, None, None)
    assert record["by_n_cameras"] == {"0": 4}


def test_noise_says_its_source_and_the_reprojection_errors(located):
    views, _, found = located
    sd = np.stack([v.sd for v in views])
    alike = np.ones(sd.shape[:2])
    record = noise_record(views, found, sd, Noise(1.0, "none", alike, alike))
    assert record["source"] == "tracker"
    assert record["sd_px"] == {"cam1": 0.1, "cam2": 0.1}
    # of 4 coordinates of two cameras 3 go into the point
    rms = np.sqrt(np.mean(np.square(list(record["reprojection_rms_px"].values()))))
    assert rms == pytest.approx(0.1 / 2, rel=0.15)
    assert noise_record(views, found, sd, Noise(2.0, "errors", 2.0 * alike, 2.0 * alike))["source"].startswith(
        "tracker, scaled"
    )
    unsaid = [v._replace(has_sd=False) for v in views]
    kinds = ("differences", "errors", "none")
    sources = [noise_record(unsaid, found, sd, Noise(1.0, kind, alike, alike))["source"] for kind in kinds]
    assert sources == ["reprojection", "reprojection errors of few samples", "assumed"]


def test_lines_of_sight_name_their_cameras(located):
    views = located[0]
    cause = Cause("late", (1,), 0.02, 0.001, 0.9, 300.0, 5.0)
    record = sight_line_record(
        views,
        Misses(50, np.array([0.1, 0.4]), np.array([0.1, 0.1]), 3.0, cause, np.zeros((2, 2)), 40.0, np.zeros((2, 2))),
    )
    assert record["px"] == {"cam1": 0.1, "cam2": 0.4}
    assert record["cause"]["cameras"] == ["cam2"]
    assert record["cause"]["units"] == "s"
    turned = sight_line_record(
        views,
        Misses(
            50, np.ones(2), np.ones(2), 3.0, cause._replace(kind="turned"), np.zeros((2, 2)), 40.0, np.zeros((2, 2))
        ),
    )
    assert turned["cause"]["units"] == "deg"
    assert sight_line_record(views, None) is None


def test_the_volume_says_the_share_outside_and_the_farthest():
    record = volume_record(np.array([-1.0, 0.0, 2.0, np.nan, 4.0]), "in")
    assert record == {"share_outside": 0.5, "farthest_outside": 4.0, "units": "in"}
    assert volume_record(np.array([np.nan]), "in") is None
    assert volume_record(None, "in") is None


def test_a_given_clock_is_the_config_s_and_an_estimated_one_has_its_interval(located):
    views = located[0]
    C = np.diag([0.002**2, 5.0**2])
    timing = Timing(Clock(0.1, 3.0), C)
    motion = Clocks(
        (Clock(), Clock(0.1, 3.0)),
        (Clock(), Clock(0.002, 5.0)),
        np.stack([np.zeros((2, 2)), C]),
        0.2,
        1.5,
        np.array([-0.1, 0.0, 0.1]),
        np.array([[np.nan] * 3, [2.0, 0.2, 2.0]]),
        (False, True),
    )
    timed = RunClocks(
        (Clock(), Clock(0.1, 3.0)),
        np.stack([np.zeros((2, 2)), C]),
        ({}, {"motion": timing, "sound": timing}),
        ((), ("motion",)),
        motion,
        1.5,
    )
    record = clock_record(views, ["auto", "auto"], timed)
    first, second = record["cameras"].values()
    assert first["source"] == "reference"
    assert second["source"] == "motion"
    assert second["offset_s_95"] == pytest.approx([0.1 - 1.96 * 0.002, 0.1 + 1.96 * 0.002])
    assert second["rate_ppm_95"] == pytest.approx([3 - 1.96 * 5, 3 + 1.96 * 5])
    assert second["ambiguous"]
    assert [second["witnesses"][w]["used"] for w in ("motion", "sound")] == [True, False]
    assert second["offsets_s"] == pytest.approx([0.0, 0.1, 0.2])
    assert "offsets_s" not in first
    assert (record["error_px"], record["error_before_px"]) == (0.2, 1.5)
    given = clock_record(views, [Clock(), Clock(0.1, 3.0)], timed._replace(motion=None))
    assert [c["source"] for c in given["cameras"].values()] == ["config", "config"]
    assert "error_px" not in given


def test_what_a_camera_that_is_left_out_misses_is_recorded_with_when(located):
    views, _, found = located
    at = np.arange(found.point.shape[1]) / 30
    out = np.zeros(found.left_out.shape, bool)
    out[1, 0, 10:20] = True
    error = found.error.copy()
    error[1, 0, 10:20] = [3.0, 4.0]
    where = sample_record(views, found._replace(left_out=out, error=error), at)["left_out_where"]
    assert where == {"cam2": {"px": pytest.approx(5.0), "from_s": at[10], "to_s": at[19]}}
