"""Moments at which two cameras or more were recording."""

import numpy as np
import pytest

from tests.location.cameras.test_views import view
from vidtrack.errors import VidtrackError
from vidtrack.location.clocks.common_moments import check_overlap, recorded_twice


def test_moments_of_one_camera_alone_are_left_out():
    at, whose = recorded_twice([np.arange(0, 10) / 30, np.arange(5, 15) / 30])
    np.testing.assert_allclose(at, np.arange(5, 10) / 30)
    assert set(whose.tolist()) <= {0, 1}


def test_a_third_camera_keeps_the_moments_that_two_others_do_not_share():
    at, _ = recorded_twice([np.arange(0, 5) / 30, np.arange(10, 15) / 30, np.arange(0, 15) / 30])
    np.testing.assert_allclose(at * 30, [*range(5), *range(10, 15)])


def test_two_cameras_that_recorded_one_after_the_other_are_refused_with_when_they_did():
    views = [view(), view(name="cam2")]
    with pytest.raises(VidtrackError, match=r"run: no two cameras .*cam1 0.000 to 0.300 s, cam2 9.000 to 9.300 s"):
        check_overlap(views, [views[0].t, views[1].t + 9], "run")
    with pytest.raises(VidtrackError, match="cam2 nothing"):
        check_overlap(views, [views[0].t, np.zeros(0)], "run")


def test_cameras_that_share_a_moment_pass_in_whatever_order_they_began():
    views = [view(), view(name="cam2")]
    check_overlap(views, [views[0].t, views[1].t + 0.3], "run")
    check_overlap(views, [views[0].t + 0.3, views[1].t], "run")


@pytest.mark.parametrize(("later", "offset"), [(7200.2, "-7200"), (-3600.1, "3600"), (19800.1, "-19800")])
def test_clocks_that_are_whole_hours_apart_are_of_two_zones(later, offset):
    views = [view(), view(name="cam2")]
    with pytest.raises(VidtrackError, match=rf"another time zone.* cameras.cam2.clock.offset_s: {offset}\."):
        check_overlap(views, [views[0].t, views[1].t + later], "run")


@pytest.mark.parametrize(("hours", "offset"), [(1, "-3603.6"), (-2, "7207.2"), (0.5, "-1801.8")])
def test_an_hour_of_non_drop_labels_at_29_97_takes_longer(hours, offset):
    one = view()
    t = one.t / one.t[-1] * (one.t.size - 1) * 1.001 / 30 + 36000
    labels = np.array([f"10:00:00:{k:02d}" for k in range(t.size)], object)
    views = [one._replace(t=t, timecode=labels), one._replace(name="cam2", t=t, timecode=labels)]
    with pytest.raises(VidtrackError, match=rf"another time zone.* cameras.cam2.clock.offset_s: {offset}\."):
        check_overlap(views, [t, t + 3603.6 * hours], "run")


def test_a_camera_without_time_code_among_others_is_named():
    coded, bare = view(), view(name="cam2")
    bare = bare._replace(timecode=np.full(bare.t.size, "", object))
    with pytest.raises(VidtrackError, match="cam2 has no time code and counts from its first picture"):
        check_overlap([coded, bare], [coded.t + 36000, bare.t], "run")
