"""What back writes: calced.prn, list.prn, fblocate.prn, and vid1iti.prn, vid2iti.prn (procedures 5.4 and 6.9 call
these two leftiti.prn and rightiti.prn).

calced.prn    a summary: mean absolute error by axis, as a share of the largest distance and of the diagonal field,
              and the largest error with its sign. Percentages, world units, 3 decimals
list.prn      point by point: calculated, surveyed, difference (2 decimals). Its running AvgError divides by the
              count of camera 1's points plus those done, not by those done: it is read as it stands and means
              nothing. Its line of = is in calced.prn, which therefore has two
fblocate.prn  a row a point: Xf Yf of camera 1, of camera 2, then both without distortion; the located points projected,
              px, 1 decimal, in the order in which camera 1 has the points that both see
vid1iti.prn   a row a point: Xf Yf, and both without distortion; the surveyed points projected by this camera alone
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.assessment.field_of_view import field_of_view, mean_depth
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, lines_of
from vidtrack.exchange.thesis.header import RULE, body_of, header, row
from vidtrack.files.atomic import replacing
from vidtrack.geometry.camera import Camera

_NUMBERS = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d{1,3})?")


class Calced(NamedTuple):
    """calced.prn. Arrays (3,) by axis; mean, most: world units; of_longest, of_field: percent; field: world units."""

    description: str
    points: int
    mean_all: float
    field: tuple[float, float]
    mean: Array
    of_longest: Array
    of_field: Array
    most: Array


class Listed(NamedTuple):
    """list.prn: of each point its tag, where it was calculated (n, 3) and surveyed (n, 3), world units."""

    tags: tuple[str, ...]
    located: Array
    surveyed: Array


def read_calced(path: Path) -> Calced:
    """Read calced.prn."""
    lines = lines_of(path)
    rules = [i for i, line in enumerate(lines) if line.strip().startswith("=====")]
    at = rules[-1] + 1 if rules else 0
    found: dict[str, list[float]] = {}
    heads = ("Points Calculated", "Diagonal field", "AvgError inches", "AvgErr/max dist", "AvgErr % field", "MaxError")
    for line in lines[at:]:
        for head in heads:
            if line.strip().startswith(head):
                found[head] = [v for text in _NUMBERS.findall(_values(line)) if math.isfinite(v := float(text))]
    needs = dict(zip(heads, (2, 2, 3, 3, 3, 3), strict=True))
    if short := [head for head in heads if len(found.get(head, ())) < needs[head]]:
        raise VidtrackError(
            f"{path}: no line {short[0]!r} with its {needs[short[0]]} numbers. Copy the whole file again."
        )
    n, mean_all = found[heads[0]][:2]
    description = next((line.strip() for line in lines[at:] if line.strip()), "")
    axes = [np.array(found[head][:3]) for head in heads[2:]]
    return Calced(description, int(n), mean_all, (found[heads[1]][0], found[heads[1]][1]), *axes)


def _values(line: str) -> str:
    """The parts of a line that hold its values: after an equals sign, or after the words."""
    parts = re.findall(r"=\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)", line)
    return " ".join(parts) if parts else line


def summary(description: str, located: Array, surveyed: Array, cameras: Sequence[Camera], units: str) -> Calced:
    """calced.prn of points located and surveyed (n, 3), the first two cameras' fields at their depth."""
    error = located - surveyed
    axes = np.arange(3)
    apart = np.linalg.norm(surveyed[:, None] - surveyed[None], axis=-1).max()
    field = [field_of_view(camera, mean_depth(camera, surveyed)).diagonal for camera in cameras[:2]]
    mean = np.abs(error).mean(0)
    of_longest = 100 * mean / apart if apart > 0 else np.full(3, np.nan)
    most = error[np.abs(error).argmax(0), axes]
    of_field = 100 * mean / float(np.mean(field))
    whole = float(np.abs(error).mean())
    return Calced(f"{description}, {units}", len(error), whole, (field[0], field[1]), mean, of_longest, of_field, most)


def write_calced(path: Path, calced: Calced) -> None:
    """Write calced.prn as back prints it."""

    def axes(values: Array, unit: str = "") -> str:
        return "\t".join(f"{name} = {value:3.3f}{unit}" for name, value in zip("XYZ", values, strict=True))

    text = ("Known calibration points are located and compared with", "their true places: a summary")
    body = f"{calced.description}\n\n\nPoints Calculated {calced.points}   AvgError {calced.mean_all:f}\n"
    body += f"Diagonal field of view\tcam1 = {calced.field[0]:3.1f}\tcam2 = {calced.field[1]:3.1f}\n\n"
    body += f"AvgError inches\t{axes(calced.mean)}\nAvgErr/max dist\t{axes(calced.of_longest, '%')}\n"
    body += f"AvgErr % field\t{axes(calced.of_field, '%')}\nMaxError   \t{axes(calced.most)}\n"
    with replacing(path) as file:
        file.write((header("calced.prn", text, height=12) + f"{RULE}\n{body}").encode())


def read_list(path: Path) -> Listed:
    """Read list.prn."""
    tags: list[str] = []
    located: list[list[float]] = []
    surveyed: list[list[float]] = []
    for i, line in enumerate(lines_of(path)):
        head, values = line.strip(), [float(text) for text in _NUMBERS.findall(line)]
        if head.startswith("Tag calculated") and values:
            tags.append(f"{values[0]:g}")
        for word, rows in (("Calculated", located), ("World", surveyed)):
            if head.startswith(word):
                if len(values) < 3:
                    raise VidtrackError(f"{path}, line {i + 1}: {word} has no x y z. Copy the whole file again.")
                rows.append(values[:3])
    if not tags or not len(tags) == len(located) == len(surveyed):
        raise VidtrackError(f"{path}: no list of points, or it breaks off. Copy the whole file again.")
    return Listed(tuple(tags), np.array(located), np.array(surveyed))


def write_list(path: Path, listed: Listed, decimals: int = 2) -> None:
    """Write list.prn; the running AvgError is the mean over the points so far."""
    text = ("Known calibration points are located and compared with", "their true places: point by point")
    error = listed.located - listed.surveyed
    running = np.cumsum(np.abs(error).sum(1)) / (3 * np.arange(1, len(error) + 1))
    body = ""
    for k, tag in enumerate(listed.tags):
        body += f"Tag calculated {tag} AvgError {running[k]:f}\n"
        for word, values in (("Calculated", listed.located), ("World", listed.surveyed), ("Difference", error)):
            body += f"{word} " + " ".join(f"{value:8.{decimals}f}" for value in values[k]) + "\n"
        body += "\n"
    with replacing(path) as file:
        file.write((header("list.prn", text, height=12) + body).encode())


def read_fblocate(path: Path) -> Array:
    """Read fblocate.prn: (n, 4, 2) px: camera 1, camera 2, camera 1 and camera 2 without distortion."""
    return _pixels(path, 8)


def read_iti(path: Path) -> Array:
    """Read vid1iti.prn, vid2iti.prn, leftiti.prn or rightiti.prn: (n, 2, 2) px, with distortion and without."""
    return _pixels(path, 4)


def _pixels(path: Path, columns: int) -> Array:
    rows = [row(path, line, text, columns, "a point") for line, text in body_of(path, "points")]
    return np.array([found[:columns] for found in rows]).reshape(len(rows), -1, 2)


def write_pixels(path: Path, b: Array, name: str) -> None:
    """Write fblocate.prn (n, 4, 2) or one of the iti files (n, 2, 2), px to one decimal; NaN is refused."""
    if not np.isfinite(b).all():
        raise VidtrackError(
            f"{path}: a point is not in front of both cameras, and the file has no mark for it. Remove the point."
        )
    text = ("Calculated screen locations of calibration points,", "used by showcalb.exe")
    body = "".join(" ".join(f"{value:5.1f}" for value in each) + "\n" for each in b.reshape(len(b), -1))
    with replacing(path) as file:
        file.write((header(name, text, height=12) + body.rstrip("\n")).encode())
