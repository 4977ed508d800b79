"""What a run's cameras see of balls, moved from the middles of their outlines to where their own middles are seen.

A camera that was calibrated for points is used for points (`geometry.ball_perspective`). The radius of a ball in the
picture follows from its pixels, sample by sample, and from how wide its track looks at some samples: that is free of
the threshold. Where a sample shows a part of a ball (`merged`, `edge`), its radius lies between its neighbours'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.geometry.ball_perspective import SHARE, outline_offset
from vidtrack.geometry.camera import Camera
from vidtrack.memory import columns_of

if TYPE_CHECKING:
    from pandas import DataFrame

SIZE = ("time_s", "target", "tracklet", "field", "flag", "pixels")
"""The columns that say how large a ball looks."""

BALL = ("ball_x", "ball_y", "ball_radius")
"""The columns that `moved_columns` adds: px, what was taken off Xf and Yf, and the radius of the ball."""

WHOLE = ("", "recovered", "saturated")
"""Flags of samples that show a whole ball."""


@dataclass(frozen=True)
class Middles:
    """How sure the radii are, and when something is said.

    larger    apparent diameters over those by pixels, at least and at most; farther off it is something else
    tilted    of R^2 / f: how far the middle of a flat disc's outline lies from where its own is seen, sin(a) cos(a) at
              an angle a between disc and picture; rms over all directions that a camera can see
    said_px   offsets from which on the record's findings say that they were taken off
    """

    larger: tuple[float, float] = (0.7, 1.5)
    tilted: float = 0.35
    said_px: float = 0.05


MIDDLES = Middles()


class AtMiddles(NamedTuple):
    """Of a camera whose balls are moved: the distance (world units) of its points from where light leaves the last
    interface, as `outline_offset` takes it; None in air, or where it is not known.
    """

    distance: float | None = None

    def inwards(self, camera: Camera, b: Array, radius: ArrayLike) -> Array:
        """Where the middles of balls are seen, whose outlines have theirs at b (..., 2) px; radius (...) px."""
        return b - outline_offset(camera, b, radius, self.distance)

    def sd_inwards(self, sd: Array, moved: Array) -> Array:
        """The sd, px, of what was moved inwards by so many px, of one shape: it holds how well that is known."""
        return np.hypot(sd, SHARE * moved)

    def outwards(self, camera: Camera, b: Array, radius: ArrayLike) -> Array:
        """Where the outlines of balls have their middles, (..., 2) px, which are themselves seen at b."""
        return b + outline_offset(camera, b, radius, self.distance)


class BallSizes(NamedTuple):
    """What was taken off in one camera: px, the usual radius and the largest offset; describes: `points`, or `outlines`
    where nothing was, because its calibration has it already.
    """

    radius_px: float
    largest_px: float
    describes: str


def moved_columns(
    columns: Mapping[str, NDArray[Any]],
    camera: Camera,
    how: AtMiddles,
    larger: Mapping[str, float],
) -> tuple[dict[str, NDArray[Any]], Array]:
    """Columns of centroids or of tracklets at the balls' middles, and the offsets (N, 2) px that were taken off.

    larger   track: its apparent diameter over that by pixels, as of `larger_than_pixels`; others are as all of these
    sd_x, sd_y hold how well the offsets are known; columns BALL say what was taken off. A table without pixels is as it
    was.
    """
    b = np.stack([np.asarray(columns[name], float) for name in ("Xf", "Yf")], -1)
    if "pixels" not in columns:
        return dict(columns), np.zeros(b.shape)
    radius = _radii(columns, larger)
    offset = outline_offset(camera, b, radius, how.distance)
    own = dict(columns) | dict(zip(BALL, (*offset.T, radius), strict=True))
    for k, (at, sd) in enumerate((("Xf", "sd_x"), ("Yf", "sd_y"))):
        own[at] = b[:, k] - offset[:, k]
        if sd in columns:
            own[sd] = how.sd_inwards(np.asarray(columns[sd], float), offset[:, k])
    return own, offset


def sd_in_a_plane(columns: Mapping[str, NDArray[Any]], picture: tuple[int, int], radius: float) -> dict[str, Array]:
    """Columns sd_x, sd_y (N,), px, grown by what a plane map does not know of its balls' perspective.

    picture  px, (width, height), of the run
    radius   px, of the known points' balls, with which the map takes it up; 0 of points
    ASSUME: f is the picture's width (53 degrees across), so that the middles of balls' outlines lie x (R^2 - r^2) / f^2
    further out, x px from the middle of the picture.
    """
    if "pixels" not in columns or not {"sd_x", "sd_y"} <= set(columns):
        return {}
    more = np.nan_to_num(np.abs(_radii(columns, {}) ** 2 - radius**2)) / picture[0] ** 2
    return {
        sd: np.hypot(np.asarray(columns[sd], float), more * (np.asarray(columns[at], float) - (size - 1) / 2))
        for sd, at, size in zip(("sd_x", "sd_y"), ("Xf", "Yf"), picture, strict=True)
    }


def sd_of_flat(
    columns: Mapping[str, NDArray[Any]], camera: Camera, larger: Mapping[str, float]
) -> dict[str, NDArray[Any]]:
    """Columns of flat targets of radius R px, whose sd_x, sd_y (px) hold what is not known of how they are turned.

    A disc at an angle a to the picture has its middle nearer to the outline's far edge, by sin(a) cos(a) R^2 / f (f in
    px), to first order of R / f.
    """
    if "pixels" not in columns or not {"sd_x", "sd_y"} <= set(columns):
        return dict(columns)
    more = MIDDLES.tilted * np.nan_to_num(_radii(columns, larger)) ** 2 * camera.dx / camera.f
    return dict(columns) | {sd: np.hypot(np.asarray(columns[sd], float), more) for sd in ("sd_x", "sd_y")}


class Moved(NamedTuple):
    """Tables at balls' middles, and the largest offset, px."""

    tables: dict[str, DataFrame]
    largest_px: float


def at_middles(tables: Mapping[str, DataFrame], cameras: Mapping[str, Camera]) -> Moved:
    """Tables of balls, by camera, with Xf, Yf (px) where their middles are seen: of tracks, or of surveyed points.

    Their radius is that by their pixels; a table without, or without a camera, is as it was.
    """
    out, largest = {}, 0.0
    for name, table in tables.items():
        out[name] = table
        if name in cameras and "pixels" in table:
            own = columns_of(table, (*SIZE, "Xf", "Yf"))
            place = {"time_s": np.zeros(len(table)), "target": np.arange(len(table))} | own
            moved, offset = moved_columns(place, cameras[name], AtMiddles(), {})
            out[name] = table.assign(Xf=moved["Xf"], Yf=moved["Yf"])
            largest = max(largest, float(np.hypot(*offset.T).max(initial=0.0)))
    return Moved(out, largest)


def larger_than_pixels(
    columns: Mapping[str, NDArray[Any]], looks: Mapping[str, Mapping[str, ArrayLike]] | None
) -> dict[str, float]:
    """Of each track how much larger its apparent diameter is than that by its pixels: medians.

    columns  of the centroids; looks: track: time_s (s, of the same clock), width (px), as `ball_widths` has them
    """
    if not looks or "pixels" not in columns:
        return {}
    wide, out = _diameters(columns), {}
    time, target, whole = np.asarray(columns["time_s"], float), columns["target"], _whole(columns)
    for name, own in looks.items():
        at, width = np.asarray(own["time_s"], float), np.asarray(own["width"], float)
        rows = np.flatnonzero((target == name) & whole & (wide > 0))
        if not rows.size or not at.size:
            continue
        rows = rows[np.argsort(time[rows], kind="stable")]
        near = np.clip(np.searchsorted(time[rows], at - 1e-4), 0, rows.size - 1)
        same = (np.abs(time[rows[near]] - at) < 1e-3) & (width > 0)
        if same.any():
            out[name] = float(np.clip(np.median(width[same] / wide[rows[near[same]]]), *MIDDLES.larger))
    return out


def perspective_findings(seen: Mapping[str, BallSizes], where: str) -> list[Finding]:
    """What to know of balls whose perspective is no longer small."""
    taken = {name: own for name, own in seen.items() if own.describes == "points"}
    left = {name: own for name, own in seen.items() if own.describes != "points"}
    out = []
    if (most := max((own.largest_px for own in left.values()), default=0.0)) >= MIDDLES.said_px:
        text = (
            f"{where}: {', '.join(left)} was calibrated by an older version, by the middles of balls' outlines. These "
            f"lie up to {most:.2f} px from where the middles of this run's targets are seen: positions are wrong by "
            "what that is more or less than of the calibration's balls."
        )
        cure = "Calibrate again: run the experiment from its calibration on."
        out.append(Finding("doubtful", "perspective-of-balls", text, cure))
    if (most := max((own.largest_px for own in taken.values()), default=0.0)) >= MIDDLES.said_px:
        text = (
            f"{where}: targets are taken for balls: the middles of their outlines lie up to {most:.2f} px from where "
            "their own middles are seen, which is taken off."
        )
        cure = "Flat targets are off by as much: give flat: true for the run where they are; keep long ones small."
        out.append(Finding("note", "perspective-of-balls", text, cure))
    return out


def ball_sizes_seen(
    columns: Mapping[str, NDArray[Any]], camera: Camera, describes: str, offset: Array | None
) -> BallSizes:
    """What a camera's table shows of its balls; offset (N, 2) px that was taken off it, None: nothing was."""
    wide = _diameters(columns)
    if offset is None:
        b = np.stack([np.asarray(columns[name], float) for name in ("Xf", "Yf")], -1)
        offset = outline_offset(camera, b, wide / 2)
    wide = wide[np.isfinite(wide)]
    usual = float(np.median(wide)) / 2 if wide.size else np.nan
    return BallSizes(usual, float(np.hypot(*offset.T).max(initial=0.0)), describes)


def _radii(columns: Mapping[str, NDArray[Any]], larger: Mapping[str, float]) -> Array:
    """The radius (N,), px, of each row's ball; NaN where its track has no sample that shows its size."""
    wide = _diameters(columns)
    known = _whole(columns) & np.isfinite(wide)
    time = np.asarray(columns["time_s"], float)
    usual = float(np.median(list(larger.values()))) if larger else 1.0
    by = np.array([larger.get(name, usual) for name in columns["target"].tolist()])
    out = np.where(known, wide, np.nan)
    for rows in _tracks(columns):
        good = rows[known[rows]]
        if good.size and good.size < rows.size:
            out[rows] = np.interp(time[rows], time[good], wide[good])
        elif not good.size:
            out[rows] = wide[rows]
    return np.asarray(out * by / 2, float)


def _tracks(columns: Mapping[str, NDArray[Any]]) -> Sequence[NDArray[np.intp]]:
    """The rows of each tracklet, or where there are none of each target, in order of time."""
    names = columns["tracklet" if "tracklet" in columns else "target"].tolist()
    number = {name: k for k, name in enumerate(dict.fromkeys(names))}
    which = np.array([number[name] for name in names], np.intp)
    order = np.lexsort((np.asarray(columns["time_s"], float), which))
    return np.split(order, np.flatnonzero(np.diff(which[order])) + 1)


def _diameters(columns: Mapping[str, NDArray[Any]]) -> Array:
    """By pixels, (N,) px; NaN where there are none."""
    if "pixels" not in columns:
        return np.full(len(columns["time_s"]), np.nan)
    pixels = np.asarray(columns["pixels"], float)
    lines = np.isin(columns["field"].astype(str), ("top", "bottom")) + 1 if "field" in columns else 1
    return np.asarray(2 * np.sqrt(np.where(pixels > 0, pixels, np.nan) * lines / np.pi))


def _whole(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    if "flag" not in columns:
        return np.ones(len(columns["time_s"]), bool)
    return np.array([word in WHOLE or word is None or word != word for word in columns["flag"].tolist()], bool)
