"""OpenFAST and WEC-Sim: motions of a floating platform under the names that their scripts take.

Layout: OpenFAST's output files (`.out`: text, tab-separated, names, units, rows); WEC-Sim's `output.bodies(i).position`
(n, 6) with time, as a .mat file.

origin, axes    motion about the place and attitude at rest, in the basin's axes where the run's `axes` are known:
                surge along the waves, heave up, sway completes the right-handed set. Without them the position of the
                body's origin in the world's axes and its attitude in the world (a note says so)
point           the first named point of the body (its CoG), else its origin
units           m and degrees in OpenFAST, m and rad in WEC-Sim
angles          yaw first, then pitch, then roll (intrinsic z-y'-x''); OpenFAST's own order is another one (small
                angles), from which they differ at most by half the product of two of them
time            s from the first sample; its time of day stands in the header of OpenFAST's file
missing         NaN
names           PtfmSurge PtfmSway PtfmHeave PtfmRoll PtfmPitch PtfmYaw; a second body's begin with its name
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.matlab import mat_file
from vidtrack.exchange.measured import Run, Series, Written, series

FREEDOMS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")


class Motion(NamedTuple):
    """Of one body: its name, the point, and (n, 6) in m and degrees over time (n,), s."""

    body: str
    point: str
    time: Array
    values: Array


def motions(run: Run) -> tuple[list[Motion], list[str]]:
    """What each body does, and the notes on the axes: from motions where there are any, else from bodies.

    VidtrackError where no body was located.
    """
    scale = np.array([run.in_unit("m")] * 3 + [1.0] * 3)
    table = run.tables.get("motions")
    if table is not None and len(table):
        found = []
        for body, rows in table.groupby("body", sort=False):
            point = str(rows["point"].iloc[0])
            own = series(rows[rows["point"] == rows["point"].iloc[0]], "body")
            found.append(Motion(str(body), point, own.time, _stack(own, [f.lower() for f in FREEDOMS]) * scale))
        return found, [f"{m.body}: motion of {m.point} about its place at rest, basin's axes" for m in found]
    own = series(run.tables["bodies"], "body")
    if not len(own.time):
        raise VidtrackError(f"run {run.name}: no body was located; there is nothing to write.")
    columns = ("x", "y", "z", "roll", "pitch", "yaw")
    values = own.stacked(*columns) * scale
    note = "position and attitude in the world: name `axes` to have motion about rest, in the basin's axes"
    return [Motion(name, "origin", own.time, values[:, i]) for i, name in enumerate(own.names)], [note]


def write_openfast(run: Run) -> Written:
    """The bodies of a run as one OpenFAST output file."""
    found, notes = motions(run)
    time = found[0].time
    names, units = ["Time"], ["(s)"]
    for i, motion in enumerate(found):
        names += [f"{'' if i == 0 else motion.body + '_'}Ptfm{freedom}" for freedom in FREEDOMS]
        units += ["(m)"] * 3 + ["(deg)"] * 3
    start = float(time[0]) if len(time) else 0.0
    lines = ["", f"Measured by vidtrack {run.version}, run {run.name}; Time 0 is {start:.6f} s after midnight", ""]
    lines += ["; ".join(notes), "", "", "\t".join(names), "\t".join(units)]
    values = np.concatenate([motion.values for motion in found], 1)
    for t, row in zip(time.tolist(), values.tolist(), strict=True):
        lines.append("\t".join([f"{t - start:.6f}", *("NaN" if v != v else repr(v) for v in row)]))
    return Written({f"{run.name}.out": ("\n".join(lines) + "\n").encode()}, notes)


def write_wecsim(run: Run) -> Written:
    """The bodies of a run as a .mat file with `output.bodies(i).position`, name and time."""
    found, notes = motions(run)
    bodies = np.empty((len(found),), dtype=[(name, object) for name in ("name", "time", "position")])
    for i, motion in enumerate(found):
        values = motion.values.copy()
        values[:, 3:] = np.radians(values[:, 3:])
        first = motion.time[0] if len(motion.time) else 0.0
        bodies[i] = (motion.body, (motion.time - first)[:, None], values)
    record: dict[str, Any] = {"output": {"bodies": bodies, "run": run.name, "notes": "; ".join(notes)}}
    return Written({f"{run.name}_wecsim.mat": mat_file(record, run.name)}, notes)


def _stack(own: Series, columns: list[str]) -> Array:
    return own.stacked(*columns)[:, 0]
