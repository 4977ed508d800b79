"""What the sizes of a run's targets say of the zoom of all its lenses."""

import pytest

from vidtrack.common_zoom import common_zoom, seen_size


def camera(*larger, sd=0.001, scatter=0.002, **more):
    targets = {
        f"t{k}": {"n": 40, "larger": own, "sd": sd, "wander": 0.0002 * k} for k, own in enumerate(larger, start=1)
    }
    return {"balls": 30, "scatter": scatter, **more, "targets": targets}


def test_a_camera_says_the_median_of_its_targets_and_knows_it_better_by_more_of_them():
    own = seen_size("cam1", camera(0.010, 0.012, 0.011, sd=0.003))
    assert own.larger == pytest.approx(0.011)
    assert own.wander == pytest.approx(0.0004)
    assert own.sd == pytest.approx((0.003**2 / 3 + 0.0007**2) ** 0.5)
    assert seen_size("cam1", camera(0.010, 0.012, lasting=0.004)).sd > 0.004


def test_the_surer_camera_counts_more_and_the_balls_own_differences_are_of_all_cameras():
    zoom = common_zoom({"cam1": camera(0.010, 0.010), "cam2": camera(0.020, 0.020, sd=0.01)})
    assert 0.010 < zoom.larger < 0.0115
    balls = 0.002 / 2**0.5
    assert balls < zoom.sd < 1.5 * balls
    assert not zoom.outlines
    among = common_zoom({"cam1": camera(0.010, 0.010, among=0.0), "cam2": camera(0.010, 0.010, among=0.0)})
    assert among.sd < zoom.sd


@pytest.mark.parametrize(
    ("larger", "agree"),
    [((0.010, 0.012), True), ((0.010, 0.029), True), ((0.010, 0.031), False), ((0.01, -0.01), False)],
)
def test_cameras_agree_within_half_of_what_they_see(larger, agree):
    sizes = {f"cam{k}": camera(own, lasting=0.0035) for k, own in enumerate(larger)}
    zoom = common_zoom(sizes)
    assert zoom.agree is agree
    assert zoom.outlines


def test_how_far_apart_cameras_are_is_in_their_own_standard_deviations():
    zoom = common_zoom({"cam1": camera(0.010, 0.010, sd=0.0), "cam2": camera(0.016, 0.016, sd=0.0)})
    assert zoom.apart == pytest.approx(0.003 / 0.0007)


def test_one_camera_agrees_with_nobody_and_none_say_nothing():
    assert common_zoom({"cam1": camera(0.01)}).agree is False
    assert common_zoom({}) is None
