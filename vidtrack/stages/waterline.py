"""Stage waterline: run-up of waves on a beach or structure, along transects, from one calibrated camera's video."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.shore.run_up import run_up
from vidtrack.shore.transect import Transect, along_transect_sd, sampling_map, transect
from vidtrack.shore.waterline import water_edge
from vidtrack.timing.clock import Clock
from vidtrack.timing.frame import Frame, VideoInfo

COLUMNS = {
    "time_s": "s",
    "timecode": "",
    "transect": "",
    **dict.fromkeys(("s", "x", "y", "z", "sigma_s", "sigma_z"), "world"),
    **dict.fromkeys(("Xf", "Yf"), "px"),
    "flag": "",
}
"""s: distance up the transect from its seaward end; z: the run-up; flag: faint, end (water beyond it), corrupt."""


STILL_PX = 0.5
"""ASSUME: an edge that strays by less than this (one sd) in the picture is no waterline."""

SELDOM = 0.05
"""Share of frames below which a flag of the waterline stays a flag and makes no finding."""


class Timestack(NamedTuple):
    """What one transect showed: grey (T, n) as stored, at times time_s (T,), places s (n,), p (n, 3), b (n, 2)."""

    grey: NDArray[Any]
    time_s: Array
    s: Array
    p: Array
    b: Array


class Waterlines(NamedTuple):
    """runup: a row for each frame and transect; timestacks by transect; record: run-up statistics by transect."""

    runup: pd.DataFrame
    timestacks: dict[str, Timestack]
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def waterline(
    frames: Iterable[Frame],
    info: VideoInfo,
    camera: Camera,
    transects: Mapping[str, Mapping[str, Any]],
    *,
    uncertainty: CameraUncertainty | None = None,
    profiles: Mapping[str, Any] | None = None,
    clock: Mapping[str, float] | None = None,
    still: float | None = None,
    where: str = "waterline",
) -> Waterlines:
    """Follow the water's edge along every transect through a recording.

    transects     name: {from: [x, y, z] in the water, to: [x, y, z] on dry ground, step}; world units
    profiles      name: (k, 3) surveyed points along the transect, world units, where the beach is no plane
    uncertainty   of the camera; without it sigma_s is that of the edge in the picture alone
    still         z of the still water, from which run-up is counted; None: z = 0
    clock         offset_s and rate_ppm, added to the camera's time
    Frames are used whole; a corrupt one is a row of NaN. Raises VidtrackError for a transect that the camera does not
    see, or whose ends look alike.
    """
    lines = _lines(camera, transects, profiles or {}, where)
    maps = {name: sampling_map(line) for name, line in lines.items()}
    stamps: list[float] = []
    good: list[bool] = []
    stacks: dict[str, list[NDArray[Any]]] = {name: [] for name in lines}
    for frame in frames:
        stamps.append(float(frame.time))
        good.append(not frame.corrupt)
        for name, (mx, my) in maps.items():
            stacks[name].append(cv2.remap(frame.luma, mx, my, cv2.INTER_LINEAR).mean(1))
    if sum(good) < 5:
        raise VidtrackError(f"{where}: {sum(good)} good frames; five are needed. Film a longer run.")
    base = info.time.fitted(np.array(stamps))
    time_s, labels = base.seconds(np.array(stamps)), base.labels(np.array(stamps))
    if clock is not None:
        time_s = Clock(**clock).corrected(time_s)
    tables, timestacks, statistics, findings = [], {}, {}, []
    for name, line in lines.items():
        grey = np.stack(stacks[name])
        timestacks[name] = Timestack(_stored(grey, info.bits), time_s, line.s, line.p, line.b)
        table = _one(grey, np.array(good), line, _calibration_sd(camera, line, uncertainty), f"{where}.{name}")
        tables.append(table.assign(time_s=time_s, timecode=labels, transect=name)[list(COLUMNS)])
        statistics[name] = _statistics(tables[-1], still)
        findings += _findings(name, tables[-1])
    return Waterlines(pd.concat(tables, ignore_index=True), timestacks, {"transects": statistics}, tuple(findings))


def _lines(
    camera: Camera, transects: Mapping[str, Mapping[str, Any]], profiles: Mapping[str, Any], where: str
) -> dict[str, Transect]:
    lines = {}
    for name, ends in transects.items():
        try:
            lines[name] = transect(camera, ends["from"], ends["to"], step=ends.get("step"), profile=profiles.get(name))
        except ValueError as problem:
            raise VidtrackError(f"{where}.transects.{name}: {problem}. Move its ends.") from None
    return lines


def _one(grey: Array, good: NDArray[np.bool_], line: Transect, blur: Array, where: str) -> pd.DataFrame:
    try:
        edge = water_edge(np.where(good[:, None], grey, np.nan))
    except ValueError as problem:
        raise VidtrackError(f"{where}: {problem}.") from None
    places = np.arange(len(line.s))
    columns = {"s": line.s, **{a: line.p[:, k] for k, a in enumerate("xyz")}, "Xf": line.b[:, 0], "Yf": line.b[:, 1]}
    table = pd.DataFrame({name: np.interp(edge.position, places, column) for name, column in columns.items()})
    per_sample, slope = np.gradient(line.s), np.gradient(line.p[:, 2], line.s)
    sigma = np.hypot(np.interp(edge.position, places, per_sample) * edge.sd, np.interp(edge.position, places, blur))
    table["sigma_s"], table["sigma_z"] = sigma, sigma * np.abs(np.interp(edge.position, places, slope))
    flags = (("corrupt", ~good), ("faint", edge.faint), ("end", edge.at_end))
    table["flag"] = [";".join(name for name, is_so in flags if is_so[t]) for t in range(len(table))]
    return table


def _calibration_sd(camera: Camera, line: Transect, uncertainty: CameraUncertainty | None) -> Array:
    """Standard deviation (n,), world units, along the transect, of what the camera's calibration leaves open."""
    if uncertainty is None:
        return np.zeros(len(line.s))
    which = columns(camera, uncertainty.names)
    J = derivatives(camera, line.p, uncertainty.pivot).by_parameter[..., which]
    return along_transect_sd(line, J @ uncertainty.covariance @ np.swapaxes(J, -1, -2))


def _stored(grey: Array, bits: int) -> NDArray[Any]:
    return np.round(grey).astype(np.uint8 if bits == 8 else np.uint16)


def _statistics(table: pd.DataFrame, still: float | None) -> dict[str, Any]:
    """Mean, spread and extremes of the run-up z, and set-up, swash and R2 above the still water."""
    quoted = run_up(table["time_s"], table["z"], still=still or 0.0)
    z = table["z"].to_numpy(float)
    z = z[np.isfinite(z)]
    peaks = z[1:-1][(z[1:-1] >= z[:-2]) & (z[1:-1] > z[2:])]
    crests = peaks[peaks > z.mean()] if len(peaks) else peaks
    return {
        "frames": len(table),
        "located": len(z),
        "mean_z": float(z.mean()),
        "sd_z": float(z.std()),
        "lowest_z": float(z.min()),
        "highest_z": float(z.max()),
        "crests": len(crests),
        "R2_z": float(np.quantile(crests, 0.98)) if len(crests) else float("nan"),
        "median_sigma_s": float(table["sigma_s"].median()),
        "still_water": still,
        **{name: value for name, value in quoted._asdict().items() if name != "n"},
        "run_ups": quoted.n,
    }


def _findings(name: str, table: pd.DataFrame) -> list[Finding]:
    found = []
    if np.hypot(table["Xf"].std(), table["Yf"].std()) < STILL_PX:
        text = f"transect {name}: the edge that was found moves by less than {STILL_PX} px: it is no waterline"
        found.append(Finding("bad", "waterline-still", text, "Move the transect to where the water runs up."))
    for flag, meaning, cure in (
        ("faint", "wet and dry look alike at the edge", "Light the beach from the side, or move the transect."),
        (
            "end",
            "the water's edge lies at an end of it, so the water reaches farther",
            "Make the transect longer at that end.",
        ),
    ):
        share = float(table["flag"].str.contains(flag).mean())
        if share > SELDOM:
            text = f"transect {name}: {meaning} in {100 * share:.0f} % of the frames"
            found.append(Finding("doubtful", f"waterline-{flag}", text, cure))
    return found
