from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.calibration.camera.test_plane_camera import looking
from tests.location.one_camera.test_plane import grid, seen
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.geometry.picture_part import Picture
from vidtrack.location.cameras.run_pictures import Pictures
from vidtrack.stages.kinematics import kinematics
from vidtrack.stages.locate_plane import COLUMNS, _warnings, locate_plane

TOSS = Path(__file__).parents[2] / "../shared/real/ball-toss"


def centroids(b, **columns):
    n = len(b)
    return pd.DataFrame({"time_s": np.arange(n) / 30, "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], **columns})


def known(tilt_deg=0.0, n=20, noise=0.1):
    p = grid()[:n]
    b = seen(p, tilt_deg=tilt_deg) + np.random.default_rng(1).normal(0, noise, (n, 2))
    tags = [str(i + 1) for i in range(n)]
    return pd.DataFrame({"tag": tags, "x": p[:, 0], "y": p[:, 1], "z": 3.0, "Xf": b[:, 0], "Yf": b[:, 1]})


def test_a_scale_gives_the_table_of_mode_space_without_z():
    done = locate_plane(
        centroids(np.array([[100.0, 50.0], [np.nan, np.nan]]), flag=["", "lost"]), scale=0.14, aspect=1.25
    )
    assert list(done.trajectories) == list(COLUMNS)
    assert done.trajectories["x"][0] == pytest.approx(17.5)
    assert done.trajectories["y"][0] == pytest.approx(7.0)
    assert done.trajectories[["z", "sigma_z", "miss"]].isna().all(axis=None)
    assert done.trajectories["n_cameras"].tolist() == [1, 0]
    assert done.trajectories["flag"].tolist() == ["", "lost"]
    assert done.record["tilt_deg"] is None


def test_the_noise_of_a_centroid_becomes_that_of_the_place():
    done = locate_plane(centroids(np.full((1, 2), 100.0), sd_x=0.05, sd_y=0.02), scale=0.1, aspect=1.25)
    assert done.trajectories["sigma_x"][0] == pytest.approx(0.05 * 0.125)
    assert done.trajectories["sigma_y"][0] == pytest.approx(0.02 * 0.1)


def test_known_points_give_places_in_their_own_axes():
    new = grid(3, 3, 40, 30)
    done = locate_plane(centroids(seen(new)), points=known(), image_size=(512, 480))
    assert np.abs(done.trajectories[["x", "y"]].to_numpy() - new).max() < 0.03  # 0.1 px of 1/9 in, over 20 points
    assert done.record["model"] == "scale"
    assert done.record["scale"] == pytest.approx(1 / 9, rel=1e-3)
    assert done.record["axes"].endswith("towards the camera")
    assert done.record["warnings"] == []


def test_points_and_their_sightings_may_come_in_two_tables():
    whole = known()
    sightings = whole[["tag", "Xf", "Yf"]].iloc[::-1]
    survey = whole.drop(columns=["Xf", "Yf"]).assign(tag=whole["tag"].astype(int))
    one, two = (
        locate_plane(centroids(seen(grid())), points=p, sightings=s) for p, s in ((whole, None), (survey, sightings))
    )
    assert np.allclose(one.trajectories["x"], two.trajectories["x"], atol=1e-9)


def test_a_lean_above_three_degrees_is_told():
    done = locate_plane(centroids(seen(grid(), tilt_deg=12)), points=known(12), image_size=(512, 480), model="affine")
    assert done.record["tilt_deg"] == pytest.approx(12, abs=4)
    assert any("limit 3" in w for w in done.record["warnings"])


def test_a_lean_that_the_points_rectify_is_no_warning():
    done = locate_plane(centroids(seen(grid(), tilt_deg=12)), points=known(12), image_size=(512, 480))
    assert done.record["model"] not in ("scale", "affine")
    assert done.record["tilt_deg"] == pytest.approx(12, abs=4)
    assert done.record["warnings"] == []


def test_a_swapped_pair_of_points_is_told():
    points = known()
    points.loc[[0, 1], ["Xf", "Yf"]] = points.loc[[1, 0], ["Xf", "Yf"]].to_numpy()
    record = locate_plane(centroids(seen(grid())), points=points).record
    assert any("miss the plane" in w for w in record["warnings"])
    assert record["max_tag"] in ("1", "2")


def test_points_of_several_heights_are_no_plane():
    with pytest.raises(VidtrackError, match="no plane of one z"):
        locate_plane(centroids(seen(grid())), points=known().assign(z=np.arange(20.0)))


def test_one_point_in_view_is_refused():
    points = known()
    points.loc[1:, "Xf"] = np.nan
    with pytest.raises(VidtrackError, match="1 known points are in view"):
        locate_plane(centroids(seen(grid())), points=points)


def test_scale_and_points_exclude_each_other():
    with pytest.raises(VidtrackError, match="either scale or points"):
        locate_plane(centroids(seen(grid())))


def test_the_camera_clock_is_added():
    done = locate_plane(centroids(seen(grid())), scale=1.0, clock={"offset_s": 2.0, "rate_ppm": 0.0})
    assert done.trajectories["time_s"].iloc[0] == 2.0


@pytest.mark.skipif(not TOSS.exists(), reason="the real recordings are not here")
def test_a_ball_tossed_by_hand_falls_with_gravity():
    """Real video, tracked by hand: 0.2 px of noise, an uncalibrated camera, 66 ms from the file's own clock."""
    hand = pd.read_csv(TOSS / "hand_tracked.csv")
    table = pd.DataFrame({"time_s": hand["frame"] * 0.066, "target": "ball", "Xf": hand["Xf"], "Yf": hand["Yf"]})
    motion, _ = kinematics(locate_plane(table, scale=1 / 398.709, units="m").trajectories)
    inner = motion[~motion["flag"].str.contains("edge")]
    assert len(inner) >= 6
    assert 9.5 < inner["ay"].median() < 10.7
    assert 9.5 < motion["ay"].mean() < 10.7
    assert inner["ay"].between(9.5, 10.75).all()
    assert inner["ax"].abs().max() < 0.6


def test_a_run_at_twice_the_size_of_the_points_picture_is_converted_and_said():
    new = grid(3, 3, 40, 30)
    b = seen(new)
    pictures = {"cam1": Pictures(Picture(512, 480), Picture(1024, 960))}
    done = locate_plane(
        centroids((b + 0.5) * 2 - 0.5), points=known(), image_size=(512, 480), pictures=pictures, where="runs.r1"
    )
    assert np.abs(done.trajectories[["x", "y"]].to_numpy() - new).max() < 0.03
    assert [f["code"] for f in done.record["findings"]] == ["picture-scaled", "noise-assumed"]


def crossing():
    """Two that pass each other in the picture, exchanged by the tracker where they met; and the truth."""
    t = np.arange(240) / 30
    b = np.stack([np.stack([60 + 50 * t, 200 + 30 * np.sin(t)], -1), np.stack([460 - 50 * t, 215 + 0 * t], -1)])
    b += np.random.default_rng(0).normal(0, 0.05, b.shape)
    hidden = np.abs(b[0, :, 0] - b[1, :, 0]) < 14
    late = np.arange(240) > 120
    tracks = np.where(hidden[:, None], np.nan, np.where(late[:, None], b[::-1], b))
    tables = [
        centroids(x, flag=np.where(hidden, "merged", "")).assign(target=name)
        for x, name in zip(tracks, "ab", strict=True)
    ]
    for k, table in enumerate(tables):
        table["tracklet"] = 2 * k + late
    table = pd.concat(tables, ignore_index=True)
    return table, table.dropna(subset="Xf").assign(bound=False), b, hidden


@pytest.mark.parametrize("targets", [2, "all"])
def test_two_that_the_tracker_exchanged_where_they_met_go_on_by_their_motion(targets):
    table, tracklets, b, hidden = crossing()
    done = locate_plane(table, scale=0.1, targets=targets, tracklets=tracklets, camera="cam1")
    for k, name in enumerate("ab"):
        own = done.trajectories[done.trajectories["target"] == name]
        assert own["x"].isna().tolist() == hidden.tolist()
        assert np.nanmax(np.abs(own[["x", "y"]].to_numpy() - 0.1 * b[k])) < 1e-12
    assert {f["code"] for f in done.record["findings"]} <= {"noise-assumed"}  # the table gives no sd
    assert set(done.associations["target"]) == {"a", "b"}
    as_tracked = locate_plane(table, scale=0.1).trajectories
    assert np.nanmax(np.abs(as_tracked[as_tracked["target"] == "a"][["x", "y"]].to_numpy() - 0.1 * b[0])) > 1


def test_one_target_is_what_the_tracker_says():
    table, tracklets, _, _ = crossing()
    one = table[table["target"] == "a"]
    done = locate_plane(one, scale=0.1, targets=1, tracklets=tracklets[tracklets["target"] == "a"])
    assert done.trajectories.equals(locate_plane(one, scale=0.1).trajectories)


def test_noise_that_is_assumed_is_said_and_noise_that_is_measured_is_used():
    table = pd.DataFrame({"time_s": [0.0, 1.0], "target": "t1", "Xf": [10.0, 20.0], "Yf": [5.0, 6.0]})
    assumed = locate_plane(table, scale=2.0)
    assert [f["code"] for f in assumed.record["findings"]] == ["noise-assumed"]
    assert "100 % of the centroids" in assumed.record["findings"][0]["text"]
    measured = locate_plane(table.assign(sd_x=0.02, sd_y=0.03), scale=2.0)
    assert measured.record["findings"] == []
    assert measured.trajectories["sigma_x"].tolist() == pytest.approx([0.04, 0.04])


def test_a_plane_in_water_is_located_along_bent_light_where_that_predicts_points_better():
    """16 points, through a window 30 degrees oblique: by light the error is that of the centroids, by maps twice it."""
    camera = looking((600, -200, 1000))
    rng = np.random.default_rng(3)
    line = np.linspace(-250, 250, 4)
    p = np.stack(np.meshgrid(line, 0.7 * line, [0.0]), -1).reshape(-1, 3)
    b = project(camera, p) + rng.normal(0, 0.05, (16, 2))
    points = pd.DataFrame({"tag": [str(k) for k in range(16)], "sd_x": 0.05, "sd_y": 0.05})
    points[["x", "y", "z"]], points[["Xf", "Yf"]] = p, b
    q = np.column_stack([rng.uniform(-230, 230, 200), rng.uniform(-160, 160, 200), np.zeros(200)])
    seen_there = centroids(project(camera, q), sd_x=0.05, sd_y=0.05)
    window = {"name": "window", "point": [0, 0, 300], "normal": [0, 0, 1], "thickness": 20}
    given = {"points": points, "image_size": (640, 480), "units": "mm"}
    bent = locate_plane(seen_there, through=[window | {"indices": [1.0, 1.49, 1.333]}], **given)
    plain = locate_plane(seen_there, **given)

    def error(done):
        return np.linalg.norm(done.trajectories[["x", "y"]].to_numpy() - q[:, :2], axis=-1).mean()

    assert bent.record["model"] == "refracted"
    assert bent.record["held_out_by_model"]["refracted"] < plain.record["held_out_rms"]
    assert error(bent) < 0.7 * error(plain)
    flat = points.drop(columns="z")
    with pytest.raises(VidtrackError, match="need z, for light is bent at window"):
        locate_plane(seen_there, through=[window | {"indices": [1.0, 1.49, 1.333]}], **given | {"points": flat})


def test_known_points_on_one_line_are_said_to_be():
    record = {"model": "scale", "tilt_deg": np.nan, "chi2": 1.0, "held_out_rms": 0.1, "n_points": 9}
    assert _warnings(record | {"on_one_line": False}) == []
    (line,) = _warnings(record | {"on_one_line": True})
    assert "lie on one line" in line


def test_centroids_without_a_time_are_left_out():
    rows = centroids(seen(grid()))
    late = rows.assign(time_s=np.where(np.arange(len(rows)) == 4, np.nan, rows["time_s"]))
    done = locate_plane(late, points=known())
    assert len(done.trajectories) == len(rows) - 1
    assert np.isfinite(done.trajectories["time_s"]).all()
