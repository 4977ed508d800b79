"""Where a target is expected is where it is, within the sd that is given."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.lost_targets.expected import BRIDGING, Expected, bridged_gaps, expected, in_picture, moments_of
from vidtrack.simulate.rig import thesis_rig

T = np.arange(200) / 30


def waves(seed=0, m=3):
    rng = np.random.default_rng(seed)
    hz, phase = rng.uniform(0.3, 1.5, (m, 1, 3)), rng.uniform(0, 6, (m, 1, 3))
    return rng.uniform(-5, 5, (m, 1, 3)) + 3 * np.sin(2 * np.pi * hz * T[:, None] + phase)


def alike(p, sd=0.01):
    """Places that are all known equally well."""
    return Expected(p, np.tile(sd**2 * np.eye(3), (*p.shape[:2], 1, 1)))


@pytest.mark.parametrize(("length", "most"), [(3, 0.05), (10, 0.2), (18, 1.2)])
def test_a_gap_is_bridged_within_the_error_that_stretches_without_a_gap_show(length, most):
    p = waves() + np.random.default_rng(1).normal(0, 0.003, (3, 200, 3))
    gap = p.copy()
    gap[:, 90 : 90 + length] = np.nan
    bridged = bridged_gaps(alike(gap))
    inner = slice(90, 90 + length)
    z = (bridged.p - p)[:, inner] / np.sqrt(np.einsum("...ii->...i", bridged.S[:, inner]))
    assert np.isfinite(z).all()
    assert np.sqrt(np.mean(z**2)) < 3
    assert np.abs((bridged.p - p)[:, inner]).max() < most  # of courses that go 6 in up and down
    assert np.isnan(bridged.p[:, :80]).all()


def test_places_beside_a_gap_that_are_hardly_known_do_not_lead_it_astray():
    """As of a ball that something has begun to hide: what is left of it lies elsewhere, and its sd says so."""
    p = waves() + np.random.default_rng(1).normal(0, 0.003, (3, 200, 3))
    seen = alike(p.copy())
    seen.p[:, 90:96] = np.nan
    seen.p[:, 87:90] += 0.2
    seen.S[:, 87:90] = 0.15**2 * np.eye(3)
    bridged = bridged_gaps(seen)
    inner = slice(87, 96)
    z = (bridged.p - p)[:, inner] / np.sqrt(np.einsum("...ii->...i", bridged.S[:, inner]))
    assert np.isfinite(z).all()
    assert np.sqrt(np.mean(z**2)) < 3


def test_long_gaps_and_short_courses_are_not_bridged():
    p = waves()
    p[0, 90 : 91 + BRIDGING.longest] = np.nan
    p[1, 10:] = np.nan
    bridged = bridged_gaps(alike(p))
    assert np.isnan(bridged.p[0, 95:108]).all()
    assert np.isnan(bridged.p[1]).all()


def test_a_few_moments_before_the_begin_and_after_the_end_are_expected():
    p = waves()
    cut = p.copy()
    cut[0, :50] = cut[0, 150:] = np.nan
    bridged = bridged_gaps(alike(cut))
    there = np.flatnonzero(np.isfinite(bridged.p[0, :, 0]))
    n = BRIDGING.beyond
    assert there.tolist() == [*range(50 - n, 50), *range(150, 150 + n)]
    assert np.abs(bridged.p[0, there] - p[0, there]).max() < 0.5


@pytest.mark.parametrize("n_cameras", [2, 3])
def test_what_other_cameras_see_says_where_a_target_is_in_the_picture(n_cameras):
    cameras, p = thesis_rig(n_cameras), waves()
    rng = np.random.default_rng(2)
    b = np.stack([project(c, p) for c in cameras])
    seen = b + rng.normal(0, 0.1, b.shape)
    seen[0, :, 90:96] = np.nan
    moments = np.arange(90, 96)
    known = p + rng.normal(0, 0.01, p.shape)
    if n_cameras == 2:
        known[:, 90:96] = np.nan
    where = in_picture(
        cameras[0], expected(cameras, seen, np.full(b.shape, 0.1), 0, 0.02, moments, bridged_gaps(alike(known)))
    )
    off = where.at - b[0][:, moments]
    sd = np.sqrt(np.einsum("...ii->...i", where.S))
    assert np.isfinite(off).all()
    assert 0.4 < np.sqrt(np.mean((off / sd) ** 2)) < 1.6
    assert (sd < 1.0).all()


def test_what_is_smoothed_counts_where_nothing_else_says_it_and_the_camera_sees_nothing():
    cameras, p = thesis_rig(2), waves(m=1)
    b = np.stack([project(c, p) for c in cameras])
    b[0, :, 91:93] = b[1, :, 92:94] = np.nan
    nothing = Expected(np.full(p.shape, np.nan), np.full((*p.shape, 3), np.nan))
    smoothed = Expected(p + 1.0, np.tile(np.eye(3), (1, p.shape[1], 1, 1)))
    moments = np.arange(90, 95)
    where = expected(cameras, b, np.full(b.shape, 0.1), 0, 0.02, moments, nothing, smoothed)
    assert np.isfinite(where.p[0, :, 0]).tolist() == [False, True, True, False, False]
    assert where.p[0, 1:3] == pytest.approx(p[0, 91:93] + 1.0)


def test_each_sample_has_its_nearest_moment():
    at = np.array([0.0, 0.1, 0.2, 0.3])
    times = np.array([0.001, 0.16, 0.29, 0.9, -1.0])
    assert moments_of(np.arange(5), times, at).tolist() == [0, 2, 3, 3, 0]
