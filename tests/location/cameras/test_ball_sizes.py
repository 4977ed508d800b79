"""How much larger cameras see targets than the balls of their calibration is known to a part of a percent."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.location.cameras.ball_sizes import ball_sizes, px_per_unit, timed_looks
from vidtrack.simulate.rig import thesis_points, thesis_rig

AT = np.arange(60) / 30
PATHS = np.stack([np.stack([12 * np.cos(4 * AT), np.full(60, y), 4 * np.sin(5 * AT)], -1) for y in (-5.0, 5.0)])


def compared(zooms, diameter=1.0, hunts=0.0, noise=0.003, seed=2, unlike=0.0, every=1, outlined=()):
    """Of a rig whose lenses were zoomed since; a target of so many times the balls' diameter, a size that hunts.

    unlike  sd of the logarithms of the balls' own sizes; every: look at a target at every so many moments
    """
    rng = np.random.default_rng(seed)
    own = np.exp(rng.normal(0, unlike, len(thesis_points()[1]))) if unlike else 1.0
    names, balls, looks = [f"cam{i + 1}" for i in range(len(zooms))], {}, {}
    cameras = thesis_rig(len(zooms))
    for name, camera, zoom in zip(names, cameras, zooms, strict=True):
        p = thesis_points()[1]
        wide = 1.5 * own * px_per_unit(camera, p) * np.exp(rng.normal(0, noise, len(p)))
        b = project(camera, p)
        balls[name] = {"x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "Xf": b[:, 0], "width": wide}
        looks[name] = {}
        for i, path in enumerate(PATHS):
            b = project(camera, path)
            scale = zoom * (1 + hunts * np.sin(4.7 * AT)) * np.exp(rng.normal(0, noise, 60))
            wide = 1.5 * diameter * px_per_unit(camera, path) * scale
            look = {"time_s": AT, "Xf": b[:, 0], "Yf": b[:, 1], "width": wide}
            looks[name][f"t{i + 1}"] = {key: values[::every].tolist() for key, values in look.items()}
    return ball_sizes(names, cameras, looks, balls, AT, PATHS, ["a", "b"], outlined)


def test_a_ball_is_as_wide_as_its_outline():
    (camera,) = thesis_rig(1)
    centre, r = np.array([[3.0, 4.0, -2.0]]), 0.05
    sight = centre[0] - camera.position
    across = np.linalg.svd(sight[None])[2][1:]
    turn = np.linspace(0, 2 * np.pi, 400)
    rim = project(camera, centre + r * (np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]))
    x, y = rim.T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    assert 2 * r * px_per_unit(camera, centre)[0] == pytest.approx(2 * np.sqrt(area / np.pi), rel=1e-3)


def test_lenses_as_they_were_calibrated_see_the_same_balls_alike():
    for own in compared([1.0, 1.0]).values():
        assert own["scatter"] == pytest.approx(0.003, rel=0.4)
        for target in own["targets"].values():
            assert abs(target["larger"]) < 4 * target["sd"] < 0.006
            assert target["wander"] < 0.002


def test_a_zoom_shows_in_its_camera_and_other_balls_in_all():
    zoomed, other = compared([1.01, 1.0]), compared([1.0, 1.0], diameter=1.2)
    assert zoomed["cam1"]["targets"]["a"]["larger"] == pytest.approx(0.01, abs=0.002)
    assert zoomed["cam2"]["targets"]["a"]["larger"] == pytest.approx(0.0, abs=0.002)
    assert [other[c]["targets"]["b"]["larger"] for c in other] == pytest.approx([np.log(1.2)] * 2, abs=0.002)


def test_a_size_that_goes_up_and_down_wanders():
    (own,) = compared([1.0], hunts=0.015).values()
    assert own["targets"]["a"]["wander"] == pytest.approx(0.0105, rel=0.25)


def test_looks_elsewhere_and_cameras_without_balls_count_for_nothing():
    camera = thesis_rig(1)
    look = {"t1": {"time_s": AT, "Xf": np.full(60, 5.0), "Yf": np.full(60, 5.0), "width": np.full(60, 9.0)}}
    few = {name: np.zeros(3) for name in ("x", "y", "z", "Xf", "width")}
    assert ball_sizes(["cam1"], camera, {"cam1": look}, {"cam1": few}, AT, PATHS, ["a", "b"]) == {}
    assert ball_sizes(["cam1"], camera, {"cam1": look}, {}, AT, PATHS, ["a", "b"]) == {}


def test_looks_are_taken_at_the_corrected_times():
    looks = timed_looks({"t1": {"time_s": [1.0, 2.0], "width": [9.0, 9.1]}}, AT * 2, AT * 2 + 0.25)
    assert looks["t1"]["time_s"] == pytest.approx([1.25, 2.25])
    assert timed_looks(None, AT, AT) == {}


def test_the_standard_deviation_of_a_size_is_that_of_its_median_beside_that_of_the_balls():
    found = [compared([1.0], seed=seed)["cam1"]["targets"]["a"] for seed in range(40)]
    rms = np.sqrt(np.mean([own["larger"] ** 2 for own in found]))
    assert np.median([own["sd"] for own in found]) == pytest.approx(rms, rel=0.3)


def test_looks_that_scatter_alone_do_not_wander():
    found = [compared([1.0], seed=seed, noise=0.01)["cam1"]["targets"]["a"]["wander"] for seed in range(20)]
    assert np.mean(found) < 0.002
    hunting = [compared([1.0], seed=seed, noise=0.01, hunts=0.015) for seed in range(20)]
    assert np.median([own["cam1"]["targets"]["a"]["wander"] for own in hunting]) == pytest.approx(0.0105, rel=0.25)


@pytest.mark.parametrize("beside", [-0.2, 0.2])
def test_looks_before_and_after_the_target_was_located_count_for_nothing(beside):
    (camera,), at = thesis_rig(1), AT[20:40]
    path = np.repeat(PATHS[:1, :1], 20, 1)
    b, p = project(camera, path[0]), thesis_points()[1]
    balls = {"x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "Xf": project(camera, p)[:, 0], "width": np.full(len(p), 9.0)}
    look = {"Xf": b[:, 0], "Yf": b[:, 1], "width": np.full(20, 9.0)}
    assert ball_sizes(["cam1"], [camera], {"cam1": {"t1": {"time_s": at, **look}}}, {"cam1": balls}, at, path, ["a"])
    outside = np.linspace(0, 0.1, 20) + (at[0] - 0.3 if beside < 0 else at[-1] + 0.2)
    looks = {"cam1": {"t1": {"time_s": outside, **look}}}
    assert ball_sizes(["cam1"], [camera], looks, {"cam1": balls}, at, path, ["a"]) == {}


def test_few_looks_are_no_surer_than_those_at_the_balls():
    """Of three looks some lie near each other by chance."""
    found = [compared([1.0], seed=seed, noise=0.006, every=20)["cam1"]["targets"]["a"] for seed in range(60)]
    assert {own["n"] for own in found} == {3}
    z = np.array([own["larger"] / own["sd"] for own in found])
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.25)
    assert np.abs(z).max() < 3.5
    assert compared([1.0], every=30) == {}


def test_balls_that_are_unlike_each_other_are_so_in_all_cameras():
    alike, unlike = compared([1.0, 1.0, 1.0], noise=0.006), compared([1.0, 1.0, 1.0], noise=0.003, unlike=0.01)
    assert all(own["scatter"] == pytest.approx(0.006, rel=0.4) and own["among"] < 0.003 for own in alike.values())
    assert all(own["among"] == pytest.approx(0.01, rel=0.35) for own in unlike.values())
    (one,) = compared([1.0], noise=0.006).values()
    assert one["among"] == one["scatter"]


def test_widths_of_outlines_have_an_sd_that_lasts():
    both = compared([1.0, 1.0], outlined=["cam2"])
    assert "lasting" not in both["cam1"]
    assert 0.002 < both["cam2"]["lasting"] < 0.01
