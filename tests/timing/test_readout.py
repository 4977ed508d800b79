"""Rolling shutter: positions brought from the times of their rows to that of their frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.timing.readout import Readout, at_frame_time, table_at_frame_time
from vidtrack.video.orientation import Orientation

SIZE = (640, 480)
T = np.arange(60) / 30


def path(t):
    return np.stack([320 + 200 * np.sin(3 * t), 240 + 180 * np.cos(2 * t)], -1)


def rolled(readout, path=path, t=T):
    """What a rolling camera sees of a path in its frames."""
    seen = t
    for _ in range(20):
        seen = t + readout.delay(path(seen))
    return path(seen)


@pytest.mark.parametrize("seconds", [0.016, 0.03, -0.02])
@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
def test_a_smooth_track_is_brought_to_the_times_of_its_frames(seconds, rotation):
    readout = Readout(seconds, SIZE, rotation)
    seen = rolled(readout)
    back = at_frame_time(T, seen[None], readout)[0]
    assert np.abs(seen - path(T)).max() > 5
    assert np.abs(back - path(T))[2:-2].max() < 0.02
    assert np.abs(back - path(T)).max() < 0.03


def test_a_global_shutter_changes_nothing():
    b = np.random.default_rng(0).normal(300, 50, (2, 5, 2))
    assert at_frame_time(T[:5], b, Readout(0.0, SIZE)) is b


def test_gaps_stay_gaps_and_are_not_bridged():
    readout = Readout(0.02, SIZE)
    seen = rolled(readout)
    seen[20:26] = np.nan
    back = at_frame_time(T, seen[None], readout)[0]
    assert np.isnan(back[20:26]).all()
    assert np.isfinite(np.delete(back, np.arange(20, 26), 0)).all()
    assert np.abs(back - path(T))[[19, 26]].max() < 0.03


def test_a_sample_without_neighbours_has_no_velocity():
    b = np.full((1, 5, 2), np.nan)
    b[0, 2] = 100
    assert np.isnan(at_frame_time(T[:5], b, Readout(0.02, SIZE))).all()
    assert np.isnan(at_frame_time(T[:5], np.full((1, 5, 2), np.nan), Readout(0.02, SIZE))).all()


@given(st.booleans(), st.booleans(), st.booleans())
def test_the_share_follows_the_rows_of_the_stored_picture(transposed, flip_x, flip_y):
    own = Orientation(transposed, flip_x, flip_y)
    stored = np.repeat(np.arange(6, dtype=np.uint8)[:, None], 8, 1)  # each px says its row
    shown = own.applied(lambda picture: picture)(stored.copy())
    readout = Readout(1.0, (shown.shape[1], shown.shape[0]), own.rotation, own.mirrored)
    y, x = np.mgrid[0 : shown.shape[0], 0 : shown.shape[1]]
    assert readout.share(np.stack([x, y], -1).astype(float)) == pytest.approx((shown + 0.5) / 6)


def test_the_rows_of_a_table_are_brought_to_their_frames_track_by_track():
    readout = Readout(0.03, SIZE)
    other = path(T + 0.4)
    tracks = [rolled(readout), rolled(readout, lambda t: path(t + 0.4))]
    b = np.stack(tracks, 1).reshape(-1, 2)  # a moment's samples beside each other
    columns = {"time_s": np.repeat(T, 2), "track": np.tile([3, 7], len(T)), "Xf": b[:, 0], "Yf": b[:, 1]}
    back = table_at_frame_time(columns, "track", readout)
    assert np.abs(back["Yf"][::2] - path(T)[:, 1]).max() < 0.03
    assert np.abs(back["Yf"][1::2] - other[:, 1]).max() < 0.03
    loose = table_at_frame_time({**columns, "track": np.tile([3, -1], len(T))}, "track", readout)
    assert np.isnan(loose["Xf"][1::2]).all()  # of no track, and without a velocity
    assert (table_at_frame_time(columns, "track", Readout(0.0, SIZE))["Yf"] == b[:, 1]).all()
