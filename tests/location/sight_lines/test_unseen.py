"""Where a camera should see a target and followed nothing."""

import numpy as np

from tests.location.cameras.test_views import CAMERA, view
from vidtrack.geometry.camera import project
from vidtrack.location.cameras.views import brought
from vidtrack.location.sight_lines.unseen import LIMITS, shares_seen, unseen

T = 10
PLACE = np.tile([2.0, -1.0, 3.0], (1, T, 1))
THERE = project(CAMERA, PLACE)
DIAGONAL = np.hypot(*CAMERA.image_size)


def found(off=0.0, point=PLACE, gone=(), at=None, times=None):
    """Moments that are called unseen where the camera followed something off px beside the place, but at `gone`."""
    b = THERE + np.array([off, 0.0])
    b[0, list(gone)] = np.nan
    own = view(T=T, b=b)
    times = own.t if times is None else times
    at = times if at is None else at
    return np.flatnonzero(unseen(own, brought(own, times, at), times, at, point)[0]).tolist()


def test_what_is_followed_at_the_place_or_near_it_is_seen():
    assert found() == []
    assert found(off=0.9 * LIMITS.near * DIAGONAL) == []


def test_a_moment_with_nothing_near_is_unseen():
    assert found(gone=(3, 4)) == [3, 4]
    assert found(off=1.1 * LIMITS.near * DIAGONAL) == list(range(T))


def test_a_place_that_is_not_known_or_not_well_inside_the_picture_may_be_missed():
    unknown, outside, edge = PLACE.copy(), PLACE.copy(), PLACE.copy()
    unknown[0, 2] = np.nan
    outside[0, 2] = [500.0, 0.0, 0.0]
    along = np.linspace(2.0, 200.0, 20000)
    row = np.stack([along, np.full_like(along, -1.0), np.full_like(along, 3.0)], -1)
    X = project(CAMERA, row)[:, 0]
    width = CAMERA.image_size[0]
    edge[0, 2] = row[np.argmin(np.abs(X - np.where(X > THERE[0, 0, 0], width - 5.0, 5.0)))]
    for point in (unknown, outside, edge):
        assert found(point=point, gone=range(T)) == [k for k in range(T) if k != 2]


def test_a_camera_that_took_no_picture_at_a_moment_shows_nothing_of_it():
    times = np.arange(T) / 30.0
    times[5:] += 1.0
    at = np.sort(np.concatenate([times, [0.6]]))
    point = np.tile(PLACE[:, :1], (1, at.size, 1))
    assert found(off=100.0, times=times, at=at, point=point) == [k for k in range(at.size) if at[k] != 0.6]


def test_of_the_samples_inside_a_picture_it_is_counted_which_a_camera_measured_and_which_were_sought_again():
    point = PLACE.copy()
    point[0, 9] = [500.0, 0.0, 0.0]  # out of the picture
    b = np.broadcast_to(THERE, (1, 1, T, 2)).copy()
    b[..., 2:, :] = np.nan
    again = b.copy()
    again[0, 0, 4:6] = THERE[0, 4:6]
    own = view(T=T, b=b[0])
    assert shares_seen([own], [own.t], own.t, point, b, again, ["t1"]) == {
        own.name: {"t1": {"inside": 9, "tracked": 2, "sought": 2}}
    }
