"""An experiment folder, as a laboratory would leave it: clips, survey, picks, recordings, sensor records.

    planned_files(scenario)          what `set_up` will write, without writing it
    set_up(scenario, folder)         write it all

What a laboratory does not have (where the balls truly hung, how the target truly moved) is written apart, into
truth/ and each run's truth.csv, for whoever wants to know how good the answer was.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from fractions import Fraction

import numpy as np
import yaml

from vidtrack.camera import Array, Camera, project
from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.simulate.motion import position
from vidtrack.simulate.picture import Picture, empty_scene
from vidtrack.simulate.recording import Actor, frames, true_times
from vidtrack.simulate.scenario import Recording, Run, Scenario, Target
from vidtrack.simulate.tape import Sound, write_tape
from vidtrack.timecode import Timecode, parse

MARK = "scenario.yaml"
"""The file by which a simulated folder is known; a folder without it is somebody's own and is left alone."""

Task = tuple[str, Callable[[str], None]]
"""A file's path inside the folder, and what writes it, given its full path."""


def set_up(scenario: Scenario, folder: str, *, threads: int | None = None) -> list[str]:
    """Write the experiment folder of a scenario; the paths written, inside the folder.

    The same scenario gives the same bytes, whatever the number of threads: each file draws its own random numbers,
    from the scenario's seed and the file's name, so that adding a run or a camera changes no other file.
    Raises VidtrackError for a folder that holds something that was not simulated.
    """
    if os.path.isdir(folder) and os.listdir(folder) and not os.path.isfile(os.path.join(folder, MARK)):
        raise VidtrackError(f"{folder}: holds files that were not simulated. Name a new folder, or empty this one.")
    tasks = [*_records(scenario), *_clips(scenario), *_recordings(scenario)]
    write = [(os.path.join(folder, path), writer) for path, writer in tasks]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        list(pool.map(lambda task: task[1](task[0]), write))
    return [path for path, _ in tasks]


def planned_files(scenario: Scenario) -> list[str]:
    """The paths, inside the folder, that `set_up` writes. Nothing is drawn or written."""
    return [path for path, _ in (*_records(scenario), *_clips(scenario), *_recordings(scenario))]


def random_stream(scenario: Scenario, *names: str) -> np.random.Generator:
    """Random numbers of one file alone, told apart by its name."""
    seed = np.random.SeedSequence([scenario.seed, zlib.crc32("/".join(names).encode())])
    return np.random.Generator(np.random.SFC64(seed))


def surveyed(scenario: Scenario) -> Array:
    """Where the survey says that the calibration balls hang, (n, 3): the truth and an error of its own for each."""
    _, places = scenario.points()
    survey, rng = scenario.calibration.survey, random_stream(scenario, "survey")
    normal = survey.distribution == "normal"
    error = rng.standard_normal(places.shape) if normal else rng.uniform(-1, 1, places.shape)
    return np.asarray(places + survey.error * error)


def survey_sigma(scenario: Scenario) -> float:
    """The standard deviation of the survey's errors: the tolerance over sqrt 3 where they are uniform."""
    survey = scenario.calibration.survey
    return survey.error / (np.sqrt(3.0) if survey.distribution == "uniform" else 1.0)


# --- tables


def _records(scenario: Scenario) -> Iterator[Task]:
    tags, places = scenario.points()
    yield MARK, _text(yaml.safe_dump(_plain(scenario), sort_keys=False))
    yield "config.yaml", _text(yaml.safe_dump(experiment_config(scenario), sort_keys=False))
    yield "truth/cameras.json", _text(_cameras_json(scenario))
    if tags:
        sigma = survey_sigma(scenario)
        told = [[tag, *place, sigma] for tag, place in zip(tags, surveyed(scenario), strict=True)]
        yield "calibration/points.csv", _table("tag,x,y,z,sigma", told, 5)
        yield "truth/points.csv", _table("tag,x,y,z", [[t, *p] for t, p in zip(tags, places, strict=True)], 5)
    for name, clip in scenario.calibration.clips.items():
        if clip.picks:
            yield f"calibration/{name}/picks.csv", _table("camera,tag,Xf,Yf", _picks(scenario, name), 0)
    for name, run in scenario.runs.items():
        yield f"runs/{name}/truth.csv", _table("time_s,target,x,y,z", _truth(scenario, name), 9)
        if run.boxes:
            yield f"runs/{name}/targets.csv", _table("camera,target,Xf,Yf", _boxes(scenario, name), 1)
        if run.reference:
            rows = _reference(scenario, name)
            yield f"runs/{name}/reference.csv", _table(f"time_s,{run.reference.column}", rows, 4)


def experiment_config(scenario: Scenario) -> dict[str, object]:
    """The config.yaml that whoever set up this laboratory would write: nominal values, nothing they cannot know."""
    runs: dict[str, object] = {}
    for name, run in scenario.runs.items():
        entry: dict[str, object] = {"targets": list(run.targets) if run.boxes else len(run.targets) or 1}
        if run.reference:
            entry["reference"] = {"time": "time_s", "value": run.reference.column, "axis": "x"}
        runs[name] = entry
    clips = {
        name: {"tags": ", ".join(clip.tags) if clip.tags else ", ".join(scenario.points()[0])}
        for name, clip in scenario.calibration.clips.items()
    }
    return {
        "units": scenario.units,
        "cameras": {name: {"sensor": list(plan.sensor)} for name, plan in scenario.cameras.items()},
        "calibration": {"clips": clips},
        "runs": runs,
    }


def _cameras_json(scenario: Scenario) -> str:
    cameras = {}
    for name in scenario.cameras:
        values = asdict(scenario.camera(name))
        values["R"], values["T"] = values["R"].tolist(), values["T"].tolist()
        cameras[name] = values
    return json.dumps(cameras, indent=1) + "\n"


def _picks(scenario: Scenario, clip: str) -> list[list[object]]:
    tags, places = scenario.points()
    rng = random_stream(scenario, "picks", clip)
    rows: list[list[object]] = []
    for name in scenario.cameras:
        for tag in scenario.calibration.clips[clip].picks or ():
            hand = scenario.calibration.picking * rng.standard_normal(2)
            rows.append([name, tag, *(project(scenario.camera(name), places[tags.index(tag)]) + hand)])
    return rows


def _boxes(scenario: Scenario, run: str) -> list[list[object]]:
    plan, recording = scenario.runs[run], scenario.recording_of(run)
    rows: list[list[object]] = []
    for name in plan.cameras or scenario.cameras:
        t = float(plan.first_frame.get(name, 0) / recording.rate)
        for target, ball in plan.targets.items():
            rows.append([name, target, *project(scenario.camera(name), position(ball.motion, t))])
    return rows


def _truth(scenario: Scenario, run: str) -> list[list[object]]:
    """Every target at every frame's (and second field's) time code, as the true clock has it."""
    plan, recording = scenario.runs[run], scenario.recording_of(run)
    steps = 1 if recording.interlace == "none" else 2
    first = min([plan.first_frame.get(name, 0) for name in plan.cameras or scenario.cameras])
    last = max([plan.first_frame.get(name, 0) for name in plan.cameras or scenario.cameras])
    n = n_frames(plan, recording) + last - first
    label = [Fraction(first) + Fraction(k, steps) for k in range(n * steps)]
    t = np.array([float(at / recording.rate) for at in label])
    start = scenario.start_of(run).frame
    time_s = [float((start + at) / recording.rate) for at in label]
    paths = {target: position(ball.motion, t) for target, ball in plan.targets.items()}
    return [[when, target, *paths[target][k]] for k, when in enumerate(time_s) for target in paths]


def _reference(scenario: Scenario, run: str) -> list[list[object]]:
    """time_s and the sensor's reading: at its own time s it shows what the video shows at s + lead."""
    plan, rng = scenario.runs[run], random_stream(scenario, "reference", run)
    sensor = plan.reference
    assert sensor is not None
    n = int((plan.duration_s + 2 * sensor.margin_s) * sensor.rate)
    # ASSUME: its readings fall anywhere between frames, as those of a machine that runs by itself
    t = (np.arange(n) + rng.uniform()) / sensor.rate - sensor.margin_s
    ball = {**plan.targets, **plan.others}[sensor.target]
    along = np.asarray(sensor.along, float) / np.linalg.norm(sensor.along)
    value = sensor.gain * (position(ball.motion, t) @ along) + sensor.bias + sensor.error * rng.standard_normal(n)
    start = float(scenario.start_of(run).seconds)
    return [[start + when - sensor.lead_s, reading] for when, reading in zip(t, value, strict=True)]


def _table(header: str, rows: list[list[object]], decimals: int) -> Callable[[str], None]:
    def cell(value: object) -> str:
        return f"{value:.{decimals}f}" if isinstance(value, float) else str(value)

    lines = [",".join(cell(float(v) if isinstance(v, np.floating) else v) for v in row) for row in rows]
    return _text("\n".join([header, *lines]) + "\n")


def _text(text: str) -> Callable[[str], None]:
    def write(path: str) -> None:
        with replacing(path) as file:
            file.write(text.encode())

    return write


def _plain(scenario: Scenario) -> object:
    return json.loads(scenario.model_dump_json(exclude_unset=True))


# --- films


def n_frames(run: Run, recording: Recording) -> int:
    """How many frames each camera records of a run."""
    return round(run.duration_s * recording.rate)


def _clips(scenario: Scenario) -> Iterator[Task]:
    plan, recording = scenario.calibration, scenario.recording
    tags, places = scenario.points()
    first = parse(plan.start, recording.rate, recording.drop_frame)
    for k, (clip_name, clip) in enumerate(plan.clips.items()):
        start = first + k * round(60 * recording.rate)
        shown = [places[tags.index(tag)] for tag in clip.tags or tags]
        for name in scenario.cameras:
            camera = moved(scenario.camera(name), clip.moved.get(name))
            picture = scenario.picture_of(name)
            balls = [_still_ball(place, plan.diameter / 2, picture) for place in shown]
            count = 1 if recording.tape.codec == "png" else clip.frames or plan.frames
            path = f"calibration/{clip_name}/{name}.{recording.tape.container}"
            yield path, _film(scenario, camera, balls, recording, start, count, path, first_frame=0, lost=())


def _recordings(scenario: Scenario) -> Iterator[Task]:
    for run_name, run in scenario.runs.items():
        recording = scenario.recording_of(run_name)
        for name in run.cameras or scenario.cameras:
            picture = scenario.picture_of(name)
            hidden = {h.target: [] for h in run.hidden}  # type: dict[str, list[tuple[float, float]]]
            for h in run.hidden:
                if h.camera == name:
                    hidden[h.target].append((h.from_s, h.to_s))
            balls = [
                _moving_ball(target, picture)._replace(hidden=hidden.get(t, []))
                for t, target in {**run.targets, **run.others}.items()
            ]
            first = run.first_frame.get(name, 0)
            start = scenario.start_of(run_name) + first
            count = n_frames(run, recording)
            path = f"runs/{run_name}/{name}.{recording.tape.container}"
            lost = run.lost_frames.get(name, ())
            camera = scenario.camera(name)
            yield path, _film(scenario, camera, balls, recording, start, count, path, first_frame=first, lost=lost)


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
) -> Callable[[str], None]:
    """What writes one recording: `count` frames from `first_frame` after the scene's zero of time."""

    def write(full_path: str) -> None:
        picture = scenario.picture_of(camera.name)
        clutter = [patch for patch in scenario.clutter if patch.camera == camera.name]
        empty = empty_scene(picture, camera.image_size, clutter)
        label = np.array([float((first_frame + k) / recording.rate) for k in range(count)])
        film = frames(
            camera,
            empty,
            balls,
            true_times(label, scenario.cameras[camera.name].clock),
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


def _sound(recording: Recording, start: Timecode, count: int, rng: np.random.Generator) -> Sound | None:
    """Longitudinal time code for the whole length of the film, where the tape has it."""
    tape = recording.tape
    if tape.timecode not in ("ltc", "both"):
        return None
    t = np.arange(int(count / recording.rate * tape.sound_rate)) / tape.sound_rate
    heard = ltc_signal(t, start, level=tape.sound_level) + tape.sound_noise * rng.standard_normal(len(t))
    return Sound(samples=np.rint(32767 * np.clip(heard, -1, 1)).astype(np.int16), rate=tape.sound_rate)


def _still_ball(place: Array, radius: float, picture: Picture) -> Actor:
    def path(t: Array) -> Array:
        return np.broadcast_to(place, (*np.shape(t), 3))

    return Actor(path, radius, picture.background + picture.contrast)


def _moving_ball(target: Target, picture: Picture) -> Actor:
    level = picture.background + picture.contrast if target.level is None else target.level
    return Actor(lambda t: position(target.motion, t), target.diameter / 2, level)


def moved(camera: Camera, change: tuple[tuple[float, ...], tuple[float, ...]] | None) -> Camera:
    """A camera that was shifted by (3,) world units and turned by (3,) degrees about its own axes."""
    if change is None:
        return camera
    shift, turn = np.asarray(change[0], float), np.radians(change[1])
    angle = float(np.linalg.norm(turn))
    K = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    about = np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)
    R = about.T @ camera.R
    return camera.with_(R=R, T=-R @ (camera.position + shift))
