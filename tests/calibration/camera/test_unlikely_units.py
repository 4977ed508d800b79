"""Balls that come out far too large or small are places in other units than the config says."""

import numpy as np
import pytest

from vidtrack.calibration.camera.unlikely_units import unlikely_units
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig

CAMERA = thesis_rig(1)[0]  # a rig of some 100 in
P = thesis_points()[1]
IN_ONE = {"in": 1.0, "mm": 25.4, "cm": 2.54, "m": 0.0254, "ft": 1 / 12}
"""Numbers that an inch is written with in each unit."""


def written_in(unit):
    """The rig in numbers of a unit, and how large its balls of an inch look, px, across the line of sight."""
    k = IN_ONE[unit]
    camera, p = CAMERA.with_(T=CAMERA.T * k), P * k
    across = np.cross(p - camera.position, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    ends = [project(camera, p + sign * across * k / 2) for sign in (-1, 1)]
    return camera, p, np.hypot(*(ends[1] - ends[0]).T) / 2


@pytest.mark.parametrize("unit", ["in", "mm", "cm", "m", "ft"])
def test_balls_of_an_inch_are_no_doubt_in_their_own_unit(unit):
    assert unlikely_units(*written_in(unit), unit) == []


@pytest.mark.parametrize(
    ("unit", "said", "meant"),
    [
        ("mm", "in", "mm"),
        ("mm", "ft", "mm"),
        ("mm", "m", "mm"),
        ("cm", "m", "cm or in"),
        ("in", "m", "cm or in"),
        ("m", "mm", "m or ft"),
        ("ft", "mm", "m or ft"),
    ],
)
def test_the_units_that_may_be_meant_are_told_by_the_size_of_the_balls(unit, said, meant):
    (finding,) = unlikely_units(*written_in(unit), said)
    assert (finding.level, finding.code) == ("doubtful", "units-unlikely")
    assert finding.text.endswith(f"points.csv is likely in {meant}.")


def test_what_has_no_size_or_no_unit_says_nothing():
    camera, p, large = written_in("mm")
    assert unlikely_units(camera, p, np.full(len(p), np.nan), "in") == []
    assert unlikely_units(camera, p, large, "") == []
    few = np.where(np.arange(len(p)) < 5, large, 0.0)
    assert unlikely_units(camera, p, few, "in") == []
