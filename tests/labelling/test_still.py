"""A still is the mean of a clip, whatever passes before the lens."""

from typing import NamedTuple

import numpy as np
import pytest

from vidtrack.labelling.still import KEPT, average, sample


class F(NamedTuple):
    luma: np.ndarray
    corrupt: bool = False


def scene(n, noise=3.0, seed=0, shape=(120, 160)):
    rng = np.random.default_rng(seed)
    truth = rng.uniform(100, 200, shape)
    lumas = np.clip(np.rint(truth + rng.normal(0, noise, (n, *shape))), 0, 255).astype(np.uint8)
    return truth, lumas


def test_the_mean_of_n_frames_has_the_noise_over_root_n():
    truth, lumas = scene(36)
    still = average(lumas)
    error = (still.mean - truth).std()
    expected = np.hypot(3.0, 12**-0.5) / 6
    # 19200 pixels tell a standard deviation to 0.5 %; leaving out what lies beyond 4 sigma costs next to nothing
    assert 0.97 * expected < error < 1.05 * expected
    assert np.median(still.sd) == pytest.approx(np.hypot(3.0, 12**-0.5), rel=0.03)
    assert still.left_out < 0.002


def test_a_shadow_that_passes_leaves_no_trace():
    truth, lumas = scene(40)
    shaded = lumas.copy()
    for k in range(8, 32):  # no column lies in shadow for more than 9 of 40 frames
        shaded[k, :, (k - 8) * 7 : (k - 8) * 7 + 60] //= 2
    clean, still = average(lumas), average(shaded)
    assert np.abs(shaded.mean(0) - truth).max() > 15
    # what is left out costs its share of the averaging, and nothing else
    assert (still.mean - truth).std() < 1.4 * (clean.mean - truth).std()
    assert np.abs((still.mean - truth).mean()) < 0.05
    assert still.left_out == pytest.approx(24 * 60 / (40 * 160), rel=0.3)


def test_the_edge_of_a_trembling_ball_stays_where_it_is_on_average():
    rng = np.random.default_rng(4)
    edges = rng.normal(30, 0.3, 40)
    profile = 30 + 170 / (1 + np.exp(-(np.arange(60)[None] - edges[:, None]) / 0.7))
    lumas = (profile[:, None] + rng.normal(0, 2, (40, 50, 60))).round().astype(np.uint8)
    mean = average(lumas).mean.mean(0)
    # the light that is missing tells where the edge lies, to the 0.005 px that noise leaves
    assert 59.5 - (mean - 30).sum() / 170 == pytest.approx(edges.mean(), abs=0.02)


def test_two_frames_are_averaged_and_one_is_left_as_it_is():
    _, lumas = scene(2)
    assert average(lumas).mean == pytest.approx(lumas.mean(0))
    alone = average(lumas[:1])
    assert (alone.mean == lumas[0]).all()
    assert np.isnan(alone.sd).all()


def test_a_long_clip_is_sampled_evenly_from_end_to_end():
    taken = sample(F(np.full((4, 4), k % 256, np.uint8)) for k in range(1000))
    assert len(taken.lumas) <= KEPT
    assert len(taken.lumas) >= KEPT // 2
    assert taken.seen == 1000
    indices = np.unwrap(taken.lumas[:, 0, 0].astype(float), period=256)
    assert len(set(np.diff(indices))) == 1
    assert indices[-1] > 960


def test_memory_bounds_how_many_frames_are_kept():
    taken = sample((F(np.zeros((100, 100), np.uint8)) for _ in range(500)), memory=200_000)
    assert 10 <= len(taken.lumas) <= 20


def test_a_frame_is_copied_before_the_next_is_asked_for():
    shared = np.zeros((4, 4), np.uint8)

    def frames():
        for k in range(5):
            shared[:] = k
            yield F(shared)

    assert sample(frames()).lumas[:, 0, 0].tolist() == [0, 1, 2, 3, 4]


def test_damaged_frames_are_passed_over_and_counted():
    taken = sample([F(np.zeros((4, 4), np.uint8), k == 1) for k in range(3)])
    assert (len(taken.lumas), taken.seen, taken.damaged) == (2, 3, 1)


def test_frames_of_different_sizes_and_clips_without_a_good_frame_are_refused():
    with pytest.raises(ValueError, match="5, 4"):
        sample([F(np.zeros((4, 4), np.uint8)), F(np.zeros((4, 5), np.uint8))])
    with pytest.raises(ValueError, match="no good frame"):
        sample([F(np.zeros((4, 4), np.uint8), True)])
