"""Calibration points that were digitised elsewhere: where a camera saw each tag, in place of a clip.

The thesis's calocate.prn, cam1.prn (tag X Y pixels x y z), cam.dat and calibrat.prn (tag X Y pixels); or a table of
any program with the columns tag, Xf, Yf (or x, y; u, v) and sd, with its pixels as `cameras.<camera>.tracks` says.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, leading_numbers, some, text_of
from vidtrack.exchange.thesis.header import body_of
from vidtrack.exchange.thesis.points import Sighted, read_picture_points, read_sighted
from vidtrack.exchange.tracks.digitised import Convention, Digitised, placed
from vidtrack.exchange.tracks.table import cells_of, numbers_of, split


class PicturePoints(NamedTuple):
    """Points in frame-buffer px.

    tags    n; b (n, 2) px; sd (n,) px, NaN where it is not known; pixels (n,), NaN where not counted
    p       (n, 3) their place in the world as the file has it, NaN where it has none
    """

    format: str
    tags: tuple[str, ...]
    b: Array
    sd: Array
    pixels: Array
    p: Array


def read_points(path: Path, said: Convention, where: str) -> PicturePoints:
    """The points in a file; VidtrackError, one line, for what cannot be read."""
    text = text_of(path)
    first = next((line for line in text.split("\n") if line.strip()), "")
    if "tag" in [cell.lower() for cell in split(text)[0][0]] and "=====" not in text and not leading_numbers(first):
        return _of_table(path, text, said, where)
    width = len(leading_numbers(body_of(path, "points")[0][1]))
    seen: Sighted = read_sighted(path) if width >= 7 else read_picture_points(path)
    nothing = np.full(len(seen.tags), np.nan)
    b = _placed(
        "thesis", seen.b, replace(said, origin=said.origin or "upper-left", first=said.first or (0.0, 0.0)), where
    )
    return PicturePoints("thesis", seen.tags, b, nothing, seen.pixels, seen.p)


def needed_size(said: Convention, camera: str) -> tuple[int, int]:
    """The size of the picture in px; VidtrackError where it is not known: no file of points has it."""
    if said.size is None:
        raise VidtrackError(
            f"config.yaml: cameras.{camera}.tracks.size: the size of the picture of camera {camera} is not known: its "
            "points were digitised elsewhere. Give size: [width, height] in px."
        )
    return said.size


def _of_table(path: Path, text: str, said: Convention, where: str) -> PicturePoints:
    _, table = split(text)
    at = {cell.lower(): k for k, cell in enumerate(table.header)}
    pairs = [pair for pair in (("xf", "yf"), ("x", "y"), ("u", "v")) if set(pair) <= set(at)]
    if not pairs:
        raise VidtrackError(f"{path}: no columns Xf, Yf beside tag; it has {some(table.header)}. Correct its header.")
    columns = [at[name] for name in pairs[0]]
    values = numbers_of(path, table, columns + ([at["sd"]] if "sd" in at else []))
    rows = [cells_of(line, table.separator) for line in table.text.split("\n") if line.strip()]
    tags = tuple(row[at["tag"]] for row in rows)
    if len(set(tags)) < len(tags):
        raise VidtrackError(f"{path}: a tag appears twice. Keep one row of each.")
    if pairs[0] == ("xf", "yf"):
        said = replace(said, origin=said.origin or "upper-left", first=said.first or (0.0, 0.0))
    b = _placed("table", values[:, :2], said, where)
    nothing = np.full(len(tags), np.nan)
    sd = values[:, 2] if values.shape[1] > 2 else nothing
    return PicturePoints("table", tags, b, sd, nothing, np.full((len(tags), 3), np.nan))


def _placed(format: str, b: Array, said: Convention, where: str) -> Array:
    tracks = Digitised(format, tuple(str(k) for k in range(len(b))), np.zeros(1, np.int64), b[None], True)
    return np.asarray(placed(tracks, said, where)[0])
