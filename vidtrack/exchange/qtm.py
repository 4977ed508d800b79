"""Qualisys Track Manager: bodies and markers as its exports to TSV and MATLAB have them.

Layout: the manual's chapters on export to TSV and to MAT; checked with a public basin test (shiplab/dt_cv,
data/basin/raw/M510A-IRR-EKFPID-020019_6D.tsv): its angles are R = Rx(roll) Ry(pitch) Rz(yaw) to 5e-6, Rot[0] to Rot[8]
are R column by column.

origin, axes    the world's, right-handed, as in points.csv
units           mm, degrees, Hz
angles          roll, pitch, yaw of R = Rx(roll) Ry(pitch) Rz(yaw), computed from the quaternion: they are not those of
                bodies.parquet, where R = Rz(yaw) Ry(pitch) Rx(roll)
time            one rate, frames from 1, Time from 0: samples that are not even in time are refused. TIME_STAMP has the
                time of day of the first frame; the day is not known
missing         NaN. (Some versions of QTM write 0.000 into TSV, which a reader cannot distinguish from a place.)
residual        body: rms distance of its targets from the pose; marker: `miss`
files           <run>_6D.tsv where the run has bodies, <run>_3D.tsv, <run>_qtm.mat (a struct `QTM`)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.matlab import mat_file
from vidtrack.exchange.measured import Even, Run, Series, Written, evenly, filled_gaps, series
from vidtrack.motion.rigid import rotation_from_quaternion
from vidtrack.timing.clock_text import of_day

POSE = ("X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9)))
DIGITS = 6
"""Decimals of mm and degrees in TSV; Rot has three more."""


def write(run: Run) -> Written:
    """The targets, and where there are any the bodies, of a run; VidtrackError for samples not even in time."""
    s = series(run.tables["trajectories"])
    even = evenly(s.time, run.name, "QTM")
    scale = run.in_unit("mm")
    points = even.filled(s.stacked("x", "y", "z", "miss")) * scale
    files = {f"{run.name}_3D.tsv": _table_3d(run, s, even, points)}
    labelled = {"Count": float(len(s.names)), "Labels": _cells(s.names), "Data": points.transpose(1, 2, 0)}
    record: dict[str, Any] = {"File": f"{run.name}.qtm", "Timestamp": of_day(even.start), "StartFrame": 1.0}
    record |= {"Frames": float(even.length), "FrameRate": even.rate, "Trajectories": {"Labeled": labelled}}
    if "bodies" in run.tables:
        own = series(run.tables["bodies"], "body", s.time)
        place = even.filled(own.stacked("x", "y", "z")) * scale
        R = _rotations(even.filled(own.stacked("qw", "qx", "qy", "qz")))
        angles = np.degrees(roll_pitch_yaw(R))
        rms = even.filled(own.stacked("rms")) * scale
        columns = R.swapaxes(-1, -2).reshape(*R.shape[:2], 9)
        values = np.concatenate([place, angles, rms, columns], -1)
        files[f"{run.name}_6D.tsv"] = _table_6d(run, own, even, values)
        record["RigidBodies"] = {
            "Bodies": float(len(own.names)),
            "Name": _cells(own.names),
            "Positions": place.transpose(1, 2, 0),
            "Rotations": columns.transpose(1, 2, 0),
            "RPYs": angles.transpose(1, 2, 0),
            "Residual": rms.transpose(1, 2, 0),
        }
    files[f"{run.name}_qtm.mat"] = mat_file({"QTM": record}, run.name)
    return Written(files, filled_gaps(even, s.time))


def roll_pitch_yaw(R: Array) -> Array:
    """Roll, pitch, yaw (..., 3), rad, of R = Rx(roll) Ry(pitch) Rz(yaw); pitch within +-pi/2, the others +-pi."""
    roll = np.arctan2(-R[..., 1, 2], R[..., 2, 2])
    pitch = np.arctan2(R[..., 0, 2], np.hypot(R[..., 0, 0], R[..., 0, 1]))
    return np.stack([roll, pitch, np.arctan2(-R[..., 0, 1], R[..., 0, 0])], -1)


def _rotations(q: Array) -> Array:
    """(n, bodies, 3, 3) of unit quaternions (n, bodies, 4)."""
    return np.stack([rotation_from_quaternion(q[:, i]) for i in range(q.shape[1])], 1)


def _head(run: Run, even: Even, count: tuple[str, int], kind: str, names: tuple[str, tuple[str, ...]]) -> list[str]:
    if bad := [name for name in names[1] if any(c in name for c in "\t\r\n")]:
        raise VidtrackError(f"run {run.name}: the name {bad[0]!r} has a tab or a line break, which ends a column.")
    return [
        f"NO_OF_FRAMES\t{even.length}",
        f"NO_OF_CAMERAS\t{int(run.tables['trajectories'].get('n_cameras', np.zeros(1)).max())}",
        f"{count[0]}\t{count[1]}",
        f"FREQUENCY\t{even.rate:.9g}",
        "NO_OF_ANALOG\t0",
        "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\tvidtrack",
        f"TIME_STAMP\t{of_day(even.start)}",
        f"DATA_INCLUDED\t{kind}",
        "\t".join([names[0], *names[1]]),
    ]


def _table_3d(run: Run, s: Series, even: Even, points: Array) -> bytes:
    lines = _head(run, even, ("NO_OF_MARKERS", len(s.names)), "3D", ("MARKER_NAMES", s.names))
    lines.append("\t".join(["Frame", "Time", *(f"{name} {a}" for name in s.names for a in "XYZ")]))
    rows = points[..., :3].reshape(even.length, -1).round(DIGITS) + 0.0
    return _text(lines, even, [[f"{v:.{DIGITS}f}" for v in row] for row in rows.tolist()], "")


def _table_6d(run: Run, own: Series, even: Even, values: Array) -> bytes:
    lines = _head(run, even, ("NO_OF_BODIES", len(own.names)), "6D", ("BODY_NAMES", own.names))
    names = [f"{body} {POSE[0]}" if i == 0 else name for body in own.names for i, name in enumerate(POSE)]
    lines.append("\t".join(["Frame", "Time", *names]) + "\t")
    digits = [DIGITS + 3 if name.startswith("Rot") else DIGITS for name in POSE] * len(own.names)
    rows = values.reshape(even.length, -1).tolist()
    cells = [[f"{v:.{d}f}" for v, d in zip(row, digits, strict=True)] for row in rows]
    return _text(lines, even, cells, "\t")


def _text(lines: list[str], even: Even, cells: list[list[str]], end: str) -> bytes:
    rate = even.rate
    rows = ["\t".join([str(i + 1), f"{i / rate:.5f}", *row]) + end for i, row in enumerate(cells)]
    return ("\n".join([*lines, *rows]) + "\n").replace("\tnan", "\tNaN").encode()


def _cells(names: tuple[str, ...]) -> Any:
    cells = np.empty((1, len(names)), object)
    cells[0, :] = names
    return cells
