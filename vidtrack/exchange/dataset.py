"""A run as an xarray Dataset: what NetCDF holds and what notebooks get.

It is CF-1.11 and the layout of the program movement at once: position(time, space, keypoint, individual), where a
target is a keypoint and the run is the individual.

origin, axes    the world's, right-handed, as in points.csv; mode plane has no z, and space is x, y
units           attribute `units` of each variable, in words that UDUNITS and pint read; the experiment's unit of length
angles          roll, pitch, yaw: degrees, intrinsic z-y'-x''; quaternion w, x, y, z of the same rotation, body to world
time            s since midnight, as a number: the day is not known, so there is no date to count from, and it is a
                coordinate of CF without a standard name (`exchange.netcdf.write_cf` gives it a date)
missing         NaN; `flag` says why by flag_values and flag_meanings (CF), and its attribute `texts` has the words as
                they are in the tables
confidence      NaN: movement asks for it, and vidtrack has standard deviations (position_sigma) in its place
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import MISSING, Run, Series, evenly, series

if TYPE_CHECKING:
    from xarray import Dataset

SPACE = ("x", "y", "z")
ANGLES = ("roll", "pitch", "yaw")
FREEDOMS = ("surge", "sway", "heave", *ANGLES)
KEYPOINTS = ("keypoint", "individual")
INTEGER = {"dtype": "int16", "_FillValue": -1}


def dataset(run: Run) -> Dataset:
    """All tables of a run in one Dataset; a table that the run does not have leaves its variables out.

    VidtrackError for a run without a sample.
    """
    import xarray as xr

    s = series(run.tables["trajectories"])
    if not len(s.time) or not len(s.names):
        raise VidtrackError(f"run {run.name}: it has no sample; there is nothing to write.")
    flat = not np.isfinite(s.stacked("z")).any() and run.is_flat
    space = SPACE[:2] if flat else SPACE
    variables = _positions(run, s, space)
    if "kinematics" in run.tables:
        variables |= _kinematics(run, s, space)
    coordinates: dict[str, Any] = {
        "time": ("time", s.time, _about("s", "seconds since midnight")),
        "space": list(space),
        "keypoint": list(s.names),
        "individual": [run.name],
    }
    if "bodies" in run.tables:
        own = series(run.tables["bodies"], "body", s.time)
        variables |= _bodies(run, own)
        coordinates |= {"body": list(own.names), "angle": list(ANGLES), "quaternion_part": list("wxyz")}
        if flat:
            raise VidtrackError(f"run {run.name}: bodies in a run without z. Delete its results and run again.")
    if "motions" in run.tables and len(run.tables["motions"]):
        variables |= _motions(run, s.time, coordinates)
    return xr.Dataset(variables, coordinates, _attributes(run, s.time))


def _positions(run: Run, s: Series, space: Sequence[str]) -> dict[str, Any]:
    dims = ("time", "space", *KEYPOINTS)
    point = ("time", *KEYPOINTS)
    sigma = _by_space(s, [f"sigma_{a}" for a in space])
    meaning = "one standard deviation of position"
    flags, about = _flags(s)
    return {
        "position": (dims, _by_space(s, space), _about(run.units, "position of the target in the world")),
        "position_sigma": (dims, sigma, _about(run.units, meaning)),
        "confidence": (
            point,
            np.full((len(s.time), len(s.names), 1), np.nan),
            _about("1", "not estimated; see position_sigma"),
        ),
        "miss": (
            point,
            s.stacked("miss"),
            _about(run.units, "rms distance of the lines of sight from the position"),
        ),
        "n_cameras": (point, s.stacked("n_cameras"), _about("1", "cameras that the position rests on"), INTEGER),
        "flag": (point, flags[..., None], about),
    }


def _kinematics(run: Run, s: Series, space: Sequence[str]) -> dict[str, Any]:
    own = series(run.tables["kinematics"], "target", s.time)
    if set(own.names) - set(s.names):
        raise VidtrackError(f"run {run.name}: kinematics.parquet is not of trajectories.parquet. Call vidtrack run.")
    order = [own.names.index(name) if name in own.names else -1 for name in s.names]
    found: dict[str, Any] = {}
    for name, prefix, unit, text in (
        ("position_smoothed", "", run.units, "smoothed position"),
        ("velocity", "v", f"{run.units}/s", "velocity"),
        ("acceleration", "a", f"{run.units}/s^2", "acceleration"),
    ):
        for ending, what in (("", text), ("_sigma", f"one standard deviation of the {text}")):
            columns = [f"{'sigma_' if ending else ''}{prefix}{a}" for a in space]
            if all(column in own.columns for column in columns):
                values = np.moveaxis(own.stacked(*columns), 1, 2)
                whole = np.where(np.array(order) < 0, np.nan, values[:, :, order])
                found[name + ending] = (("time", "space", *KEYPOINTS), whole[..., None], _about(unit, what))
    return found


def _bodies(run: Run, own: Series) -> dict[str, Any]:
    place, turn = ("time", "space", "body"), ("time", "angle", "body")
    flags, about = _flags(own)

    def by(columns: Sequence[str]) -> Array:
        return np.moveaxis(own.stacked(*columns), 1, 2)

    sd = "one standard deviation of"
    origin = "position of the body's origin in the world"
    return {
        "body_position": (place, by(SPACE), _about(run.units, origin)),
        "body_position_sigma": (
            place,
            by([f"sigma_{a}" for a in SPACE]),
            _about(run.units, f"{sd} body_position"),
        ),
        "body_angles": (
            turn,
            by(ANGLES),
            _about("degree", "R = Rz(yaw) Ry(pitch) Rx(roll), body axes to world axes"),
        ),
        "body_angles_sigma": (turn, by([f"sigma_{a}" for a in ANGLES]), _about("degree", f"{sd} body_angles")),
        "body_quaternion": (
            ("time", "quaternion_part", "body"),
            by([f"q{a}" for a in "wxyz"]),
            _about("1", "unit quaternion, body axes to world axes"),
        ),
        "body_rms": (
            ("time", "body"),
            own.stacked("rms")[..., 0],
            _about(run.units, "rms distance of targets from the body"),
        ),
        "body_flag": (("time", "body"), flags, about),
    }


def _motions(run: Run, time: Array, coordinates: dict[str, Any]) -> dict[str, Any]:
    table = run.tables["motions"]
    named = table.assign(whole=table["body"].astype(str) + "@" + table["point"].astype(str))
    own = series(named, "whole", time)
    coordinates["point"] = list(own.names)
    found: dict[str, Any] = {}
    for name in FREEDOMS:
        unit = "degree" if name in ANGLES else run.units
        values = own.stacked(name)[..., 0], own.stacked(f"sigma_{name}")[..., 0]
        text = f"{name} of the point about its place at rest, in the basin's axes"
        found[name] = (("time", "point"), values[0], _about(unit, text))
        found[f"{name}_sigma"] = (("time", "point"), values[1], _about(unit, f"one standard deviation of {name}"))
    return found


def _by_space(s: Series, columns: Sequence[str]) -> Array:
    """(time, space, keypoint, 1)."""
    return np.moveaxis(s.stacked(*columns), 1, 2)[..., None]


def _flags(s: Series) -> tuple[Any, dict[str, Any]]:
    """Flags (n, m) as numbers, and the attributes that say what each stands for; 0 is none."""
    text = np.where(s.present, s.columns.get("flag", np.full(s.present.shape, "", object)), MISSING)
    texts = ["", *sorted(set(text.ravel().tolist()) - {""})]
    place = {word: i for i, word in enumerate(texts)}
    numbers = np.array([place[word] for word in text.ravel().tolist()], np.int16).reshape(text.shape)
    meanings = " ".join(re.sub(r"[^\w.@+-]", "_", word.replace(":", ".").replace(";", "+")) or "none" for word in texts)
    about = {"long_name": "what is to be said of a sample", "flag_values": np.arange(len(texts), dtype=np.int16)}
    return numbers, about | {"flag_meanings": meanings, "texts": json.dumps(texts, ensure_ascii=False)}


def _about(units: str, long_name: str) -> dict[str, Any]:
    return {"units": units, "long_name": long_name}


def _attributes(run: Run, time: Array) -> dict[str, Any]:
    found: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "title": f"Run {run.name}",
        "source": f"vidtrack {run.version}".strip(),
        "history": f"written by vidtrack {run.version}".strip(),
        "ds_type": "poses",
        "source_software": "vidtrack",
        "time_unit": "seconds",
        "length_unit": run.units,
        "provenance": json.dumps(dict(run.provenance), sort_keys=True, ensure_ascii=False),
    }
    try:
        found["fps"] = evenly(time, run.name, "fps").rate
    except VidtrackError:
        found["comment"] = "samples are not even in time: there is no fps"
    return found | {f"axis_{name}": way for name, way in (("waves", run.waves), ("up", run.up)) if way}
