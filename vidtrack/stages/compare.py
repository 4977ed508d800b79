"""Stage compare: trajectories against a contact sensor's record, and against the truth where that is known."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.motion.lag import FEWEST, Agreement, agreement, find_lag
from vidtrack.motion.reference_clock import (
    IN_SECONDS,
    in_another_unit,
    no_common_time,
    offset_by_correlation,
    resolution_of,
    too_sparse,
    with_rounding,
)
from vidtrack.motion.reference_rate import picture_rate
from vidtrack.motion.reference_record import (
    ONE_UNIT,
    RECORD,
    another_size,
    clock_rate,
    lag_warnings,
    scale,
    without_marks,
)
from vidtrack.motion.straight import Line, fit_line
from vidtrack.motion.truth import by_place, error_sizes, exchanged
from vidtrack.timing.resample import resample
from vidtrack.timing.time_column import counting_of, regular, seconds_from_cells

COLUMNS = {
    "time_s": "s",
    "target": "",
    "video": "world",
    "reference": "world",
    "reference_aligned": "world",
    "difference": "world",
    "difference_aligned": "world",
    "mean_aligned": "world",
    "error_x": "world",
    "error_y": "world",
    "error_z": "world",
}
"""reference: at the video's time; reference_aligned: as much earlier as the lag; difference: reference minus video."""

MEANING = {
    "lag_s": "positive: the video shows the motion later than the reference",
    "gain, bias": "reference = gain video + bias, least squares",
    "rms, max_abs": "of reference minus video",
    "rms_fit": "of what is left after gain and bias",
    "limits": "Bland and Altman: mean difference +- 1.96 standard deviations",
    "before, after": "before and after the lag is removed; the plain keys are those after",
}
LEAST_STRAIGHT = 0.98
"""Share of the motion's variance along its principal direction below which it is no straight line."""


class Comparison(NamedTuple):
    """record: what comparison.json records; series: the records side by side, a row for each video sample."""

    record: dict[str, Any]
    series: pd.DataFrame


def compare(
    trajectories: pd.DataFrame,
    reference: pd.DataFrame | None = None,
    truth: pd.DataFrame | None = None,
    *,
    value: str | None = None,
    time: str = "time_s",
    axis: str = "x",
    target: str | None = None,
    field_diagonal: float | None = None,
    longest_lag: float | None = None,
    offset_s: float | str | None = None,
    units: str = "",
    named: bool = True,
    where: str = "compare",
) -> Comparison:
    """Compare a run with its contact sensor, before and after the lag between their clocks is removed.

    trajectories    time_s, target, x, y, z; timecode, sigma_x... where there are any
    reference       column `time` (seconds, time code or ISO) and column `value`, in the trajectories' unit
    truth           time_s, target, x, y, z: where the targets truly were
    named           whether the user named the targets; where they were only counted, names that differ are no doubt
    axis            x | y | z, or auto: the line along which the target moves, as a rod that is skewed to the world
                    axes leads it (thesis figure 6.12)
    target          default: the only one
    field_diagonal  world units; mean errors are given as a share of it, 1/N
    longest_lag     s
    offset_s        added to the reference's times; auto: that at which the records correlate best, for a logger
                    without a clock. The lag then says nothing
    A target that was never located, or records that share no time, give n = 0 and a finding. Raises VidtrackError
    where a column is missing or unreadable.
    """
    record: dict[str, Any] = {"units": units, "meaning": MEANING, "warnings": [], "findings": []}
    parts = []
    if reference is not None:
        about, part = _against_reference(
            trajectories, target, reference, value, time, axis, longest_lag, offset_s, where
        )
        record["warnings"] += about.pop("warnings")
        record["findings"] += as_records(about.pop("findings", ()))
        record |= about
        parts.append(part)
    if truth is not None:
        about, errors = _against_truth(trajectories, truth, field_diagonal, named, where)
        record["warnings"] += about.pop("warnings")
        record["findings"] += as_records(about.pop("findings", ()))
        record["truth"] = about
        parts.append(errors)
    if not parts:
        raise VidtrackError(f"{where}: neither a reference nor the truth to compare with. Give reference.csv.")
    series = parts[0] if len(parts) == 1 else parts[0].merge(parts[1], on=["time_s", "target"], how="outer")
    return Comparison(record, series.reindex(columns=list(COLUMNS)))


def _of_target(trajectories: pd.DataFrame, target: str | None, where: str) -> pd.DataFrame:
    names = sorted(trajectories["target"].astype(str).unique())
    if target is None and len(names) > 1:
        raise VidtrackError(f"{where}: targets {', '.join(names)}: which one? Set reference.target.")
    target = str(target) if target is not None else names[0] if names else ""
    rows: pd.DataFrame = trajectories[trajectories["target"].astype(str) == target].sort_values("time_s")
    return rows.drop_duplicates("time_s").reset_index(drop=True)


def _against_reference(
    trajectories: pd.DataFrame,
    target: str | None,
    reference: pd.DataFrame,
    value: str | None,
    time: str,
    axis: str,
    longest: float | None,
    offset_s: float | str | None,
    where: str,
) -> tuple[dict[str, Any], pd.DataFrame]:
    rows = _of_target(trajectories, target, where)
    if not len(rows):
        known = ", ".join(sorted(trajectories["target"].astype(str).unique())) or "none"
        text = f"target {target or ''} of the reference was never located; located: {known}".replace("  ", " ")
        return _nothing("reference-target-missing", text, "Correct reference.target, or see why it was lost.")
    t = rows["time_s"].to_numpy(float)
    line, video, warnings = _along(rows, axis)
    tr, r, about = _reference_record(reference, value, time, rows, where)
    findings: list[Finding] = []
    located = int(np.isfinite(video).sum())
    if located >= FEWEST and (sparse := too_sparse(tr, t)):
        said, part = _nothing("reference-too-sparse", *sparse)
        return said | {"reference": {k: v for k, v in about.items() if k != "warnings"}}, part
    if offset_s == "auto":
        offset, found = offset_by_correlation(tr, r, t, video)
        about |= {"offset_s": offset, "offset_by": "correlation"}
        findings.append(found)
        tr = tr + (offset if np.isfinite(offset) else 0.0)
    elif offset_s is not None:
        tr = tr + float(offset_s)
        about |= {"offset_s": float(offset_s), "offset_by": "config"}
    if max(t[0], tr[0]) > min(t[-1], tr[-1]):
        said, part = _nothing("reference-no-common-time", *no_common_time(tr, t))
        return said | {"reference": {k: v for k, v in about.items() if k != "warnings"}}, part
    lag = with_rounding(find_lag(tr, r, t, video, longest=longest), about["resolution_s"])
    warnings += about.pop("warnings") + lag_warnings(lag, located)
    if not abs(lag.correlation) >= RECORD.alike and (counted := in_another_unit(tr, t)):
        findings.append(Finding("bad", "reference-time-unit", counted, IN_SECONDS))
    elif stretched := picture_rate(tr, r, t, video, lag):
        findings.append(stretched)
    elif rate := clock_rate(tr, r, t, video, lag):
        findings.append(rate)
    before = _at(tr, r, t)
    after = _at(tr, r, t - lag.lag_s) if np.isfinite(lag.lag_s) else np.full(len(t), np.nan)
    agreed_before, agreed_after = _plain(agreement(video, before)), _plain(agreement(video, after))
    gain = abs(agreed_after["gain"])
    if gain > ONE_UNIT or gain < 1 / ONE_UNIT:
        warnings.append(another_size(gain, axis, "xyz"[line.axis]))
    elif scaled := scale(agreed_after):
        findings.append(scaled)
    record = {
        "target": str(rows["target"].iloc[0]),
        "lag_s": lag.lag_s,
        "lag_sd_s": lag.sd,
        "lag_low_s": lag.low,
        "lag_high_s": lag.high,
        "lag_others_s": list(lag.others),
        **agreed_after,
        "before": agreed_before,
        "after": agreed_after,
        "axis": _line_record(line, axis),
        "reference": about,
        "warnings": warnings,
        "findings": findings,
    }
    worst = np.abs(after - video)
    if np.isfinite(worst).any():
        record["max_abs_time_s"] = float(t[np.nanargmax(worst)])
    series = {"time_s": t, "target": rows["target"].astype(str), "video": video, "reference": before}
    series |= {"reference_aligned": after, "difference": before - video, "difference_aligned": after - video}
    return record, pd.DataFrame({**series, "mean_aligned": (after + video) / 2})


def _nothing(code: str, text: str, cure: str) -> tuple[dict[str, Any], pd.DataFrame]:
    """The record and series where there is nothing to compare, and why."""
    return {"n": 0, "warnings": [], "findings": [Finding("bad", code, text, cure)]}, pd.DataFrame(columns=list(COLUMNS))


def _at(t: Array, x: Array, when: Array) -> Array:
    values: Array = resample(t, x[:, None], when).values[:, 0]
    return values


def _along(rows: pd.DataFrame, axis: str) -> tuple[Line, Array, list[str]]:
    """The target's coordinate along the axis that the sensor measures, and the line on which it moves."""
    if axis not in ("x", "y", "z", "auto"):
        raise ValueError(f"axis is x, y, z or auto, not {axis!r}")
    p = rows[["x", "y", "z"]].to_numpy(float)
    line = fit_line(p, None if axis == "auto" else "xyz".index(axis))
    if axis != "auto":
        return line, p[:, "xyz".index(axis)], []
    warnings = []
    if not line.straight >= LEAST_STRAIGHT:
        warnings.append(
            f"only {100 * line.straight:.0f} % of the target's motion lies along one line: "
            "axis auto may not be what the sensor saw"
        )
    return line, line.along(p), warnings


def _reference_record(
    reference: pd.DataFrame, value: str | None, time: str, rows: pd.DataFrame, where: str
) -> tuple[Array, Array, dict[str, Any]]:
    columns = [c for c in reference.columns if c != "line"]
    value = value if value is not None else next((str(c) for c in columns if c != time), "")
    for name in (time, value):
        if name not in reference:
            raise VidtrackError(
                f"{where}: the reference has no column '{name}'; it has {', '.join(map(str, columns))}."
            )
    labels = rows["timecode"].fillna("").astype(str).tolist() if "timecode" in rows else []
    counting = counting_of(labels, rows["time_s"].to_numpy(float)) if labels else None
    try:
        times = seconds_from_cells(reference[time].tolist(), counting)
        r = pd.to_numeric(reference[value]).to_numpy(float)
    except ValueError as problem:
        raise VidtrackError(f"{where}: the reference's columns {time}, {value}: {problem}. Correct the file.") from None
    good = np.isfinite(times.seconds)
    values, warnings = without_marks(r[good])
    t, r = times.seconds[good], np.array(values)
    if len(t) < 2:
        raise VidtrackError(f"{where}: the reference has {len(t)} rows with a time. Record more of the motion.")
    resolution = resolution_of(t, bool((np.diff(t) == 0).any())) if times.written == "seconds" else 0.0
    even = regular(t)
    if even is not None:
        t = even
        warnings.append(
            f"reference times are rounded until some coincide; taken as even, every {np.diff(t).mean():.6g} s"
        )
    elif (np.diff(t) <= 0).any():
        mean = pd.Series(r).groupby(t).mean()
        t, r = mean.index.to_numpy(float), mean.to_numpy(float)
        warnings.append("reference times do not rise; sorted, equal ones averaged. Were two records joined?")
    about = {"column": value, "time_column": time, "time_written_as": times.written, "samples": len(t)}
    about |= {"first_s": float(t[0]), "last_s": float(t[-1]), "rate_hz": float(1 / np.median(np.diff(t)))}
    about["resolution_s"] = resolution
    return t, r, {**about, "warnings": warnings}


def _plain(a: Agreement) -> dict[str, Any]:
    low, high = a.mean_difference - 1.96 * a.sd_difference, a.mean_difference + 1.96 * a.sd_difference
    return {**a._asdict(), "limits": [low, high]}


def _line_record(line: Line, axis: str) -> dict[str, Any]:
    return {
        "asked": axis,
        "nearest": "xyz"[line.axis],
        "skew_deg": line.skew_deg,
        "skew_sd_deg": line.skew_sd_deg,
        "direction": line.direction.tolist(),
        "straight": line.straight,
        "rms_off_line": line.rms_off,
        "length": line.length,
        "run_out": float(line.length * np.sin(np.radians(line.skew_deg))),
    }


def _against_truth(
    trajectories: pd.DataFrame, truth: pd.DataFrame, diagonal: float | None, named: bool, where: str
) -> tuple[dict[str, Any], pd.DataFrame]:
    names, true_names = (sorted(table["target"].astype(str).unique()) for table in (trajectories, truth))
    pairs = {n: n for n in names if n in true_names}
    if not pairs and len(names) == len(true_names) == 1:
        pairs = {names[0]: true_names[0]}
    never = sorted(set(true_names) - set(pairs.values()))
    tables, warnings, findings = [], [], []
    if placed := by_place(_paths(trajectories), _paths(truth), pairs):
        pairs = placed
        findings.append(exchanged(pairs, named))
    if never:
        text = f"truth.csv names {', '.join(never)}, never located (located: {', '.join(names) or 'none'})"
        cure = "Name the targets alike in targets.csv and truth.csv, or see in the tracks why it was lost."
        findings.append(Finding("doubtful" if pairs else "bad", "truth-target-missing", text, cure))
    none: dict[Any, Any] = {n: {"n": 0} for n in never}
    if not pairs:
        about = {"n": 0, "by_target": none, "warnings": [], "findings": findings}
        return about, pd.DataFrame(columns=["time_s", "target", "error_x", "error_y", "error_z"])
    for name, true_name in pairs.items():
        rows = _of_target(trajectories, name, where)
        known = _of_target(truth, true_name, where)
        t = rows["time_s"].to_numpy(float)
        p = resample(known["time_s"].to_numpy(float), known[["x", "y", "z"]].to_numpy(float), t).values
        error = rows[["x", "y", "z"]].to_numpy(float) - p
        sigma = (
            rows[["sigma_x", "sigma_y", "sigma_z"]].to_numpy(float)
            if "sigma_x" in rows
            else np.full(error.shape, np.nan)
        )
        frame = {"time_s": t, "target": name, **{f"error_{a}": error[:, k] for k, a in enumerate("xyz")}}
        tables.append(pd.DataFrame({**frame, **{f"z_{a}": error[:, k] / sigma[:, k] for k, a in enumerate("xyz")}}))
    unmatched = sorted(set(names) - set(pairs))
    if unmatched:
        warnings.append(f"no truth for {', '.join(unmatched)}")
    errors = pd.concat(tables, ignore_index=True)
    if not np.isfinite(errors[["error_x", "error_y"]].to_numpy(float)).any():
        warnings.append("truth.csv and the located samples share no time: put both on one clock")
        return {"n": 0, "warnings": warnings, "findings": findings}, errors.drop(columns=[f"z_{a}" for a in "xyz"])
    by_target = {n: _sizes(e, diagonal) for n, e in errors.groupby("target")} | none
    about = {**_sizes(errors, diagonal), "by_target": by_target, "warnings": warnings, "findings": findings}
    return about, errors.drop(columns=[f"z_{a}" for a in "xyz"])


def _sizes(errors: pd.DataFrame, diagonal: float | None) -> dict[str, Any]:
    e, z = (errors[[f"{name}_{a}" for a in "xyz"]].to_numpy(float) for name in ("error", "z"))
    return error_sizes(e, z, diagonal)


def _paths(table: pd.DataFrame) -> dict[str, tuple[Array, Array]]:
    """Times and positions of each target, in order of time."""
    return {
        str(name): (own["time_s"].to_numpy(float), own[["x", "y", "z"]].to_numpy(float))
        for name, own in table.sort_values("time_s", kind="stable").groupby("target")
    }
