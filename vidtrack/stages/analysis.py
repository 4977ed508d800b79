"""Stage analysis: motions at named points, free decay, waves and the response to them, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.analysis.channel_clock import Joined, by_lamp, by_motion, by_offset
from vidtrack.analysis.decay import free_decay
from vidtrack.analysis.mixing import ErrorField, Resting, mixing
from vidtrack.analysis.motions import (
    Motions,
    basin_axes,
    before_motion,
    mean_rotation,
    motions_at,
    statistics,
    watch_circle,
)
from vidtrack.analysis.responses import Series, Systematic, fields
from vidtrack.analysis.waves import waves_and_responses
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.motion.rigid import rotation_from_quaternion

COLUMNS = {
    "time_s": "s",
    "body": "",
    "point": "",
    **dict.fromkeys(DEGREES_OF_FREEDOM[:3], "world"),
    **dict.fromkeys(DEGREES_OF_FREEDOM[3:], "deg"),
    **dict.fromkeys([f"sigma_{name}" for name in DEGREES_OF_FREEDOM[:3]], "world"),
    **dict.fromkeys([f"sigma_{name}" for name in DEGREES_OF_FREEDOM[3:]], "deg"),
}

FEW_CYCLES = 5
"""Fewer cycles make a decay's numbers doubtful."""


class Analysis(NamedTuple):
    """motions: a row for each sample, body and point; record: what analysis.json records; findings."""

    motions: pd.DataFrame
    record: dict[str, Any]
    findings: list[Finding]


def analysis(
    trajectories: pd.DataFrame,
    bodies: pd.DataFrame | None = None,
    channels: pd.DataFrame | None = None,
    *,
    clock: Mapping[str, Any] | None = None,
    light: Mapping[str, pd.DataFrame] | None = None,
    given: Sequence[str] | None = None,
    points: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    axes: Mapping[str, str] | None = None,
    about: str | Sequence[float] = "mean",
    decay: Mapping[str, Any] | None = None,
    waves: Mapping[str, Any] | None = None,
    uncertainty: Mapping[str, Any] | None = None,
    shapes: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    units: str = "",
    where: str = "analysis",
) -> Analysis:
    """Analyse one run.

    trajectories   time_s, target, x, y, z, sigma_x, sigma_y, sigma_z; world units
    bodies         bodies.parquet of the run, with the covariance of each pose
    channels       time_s and a column for each other instrument, by its own clock, and the column of its lamp or motion
    clock          offset_s; lamp, or motion and series: what joins that clock to the video's
    light          camera: table of begun_s (s on the run's clock) and brightness, where there is a lamp
    given          names in `channels` that are asked for; default: all
    points         body: {point: place in the body's axes}; the body's origin is always one of them
    axes           waves, up: directions in the world, such as +x and +z; needed for bodies
    about          what motions are counted from: mean; rest: where the body is before it moves; or two times, s,
                   between which it rests
    decay          series, drop_half_cycles, quadratic, end: see `free_decay`
    waves          elevation (a series), kind: auto | regular | irregular; period s; start, end s; depth, distance
    uncertainty    gradients, curvatures, about: what the calibration leaves open, `uncertainty` of locate.json
    shapes         body: {target: its place in the body's axes}: on these it depends what a bent field does to a pose
    A series is named <target>.<x|y|z>, <body>.<surge ... yaw>, <body>@<point>.<surge ... yaw>, or by its channel.
    Raises VidtrackError where a name fits no series, or bodies come without axes.
    """
    motions, of_motions = _motions(bodies, points or {}, axes, about, where)
    series = _series(trajectories, motions, units)
    record: dict[str, Any] = {"units": units, "axes": dict(axes or {}), **of_motions}
    findings: list[Finding] = []
    if channels is not None:
        joined = _joined(series, channels, clock or {}, light or {}, (waves or {}).get("elevation"), where)
        record["channels"] = {"clock": joined.record, "names": list(given or channels.columns.drop("time_s"))}
        findings += joined.findings
        for name in record["channels"]["names"]:
            x = channels[name].to_numpy(float)
            series[str(name)] = Series(joined.times, x, np.full(len(x), np.nan), "", joined.offset_sd)
    if decay is not None:
        record["decay"], found = _decay(series, decay, where)
        findings += found
    if waves is not None:
        name = _elevation(series, str(waves["elevation"]), axes)
        own = _named(series, name, f"{where}.waves.elevation")
        others = {other: s for other, s in series.items() if other != name}
        record["waves"], found = waves_and_responses(
            name,
            own,
            others,
            waves,
            units,
            _mixing(others, uncertainty or {}, bodies, points or {}, shapes or {}, axes),
        )
        findings += found
    return Analysis(motions, record, findings)


def _motions(
    bodies: pd.DataFrame | None,
    points: Mapping[str, Mapping[str, Sequence[float]]],
    axes: Mapping[str, str] | None,
    about: str | Sequence[float],
    where: str,
) -> tuple[pd.DataFrame, dict[str, Any]]:
    if bodies is None or bodies.empty:
        return pd.DataFrame({name: [] for name in COLUMNS}), {}
    if axes is None:
        raise VidtrackError(
            f"{where}: the run has bodies but no axes: say in which directions waves travel and which way is up, "
            "as in axes: {waves: +x, up: +z}."
        )
    try:
        basin = basin_axes(axes["waves"], axes["up"])
    except ValueError as problem:
        raise VidtrackError(f"{where}.axes: {problem}. Name two perpendicular directions.") from None
    tables: list[pd.DataFrame] = []
    record: dict[str, Any] = {}
    for name, rows in bodies.groupby("body", sort=False):
        R = rotation_from_quaternion(rows[["qw", "qx", "qy", "qz"]].to_numpy(float))
        covariance = np.array(rows["covariance"].to_list(), float).reshape(-1, 6, 6)
        for point, place in {"origin": (0.0, 0.0, 0.0), **points.get(str(name), {})}.items():
            try:
                given = rows[["x", "y", "z"]].to_numpy(float), R, covariance, place, basin
                found = motions_at(*given)
                rest = _at_rest(rows["time_s"].to_numpy(float), found, about)
                if rest is not None:
                    found = motions_at(*given, at_rest=rest)
            except ValueError as problem:
                raise VidtrackError(f"{where}: body {name}: {problem}. See bodies.parquet for the reason.") from None
            columns: dict[str, Any] = {"time_s": rows["time_s"].to_numpy(), "body": str(name), "point": point}
            columns |= {dof: found.motion[:, i] for i, dof in enumerate(DEGREES_OF_FREEDOM)}
            columns |= {f"sigma_{dof}": found.sigma[:, i] for i, dof in enumerate(DEGREES_OF_FREEDOM)}
            tables.append(pd.DataFrame(columns))
            radius, hull = watch_circle(found.motion)
            record.setdefault(str(name), {})[point] = {
                "at_rest": found.rest,
                "watch_circle": radius,
                "envelope": hull,
                **{
                    dof: fields(statistics(found.motion[:, i], found.sigma[:, i]))
                    for i, dof in enumerate(DEGREES_OF_FREEDOM)
                },
            }
    said = "mean" if about == "mean" else "rest" if about == "rest" else f"{about[0]:g} to {about[1]:g} s"
    return pd.concat(tables, ignore_index=True)[list(COLUMNS)], {"about": said, "motions": record}


def _at_rest(t: np.ndarray[Any, Any], found: Motions, about: str | Sequence[float]) -> np.ndarray[Any, Any] | None:
    """The samples in which the body rests; None: motions are about the mean. ValueError where it never rests."""
    if about == "mean":
        return None
    if about == "rest":
        rest = before_motion(t, found.motion, found.sigma)
        if not rest.any():
            raise ValueError("it is in motion from the first sample on, so no rest is known (about: rest)")
        return rest
    return (t >= float(about[0])) & (t <= float(about[1]))


def _elevation(series: Mapping[str, Series], name: str, axes: Mapping[str, str] | None) -> str:
    """A target that floats is a wave gauge: its name alone means its motion upward."""
    up = f"{name}.{axes['up'][1] if axes else 'z'}"
    return up if name not in series and up in series else name


def _mixing(
    series: Mapping[str, Series],
    uncertainty: Mapping[str, Any],
    bodies: pd.DataFrame | None,
    points: Mapping[str, Mapping[str, Sequence[float]]],
    shapes: Mapping[str, Mapping[str, Sequence[float]]],
    axes: Mapping[str, str] | None,
) -> Systematic | None:
    """What the calibration's error mixes into the series of targets and bodies."""
    if uncertainty.get("gradients") is None:
        return None
    G = np.asarray(uncertainty["gradients"], float)
    curvatures = uncertainty.get("curvatures")
    H = np.zeros((*G.shape, 3)) if curvatures is None else np.asarray(curvatures, float)
    about = uncertainty.get("about")
    field = ErrorField(G, H, np.zeros(3) if about is None else np.asarray(about, float))
    resting: dict[str, Resting] = {}
    for name, rows in bodies.groupby("body", sort=False) if bodies is not None and axes else ():
        origin = np.nanmean(rows[["x", "y", "z"]].to_numpy(float), axis=0)
        R = rotation_from_quaternion(rows[["qw", "qx", "qy", "qz"]].to_numpy(float))
        R = mean_rotation(R[np.isfinite(R).all((1, 2))])
        places = np.array(list(shapes.get(str(name), {}).values()), float).reshape(-1, 3)
        targets = origin + (places if len(places) > 2 else np.concatenate([np.eye(3), -np.eye(3)])) @ R.T
        resting[str(name)] = Resting(targets, origin)
        for point, place in points.get(str(name), {}).items():
            resting[f"{name}@{point}"] = Resting(targets, origin + R @ np.asarray(place, float))
    filmed = [name for name, own in series.items() if np.isfinite(own.sigma).any()]
    return mixing(filmed, field, basin_axes(axes["waves"], axes["up"]) if axes else None, resting)


def _joined(
    series: Mapping[str, Series],
    channels: pd.DataFrame,
    clock: Mapping[str, Any],
    light: Mapping[str, pd.DataFrame],
    elevation: str | None,
    where: str,
) -> Joined:
    """The channels' times on the video's clock."""
    t = channels["time_s"].to_numpy(float)
    near = by_offset(t, float(clock.get("offset_s") or 0.0))
    if (lamp := clock.get("lamp")) is not None:
        seen = {
            camera: (own["begun_s"].to_numpy(float), own["brightness"].to_numpy(float)) for camera, own in light.items()
        }
        return _whole(by_lamp(near.times, channels[lamp].to_numpy(float), seen, lamp), near)
    if (motion := clock.get("motion")) is None:
        return near
    if motion == elevation or (elevation in channels and channels[motion].equals(channels[elevation])):
        raise VidtrackError(
            f"{where}: channels.clock.motion is the wave itself ({motion}); by how much a motion follows it is what "
            "is to be measured. Join the clocks by a lamp, by offset_s, or by a motion that both record."
        )
    own = _named(series, str(clock["series"]), f"{where}: channels.clock.series")
    return _whole(by_motion(near.times, channels[motion].to_numpy(float), own.t, own.x, motion, clock["series"]), near)


def _whole(found: Joined, near: Joined) -> Joined:
    """What was found after the given offset was added, as counted from the file's own times."""
    if found.record.get("offset_s") is None:
        return found
    return found._replace(record={**found.record, "offset_s": found.record["offset_s"] + near.record["offset_s"]})


def _series(trajectories: pd.DataFrame, motions: pd.DataFrame, units: str) -> dict[str, Series]:
    found: dict[str, Series] = {}
    for target, rows in trajectories.groupby(trajectories["target"].astype(str), sort=False):
        for axis in "xyz":
            if rows[axis].notna().any():
                found[f"{target}.{axis}"] = _one_series(rows, axis, units)
    for (body, point), rows in motions.groupby(["body", "point"], sort=False):
        name = str(body) if point == "origin" else f"{body}@{point}"
        for i, dof in enumerate(DEGREES_OF_FREEDOM):
            found[f"{name}.{dof}"] = _one_series(rows, dof, units if i < 3 else "deg")
    return found


def _one_series(rows: pd.DataFrame, column: str, unit: str) -> Series:
    rows = rows.sort_values("time_s").drop_duplicates("time_s")
    sigma = rows[f"sigma_{column}"].to_numpy(float) if f"sigma_{column}" in rows else np.full(len(rows), np.nan)
    return Series(rows["time_s"].to_numpy(float), rows[column].to_numpy(float), sigma, unit)


def _named(series: Mapping[str, Series], name: str, where: str) -> Series:
    if name not in series:
        known = ", ".join(series) or "none"
        raise VidtrackError(f"{where}: no series '{name}'; there are {known}. Correct the name.")
    return series[name]


def _liveliest(series: Mapping[str, Series]) -> str:
    """The series that moves most against its own noise; bodies before targets."""
    of_bodies = {name: own for name, own in series.items() if name.rsplit(".", 1)[-1] in DEGREES_OF_FREEDOM}

    def motion(name: str) -> float:
        own = series[name]
        noise = np.nanmedian(own.sigma) if np.isfinite(own.sigma).any() else np.nan
        return float(np.nan_to_num(np.nanstd(own.x) / noise if noise > 0 else 0.0))

    return max(of_bodies or series, key=motion)


def _decay(series: Mapping[str, Series], how: Mapping[str, Any], where: str) -> tuple[dict[str, Any], list[Finding]]:
    if not series:
        return {}, [
            Finding("bad", "decay-without-motion", "free decay: nothing was located", "See the run's findings.")
        ]
    name = how.get("series") or _liveliest(series)
    own = _named(series, name, f"{where}.decay.series")
    options = {key: how[key] for key in ("drop_half_cycles", "quadratic", "end") if how.get(key) is not None}
    try:
        found = free_decay(own.t, own.x, **options)
    except ValueError as problem:
        text = f"free decay of {name}: {problem}"
        cure = "Name the degree of freedom that was released (analysis.decay.series), or drop fewer half cycles."
        return {"series": name, "problem": str(problem)}, [Finding("bad", "decay-not-found", text, cure)]
    record = {
        "series": name,
        "unit": own.unit,
        "Td_s": fields(found.Td),
        "fn_Hz": fields(found.fn),
        "zeta": fields(found.zeta),
        "quadratic": fields(found.b),
        "rest": fields(found.rest),
        "release_s": found.release,
        "cycles": found.cycles,
        "rms": found.rms,
        "decrement": {"zeta": fields(found.p), "quadratic": fields(found.q)},
        "half_cycles": found.extremes._asdict(),
        "fit": {"time_s": own.t[found.used], "measured": own.x[found.used], "fitted": found.fitted[found.used]},
        "energy": _energy(series, name),
        "equation": "x'' + 2 zeta wn x' + b |x'| x' + wn^2 (x - c) = 0",
    }
    findings = []
    if found.cycles < FEW_CYCLES:
        text = f"free decay of {name}: {found.cycles:.1f} cycles could be used"
        findings.append(Finding("note", "decay-few-cycles", text, "Displace the body farther, or repeat the test."))
    noise = float(np.nanmedian(own.sigma)) if np.isfinite(own.sigma).any() else float("nan")
    if found.rms > 5 * noise:
        text = f"free decay of {name}: the fit leaves {found.rms:.2g} {own.unit}, {found.rms / noise:.0f} times sigma"
        cure = (
            "Another degree of freedom is in the motion, or damping is neither linear nor quadratic: see the residual."
        )
        findings.append(Finding("doubtful", "decay-misfit", text, cure))
    return record, findings


def _energy(series: Mapping[str, Series], name: str) -> dict[str, float]:
    """The variance of the other degrees of freedom of the same body, as a share of the variance of `name`'s kind."""
    group, dof = name.rsplit(".", 1)
    kinds = (DEGREES_OF_FREEDOM[:3], DEGREES_OF_FREEDOM[3:], ("x", "y", "z"))
    alike = next((kind for kind in kinds if dof in kind), ())
    whole = np.nanvar(series[name].x)
    others = [other for other in alike if other != dof and f"{group}.{other}" in series]
    return {other: float(np.nanvar(series[f"{group}.{other}"].x) / whole) for other in others if whole > 0}
