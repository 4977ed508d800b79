"""DLTdv's and Argus's files: their own reconstruction gives the positions that were measured."""

import io
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.exchange.test_digitised import CAMERAS, NAMES, digitised_run, paths
from vidtrack.exchange.dltdv import write_argus, write_dltdv7, write_dltdv8
from vidtrack.geometry.camera import project

HEIGHT = 480


def table(files, name):
    return pd.read_csv(io.BytesIO(files[name]))


def reconstructed(coefs, uv):
    """As dlt_reconstruct of DLTdv: linear least squares of points (n, 3) from uv (n, cameras, 2)."""
    answer = []
    for row in uv:
        A, b = [], []
        for (u, v), L in zip(row, coefs.T, strict=True):
            if np.isfinite(u):
                A += [u * L[8:11] - L[:3], v * L[8:11] - L[4:7]]
                b += [L[3] - u, L[7] - v]
        answer.append(np.linalg.lstsq(np.array(A), np.array(b), rcond=None)[0])
    return np.array(answer)


@pytest.mark.parametrize(
    ("write", "joint", "columns", "third"),
    [
        (write_dltdv8, "_", "stern_cam{}_U stern_cam{}_V", "stern_Z"),
        (write_dltdv7, "_", "pt2_cam{}_X pt2_cam{}_Y", "pt2_Z"),
        (write_argus, "-", "stern_cam_{}_x stern_cam_{}_y", "stern_z"),
    ],
    ids=["dltdv8", "dltdv7", "argus"],
)
def test_the_programs_own_reconstruction_gives_what_was_measured(write, joint, columns, third):
    files = write(digitised_run()).files
    coefs = np.loadtxt(io.BytesIO(files[f"pluck{joint}dltcoefs.csv"]), delimiter=",")
    assert coefs.shape == (11, 3)
    flat = table(files, f"pluck{joint}undistorted_xypts.csv")
    uv = np.stack([flat[columns.format(c, c).split()].to_numpy() for c in (1, 2, 3)], 1)
    np.testing.assert_allclose(reconstructed(coefs, uv), paths()[:, 1], atol=5e-7)
    xyz = table(files, f"pluck{joint}xyzpts.csv")
    np.testing.assert_array_equal(xyz[third], paths()[:, 1, 2])
    assert np.nanmax(table(files, f"pluck{joint}xyzres.csv")) < 1e-6
    assert table(files, f"pluck{joint}offsets.csv").iloc[0].tolist() == [0, 3, -2]


@pytest.mark.parametrize(
    ("write", "name", "columns", "expected"),
    [
        (write_dltdv8, "pluck_xypts.csv", ["bow_cam1_U", "bow_cam1_V"], lambda b: b + 1),
        (write_dltdv7, "pluck_xypts.csv", ["pt1_cam1_X", "pt1_cam1_Y"], lambda b: b * [1, -1] + [1, HEIGHT]),
        (write_argus, "pluck-xypts.csv", ["bow_cam_1_x", "bow_cam_1_y"], lambda b: b * [1, -1] + [0, HEIGHT]),
    ],
    ids=["dltdv8", "dltdv7", "argus"],
)  # fmt: skip
def test_points_lie_on_the_pictures_with_the_origin_of_each_program(write, name, columns, expected):
    got = table(write(digitised_run()).files, name)[columns]
    np.testing.assert_allclose(got, expected(project(CAMERAS["cam1"], paths()[:, 0])), rtol=1e-12)


def test_what_was_not_seen_is_nan():
    lines = write_dltdv8(digitised_run()).files["pluck_xypts.csv"].decode().splitlines()
    assert lines[0].split(",")[4:6] == ["bow_cam3_U", "bow_cam3_V"]
    assert lines[1].split(",")[4:6] == ["NaN", "NaN"]
    assert len(lines) == 41


def test_numbers_stand_for_names_where_the_program_has_none():
    assert {"pt1 is bow", "pt2 is stern"} <= set(write_dltdv7(digitised_run()).notes)
    assert NAMES == ("bow", "stern")


def test_argus_undistorts_with_its_profile_to_the_points_without_lens():
    """As its undistort_pts does: one f for both directions, whatever the pixels' shape."""
    own = digitised_run()
    made = write_argus(own)
    profile = np.loadtxt(io.BytesIO(made.files["pluck-camera-profile.txt"]))
    assert profile[:, :4].tolist() == [[k, profile[k - 1, 1], 512, 480] for k in (1, 2, 3)]
    said = [float(note.split("within ")[1].split(" px")[0]) for note in made.notes if "profile's lens" in note]
    for k, camera in enumerate(CAMERAS.values()):
        f, cx, cy = profile[k, [1, 4, 5]]
        K = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1]])
        b = project(camera, paths()).reshape(-1, 2)
        got = cv2.undistortPoints(b[:, None], K, profile[k, -5:], P=K)[:, 0]
        expected = project(camera.without_lens(), paths()).reshape(-1, 2)
        np.testing.assert_allclose(got, expected, atol=2 * said[k] + 1e-6)
    assert max(said) < 0.5  # of pixels that are not square; of square ones:
    square = {name: camera.with_(dx=camera.dy, Sx=1.0) for name, camera in CAMERAS.items()}
    notes = write_argus(replace(own, cameras=square)).notes
    assert max(float(note.split("within ")[1].split(" px")[0]) for note in notes if "profile's lens" in note) < 0.01
