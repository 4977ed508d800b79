"""The map over Cx, Cy and the sensor's width: each trial is what a calibration with that held would leave."""

import numpy as np
import pytest

from vidtrack.calibration.camera.centre_search import best_centre, closed_form_error, refined_error, search_map
from vidtrack.calibration.camera.initial_fit import Nominal, fit_camera
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")


@pytest.fixture(scope="module")
def rig():
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    b = project(camera, p) + np.random.default_rng(0).normal(0, 0.1, (64, 2))
    fit = fit_camera(p, b, Nominal(255.5, 239.5, camera.dx, camera.dy, camera.image_size))
    return fit, p, b


def test_the_closed_form_s_error_is_that_of_projecting_it(rig):
    fit, p, b = rig
    where = {"Cx": 250.0, "Cy": 245.0, "dx": fit.camera.dx, "dy": fit.camera.dy}
    solved = closed_form(p, b, **where)
    camera = camera_from_closed_form(solved, (512, 480))
    direct = np.sqrt(((project(camera, p) - b) ** 2).sum(1).mean())
    assert float(closed_form_error(p, b, solved)) == pytest.approx(direct, rel=1e-3)


@pytest.mark.parametrize("model", ["tsai", "affine"])
def test_the_refined_error_is_that_of_a_refinement_with_the_centre_held(rig, model):
    fit, p, b = rig
    Cx, Cy = np.array([240.0, 262.0, 280.0]), np.array([225.0, 231.0, 250.0])
    held = [name for name in free_parameters(model) if name not in ("Cx", "Cy")]
    fast = refined_error(fit.camera, p, b, Cx=Cx, Cy=Cy, dx=np.full(3, fit.camera.dx), free=held)
    slow = [refine(fit.camera.with_(Cx=x, Cy=y), p, b, free=held).rms_px for x, y in zip(Cx, Cy, strict=True)]
    np.testing.assert_allclose(fast, slow, rtol=2e-3)


def test_the_map_is_lowest_at_the_grid_point_next_to_the_answer(rig):
    fit, p, b = rig
    found = search_map(fit.camera, p, b, Cx=round(fit.camera.Cx) + 5.0, Cy=round(fit.camera.Cy) - 10.0, free=FREE)
    centre = np.array(found.varied) == "centre"
    best = np.nanargmin(np.where(centre, found.rms_refined, np.nan))
    assert abs(found.Cx[best] - fit.camera.Cx) <= 2.6
    assert abs(found.Cy[best] - fit.camera.Cy) <= 5.1  # a narrow slanted valley: the nearest node need not be lowest
    assert np.nanmin(found.rms_refined) >= fit.rms_px * (1 - 1e-6)


def test_the_map_reaches_25_px_and_0_2_mm(rig):
    fit, p, b = rig
    found = search_map(fit.camera, p, b, Cx=255.5, Cy=239.5, free=FREE)
    assert (np.nanmin(found.Cx), np.nanmax(found.Cx)) == (230.5, 280.5)
    sensor = np.array(found.varied) == "sensor"
    np.testing.assert_allclose(found.sensor_width[sensor][[0, -1]], [8.6, 9.0])
    assert np.isnan(found.Cx[sensor]).all()
    assert found.sensor_width[sensor][np.argmin(found.rms_refined[sensor])] == pytest.approx(8.8)


def test_without_a_sensor_the_same_share_of_the_width_is_searched(rig):
    fit, p, b = rig
    camera = fit.camera.with_(
        dx=1.0, dy=1.0, f=fit.camera.f / fit.camera.dy, Sx=fit.camera.Sx * fit.camera.dy / fit.camera.dx,
        kappa1=fit.camera.kappa1 * fit.camera.dy**2,
    )  # fmt: skip
    found = search_map(camera, p, b, Cx=255.5, Cy=239.5, free=FREE)
    sensor = np.array(found.varied) == "sensor"
    np.testing.assert_allclose(found.sensor_width[sensor][[0, -1]], 512 * (1 + np.array([-1, 1]) * 0.2 / 8.8))


def test_the_hunt_ends_where_a_fine_grid_has_its_least_error(rig):
    fit, p, b = rig
    sensor = {"dx": fit.camera.dx, "dy": fit.camera.dy}
    x, y, edge = best_centre(p, b, Cx=255.5, Cy=239.5, **sensor)
    gx, gy = np.meshgrid(x + np.linspace(-3, 3, 13), y + np.linspace(-3, 3, 13))
    here = float(closed_form_error(p, b, closed_form(p, b, Cx=x, Cy=y, **sensor)))
    assert here <= closed_form_error(p, b, closed_form(p, b, Cx=gx, Cy=gy, **sensor)).min() * (1 + 1e-4)
    assert not edge


def test_a_centre_out_of_reach_ends_at_the_edge(rig):
    fit, p, b = rig
    *_, edge = best_centre(p, b, Cx=fit.camera.Cx + 60, Cy=fit.camera.Cy, dx=fit.camera.dx, dy=fit.camera.dy)
    assert edge


def test_a_mirror_has_no_error_at_all(rig):
    fit, p, b = rig
    solved = closed_form(-p, b, Cx=255.5, Cy=239.5, dx=fit.camera.dx, dy=fit.camera.dy)
    assert np.isnan(closed_form_error(-p, b, solved))
