"""Balls that a lamp lights from one side, against rays through every part of a pixel."""

import numpy as np
import pytest

from tests.simulate.test_recording import CAMERA, PLAIN, ball, centre_of_light, film
from vidtrack.geometry.camera import directions
from vidtrack.simulate.lamp import Lamp
from vidtrack.simulate.scenario import scenario_from

FINE, RADIUS, AT = 8, 3.0, np.array([30.0, 6.0, -8.0])
TO_CAMERA = CAMERA.position - AT


def by_rays(lamp, image, level=200.0):
    """The same picture by rays, FINE x FINE in a pixel, about where `image` shows the ball."""
    x, y = centre_of_light(image).round().astype(int)
    reach = 20
    fine = (np.arange((2 * reach + 1) * FINE) + 0.5) / FINE - 0.5 - reach
    X, Y = np.meshgrid(x + fine, y + fine)
    ray = directions(CAMERA, np.stack([X, Y], -1))
    away = AT - CAMERA.position
    along = ray @ away
    inside = along**2 - (away @ away - RADIUS**2)
    point = CAMERA.position + (along - np.sqrt(np.maximum(inside, 0)))[..., None] * ray
    toward = np.array(lamp.toward) / np.linalg.norm(lamp.toward)
    light = 1 - lamp.share + lamp.share * np.maximum((point - AT) / RADIUS @ toward, 0)
    light = np.where(inside > 0, level * light, 0)
    drawn = np.zeros_like(image)
    side = 2 * reach + 1
    drawn[y - reach : y + reach + 1, x - reach : x + reach + 1] = light.reshape(side, FINE, side, FINE).mean((1, 3))
    return drawn


@pytest.mark.parametrize(
    "toward",
    [
        TO_CAMERA,
        [0, 0, 1.0],
        [0.2, -1, 0.3],
        [1, 0.1, -0.2],
        -TO_CAMERA + [30, 90, 40],
        np.cross(TO_CAMERA, [0, 0, 1.0]),
    ],
)
@pytest.mark.parametrize("share", [0.4, 1.0])
def test_the_light_is_that_of_rays(toward, share):
    lamp = Lamp(toward=tuple(toward), share=share)
    image = film([ball(at=AT, radius=RADIUS)._replace(lamp=lamp)], np.zeros(1), picture=SHARP)[0]
    rays = by_rays(lamp, image)
    assert image.sum() == pytest.approx(rays.sum(), rel=0.02)
    assert centre_of_light(image) == pytest.approx(centre_of_light(rays), abs=0.05)
    assert np.abs(image - rays).max() < 25  # the light has eight steps
    assert np.abs(image - rays).mean() < 0.01 * rays.mean() * rays.size / (rays > 0).sum()


SHARP = PLAIN.model_copy(update={"blur_px": 0.0})


def test_a_lamp_behind_a_ball_leaves_what_comes_from_everywhere():
    lamp = Lamp(toward=tuple(-TO_CAMERA), share=0.7)
    lit, plain = (film([ball(at=AT, radius=RADIUS)._replace(lamp=one)], np.zeros(1))[0] for one in (lamp, None))
    assert lit == pytest.approx(0.3 * plain, abs=0.02)


def test_the_middle_of_the_light_lies_toward_the_lamp():
    up, plain = (
        centre_of_light(film([ball(at=AT, radius=RADIUS)._replace(lamp=lamp)], np.zeros(1))[0])
        for lamp in (Lamp(toward=(0, 0, 1), share=1.0), None)
    )
    assert plain[1] - up[1] > 1


def test_clips_and_runs_are_lit_by_their_own_lamp_or_the_scenarios(tmp_path):
    camera = {"position": [0, -100, 0], "field": 60, "size": [128, 96], "sensor": [6.4, 4.8]}
    run = {"duration_s": 0.1, "targets": {"t1": {"diameter": 8}}}
    tape = {"codec": "png", "container": "png"}
    picture = {"noise": 0, "background": 0}
    scene = {
        "cameras": {"cam1": camera},
        "picture": picture,
        "recording": {"tape": {**tape, "codec": "ffv1", "container": "mkv"}},
        "calibration": {"points": {"1": [0, 0, 0]}, "diameter": 8, "frames": 1, "clips": {"c": {}}},
        "lamp": {"toward": [0, 0, 1]},
        "runs": {"own": {**run, "lamp": {"toward": [0, 0, -1]}}, "same": run},
    }
    rise = {name: middle - 47.5 for name, middle in middles(scene, tmp_path).items()}
    assert rise["same"] == pytest.approx(rise["c"], abs=0.05)
    assert rise["same"] < -1
    assert rise["own"] == pytest.approx(-rise["same"], abs=0.05)
    scene["calibration"]["lamp"] = {"toward": [0, 0, -1], "share": 0.2}
    assert middles(scene, tmp_path)["c"] - 47.5 == pytest.approx(-0.15 * rise["same"], abs=0.5)


def middles(scene, folder):
    """Row of the middle of light of the first picture of each film."""
    from vidtrack.simulate.films import clips, recordings
    from vidtrack.video.reader import open_video

    plan, found = scenario_from(scene, "scenario"), {}
    for path, write in [*clips(plan), *recordings(plan)]:
        to = folder / path.replace("/", "-")
        write(str(to))
        with open_video(str(to)) as video:
            found[path.split("/")[1]] = centre_of_light(next(iter(video.frames())).luma.astype(float))[1]
    return found


@pytest.mark.parametrize("toward", [[0, 0, 0], [1, 2]])
def test_a_lamp_has_a_direction(toward):
    with pytest.raises(ValueError, match="toward"):
        Lamp(toward=toward)
