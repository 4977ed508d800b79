"""Pairs of tracklets are worth what their lines of sight tell, moment by moment."""

import numpy as np
import pytest

from tests.association.swarm import as_tracklets, seen, swarm
from tests.geometry.underwater import SURFACE, looking
from vidtrack.association import pairs as module
from vidtrack.association.pairs import GAIN, LOSS, Side, bias_of, by_moment, pairs_of, rays_of
from vidtrack.association.tracklets import tracklets_of
from vidtrack.geometry.camera import project
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.simulate.rig import thesis_rig

CAMERAS = tuple(thesis_rig(2))


def sides(cameras, pieces):
    return [Side(*own) for own in zip(cameras, pieces, rays_of(cameras, [p.b for p in pieces]), strict=True)]


def pairs(tracks, bias_px=0.0, moments=None, noise=0.1):
    pieces = tuple(as_tracklets(t, noise)[0] for t in tracks)
    moments = np.arange(tracks[0].shape[1]) if moments is None else moments
    return pairs_of(*sides(CAMERAS, pieces), bias_px, moments)


def test_a_true_pair_is_worth_its_gain_less_half_a_nat_a_moment():
    rng = np.random.default_rng(0)
    tracks, orders = seen(CAMERAS, swarm(20, rng), rng)
    found = pairs(tracks)
    true = orders[0][found.a] == orders[1][found.b]
    assert true.sum() == 20
    assert (found.n[true] == 150).all()
    # chi^2 of one degree of freedom has mean 1; 20 x 150 of them have it to 0.026
    assert found.value[true].sum() / 3000 == pytest.approx(GAIN - 0.5, abs=0.04)
    assert found.value[~true].max() < 0.2 * found.value[true].min()
    assert found.noise[true] == pytest.approx(np.full(20, 0.01))
    assert found.square[true].mean() == pytest.approx(0.01, rel=0.1)


def test_what_the_calibration_leaves_is_seen_beside_moments_of_a_large_sd():
    """A target that another one hides in part for a while, in pictures whose calibration leaves a tenth of a pixel."""
    rng = np.random.default_rng(7)
    tracks, _ = seen(CAMERAS, swarm(6, rng), rng, noise=0.01)
    tracks[1] = tracks[1] + [0.0, 0.14]
    pieces = [as_tracklets(t, 0.01)[0] for t in tracks]
    unsure = pieces[1].sample < 75
    assert 0.3 < unsure.mean() < 0.7
    pieces[1].sd[unsure] = 0.5
    found = pairs_of(*sides(CAMERAS, pieces), 1.0, np.arange(150))
    assert 0.07 < bias_of([found], 0.02, 1.0) < 0.25


def test_a_moment_costs_no_more_than_its_loss():
    rng = np.random.default_rng(1)
    tracks, _ = seen(CAMERAS, swarm(1, rng), rng)
    whole = pairs(tracks).value[0]
    tracks[0][:, 40:50] += 300
    assert whole - pairs(tracks).value[0] == pytest.approx(10 * (GAIN - 0.5 + LOSS), abs=5)


def test_chi2_is_the_squared_epipolar_distance_over_its_variance():
    rng = np.random.default_rng(2)
    tracks, _ = seen(CAMERAS, swarm(1, rng)[:, :1], rng, noise=0.0)
    tracks[1] = tracks[1] + [0.3, 0.4]
    # all noise in the second picture: there the first-order distance over its sd is chi
    pieces = tuple(as_tracklets(t, sd)[0] for t, sd in zip(tracks, (1e-9, 0.2), strict=True))
    found = pairs_of(*sides(CAMERAS, pieces), 0.0, np.arange(1))
    d = epipolar_distance(*CAMERAS, tracks[0][0], tracks[1][0])[0]
    assert GAIN - found.value[0] == pytest.approx((d / 0.2) ** 2 / 2, rel=1e-6)


def test_what_is_left_by_the_calibration_widens_every_miss():
    rng = np.random.default_rng(3)
    tracks, _ = seen(CAMERAS, swarm(3, rng), rng)
    tracks[1] = tracks[1] + [0, 1.0]
    assert pairs(tracks, 1.0).value.max() > 2 * 150
    assert not (pairs(tracks, 0.0).value > 0).any()
    assert 0.2 < bias_of([pairs(tracks, 1.0)], 0.02, 2.0) < 1.5


def test_some_moments_tell_the_same_as_all_of_them_in_proportion():
    rng = np.random.default_rng(4)
    tracks, _ = seen(CAMERAS, swarm(2, rng), rng)
    tracks[0][0, 30:60] = np.nan
    some = pairs(tracks, moments=np.arange(0, 150, 5))
    assert some.n.max() == 30
    assert some.value.max() == pytest.approx(pairs(tracks).value.max() / 5, rel=0.1)


def test_tracklets_without_a_common_moment_are_no_pair():
    rng = np.random.default_rng(5)
    tracks, _ = seen(CAMERAS, swarm(1, rng), rng)
    tracks[0][:, :75], tracks[1][:, 75:] = np.nan, np.nan
    assert not pairs(tracks).a.size
    assert bias_of([pairs(tracks)], 0.02, 0.7) == 0.7


def test_targets_above_and_in_the_water_both_find_their_images():
    # two cameras above a surface; one target in the water, one in the air, far from each other
    cameras = tuple(looking(place, SURFACE) for place in ((-600.0, -700, 1500), (700.0, -500, 1500)))
    t = np.arange(40)
    paths = [np.stack([x + 60 * np.sin(t / 9), 40 * np.cos(t / 7), z + 0 * t], -1) for x, z in ((-100, 0), (120, 200))]
    pieces = tuple(
        tracklets_of(
            np.repeat([0, 1], 40), np.tile(t, 2), np.concatenate([project(c, p) for p in paths]), np.full((80, 2), 0.1)
        )
        for c in cameras
    )
    found = pairs_of(*sides(cameras, pieces), 0.05, t)
    value = dict(zip(zip(found.a.tolist(), found.b.tolist(), strict=True), found.value, strict=True))
    for own in (0, 1):
        assert value[own, own] > 0.9 * 40 * GAIN
        assert max((v for pair, v in value.items() if pair != (own, own) and own in pair), default=0) < value[own, own]


@pytest.mark.parametrize("piece", [7, 16_384])
def test_each_row_lies_at_its_own_moment_whatever_pieces_they_are_written_in(monkeypatch, piece):
    monkeypatch.setattr(module, "PIECE", piece)
    rng = np.random.default_rng(6)
    tracks, _ = seen(CAMERAS, swarm(3, rng), rng)
    tracks[0][0, 20:40] = np.nan
    pieces, _ = as_tracklets(tracks[0], 0.1)
    pieces = pieces._replace(sample=pieces.sample - 30)  # a shift of the clock may lead before the first moment
    rays = rays_of(CAMERAS[:1], [pieces.b])[0]
    moments = np.arange(-20, 100, 3)
    found = by_moment(pieces, rays, 0.2, moments)
    for moment, at in zip(moments, found.at, strict=True):
        assert sorted(found.row[at[at >= 0]]) == np.flatnonzero(pieces.sample == moment).tolist()
    there = found.at >= 0
    row = found.row[found.at[there]]
    assert np.array_equal(found.u[there], rays.u[row].astype(np.float32))
    variance = pieces.sd[row] ** 2 + 0.2**2
    whole = np.concatenate([rays.u[row], rays.by_x[row], rays.by_y[row], variance], axis=1)
    assert np.array_equal(found.packed[found.at[there]], whole)
    spread = (rays.by_x[row] ** 2 * variance[:, :1] + rays.by_y[row] ** 2 * variance[:, 1:]).sum(axis=1)
    assert found.spread[there] == pytest.approx(spread, rel=1e-6)
