"""One camera that errs is found by what the others agree upon."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_rig


def scene(n, size, seed=0):
    rng = np.random.default_rng(seed)
    cameras = thesis_rig(n)
    p = rng.uniform(-1, 1, (size, 3)) * (25, 6, 9)
    b = np.stack([project(c, p) for c in cameras])
    return cameras, p, b + rng.normal(0, 0.1, b.shape), rng


def test_the_camera_that_errs_is_left_out_and_no_other():
    cameras, p, b, rng = scene(4, 5000)
    bad = rng.integers(0, 4, len(p))
    angle = rng.uniform(0, 2 * np.pi, len(p))
    b[bad, np.arange(len(p))] += 12 * np.stack([np.cos(angle), np.sin(angle)], -1)
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert (located.left_out.sum(0) == 1).all()
    assert (np.argmax(located.left_out, 0) == bad).all()
    assert (located.n_cameras == 3).all()
    without = np.where(np.arange(4)[:, None, None] == bad[:, None], np.nan, b)
    assert located.point == pytest.approx(locate_points(cameras, without, sd=0.1).point, abs=1e-6)
    assert np.mean(((located.point - p) / located.sigma) ** 2) == pytest.approx(1, abs=0.06)


def test_good_cameras_are_never_left_out():
    cameras, _, b, _ = scene(4, 5000)
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert not located.left_out.any()
    assert not located.disagree.any()


def test_two_cameras_that_disagree_give_no_fix_but_their_miss():
    cameras, _, b, _ = scene(2, 100)
    b[1, :, 1] += 40
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert located.disagree.all()
    assert np.isnan(located.point).all()
    assert not located.left_out.any()
    assert (located.miss > 1).all()  # 40 px of 0.2 in, shared by two lines of sight
    assert np.isfinite(locate_points(cameras, b, sd=0.1).point).all()  # unless nobody asked


def test_a_camera_that_could_as_well_be_right_leaves_the_point_undecided():
    # camera 1 sees both p and q on one line; camera 2 sees p, camera 3 sees q
    cameras = thesis_rig(3)
    p = np.zeros(3)
    q = p + 0.15 * (cameras[0].position - p)
    b = np.stack([project(cameras[0], p), project(cameras[1], p), project(cameras[2], q)])
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert located.disagree
    assert np.isnan(located.point).all()


def test_two_against_two_is_no_majority():
    cameras = thesis_rig(4)
    p, q = np.zeros(3), np.array([5.0, 12, -8])
    b = np.stack([project(c, place) for c, place in zip(cameras, (p, p, q, q), strict=True)])
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert located.disagree
    assert np.isnan(located.point).all()
    assert not located.left_out.any()
    assert located.n_cameras == 0


def test_two_of_five_cameras_are_left_out():
    cameras, p, b, _ = scene(4, 200)
    fifth = cameras[0].with_(T=cameras[0].T + np.array([30.0, 0, 0]))
    cameras, b = [*cameras, fifth], np.concatenate([b, project(fifth, p)[None]])
    b[1] += [9.0, -7.0]
    b[3] += [-8.0, -11.0]
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert (located.left_out.sum(1) == [0, 200, 0, 200, 0]).mean() == 1
    assert np.linalg.norm(located.point - p, axis=-1).max() < 0.2


def test_a_lost_camera_is_not_left_out_again():
    cameras, _, b, _ = scene(4, 10)
    b[0] = np.nan
    b[2] += [15, -4]
    located = locate_points(cameras, b, sd=0.1, reject=2.0)
    assert not located.left_out[0].any()
    assert located.left_out[2].all()
    assert (located.n_cameras == 2).all()


def test_a_camera_that_says_how_roughly_it_sees_contradicts_no_other():
    cameras, p, b, _ = scene(4, 200)
    b[3] += [7.0, 0.0]
    sd = np.broadcast_to(np.array([0.1, 0.1, 0.1, 4.0])[:, None, None], b.shape)
    strict = locate_points(cameras, b, sd=sd, reject=2.0)
    assert strict.disagree.any()  # what it says is worth so little that nothing shows who errs
    located = locate_points(cameras, b, sd=sd, reject=np.array([2.0, 2.0, 2.0, 24.0])[:, None])
    assert not located.disagree.any()
    assert np.abs((located.point - p) / located.sigma).max() < 5


def test_odds_of_ninety_to_one_decide_between_two_cameras_that_may_err():
    """Twice the log of the odds is the difference of the two sums of weighted squares: 9."""
    cameras, _, b, _ = scene(4, 1, seed=5)
    b += np.random.default_rng(5).normal(0, 3.0, b.shape)
    b[2] += [12.0, 0.0]
    squares = []
    for i in range(4):
        rest = np.where(np.arange(4)[:, None, None] == i, np.nan, b)
        squares.append(np.nansum(locate_points(cameras, rest, sd=1.0).error ** 2))
    best, second = np.sort(squares)[:2]
    assert np.argmin(squares) == 2
    assert best > 0.1 * second
    for share, decided in ((0.97, True), (1.03, False)):
        sd = share * np.sqrt((second - best) / 9)
        located = locate_points(cameras, b, sd=sd, reject=9.0)
        assert located.left_out[2].all() == decided
        assert located.disagree.all() != decided
