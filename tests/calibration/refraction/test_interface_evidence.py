"""Wrong and missing interfaces are found from the points of one camera; right ones are left alone."""

import numpy as np
import pandas as pd
import pytest

from tests.geometry.underwater import SURFACE, WINDOW, looking
from vidtrack.geometry.camera import project
from vidtrack.stages.calibrate import calibrate

EXACT = {"position": 0, "tilt": 0, "thickness": 0, "index": 0}
WET = looking((-500, -1500, 50), WINDOW)
DRY = WET.with_(through=())
ABOVE = looking((-600, -700, 1500), SURFACE)
MIDDLE = SURFACE.stepped({"surface.position": -120.0})
BOTH = ABOVE.with_(through=(MIDDLE,))
LINES = np.linspace(-200, 200, 4)
GRID = np.stack(np.meshgrid(LINES, LINES, np.linspace(-200, 110, 4)), -1).reshape(-1, 3)


def found(camera, *through, seed=0):
    """The findings about interfaces of a calibration on 64 points."""
    done = calibrated(camera, *through, seed=seed)
    return [f for f in done.findings if f.code.startswith("interface")]


def calibrated(camera, *through, seed=0):
    b = project(camera, GRID) + np.random.default_rng(seed).normal(0, 0.1, (len(GRID), 2))
    table = pd.DataFrame({"tag": [str(i) for i in range(len(GRID))], "sd_x": 0.1, "sd_y": 0.1})
    table[["x", "y", "z"]], table[["Xf", "Yf"]] = GRID, b
    return calibrate(
        table, image_size=(640, 480), sensor=(6.4, 4.8), model="tsai", through=through, units="mm", search=False
    )


def config(interface, **changes):
    own = {"name": interface.name, "point": interface.point, "normal": interface.normal, "indices": interface.indices}
    thickness = {"thickness": interface.thickness} if interface.thickness else {}
    return own | thickness | changes


def test_a_right_interface_is_left_alone_and_no_point_is_blamed():
    for camera in (WET, ABOVE):
        done = calibrated(camera, *(config(i) for i in camera.through))
        said = [f for f in done.findings if f.code.startswith("interface")]
        assert {f.level for f in said} == {"note"}
        assert {f.code for f in said} <= {"interface-place-unchecked", "interface-unchecked"}  # all points are wet
        assert done.points["used"].all()
        assert done.record["sigma_px"] == pytest.approx(0.1, rel=0.2)


def test_a_camera_in_air_asks_for_no_interface():
    assert not found(DRY)


@pytest.mark.parametrize("camera", [WET, ABOVE])
def test_water_that_the_config_does_not_name_is_found(camera):
    (missing,) = found(camera)
    assert missing.code == "interface-missing"
    assert "through water" in missing.text


def test_a_surface_in_a_wrong_place_is_found_though_it_is_said_to_be_exact():
    # points on both sides of it see where it lies
    (wrong,) = found(BOTH, config(MIDDLE, point=MIDDLE.point + np.array([0, 0, 20.0]), sigma=EXACT))
    assert wrong.code == "interface-wrong"
    assert "position -19" in wrong.text


@pytest.mark.parametrize("off", [-60, 60])
def test_a_place_that_wet_points_cannot_check_is_said_and_one_that_dry_points_check_is_not(off):
    """Off by 60 mm, the camera moves along with the plane, and the points fit as well: docs/refraction.md."""
    there = {"point": WINDOW.point + off * WINDOW.normal}
    (said,) = [f for f in found(WET, config(WINDOW, **there)) if f.code != "interface-unchecked"]
    assert (said.level, said.code) == ("note", "interface-place-unchecked")
    assert "known to 5 mm from the config alone" in said.text
    said = found(BOTH, config(MIDDLE, sigma={"position": 20}))
    assert "interface-place-unchecked" not in {f.code for f in said}


@pytest.mark.parametrize("change", [{"thickness": (60.0,)}, {"indices": (1.0, 1.6, 1.333)}])
def test_a_pane_that_is_stated_wrongly_is_not_seen_by_wet_points_and_is_said_to_be_unchecked(change):
    """And does no harm: what lies in the water is predicted as well as the noise allows."""
    done = calibrated(WET, config(WINDOW, **change))
    (said,) = [f for f in done.findings if f.code == "interface-unchecked"]
    assert "thickness 1 (to " in said.text
    assert "index 1 (to 0.005)" in said.text
    q = np.random.default_rng(1).uniform([-180, -180, -180], [180, 180, 100], (200, 3))
    assert np.sqrt(((project(done.camera, q) - project(WET, q)) ** 2).mean()) < 0.1
    assert "window.thickness_1" in done.uncertainty.names


def test_a_surface_that_is_not_level_is_found():
    (wrong,) = found(ABOVE, config(SURFACE, normal=SURFACE.normal + np.array([0.05, 0, 0]), sigma=EXACT))
    assert wrong.code == "interface-wrong"


@pytest.mark.parametrize(("camera", "there"), [(WET, (0, 400, 0)), (ABOVE, (0, 0, -400))])
def test_a_plane_behind_all_points_that_look_wet_is_found(camera, there):
    # the sign of a coordinate is wrong: no line of sight meets the plane, and the camera is as one without it
    (wrong,) = found(camera, config(camera.through[0], point=there))
    assert (wrong.code, wrong.level) == ("interface-wrong", "doubtful")
    assert "on the camera's side" in wrong.text
    assert "through water" in wrong.text


def test_points_in_the_air_alone_do_not_accuse_a_surface_beyond_them():
    (unused,) = found(DRY, config(WINDOW, point=(0, 400, 0)))
    assert (unused.code, unused.level) == ("interface-unused", "note")


def test_a_wrong_index_is_found():
    (wrong,) = found(WET, config(WINDOW, indices=(1.0, 1.49, 1.0), sigma=EXACT))
    assert wrong.code == "interface-wrong"


def test_an_interface_that_is_refined_away_from_what_is_known_is_found():
    moved = config(MIDDLE, point=MIDDLE.point + np.array([0, 0, 60.0]), sigma={**EXACT, "position": 3})
    (wrong,) = found(BOTH, moved)
    assert "standard deviations" in wrong.text


def test_points_on_both_sides_are_all_used_and_refine_the_surface():
    done = calibrated(BOTH, config(MIDDLE, point=MIDDLE.point + np.array([0, 0, 4.0])))
    assert done.points["used"].all()
    sd = dict(zip(done.uncertainty.names, done.uncertainty.standard_errors, strict=True))
    assert sd["surface.position"] < 1.5  # 5 as it was known
    off = done.camera.through[0].deviation(MIDDLE)[0]
    assert abs(off) < 4 * sd["surface.position"]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_window_that_leans_by_4_degrees_more_than_stated_is_named(axis):
    """Known to half a degree, and by the points to half a degree: neither alone moves it by 4 standard deviations."""
    leaning = WINDOW.normal + np.tan(np.radians(4)) * WINDOW.axes[axis]
    assert "interface-wrong" in {f.code for f in found(WET, config(WINDOW, normal=leaning))}
