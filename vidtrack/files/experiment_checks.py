"""Whether an experiment folder can be worked on: every problem that shows before work begins, reported at once."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Mapping

from vidtrack.errors import VidtrackError, first_of
from vidtrack.files.beside import entries, is_recording
from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import CAMPAIGN, PICKS, POINTS, PROFILE, TARGETS, TRUTH, Columns
from vidtrack.files.experiment import Experiment, Run, awaited_runs, board_of, look_through, profiles, tags_of, within
from vidtrack.files.run_checks import check_runs
from vidtrack.files.same_recordings import check_same_recordings
from vidtrack.naming import did_you_mean, hint_of, some_of, tags_meant
from vidtrack.settings.config import Settings

_DATE = re.compile(r"\d{1,2}[-. ][A-Za-z]{3,9}\.?|[A-Za-z]{3,9}[-. ]\d{1,2}|\d{1,4}[-./]\d{1,2}[-./]\d{1,4}")


def checked_experiment(settings: Settings) -> Experiment:
    """The experiment that the settings name; VidtrackError with every problem of it, a line each."""
    experiment, problems = look_through(settings)
    problems += _check_folders(experiment.folder) or _check_names(settings, experiment)
    problems += _check_places(settings, experiment)
    problems += _check_tables(settings, experiment)
    problems += _check_lenses(settings, experiment)
    problems += check_runs(settings, experiment)
    problems += check_same_recordings(settings, experiment)
    problems += _check_self(settings, experiment)
    problems += _check_wand(settings, experiment)
    if problems:
        raise VidtrackError(*dict.fromkeys(problems))
    return experiment


def _check_folders(folder: str) -> list[str]:
    """A line for calibration/ or runs/ that is not there where another folder has nearly its name: calib, Runs, run."""
    there = [name for name in os.listdir(folder) if os.path.isdir(within(folder, name))]
    problems = []
    for wanted in ("calibration", "runs"):
        short = [name for name in there if len(name) > 2 and wanted.startswith(name.casefold())]
        near = short[0] if short else did_you_mean(wanted, there)
        if wanted not in there and near:
            problems.append(f"{wanted}/: no such folder; did you mean {near!r}? Rename it to {wanted}.")
    return problems


def _check_names(settings: Settings, experiment: Experiment) -> list[str]:
    clips, runs, problems = experiment.clips, experiment.runs, []
    waved = settings.calibration.wand
    for name in waved.clips if waved else ():
        if name not in clips:
            hint = hint_of(name, clips, f"folders there: {', '.join(clips) or 'none'}.")
            key = "wand.clip" if name == waved.clip else "wand.axes.drop"  # type: ignore[union-attr]
            problems.append(f"config.yaml: calibration.{key}: no folder {name} in calibration/; {hint}")
    for name in [*settings.calibration.clips, *settings.calibration.after]:
        if name not in clips:
            hint = hint_of(name, clips, f"folders there: {', '.join(clips) or 'none'}.")
            problems.append(f"config.yaml: calibration.clips.{name}: no such folder in calibration/; {hint}")
    unsaid = [name for name in runs if name not in settings.runs]
    for name in awaited_runs(settings, experiment):
        if unsaid:  # it may be what one of these is meant to be
            hint = hint_of(name, runs, f"folders there: {', '.join(runs)}.")
            problems.append(f"config.yaml: runs.{name}: no such folder in runs/; {hint}")
    return problems


def _check_places(settings: Settings, experiment: Experiment) -> list[str]:
    """Recordings of cameras that lie beside the folders of clips and runs, where nothing reads them."""
    used = {os.path.normpath(path) for run in experiment.runs.values() for path in run.videos.values()}
    used |= {path for run in experiment.runs.values() for one in run.recordings.values() for path in one.files}
    problems = []
    for part, inner in (("calibration", "clip"), ("runs", "run")):
        folder = within(experiment.folder, part)
        for name in entries(folder) if os.path.isdir(folder) else ():
            path = within(folder, name)
            if os.path.splitext(name)[0] not in settings.cameras or not is_recording(name) or os.path.isdir(path):
                continue
            if path not in used:
                problems.append(f"{path}: nothing reads it here. Move it to {within(folder, f'<{inner}>', name)}.")
    return problems


def _check_wand(settings: Settings, experiment: Experiment) -> list[str]:
    """What a wand cannot calibrate: cameras behind interfaces, of lenses known from elsewhere, of several models."""
    own = settings.calibration.wand
    cameras = list(experiment.clips[own.clip].videos) if own and own.clip in experiment.clips else []
    problems = []
    for camera in cameras:
        here = settings.cameras[camera]
        if here.through:
            problems.append(
                f"config.yaml: cameras.{camera}.through: a wand calibrates no camera that looks through an interface "
                f"({here.through[0]}). Calibrate it by surveyed points, or take its film out of calibration/{own.clip}."  # type: ignore[union-attr]
            )
        if here.calibration.lens or settings.calibration.lens:
            place = f"cameras.{camera}.calibration" if here.calibration.lens else "calibration"
            problems.append(
                f"config.yaml: {place}.lens: a wand finds the lens of {camera} itself. Leave it out, or write what is "
                "known of the lens as calibration.prior or fix."
            )
    models = {settings.cameras[camera].calibration.model or settings.calibration.model for camera in cameras}
    if len(models) > 1:
        problems.append(
            f"config.yaml: cameras: those of a wand have one lens model, not {', '.join(sorted(models))}. Name one, or "
            "auto, as calibration.model."
        )
    return problems


def _check_self(settings: Settings, experiment: Experiment) -> list[str]:
    """Runs in which the body that refines the cameras does not float."""
    own = settings.calibration.self_calibration
    if own is None:
        return []
    place, have = "config.yaml: calibration.self", {n: r for n, r in settings.runs.items() if own.body in r.bodies}
    problems, cure = [], f"Describe it under runs.<run>.bodies.{own.body}."
    for name in own.runs:
        if name not in experiment.runs:
            problems.append(f"{place}.runs: no folder {name} in runs/. Name a run that is there.")
        elif name not in have:
            problems.append(f"{place}.runs: run {name} has no body {own.body}. {cure}")
    used = own.runs or tuple(have)
    if not used:
        problems.append(f"{place}.body: no run has a body {own.body}. {cure}")
    problems += [
        f"{place}: run {name} is of mode {settings.runs[name].mode}; a body refines cameras in mode space."
        for name in used
        if name in settings.runs and settings.runs[name].mode != "space"
    ]
    places: dict[str, tuple[float, ...]] = {}
    for name in used:
        for target, at in (have[name].bodies[own.body].targets if name in have else {}).items():
            if places.setdefault(target, at) != at:
                problems.append(f"{place}: target {target} of {own.body} has another place in run {name}. Give one.")
    return problems


def _check_campaign(settings: Settings, experiment: Experiment) -> list[str]:
    """runs.csv may list runs that are still to be made, but a name that is nearly that of a run is a mistake."""
    if not experiment.campaign:
        return []
    problems: list[str] = []
    listed = _checked(experiment.campaign, CAMPAIGN, problems, settings.units, others="ignore").get("run", [])
    others = [name for name in experiment.runs if name not in listed]
    for name in listed:
        if name not in experiment.runs and (near := did_you_mean(str(name), others)):
            problems.append(f"{experiment.campaign}: no run {name!r} in runs/; did you mean {near!r}?")
    return problems


def _check_lenses(settings: Settings, experiment: Experiment) -> list[str]:
    """Files of known lenses that are not there."""
    places = {"calibration.lens": settings.calibration.lens}
    places |= {f"cameras.{name}.calibration.lens": own.calibration.lens for name, own in settings.cameras.items()}
    return [
        f"config.yaml: {place}: no such file as {within(experiment.folder, lens.file)}. Correct the path (relative to "
        "the experiment's folder)."
        for place, lens in places.items()
        if lens and lens.file and not os.path.isfile(within(experiment.folder, lens.file))
    ]


def _check_tables(settings: Settings, experiment: Experiment) -> list[str]:
    problems: list[str] = []
    known: list[str] = []
    if experiment.points:
        known = [str(tag) for tag in _checked(experiment.points, POINTS, problems, settings.units).get("tag", [])]
    elif any(board_of(settings, experiment, n) is None for n in set(experiment.clips) - set(_waved(settings))):
        where = within(experiment.folder, "calibration", "points.csv")
        problems.append(
            f"{where}: no such file. Write tag,x,y,z: the surveyed position of every calibration point; or describe "
            "the board that the clips show under calibration.board."
        )
    for name, clip in experiment.clips.items():
        if board_of(settings, experiment, name) is not None:
            continue
        if name in _waved(settings):
            if clip.picks:
                picks = _checked(clip.picks, PICKS, problems)
                problems += _foreign(clip.picks, "camera", picks, settings.cameras, "config.yaml names")
                problems += _unpicked(settings, clip.picks, picks)
            elif name == _waved(settings)[0]:
                problems += _unpicked(settings, within(experiment.folder, "calibration", name, "picks.csv"), {})
            continue
        tags = tags_of(settings, name, known)
        problems += _check_tags(settings, name, tags, known, experiment.points)
        if clip.picks:
            picks = _checked(clip.picks, PICKS, problems)
            problems += _foreign(clip.picks, "tag", picks, tags, f"clip {name} shows") if known else []
            problems += _foreign(clip.picks, "camera", picks, settings.cameras, "config.yaml names")
    problems += _check_campaign(settings, experiment)
    for run in experiment.runs.values():
        if run.targets:
            targets = _checked(run.targets, TARGETS, problems)
            problems += _foreign(run.targets, "camera", targets, settings.cameras, "config.yaml names")
            problems += _unlisted(settings, run, targets) if targets else []
        if run.truth and run.truth.endswith(".csv"):
            _checked(run.truth, TRUTH, problems, settings.units)
        for path in profiles(settings, run).values():
            if os.path.isfile(path):
                _checked(path, PROFILE, problems, settings.units, others="ignore")
    return problems


def _unlisted(settings: Settings, run: Run, boxes: Mapping[str, list[str]]) -> list[str]:
    """A line for each camera that has start boxes, and none for a target that another camera or the config names."""
    own = settings.runs[run.name].targets if run.name in settings.runs else None
    if isinstance(own, int) or own == "all":
        return []
    problems = []
    for camera in dict.fromkeys(boxes["camera"]):
        listed = [target for whose, target in zip(boxes["camera"], boxes["target"], strict=True) if whose == camera]
        names = own or dict.fromkeys(boxes["target"])
        if camera in run.videos and camera not in run.tracks and (lacking := [n for n in names if n not in listed]):
            problems.append(
                f"{run.targets}: camera {camera} has start boxes of {some_of(listed)}, and none of {some_of(lacking)}. "
                "A target has one name in all cameras and in config.yaml: correct it, or add the row."
            )
    return problems


def _waved(settings: Settings) -> tuple[str, ...]:
    """The clips that show a wand or a dropped ball: they need no points.csv, and their picks may name any point."""
    return settings.calibration.wand.clips if settings.calibration.wand else ()


def _unpicked(settings: Settings, path: str, picks: Mapping[str, list[str]]) -> list[str]:
    """Points that the wand's axes name and that are not picked in two cameras."""
    wand = settings.calibration.wand
    if wand is None or wand.axes is None or isinstance(wand.axes, str):
        return []
    own = wand.axes
    named = [own.origin, *(own.x or ()), *(own.y or ()), *(own.up or ()), *(own.level or ())]
    pairs = set(zip(picks.get("tag", ()), picks.get("camera", ()), strict=True))
    counts = Counter(tag for tag, _ in pairs)
    return [
        f"{path}: tag {tag}, which calibration.wand.axes names, is picked in {counts[tag]} cameras; it needs two. "
        "Write camera,tag,Xf,Yf for it."
        for tag in dict.fromkeys(tag for tag in named if tag is not None)
        if counts[tag] < 2
    ]


def _counted_from_0(missing: list[str], known: list[str], points: str) -> str:
    """What to write where the points are counted from 0 and the clips from 1, or the other way round; else empty."""
    if "0" in known and all(tag.isdecimal() and str(int(tag) - 1) in known for tag in missing):
        return f"{points} counts from 0: if this clip counts from 1, all its tags are one off. Count alike in both."
    if missing == ["0"] and "1" in known:
        return f"{points} counts from 1: if this clip counts from 0, all its tags are one off. Count alike in both."
    return ""


def _check_tags(settings: Settings, clip: str, tags: list[str], known: list[str], points: str | None) -> list[str]:
    """What is wrong with the tags that the config says a clip shows."""
    own = settings.calibration.clips.get(clip)
    if own is None or own.tags is None or not known:
        return []
    place = f"config.yaml: calibration.clips.{clip}.tags"
    problems = [f"{place}: {problem}" for problem in tags_meant(own.tags, known)[1]]
    unknown = {tag: _as_spreadsheets_have_it(tag, known) for tag in dict.fromkeys(tags) if tag not in known}
    changed = {tag: near for tag, near in unknown.items() if near}
    if changed:
        there = some_of([repr(near) for near in changed.values()], 6)
        problems.append(
            f"{place}: {_tags_are(list(changed))} not in {points}, but {there}, which may be the same: spreadsheets "
            "drop or add zeros, and make dates of numbers. Write the tags alike in both."
        )
    if missing := [tag for tag in unknown if tag not in changed]:
        cure = _counted_from_0(missing, known, str(points)) or "Add the points there or correct the tags."
        problems.append(f"{place}: {_tags_are(missing)} not in {points}. {cure}")
    for tag, times in Counter(tags).items():
        if tag in known and times > 1:
            problems.append(f"{place}: tag {tag} appears twice. Name each once.")
    return first_of(problems, place)


def _tags_are(tags: list[str]) -> str:
    return f"tag {tags[0]} is" if len(tags) == 1 else f"tags {some_of(tags, 6)} are"


def _as_spreadsheets_have_it(tag: str, known: list[str]) -> str | None:
    """The known tag that a spreadsheet may have made of this one: 1-2 became 02-Jan or 01-Feb, 01 became 1."""
    if tag.isdecimal():
        number = re.compile(rf"0*{int(tag)}(\.0+)?")
        return next((other for other in known if number.fullmatch(other)), None)
    if not re.fullmatch(r"\d{1,2}[-/.]\d{1,2}", tag):
        return None
    return next((other for other in known if _DATE.fullmatch(other)), None)


def _checked(
    path: str, columns: Columns, problems: list[str], units: str = "", others: str = "forbid"
) -> dict[str, list[str]]:
    try:
        return checked_csv(path, columns, others=others, units=units)
    except VidtrackError as error:
        problems += error.problems
        return {}


def _foreign(path: str, column: str, table: Mapping[str, list[str]], known: Iterable[str], who: str) -> list[str]:
    known = list(known)
    problems = []
    for name, line in zip(table.get(column, ()), table.get("line", ()), strict=True):
        if name not in known:
            hint = hint_of(name, known, f"known: {some_of(known)}.")
            problems.append(f"{path}, line {line}: {who} no {column} {name}; {hint}")
    return first_of(problems, path)
