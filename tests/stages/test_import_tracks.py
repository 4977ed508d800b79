from fractions import Fraction

import numpy as np
import pytest

from tests.stages.test_track import path, recorded
from vidtrack.association.tracklets import COLUMNS
from vidtrack.errors import VidtrackError
from vidtrack.stages.import_tracks import import_tracks
from vidtrack.stages.track import track
from vidtrack.timing.timebase import time_base
from vidtrack.timing.timecode import parse

RATE = Fraction(30000, 1001)


def swinging(k=300, n=2, noise=0.1, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(k)[:, None] / 30
    x = 300 + 50 * np.cos(2 * np.pi * 0.9 * t + np.arange(n))
    y = 200 + 30 * np.sin(2 * np.pi * 0.5 * t + np.arange(n))
    return np.stack([x, y], -1) + rng.normal(0, noise, (k, n, 2))


@pytest.mark.parametrize("noise", [0.05, 0.3])
def test_the_sd_of_digitised_positions_is_that_of_their_errors(noise):
    done = import_tracks(["a", "b"], np.arange(300), swinging(noise=noise), time_base(RATE), named=True)
    assert done.centroids[["sd_x", "sd_y"]].to_numpy() == pytest.approx(noise, rel=0.2)
    assert [finding.code for finding in done.findings] == ["sd-estimated"]


def test_positions_in_whole_pixels_have_at_least_the_sd_of_their_rounding():
    done = import_tracks(["a"], np.arange(300), np.rint(swinging(n=1, noise=0)), time_base(RATE), named=True)
    assert (done.centroids[["sd_x", "sd_y"]].to_numpy() >= 12**-0.5).all()


def test_a_track_that_was_smoothed_before_is_a_doubt():
    done = import_tracks(["a"], np.arange(300), swinging(n=1, noise=0), time_base(RATE), named=True)
    assert [finding.level for finding in done.findings] == ["doubtful"]
    assert "smoothed" in done.findings[0].text


def test_the_sd_that_the_config_gives_is_used_and_a_track_too_short_to_show_one_asks_for_it():
    done = import_tracks(["a", "b"], np.arange(4), swinging(4), time_base(RATE), named=True, sd=0.4)
    assert (done.centroids[["sd_x", "sd_y"]].to_numpy() == 0.4).all()
    with pytest.raises(VidtrackError, match=r"config.yaml: runs\.a\.detect\.sd: "):
        import_tracks(["a", "b"], np.arange(4), swinging(4), time_base(RATE), named=True, where="runs.a")


def test_tables_have_the_columns_of_a_tracked_recording():
    tracked = track(*recorded(path(1), 12), targets=1)
    done = import_tracks(["a"], np.arange(30), swinging(30, 1), time_base(RATE), named=True)
    assert list(done.centroids) == list(tracked.centroids)
    assert list(done.tracklets) == list(COLUMNS)
    kinds = [{name: kind.kind for name, kind in table.dtypes.items()} for table in (done.centroids, tracked.centroids)]
    assert kinds[0] == kinds[1]


def test_times_are_those_of_the_frames_numbers_and_of_the_time_code():
    clock = time_base(RATE, parse("10:00:55:00", RATE), source="config")
    done = import_tracks(["a"], [0, 3, 30, 33, 36, 39, 42, 45, 48, 51], swinging(10, 1), clock, named=True, sd=0.1)
    seconds = done.centroids["time_s"].to_numpy()
    assert seconds[0] == 36055.0
    assert seconds[2] - seconds[0] == pytest.approx(30 * 1001 / 30000, abs=1e-9)
    assert done.centroids["timecode"].tolist()[:3] == ["10:00:55:00", "10:00:55:03", "10:00:56:00"]


def test_what_was_not_found_is_nan_and_lost_and_ends_its_tracklet():
    b = swinging(60)
    b[20:40, 0] = np.nan
    done = import_tracks(["a", "b"], np.arange(60), b, time_base(RATE), named=True, sd=0.1)
    own = done.centroids[done.centroids["target"] == "a"]
    assert (own["flag"] == "lost").to_numpy().nonzero()[0].tolist() == list(range(20, 40))
    assert own.loc[own["flag"] == "lost", ["Xf", "Yf", "sd_x", "sd_y"]].isna().all(axis=None)
    assert done.tracklets.loc[done.tracklets["target"] == "a", "tracklet"].nunique() == 2
    assert done.record["targets"]["a"]["flags"] == {"lost": pytest.approx(1 / 3)}


def test_names_of_one_camera_only_are_told_from_those_of_another():
    done = import_tracks(["p0"], np.arange(60), swinging(60, 1), time_base(RATE), named=False, camera="cam1")
    assert set(done.centroids["target"]) == {"cam1-p0"}
    assert not done.tracklets["bound"].any()


def test_a_target_without_any_position_is_reported():
    b = swinging(60)
    b[:, 1] = np.nan
    done = import_tracks(["a", "b"], np.arange(60), b, time_base(RATE), named=True, sd=0.1)
    assert [finding.code for finding in done.findings] == ["target-never-digitised"]
