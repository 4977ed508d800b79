"""Eliminating the points must change nothing: the dense equations are the witness."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment.normal_equations import covariance, solved
from vidtrack.calibration.adjustment.unknowns import columns
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.calibration.normal_equations import linearised, normal_equations, sight_equations
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")


def _case(seed: int = 0, n: int = 12, m: int = 3):
    rng = np.random.default_rng(seed)
    cameras, p = thesis_rig(m), thesis_points()[1][:: 64 // n][:n]
    seen = linearised(cameras, p, p.mean(0))
    residual = rng.normal(0, 0.1, seen.projected.shape)
    weight = np.full(seen.projected.shape, 1 / 0.1**2)
    weight[1, 3] = 0  # camera 1 lost point 3
    residual[1, 3] = np.nan
    information = np.full((n, 3), 1 / 0.03**2)
    information[5] = np.inf  # an exact point
    shift = rng.normal(0, 0.03, (n, 3))
    return cameras, seen, residual, weight, information, shift


def _dense(seen, residual, weight, free, information, shift):
    """All equations one below the other, nothing eliminated; exact points have no column."""
    n = residual.shape[1]
    places = columns(free)
    K = places[-1][0].stop
    moving = np.flatnonzero(np.isfinite(information).all(-1))
    rows, right = [], []
    for i, (place, names) in enumerate(places):
        for j in range(n):
            for k in range(2):
                if weight[i, j, k] == 0:
                    continue
                row = np.zeros(K + 3 * len(moving))
                row[place] = seen.by_parameter[i, j, k, names]
                if j in moving:
                    at = K + 3 * list(moving).index(j)
                    row[at : at + 3] = seen.by_point[i, j, k]
                rows.append(row * np.sqrt(weight[i, j, k]))
                right.append(residual[i, j, k] * np.sqrt(weight[i, j, k]))
    for a, j in enumerate(moving):
        for k in range(3):
            row = np.zeros(K + 3 * len(moving))
            row[K + 3 * a + k] = np.sqrt(information[j, k])
            rows.append(row)
            right.append(shift[j, k] * np.sqrt(information[j, k]))
    return np.array(rows), np.array(right), K, moving


def test_eliminating_the_points_gives_the_step_of_the_whole_system():
    _, seen, residual, weight, information, shift = _case()
    free = [FREE] * 3
    cameras, (points,) = solved(normal_equations(seen, residual, weight, free, information, shift))
    A, right, K, moving = _dense(seen, residual, weight, free, information, shift)
    scale = np.linalg.norm(A, axis=0)
    whole = np.linalg.lstsq(A / scale, right, rcond=None)[0] / scale
    sd = np.sqrt(np.diag(np.linalg.inv((A / scale).T @ (A / scale)))) / scale
    np.testing.assert_allclose(cameras / sd[:K], whole[:K] / sd[:K], atol=1e-6)
    np.testing.assert_allclose(points[moving].ravel() / sd[K:], whole[K:] / sd[K:], atol=1e-6)
    assert (points[5] == 0).all()


def test_covariances_are_those_of_the_whole_system():
    _, seen, residual, weight, information, shift = _case()
    free = [FREE, FREE[:6], FREE]
    equations = sight_equations(seen, residual, weight, free)
    found = covariance(normal_equations(seen, residual, weight, free, information, shift), equations)
    (points,) = found.blocks
    deviations = np.reshape(found.fitted, residual.shape)
    A, _, K, moving = _dense(seen, residual, weight, free, information, shift)
    scale = np.linalg.norm(A, axis=0)
    whole = np.linalg.inv((A / scale).T @ (A / scale)) / np.outer(scale, scale)
    sd = np.sqrt(np.diag(whole))
    np.testing.assert_allclose(
        found.shared / np.outer(sd[:K], sd[:K]), whole[:K, :K] / np.outer(sd[:K], sd[:K]), atol=1e-6
    )
    for a, j in enumerate(moving):
        block = whole[K + 3 * a : K + 3 * a + 3, K + 3 * a : K + 3 * a + 3]
        np.testing.assert_allclose(points[j], block, rtol=1e-6, atol=1e-12)
    assert (points[5] == 0).all()
    # the variances of the fitted positions, weighted, add up to the number of unknowns less what the survey told
    fitted = ((A @ whole) * A).sum(1)
    sights = int((weight > 0).sum())
    np.testing.assert_allclose((deviations * weight)[weight > 0].sum(), fitted[:sights].sum(), rtol=1e-6)


def test_what_the_sights_leave_open_is_refused():
    _, seen, residual, weight, information, shift = _case()
    free = [FREE] * 3
    normal = normal_equations(
        seen, residual, np.where(np.arange(3)[:, None, None] == 2, 0, weight), free, information, shift
    )
    with pytest.raises(ValueError, match="open"):
        covariance(normal, [])
