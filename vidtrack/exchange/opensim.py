"""TRC and MOT: marker positions and motions as OpenSim reads them.

Layout: OpenSim's documentation, "Marker (.trc) Files" and "Motion (.mot) Files"; opensim-core issues 2289 (eight keys
in the header), 2345 (X1, Y1, Z1, ... numbered), 3648 (frames from 1), 1650 and 2120 (nRows and nColumns).

origin, axes    right-handed. OpenSim takes Y up: where the config names the run's `axes`, X is along the waves, Y up
                and Z completes the set; else the world's own axes, as in points.csv, and a note says so
units           mm in TRC, m and degrees in MOT (inDegrees=yes)
angles          MOT: the body's roll, pitch, yaw, intrinsic z-y'-x'', as bodies.parquet has them (world axes)
time            s since midnight, one rate in TRC: samples that are not even in time are refused
missing         TRC: empty cells. MOT: a moment at which no body is located has no row; a body that is missing beside
                others is NaN
"""

from __future__ import annotations

import numpy as np

from vidtrack.analysis.motions import basin_axes
from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import Run, Written, evenly, filled_gaps, series

KEYS = [
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
]
COORDINATES = ("tx", "ty", "tz", "roll", "pitch", "yaw")


def write_trc(run: Run) -> Written:
    """The trajectories of a run as one TRC file; VidtrackError for samples that are not even in time."""
    s = series(run.tables["trajectories"])
    _check_names(run, s.names)
    even = evenly(s.time, run.name, "TRC")
    p = even.filled(s.stacked("x", "y", "z")) * run.in_unit("mm")
    notes = filled_gaps(even, s.time)
    if run.waves and run.up:
        surge, _, heave = basin_axes(run.waves, run.up)
        p = p @ np.stack([surge, heave, np.cross(surge, heave)]).T
        notes.append(f"X is {run.waves} of the world, Y is {run.up} (up)")
    else:
        notes.append("axes are the world's; OpenSim takes Y up: name runs.<run>.axes to have it turned")
    count, markers, rate = even.length, len(s.names), f"{even.rate:.9g}"
    values = (rate, rate, str(count), str(markers), "mm", rate, "1", str(count))
    lines = [f"PathFileType\t4\t(X/Y/Z)\t{run.name}.trc", "\t".join(KEYS), "\t".join(values)]
    lines.append("Frame#\tTime\t" + "".join(f"{name}\t\t\t" for name in s.names))
    lines.append("\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, markers + 1)))
    lines.append("")
    whole = np.isfinite(p).all(-1, keepdims=True)
    cells = _cells(np.where(whole, p, np.nan).reshape(count, -1))
    lines += [
        "\t".join([str(i), f"{t:.6f}", *row]) for i, (t, row) in enumerate(zip(even.times(), cells, strict=True), 1)
    ]
    return Written({f"{run.name}.trc": ("\n".join(lines) + "\n").encode()}, notes)


def write_mot(run: Run) -> Written:
    """The bodies of a run as one MOT file: columns <body>_tx ... <body>_yaw; VidtrackError where it has no body."""
    s = series(run.tables["bodies"], "body")
    _check_names(run, s.names)
    move = s.stacked("x", "y", "z") * run.in_unit("m")
    values = np.concatenate([move, s.stacked("roll", "pitch", "yaw")], -1)
    located = np.isfinite(values).any((1, 2))
    if not located.any():
        raise VidtrackError(f"run {run.name}: no body was located; there is nothing to write.")
    values, time = values[located].reshape(located.sum(), -1), s.time[located]
    names = [f"{body}_{c}" for body in s.names for c in COORDINATES]
    lines = [run.name, "version=1", f"nRows={len(time)}", f"nColumns={len(names) + 1}", "inDegrees=yes", ""]
    lines += ["x, y, z: m; angles: degrees, intrinsic z-y'-x''", "endheader", "\t".join(["time", *names])]
    lines += ["\t".join([f"{t:.6f}", *row]) for t, row in zip(time, _cells(values, "NaN"), strict=True)]
    dropped = int((~located).sum())
    notes = [f"{dropped} moments at which no body is located have no row"] if dropped else []
    return Written({f"{run.name}.mot": ("\n".join(lines) + "\n").encode()}, notes)


def _cells(values: np.ndarray, missing: str = "") -> list[list[str]]:
    """Numbers as the shortest text that gives them back; NaN as `missing`."""
    return [[missing if v != v else repr(v) for v in row] for row in values.tolist()]


def _check_names(run: Run, names: tuple[str, ...]) -> None:
    if bad := [name for name in names if any(c in name for c in "\t\r\n")]:
        raise VidtrackError(
            f"run {run.name}: the name {bad[0]!r} has a tab or a line break, which ends a column. Rename it."
        )
