"""The shift at which tracklets of two cameras fit each other is that of their recordings."""

import numpy as np
import pytest

from tests.association.swarm import as_tracklets, seen, swarm
from vidtrack.association.offsets import shift_worths
from vidtrack.simulate.rig import thesis_rig


@pytest.mark.parametrize("n", [1, 8, 30])
def test_a_recording_that_began_later_is_found_to_the_sample(n):
    rng = np.random.default_rng(n)
    cameras = tuple(thesis_rig(2))
    tracks, _ = seen(cameras, swarm(n, rng), rng)
    tracks = [tracks[0][:, :130], tracks[1][:, 9:]]  # its sample 0 is sample 9 of the first
    pieces = tuple(as_tracklets(t)[0] for t in tracks)
    shifts = np.arange(-20, 21)
    worth = shift_worths(cameras, pieces, shifts, 0.5)
    assert shifts[np.argmax(worth)] == 9
    assert np.max(worth) > 1.5 * np.max(np.delete(worth, [28, 29, 30]))


def test_recordings_that_share_no_moment_are_worth_nothing():
    rng = np.random.default_rng(0)
    cameras = tuple(thesis_rig(2))
    pieces = tuple(as_tracklets(t)[0] for t in seen(cameras, swarm(2, rng), rng)[0])
    assert shift_worths(cameras, pieces, np.array([1000]), 0.5).tolist() == [0.0]
