"""Whether each run can be worked on: its recordings, and what config.yaml says of it."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import NamedTuple

from vidtrack.files.csv_header import LENGTHS, column_of, split_unit
from vidtrack.files.experiment import (
    Experiment,
    Run,
    channels_path,
    profiles,
    reference_columns,
    target_names,
    within,
)
from vidtrack.files.recordings import inner_folders
from vidtrack.naming import hint_of, some_of
from vidtrack.settings.config import Settings
from vidtrack.settings.runs import Run as RunSettings


class _Case(NamedTuple):
    settings: Settings
    experiment: Experiment
    own: RunSettings
    run: Run
    place: str  # of the run in the config, for messages


def _one_column_for_all(name: str, run: Run, own: RunSettings | None) -> list[str]:
    """A run's word on which of a file's cameras is meant holds for each of the run's cameras."""
    files = [run.videos[camera] for camera in run.tracks]
    if own is None or own.tracks is None or own.tracks.camera is None or len(set(files)) == len(files):
        return []
    return [
        f"config.yaml: runs.{name}.tracks.camera: it would make {' and '.join(sorted(run.tracks))} one and the same, "
        "as they share a file. Say it of each camera, under cameras.<camera>.tracks."
    ]


def check_runs(settings: Settings, experiment: Experiment) -> list[str]:
    """What is wrong with the recordings of the runs and with what the config says of them, a line each."""
    problems = []
    calibrated = {*experiment.cameras_in_clips(), *experiment.given}
    for name, run in experiment.runs.items():
        own = settings.runs.get(name)
        place = within(experiment.folder, "runs", name)
        mode = own.mode if own else "space"
        problems += _one_column_for_all(name, run, own)
        if not run.videos:
            inner = inner_folders(place)
            cure = "Put <camera>.<ext> there or delete the folder."
            if inner:
                cure = f"Move its folders ({some_of(inner)}) to {os.path.dirname(place)}: each of them is a run."
            problems.append(f"{place}: no recording of any camera ({', '.join(settings.cameras)}). {cure}")
        elif mode == "waterline":
            problems += (
                []
                if own and own.waterline
                else [
                    f"config.yaml: runs.{name}.waterline: mode waterline needs transects. Name some, each from and to."
                ]
            )
        elif mode == "space" and len(run.videos) < 2 and not (own and own.tags):
            problems.append(
                f"{place}: only camera {next(iter(run.videos))} has a recording, and mode space needs two or more. "
                f"Add another camera's, or set runs.{name}.mode: plane with a plane to move in."
            )
        elif mode == "space":
            problems += [
                f"{place}: camera {camera} has no calibration clip in calibration/. "
                f"Film calibration points with it, or take its recording out of the run."
                for camera in run.videos
                if camera not in calibrated
            ]
        elif len(run.videos) > 1:
            problems.append(
                f"{place}: mode plane uses one camera, and here are {', '.join(run.videos)}. Keep one recording, "
                f"or set runs.{name}.mode: space."
            )
        problems += [
            f"config.yaml: runs.{name}.rate: the pictures of camera {camera} carry no times. Give how many were taken "
            f"a second, as in rate: 120."
            for camera, recording in run.recordings.items()
            if recording.numbered and not _has_rate(settings, name, camera)
        ]
        if own:
            problems += _check_run_settings(name, settings, experiment)
    return problems


def _has_rate(settings: Settings, run: str, camera: str) -> bool:
    own = settings.runs[run].rate if run in settings.runs else None
    return bool((own.get(camera) if isinstance(own, dict) else own) or settings.cameras[camera].rate)


def _check_run_settings(name: str, settings: Settings, experiment: Experiment) -> list[str]:
    case = _Case(settings, experiment, settings.runs[name], experiment.runs[name], f"config.yaml: runs.{name}")
    return [problem for check in _CHECKS for problem in check(case)]


def _check_cameras(case: _Case) -> list[str]:
    """Every part of a run that may be given camera by camera, by names that are cameras."""
    problems = []
    known = list(case.settings.cameras)
    for key in ("crop", "rate", "stream"):
        value = getattr(case.own, key)
        for camera in value if isinstance(value, dict) else ():
            if camera not in known:
                problems.append(f"{case.place}.{key}.{camera}: no such camera; {_hint(camera, known)}")
            elif camera not in case.run.videos:
                problems.append(
                    f"{case.place}.{key}.{camera}: this camera has no recording in the run; "
                    f"{some_of(list(case.run.videos))} have. Take the line out."
                )
    return problems


def _hint(name: str, known: list[str]) -> str:
    return hint_of(name, known, f"known: {some_of(known)}.")


def _check_plane(case: _Case) -> list[str]:
    plane = case.own.plane
    if case.own.mode != "plane":
        return []
    if plane is None or (plane.scale is None and plane.points is None):
        return [
            f"{case.place}.plane: mode plane needs a scale (units per px) or known points. "
            "Give plane: {scale: ...} or plane: {points: calibration/points.csv, clip: ...}."
        ]
    if plane.points is not None and plane.clip not in case.experiment.clips:
        return [f"{case.place}.plane.clip: {plane.clip} is no clip in calibration/. Name the one with the points."]
    return []


def _check_reference(case: _Case) -> list[str]:
    own, run = case.own.reference, case.run
    if not own:
        return []
    if not run.reference:
        return [f"{case.place}.reference: there is no reference.csv in the run's folder. Put it there."]
    problems = []
    if not run.reference.endswith(".csv"):
        return _check_reference_target(case)
    header = reference_columns(run)
    for key, column in (("time", own.time), ("value", own.value)):
        if not any(_means(cell, column) for cell in header):
            hint = hint_of(column, header, f"it has {some_of(header)}.")
            problems.append(f"{case.place}.reference.{key}: {run.reference} has no column {column!r}; {hint}")
    unit, units = split_unit(own.value)[1], case.settings.units
    if unit in LENGTHS and unit != units:
        problems.append(
            f"{case.place}.reference.value: column {own.value} of {run.reference} is in {unit}, but units is {units}. "
            f"Convert the column and name it so, or correct units."
        )
    return problems + _check_reference_target(case)


def _check_reference_target(case: _Case) -> list[str]:
    """Whether the target of the reference is one of the run's; of tracks only their files know the names."""
    target = case.own.reference.target if case.own.reference else None
    names = target_names(case.settings, case.run)
    if not target or target in names or (case.run.tracks and case.own.targets is None):
        return []
    return [f"{case.place}.reference.target: no target {target!r}; {_hint(target, names)}"]


def _means(cell: str, column: str) -> bool:
    """Whether a header's cell is the column that the config names: in any case, and `time (s)` for time_s."""
    found, unit = column_of(cell, [column])
    return found is not None and unit in ("", split_unit(column)[1])


def _check_bodies(case: _Case) -> list[str]:
    problems = []
    names = target_names(case.settings, case.run)
    problems += _check_tags(case)
    if case.run.tracks and case.own.targets is None:
        names = [name for body in case.own.bodies.values() for name in body.targets]  # their files know the names
    for body, parts in case.own.bodies.items():
        place = f"{case.place}.bodies.{body}"
        problems += [f"{place}.{t}: no such target; {_hint(t, names)}" for t in parts.targets if t not in names]
        if len(parts.targets) < 3 and not parts.tags:
            problems.append(f"{place}: {len(parts.targets)} targets; six degrees of freedom need three or more.")
    if case.own.analysis and case.own.bodies and (case.own.axes or case.settings.axes) is None:
        problems.append(
            f"{case.place}.axes: motions of a body need directions. Say which way waves travel and which is up, as in "
            "axes: {waves: +x, up: +z}."
        )
    return problems


def _check_tags(case: _Case) -> list[str]:
    """Whether a run has tags where its bodies do, and each tag is on one body."""
    problems: list[str] = []
    on: dict[int, str] = {}
    for body, parts in case.own.bodies.items():
        place = f"{case.place}.bodies.{body}.tags"
        if parts.tags and case.own.tags is None:
            problems.append(
                f"{place}: the run has no tags. Give family and size, as in {case.place.split(': ')[-1]}.tags: "
                "{family: 36h11, size: 4}."
            )
        for number in parts.tags:
            if number in on:
                problems.append(f"{place}.{number}: this tag is on body {on[number]} too. One number is one tag.")
            on[number] = body
    if case.own.tags and case.own.mode != "space":
        problems.append(f"{case.place}.tags: they are located in mode space, not {case.own.mode}. Take mode out.")
    if case.own.tags and case.run.tracks:
        problems.append(
            f"{case.place}.tags: camera {next(iter(case.run.tracks))} has tracks in place of a recording, and tags are "
            "found in pictures. Take tags out, or give the recordings."
        )
    return problems


def _check_channels(case: _Case) -> list[str]:
    path = channels_path(case.settings, case.run) or ""
    if case.own.channels and not os.path.isfile(path):
        return [f"{case.place}.channels.file: no such file as {path}. Put it there or correct the path."]
    return []


def _check_waterline(case: _Case) -> list[str]:
    own, run = case.own.waterline, case.run
    if not own or not run.videos:
        return []
    problems = []
    follower = own.camera or next(iter(run.videos))
    if follower in run.videos and follower not in case.experiment.cameras_in_clips():
        problems.append(
            f"{case.place}.waterline: camera {follower} has no calibration clip. Film calibration points with it."
        )
    problems += [
        f"{case.place}.waterline.transects.{transect}.profile: no such file as {path}. Correct the path."
        for transect, path in profiles(case.settings, run).items()
        if not os.path.isfile(path)
    ]
    if own.camera is not None and own.camera not in run.videos:
        problems.append(
            f"{case.place}.waterline.camera: {own.camera} has no recording in this run; "
            f"{_hint(own.camera, list(run.videos))}"
        )
    return problems


_CHECKS: tuple[Callable[[_Case], list[str]], ...] = (
    _check_cameras,
    _check_plane,
    _check_reference,
    _check_bodies,
    _check_channels,
    _check_waterline,
)
