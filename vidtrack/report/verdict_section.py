"""The first screen of the report: the verdict, each run a line, each camera a line, and the reasons, worst first."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from vidtrack.findings import LEVELS
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import measured, number, pick, share
from vidtrack.report.page import Reason, Table, Verdict
from vidtrack.report.run_summary import run_summary
from vidtrack.results import CameraResults, Results, RunResults
from vidtrack.verdict.judgement import WORDS, capitalised, not_recorded, of_earlier_call, sentence

Record = Mapping[str, Any]

GOOD: Record = {"verdict": "good", "reasons": (), "notes": ()}

NOT_JUDGED = Reason(
    "verdict",
    "Experiment",
    "failed",
    "Nothing was judged: there is no verdict.json.",
    "The last lines of the run, and logs/verdict.log beside this page, say why.",
)

LONGEST = 130
"""Characters of a reason in a cell of a table; the whole of it stands below."""


def verdict_section(results: Results, units: str) -> Verdict:
    """What verdict.json says of the whole, beside the numbers that a reader asks for first."""
    if (record := results.verdict) is None:
        return Verdict("failed", "", [], [NOT_JUDGED], [])
    calibration: Record = record["calibration"] or {}
    runs: Record = record["runs"]
    tables = []
    if runs:
        tables.append(_runs_table(results.summaries, runs, units))
    if calibration:
        tables.append(_cameras_table(results, calibration["cameras"]))
    entries = _of_calibration(calibration)
    entries += [(f"run-{name}", f"Run {name}", own) for name, own in runs.items()]
    line = _line(calibration, runs)
    if awaited := record.get("awaited"):
        line = f"{line} {sentence(capitalised(not_recorded(awaited)))}".lstrip()
    if places := record.get("outdated"):
        line = f"{line} {of_earlier_call(places)}".lstrip()
    return _verdict(record["verdict"], line, tables, entries)


def run_verdict(name: str, results: Results, units: str) -> Verdict:
    """What the verdict says of one run."""
    own: Record = results.verdict["runs"][name] if results.verdict else GOOD
    summary = run_summary(name, results.runs.get(name, RunResults()))
    table = _runs_table({name: summary}, {name: own}, units)
    return _verdict(own["verdict"], "", [table], [(f"run-{name}", f"Run {name}", own)])


def calibration_verdict(results: Results) -> Verdict:
    """What the verdict says of the calibration."""
    own: Record = (results.verdict or {}).get("calibration") or {**GOOD, "cameras": {}}
    return _verdict(own["verdict"], "", [_cameras_table(results, own["cameras"])], _of_calibration(own))


def judged_cameras(results: Results) -> list[str]:
    """The cameras that the verdict judges, those whose calibration failed included."""
    return list(((results.verdict or {}).get("calibration") or {}).get("cameras") or {})


def _of_calibration(calibration: Record) -> list[tuple[str, str, Record]]:
    cameras: Record = calibration.get("cameras") or {}
    entries = [(f"camera-{name}", f"Camera {name}", own) for name, own in cameras.items()]
    return entries + ([("calibration", "Calibration", _without(calibration, cameras.values()))] if calibration else [])


def _verdict(word: str, line: str, tables: Sequence[Table], entries: Sequence[tuple[str, str, Record]]) -> Verdict:
    reasons, notes = ([r for entry in entries for r in _reasons(*entry, key)] for key in ("reasons", "notes"))
    reasons.sort(key=lambda reason: -LEVELS.index(reason.level))
    return Verdict(word, line, tables, reasons, notes)


def _line(calibration: Record, runs: Record) -> str:
    parts = [f"the calibration is {calibration['verdict']}"] if calibration else []
    words = [own["verdict"] for own in runs.values()]
    counts = [(word, words.count(word)) for word in reversed(WORDS)]
    counted = ", ".join(f"{count} {word}" for word, count in counts if count)
    if counted:
        parts.append(f"of {len(runs)} run{'s' if len(runs) > 1 else ''} {counted}")
    return sentence(capitalised("; ".join(parts)))


def _without(whole: Record, parts: Iterable[Record]) -> Record:
    """The reasons and notes of the calibration as a whole that are no camera's."""
    theirs = [finding for part in parts for finding in (*part["reasons"], *part["notes"])]
    return {key: [finding for finding in whole[key] if finding not in theirs] for key in ("reasons", "notes")}


def _reasons(key: str, about: str, own: Record, which: str) -> Iterator[Reason]:
    for finding in own.get(which) or ():
        yield Reason(key, about, finding["level"], sentence(finding["text"]), sentence(finding["cure"]))


def _runs_table(summaries: Mapping[str, Record], runs: Record, units: str) -> Table:
    rows, keys = [], []
    for name, judgement in runs.items():
        own = summaries.get(name, {})
        part = own["located"] / own["samples"] if own.get("samples") else None
        lag, _ = measured(own.get("lag_s"), own.get("lag_sd_s"))
        cells = [share(part, 3), number(own.get("sigma"), 2), lag, _first(judgement)]
        rows.append([name, judgement["verdict"], *cells])
        keys.append(f"run-{name}")
    header = ["run", "verdict", "located", f"mean sigma in space ({units})", "lag of the video (s)", "what to look at"]
    return Table("Runs", header, rows, ABOUT["runs"], keys)


def _cameras_table(results: Results, cameras: Record) -> Table:
    rows, keys = [], []
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
        keys.append(f"camera-{name}")
    header = ["camera", "verdict", "points used", "reprojection error (px rms)", "f", "lens model", "what to look at"]
    return Table("Cameras", header, rows, ABOUT["cameras"], keys)


def _first(judgement: Record) -> str:
    """The worst reason, shortened to a table's cell."""
    if not judgement["reasons"]:
        return "–"
    text = str(judgement["reasons"][0]["text"])
    return text if len(text) <= LONGEST else text[: LONGEST - 2].rsplit(" ", 1)[0] + " …"
