"""QTM's files: angles against scipy's rotations, and the layout of a public file of QTM itself."""

import io

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from tests.exchange.runs import NAMES, RATE, bodies, run, times, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.qtm import write

HEADER = [
    "NO_OF_FRAMES",
    "NO_OF_CAMERAS",
    "NO_OF_BODIES",
    "FREQUENCY",
    "NO_OF_ANALOG",
    "ANALOG_FREQUENCY",
    "DESCRIPTION",
    "TIME_STAMP",
    "DATA_INCLUDED",
    "BODY_NAMES",
]
"""Of shiplab/dt_cv, data/basin/raw/M510A-IRR-EKFPID-020019_6D.tsv, whose columns are COLUMNS."""
COLUMNS = "Frame\tTime\tPSVH X\tY\tZ\tRoll\tPitch\tYaw\tResidual\t" + "".join(f"Rot[{i}]\t" for i in range(9))
PUBLIC = (-0.65630, 0.09391, 0.05772), (1.0, 0.00099, -0.00165, -0.00101, 0.99993, -0.01145, 0.00164, 0.01145, 0.99993)
"""Its first row: roll, pitch, yaw and Rot."""


def of_quaternions():
    own = bodies().set_index("time_s").reindex(times())
    return Rotation.from_quat(own[["qx", "qy", "qz", "qw"]].dropna()), own["qw"].notna().to_numpy()


def tsv(own):
    lines = write(own).files["pluck_6D.tsv"].decode().splitlines()
    return lines[:11], np.array([line.rstrip("\t").split("\t") for line in lines[11:]], float)


def test_the_layout_is_that_of_a_file_of_qtm():
    head, _ = tsv(run())
    assert [line.split("\t")[0] for line in head[:10]] == HEADER
    assert head[10] == COLUMNS.replace("PSVH", "float")
    assert head[0] == "NO_OF_FRAMES\t60"
    assert float(head[3].split("\t")[1]) == pytest.approx(RATE, rel=1e-6)


def test_a_public_row_of_qtm_has_the_order_of_angles_and_columns_that_is_written_here():
    angles, rot = PUBLIC
    R = np.array(rot).reshape(3, 3).T
    np.testing.assert_allclose(Rotation.from_euler("XYZ", angles, degrees=True).as_matrix(), R, atol=2e-5)


def test_angles_are_those_of_rx_ry_rz_and_not_of_bodies_parquet():
    _, values = tsv(run())
    turned, seen = of_quaternions()
    np.testing.assert_allclose(values[seen, 5:8], turned.as_euler("XYZ", degrees=True), atol=1e-6)
    own = bodies().dropna(subset="x")
    assert np.abs(values[seen, 5:8] - own[["roll", "pitch", "yaw"]]).max().max() > 5


def test_the_rotation_stands_column_by_column():
    _, values = tsv(run())
    turned, seen = of_quaternions()
    np.testing.assert_allclose(values[seen, 9:].reshape(-1, 3, 3), turned.inv().as_matrix(), atol=1e-9)


def test_places_are_mm_and_missing_is_nan():
    _, values = tsv(run())
    own = bodies().set_index("time_s").reindex(times())
    np.testing.assert_allclose(values[:, 2:5], own[["x", "y", "z"]] * 25.4, atol=6e-7)
    assert np.isnan(values[5, 2:]).all()
    assert values[0, :2].tolist() == [1, 0]
    assert np.isnan(values[20:25, 2:]).all()


def test_matlab_has_the_fields_that_scripts_read():
    mat = loadmat(io.BytesIO(write(run()).files["pluck_qtm.mat"]), squeeze_me=False)["QTM"][0, 0]
    body = mat["RigidBodies"][0, 0]
    assert body["Positions"].shape == (1, 3, 60)
    assert body["Rotations"].shape == (1, 9, 60)
    turned, seen = of_quaternions()
    np.testing.assert_allclose(body["RPYs"][0, :, seen], turned.as_euler("XYZ", degrees=True), atol=1e-9)
    labelled = mat["Trajectories"][0, 0]["Labeled"][0, 0]
    assert [str(cell[0]) for cell in labelled["Labels"][0]] == list(NAMES)
    assert labelled["Data"].shape == (3, 4, 60)
    assert float(mat["FrameRate"][0, 0]) == pytest.approx(RATE, rel=1e-6)
    own = trajectories().query("target == 'stern'").set_index("time_s").reindex(times())
    np.testing.assert_array_equal(labelled["Data"][2, :3], own[["x", "y", "z"]].T * 25.4)


def test_a_run_without_bodies_has_its_markers():
    files = write(run(tables={"trajectories": trajectories()})).files
    assert sorted(files) == ["pluck_3D.tsv", "pluck_qtm.mat"]
    lines = files["pluck_3D.tsv"].decode().splitlines()
    assert lines[9] == "MARKER_NAMES\tbow\tBälle é\tstern"
    assert "DATA_INCLUDED\t3D" in lines
    assert lines[11 + 5].split("\t")[2:] == ["NaN"] * 9


def test_times_that_are_not_even_are_refused():
    t = np.sort(times(60) + np.random.default_rng(0).normal(scale=1e-3, size=60))
    with pytest.raises(VidtrackError, match="QTM has one rate"):
        write(run(tables={"trajectories": trajectories(t=t)}))
