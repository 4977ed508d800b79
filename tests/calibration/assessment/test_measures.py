"""Willson's measures, against his own sample and by hand."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.calibration.assessment.measures import (
    distorted_error,
    measures,
    normalised_error,
    object_space_error,
    summary,
    undistorted_error,
)
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form
from vidtrack.geometry.camera import Camera, line_of_sight, project
from vidtrack.simulate.rig import thesis_points, thesis_rig

REAL = Path(__file__).parents[3] / "../shared/real/points"

PLAIN = Camera(256.0, 240.0, 0.02, 0.01, 1.0, 10.0, 0.0, np.eye(3), np.array([0.0, 0.0, 100.0]), (512, 480))
"""Looks along z from (0, 0, -100); 0.2 units a column, 0.1 units a row at the origin."""


def test_one_pixel_off_on_the_axis_by_hand():
    p, b = np.zeros((1, 3)), np.array([[257.0, 240.0]])  # one column right of where the origin is seen
    assert distorted_error(PLAIN, p, b)[0] == pytest.approx([1, 0])
    assert undistorted_error(PLAIN, p, b)[0] == pytest.approx([1, 0])
    # the line leaves the centre at 0.02/10 rad: 0.2 units at 100, less the cosine of that angle
    assert object_space_error(PLAIN, p, b)[0] == pytest.approx(0.2 * np.cos(np.arctan(0.002)))
    # 0.2 units over 100 sqrt((1/500^2 + 1/1000^2)/12)
    assert normalised_error(PLAIN, p, b)[0] == pytest.approx(0.2 / (100 * np.sqrt((500**-2 + 1000**-2) / 12)))


def test_summary_by_hand():
    assert summary([3.0, 4.0, np.nan, 5.0]) == (4.0, 1.0, 5.0, 50.0, 3)
    assert summary([2.0]) == (2.0, 0.0, 2.0, 4.0, 1)
    assert summary([np.nan]).n == 0
    assert np.isnan(summary([]).mean)


@pytest.mark.skipif(not REAL.exists(), reason="the shared real points are not here")
def test_willsons_sample_has_the_errors_that_its_true_optimum_has():
    """Independent optimum of his 300 points: sum of squares 2.399750 px^2, normalised calibration error .193552."""
    table = np.genfromtxt(REAL / "willson_ncc/cam1.csv", delimiter=",", skip_header=1)
    p, b = table[:, 1:4], table[:, 4:6]
    start = camera_from_closed_form(closed_form(p, b, Cx=258, Cy=204, dx=0.023, dy=0.023), (576, 384))
    found = measures(refine(start, p, b, free=free_parameters("tsai")).camera, p, b)
    assert found.distorted.sse == pytest.approx(2.399750, abs=1e-6)
    assert found.normalised.mean == pytest.approx(0.193552, abs=1e-6)
    assert found.distorted.n == 300


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000))
def test_the_four_measures_agree_to_first_order(seed):
    """A small step in the picture is the same step undistorted, times the lens's gain; and an angle in the world."""
    rng = np.random.default_rng(seed)
    camera, p = thesis_rig(1)[0], thesis_points()[1]
    step = rng.normal(0, 1e-4, (64, 2))
    b = project(camera, p) + step
    assert np.allclose(distorted_error(camera, p, b), step, atol=1e-9)
    gain = np.linalg.norm(undistorted_error(camera, p, b), axis=-1) / np.linalg.norm(step, axis=-1)
    assert (np.abs(gain - 1) < 0.05).all()  # barrel of 8e-4/mm^2 within 3 mm of the axis: 1 + 3 kappa1 r^2
    origin, direction = line_of_sight(camera, b)
    far = np.linalg.norm(p - origin, axis=-1)
    angle = np.arccos(np.clip(((p - origin) * direction).sum(-1) / far, -1, 1))
    assert np.allclose(object_space_error(camera, p, b), far * np.sin(angle), atol=1e-5)


def test_points_that_are_missing_or_behind_are_passed_over():
    p = np.array([[0.0, 0, 0], [0, 0, -200.0], [0, 0, 10]])
    b = np.array([[256.0, 240.0], [256, 240], [np.nan, np.nan]])
    found = measures(PLAIN, p, b)
    assert found.distorted.n == found.undistorted.n == 1
    assert found.distorted.sse == 0
