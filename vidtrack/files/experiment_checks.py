"""Whether an experiment folder can be worked on: every problem that shows before work begins, told at once."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import PICKS, POINTS, TARGETS, TRUTH, Columns
from vidtrack.files.experiment import (
    Experiment,
    channels_path,
    look_through,
    profiles,
    reference_columns,
    tags_of,
    target_names,
    within,
)
from vidtrack.naming import did_you_mean
from vidtrack.settings import Settings


def checked_experiment(settings: Settings) -> Experiment:
    """The experiment that the settings name; VidtrackError with every problem of it, a line each."""
    experiment, problems = look_through(settings)
    problems += _check_names(settings, experiment)
    problems += _check_tables(settings, experiment)
    problems += _check_runs(settings, experiment)
    if problems:
        raise VidtrackError(*dict.fromkeys(problems))
    return experiment


def _check_names(settings: Settings, experiment: Experiment) -> list[str]:
    clips, runs, problems = experiment.clips, experiment.runs, []
    for name in [*settings.calibration.clips, *settings.calibration.after]:
        if name not in clips:
            near = did_you_mean(name, clips)
            hint = f"did you mean {near!r}?" if near else f"folders there: {', '.join(clips) or 'none'}."
            problems.append(f"config.yaml: calibration.clips.{name}: no such folder in calibration/; {hint}")
    for name in settings.runs:
        if name not in runs:
            near = did_you_mean(name, runs)
            hint = f"did you mean {near!r}?" if near else f"folders there: {', '.join(runs) or 'none'}."
            problems.append(f"config.yaml: runs.{name}: no such folder in runs/; {hint}")
    return problems


def _check_tables(settings: Settings, experiment: Experiment) -> list[str]:
    problems: list[str] = []
    known: list[str] = []
    if experiment.points:
        known = [str(tag) for tag in _checked(experiment.points, POINTS, problems).get("tag", [])]
    elif experiment.clips:
        where = within(experiment.folder, "calibration", "points.csv")
        problems.append(f"{where}: no such file. Write tag,x,y,z: the surveyed position of every calibration point.")
    for name, clip in experiment.clips.items():
        tags = tags_of(settings, name, known)
        place = f"config.yaml: calibration.clips.{name}.tags"
        for tag in tags if known else ():
            if tag not in known:
                problems.append(f"{place}: tag {tag} is not in {experiment.points}. Add it there or correct the tags.")
            elif tags.count(tag) > 1:
                problems.append(f"{place}: tag {tag} appears twice. Name each once.")
        if clip.picks:
            picks = _checked(clip.picks, PICKS, problems)
            problems += _foreign(clip.picks, "tag", picks, tags, f"clip {name} shows") if known else []
            problems += _foreign(clip.picks, "camera", picks, settings.cameras, "config.yaml names")
    for run in experiment.runs.values():
        if run.targets:
            targets = _checked(run.targets, TARGETS, problems)
            problems += _foreign(run.targets, "camera", targets, settings.cameras, "config.yaml names")
        if run.truth:
            _checked(run.truth, TRUTH, problems)
    return problems


def _checked(path: str, columns: Columns, problems: list[str]) -> dict[str, list[str]]:
    try:
        return checked_csv(path, columns)
    except VidtrackError as error:
        problems += error.problems
        return {}


def _foreign(path: str, column: str, table: Mapping[str, list[str]], known: Iterable[str], who: str) -> list[str]:
    known = list(known)
    problems = []
    for name, line in zip(table.get(column, ()), table.get("line", ()), strict=True):
        if name not in known:
            near = did_you_mean(name, known)
            hint = f"did you mean {near!r}?" if near else f"known: {_some(known)}."
            problems.append(f"{path}, line {line}: {who} no {column} {name}; {hint}")
    return problems


def _some(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 12 else f"{', '.join(names[:10])} and {len(names) - 10} more"


def _check_runs(settings: Settings, experiment: Experiment) -> list[str]:
    problems = []
    calibrated = experiment.cameras_in_clips()
    for name, run in experiment.runs.items():
        own = settings.runs.get(name)
        place = within(experiment.folder, "runs", name)
        mode = own.mode if own else "space"
        if not run.videos:
            problems.append(
                f"{place}: no recording of any camera ({', '.join(settings.cameras)}). Put <camera>.<ext> there "
                "or delete the folder."
            )
        elif mode == "waterline":
            problems += (
                []
                if own and own.waterline
                else [
                    f"config.yaml: runs.{name}.waterline: mode waterline needs transects. Name some, each from and to."
                ]
            )
        elif mode == "space" and len(run.videos) < 2:
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
        if own:
            problems += _check_run_settings(name, settings, experiment)
    return problems


def _check_run_settings(name: str, settings: Settings, experiment: Experiment) -> list[str]:
    own, run, problems = settings.runs[name], experiment.runs[name], []
    place = f"config.yaml: runs.{name}"
    names = target_names(settings, run)
    if own.mode == "plane":
        plane = own.plane
        if plane is None or (plane.scale is None and plane.points is None):
            problems.append(
                f"{place}.plane: mode plane needs a scale (units per px) or known points. "
                "Give plane: {scale: ...} or plane: {points: calibration/points.csv, clip: ...}."
            )
        elif plane.points is not None and plane.clip not in experiment.clips:
            problems.append(
                f"{place}.plane.clip: {plane.clip} is no clip in calibration/. Name the one with the points."
            )
    if own.reference and not run.reference:
        problems.append(f"{place}.reference: there is no reference.csv in the run's folder. Put it there.")
    if own.reference and run.reference:
        header = reference_columns(run)
        for key, column in (("time", own.reference.time), ("value", own.reference.value)):
            if column not in header:
                near = did_you_mean(column, header)
                hint = f"did you mean {near!r}?" if near else f"it has {', '.join(header)}."
                problems.append(f"{place}.reference.{key}: {run.reference} has no column {column!r}; {hint}")
    if own.reference and own.reference.target and own.reference.target not in names:
        problems.append(f"{place}.reference.target: no target {own.reference.target!r}; known: {', '.join(names)}.")
    for body, parts in own.bodies.items():
        for target in parts.targets:
            if target not in names:
                problems.append(f"{place}.bodies.{body}.{target}: no such target; known: {', '.join(names)}.")
        if len(parts.targets) < 3:
            problems.append(
                f"{place}.bodies.{body}: {len(parts.targets)} targets; six degrees of freedom need three or more."
            )
    if own.analysis and own.bodies and own.axes is None:
        problems.append(
            f"{place}.axes: motions of a body need directions. Say which way waves travel and which is up, as in "
            "axes: {waves: +x, up: +z}."
        )
    if own.channels and not os.path.isfile(path := channels_path(settings, run) or ""):
        problems.append(f"{place}.channels.file: no such file as {path}. Put it there or correct the path.")
    if own.waterline and run.videos:
        camera = own.waterline.camera
        follower = camera or next(iter(run.videos))
        if follower in run.videos and follower not in experiment.cameras_in_clips():
            problems.append(
                f"{place}.waterline: camera {follower} has no calibration clip. Film calibration points with it."
            )
        problems += [
            f"{place}.waterline.transects.{transect}.profile: no such file as {path}. Correct the path."
            for transect, path in profiles(settings, run).items()
            if not os.path.isfile(path)
        ]
        if camera is not None and camera not in run.videos:
            problems.append(
                f"{place}.waterline.camera: {camera} has no recording in this run; {', '.join(run.videos)} do."
            )
    return problems
