import numpy as np
import pytest

from tests.exchange.cameras.rig import BROWN, RVEC, SIZE, TVEC, K, points, said, seen
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.dlt import coefficients_of, frame_buffer, matrix_of, read_coefficients
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import in_world
from vidtrack.geometry.camera import project

NONE = np.zeros(5)


def written(path, origin, first, digits="%.10g", columns=1, **kwargs):
    """The coefficients of the rig's camera in another program's pixels, by least squares on points as DLTdv does it."""
    p = points(200, 1)
    u = np.column_stack([seen(NONE, p), np.ones(200)]) @ np.linalg.inv(frame_buffer(origin, first, SIZE)).T
    u = u[:, :2]
    h = np.column_stack([p, np.ones(200)])
    zero = np.zeros_like(h)
    A = np.concatenate([np.column_stack([h, zero, -u[:, :1] * p]), np.column_stack([zero, h, -u[:, 1:] * p])])
    L = np.linalg.lstsq(A, np.concatenate([u[:, 0], u[:, 1]]), rcond=None)[0]
    np.savetxt(path, np.column_stack([L * (1 + 0.1 * k) for k in range(columns)]), fmt=digits, delimiter=",", **kwargs)
    return L


@pytest.mark.parametrize(
    ("format", "origin", "first"),
    [("dltdv8", "upper-left", (1, 1)), ("dltdv", "lower-left", (1, 1)), ("argus", "lower-left", (0, 1))],
)
def test_the_camera_sees_points_where_the_coefficients_say(tmp_path, format, origin, first):
    written(tmp_path / "cam1.csv", origin, first)
    given = read_camera(tmp_path / "cam1.csv", said(format=format, size=SIZE))
    np.testing.assert_allclose(project(given.camera, points()), seen(NONE), atol=1e-4)
    assert given.findings == ()


def test_skewed_and_oblong_pixels_are_kept(tmp_path):
    rng = np.random.default_rng(3)
    L = written(tmp_path / "cam1.csv", "upper-left", (0, 0)) * (1 + 0.01 * rng.normal(size=11))
    np.savetxt(tmp_path / "cam1.csv", L, fmt="%.15g")
    camera = read_camera(tmp_path / "cam1.csv", said(origin="upper-left", first=(0.0, 0.0), size=SIZE)).camera
    h = np.column_stack([points(), np.ones(60)]) @ matrix_of(L).T
    np.testing.assert_allclose(project(camera, points()), h[:, :2] / h[:, 2:], atol=1e-8)
    f = camera.f
    P = np.array([[f * camera.Sx, f * camera.skew, camera.Cx], [0, f, camera.Cy], [0, 0, 1]])
    np.testing.assert_allclose(coefficients_of(P @ np.column_stack([camera.R, camera.T])), L, rtol=1e-9)


def test_with_the_wrong_corner_the_origin_lies_behind_the_camera_and_that_is_reported(tmp_path):
    written(tmp_path / "cam1.csv", "lower-left", (1, 1))
    given = read_camera(tmp_path / "cam1.csv", said(format="dltdv8", size=SIZE))
    assert [finding.code for finding in given.findings] == ["dlt-origin-behind"]


def test_what_the_file_does_not_say_is_asked_for_by_its_key(tmp_path):
    path = tmp_path / "cam1.csv"
    written(path, "upper-left", (1, 1))
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.size"):
        read_camera(path, said(format="dltdv8"))
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.origin"):
        read_camera(path, said(size=SIZE))
    written(path, "upper-left", (1, 1), columns=3)
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.camera: .* 3 columns"):
        read_camera(path, said(size=SIZE, format="dltdv8"))
    given = read_camera(path, said(size=SIZE, format="dltdv8", camera="1"))
    np.testing.assert_allclose(project(given.camera, points()), seen(NONE), atol=1e-4)


@pytest.mark.parametrize("how", ["row", "semicolons", "spaces", "crlf"])
def test_coefficients_are_read_however_they_are_laid_out(tmp_path, how):
    path = tmp_path / "cam1.csv"
    L = written(path, "upper-left", (1, 1), digits="%.17g", columns=2)
    text = path.read_text()
    if how == "row":
        np.savetxt(path, L[None], delimiter=",", fmt="%.17g")
    else:
        path.write_text({"semicolons": text.replace(",", ";").replace(".", ","), "spaces": text.replace(",", "  "),
                         "crlf": text.replace("\n", "\r\n")}[how])  # fmt: skip
    np.testing.assert_array_equal(read_coefficients(path)[:, 0], L)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("1\n" * 10, "11 coefficients"),
        ("1,2\n" * 10 + "1\n", "different lengths"),
        ("1\n" * 10 + "nan\n", "no coefficients"),
        ("1.5\n" * 8 + "0\n" * 3, "L9, L10 and L11 are 0"),
        ("-21,149,-75,312\n" * 11, "whole numbers alone"),
        ("tag\n" * 11, "no coefficients"),
    ],
)
def test_what_are_no_coefficients_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "cam1.csv").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_camera(tmp_path / "cam1.csv", said(size=SIZE, format="dltdv8"))
    assert "\n" not in str(error.value)


def test_an_argus_profile_puts_its_distortion_before_the_coefficients(tmp_path):
    written(tmp_path / "cam1.csv", "lower-left", (0, 1), digits="%.17g")
    k1, k2, t1, t2, k3 = BROWN
    profile = f"1 {K[0, 0]} 1280 960 {K[0, 2]} {K[1, 2]} {float(K[1, 1] / K[0, 0])} {k1} {k2} {t1} {t2} {k3}\n"
    (tmp_path / "profile.txt").write_text(profile)
    how = said(format="argus", size=SIZE, lens=str(tmp_path / "profile.txt"))
    given = read_camera(tmp_path / "cam1.csv", how)
    assert given.largest_px < 0.1
    np.testing.assert_allclose(project(given.camera, points()), seen(), atol=given.largest_px + 1e-4)


def test_lengths_become_those_of_the_experiment(tmp_path):
    written(tmp_path / "cam1.csv", "upper-left", (1, 1), digits="%.17g")
    how = said(format="dltdv8", size=SIZE, units="m", world="mm")
    camera = in_world(read_camera(tmp_path / "cam1.csv", how), how)
    np.testing.assert_allclose(project(camera, 1000 * points()), seen(NONE), atol=1e-6)
    assert np.linalg.norm(camera.T - 1000 * TVEC) < 1e-3
    assert RVEC is not None
