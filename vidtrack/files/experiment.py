"""What an experiment folder holds: found, not listed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vidtrack.errors import VidtrackError, first_of
from vidtrack.files.beside import (
    alike_but_for_case,
    broken_link,
    entries,
    is_recording,
    may_be_recording,
    table_in,
    unknown_camera,
)
from vidtrack.files.csv_checked import checked_csv, read_header
from vidtrack.files.csv_columns import POINTS, TARGETS
from vidtrack.naming import did_you_mean, tags_meant
from vidtrack.settings.config import Settings


@dataclass(frozen=True)
class Clip:
    """A folder of calibration/: a recording (path) for each camera, and where someone picked tagged points."""

    name: str
    videos: Mapping[str, str]
    picks: str | None


@dataclass(frozen=True)
class Run:
    """A folder of runs/: a recording (path) for each camera, and the tables beside them (None where absent)."""

    name: str
    videos: Mapping[str, str]
    targets: str | None
    reference: str | None
    truth: str | None


@dataclass(frozen=True)
class Experiment:
    """The inputs that lie in an experiment folder; paths begin with the folder as the config names it."""

    folder: str
    points: str | None
    clips: Mapping[str, Clip]
    runs: Mapping[str, Run]
    scenarios: Mapping[str, str]  # name: path, of rigs whose accuracy is to be predicted

    @property
    def results(self) -> str:
        """The folder that receives what comes out."""
        return within(self.folder, "results")

    def cameras_in_clips(self) -> list[str]:
        """The cameras that can be calibrated, in the order of their names."""
        return sorted({camera for clip in self.clips.values() for camera in clip.videos})


def within(folder: str, *parts: str) -> str:
    """A path inside a folder, without a leading `./`."""
    return os.path.normpath(os.path.join(folder, *parts))


def look_through(settings: Settings) -> tuple[Experiment, list[str]]:
    """What the experiment's folder holds, and what is wrong with its files' names, a line each.

    VidtrackError where there is no such folder.
    """
    folder = settings.experiment
    problems: list[str] = []
    if not os.path.isdir(folder):
        raise VidtrackError(f"config.yaml: experiment: no such folder as {folder!r}. Correct it or make the folder.")
    clips = {}
    for name in _folders(within(folder, "calibration"), problems):
        here = within(folder, "calibration", name)
        videos = _recordings(here, settings, problems)
        clips[name] = Clip(name, videos, table_in(here, "picks.csv", problems))
    runs = {}
    for name in sorted({*_folders(within(folder, "runs"), problems), *_runs_elsewhere(settings)}):
        here = within(folder, "runs", name)
        videos = _recordings(here, settings, problems) if os.path.isdir(here) else {}
        videos |= _elsewhere(name, settings, problems)
        tables = [table_in(here, f"{table}.csv", problems) for table in ("targets", "reference", "truth")]
        runs[name] = Run(name, dict(sorted(videos.items())), *tables)
    points = table_in(within(folder, "calibration"), "points.csv", problems)
    scenarios = _scenarios(within(folder, "sensitivity"))
    experiment = Experiment(folder, points, {n: c for n, c in clips.items() if c.videos}, runs, scenarios)
    return experiment, problems


def tags_of(settings: Settings, clip: str, known: Sequence[str]) -> list[str]:
    """The tags that a clip shows: those that the config names (see `naming.tags_meant`), or all in points.csv."""
    named = settings.calibration.clips[clip].tags if clip in settings.calibration.clips else None
    return tags_meant(named, known)[0] if named is not None else list(known)


def point_tags(experiment: Experiment) -> list[str]:
    """The tags in points.csv, in its order."""
    return list(checked_csv(experiment.points, POINTS)["tag"]) if experiment.points else []


def channels_path(settings: Settings, run: Run) -> str | None:
    """Where the records of a run's other instruments lie; None where the config names none."""
    own = settings.runs.get(run.name)
    if own is None or own.channels is None:
        return None
    return within(settings.experiment, "runs", run.name, own.channels.file)


def reference_columns(run: Run) -> list[str]:
    """The names of the columns of a run's reference.csv."""
    return read_header(run.reference) if run.reference else []


def _folders(folder: str, problems: list[str]) -> list[str]:
    if not os.path.isdir(folder):
        return []
    names = []
    for name in entries(folder):
        path = within(folder, name)
        if os.path.isdir(path):
            names.append(name)
        elif trouble := broken_link(path):
            problems.append(trouble)
    problems += alike_but_for_case(names, folder)
    return names


def _scenarios(folder: str) -> dict[str, str]:
    names = entries(folder) if os.path.isdir(folder) else []
    return {os.path.splitext(n)[0]: within(folder, n) for n in names if n.endswith((".yaml", ".yml"))}


def _recordings(folder: str, settings: Settings, problems: list[str]) -> dict[str, str]:
    """A folder's recordings by camera. A file of unknown ending is one only if the camera has no other."""
    found: dict[str, str] = {}
    strangers = []
    names = [name for name in entries(folder) if may_be_recording(name) and not os.path.isdir(within(folder, name))]
    for name in sorted(names, key=lambda name: (not is_recording(name), name)):
        camera, path = os.path.splitext(name)[0], within(folder, name)
        if camera not in settings.cameras:
            if is_recording(name) or did_you_mean(camera, settings.cameras):
                strangers.append(unknown_camera(path, camera, list(settings.cameras)))
        elif trouble := broken_link(path):
            problems.append(trouble)
        elif camera not in found:
            found[camera] = path
        elif is_recording(name):
            problems.append(f"{path}: camera {camera} has another recording here, {found[camera]}. Keep one.")
    problems += first_of(strangers, folder)
    return found


def _runs_elsewhere(settings: Settings) -> list[str]:
    return [name for name, run in settings.runs.items() if run.videos]


def _elsewhere(name: str, settings: Settings, problems: list[str]) -> dict[str, str]:
    found = {}
    for camera, path in settings.runs[name].videos.items() if name in settings.runs else ():
        full = within(settings.experiment, path)
        place = f"config.yaml: runs.{name}.videos.{camera}"
        if camera not in settings.cameras:
            problems.append(f"{place}: no such camera; known: {', '.join(settings.cameras)}.")
        elif trouble := broken_link(full):
            problems.append(trouble)
        elif not os.path.isfile(full):
            problems.append(f"{place}: no such file as {full}. Correct the path (relative to the experiment's folder).")
        else:
            found[camera] = full
    return found


def target_names(settings: Settings, run: Run) -> list[str]:
    """The names of a run's targets: the config's list, else those in targets.csv, else t1, t2, ..."""
    own = settings.runs[run.name].targets if run.name in settings.runs else None
    if isinstance(own, tuple):
        return list(own)
    if own is None and run.targets:
        return list(dict.fromkeys(checked_csv(run.targets, TARGETS)["target"]))
    return [f"t{n + 1}" for n in range(own or 1)]


def profiles(settings: Settings, run: Run) -> dict[str, str]:
    """The files of surveyed points along a run's transects, by transect, where it names any."""
    own = settings.runs[run.name].waterline if run.name in settings.runs else None
    transects = own.transects if own else {}
    return {name: within(settings.experiment, t.profile) for name, t in transects.items() if t.profile}
