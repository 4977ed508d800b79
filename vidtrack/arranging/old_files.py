"""A folder of the thesis's programs as an experiment: which of its files goes where, and what config.yaml says."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from typing import Any, NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.camparm import Camparm, read_camparm
from vidtrack.exchange.thesis.outcam import read_outcam
from vidtrack.exchange.thesis.points import Survey, read_sighted, read_targets, read_world
from vidtrack.exchange.thesis.tracks import read_taped
from vidtrack.exchange.tracks.digitised import Convention
from vidtrack.exchange.tracks.picture_points import read_points
from vidtrack.files.atomic import replacing

SURVEYS = (
    ("balls.dat", read_targets),
    ("targets.dat", read_targets),
    ("world.prn", read_world),
    ("world.dat", read_world),
)
"""Files of surveyed points, the best first."""
CLIP, RUN = "balls", "run"


class OldFolder(NamedTuple):
    """What a folder of the old programs becomes.

    config   of config.yaml; points: rows tag, x, y, z; copies: from where, to where in the experiment
    notes    what the user should know, a sentence each
    """

    config: dict[str, Any]
    points: list[tuple[str, float, float, float]]
    copies: list[tuple[str, str]]
    notes: list[str]


def old_folder(folder: str, units: str, *, calibration: str = "points", run: str = RUN) -> OldFolder:
    """Look through a folder of the old programs: camparm.dat, cam1.prn, outcam1.prn, cam1vid.prn and so on, in any
    case.

    calibration  points: the cameras are calibrated anew, from cam1.prn; old: as calb did, from outcam1.prn
    VidtrackError, with all that is missing, where it is no such folder.
    """
    here = {name.lower(): os.path.join(folder, name) for name in sorted(os.listdir(folder))}
    numbers = [k for k in range(1, 10) if {f"cam{k}.prn", f"outcam{k}.prn", f"cam{k}vid.prn"} & set(here)]
    if "camparm.dat" not in here or not numbers:
        raise VidtrackError(
            f"{folder}: no camparm.dat with cam1.prn, outcam1.prn or cam1vid.prn. Name the folder that has them."
        )
    camparm = read_camparm(here["camparm.dat"])
    wanted = "cam{}.prn" if calibration == "points" else "outcam{}.prn"
    if missing := [wanted.format(k) for k in numbers if wanted.format(k) not in here]:
        other = "old" if calibration == "points" else "points"
        raise VidtrackError(f"{folder}: no {missing[0]}. Copy it there, or call with --calibration {other}.")
    notes = _differences(camparm, numbers, calibration)
    copies, cameras = [], {}
    for k in numbers:
        cameras[f"cam{k}"] = _camera(camparm, k, calibration)
        place = os.path.join("calibration", CLIP) if calibration == "points" else "calibration"
        copies.append((here[wanted.format(k)], os.path.join(place, f"cam{k}.prn")))
        if f"cam{k}vid.prn" in here:
            copies.append((here[f"cam{k}vid.prn"], os.path.join("runs", run, f"cam{k}.prn")))
    _read_all(copies, run)
    points = _points(here, numbers, calibration, notes)
    return OldFolder({"units": units, "cameras": cameras}, points, copies, notes)


def _read_all(copies: list[tuple[str, str]], run: str) -> None:
    """Read what is copied, once: a file that was cut off is refused before anything is written."""
    problems: list[str] = []
    for source, to in copies:
        try:
            if to.startswith(os.path.join("runs", run)):
                read_taped(source)
            elif to.startswith(os.path.join("calibration", CLIP)):
                read_points(source, Convention(), source)
            else:
                read_outcam(source)
        except VidtrackError as error:
            problems += error.problems
    if problems:
        raise VidtrackError(*problems)


def _camera(camparm: Camparm, k: int, calibration: str) -> dict[str, Any]:
    """What config.yaml says of a camera. calb calibrated every camera with the numbers of camera 1."""
    which = 0 if calibration == "old" else min(k, len(camparm.cameras)) - 1
    fixed = camparm.cameras[which]
    size = list(fixed.image_size)
    own: dict[str, Any] = {"Cx": fixed.Cx, "Cy": fixed.Cy, "sensor": [fixed.width, fixed.height]}
    return own | ({"tracks": {"size": size}} if calibration == "points" else {"camera_file": {"size": size}})


def _differences(camparm: Camparm, numbers: list[int], calibration: str) -> list[str]:
    if calibration == "points" or len(camparm.cameras) < 2 or camparm.cameras[0] == camparm.cameras[1]:
        return []
    return [
        f"camparm.dat has other numbers for camera 2; calb used those of camera 1 for {len(numbers)} cameras, "
        "and so does "
        "config.yaml with its outcam2.prn"
    ]


def _points(
    here: Mapping[str, str], numbers: list[int], calibration: str, notes: list[str]
) -> list[tuple[str, float, float, float]]:
    """The survey: of balls.dat or a file of its format, else of cam1.prn and cam2.prn themselves."""
    if calibration == "old":
        return []
    for name, read in SURVEYS:
        if name in here:
            return _rows(read(here[name]))
    seen = [read_sighted(here[f"cam{k}.prn"]) for k in numbers]
    whole = {tag: p for each in seen for tag, p in zip(each.tags, each.p, strict=True)}
    notes.append("no balls.dat: points.csv is made of the points of cam1.prn, cam2.prn ...")
    return [(tag, float(x), float(y), float(z)) for tag, (x, y, z) in whole.items()]


def _rows(survey: Survey) -> list[tuple[str, float, float, float]]:
    return [(tag, float(x), float(y), float(z)) for tag, (x, y, z) in zip(survey.tags, survey.p, strict=True)]


def write_experiment(old: OldFolder, to: str, text: str) -> list[str]:
    """Write an experiment folder; text: of config.yaml. The paths written; VidtrackError where one is there already."""
    made = [os.path.join(to, path) for _, path in old.copies] + [os.path.join(to, "config.yaml")]
    points = os.path.join(to, "calibration", "points.csv")
    made += [points] if old.points else []
    if there := [path for path in made if os.path.lexists(path)]:
        raise VidtrackError(f"{there[0]}: is there already. Name another folder, or remove it.")
    for source, path in old.copies:
        os.makedirs(os.path.dirname(os.path.join(to, path)), exist_ok=True)
        shutil.copyfile(source, os.path.join(to, path))
    if old.points:
        rows = "".join(f"{tag},{x!r},{y!r},{z!r}\n" for tag, x, y, z in old.points)
        with replacing(points) as file:
            file.write(f"tag,x,y,z\n{rows}".encode())
    with replacing(os.path.join(to, "config.yaml")) as file:
        file.write(text.encode())
    return made
