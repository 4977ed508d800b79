"""Pictures that were lost and whose loss the time stamps hide are found by the epipolar lines."""

from dataclasses import replace

import numpy as np
import pytest

from tests.stages.test_locate import centroids, other, pluck
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.location.clocks.hidden_losses import LOSSES, cheapest
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate


def without(table, lost):
    """The table of a camera that lost these pictures, and stamped the others evenly."""
    t = np.unique(table["time_s"])
    kept = np.delete(t, lost)
    return table[table["time_s"].isin(kept)].assign(
        time_s=lambda own: own["time_s"].map(dict(zip(kept, t, strict=False)))
    )


def findings(count=2, lost=(), camera="cam2", turned=0.0):
    rng = np.random.default_rng(8)
    cameras = thesis_rig(count)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng) for c in cameras}
    tables[camera] = without(tables[camera], list(lost))
    if turned:
        own = cameras[1]
        cameras[1] = replace(own, R=rotation_from_vector([turned, turned, 0.0]) @ own.R)
    return locate(tables, {c.name: (c, None) for c in cameras}, targets=["t1", "t2"]).record["findings"]


def scattered(n=240, share=0.1):
    return np.flatnonzero(np.random.default_rng(5).random(n) < share)[1:].tolist()


def test_the_cheapest_way_counts_each_loss_where_it_was():
    """By hand: nothing lost before sample 4, two pictures there, one more before sample 7."""
    late = np.array([0, 0, 0, 0, 2, 2, 2, 3, 3, 3])
    cost = (np.arange(6) - late[:, None]) ** 2 * 4.0
    np.testing.assert_array_equal(cheapest(cost), late)
    flat = np.full((10, 6), LOSSES.unknown)
    np.testing.assert_array_equal(cheapest(flat), 0)


@pytest.mark.parametrize(
    ("count", "camera", "level"), [(2, "cam1", "bad"), (2, "cam2", "bad"), (3, "cam2", "doubtful")]
)
def test_lost_pictures_are_named_with_their_share(count, camera, level):
    lost = scattered()
    (finding,) = [f for f in findings(count, lost, camera) if f["code"] == "losses-hidden"]
    assert finding["level"] == level
    assert finding["text"].startswith(f"{camera}: some ")
    said = float(finding["text"].split("some ")[1].split("%")[0])
    assert said == pytest.approx(100 * len(lost) / 240, abs=2.0)
    assert not [f for f in findings(count, lost, camera) if "Neither one late clock" in f["cure"]]


def test_one_picture_is_named_where_two_other_cameras_agree_on_it():
    (finding,) = [f for f in findings(3, [100, 101, 102]) if f["code"] == "losses-hidden"]
    assert ", at " in finding["text"]


def test_nothing_lost_and_a_turned_camera_are_no_losses():
    for count in (2, 3):
        assert not [f for f in findings(count) if f["code"] == "losses-hidden"]
        assert not [f for f in findings(count, turned=0.02) if f["code"] == "losses-hidden"]
