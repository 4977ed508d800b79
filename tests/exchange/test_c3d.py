"""C3D, read back by ezc3d, which is not ours."""

import ezc3d
import numpy as np
import pytest

from tests.exchange.runs import NAMES, RATE, run, times, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.c3d import write


def read(tmp_path, own):
    (tmp_path / "a.c3d").write_bytes(write(own).files[f"{own.name}.c3d"])
    return ezc3d.c3d(str(tmp_path / "a.c3d"))


def of_tables(table, **changes):
    return run(tables={"trajectories": table}, **changes)


def test_points_come_back_to_the_last_digit_of_single_precision(tmp_path):
    c3d = read(tmp_path, run())
    points = c3d["data"]["points"]
    assert points.shape == (4, 3, 60)
    own = trajectories().query("target == 'stern'").set_index("time_s")[["x", "y", "z"]].reindex(times())
    np.testing.assert_array_equal(points[:3, 2].T.astype(np.float32), (own.to_numpy() * 25.4).astype(np.float32))


def test_names_rate_unit_and_start_come_back(tmp_path):
    parameters = read(tmp_path, run(waves="+x", up="+z"))["parameters"]
    point = parameters["POINT"]
    assert tuple(point["LABELS"]["value"]) == NAMES
    assert point["RATE"]["value"] == [pytest.approx(RATE, rel=1e-7)]
    assert point["UNITS"]["value"] == ["mm"]
    assert (point["X_SCREEN"]["value"], point["Y_SCREEN"]["value"]) == (["+X"], ["+Z"])
    assert float(parameters["VIDTRACK"]["START_TIME_S"]["value"][0]) == pytest.approx(times()[0], abs=1e-6)


def test_what_is_missing_is_occluded(tmp_path):
    c3d = read(tmp_path, run())
    gone = np.isnan(c3d["data"]["points"][0])
    residual = c3d["data"]["meta_points"]["residuals"][0]
    assert (residual[gone] == -1).all()
    assert (residual[~gone] >= 0).all()
    assert sorted(np.flatnonzero(gone[0])) == [5, 7, 20, 21, 22, 23, 24]
    assert sorted(np.flatnonzero(gone[1])) == [5, 20, 21, 22, 23, 24]


def test_the_residual_is_the_miss_to_half_a_step_of_the_scale(tmp_path):
    c3d = read(tmp_path, run())
    step = -c3d["parameters"]["POINT"]["SCALE"]["value"][0]
    miss = trajectories().query("target == 'stern'").set_index("time_s")["miss"].reindex(times()) * 25.4
    read_back = c3d["data"]["meta_points"]["residuals"][0, 2]
    seen = miss.notna().to_numpy()
    assert np.abs(read_back - miss)[seen].max() < 0.51 * step
    assert step < 0.01 * miss.max()


@pytest.mark.parametrize("targets", [1, 2, 70, 300, 600])
def test_any_number_of_targets_comes_back(tmp_path, targets):
    names = [f"target {i}" for i in range(targets)]
    c3d = read(tmp_path, of_tables(trajectories(names, n=30)))
    labels = [
        label
        for key in ("LABELS", "LABELS2", "LABELS3")
        if key in c3d["parameters"]["POINT"]
        for label in c3d["parameters"]["POINT"][key]["value"]
    ]
    assert labels == names
    assert c3d["data"]["points"].shape == (4, targets, 30)


def test_a_run_in_which_nothing_was_located_is_all_occluded(tmp_path):
    table = trajectories()
    table[["x", "y", "z", "miss"]] = np.nan
    assert np.isnan(read(tmp_path, of_tables(table))["data"]["points"][:3]).all()


def test_the_longest_file_is_read_whole_and_a_longer_one_is_refused(tmp_path):
    t = np.round(np.arange(65_534) / RATE, 6)
    table = trajectories(["a"], t=t)
    assert read(tmp_path, of_tables(table))["data"]["points"].shape == (4, 1, 65_534)
    table = trajectories(["a"], t=np.round(np.arange(65_535) / RATE, 6))
    with pytest.raises(VidtrackError, match="65535 frames, and a C3D file holds 65534"):
        write(of_tables(table))


def test_a_name_of_255_bytes_comes_back_and_a_longer_one_is_refused(tmp_path):
    name = "é" * 127 + "x"
    assert read(tmp_path, of_tables(trajectories([name])))["parameters"]["POINT"]["LABELS"]["value"] == [name]
    with pytest.raises(VidtrackError, match="256 bytes"):
        write(of_tables(trajectories(["é" * 128])))


def test_times_that_are_not_even_are_refused():
    t = times(60) + np.random.default_rng(0).normal(scale=1e-3, size=60)
    with pytest.raises(VidtrackError, match="C3D has one rate"):
        write(of_tables(trajectories(t=np.sort(t))))


def test_gaps_are_said():
    assert write(run()).notes == ["5 moments at which there is no sample are missing points"]
