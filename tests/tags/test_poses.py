"""Coded tags become the poses of bodies, from one camera and from several; what contradicts them is found."""

import numpy as np
import pytest

from tests.motion.tags import SIDE, SQUARE, errors, poses, rig, seen, z_of
from vidtrack.errors import VidtrackError
from vidtrack.tags.poses import TagOrder, pose_rows, tag_poses, trajectory_rows

FACE = SQUARE @ np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]) + [60, 0, -60]
T = 40
ORIGIN, R = poses(T=T)


def tables(n, tags, late=0.0, sd=0.03):
    """Columns of what n cameras see of tags {number: corners (4, 3)} on a body; the second camera's clock is late."""
    names = [f"tag{number}_{k}" for number in tags for k in range(1, 5)]
    sightings = seen(rig(n), np.concatenate(list(tags.values())), ORIGIN, R, sd=sd)
    out = {}
    for i, b in enumerate(sightings.b):
        time = np.repeat(np.arange(T) / 30 - late * i, len(names))
        words = {"timecode": np.full(time.size, "", object), "target": np.array(names * T, object)}
        sds = dict.fromkeys(("sd_x", "sd_y"), np.full(time.size, sd))
        columns = {"time_s": time, "flag": np.full(time.size, "", object), **words, **sds}
        out[f"cam{i + 1}"] = columns | {"Xf": b[..., 0].ravel(), "Yf": b[..., 1].ravel()}
    return out


def cameras(n):
    return {f"cam{i + 1}": (camera, None) for i, camera in enumerate(rig(n))}


def found(n, tags, size=SIDE, **order):
    return tag_poses(tables(n, tags), cameras(n), TagOrder(size, **order), where="runs.swing")


def codes(done):
    return [finding.code for finding in done.findings]


@pytest.mark.parametrize("n", [1, 2])
def test_a_tag_in_no_body_is_one_by_itself(n):
    done = found(n, {7: SQUARE})
    (table,) = pose_rows(done)
    assert table["body"] == "tag7"
    assert (table["n_cameras"] == n).all()
    assert codes(done) == []
    own = done.poses[0]
    assert 0.8 < z_of(errors(own.pose, ORIGIN, R), own.covariance) < 1.25
    good = np.array(table["flag"]) == ""
    assert good.mean() > 0.9
    assert table["sigma_roll"][good].max() < 1.0


def test_tags_on_one_body_make_one_pose():
    done = found(1, {7: SQUARE, 9: FACE}, bodies={"float": {"7": SQUARE.tolist(), "9": FACE.tolist()}})
    assert [own.name for own in done.poses] == ["float"]
    assert 0.8 < z_of(errors(done.poses[0].pose, ORIGIN, R), done.poses[0].covariance) < 1.25
    assert done.record["bodies"]["float"]["size"]["factor"] == pytest.approx(1, abs=1e-3)


def test_a_tag_that_is_on_no_body_is_reported_and_given_by_itself():
    done = found(1, {7: SQUARE, 9: FACE}, bodies={"float": {"7": SQUARE.tolist()}})
    assert [own.name for own in done.poses] == ["float", "tag9"]
    assert "tag-not-in-body" in codes(done)


def test_a_wrong_size_is_found_by_two_cameras_and_named():
    done = found(2, {7: SQUARE}, size=1.1 * SIDE)
    assert codes(done) == ["tag-size"]
    assert "measure 100 along a side, not 110" in done.findings[0].text
    assert codes(found(1, {7: SQUARE}, size=1.1 * SIDE)) == []  # one plane in one camera cannot show it


def test_a_tag_that_is_not_where_the_body_has_it_is_found():
    moved = FACE + np.array([5.0, 0, 0])
    done = found(2, {7: SQUARE, 9: FACE}, bodies={"float": {"7": SQUARE.tolist(), "9": moved.tolist()}})
    assert {"tag-misfit", "tag-size"} & set(codes(done))


def test_the_size_s_own_sigma_is_in_the_covariance():
    exact, rough = found(1, {7: SQUARE}), found(1, {7: SQUARE}, sigma=1.0)
    good = ~exact.poses[0].pose.unsure
    more = rough.poses[0].covariance[good, 5, 5] - exact.poses[0].covariance[good, 5, 5]
    np.testing.assert_allclose(np.sqrt(more), 0.01 * ORIGIN[good, 2], rtol=0.05)


def test_a_clock_that_is_late_is_corrected():
    late = tables(2, {7: SQUARE}, late=0.25)
    done = tag_poses(late, cameras(2), TagOrder(SIDE), clocks={"cam2": {"offset_s": 0.25, "rate_ppm": 0.0}})
    assert (done.poses[0].n_cameras == 2).all()
    np.testing.assert_allclose(done.poses[0].pose.origin, found(2, {7: SQUARE}).poses[0].pose.origin, atol=1e-6)


def test_other_targets_of_the_body_that_were_located_make_its_pose_surer():
    bodies, place = {"float": {"7": SQUARE.tolist()}}, [0.0, 0.0, 200.0]
    p = ORIGIN + R @ np.array(place)
    located = {"time_s": np.arange(T) / 30, "target": np.array(["bow"] * T, object)}
    located |= {axis: p[:, i] for i, axis in enumerate("xyz")} | {f"sigma_{a}": np.full(T, 0.2) for a in "xyz"}
    located["x"] = np.where(np.arange(T) < 5, np.nan, located["x"])
    order = TagOrder(SIDE, bodies=bodies, targets={"float": {"bow": place}})
    seen_by_one = tables(1, {7: SQUARE})
    alone = tag_poses(seen_by_one, cameras(1), order)
    helped = tag_poses(seen_by_one, cameras(1), order, trajectories=located)
    sigma = [np.sqrt(np.diagonal(done.poses[0].covariance, axis1=1, axis2=2)).max(1) for done in (alone, helped)]
    good = np.isfinite(sigma[0]) & np.isfinite(sigma[1])
    np.testing.assert_allclose(sigma[0][:5], sigma[1][:5])
    assert (sigma[1][5:] < 0.7 * sigma[0][5:])[good[5:]].all()
    assert 0.8 < z_of(errors(helped.poses[0].pose, ORIGIN, R), helped.poses[0].covariance) < 1.25


def test_trajectories_have_the_centre_and_the_corners():
    done = found(1, {7: SQUARE})
    tables_by_target = {rows["target"]: rows for rows in trajectory_rows(done, corners=True)}
    assert sorted(tables_by_target) == ["tag7", "tag7_1", "tag7_2", "tag7_3", "tag7_4"]
    assert [rows["target"] for rows in trajectory_rows(done, corners=False)] == ["tag7"]
    for name, place in zip(["tag7", "tag7_2"], [np.zeros(3), SQUARE[1]], strict=True):
        rows = tables_by_target[name]
        off = np.stack([rows[axis] for axis in "xyz"], -1) - (ORIGIN + R @ place)
        z = off / np.stack([rows[f"sigma_{axis}"] for axis in "xyz"], -1)
        assert 0.8 < np.sqrt(np.nanmean(z**2)) < 1.25


def test_what_no_camera_saw_is_one_clear_line():
    blank = {name: np.array([value]) for name, value in {"time_s": 0.0, "target": "t1", "Xf": 1.0, "Yf": 1.0}.items()}
    with pytest.raises(VidtrackError, match="no camera saw a coded tag"):
        tag_poses({"cam1": blank}, {"cam1": (rig(1)[0], None)}, TagOrder(SIDE))


def test_a_camera_without_calibration_is_named():
    with pytest.raises(VidtrackError, match=r"runs\.swing: camera cam2 has no calibration"):
        tag_poses(tables(2, {7: SQUARE}), cameras(1), TagOrder(SIDE), where="runs.swing")
