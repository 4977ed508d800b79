"""The tables of a simulated laboratory: survey, picks, boxes, sensor records, config; and, apart, the truth."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict
from fractions import Fraction

import numpy as np
import yaml

from vidtrack.arrays import Array
from vidtrack.files.atomic import replacing
from vidtrack.geometry.camera import project
from vidtrack.simulate.motion import position, swing
from vidtrack.simulate.scenario import Scenario, n_frames, random_stream

MARK = "scenario.yaml"
"""The file by which a simulated folder is known; a folder without it is a user's own and is left alone."""

Task = tuple[str, Callable[[str], None]]
"""A file's path inside the folder, and what writes it, given its full path."""


def tables(scenario: Scenario) -> Iterator[Task]:
    """Every table of the folder, and what writes it."""
    tags, places = scenario.points()
    yield MARK, _text(yaml.safe_dump(_plain(scenario), sort_keys=False))
    yield "config.yaml", _text(yaml.safe_dump(experiment_config(scenario), sort_keys=False))
    yield "truth/cameras.json", _text(_cameras_json(scenario))
    if tags:
        sigma = survey_sigma(scenario)
        rows = [[tag, *place, sigma] for tag, place in zip(tags, surveyed(scenario), strict=True)]
        yield "calibration/points.csv", _table("tag,x,y,z,sigma", rows, 5)
        yield "truth/points.csv", _table("tag,x,y,z", [[t, *p] for t, p in zip(tags, places, strict=True)], 5)
    for name, clip in scenario.calibration.clips.items():
        if clip.picks:
            yield f"calibration/{name}/picks.csv", _table("camera,tag,Xf,Yf", _picks(scenario, name), 0)
    if scenario.calibration.marks and scenario.waved:
        yield f"calibration/{next(iter(scenario.waved))}/picks.csv", _table("camera,tag,Xf,Yf", _marked(scenario), 2)
    for name, run in scenario.runs.items():
        yield f"runs/{name}/truth.csv", _table("time_s,target,x,y,z", _truth(scenario, name), 9)
        if run.boxes:
            yield f"runs/{name}/targets.csv", _table("camera,target,Xf,Yf", _boxes(scenario, name), 1)
        if run.reference:
            rows = _reference(scenario, name)
            yield f"runs/{name}/reference.csv", _table(f"time_s,{run.reference.column}", rows, 4)
        if run.channels:
            header = ",".join(["time_s", *run.channels.columns])
            yield f"runs/{name}/channels.csv", _table(header, _channels(scenario, name), 6)


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


def experiment_config(scenario: Scenario) -> dict[str, object]:
    """The config.yaml of this laboratory: nominal values, and nothing that its user could not know."""
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
    cameras: dict[str, dict[str, object]] = {}
    for name, plan in scenario.cameras.items():
        cameras[name] = {"sensor": list(plan.sensor)} | ({"through": list(plan.through)} if plan.through else {})
    interfaces = {name: plan.model_dump(mode="json", exclude_unset=True) for name, plan in scenario.interfaces.items()}
    calibration: dict[str, object] = {} if scenario.waved and not clips else {"clips": clips}
    for name, wand in scenario.waved.items():
        if wand.lengths:
            calibration["wand"] = {"clip": name, "lengths": dict(wand.lengths)}
            calibration["wand"] |= {"axes": wand.axes} if wand.axes else {}  # type: ignore[operator]
    return {
        "units": scenario.units,
        **({"interfaces": interfaces} if interfaces else {}),
        "cameras": cameras,
        "calibration": calibration,
        "runs": runs,
    }


def _cameras_json(scenario: Scenario) -> str:
    cameras = {}
    for name in scenario.cameras:
        values = asdict(scenario.camera(name))
        values["R"], values["T"] = values["R"].tolist(), values["T"].tolist()
        if not values.pop("through"):
            cameras[name] = values
            continue
        plans = scenario.cameras[name].through
        values["through"] = [{"name": own, **scenario.interfaces[own].model_dump(mode="json")} for own in plans]
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


def _marked(scenario: Scenario) -> list[list[object]]:
    """Picks, by hand, of points that are not surveyed."""
    rng = random_stream(scenario, "marks")
    rows: list[list[object]] = []
    for name in scenario.cameras:
        for tag, place in scenario.calibration.marks.items():
            hand = scenario.calibration.picking * rng.standard_normal(2)
            rows.append([name, tag, *(project(scenario.camera(name), np.array(place)) + hand)])
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
    first = scenario.first_frame_of(run)
    last = max([plan.first_frame.get(name, 0) for name in plan.cameras or scenario.cameras])
    n = n_frames(plan, recording) + last - first
    label = [Fraction(first) + Fraction(k, steps) for k in range(n * steps)]
    t = np.array([float(at / recording.rate) for at in label])
    begun = scenario.first_code_of(run).clock  # what the run's earliest first label shows
    time_s = [float(begun + (at - first) / recording.rate) for at in label]
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
    recording = scenario.recording_of(run)
    start = float(scenario.first_code_of(run).clock - scenario.first_frame_of(run) / recording.rate)
    return [[start + when - sensor.lead_s, reading] for when, reading in zip(t, value, strict=True)]


def _channels(scenario: Scenario, run: str) -> list[list[object]]:
    """time_s and the reading of each column, from half a second before the video to half a second after it."""
    plan, rng = scenario.runs[run], random_stream(scenario, "channels", run)
    recorder, recording = plan.channels, scenario.recording_of(run)
    assert recorder is not None
    t = np.arange(int((plan.duration_s + 1) * recorder.rate)) / recorder.rate - 0.5
    columns = [
        np.sum([swing(term, t) for term in terms], axis=0) + recorder.error * rng.standard_normal(t.size)
        for terms in recorder.columns.values()
    ]
    start = float(scenario.first_code_of(run).clock - scenario.first_frame_of(run) / recording.rate)
    return [[start + when, *readings] for when, *readings in zip(t, *columns, strict=True)]


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
