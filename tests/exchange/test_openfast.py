"""Motions under the names of OpenFAST and WEC-Sim."""

import io

import numpy as np
import pandas as pd
from scipy.io import loadmat

from tests.exchange.runs import bodies, run, times
from vidtrack.exchange.openfast import write_openfast, write_wecsim

NAMES = [f"Ptfm{name}" for name in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")]


def moved(points=("CoG",), names=("float",)):
    rng = np.random.default_rng(4)
    tables = []
    for name in names:
        for point in points:
            table = pd.DataFrame({"time_s": times(), "body": name, "point": point})
            for freedom in ("surge", "sway", "heave", "roll", "pitch", "yaw"):
                table[freedom] = rng.normal(size=60)
                table[f"sigma_{freedom}"] = 0.01
            tables.append(table)
    return pd.concat(tables, ignore_index=True)


def read(own):
    lines = write_openfast(own).files["pluck.out"].decode().splitlines()
    return lines[6].split("\t"), lines[7].split("\t"), np.array([line.split("\t") for line in lines[8:]], float)


def test_motions_have_the_names_and_units_of_openfast():
    table = moved()
    names, units, values = read(run(tables={"bodies": bodies(), "motions": table}))
    assert names == ["Time", *NAMES]
    assert units == ["(s)", *["(m)"] * 3, *["(deg)"] * 3]
    np.testing.assert_allclose(values[:, 1:4], table[["surge", "sway", "heave"]] * 0.0254, rtol=1e-15)
    np.testing.assert_array_equal(values[:, 4:], table[["roll", "pitch", "yaw"]])
    np.testing.assert_allclose(values[:, 0], times() - times()[0], atol=1e-6)


def test_the_first_named_point_of_each_body_is_written():
    table = moved(("CoG", "fairlead"), ("float", "buoy"))
    names, _, values = read(run(tables={"bodies": bodies(), "motions": table}))
    assert names[7] == "buoy_PtfmSurge"
    own = table.query("body == 'buoy' and point == 'CoG'")
    np.testing.assert_array_equal(values[:, 12], own["yaw"])


def test_without_axes_the_pose_in_the_world_is_written_and_said():
    own = run(tables={"bodies": bodies()})
    _, _, values = read(own)
    np.testing.assert_allclose(values[:, 1:4], bodies()[["x", "y", "z"]] * 0.0254, rtol=1e-15)
    assert np.isnan(values[5, 1:]).all()
    assert "name `axes`" in write_openfast(own).notes[0]


def test_wecsim_reads_positions_with_angles_in_radians():
    table = moved()
    mat = loadmat(io.BytesIO(write_wecsim(run(tables={"motions": table})).files["pluck_wecsim.mat"]))
    body = mat["output"]["bodies"][0, 0][0, 0]
    assert str(body["name"][0]) == "float"
    np.testing.assert_allclose(body["position"][:, 3:], np.radians(table[["roll", "pitch", "yaw"]]), rtol=1e-15)
    np.testing.assert_allclose(body["position"][:, 2], table["heave"] * 0.0254, rtol=1e-15)
