"""Stage report: what the other stages found, told in order: first what a reader must not overlook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from vidtrack.report import calibration_sections as calibration
from vidtrack.report import run_sections as told
from vidtrack.report.page import Section, interval, number, one_over, pick

Record = Mapping[str, Any]


class Story(NamedTuple):
    """The page without its pictures, and the runs as given."""

    title: str
    lead: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    footer: tuple[str, ...]
    runs: dict[str, Any]


def report(
    *,
    cameras: Mapping[str, Record],
    points: Mapping[str, pd.DataFrame],
    labellings: Mapping[str, Record],
    back: Record | None,
    stability: Record | None,
    runs: Mapping[str, Record],
    units: str,
    title: str = "vidtrack",
    version: str = "",
) -> Story:
    """Compose the report of an experiment.

    cameras      camera: its camera.json;  points, labellings: camera: points.parquet, labelling.json
    back         backprojection.json, or None where nothing was calibrated;  stability: stability.json, or None
    runs         run: {readings, trajectories, kinematics, locate[, bodies, comparison, series, waterline]}
    units        the experiment's unit of length
    """
    sections = []
    if back is not None:
        parts = [calibration.accuracy_section(back, units)]
        for name, record in cameras.items():
            rows = points[name].to_dict("records")
            parts.append(calibration.camera_section(record, rows, labellings.get(name, {}), units))  # type: ignore[arg-type]
        if stability is not None:
            parts.append(calibration.stability_section(stability, units))
        sections.append(Section("calibration", "Calibration", sections=parts))
    if runs:
        glance = {name: {**run, **_measures(run)} for name, run in runs.items()}
        each = [_run_section(name, run, units) for name, run in runs.items()]
        sections.append(Section("runs", "Runs", tables=[told.runs_table(glance, units)], sections=each))
    return Story(
        title,
        _lead(back, runs, units),
        _warnings(cameras, labellings, stability, runs),
        tuple(sections),
        (f"vidtrack {version}. The unit of length is {units} unless said otherwise; px are frame buffer pixels.",),
        dict(runs),
    )


def _measures(run: Record) -> dict[str, Any]:
    if "trajectories" not in run:
        return {}
    table = run["trajectories"]
    return {
        "n_targets": int(table["target"].nunique()),
        "duration_s": float(table["time_s"].max() - table["time_s"].min()) if len(table) else None,
    }


def _run_section(name: str, run: Record, units: str) -> Section:
    comparison, locate = run.get("comparison") or {}, run.get("locate") or {}
    tables = [
        told.comparison_table(comparison, units),
        told.truth_table(comparison, units),
        told.reading_table(run["readings"]) if run["readings"] else None,
        told.waterline_table(run["waterline"], units) if "waterline" in run else None,
        told.clock_table(locate),
        told.correspondence_table(locate, units),
    ]
    return Section(f"run-{name}", name, _run_lines(comparison, locate, units), [t for t in tables if t])


def _run_lines(comparison: Record, locate: Record, units: str) -> list[str]:
    lines = []
    if comparison.get("lag_s") is not None:
        low, high = comparison.get("lag_low_s"), comparison.get("lag_high_s")
        lines.append(
            f"The video shows the motion {number(comparison['lag_s'], 4)} s later than the reference "
            f"(95 %: {interval(low, high)} s). With the lag removed they differ by "
            f"{number((comparison.get('after') or {}).get('rms'), 3)} {units} rms."
        )
    line = comparison.get("axis") or {}
    if line.get("skew_deg") is not None:
        lines.append(
            f"The target moves along a line {number(line['skew_deg'], 3)} ± {number(line.get('skew_sd_deg'), 2)} "
            f"degrees off the {line.get('nearest')} axis: {number(line.get('run_out'), 3)} {units} over "
            f"{number(line.get('length'), 3)} {units}."
        )
    miss = pick(locate, "samples", "mean_miss")
    if miss is not None:
        lines.append(f"Lines of sight miss the located points by {number(miss, 3)} {units} on average.")
    lines += told.clock_lines(locate)
    return lines


def _lead(back: Record | None, runs: Mapping[str, Record], units: str) -> tuple[str, ...]:
    lines = []
    if back is not None:
        mean, field = (back.get("held_out") or {}).get("mean_3d"), back.get("diagonal_field")
        survey = (back.get("floor") or {}).get("mean_3d_with_survey")
        ratio = f", {one_over(mean / field)} of the diagonal field" if mean and field else ""
        due = f"; the survey's tolerance and the centroid noise alone make {number(survey, 3)}" if survey else ""
        lines.append(
            f"{len(back.get('cameras') or ())} cameras calibrated from {back['n_points']} points. Points held out of "
            f"the calibration are located to {number(mean, 3)} {units} of their survey on average{ratio}{due}."
        )
    if runs:
        lines.append(f"{len(runs)} run{'s' if len(runs) > 1 else ''}: {', '.join(runs)}.")
    return tuple(lines)


def _warnings(
    cameras: Mapping[str, Record],
    labellings: Mapping[str, Record],
    stability: Record | None,
    runs: Mapping[str, Record],
) -> tuple[str, ...]:
    lines: list[str] = []
    for record in cameras.values():
        lines += record.get("warnings") or ()
    for camera, record in labellings.items():
        lines += [f"{camera}: {line}" for line in (*(record.get("warnings") or ()), *(record.get("reading") or ()))]
    lines += (stability or {}).get("warnings") or ()
    for name, run in runs.items():
        for camera, reading in run["readings"].items():
            problems: Sequence[str] = (
                *((reading.get("reading") or {}).get("problems") or ()),
                *(reading.get("problems") or ()),
            )
            lines += [f"{name}, {camera}: {line}" for line in problems]
        for part in ("locate", "comparison"):
            lines += [f"{name}: {line}" for line in (run.get(part) or {}).get("warnings") or ()]
    return tuple(dict.fromkeys(lines))
