"""Pictures kept on the way: spread over the recording, of bounded size, damaged ones left out."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.steadiness.samples import BackgroundSamples, Keeping, averaged, in_averaged, in_recording
from vidtrack.timing.frame import Frame


def frames(n, shape=(40, 60), damaged=()):
    for k in range(n):
        yield Frame(k, Fraction(k, 30), np.full(shape, k % 250, np.uint8), k in damaged, None)


def kept(n, keeping=None, **more):
    samples = BackgroundSamples(keeping or Keeping())
    assert sum(1 for _ in samples.over(frames(n, **more))) == n
    return samples


@pytest.mark.parametrize("n", [1, 7, 100, 3001])
def test_no_more_are_kept_than_asked_and_they_reach_over_the_whole_recording(n):
    samples = kept(n, Keeping(most=16, stride=2))
    assert 1 <= len(samples.pictures) <= 16
    steps = np.diff(samples.frames)
    assert len(set(steps.tolist())) <= 1
    assert n - 1 - samples.frames[-1] <= 2 * (steps[0] if len(steps) else 2)
    assert [int(p[0, 0]) for p in samples.pictures] == [k % 250 for k in samples.frames]


def test_memory_bounds_how_many_are_kept():
    assert len(kept(500, Keeping(memory=40 * 60 * 20, least=2, stride=1)).pictures) <= 20


def test_the_reference_is_the_mean_of_the_first_good_frames():
    assert kept(50, Keeping(first=4), damaged={1}).reference[0, 0] == pytest.approx((0 + 2 + 3 + 4) / 4)


def test_a_damaged_recording_has_no_reference():
    samples = kept(5, damaged=range(5))
    assert samples.reference is None
    assert not len(samples.pictures)


def test_large_pictures_are_averaged_in_blocks_and_places_follow():
    samples = kept(3, Keeping(pixels=600), shape=(41, 60))
    assert samples.block == 3
    assert samples.reference.shape == (13, 20)
    luma = np.arange(24, dtype=np.uint8).reshape(4, 6) * 4
    assert averaged(luma, 2)[0, 0] == np.mean([0, 4, 24, 28])
    b = np.array([[0.0, 0.0], [2.5, 7.0]])
    assert np.allclose(in_averaged(in_recording(b, 2), 2), b)
    assert np.allclose(in_recording(np.zeros(2), 2), 0.5)
