"""Which camera errs for a moment: left out where the others agree without it alone, else spanned by sigma."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.erring_camera import lens_findings, places_of_errors, without_erring
from vidtrack.location.sight_lines.sudden_misses import with_grown_sigma
from vidtrack.simulate.rig import thesis_rig

T = np.linspace(0, 8, 400)
PATH = np.stack([12 * np.sin(T), 4 * np.cos(1.7 * T), 3 * np.sin(2.3 * T)], -1)[None]
SD = 0.02
WIDTHS = {"cam1": 384, "cam2": 384}
WHERE = [40, 41, 42, 200]


def settled(n, camera=0, off=(0.0, 0.0), seed=3):
    """By n cameras, of which one is off by (x, y) px in the samples WHERE; and positions that were grown only."""
    cameras = thesis_rig(n)
    rng = np.random.default_rng(seed)
    b = np.stack([project(c, PATH) for c in cameras]) + rng.normal(0, SD, (n, 1, T.size, 2))
    b[camera, 0, WHERE] += off
    sd = np.full(b.shape, SD)
    grown = with_grown_sigma(locate_points(cameras, b, sd=sd, reject=3.0), sd)
    return without_erring(*grown, sd, lambda which, own: locate_points(cameras, b[:, which], sd=own)), grown, b


def z_of(located):
    return np.abs(located.point - PATH)[0] / located.sigma[0]


@pytest.mark.parametrize("n", [3, 4])
@pytest.mark.parametrize("camera", [0, 1, 2])
@pytest.mark.parametrize("off", [(1.0, 0.5), (-0.3, 0.6), (2.0, -1.5)])
def test_the_camera_that_errs_is_left_out_and_the_position_is_right(n, camera, off):
    now, grown, _ = settled(n, camera, off)
    sure = [k for k in WHERE if now.camera[0, k] == camera]
    assert len(sure) >= (4 if n == 4 else 1)
    assert now.located.left_out[camera, 0, sure].all()
    assert (now.located.n_cameras[0, sure] == n - 1).all()
    assert z_of(now.located)[WHERE].max() < 5
    assert now.located.sigma[0, sure].max() < 0.5 * grown.located.sigma[0, sure].max()
    assert np.hypot(*now.located.error[camera, 0, sure].T) == pytest.approx(np.hypot(*off), abs=0.4)


def test_where_two_cameras_may_err_sigma_spans_the_positions_without_either():
    """What is moved along the epipolar line of one other camera leaves these two agreeing, and all three apart."""
    cameras = thesis_rig(3)
    b = np.stack([project(c, PATH) for c in cameras]) + np.random.default_rng(3).normal(0, SD, (3, 1, T.size, 2))
    beyond = PATH[0, WHERE] - cameras[1].position
    along = PATH[0, WHERE] + 0.06 * beyond / np.linalg.norm(beyond, axis=1)[:, None] * 5
    b[0, 0, WHERE] = project(cameras[0], along)
    sd = np.full(b.shape, SD)
    located = locate_points(cameras, b, sd=sd)
    grown = with_grown_sigma(located, sd)
    now = without_erring(*grown, sd, lambda which, own: locate_points(cameras, b[:, which], sd=own))
    assert (now.camera[0, WHERE] == -1).all()
    assert not now.located.left_out.any()
    assert z_of(now.located)[WHERE].max() < 2.5
    assert z_of(located)[WHERE].max() > 5


def test_two_cameras_and_noise_are_left_as_they_are():
    now, grown, _ = settled(2, off=(1.0, 0.5))
    assert (now.camera == -1).all()
    np.testing.assert_array_equal(now.located.sigma, grown.located.sigma)
    now, grown, _ = settled(3)
    assert now.located.left_out.sum() <= 1


def test_a_place_is_named_where_targets_come_back_to_it():
    who, b = np.full((1, 60), -1), np.full((2, 1, 60, 2), np.nan)
    who[0, [5, 6, 30, 31]] = 1
    b[1, 0, [5, 6, 30, 31]] = [[100, 50], [104, 50], [103, 52], [99, 51]]
    assert places_of_errors(who, b, WIDTHS) == {"cam2": {"n": 4, "places": [[102, 50, 4]]}}


def test_a_place_that_is_passed_once_is_none():
    who, b = np.full((1, 60), -1), np.full((2, 1, 60, 2), np.nan)
    who[0, 5:9] = 0
    b[0, 0, 5:9] = [[100, 50], [104, 50], [103, 52], [99, 51]]
    assert places_of_errors(who, b, WIDTHS) == {"cam1": {"n": 4, "places": []}}
    two, at = np.full((2, 60), -1), np.repeat(b, 2, 1)
    two[:, 5:9] = 0  # both at once: they touch each other
    assert places_of_errors(two, at, WIDTHS)["cam1"]["places"] == []
    two[1], two[1, 25:29], at[:, 1, 25:29] = -1, 0, at[:, 1, 5:9]
    assert places_of_errors(two, at, WIDTHS)["cam1"]["places"] == [[102, 50, 8]]


def test_what_lies_on_a_lens_is_named_with_its_places():
    places = [[10, 20, 3], [102, 50, 4], [7, 8, 9], [200, 1, 5]]
    (one,) = lens_findings({"cam1": {"n": 9, "places": []}, "cam2": {"n": 25, "places": places}})
    assert (one.level, one.code) == ("doubtful", "something-on-lens")
    assert one.text.startswith("cam2: ")
    assert "(7, 8), (200, 1), (102, 50) px" in one.text
    assert "lens" in one.text
    assert "window" in one.text
