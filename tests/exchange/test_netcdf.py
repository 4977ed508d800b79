"""NetCDF, read back by xarray and by scipy's reader of its own."""

import io

import numpy as np
import pytest
import scipy.io
import xarray as xr

from tests.exchange.runs import run, times, trajectories
from vidtrack.exchange.dataset import dataset
from vidtrack.exchange.netcdf import write, write_cf


def opened(tmp_path, own):
    (tmp_path / "a.nc").write_bytes(write(own).files["pluck.nc"])
    return xr.open_dataset(tmp_path / "a.nc")


def test_every_number_and_name_comes_back(tmp_path):
    back = opened(tmp_path, run())
    for name, variable in dataset(run()).variables.items():
        np.testing.assert_array_equal(back[name].values, variable.values, err_msg=str(name))
        assert back[name].attrs.get("units") == variable.attrs.get("units")


def test_time_stays_a_number_of_seconds(tmp_path):
    back = opened(tmp_path, run())
    assert back["time"].dtype == float
    np.testing.assert_array_equal(back["time"], times()[np.r_[:20, 25:60]])


def test_a_reader_of_plain_netcdf_finds_the_numbers(tmp_path):
    with scipy.io.netcdf_file(io.BytesIO(write(run()).files["pluck.nc"])) as file:
        position = np.array(file.variables["position"][:])
        assert file.variables["position"].units == b"in"
        assert file.Conventions == b"CF-1.11"
    np.testing.assert_array_equal(position, dataset(run())["position"])


def test_the_same_run_makes_the_same_bytes():
    assert write(run()).files == write(run()).files


@pytest.mark.parametrize("names", [["a"], ["é", "日本"]])
def test_one_target_and_names_of_any_script_come_back(tmp_path, names):
    back = opened(tmp_path, run(tables={"trajectories": trajectories(names)}))
    assert list(back["keypoint"].values) == names


def test_uneven_times_are_said():
    t = np.sort(times(60) + np.random.default_rng(0).normal(scale=1e-3, size=60))
    assert "not even in time" in write(run(tables={"trajectories": trajectories(t=t)})).notes[0]


def test_the_cf_flavour_has_a_time_that_xarray_decodes(tmp_path):
    (tmp_path / "a.nc").write_bytes(write_cf(run()).files["pluck_cf.nc"])
    back = xr.open_dataset(tmp_path / "a.nc")
    assert back["time"].dtype.kind == "M"
    seconds = (back["time"].values - np.datetime64("1970-01-01")) / np.timedelta64(1, "ns") * 1e-9
    np.testing.assert_allclose(seconds, dataset(run())["time"], atol=1e-6)
    assert back["time"].attrs["standard_name"] == "time"
    assert "stands for it" in write_cf(run()).notes[0]
