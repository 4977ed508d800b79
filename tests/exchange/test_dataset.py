"""A run as a Dataset: the values of its tables, and what CF, movement and pint ask for."""

import json

import numpy as np
import pint
import pytest

from tests.exchange.runs import NAMES, RATE, bodies, kinematics, run, times, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.dataset import dataset


def test_position_has_the_layout_of_movement():
    ds = dataset(run())
    assert ds["position"].dims == ("time", "space", "keypoint", "individual")
    assert ds["confidence"].dims == ("time", "keypoint", "individual")
    assert list(ds["keypoint"].values) == list(NAMES)
    assert (ds.attrs["ds_type"], ds.attrs["source_software"], ds.attrs["time_unit"]) == (
        "poses",
        "vidtrack",
        "seconds",
    )
    assert ds.attrs["fps"] == pytest.approx(RATE, rel=1e-6)


def test_values_are_those_of_the_tables():
    ds = dataset(run())
    own = trajectories().query("target == 'stern'")
    got = ds["position"].sel(keypoint="stern", individual="pluck").transpose("time", "space")
    np.testing.assert_array_equal(got, own[["x", "y", "z"]])
    own = kinematics().query("target == 'stern'")
    np.testing.assert_array_equal(ds["velocity"].sel(keypoint="stern", space="y").squeeze(), own["vy"])
    own = bodies().set_index("time_s").reindex(ds["time"].values)
    np.testing.assert_array_equal(ds["body_angles"].sel(body="float", angle="pitch"), own["pitch"])
    np.testing.assert_array_equal(ds["body_quaternion"].sel(body="float", quaternion_part="w"), own["qw"])


def test_pint_reads_every_unit():
    registry = pint.UnitRegistry()
    for units in ("m", "cm", "mm", "in", "ft"):
        for name, variable in dataset(run(units)).variables.items():
            if "units" in variable.attrs:
                registry.parse_units(variable.attrs["units"])
            else:
                assert name in (
                    "space",
                    "keypoint",
                    "individual",
                    "flag",
                    "body",
                    "angle",
                    "quaternion_part",
                    "body_flag",
                )
    ds = dataset(run("in"))
    assert registry(ds["velocity"].attrs["units"]).to("m/s").magnitude == pytest.approx(0.0254)


def test_flags_say_why_in_cf_and_in_their_own_words():
    flag = dataset(run())["flag"]
    texts = json.loads(flag.attrs["texts"])
    assert texts[int(flag.sel(keypoint="stern")[5, 0])] == "lost;cam1:edge"
    assert texts[int(flag.sel(keypoint="bow")[7, 0])] == "missing"
    assert texts[int(flag.sel(keypoint="stern")[0, 0])] == ""
    meanings = flag.attrs["flag_meanings"].split()
    assert len(meanings) == len(flag.attrs["flag_values"]) == len(texts)
    assert meanings[0] == "none"


def test_times_that_are_not_even_stay_as_they_are_and_there_is_no_fps():
    t = np.sort(times(60) + np.random.default_rng(0).normal(scale=1e-3, size=60))
    ds = dataset(run(tables={"trajectories": trajectories(t=t)}))
    np.testing.assert_allclose(ds["time"], t[np.r_[:20, 25:60]], atol=0)
    assert "fps" not in ds.attrs


def test_a_run_in_a_plane_has_two_coordinates():
    table = trajectories()
    table["z"] = np.nan
    ds = dataset(run(tables={"trajectories": table}, is_flat=True))
    assert list(ds["space"].values) == ["x", "y"]


def test_a_run_in_space_in_which_nothing_was_located_keeps_three():
    table = trajectories()
    table[["x", "y", "z"]] = np.nan
    assert dataset(run(tables={"trajectories": table})).sizes["space"] == 3


def test_kinematics_of_some_targets_only_leave_the_others_missing():
    own = kinematics().query("target != 'bow'")
    ds = dataset(run(tables={"trajectories": trajectories(), "kinematics": own}))
    assert np.isnan(ds["velocity"].sel(keypoint="bow")).all()
    np.testing.assert_array_equal(
        ds["velocity"].sel(keypoint="stern", space="x").squeeze(), own.query("target == 'stern'")["vx"]
    )


def test_a_run_without_a_sample_is_refused():
    with pytest.raises(VidtrackError, match="no sample"):
        dataset(run(tables={"trajectories": trajectories(names=())}))
