"""Which looks of which cameras are compared with the calibration's balls."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.cameras.ball_sizes import px_per_unit
from vidtrack.location.cameras.run_sizes import run_sizes
from vidtrack.location.cameras.views import View
from vidtrack.simulate.rig import thesis_rig

AT = np.arange(40) / 10.0
LATE_S = 2.0
COURSE = np.stack([12 * np.sin(AT), 4 * np.cos(AT), np.zeros_like(AT)], -1)
CAMERAS = dict(zip(("cam1", "cam2"), thesis_rig(2), strict=True))


def view(name):
    empty = np.zeros((0, 2))
    return View(
        name, CAMERAS[name], None, AT - LATE_S, (), [], empty, empty, (), True, empty.astype(int), (), np.zeros(0, bool)
    )


def looks(name, larger=1.01):
    px = project(CAMERAS[name], COURSE)
    width = larger * px_per_unit(CAMERAS[name], COURSE)
    return {"track": {"time_s": AT - LATE_S, "Xf": px[:, 0], "Yf": px[:, 1], "width": width}}


def balls(name):
    p = np.random.default_rng(2).uniform(-10, 10, (20, 3))
    width = px_per_unit(CAMERAS[name], p) * np.exp(np.random.default_rng(3).normal(0, 1e-3, 20))
    return {"x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "Xf": project(CAMERAS[name], p)[:, 0], "width": width}


def found(widths, known, lit=None, otherwise=()):
    views = [view(name) for name in CAMERAS]
    return run_sizes(views, [AT, AT], (AT, COURSE[None], ["t1"]), widths, known, lit or {}, otherwise)


def test_looks_are_taken_at_corrected_times_and_outlines_are_told_from_light():
    widths, known = ({name: own(name) for name in CAMERAS} for own in (looks, balls))
    sizes = found(widths, known, lit={"cam1": 0.0, "cam2": 0.03})
    assert list(sizes) == ["cam1", "cam2"]
    for own in sizes.values():
        assert own["targets"]["t1"]["n"] == 40
        assert own["targets"]["t1"]["larger"] == pytest.approx(np.log(1.01), abs=2e-3)
    assert "lasting" in sizes["cam1"]
    assert "lasting" not in sizes["cam2"]


def test_cameras_whose_balls_are_lit_otherwise_or_have_no_width_are_left_out():
    widths, known = ({name: own(name) for name in CAMERAS} for own in (looks, balls))
    assert list(found(widths, known, otherwise={"cam1"})) == ["cam2"]
    assert list(found(widths, {"cam1": known["cam1"]})) == ["cam1"]
    assert found({}, known) == {}
