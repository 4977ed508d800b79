"""Points over time as another instrument measured them, and as tables that stage compare takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.lengths import METRES

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Measured:
    """Points over time.

    format   name of the format
    names    n points; p (k, n, 3) in `unit`, NaN where a point was not seen
    time_s   (k,) s from the first frame
    start_s  s since midnight at which the first frame was, where the file says it
    unit     one of METRES; None: the file does not say it
    """

    format: str
    names: tuple[str, ...]
    p: Array
    time_s: Array
    unit: str | None
    start_s: float | None = None


def scaled(measured: Measured, units: str, where: str) -> Array:
    """Positions (k, n, 3) in the experiment's unit; VidtrackError where the file's is not known."""
    if measured.unit is None:
        raise VidtrackError(
            f"{where}: the {measured.format} file states no unit of length. Convert it to CSV in {units}."
        )
    return np.asarray(measured.p * (METRES[measured.unit] / METRES[units]))


def clock(measured: Measured, offset_s: float | None, where: str) -> Array:
    """Times (k,), s since midnight, as trajectories have them.

    offset_s   added to the times from the first frame; None: the file's own time of day
    where      the section of the config that has offset_s, for messages
    """
    start = measured.start_s if offset_s is None else offset_s
    if start is None:
        raise VidtrackError(
            f"config.yaml: {where}.offset_s: the {measured.format} file does not say when its first frame was. "
            "Give its "
            "time as trajectories count it: s since midnight of the time code, or s after the first frame without one."
        )
    return np.asarray(measured.time_s + start)


def as_truth(measured: Measured, units: str, offset_s: float | None, where: str) -> DataFrame:
    """The table of truth.csv: time_s, target, x, y, z, points that were not seen left out."""
    from pandas import DataFrame

    p = scaled(measured, units, where)
    k, n = p.shape[:2]
    seen = np.isfinite(p).all(-1).ravel()
    flat = p.reshape(-1, 3)[seen]
    names = np.tile(np.array(measured.names, object), k)[seen]
    time = np.repeat(clock(measured, offset_s, where), n)[seen]
    return DataFrame({"time_s": time, "target": names, "x": flat[:, 0], "y": flat[:, 1], "z": flat[:, 2]})


def as_reference(measured: Measured, units: str, offset_s: float | str | None, where: str) -> DataFrame:
    """A table of time_s and, for each point, <name>_x, <name>_y, <name>_z.

    offset_s   as the config has it for the reference, which adds it later: then times count from the first frame, as
               they do where a file has no time of day
    """
    from pandas import DataFrame

    p = scaled(measured, units, where)
    start = measured.start_s if offset_s is None and measured.start_s is not None else 0.0
    table = {"time_s": measured.time_s + start}
    for i, name in enumerate(measured.names):
        table |= {f"{name}_{axis}": p[:, i, a] for a, axis in enumerate("xyz")}
    return DataFrame(table)
