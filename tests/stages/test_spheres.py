"""Large and small balls, seen as ellipses: calibrated and located where they are, whatever their size."""

import numpy as np
import pandas as pd
import pytest

from tests.spheres import seen
from vidtrack.files.camera_json import Calibrated
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.calibrate import calibrate
from vidtrack.stages.locate import locate

RIG = {"image_size": (512, 480), "sensor": (8.8, 6.6), "search": False, "model": "tsai", "sigma": 1e-4}
SMALL, LARGE = 0.5, 6.0
"""in, radii of balls; they look 4 and 50 px wide."""
NOISE = 0.005


def sightings(camera, radius, rng):
    tags, p = thesis_points()
    b, pixels = seen(camera, p, radius)
    b = b + rng.normal(0, NOISE, b.shape)
    table = pd.DataFrame({"tag": tags, **dict(zip("xyz", p.T, strict=True)), "Xf": b[:, 0], "Yf": b[:, 1]})
    return table.assign(sd_x=NOISE, sd_y=NOISE, pixels=pixels)


def courses():
    t = np.arange(40) / 30
    swing = np.stack([22 * np.cos(3 * t), 20 * np.sin(4 * t), 12 * np.sin(5 * t)], -1)
    return t, swing + thesis_points()[1].mean(0)


def recorded(camera, radius, rng):
    t, p = courses()
    b, pixels = seen(camera, p, radius)
    b = b + rng.normal(0, NOISE, b.shape)
    rows = {"time_s": t, "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], "sd_x": NOISE, "sd_y": NOISE, "flag": ""}
    return pd.DataFrame(rows | {"pixels": pixels})


def error(cameras, radius, drop=(), record=None):
    """The mean distance, in, of located balls of this radius from where they are, and the record."""
    rng = np.random.default_rng(5)
    tables = {c.name: recorded(c, radius, rng).drop(columns=list(drop)) for c in thesis_rig(2)}
    given = {n: (c, None) if record is None else Calibrated(c, None, record) for n, c in cameras.items()}
    found = locate(tables, given, targets=1, clocks={name: {} for name in tables})
    return np.linalg.norm(found.trajectories[["x", "y", "z"]].to_numpy() - courses()[1], axis=1).mean(), found.record


def cameras_of(radius):
    rng = np.random.default_rng(4)
    return {c.name: calibrate(sightings(c, radius, rng), **RIG) for c in thesis_rig(2)}


def test_a_calibration_by_large_balls_is_that_of_their_middles():
    done, truth = cameras_of(LARGE)["cam1"], thesis_rig(2)[0]
    p = thesis_points()[1]
    outlines = seen(truth, p, LARGE).b
    assert np.abs(outlines - project(truth, p)).max() > 0.1
    np.testing.assert_allclose(project(done.camera, p), project(truth, p), atol=4 * NOISE)
    table, record = done.points, done.record["perspective"]
    np.testing.assert_allclose(table[["Xf", "Yf"]], project(truth, p), atol=5 * NOISE)
    off = table[["outline_x", "outline_y"]].to_numpy()
    np.testing.assert_allclose(table[["Xf", "Yf"]] + off, outlines, atol=5 * NOISE)
    assert record["balls"] == 64
    assert record["largest_px"] == pytest.approx(np.hypot(*off.T).max())


def test_points_without_sizes_are_not_touched():
    tables = [sightings(thesis_rig(1)[0], LARGE, np.random.default_rng(4)) for _ in range(3)]
    without, none = tables[0].drop(columns="pixels"), tables[1].assign(pixels=0)
    one, other = calibrate(without, **RIG), calibrate(none, **RIG)
    assert one.camera.f == other.camera.f
    assert "perspective" not in one.record
    np.testing.assert_array_equal(one.points[["Xf", "Yf"]], without[["Xf", "Yf"]])
    assert calibrate(tables[2], **RIG).camera.f != one.camera.f


@pytest.mark.parametrize(("before", "after"), [(SMALL, LARGE), (LARGE, SMALL), (LARGE, LARGE)])
def test_balls_of_any_size_are_located_where_they_are(before, after):
    cameras = {name: done.camera for name, done in cameras_of(before).items()}
    off, record = error(cameras, after)
    assert off < 0.003
    assert {"points"} == {own["describes"] for own in record["perspective"].values()}
    assert all("perspective" not in f["code"] or f["level"] == "note" for f in record["findings"])
    if before != after:  # as it was without sizes
        rng = np.random.default_rng(4)
        tables = {c.name: sightings(c, before, rng).drop(columns="pixels") for c in thesis_rig(2)}
        plain = {name: calibrate(table, **RIG).camera for name, table in tables.items()}
        assert error(plain, after, drop=["pixels"])[0] > 5 * off


def test_a_calibration_of_an_older_version_is_used_as_it_was_made_and_that_is_said():
    rng = np.random.default_rng(4)
    made = {c.name: calibrate(sightings(c, SMALL, rng).drop(columns="pixels"), **RIG).camera for c in thesis_rig(2)}
    found = {}
    for radius in (SMALL, LARGE):
        off, record = error(made, radius, record={"n_points": 64})
        plain = error(made, radius, drop=["pixels"])[0]
        assert off == pytest.approx(plain)
        found[radius] = [f for f in record["findings"] if f["code"] == "perspective-of-balls"]
    assert found[SMALL] == []
    assert [f["level"] for f in found[LARGE]] == ["doubtful"]
