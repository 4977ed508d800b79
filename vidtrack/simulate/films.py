"""The films of a simulated laboratory: every camera's calibration clips and recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.simulate.background import seen, turned
from vidtrack.simulate.lamp import Lamp
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.simulate.motion import position
from vidtrack.simulate.picture import Picture, Scene, empty_scene
from vidtrack.simulate.recording import Actor, frames, true_times
from vidtrack.simulate.records import Task
from vidtrack.simulate.scenario import Recording, Scenario, Target, Turned, n_frames, random_stream
from vidtrack.simulate.tape import Sound, write_tape
from vidtrack.timing.timecode import Timecode, parse


def clips(scenario: Scenario) -> Iterator[Task]:
    """Every calibration clip: the balls that it shows, at rest."""
    plan, recording = scenario.calibration, scenario.recording
    tags, places = scenario.points()
    first = parse(plan.start, recording.rate, recording.drop_frame)
    for k, (clip_name, clip) in enumerate(plan.clips.items()):
        start = first + k * round(60 * recording.rate)
        shown = [places[tags.index(tag)] for tag in clip.tags or tags]
        for name in scenario.cameras:
            camera = moved(scenario.camera(name), clip.moved.get(name))
            picture = scenario.picture_of(name)
            balls = [_still_ball(place, plan.diameter / 2, picture, plan.lamp or scenario.lamp) for place in shown]
            count = 1 if recording.tape.codec == "png" else clip.frames or plan.frames
            path = f"calibration/{clip_name}/{name}.{recording.tape.container}"
            yield path, _film(scenario, camera, balls, recording, start, count, path, first_frame=0, lost=())


def recordings(scenario: Scenario) -> Iterator[Task]:
    """Every camera's recording of every run."""
    for folder, run_name, run in [
        *(("runs", name, run) for name, run in scenario.runs.items()),
        *(("calibration", name, clip) for name, clip in scenario.waved.items()),
    ]:
        recording = run.recording or scenario.recording
        for name in run.cameras or scenario.cameras:
            picture = scenario.picture_of(name)
            hidden = {h.target: [] for h in run.hidden}  # type: dict[str, list[tuple[float, float]]]
            for h in run.hidden:
                if h.camera == name:
                    hidden[h.target].append((h.from_s, h.to_s))
            balls = [
                _moving_ball(target, picture)._replace(hidden=hidden.get(t, []), lamp=run.lamp or scenario.lamp)
                for t, target in {**run.targets, **run.others}.items()
            ]
            first = run.first_frame.get(name, 0)
            start = parse(run.start, recording.rate, recording.drop_frame) + first
            count = n_frames(run, recording)
            path = f"{folder}/{run_name}/{name}.{recording.tape.container}"
            lost = run.lost_frames.get(name, ())
            camera, turns = scenario.camera(name), run.turned.get(name, ())
            yield (
                path,
                _film(
                    scenario, camera, balls, recording, start, count, path, first_frame=first, lost=lost, turns=turns
                ),
            )


def _film(
    scenario: Scenario,
    camera: Camera,
    balls: list[Actor],
    recording: Recording,
    start: Timecode,
    count: int,
    path: str,
    *,
    first_frame: int,
    lost: tuple[int, ...],
    turns: tuple[Turned, ...] = (),
) -> Callable[[str], None]:
    """What writes one recording: `count` frames from `first_frame` after the scene's zero of time."""

    def write(full_path: str) -> None:
        picture = scenario.picture_of(camera.name)
        clutter = [patch for patch in scenario.clutter if patch.camera == camera.name]
        empty = empty_scene(picture, camera.image_size, clutter)
        wall = _wall(scenario, camera)
        label = np.array([float((first_frame + k) / recording.rate) for k in range(count)])
        film = frames(
            camera,
            empty if wall is None or turns else empty + wall(camera),
            balls,
            true_times(label, scenario.cameras[camera.name].clock),
            moving=_moving(camera, turns),
            wall=wall if turns else None,
            picture=picture,
            shutter=recording.shutter,
            rate=recording.rate,
            interlace=recording.interlace,
            rng=random_stream(scenario, path),
        )
        write_tape(
            full_path,
            film,
            recording.tape,
            rate=recording.rate,
            bits=picture.bits,
            interlace=recording.interlace,
            start=start,
            lost=frozenset(lost),
            sound=_sound(recording, start, count, random_stream(scenario, path, "sound")),
        )

    return write


def _wall(scenario: Scenario, camera: Camera) -> Callable[[Camera], Scene] | None:
    """What the pattern of the background adds to the picture of a camera; None for a plain one."""
    if scenario.texture is None:
        return None
    return partial(seen, scenario.texture, scenario.camera(camera.name), seed=scenario.seed)


def _moving(camera: Camera, turns: tuple[Turned, ...]) -> Callable[[float], Camera] | None:
    """The camera at a time, s, where it moves."""
    if not turns:
        return None
    rows = np.asarray(turns, float)

    def at(t: float) -> Camera:
        turn = [np.interp(t, rows[:, 0], rows[:, k]) for k in range(1, 5)]
        return turned(camera, np.array(turn[:3]), float(turn[3]))

    return at


def _sound(recording: Recording, start: Timecode, count: int, rng: np.random.Generator) -> Sound | None:
    """Longitudinal time code for the whole length of the film, where the tape has it."""
    tape = recording.tape
    if tape.timecode not in ("ltc", "both"):
        return None
    t = np.arange(int(count / recording.rate * tape.sound_rate)) / tape.sound_rate
    heard = ltc_signal(t, start, level=tape.sound_level) + tape.sound_noise * rng.standard_normal(len(t))
    return Sound(samples=np.rint(32767 * np.clip(heard, -1, 1)).astype(np.int16), rate=tape.sound_rate)


def _still_ball(place: Array, radius: float, picture: Picture, lamp: Lamp | None) -> Actor:
    def path(t: Array) -> Array:
        return np.broadcast_to(place, (*np.shape(t), 3))

    return Actor(path, radius, picture.background + picture.contrast, lamp=lamp)


def _moving_ball(target: Target, picture: Picture) -> Actor:
    level = picture.background + picture.contrast if target.level is None else target.level
    return Actor(lambda t: position(target.motion, t), target.diameter / 2, level)


def moved(camera: Camera, change: tuple[tuple[float, ...], tuple[float, ...]] | None) -> Camera:
    """A camera that was shifted by (3,) world units and turned by (3,) degrees about its own axes."""
    if change is None:
        return camera
    there = turned(camera, np.asarray(change[1], float))
    return there.with_(T=-there.R @ (camera.position + np.asarray(change[0], float)))
