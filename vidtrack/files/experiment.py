"""What an experiment folder holds: found, not listed."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vidtrack.errors import VidtrackError
from vidtrack.files.beside import (
    CAMERA_FILES,
    STILLS,
    TRACKS,
    alike_but_for_case,
    broken_link,
    entries,
    measured_in,
    named_as,
    table_in,
)
from vidtrack.files.config_file import read_config
from vidtrack.files.csv_checked import checked_csv, read_header
from vidtrack.files.csv_columns import POINTS, TARGETS
from vidtrack.files.recordings import Recording, inner_folders, of_folder, of_pattern, recordings_in
from vidtrack.naming import hint_of, some_of, tags_meant
from vidtrack.settings.board import Board, board_from_values
from vidtrack.settings.config import Settings


@dataclass(frozen=True)
class Clip:
    """A folder of calibration/: a recording for each camera, and where someone picked tagged points.

    videos      camera: the path of its recording's first file; recordings: all its files, where there are several
    digitised   the cameras whose file holds points that another program digitised, in place of a recording
    """

    name: str
    videos: Mapping[str, str]
    picks: str | None
    recordings: Mapping[str, Recording] = field(default_factory=dict)
    digitised: frozenset[str] = frozenset()
    board: str | None = None  # the path of its board.yaml, where the clip shows a board


@dataclass(frozen=True)
class Run:
    """A folder of runs/: a recording for each camera, as in `Clip`, and the tables beside them (None where absent).

    tracks   the cameras whose file holds tracks that another program made, in place of a recording
    """

    name: str
    videos: Mapping[str, str]
    targets: str | None
    reference: str | None
    truth: str | None
    recordings: Mapping[str, Recording] = field(default_factory=dict)
    tracks: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Experiment:
    """The inputs that lie in an experiment folder; paths begin with the folder as the config names it."""

    folder: str
    points: str | None
    clips: Mapping[str, Clip]
    runs: Mapping[str, Run]
    scenarios: Mapping[str, str]  # name: path, of rigs whose accuracy is to be predicted
    campaign: str | None = None  # runs.csv: under which conditions each run was made
    given: Mapping[str, str] = field(default_factory=dict)  # camera: path, of those that another program calibrated

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
        raise VidtrackError(
            f"config.yaml: experiment: no such folder as {folder!r}. Correct the name or make the folder."
        )
    problems += alike_but_for_case(list(settings.cameras), "config.yaml: cameras")
    clips = {}
    for name in _folders(within(folder, "calibration"), problems):
        here = within(folder, "calibration", name)
        found = recordings_in(here, list(settings.cameras), problems)
        points = named_as(here, set(settings.cameras) - set(found), TRACKS, problems)
        picks = table_in(here, "picks.csv", problems)
        videos = dict(sorted({**_firsts(found), **points}.items()))
        board = next((within(here, f) for f in ("board.yaml", "board.yml") if os.path.isfile(within(here, f))), None)
        problems += [t for f in ("board.yaml", "board.yml") if (t := broken_link(within(here, f)))]
        clips[name] = Clip(name, videos, picks, _several(found), frozenset(points), board)
    runs = {}
    for name in sorted({*_folders(within(folder, "runs"), problems), *_runs_elsewhere(settings)}):
        here = within(folder, "runs", name)
        found = recordings_in(here, list(settings.cameras), problems) if os.path.isdir(here) else {}
        found |= _elsewhere(name, settings, problems)
        tracks = named_as(here, set(settings.cameras) - set(found), TRACKS, problems)
        tracks |= {camera: one.path for camera, one in found.items() if _holds_tracks(one)}
        targets = table_in(here, "targets.csv", problems)
        reference, truth = (measured_in(here, table, problems) for table in ("reference", "truth"))
        videos = dict(sorted({**_firsts(found), **tracks}.items()))
        runs[name] = Run(name, videos, targets, reference, truth, _several(found), frozenset(tracks))
    survey = table_in(within(folder, "calibration"), "points.csv", problems)
    scenarios = _scenarios(within(folder, "sensitivity"))
    listed = within(folder, "runs.csv")
    if trouble := broken_link(listed):
        problems.append(trouble)
    campaign = listed if os.path.isfile(listed) else None
    for name in [name for name, clip in clips.items() if not clip.videos]:
        del clips[name]
        if inner := inner_folders(here := within(folder, "calibration", name)):
            problems.append(
                f"{here}: no recording of any camera, but folders ({some_of(inner)}). Move them to "
                f"{os.path.dirname(here)}, where each is a clip, or the folder to another place."
            )
    given = _given(settings, clips, problems)
    experiment = Experiment(folder, survey, clips, runs, scenarios, campaign, given)
    return experiment, problems


def awaited_runs(settings: Settings, experiment: Experiment) -> list[str]:
    """The runs that the config names and that have no folder yet: a rig is calibrated before the runs are made."""
    return [name for name in settings.runs if name not in experiment.runs]


def tags_of(settings: Settings, clip: str, known: Sequence[str]) -> list[str]:
    """The tags that a clip shows: those that the config names (see `naming.tags_meant`), or all in points.csv."""
    named = settings.calibration.clips[clip].tags if clip in settings.calibration.clips else None
    return tags_meant(named, known)[0] if named is not None else list(known)


def board_of(settings: Settings, experiment: Experiment, clip: str) -> Board | None:
    """The board that a clip shows: by its board.yaml, or by the config; None where it shows none."""
    here = experiment.clips[clip]
    if here.board:
        needed = "type, columns, rows and square of the board"
        return board_from_values(read_config(here.board, needed), here.board)
    board, wand = settings.calibration.board, settings.calibration.wand
    if board is None or (wand and clip in wand.clips):
        return None
    if board.clips is not None:
        return board if clip in board.clips else None
    return board if not experiment.points or clip.lower().startswith("board") else None


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
    """The names of the columns of a run's reference.csv; none of another instrument's file."""
    return read_header(run.reference) if run.reference and run.reference.endswith(".csv") else []


def files_of(part: Clip | Run, camera: str) -> str | tuple[str, ...]:
    """The path of a camera's recording, or the paths of all its files where there are several."""
    several = part.recordings.get(camera)
    return several.files if several else part.videos[camera]


def _holds_tracks(recording: Recording) -> bool:
    """Whether what the config names as a recording is a file of tracks, by its ending."""
    return not recording.others and os.path.splitext(recording.path)[1].lower().removeprefix(".") in TRACKS


def _given(settings: Settings, clips: Mapping[str, Clip], problems: list[str]) -> dict[str, str]:
    """The files of cameras that another program calibrated: those that the config names, and calibration/<camera>.<ext>
    of cameras that no clip shows.
    """
    shown = {camera for clip in clips.values() for camera in clip.videos}
    place = within(settings.experiment, "calibration")
    found = named_as(place, set(settings.cameras) - shown, CAMERA_FILES, problems)
    for camera, own in settings.cameras.items():
        if own.camera_file is None or own.camera_file.path is None:
            continue
        where = f"config.yaml: cameras.{camera}.camera_file.path"
        path = within(settings.experiment, own.camera_file.path)
        if camera in shown:
            problems.append(f"{where}: clips show this camera. Keep one of the two.")
        elif not os.path.isfile(path):
            problems.append(f"{where}: no such file as {path}. Correct the path.")
        else:
            found[camera] = path
    return dict(sorted(found.items()))


def _firsts(found: Mapping[str, Recording]) -> dict[str, str]:
    return {camera: recording.path for camera, recording in found.items()}


def _several(found: Mapping[str, Recording]) -> dict[str, Recording]:
    return {camera: recording for camera, recording in found.items() if recording.others}


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


def _runs_elsewhere(settings: Settings) -> list[str]:
    return [name for name, run in settings.runs.items() if run.videos]


def _elsewhere(name: str, settings: Settings, problems: list[str]) -> dict[str, Recording]:
    found = {}
    for camera, given in settings.runs[name].videos.items() if name in settings.runs else ():
        place = f"config.yaml: runs.{name}.videos.{camera}"
        if camera not in settings.cameras:
            hint = hint_of(camera, settings.cameras, f"known: {', '.join(settings.cameras)}.")
            problems.append(f"{place}: no such camera; {hint}")
        elif one := _named(place, given, settings, problems):
            found[camera] = one
    return found


def _named(place: str, given: str | tuple[str, ...], settings: Settings, problems: list[str]) -> Recording | None:
    """The recording that the config names: a file, several, a folder, or a pattern."""
    paths = [within(settings.experiment, path) for path in ([given] if isinstance(given, str) else given)]
    if len(paths) == 1 and os.path.isdir(paths[0]):
        return of_folder(paths[0], problems)
    if len(paths) == 1 and not os.path.lexists(paths[0]) and re.search(r"[*?]", os.path.basename(paths[0])):
        return of_pattern(paths[0], problems, place)
    if len(paths) > 1 and all(os.path.splitext(path)[1][1:].lower() in STILLS for path in paths):
        problems.append(f"{place}: several pictures. Name their folder, or a pattern such as cam1_*.png.")
        return None
    for path in paths:
        if trouble := broken_link(path):
            problems.append(trouble)
        elif not os.path.isfile(path):
            problems.append(f"{place}: no such file as {path}. Correct the path (relative to the experiment's folder).")
        else:
            continue
        return None
    return Recording(paths[0], tuple(paths[1:]))


def target_names(settings: Settings, run: Run) -> list[str]:
    """The names of a run's targets: the config's list, else those in targets.csv, else t1, t2, ...

    Of `all` only those in targets.csv are known before the run is located, or t1.
    """
    own = settings.runs[run.name].targets if run.name in settings.runs else None
    if isinstance(own, tuple):
        return list(own)
    if own in (None, "all") and run.targets:
        return list(dict.fromkeys(checked_csv(run.targets, TARGETS)["target"]))
    return [f"t{n + 1}" for n in range(own if isinstance(own, int) else 1)]


def profiles(settings: Settings, run: Run) -> dict[str, str]:
    """The files of surveyed points along a run's transects, by transect, where it names any."""
    own = settings.runs[run.name].waterline if run.name in settings.runs else None
    transects = own.transects if own else {}
    return {name: within(settings.experiment, t.profile) for name, t in transects.items() if t.profile}
