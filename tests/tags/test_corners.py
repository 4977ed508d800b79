"""Corners of coded tags: which targets they are, and where cameras saw them."""

import numpy as np
import pytest

from tests.location.cameras.test_views import view
from vidtrack.location.cameras.views import brought
from vidtrack.tags.corners import corner_names, corners_of, with_corners


def test_corners_are_distinguished_by_their_names_and_sorted_by_number():
    assert corner_names(["tag10_1", "tag7_2", "bow", "tag7_1", "tag7_5", "tag7", "my_tag7_1", "tag7_2"]) == [
        "tag7_1",
        "tag7_2",
        "tag10_1",
    ]


@pytest.mark.parametrize(
    ("targets", "all_of_them"),
    [(2, ["t1", "t2", "c"]), (["bow"], ["bow", "c"]), (0, ["c"]), ("all", "all"), (None, None)],
)
def test_corners_come_after_the_targets_of_the_config(targets, all_of_them):
    assert with_corners(targets, ["c"]) == all_of_them


def seen_by(*, gap=False, fewer=False, T=6):
    """A camera that sees the corners of tag 3 move at 30 px/s along x, and another target."""
    names = ["bow", *(f"tag3_{i}" for i in range(1, 4 if fewer else 5))]
    t = np.arange(T) / 30
    start = np.array([[0.0, 0], [10, 10], [20, 10], [20, 0], [10, 0]])[: len(names)]
    b = start[:, None] + np.stack([30 * t, 0 * t], -1)
    if gap:
        b[2, 1] = np.nan
    own = view(T=T, n=len(names), b=b, sd=0.1)._replace(tracks=names)
    return own, brought(own, own.t, own.t)


def test_a_tag_of_which_a_corner_is_missing_is_left_out_whole():
    (one, seen), (two, other) = seen_by(gap=True), seen_by(fewer=True)
    b, sd = corners_of([one, two], [seen, other], [3, 5], one.t, [0.0, 0.0])
    assert b.shape == sd.shape == (2, 6, 8, 2)
    assert np.isnan(b[0, 1]).all()
    assert np.isnan(b[1]).all()
    assert np.isnan(b[0, :, 4:]).all()
    rest = [0, 2, 3, 4, 5]
    np.testing.assert_allclose(b[0, rest, :4], seen.b[1:5, rest].swapaxes(0, 1))
    np.testing.assert_allclose(sd[0, rest, :4], 0.1)


def test_a_clock_that_is_not_known_well_is_in_the_sd_along_the_motion_alone():
    own, seen = seen_by()
    _, sd = corners_of([own], [seen], [3], own.t, [0.01])
    np.testing.assert_allclose(sd[..., 0], np.hypot(0.1, 0.3))
    np.testing.assert_allclose(sd[..., 1], 0.1)
