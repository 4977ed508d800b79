"""The first screen of the report: the verdict, each run a line, each camera a line, and the reasons, worst first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import hypot
from typing import Any

from vidtrack.findings import LEVELS
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import measured, number, pick, share
from vidtrack.report.page import Reason, Table, Verdict
from vidtrack.results import CameraResults, Results, RunResults
from vidtrack.verdict.judgement import WORDS, sentence

Record = Mapping[str, Any]

LONGEST = 130
"""Characters of a reason in a cell of a table; the whole of it stands below."""


def verdict_section(results: Results, units: str) -> Verdict:
    """What verdict.json says, beside the numbers that a reader asks for first."""
    record = results.verdict or {"verdict": "good", "calibration": None, "runs": {}}
    calibration: Record = record["calibration"] or {}
    runs: Record = record["runs"]
    tables = []
    if runs:
        tables.append(_runs_table(results, runs, units))
    if calibration:
        tables.append(_cameras_table(results, calibration["cameras"]))
    cameras: Record = calibration.get("cameras") or {}
    entries = [(f"camera-{name}", f"Camera {name}", own) for name, own in cameras.items()]
    entries += [("calibration", "Calibration", _without(calibration, cameras.values()))] if calibration else []
    entries += [(f"run-{name}", f"Run {name}", own) for name, own in runs.items()]
    reasons, notes = ([r for entry in entries for r in _reasons(*entry, key)] for key in ("reasons", "notes"))
    reasons.sort(key=lambda reason: -LEVELS.index(reason.level))
    return Verdict(record["verdict"], _line(calibration, runs), tables, reasons, notes)


def _line(calibration: Record, runs: Record) -> str:
    parts = [f"the calibration is {calibration['verdict']}"] if calibration else []
    words = [own["verdict"] for own in runs.values()]
    counts = [(word, words.count(word)) for word in reversed(WORDS)]
    counted = ", ".join(f"{count} {word}" for word, count in counts if count)
    if counted:
        parts.append(f"of {len(runs)} run{'s' if len(runs) > 1 else ''} {counted}")
    text = "; ".join(parts)
    return sentence(text[:1].upper() + text[1:])


def _without(whole: Record, parts: Iterable[Record]) -> Record:
    """The reasons and notes of the calibration as a whole that are no camera's."""
    theirs = [finding for part in parts for finding in (*part["reasons"], *part["notes"])]
    return {key: [finding for finding in whole[key] if finding not in theirs] for key in ("reasons", "notes")}


def _reasons(key: str, about: str, own: Record, which: str) -> Iterator[Reason]:
    for finding in own.get(which) or ():
        yield Reason(key, about, finding["level"], sentence(finding["text"]), sentence(finding["cure"]))


def _runs_table(results: Results, runs: Record, units: str) -> Table:
    rows = []
    for name, judgement in runs.items():
        own = results.runs.get(name, RunResults())
        n, located = _located(own)
        lag, _ = measured(pick(own.record("comparison"), "lag_s"), pick(own.record("comparison"), "lag_sd_s"))
        cells = [share(located / n if n else None, 3), _sigma(own), lag, _first(judgement)]
        rows.append([name, judgement["verdict"], *cells])
    header = ["run", "verdict", "located", f"mean sigma ({units})", "lag of the video (s)", "what to look at"]
    return Table("Runs", header, rows, ABOUT["runs"])


def _located(own: RunResults) -> tuple[int, int]:
    table = own.tables.get("trajectories", own.tables.get("waterline"))
    return (0, 0) if table is None else (len(table), int(table["z" if "s" in table else "x"].notna().sum()))


def _sigma(own: RunResults) -> str:
    """Root of the summed squares of the mean sigmas of all axes that have one."""
    table = own.tables.get("trajectories")
    if table is None:
        return "–"
    means = [float(s) for s in table[["sigma_x", "sigma_y", "sigma_z"]].mean() if s == s]
    return number(hypot(*means), 2) if means else "–"


def _cameras_table(results: Results, cameras: Record) -> Table:
    rows = []
    for name, judgement in cameras.items():
        own = results.cameras.get(name, CameraResults())
        record: Record = own.record or {}
        listed = pick(own.labelling or {}, "points")
        used = f"{number(record.get('n_points'))} of {number(listed)}" if record else "–"
        f, sd = measured(record.get("f"), pick(record, "standard_errors", "f"))
        cells = [
            used,
            number(record.get("rms_px"), 2),
            f"{f} ± {sd} {'px' if record.get('dx') == record.get('dy') == 1 else 'mm'}" if record else "–",
            str(record.get("model") or "–"),
            _first(judgement),
        ]
        rows.append([name, judgement["verdict"], *cells])
    header = ["camera", "verdict", "points used", "reprojection error (px rms)", "f", "lens model", "what to look at"]
    return Table("Cameras", header, rows, ABOUT["cameras"])


def _first(judgement: Record) -> str:
    """The worst reason, shortened to a table's cell."""
    if not judgement["reasons"]:
        return "–"
    text = str(judgement["reasons"][0]["text"])
    return text if len(text) <= LONGEST else text[: LONGEST - 2].rsplit(" ", 1)[0] + " …"
