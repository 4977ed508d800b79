"""An experiment folder written from an arrangement: config.yaml, points.csv, and recordings where they belong."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from typing import Any, NamedTuple

from vidtrack.arranging.arrangement import Arrangement, Take, as_laid_out
from vidtrack.arranging.inventory import Recording
from vidtrack.files.atomic import replacing
from vidtrack.settings.commented import commented_config

HEAD = """What vidtrack is to do with the recordings of this folder.

A key that is commented out (#key: value) has the value that is shown, or, where it has no default, an example.
Take away its # to change it.

vidtrack pick     points, start boxes and thresholds, in the browser
vidtrack check    what will come of it, and what is wrong
vidtrack run      everything that is not done yet, with the verdict last
vidtrack report   the page with all results"""

POINTS = "tag,x,y,z,sigma\n"
"""The header of points.csv: surveyed positions; sigma, their tolerance, may be left empty."""


class Written(NamedTuple):
    """What was done: files that were written, recordings that were put in place, what was left as it is and why."""

    written: list[str]
    placed: list[tuple[str, str]]
    left: list[str]


def home(take: Take, camera: str) -> str:
    """Where the contract has the recording of a camera, relative to the experiment's folder.

    One of several files lies in a folder of the camera.
    """
    recording = take.recordings[camera]
    folder = os.path.join("calibration" if take.kind == "calibration" else "runs", take.name, camera)
    if len(recording.parts) > 1:
        if as_laid_out(recording) == (camera, folder.split(os.sep)[:2]):
            return recording.path
        return os.path.join(folder, os.path.basename(recording.path))
    return folder + os.path.splitext(recording.path)[1]


def config_values(arrangement: Arrangement, units: str, placed: bool) -> dict[str, Any]:
    """What config.yaml must say of an arrangement; `placed`: recordings will lie where the contract has them."""
    runs: dict[str, Any] = {}
    for take in arrangement.of("run"):
        away = {c: _named(r) for c, r in take.recordings.items() if r.path != home(take, c)}
        runs[take.name] = {"mode": "plane"} if len(arrangement.cameras) == 1 else {}
        if away and not placed:
            runs[take.name]["videos"] = away
    return {
        "units": units,
        "cameras": {camera: {} for camera in arrangement.cameras},
        "calibration": {"clips": {take.name: {} for take in arrangement.of("calibration")}},
        "runs": runs,
    }


def write_folder(folder: str, arrangement: Arrangement, units: str, how: str = "leave") -> Written:
    """Write config.yaml and points.csv where there are none, and put recordings in place.

    how   leave: they stay where they are, and config.yaml names those of the runs; link, copy, move
    Nothing is overwritten.
    """
    moves = [
        (recording, home(take, camera))
        for take in arrangement.takes
        for camera, recording in take.recordings.items()
        if recording.path != home(take, camera)
    ]
    done = Written([], [], [])
    if how != "leave":
        for recording, goal in moves:
            for part in recording.parts:
                name = os.path.basename(part if len(recording.parts) > 1 else goal)
                _place(folder, part, os.path.join(os.path.dirname(goal), name), how, done)
    text = commented_config(config_values(arrangement, units, how != "leave"), HEAD)
    _write(os.path.join(folder, "config.yaml"), text, done)
    _write(os.path.join(folder, "calibration", "points.csv"), POINTS, done)
    return done


def _named(recording: Recording) -> str | list[str]:
    """How config.yaml names a recording that lies elsewhere: its file, its files, or a pattern of numbered pictures."""
    if recording.kind == "pictures":
        stem, ending = os.path.splitext(recording.path)
        return f"{stem.rstrip('0123456789')}*{ending}".replace(os.sep, "/")
    paths = [part.replace(os.sep, "/") for part in recording.parts]
    return paths[0] if len(paths) == 1 else paths


def _place(folder: str, path: str, goal: str, how: str, done: Written) -> None:
    source, target = os.path.join(folder, path), os.path.join(folder, goal)
    if os.path.lexists(target):
        done.left.append(f"{goal}: is there already; {path} stays where it is")
        return
    os.makedirs(os.path.dirname(target), exist_ok=True)
    _WAYS[how](source, target)
    done.placed.append((path, goal))


def _link(source: str, target: str) -> None:
    os.symlink(os.path.relpath(os.path.realpath(source), os.path.realpath(os.path.dirname(target))), target)


def _copy(source: str, target: str) -> None:
    with replacing(target) as file, open(source, "rb") as original:
        shutil.copyfileobj(original, file, 1 << 20)


_WAYS: dict[str, Callable[[str, str], object]] = {"link": _link, "copy": _copy, "move": os.rename}


def _write(path: str, text: str, done: Written) -> None:
    if os.path.lexists(path):
        done.left.append(f"{path}: is there already, and stays as it is")
        return
    with replacing(path) as file:
        file.write(text.encode())
    done.written.append(path)
