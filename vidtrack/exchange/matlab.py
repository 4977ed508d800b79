"""MATLAB .mat (version 5): one struct `vidtrack`.

    S = load('pluck.mat'); plot(S.vidtrack.time, squeeze(S.vidtrack.position(:, 1, :)))

origin, axes    the world's, right-handed, as in points.csv
units           struct `units`, a field a quantity; the experiment's unit of length
angles          bodies(k).angles: roll, pitch, yaw, degrees, intrinsic z-y'-x''; bodies(k).quaternion w, x, y, z
layout          time (n, 1) s since midnight; targets {m}; position, sigma (n, 3, m); miss, n_cameras, flag (n, m);
                velocity, acceleration (n, 3, m); bodies: struct array of name, position (n, 3), ...
missing         NaN; flag: 0 for none, else the number of its text in flag_texts
"""

from __future__ import annotations

import io
from typing import Any, cast

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.dataset import ANGLES, SPACE
from vidtrack.exchange.measured import MISSING, Run, Series, Written, series

MOST_BYTES = 2**31 - 2**20
HEADER = 116
"""Bytes of text at the beginning of a file; scipy puts the date there, by which the same numbers make other bytes."""


def write(run: Run) -> Written:
    """All tables of a run as one file; VidtrackError where it has no sample or does not fit."""
    s = series(run.tables["trajectories"])
    if not len(s.time):
        raise VidtrackError(f"run {run.name}: it has no sample; there is nothing to write.")
    length = run.units
    record: dict[str, Any] = {
        "run": run.name,
        "version": run.version,
        "units": {"length": length, "velocity": f"{length}/s", "acceleration": f"{length}/s^2", "angle": "deg"},
        "time": s.time[:, None],
        "targets": _cells(s.names),
        "position": _by_place(s, SPACE),
        "sigma": _by_place(s, [f"sigma_{a}" for a in SPACE]),
        "miss": s.stacked("miss")[..., 0],
        "n_cameras": s.stacked("n_cameras")[..., 0],
        **_flags(s),
    }
    if "kinematics" in run.tables:
        own = series(run.tables["kinematics"], "target", s.time)
        for name, letter in (("velocity", "v"), ("acceleration", "a")):
            record[name] = _by_place(own, [f"{letter}{a}" for a in SPACE])
            record[f"{name}_sigma"] = _by_place(own, [f"sigma_{letter}{a}" for a in SPACE])
        record["kinematics_targets"] = _cells(own.names)
    if "bodies" in run.tables:
        record["bodies"] = _bodies(series(run.tables["bodies"], "body", s.time))
    return Written({f"{run.name}.mat": mat_file({"vidtrack": record}, run.name)}, [])


def mat_file(variables: dict[str, Any], name: str) -> bytes:
    """Variables as a .mat file of version 5, the same bytes whatever the day."""
    from scipy.io import savemat

    buffer = io.BytesIO()
    savemat(cast(Any, buffer), variables, long_field_names=True, oned_as="column")
    content = buffer.getvalue()
    if len(content) > MOST_BYTES:
        raise VidtrackError(f"run {name}: {len(content)} bytes; a .mat file of version 5 holds 2 GB. Export netcdf.")
    return b"MATLAB 5.0 MAT-file, written by vidtrack".ljust(HEADER) + content[HEADER:]


def _bodies(own: Series) -> Any:
    kinds = ("name", "position", "position_sigma", "angles", "angles_sigma", "quaternion", "rms", "flag", "flag_texts")
    answer = np.empty((len(own.names),), dtype=[(kind, object) for kind in kinds])
    flags = _flags(own)
    for i, name in enumerate(own.names):
        one = answer[i]
        one["name"] = name
        one["position"] = own.stacked(*SPACE)[:, i]
        one["position_sigma"] = own.stacked(*(f"sigma_{a}" for a in SPACE))[:, i]
        one["angles"] = own.stacked(*ANGLES)[:, i]
        one["angles_sigma"] = own.stacked(*(f"sigma_{a}" for a in ANGLES))[:, i]
        one["quaternion"] = own.stacked(*(f"q{a}" for a in "wxyz"))[:, i]
        one["rms"] = own.stacked("rms")[:, i]
        one["flag"] = flags["flag"][:, i : i + 1]
        one["flag_texts"] = flags["flag_texts"]
    return answer


def _by_place(s: Series, columns: Any) -> Any:
    return np.moveaxis(s.stacked(*columns), 1, 2)


def _flags(s: Series) -> dict[str, Any]:
    text = np.where(s.present, s.columns.get("flag", np.full(s.present.shape, "", object)), MISSING)
    texts = sorted(set(text.ravel().tolist()) - {""})
    place = {word: i for i, word in enumerate(["", *texts])}
    return {
        "flag": np.array([place[word] for word in text.ravel().tolist()], float).reshape(text.shape),
        "flag_texts": _cells(texts),
    }


def _cells(texts: Any) -> Any:
    """A cell array (m, 1) of texts."""
    cells = np.empty((len(texts), 1), object)
    for i, text in enumerate(texts):
        cells[i, 0] = text
    return cells
