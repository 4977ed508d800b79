"""What was measured in a run, as the writers of other programs' files take it.

Targets share the moments of the run (n,); a moment or a target without a row is NaN with the flag `missing`. Positions
stay in world axes and in the experiment's unit of length; a writer that needs another unit converts by `Run.in_unit`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera
from vidtrack.lengths import METRES

if TYPE_CHECKING:
    from pandas import DataFrame

MISSING = "missing"
"""The flag of a moment at which a target has no row."""

TIME_DECIMALS = 6
"""Moments of two targets are one where they agree to a microsecond, as in the tables of bodies."""


@dataclass(frozen=True)
class Run:
    """One run's results; what a format does not need is left empty.

    units       the experiment's unit of length: m, cm, mm, in, ft
    tables      by name: trajectories, kinematics, bodies, motions, associations
    centroids, tracklets   by camera
    cameras     by name, as the pictures of the run have them
    points      calibration points by camera, as calibration/<camera>/points.parquet has them
    clocks      camera: {offset_s, rate_ppm}, added to its time
    waves, up   directions of the world (+x, +z ...), where the config says them
    is_flat     located in a plane by one camera: there is no z
    provenance  as in every result
    """

    name: str
    units: str
    tables: Mapping[str, DataFrame]
    centroids: Mapping[str, DataFrame] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    clocks: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    waves: str | None = None
    up: str | None = None
    is_flat: bool = False
    tracklets: Mapping[str, DataFrame] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    points: Mapping[str, DataFrame] = field(default_factory=dict)

    def in_unit(self, unit: str) -> float:
        """How many of `unit` (m, mm, ...) one world unit is."""
        return round(METRES[self.units] / METRES[unit], 12)

    @property
    def version(self) -> str:
        """vidtrack's version, as the provenance has it."""
        return str(self.provenance.get("vidtrack", ""))


class Written(NamedTuple):
    """What a writer made: files by name, and what their reader should know beyond them, a line each."""

    files: dict[str, bytes]
    notes: list[str]


class Series(NamedTuple):
    """A long table as arrays over its moments and its things (targets or bodies), in the order of their first rows.

    time (n,) s; names (m,); columns: name: (n, m), NaN or "" where a thing has no row; present (n, m)
    """

    time: Array
    names: tuple[str, ...]
    columns: dict[str, Any]
    present: Any

    def stacked(self, *columns: str) -> Array:
        """Columns as the last axis, (n, m, k); NaN where the table has no such column."""
        nothing = np.full((len(self.time), len(self.names)), np.nan)
        return np.stack([np.asarray(self.columns.get(c, nothing), float) for c in columns], -1)


def series(table: DataFrame, thing: str = "target", time: Array | None = None) -> Series:
    """A table of time_s, <thing> and further columns as arrays.

    time   (n,) the moments wanted; default: those of the table
    VidtrackError where a thing has two rows at one moment, or rows at others than those wanted.
    """
    exact = table["time_s"].to_numpy(float)
    own = exact.round(TIME_DECIMALS)
    moments, first = np.unique(own, return_index=True)
    given = exact[first] if time is None else np.asarray(time, float)
    moments = given.round(TIME_DECIMALS)
    if time is not None and not np.isin(own, moments).all():
        raise VidtrackError(f"a {thing} has rows at moments that trajectories.parquet lacks. Call vidtrack run.")
    whose = table[thing].astype(str).to_numpy()
    names = tuple(dict.fromkeys(whose))
    where = np.searchsorted(moments, own)
    known = where < len(moments)
    known[known] = moments[where[known]] == own[known]
    place = {name: i for i, name in enumerate(names)}
    column = np.array([place[name] for name in whose], np.intp)
    present = np.zeros((len(moments), len(names)), bool)
    if len(np.unique(where[known] * max(len(names), 1) + column[known])) < known.sum():
        raise VidtrackError(f"a {thing} has two rows at one moment. Delete the results of the run and run again.")
    present[where[known], column[known]] = True
    columns: dict[str, Any] = {}
    for name in table.columns:
        values = table[name].to_numpy()
        if name in ("time_s", thing) or (len(values) and isinstance(values[0], (np.ndarray, list))):
            continue
        if values.dtype.kind in "fiub":
            whole = np.full(present.shape, np.nan)
            whole[where[known], column[known]] = values[known].astype(float)
        else:
            text = np.array(["" if v is None or isinstance(v, float) else str(v) for v in values], object)
            whole = np.full(present.shape, "", object)
            whole[where[known], column[known]] = text[known]
        columns[str(name)] = whole
    return Series(given, names, columns, present)


class Even(NamedTuple):
    """Moments on an even grid: rate (Hz), start (s), and the number (n,) of each moment on it, 0 the first."""

    rate: float
    start: float
    index: Any

    @property
    def length(self) -> int:
        """Samples from the first to the last, gaps counted."""
        return int(self.index[-1]) + 1

    def filled(self, values: Array) -> Array:
        """Values (n, ...) on the whole grid (length, ...): NaN in gaps."""
        whole = np.full((self.length, *values.shape[1:]), np.nan)
        whole[self.index] = values
        return whole

    def times(self) -> Array:
        """The moments (length,), s, of the whole grid."""
        return self.start + np.arange(self.length) / self.rate


@dataclass(frozen=True)
class Evenness:
    """When moments count as even: no moment lies farther from the grid than this.

    share      of a sampling interval: at 1 m/s and 60 Hz it stands for 0.02 mm
    rounding   s, what the rounding of times to a microsecond may add
    """

    share: float = 1e-3
    rounding: float = 2e-6


EVENNESS = Evenness()


def evenly(time: Array, run: str, format_name: str) -> Even:
    """The even grid on which moments (n,), s, lie; nothing is ever resampled.

    A moment that is missing leaves a gap in the grid. VidtrackError where there are fewer than two moments, or where
    they are not even.
    """
    t = np.asarray(time, float)
    keep = "csv, parquet, netcdf and mat keep the time of each sample."
    if len(t) < 2:
        count = "no sample" if not len(t) else "one sample"
        raise VidtrackError(f"run {run}: {count}: {format_name} needs a rate, which takes two. {keep.capitalize()}")
    steps = np.diff(t)
    step = float(np.median(steps))
    index = np.concatenate([[0], np.cumsum(np.round(steps / step))]).astype(np.int64)
    for _ in range(3):
        slope, start = np.polyfit(index, t - t[0], 1)
        fitted = np.round((t - t[0] - start) / slope).astype(np.int64)
        if (fitted == index).all():
            break
        index = fitted
    off = np.abs(t - t[0] - start - slope * index)
    if (np.diff(index) < 1).any() or off.max() > EVENNESS.share * slope + EVENNESS.rounding:
        raise VidtrackError(
            f"run {run}: its samples are not even in time (by up to {1e3 * off.max():.3g} ms of {1e3 * slope:.4g}), "
            f"and {format_name} has one rate. {keep.capitalize()}"
        )
    return Even(float(1 / slope), float(t[0] + start), index - index[0])


def filled_gaps(even: Even, time: Array) -> list[str]:
    """The note of a file in which gaps of the record are missing points."""
    gaps = even.length - len(time)
    return [f"{gaps} moments at which there is no sample are missing points"] if gaps else []
