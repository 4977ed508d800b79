"""A run of two cameras as the files of the thesis's programs.

    camparm.dat                    the fixed parameters of both cameras
    balls.dat, targets.dat         the survey; world.dat, world.prn: the same without a head
    cam1.prn, cam2.prn             calibration points as calb, back and showcalb read them (calocate.prn, renamed)
    outcam1.prn, outcam2.prn       the calibration
    calced.prn, list.prn, fblocate.prn, vid1iti.prn, vid2iti.prn     what back makes of them
    cam1vid.prn, cam2vid.prn       every frame: time code, X Y of each target
    location.prn                   positions of one target

origin, axes    px from the centre of the top-left pixel, X right, Y down; world axes of points.csv; c = R p + T
units           the experiment's unit of length, mm for sensor and f, px
lens            calb has one term: f, Sx, Cx, Cy and K1 are fitted over the picture, and a note says how far that is
                off at most
time            labels of NTSC tape, 30 a second: that of the first camera's first frame, counted on without leaving out
                any, in both files (a row is one moment); of an interlaced frame the first field
missing         cam1vid.prn: the place before, as tsbackm prints it, 0 0 where there was none; a row in which no target
                was found is left out. location.prn: no row
tags            whole numbers; others are numbered from 0 in the order of balls.dat, and a note says which is which
digits          px to 0.01, world to 0.01 as the old programs print them (m: 0.0001, ft: 0.001)
"""

from __future__ import annotations

import os
import tempfile
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.calibration.assessment.field_of_view import field_of_view, mean_depth
from vidtrack.errors import VidtrackError
from vidtrack.exchange.digitised import Digitised, digitised
from vidtrack.exchange.measured import Run, Written
from vidtrack.exchange.thesis import back, camparm, location, outcam, points, tracks
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.timing.timecode import label_from_frame, parse

FILES = (
    *("camparm.dat", "balls.dat", "targets.dat", "world.dat", "world.prn"),
    *("cam1.prn", "cam2.prn", "outcam1.prn", "outcam2.prn"),
    *("calced.prn", "list.prn", "fblocate.prn", "vid1iti.prn", "vid2iti.prn"),
    *("cam1vid.prn", "cam2vid.prn", "location.prn"),
)
DECIMALS = {"m": 4, "ft": 3}
"""Of world lengths, where two are coarser than in the thesis's inches."""
NTSC = Fraction(30000, 1001)
"""Frames a second."""
EVEN = 1e-3
"""Share by which a recording's rate may differ from NTSC's."""


class Calibrated(NamedTuple):
    """The calibration points: the survey, and what each of two cameras saw of it."""

    survey: points.Survey
    seen: tuple[points.Sighted, points.Sighted]
    notes: list[str]


def write(run: Run) -> Written:
    """The files of a run; VidtrackError where it has no NTSC frames, no calibration points, or another lens."""
    own = digitised(run)
    if len(own.cameras) != 2:
        raise VidtrackError(
            f"run {run.name}: {len(own.cameras)} cameras, and the thesis's programs have two. Export csv."
        )
    code = _codes(run, own)
    calibrated = _calibrated(run, own.cameras)
    found = [outcam.nearest(camera, calibrated.survey.p) for camera in own.cameras]
    notes = [f"cam{k} is {camera.name}" for k, camera in enumerate(own.cameras, 1)]
    for each, camera in zip(found, own.cameras, strict=True):
        notes.append(f"{camera.name}: the lens of outcam is within {each.worst_px:.3g} px over the picture")
    notes += [*calibrated.notes, *(note for note in own.notes if "of a frame" in note)]
    with tempfile.TemporaryDirectory() as folder:
        _fixed(folder, own.cameras, found, calibrated)
        _back(folder, run, own.cameras, calibrated)
        notes += _moving(folder, run, own, code)
        return Written({name: _content(folder, name) for name in FILES}, notes)


def _content(folder: str, name: str) -> bytes:
    with open(os.path.join(folder, name), "rb") as file:
        return file.read()


def _codes(run: Run, own: Digitised) -> list[str]:
    """The label of each row: that of the first camera's first frame, counted on."""
    table = run.tables["trajectories"]
    table = table[table["timecode"].astype(str).str.len() > 0] if "timecode" in table else table.iloc[:0]
    first = run.centroids[own.cameras[0].name][["frame", "time_s"]].dropna().groupby("frame")["time_s"].min()
    step = float(np.median(np.diff(first.to_numpy()) / np.diff(first.index.to_numpy()))) if len(first) > 1 else 0.0
    if table.empty or abs(step * NTSC - 1) > EVEN:
        raise VidtrackError(
            f"run {run.name}: no NTSC time code (30 labels a second), which is the only time that the thesis's files "
            "have. Export csv."
        )
    row = int(first.index[int(np.argmin(np.abs(first.to_numpy() - float(table["time_s"].iloc[0]))))])
    begun = parse(str(table["timecode"].iloc[0]), NTSC) + -row
    start = parse(str(begun).replace(";", ":"), NTSC, drop=False)
    return [str(label) for label in label_from_frame(start.frame + np.arange(len(own.xyz)), NTSC)]


def _calibrated(run: Run, cameras: tuple[Camera, ...]) -> Calibrated:
    tables = []
    for camera in cameras:
        table = run.points[camera.name]
        table = table[table["used"].astype(bool) & np.isfinite(table["Xf"])].drop_duplicates("tag")
        if table.empty:
            raise VidtrackError(f"run {run.name}: camera {camera.name} has no calibration points. Export csv.")
        tables.append(table.set_index(table["tag"].astype(str)))
    tags = list(dict.fromkeys(tag for table in tables for tag in table.index))
    notes = []
    number = {tag: tag for tag in tags}
    if not all(tag.isdigit() and len(tag) < 9 for tag in tags) or len({int(tag) for tag in tags}) < len(tags):
        number = {tag: str(k) for k, tag in enumerate(tags)}
        notes = ["points are numbered: " + ", ".join(f"{k} is {tag}" for tag, k in number.items())]
    place = {tag: table.loc[tag, ["x", "y", "z"]].to_numpy(float) for table in tables for tag in table.index}
    survey = points.Survey(tuple(number[tag] for tag in tags), np.array([place[tag] for tag in tags]))
    seen = [
        points.Sighted(
            tuple(number[tag] for tag in table.index),
            table[["Xf", "Yf"]].to_numpy(float),
            table["pixels"].to_numpy(float),
            table[["x", "y", "z"]].to_numpy(float),
        )
        for table in tables
    ]
    return Calibrated(survey, (seen[0], seen[1]), notes)


def _fixed(folder: str, cameras: tuple[Camera, ...], found: list[outcam.Written], calibrated: Calibrated) -> None:
    p = calibrated.survey.p
    fields = tuple(field_of_view(camera, mean_depth(camera, p)).diagonal for camera in cameras)
    camparm.write_camparm(os.path.join(folder, "camparm.dat"), camparm.Camparm(tuple(f.fixed for f in found), fields))
    for name in ("balls.dat", "targets.dat"):
        points.write_targets(os.path.join(folder, name), calibrated.survey)
    for name in ("world.dat", "world.prn"):
        points.write_world(os.path.join(folder, name), calibrated.survey)
    for k, each in enumerate(found, 1):
        outcam.write_outcam(os.path.join(folder, f"outcam{k}.prn"), each.out, f"outcam{k}.prn")


def _back(folder: str, run: Run, cameras: tuple[Camera, ...], calibrated: Calibrated) -> None:
    """What back makes of the calibration: points that both cameras see, located and projected."""
    digits = DECIMALS.get(run.units, 2)
    first, second = calibrated.seen
    for k, (camera, seen) in enumerate(zip(cameras, calibrated.seen, strict=True), 1):
        points.write_sighted(os.path.join(folder, f"cam{k}.prn"), seen, f"cam{k}.prn", digits)
        alone = np.stack([project(camera, seen.p), project(camera.without_lens(), seen.p)], 1)
        back.write_pixels(os.path.join(folder, f"vid{k}iti.prn"), alone, f"vid{k}iti.prn")
    both = [tag for tag in first.tags if tag in second.tags]
    i, j = ([seen.tags.index(tag) for tag in both] for seen in (first, second))
    located = locate_points(list(cameras), np.stack([first.b[i], second.b[j]]), sd=1.0).point
    known: NDArray[np.bool_] = np.asarray(np.isfinite(located).all(-1))
    if known.sum() < 1:
        raise VidtrackError(f"run {run.name}: no calibration point is seen by both cameras. Export csv.")
    located, surveyed = located[known], first.p[i][known]
    tags = tuple(tag for tag, is_known in zip(both, known, strict=True) if is_known)
    back.write_list(os.path.join(folder, "list.prn"), back.Listed(tags, located, surveyed), digits)
    back.write_calced(
        os.path.join(folder, "calced.prn"), back.summary(f"run {run.name}", located, surveyed, cameras, run.units)
    )
    seen_by = [project(camera, located) for camera in (*cameras, *(camera.without_lens() for camera in cameras))]
    back.write_pixels(os.path.join(folder, "fblocate.prn"), np.stack(seen_by, 1), "fblocate.prn")


def _moving(folder: str, run: Run, own: Digitised, code: list[str]) -> list[str]:
    """The tracks and the positions; the target with the most positions comes first, and is the one of location.prn."""
    known = np.isfinite(own.xyz).all(-1)
    order = np.argsort(-known.sum(0), kind="stable")
    if not known.any():
        raise VidtrackError(f"run {run.name}: no target has a position; there is nothing to write.")
    for k in (0, 1):
        path = os.path.join(folder, f"cam{k + 1}vid.prn")
        tracks.write_taped(path, code, own.b[:, order, k], f"run {run.name}, {own.cameras[k].name}")
    name = own.names[order[0]]
    path = os.path.join(folder, "location.prn")
    text = f"run {run.name}, target {name}, {run.units}"
    location.write_location(path, (code, code), own.xyz[:, order[0]], text, DECIMALS.get(run.units, 2))
    notes = ["time codes of both files are those of cam1, counted on without leaving out labels"]
    if len(order) > 1:
        columns = ", ".join(own.names[k] for k in order)
        notes.append(
            f"cam1vid.prn has the targets in the order {columns}; location.prn has {name} alone, as locate does"
        )
    return notes
