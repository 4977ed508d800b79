"""Calibration points: targets.dat and balls.dat, calocate.prn and cam1.prn, cam.dat, world.dat, world.prn,
calibrat.prn.

targets.dat, balls.dat   the survey, typed by hand for subcapt: five lines of text, then `n 1 x y z` for a point that
                         was surveyed and `n 0` for a number that was not; n counts from 0 without a gap
calocate.prn             what subcapt writes, renamed to cam1.prn and cam2.prn for calb, back and showcalb: a header,
                         then `tag X Y pixels x y z` (X, Y printed to 0.01 px, the world to 0.01)
calibrat.prn             tsbackm's own points: `n X Y pixels`, no header, 6 decimals
cam.dat, world.dat,      named by procedures 5.4 and 6.9 and by no program of appendix C, which joined them in one file.
world.prn                ASSUME: `tag X Y [pixels]`, `tag x y z`, each with or without a header

What the old programs make of cam1.prn: subcapt writes a header of 11 lines, and calb, back and showcalb skip 12, in
pieces of at most 79 (calb) or 126 characters: back and showcalb lose the first point where the line of = fits into
one piece. calb uses at most 31 points and, where the file ends with a line end, one more of zeros. All points of the
file are read here, and what is written has a header of 12 lines that each fit into a piece.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, leading_numbers, lines_of
from vidtrack.exchange.thesis.header import body_of, header, row
from vidtrack.files.atomic import replacing

MOST_OF_CALB = 31
"""Points that calb uses, the first ones of its file."""


class Survey(NamedTuple):
    """Surveyed points: tags, and their place p (n, 3), world units; NaN for numbers that were not surveyed."""

    tags: tuple[str, ...]
    p: Array


class Sighted(NamedTuple):
    """Points as a camera saw them: b (n, 2) px, pixels (n,) above the threshold, and p (n, 3) world units."""

    tags: tuple[str, ...]
    b: Array
    pixels: Array
    p: Array


def read_targets(path: Path) -> Survey:
    """Read targets.dat or balls.dat; points that are not used are left out."""
    tags, p = [], []
    lines = lines_of(path)
    words = [(i + 6, found) for i, line in enumerate(lines[5:]) if (found := leading_numbers(line))]
    flat = [(line, value) for line, found in words for value in found]  # records may go over lines, as fscanf reads
    at = 0
    while at < len(flat):
        used = flat[at + 1][1] if at + 1 < len(flat) else np.nan
        need = 5 if used == 1 else 2
        if used not in (0.0, 1.0) or at + need > len(flat):
            raise VidtrackError(
                f"{path}, line {flat[at][0]}: a point is `n 1 x y z`, or `n 0` where it was not surveyed. Correct "
                "the line."
            )
        if used:
            tags.append(f"{flat[at][1]:g}")
            p.append([value for _, value in flat[at + 2 : at + 5]])
        at += need
    if not tags:
        raise VidtrackError(f"{path}: no surveyed point after five lines of text. Copy the whole file again.")
    return Survey(_once(path, tags), np.array(p))


def write_targets(path: Path, survey: Survey) -> None:
    """Write targets.dat; numbers between the tags that are not surveyed get `n 0`. Raises VidtrackError for "
    "other tags."""
    at = dict(zip(_counted(path, survey.tags), survey.p, strict=True))
    text = ["surveyed points", "n: number of the point", "1: surveyed, 0: not", "x y z: in the unit of the survey", ""]
    rows = [
        f"{n} 1 " + " ".join(f"{value:.17g}" for value in at[n]) if n in at else f"{n} 0" for n in range(max(at) + 1)
    ]
    with replacing(path) as file:
        file.write("\n".join([*text, *rows]).encode())  # no line end: the old reader would count one point more


def read_sighted(path: Path) -> Sighted:
    """Read calocate.prn, cam1.prn or cam2.prn."""
    rows = [row(path, line, text, 7, "a point (tag X Y pixels x y z)") for line, text in body_of(path, "points")]
    table = np.array([found[:7] for found in rows])
    tags = _once(path, [f"{tag:g}" for tag in table[:, 0]])
    return Sighted(tags, table[:, 1:3], table[:, 3], table[:, 4:7])


def write_sighted(path: Path, sighted: Sighted, name: str = "calocate.prn", decimals: int = 2) -> None:
    """Write calocate.prn as the old programs read it; X, Y to 0.01 as subcapt prints them, x, y, z to `decimals`."""
    text = (
        "Point tag, screen centroid, pixel count and world point location,",
        "as calb.exe, back.exe and showcalb.exe read them.",
        "",
        "Point   X       Y       Pixel   X       Y       Z",
        "Tag     cent    cent    Total   w       w       w",
    )
    rows = []
    for tag, b, pixels, p in zip(_counted(path, sighted.tags), sighted.b, sighted.pixels, sighted.p, strict=True):
        count = 0 if np.isnan(pixels) else round(float(pixels))
        rows.append(
            "\t".join([str(tag), f"{b[0]:.2f}", f"{b[1]:.2f}", str(count), *(f"{value:.{decimals}f}" for value in p)])
        )
    with replacing(path) as file:
        file.write((header(name, text, height=12) + "\n".join(rows)).encode())


def read_picture_points(path: Path) -> Sighted:
    """Read cam.dat or calibrat.prn: where points were seen; their place in the world is NaN."""
    rows = [row(path, line, text, 3, "a point (tag X Y)") for line, text in body_of(path, "points")]
    pixels = np.array([found[3] if len(found) > 3 else np.nan for found in rows])
    b = np.array([found[1:3] for found in rows])
    return Sighted(_once(path, [f"{found[0]:g}" for found in rows]), b, pixels, np.full((len(b), 3), np.nan))


def write_picture_points(path: Path, sighted: Sighted) -> None:
    """Write calibrat.prn, as tsbackm does: no header, 6 decimals. cam.dat is written alike."""
    rows = []
    for tag, b, pixels in zip(_counted(path, sighted.tags), sighted.b, sighted.pixels, strict=True):
        rows.append(f"{tag} {b[0]:.6f} {b[1]:.6f} {0 if np.isnan(pixels) else round(float(pixels))}\n")
    with replacing(path) as file:
        file.write("".join(rows).encode())


def read_world(path: Path) -> Survey:
    """Read world.dat or world.prn."""
    rows = [row(path, line, text, 4, "a point (tag x y z)") for line, text in body_of(path, "points")]
    return Survey(_once(path, [f"{found[0]:g}" for found in rows]), np.array([found[1:4] for found in rows]))


def write_world(path: Path, survey: Survey) -> None:
    """Write world.dat or world.prn: tag x y z, all digits, no header."""
    rows = [
        f"{tag}\t" + "\t".join(f"{value:.17g}" for value in p) + "\n"
        for tag, p in zip(_counted(path, survey.tags), survey.p, strict=True)
    ]
    with replacing(path) as file:
        file.write("".join(rows).encode())


def joined(seen: Sighted, survey: Survey) -> Sighted:
    """Points of cam.dat with their places of world.dat; VidtrackError where one has none."""
    at = dict(zip(survey.tags, survey.p, strict=True))
    if missing := [tag for tag in seen.tags if tag not in at]:
        raise VidtrackError(f"point {missing[0]} was seen and is not among the surveyed ones. Add it to the survey.")
    return seen._replace(p=np.array([at[tag] for tag in seen.tags]))


def _once(path: Path, tags: Sequence[str]) -> tuple[str, ...]:
    seen: set[str] = set()
    for tag in tags:
        if tag in seen:
            raise VidtrackError(f"{path}: point {tag} appears twice. Keep one of the two.")
        seen.add(tag)
    return tuple(tags)


def _counted(path: Path, tags: Sequence[str]) -> list[int]:
    """Tags as the whole numbers that the old programs need."""
    if odd := [tag for tag in tags if not (tag.isdigit() and len(tag) < 9)]:
        raise VidtrackError(f"{path}: tag {odd[0]} is no whole number, as the old programs need it. Rename it.")
    return [int(tag) for tag in tags]
