import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.location.one_camera.plane import (
    MODELS,
    fit_plane,
    holds,
    on_one_line,
    scaled_plane,
    world_covariance,
    world_from_frame_buffer,
)

THESIS = Path(__file__).parents[3] / "data/thesis"
FACING = np.diag([1.0, -1.0, -1.0])
"""Camera axes of a camera that looks down on the plane, x right and y up in its picture."""


def grid(nx=5, ny=4, width=50.0, height=40.0):
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, nx), np.linspace(-height / 2, height / 2, ny))
    return np.stack([x.ravel(), y.ravel()], -1)


def seen(p, *, tilt_deg=0.0, kappa1=0.0, f=900.0, distance=100.0):
    R = rotation_from_vector([np.radians(tilt_deg), 0, 0]) @ FACING
    camera = Camera(255.5, 239.5, 1, 1, 1, f, kappa1, R, np.array([0, 0, distance]), (512, 480))
    return project(camera, np.column_stack([p, np.zeros(len(p))]))


def rms(d):
    return float(np.sqrt((d**2).sum(-1).mean()))


def test_39_px_are_a_foot():
    assert world_from_frame_buffer(scaled_plane(1 / 39), [78, 39]) == pytest.approx([2, 1])


def test_x_alone_is_stretched_by_the_aspect():
    assert world_from_frame_buffer(scaled_plane(0.14, 1.25), [100, 100]) == pytest.approx([17.5, 14])


def test_table_5_3_of_the_thesis_is_reproduced_to_its_printed_digits():
    """All 37 rows: 39 px a foot, and no aspect factor, though section 4.2 says that X is always multiplied by 1.25."""
    with open(THESIS / "table-5.3.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 37
    located = world_from_frame_buffer(scaled_plane(1 / 39), [[float(r["Xf"]), float(r["Yf"])] for r in rows])
    for (x, y), row in zip(located, rows, strict=True):
        assert (f"{x:.2f}", f"{y:.2f}") == (row["x_ft"], row["y_ft"]), row["timecode"]


def test_no_scale_but_39_px_a_foot_fits_table_5_3():
    with open(THESIS / "table-5.3.csv") as file:
        rows = list(csv.DictReader(file))
    b = np.array([[float(r["Xf"]), float(r["Yf"])] for r in rows])
    feet = np.array([[float(r["x_ft"]), float(r["y_ft"])] for r in rows])
    low, high = ((feet - 0.005) / b).max(), ((feet + 0.005) / b).min()
    assert low < 1 / 39 < high
    assert high - low < 2e-6
    misses = (np.abs(0.02565 * b - feet) > 0.005).any(1)
    assert misses.sum() == 8


@settings(max_examples=30, deadline=None)
@given(
    st.floats(0.01, 100), st.floats(-3, 3), st.floats(-1000, 1000), st.floats(0.5, 2), st.booleans(), st.integers(2, 8)
)
def test_a_scale_is_found_exactly_from_two_points_on(scale, angle, shift, aspect, mirrored, n):
    rng = np.random.default_rng(n)
    b = rng.uniform(0, 500, (n, 2))
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    side = -1 if mirrored or n == 2 else 1
    p = (b * [aspect, side]) @ turn.T + shift
    fit = fit_plane(b, p, aspect=aspect, model="scale")
    assert fit.plane.side == side
    assert np.abs(fit.residuals).max() < 1e-9 * (scale * 500 + abs(shift))


@settings(max_examples=20, deadline=None)
@given(st.floats(-25, 25), st.floats(-1.5e-7, 6e-7))
def test_any_tilted_and_distorted_view_is_undone_exactly(tilt, kappa1):
    p, new = grid(), grid(3, 3, 41, 29)
    fit = fit_plane(seen(p, tilt_deg=tilt, kappa1=kappa1), p, centre=(255.5, 239.5), model="radial")
    # Tsai's lens in mm and kappa1 here differ only by the unit, so the model is exact.
    assert np.abs(world_from_frame_buffer(fit.plane, seen(new, tilt_deg=tilt, kappa1=kappa1)) - new).max() < 1e-8


@pytest.mark.parametrize(
    ("tilt", "kappa1", "model"), [(0, 0, "scale"), (6, 0, "homography"), (0, 2e-7, "radial"), (10, 2e-7, "radial")]
)
def test_held_out_points_choose_the_model_that_made_the_picture(tilt, kappa1, model):
    p = grid()
    b = seen(p, tilt_deg=tilt, kappa1=kappa1) + np.random.default_rng(1).normal(0, 0.1, (20, 2))
    fit = fit_plane(b, p, sd=0.1, centre=(255.5, 239.5))
    assert fit.plane.model == model
    assert set(fit.held_out) == set(MODELS)


def test_the_lens_function_removes_what_a_scale_factor_leaves_at_the_edges():
    """Thesis 5.2: errors at the larger excursions, the problem of a constant factor for a nonlinear mapping."""
    p, new = grid(), grid(7, 7, 48, 38)
    b = seen(p, kappa1=2e-7) + np.random.default_rng(2).normal(0, 0.1, (20, 2))
    plain, rich = (fit_plane(b, p, centre=(255.5, 239.5), model=m) for m in ("scale", "auto"))
    errors = [rms(world_from_frame_buffer(f.plane, seen(new, kappa1=2e-7)) - new) for f in (plain, rich)]
    assert errors[0] > 0.05  # half a px of 1/9 in
    assert errors[1] < errors[0] / 5


def test_the_stated_uncertainty_is_the_error_that_noise_makes():
    p, new, rng = grid(), grid(4, 4, 44, 30), np.random.default_rng(3)
    clean, aim = seen(p, tilt_deg=8), seen(new, tilt_deg=8)
    ratios = []
    for _ in range(40):
        fit = fit_plane(clean + rng.normal(0, 0.2, clean.shape), p, sd=0.2, model="homography")
        error = world_from_frame_buffer(fit.plane, aim + rng.normal(0, 0.1, aim.shape)) - new
        C = world_covariance(fit.plane, aim, 0.1)
        ratios.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(C), error) / 2)
    assert 0.85 < np.mean(ratios) < 1.2


def test_noise_that_was_stated_too_small_is_made_up_for_by_the_misses():
    p, rng = grid(), np.random.default_rng(5)
    b = seen(p) + rng.normal(0, 0.3, p.shape)
    honest, bold = (fit_plane(b, p, sd=s, model="scale") for s in (0.3, 0.1))
    assert bold.chi2 == pytest.approx(9 * honest.chi2, rel=1e-6)
    assert bold.plane.covariance == pytest.approx(honest.plane.covariance * honest.chi2 / max(honest.chi2, 1), rel=1e-6)


def test_four_points_make_a_homography_only_where_noise_cannot_explain_a_scale():
    corners = grid(2, 2)
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 0.1, (4, 2))
    assert fit_plane(seen(corners) + noise, corners, sd=0.1).plane.model in ("scale", "affine")
    assert fit_plane(seen(corners, tilt_deg=20) + noise, corners, sd=0.1).plane.model == "homography"


def test_three_points_make_an_affine_map_only_where_noise_cannot_explain_a_scale():
    b = np.array([[100.0, 100], [400, 120], [150, 380]])
    sheared = (b - b.mean(0)) @ np.array([[0.1, 0.02], [0.0, 0.1]])
    assert fit_plane(b, sheared, sd=0.1).plane.model == "affine"
    assert fit_plane(b, sheared, sd=50.0).plane.model == "scale"


@pytest.mark.parametrize("term", [(3, 0), (2, 1), (1, 2), (0, 3)])
def test_each_cubic_term_of_a_map_is_fitted_exactly(term):
    b = seen(grid(7, 6))
    u, v = ((b - b.mean(0)) / 100).T
    p = grid(7, 6) + 0.5 * (u ** term[0] * v ** term[1])[:, None]
    fit = fit_plane(b, p, model="cubic")
    assert world_from_frame_buffer(fit.plane, b) == pytest.approx(p, abs=1e-6)


def test_points_on_one_line_give_a_scale_and_no_more():
    """The thesis's white dots on the rod, one foot apart."""
    p = np.column_stack([np.arange(6) * 12.0, np.zeros(6)])
    fit = fit_plane(seen(p - [30, 0]), p)
    assert fit.plane.model == "scale"
    with pytest.raises(ValueError, match="cannot hold the model 'homography'"):
        fit_plane(seen(p - [30, 0]), p, model="homography")


def test_one_point_is_refused():
    with pytest.raises(ValueError, match="needs two that differ"):
        fit_plane([[1, 2]], [[3, 4]])


def test_an_unknown_model_is_refused():
    with pytest.raises(ValueError, match="no model 'spline'"):
        fit_plane(grid(), grid(), model="spline")


def test_a_scale_must_be_positive():
    with pytest.raises(ValueError, match="must be positive"):
        scaled_plane(-1)


def test_a_lost_centroid_has_no_place():
    assert np.isnan(world_from_frame_buffer(scaled_plane(1), [np.nan, 3])).any()


@pytest.mark.parametrize("turn", [0.0, 0.3, 90.0, 37.0])
@pytest.mark.parametrize("n", [3, 5])
def test_a_line_is_a_line_whichever_way_it_runs(turn, n):
    """An upright line of three points held an affine map: 1,235 in off with a sigma of 24."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    along = np.linspace(0, 90, n)
    b = np.stack([c * along, s * along], -1) + np.random.default_rng(n).normal(0, 0.05, (n, 2)) + 300
    assert on_one_line(b)
    assert not holds("affine", b)
    assert not holds("homography", b)
    assert holds("affine", np.vstack([b, b[0] + [-30 * s, 30 * c]]))
