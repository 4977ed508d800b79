"""MATLAB files, read back by scipy.io.loadmat."""

import io

import numpy as np
import pytest
from scipy.io import loadmat

from tests.exchange.runs import NAMES, bodies, kinematics, run, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.matlab import write


def read(own):
    return loadmat(io.BytesIO(write(own).files["pluck.mat"]))["vidtrack"][0, 0]


def test_positions_come_back_to_the_last_digit():
    mat = read(run())
    assert [str(cell[0]) for cell in mat["targets"][:, 0]] == list(NAMES)
    assert mat["position"].shape == (55, 3, 3)
    own = trajectories().query("target == 'stern'")
    np.testing.assert_array_equal(mat["position"][:, :, 2], own[["x", "y", "z"]])
    np.testing.assert_array_equal(mat["time"][:, 0], own["time_s"])
    np.testing.assert_array_equal(mat["velocity"][:, :, 2], kinematics().query("target == 'stern'")[["vx", "vy", "vz"]])
    assert mat["units"]["velocity"][0, 0][0] == "in/s"


def test_flags_are_numbers_of_texts():
    mat = read(run())
    texts = [""] + [str(cell[0]) for cell in mat["flag_texts"][:, 0]]
    assert texts[int(mat["flag"][5, 2])] == "lost;cam1:edge"
    assert texts[int(mat["flag"][7, 0])] == "missing"
    assert mat["flag"][0, 0] == 0


def test_bodies_are_an_array_of_structs():
    mat = read(run(tables={"trajectories": trajectories(), "bodies": bodies(("float", "keel"))}))
    assert mat["bodies"].shape == (2, 1)
    one = mat["bodies"][1, 0]
    assert str(one["name"][0]) == "keel"
    own = bodies(("float", "keel")).query("body == 'keel'").set_index("time_s").reindex(mat["time"][:, 0])
    np.testing.assert_array_equal(one["quaternion"], own[["qw", "qx", "qy", "qz"]])
    np.testing.assert_array_equal(one["angles"], own[["roll", "pitch", "yaw"]])


def test_one_target_keeps_its_axes():
    mat = read(run(tables={"trajectories": trajectories(["a"])}))
    assert mat["position"].reshape(len(mat["time"]), 3, -1).shape[2] == 1


def test_the_same_run_makes_the_same_bytes_whatever_the_day(monkeypatch):
    before = write(run()).files
    monkeypatch.setattr("time.asctime", lambda *_: "Thu Jan  1 00:00:00 1970")
    assert write(run()).files == before


def test_a_run_without_a_sample_is_refused():
    with pytest.raises(VidtrackError, match="no sample"):
        write(run(tables={"trajectories": trajectories(names=())}))
