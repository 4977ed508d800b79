"""Two cameras that know nothing of each other: exact sights give their relation exactly."""

import numpy as np
import pytest

from tests.calibration.wand.waved import waved
from vidtrack.calibration.wand.ends import orders, stretches
from vidtrack.calibration.wand.pairs import algebraic_misfit, find_pair, fundamental, meeting, poses_of, sampson, starts
from vidtrack.geometry.camera import undistorted_from_frame_buffer
from vidtrack.geometry.epipolar import essential


def _pinhole(scene):
    """Sights without lens, px of square pixels from the principal point."""
    out = []
    for camera, b in zip(scene.cameras, scene.b, strict=True):
        out.append(undistorted_from_frame_buffer(camera, b) / camera.dx)
    return out


def test_the_fundamental_matrix_of_exact_sights_has_no_error_and_mixed_up_balls_have_a_large_one():
    scene = waved(1, noise=0.0)
    a, b = (own.reshape(-1, 2) for own in _pinhole(scene))
    good = np.isfinite(a).all(-1) & np.isfinite(b).all(-1)
    F = fundamental(a[good], b[good])
    assert sampson(F, a[good], b[good]).max() < 1e-6
    assert algebraic_misfit(a[good], b[good]) < 1e-6
    assert algebraic_misfit(a[good], b[good][::-1]) > 1e-2


@pytest.mark.parametrize("seed", range(3))
def test_a_pair_is_found_whichever_way_its_balls_are_named(seed):
    scene = waved(seed, noise=0.1)
    a, b = _pinhole(scene)
    ways = orders(scene.wand.lengths)
    whole = [find_pair(a, own, stretches(a), ways, 512, np.random.default_rng(0)) for own in (b, b[:, ::-1])]
    for pair in whole:
        assert pair is not None
        assert pair.inlier.mean() > 0.9
        assert pair.error < 0.5
    assert (whole[0].order[whole[0].inlier] != whole[1].order[whole[0].inlier]).all()


def test_focal_lengths_are_those_by_which_the_wand_keeps_its_length():
    scene = waved(2, noise=0.05)
    a, b = _pinhole(scene)
    ways = orders(scene.wand.lengths)
    pair = find_pair(a, b, stretches(a), ways, 512, np.random.default_rng(0))
    b = np.take_along_axis(b, np.array(ways)[pair.order][..., None], 1)
    true = [c.f / c.dx for c in scene.cameras]
    f = [tuple(own * np.array([0.6, 0.8, 1.0, 1.25, 1.6])) for own in true]
    best = starts(pair, a, b, scene.wand.lengths, (np.zeros(2), np.zeros(2)), tuple(f))[0]
    np.testing.assert_allclose(best.f, true)
    assert best.spread < 0.02
    length = np.linalg.norm(best.points[:, 0] - best.points[:, 1], axis=-1)
    assert np.nanmedian(np.abs(length / np.nanmedian(length) - 1)) < 0.02


def test_one_of_the_four_poses_of_an_essential_matrix_is_the_true_one():
    a, b = waved(0).cameras
    R, t = b.R @ a.R.T, b.R @ (a.position - b.position)
    found = [
        (np.abs(own - R).max(), np.abs(shift - t / np.linalg.norm(t)).max()) for own, shift in poses_of(essential(a, b))
    ]
    assert min(max(each) for each in found) < 1e-9


def test_lines_of_sight_meet_where_the_point_is():
    a, b = waved(0).cameras
    R, t = b.R @ a.R.T, b.R @ (a.position - b.position)
    p = np.array([[1.0, 2.0, 50.0], [-5.0, 3.0, 120.0]])
    other = p @ R.T + t
    np.testing.assert_allclose(meeting(p / p[:, 2:], other / other[:, 2:], R, t), p, atol=1e-9)


def test_too_few_common_moments_are_no_pair():
    scene = waved(0)
    a, b = scene.b
    b = b.copy()
    b[8:] = np.nan
    assert find_pair(a, b, stretches(a), orders(scene.wand.lengths), 512, np.random.default_rng(0)) is None
