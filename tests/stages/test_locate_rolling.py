"""Rendered truth: 30 ms of read-out at a metre a second, with and without `readout_ms`."""

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from vidtrack.location.clocks.readout_search import sought_readouts
from vidtrack.simulate.picture import Picture, empty_scene
from vidtrack.simulate.recording import Actor, Shutter, frames
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate
from vidtrack.timing.readout import Readout
from vidtrack.tracking.detection.blobs import find_blobs

READOUT = 0.030
AT = np.arange(60) / 30
SPEED = 39.37  # in/s: a metre a second


def path(t):
    """A circle in a plane across the cameras' view, at that speed."""
    angle = SPEED / 12 * np.asarray(t)
    return np.stack([12 * np.cos(angle), 2 * np.sin(angle), 12 * np.sin(angle)], -1)


@pytest.fixture(scope="module")
def run():
    cameras = thesis_rig(3)
    picture = Picture(noise=1.0)
    tables = {}
    for camera, seconds in zip(cameras, (READOUT, 0.0, READOUT), strict=True):
        film = frames(
            camera,
            empty_scene(picture, camera.image_size),
            [Actor(path, 1.0, 220.0)],
            AT,
            picture=picture,
            shutter=Shutter(readout_s=seconds),
            rate=Fraction(30),
            interlace="none",
            rng=np.random.default_rng(1),
        )
        found = [find_blobs(frame) for frame in film]
        b = np.array([[blobs.Xf[0], blobs.Yf[0]] for blobs in found])
        columns = {"Xf": b[:, 0], "Yf": b[:, 1], "sd_x": 0.03, "sd_y": 0.03, "flag": "", "target": "t1"}
        tables[camera.name] = pd.DataFrame({"time_s": AT, "timecode": "", **columns})
    return tables, {camera.name: (camera, None) for camera in cameras}


def located(run, *seconds):
    return judged(locate(run[0], run[1], readouts=readouts(run, *seconds)))


def readouts(run, *seconds):
    return {name: Readout(s, own[0].image_size) for (name, own), s in zip(run[1].items(), seconds, strict=True)}


def judged(done):
    table, record = done[:2]
    rows = table.dropna(subset="x")
    error = rows[["x", "y", "z"]].to_numpy() - path(rows["time_s"].to_numpy())
    return np.sqrt((error**2).sum(1).mean()), record


def test_a_read_out_that_the_config_names_leaves_positions_as_good_as_a_global_shutter(run):
    off, record = located(run, READOUT, 0.0, READOUT)
    assert off < 0.05  # in: 1 mm
    assert not [f for f in record["findings"] if f["code"] == "rolling-shutter"]


def test_a_read_out_that_it_does_not_name_is_reported_with_its_size(run):
    off, record = located(run, 0.0, 0.0, 0.0)
    assert off > 0.2
    found = {f["text"].split(":")[0]: f for f in record["findings"] if f["code"] == "rolling-shutter"}
    names = list(run[1])
    assert set(found) >= {names[0], names[2]}
    sights = record["sight_lines"]
    for name, true in zip(names, (READOUT, 0.0, READOUT), strict=True):
        assert abs(sights["readout_s"][name] - true) < 5 * sights["readout_sd_s"][name] + 0.004
    assert f"cameras.{names[0]}.readout_ms" in found[names[0]]["cure"]


def test_a_read_out_that_is_sought_is_found_from_the_motion_along_with_the_positions(run):
    names = list(run[1])
    found = sought_readouts(
        lambda own: locate(run[0], run[1], readouts=own), readouts(run, 0.0, 0.0, 0.0), [names[0], names[2]], "runs.x"
    )
    for name in (names[0], names[2]):
        assert found.readouts[name].seconds == pytest.approx(READOUT, abs=5 * found.sd[name] + 5e-4)
    assert found.readouts[names[1]].seconds == 0.0
    off, record = judged(found.located)
    assert off < 0.05  # in: 1 mm, as with the read-out that the config names
    assert not [f for f in record["findings"] if f["code"] == "rolling-shutter"]
    assert not found.findings


def test_a_read_out_that_the_motion_does_not_show_is_said_to_be_unsure(run):
    """A target that hardly moves."""
    still = {
        name: table.assign(Xf=table["Xf"].iloc[0] + 0.03 * np.sin(table.index), Yf=table["Yf"].iloc[0])
        for name, table in run[0].items()
    }
    names = list(run[1])
    found = sought_readouts(
        lambda own: locate(still, run[1], readouts=own), readouts(run, 0.0, 0.0, 0.0), names, "runs.x"
    )
    assert {f.code for f in found.findings} == {"readout-unsure"}
    assert all(own.seconds == 0.0 for own in found.readouts.values())
