"""Several starts, and the best fit of them."""

import numpy as np
import pytest

from vidtrack.calibration.camera.initial_fit import Nominal, distances, fit_camera, starts, tsai_solution
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig


def case(**changes):
    camera = thesis_rig(1)[0].with_(**changes)
    p = thesis_points()[1]
    b = project(camera, p) + np.random.default_rng(0).normal(0, 0.1, (64, 2))
    return camera, p, b, Nominal(255.5, 239.5, camera.dx, camera.dy, camera.image_size)


def test_there_are_three_starts_and_each_sees_the_points_roughly():
    _, p, b, nominal = case()
    found = starts(p, b, nominal)
    assert len(found) == 3
    assert all(np.median(distances(camera, p, b)) < 3 for camera in found)


def test_a_centre_far_from_the_middle_is_found():
    """As a mirror splitter makes it: 300 px off."""
    _, p, b, nominal = case(Cx=560.0, Cy=120.0)
    assert fit_camera(p, b, nominal).sigma_px == pytest.approx(0.1, rel=0.25)


def test_the_answer_is_at_least_as_good_as_any_single_start_s():
    _, p, b, nominal = case()
    best = fit_camera(p, b, nominal)
    single = camera_from_closed_form(tsai_solution(p, b, nominal), nominal.image_size)
    assert best.cost <= refine(single, p, b, free=free_parameters("tsai")).cost * (1 + 1e-9)


def test_fixed_parameters_keep_their_value_in_every_start_and_in_the_fit():
    _, p, b, nominal = case()
    assert all(camera.Sx == 1.0 and camera.kappa1 == 0 for camera in starts(p, b, nominal, {"Sx": 1.0, "kappa1": 0.0}))
    fit = fit_camera(p, b, nominal, fixed={"Sx": 1.0, "kappa1": 0.0})
    assert (fit.camera.Sx, fit.camera.kappa1) == (1.0, 0.0)


def test_a_mirror_gives_no_true_start():
    _, p, b, nominal = case()
    assert starts(p * [1, 1, -1], b, nominal) == [] or fit_camera(p * [1, 1, -1], b, nominal).sigma_px > 1


def test_a_richer_lens_never_fits_worse():
    _, p, b, nominal = case()
    plain, rich = (fit_camera(p, b, nominal, model=m) for m in ("tsai", "affine"))
    assert rich.cost <= plain.cost


def test_a_point_behind_the_camera_is_infinitely_far():
    camera, _, b, _ = case()
    assert distances(camera, camera.position[None] - camera.R[2], b[:1])[0] == np.inf


def test_a_camera_of_which_nothing_is_said_has_its_principal_point_in_the_middle_and_a_usual_lens():
    camera = Nominal.of((640, 480)).unplaced("cam1")
    assert (camera.Cx, camera.Cy, camera.dx, camera.dy, camera.f) == (319.5, 239.5, 1.0, 1.0, 960.0)
    stated = Nominal.of((640, 480), 300.0, None, (6.4, 4.8))
    assert (stated.Cx, stated.Cy, stated.dx, stated.dy) == (300.0, 239.5, pytest.approx(0.01), pytest.approx(0.01))
    assert stated.unplaced("cam2").f == pytest.approx(9.6)
