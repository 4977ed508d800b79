"""Coded tags become the poses of bodies, from one camera and from several; what contradicts them is found."""

import numpy as np
import pandas as pd
import pytest

from tests.motion.tags import SIDE, SQUARE, errors, poses, rig, seen, z_of
from vidtrack.errors import VidtrackError
from vidtrack.stages.tag_poses import table_of, tag_poses, trajectories_of

FACE = SQUARE @ np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]) + [60, 0, -60]
T = 40
ORIGIN, R = poses(T=T)


def tables(n, tags, late=0.0, sd=0.03):
    """What n cameras see of tags {number: corners (4, 3)} on one body; the second camera's clock is `late` s."""
    names = [f"tag{number}_{k}" for number in tags for k in range(1, 5)]
    sightings = seen(rig(n), np.concatenate(list(tags.values())), ORIGIN, R, sd=sd)
    out = {}
    for i, b in enumerate(sightings.b):
        time = np.repeat(np.arange(T) / 30 - late * i, len(names))
        columns = {"time_s": time, "timecode": "", "target": names * T, "flag": "", "sd_x": sd, "sd_y": sd}
        out[f"cam{i + 1}"] = pd.DataFrame(columns | {"Xf": b[..., 0].ravel(), "Yf": b[..., 1].ravel()})
    return out


def found(n, tags, size=SIDE, **how):
    calibrated = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(rig(n))}
    return tag_poses(tables(n, tags), calibrated, size=size, where="runs.swing", **how)


def codes(done):
    return [finding.code for finding in done.findings]


@pytest.mark.parametrize("n", [1, 2])
def test_a_tag_in_no_body_is_one_by_itself(n):
    done = found(n, {7: SQUARE})
    table = table_of(done)
    assert table["body"].unique().tolist() == ["tag7"]
    assert (table["n_cameras"] == n).all()
    assert codes(done) == []
    own = done.poses[0]
    assert 0.8 < z_of(errors(own.pose, ORIGIN, R), own.covariance) < 1.25
    good = table["flag"] == ""
    assert good.mean() > 0.9
    assert table.loc[good, "sigma_roll"].max() < 1.0


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
    calibrated = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(rig(2))}
    late = tables(2, {7: SQUARE}, late=0.25)
    done = tag_poses(late, calibrated, size=SIDE, clocks={"cam2": {"offset_s": 0.25, "rate_ppm": 0.0}})
    assert (done.poses[0].n_cameras == 2).all()
    np.testing.assert_allclose(done.poses[0].pose.origin, found(2, {7: SQUARE}).poses[0].pose.origin, atol=1e-6)


def test_trajectories_have_the_centre_and_the_corners():
    done = found(1, {7: SQUARE})
    table = trajectories_of(done, corners=True)
    assert sorted(table["target"].unique()) == ["tag7", "tag7_1", "tag7_2", "tag7_3", "tag7_4"]
    for name, place in zip(["tag7", "tag7_2"], [np.zeros(3), SQUARE[1]], strict=True):
        rows = table[table["target"] == name]
        off = rows[list("xyz")].to_numpy() - (ORIGIN + R @ place)
        z = off / rows[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
        assert 0.8 < np.sqrt(np.nanmean(z**2)) < 1.25


def test_what_no_camera_saw_is_one_clear_line():
    blank = {"cam1": pd.DataFrame({"time_s": [0.0], "target": ["t1"], "Xf": [1.0], "Yf": [1.0], "flag": [""]})}
    with pytest.raises(VidtrackError, match="no camera saw a coded tag"):
        tag_poses(blank, {"cam1": (rig(1)[0], None)}, size=SIDE)
