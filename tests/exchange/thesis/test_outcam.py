import numpy as np
import pytest

from tests.exchange.thesis.rig import FIXED, cameras, points, projected_by_back
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.outcam import Outcam, camera_of, outcam_of, read_outcam, write_outcam
from vidtrack.geometry.camera import project


def test_the_camera_projects_as_back_does(tmp_path):
    camera = cameras()[0]
    out, fixed, worst = outcam_of(camera, points())
    write_outcam(tmp_path / "outcam1.prn", out)
    found = read_outcam(tmp_path / "outcam1.prn")
    theirs = projected_by_back(found.R, found.T, found.Sx, found.f, found.kappa1, fixed, points())
    np.testing.assert_allclose(project(camera_of(found, fixed), points()), theirs, atol=1e-5)
    np.testing.assert_allclose(project(camera, points()), theirs, atol=worst)
    assert worst < 0.02
    assert found.kappa1 == pytest.approx(-camera.kappa1, rel=0.02)  # appendix C divides where chapter 4 multiplies


def test_a_calibration_that_was_read_is_written_as_it_was():
    out, fixed, _ = outcam_of(cameras()[1])
    again, _, worst = outcam_of(camera_of(out, fixed))
    assert again.kappa1 == pytest.approx(out.kappa1, rel=1e-6)
    assert worst < 1e-5
    np.testing.assert_allclose(again.R, out.R, atol=1e-12)
    np.testing.assert_allclose(again.T, out.T, atol=1e-10)


def test_rows_of_R_that_are_not_square_become_skew_and_the_picture_stays():
    out, fixed, _ = outcam_of(cameras()[1])
    R = np.array(out.R)
    R[0] += 2e-3 * R[1]  # as calb leaves it: its first two rows are solved without that condition
    R[0] /= np.linalg.norm(R[0])
    R[2] = np.cross(R[0], R[1])
    skewed = out._replace(R=R)
    theirs = projected_by_back(R, out.T, out.Sx, out.f, out.kappa1, fixed, points())
    camera = camera_of(skewed, fixed)
    assert camera.skew == pytest.approx(2e-3, rel=0.1)
    np.testing.assert_allclose(project(camera, points()), theirs, atol=2e-3)


def test_a_calibration_that_is_written_is_read_to_fifteen_decimals(tmp_path):
    out, _, _ = outcam_of(cameras()[0], points())
    write_outcam(tmp_path / "outcam1.prn", out)
    found = read_outcam(tmp_path / "outcam1.prn")
    np.testing.assert_allclose(found.R, out.R, atol=6e-16)
    np.testing.assert_allclose(found.T, out.T, atol=6e-16, rtol=1e-15)
    assert (found.Sx, found.f, found.kappa1) == pytest.approx((out.Sx, out.f, out.kappa1), abs=6e-16)
    assert found.ends == out.ends
    assert found.longest == pytest.approx(out.longest, abs=5e-7)
    assert len((tmp_path / "outcam1.prn").read_text().split("=\n")[0].split("\n")) == 15


def test_the_longest_distance_names_points_by_their_place_in_the_list():
    out, _, _ = outcam_of(cameras()[0], np.array([[0, 0, 0], [9, 0, 0], [5, 0, 0], [-1, 0, 0]], float))
    assert out.longest == 10
    assert out.ends == (2, 4)


@pytest.mark.parametrize("broken", [{"f": -3.0}, {"Sx": 0.0}, {"R": np.diag([1.0, 1, -1])}])
def test_a_calibration_that_failed_is_refused(tmp_path, broken):
    out = Outcam(np.eye(3), np.array([0, 0, 100.0]), 1.0, 16.0, 0.0)._replace(**broken)
    write_outcam(tmp_path / "outcam1.prn", out)
    with pytest.raises(VidtrackError, match="calb failed"):
        read_outcam(tmp_path / "outcam1.prn")


def test_a_file_that_breaks_off_is_refused(tmp_path):
    path = tmp_path / "outcam1.prn"
    write_outcam(path, outcam_of(cameras()[0])[0])
    path.write_text("\n".join(path.read_text().split("\n")[:18]))
    with pytest.raises(VidtrackError, match="Copy the whole file again"):
        read_outcam(path)


def test_a_lens_that_calb_does_not_know_is_refused():
    with pytest.raises(VidtrackError, match="p1 is not known to calb"):
        outcam_of(cameras()[0].with_(p1=1e-6))
    assert outcam_of(cameras()[0])[1] == FIXED._replace(Ncx=512.0, Ncy=492.0)
