"""The page of a campaign: all runs under their conditions, response over period, repeatability, pooled decays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.figures.campaign import response_curves
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.report.addresses import INDEX, run_file
from vidtrack.report.drawn import Chart, drawn
from vidtrack.report.explanations import ABOUT
from vidtrack.report.footer import footer
from vidtrack.report.numbers import measured, number
from vidtrack.report.page import Page, Section, Table

Record = Mapping[str, Any]

LABELS = {
    "H": "H (asked)",
    "T": "T (asked, s)",
    "H_measured": "H",
    "T_s": "T (s)",
    "Hm0": "Hm0",
    "Tp": "Tp (s)",
    "Tz": "Tz (s)",
    "Te": "Te (s)",
    "Td_s": "Td (s)",
    "fn_Hz": "fn (Hz)",
    "zeta": "zeta",
    "quadratic": "quadratic damping b",
}


MOST_CURVES = 12
"""Motions in one figure."""


def campaign_page(record: Record, *, units: str, title: str, provenance: Record) -> Page:
    """Compose the page; record: campaign.json."""
    runs: Record = record["runs"]
    tables = [
        runs_table(runs, units),
        response_table(runs, units),
        pooled_table(record["pooled"], units),
        repeatability_table(record["repeats"], units),
        full_scale_table(runs, units),
        full_scale_responses(runs, units),
    ]
    charts = []
    for (unit, body), curves in _curves(runs, units).items():
        caption = f"Response of {body} over the period of the waves, with 95 % intervals; each point is a run ({unit})"
        charts.append(Chart(caption, response_curves(curves, unit, body)))
    lines = [f"{len(runs)} runs, {sum(bool(own['analysed']) for own in runs.values())} of them analysed."]
    section = Section("campaign", "Campaign", lines, [t for t in tables if t], drawn(charts))
    links = {f"run-{name}": run_file(name) for name, own in runs.items() if own["analysed"]}
    nav = [("Overview", f"../{INDEX}")]
    return Page(f"{title}: campaign", (), None, [section], footer(provenance, units), links, nav)


def runs_table(runs: Record, units: str) -> Table:
    """Each run a line: its conditions, and what was measured."""
    measured_names = [n for n in LABELS if any(n in own["measured"] for own in runs.values())]
    asked = [key for key in ("H", "T", "heading", "scale") if any(own[key] is not None for own in runs.values())]
    words = [key for key in ("repeat", "notes") if any(own[key] for own in runs.values())]
    rows = [
        [
            name,
            *(number(own[key], 6) for key in asked),
            *(_pm(own["measured"].get(key)) for key in measured_names),
            *(own[key] or "–" for key in words),
        ]
        for name, own in runs.items()
    ]
    units_of = {"H": f"H asked ({units})", "T": "T asked (s)", "heading": "heading (deg)", "scale": "scale"}
    header = ["run", *(units_of[key] for key in asked), *(_label(n, units) for n in measured_names), *words]
    return Table("All runs", header, rows, ABOUT["campaign"], [f"run-{name}" for name in runs])


def response_table(runs: Record, units: str) -> Table | None:
    """The response of each motion in each run of regular waves."""
    rows, keys = [], []
    for name, own in runs.items():
        for motion, response in _of_bodies(own["responses"]).items():
            T = own["measured"].get("T_s") or {}
            slope = response.get("rao_slope")
            cells = [_pm(T), _pm(response["rao"]), _ratio_unit(response["unit"], units)]
            rows.append([name, motion, *cells, _pm(slope) if slope else "–", _pm(response["phase_deg"])])
            keys.append(f"run-{name}")
    if not rows:
        return None
    header = ["run", "motion", "T (s)", "RAO", "unit", "over the slope (deg/deg)", "phase (deg)"]
    return Table("Response of each motion", header, rows, ABOUT["responses"], keys)


def repeatability_table(repeats: list[Record], units: str) -> Table | None:
    """How far repeats scatter."""
    rows = []
    for group in repeats:
        names = ", ".join(group["runs"])
        for name, own in group["quantities"].items():
            rows.append([names, _label(name, units), *_type_a(own)])
        for motion, own in group["responses"].items():
            rows += [
                [names, f"{motion}, {what}", *_type_a(own[key])]
                for key, what in (("rao", "RAO"), ("phase_deg", "phase (deg)"))
            ]
    if not rows:
        return None
    header = ["repeats", "quantity", "n", "mean", "± 95 %", "standard deviation", "u of the mean (type A)"]
    return Table("Repeatability", header, rows, ABOUT["repeatability"])


def pooled_table(pooled: list[Record], units: str) -> Table | None:
    """Free decays pooled over repeats."""
    rows = []
    for group in pooled:
        cells = [_pm(group[name]) for name in ("Td_s", "fn_Hz", "zeta", "quadratic")]
        rows.append([", ".join(group["runs"]), str(group["series"]), *cells])
    if not rows:
        return None
    header = ["runs", "motion", *(_label(name, units) for name in ("Td_s", "fn_Hz", "zeta", "quadratic"))]
    return Table("Free decay, pooled over repeats", header, rows, ABOUT["pooled"])


def full_scale_table(runs: Record, units: str) -> Table | None:
    """What the runs say of the full size, by Froude's law."""
    scaled = {name: own for name, own in runs.items() if own["full_scale"]}
    if not scaled:
        return None
    names = [n for n in LABELS if any(n in own["full_scale"] for own in scaled.values())]
    rows = [
        [
            name,
            number(own["scale"], 6),
            *(number(own["full_scale"].get(n), 4) for n in names),
        ]
        for name, own in scaled.items()
    ]
    header = ["run", "scale", *(_label(n, units) for n in names)]
    keys = [f"run-{name}" for name in scaled]
    return Table("At full scale, by Froude's law", header, rows, ABOUT["full-scale"], keys)


def full_scale_responses(runs: Record, units: str) -> Table | None:
    """The response of each motion of a body at full size, a line each: a column each would not fit on paper."""
    rows, keys = [], []
    for name, own in runs.items():
        for motion, rao in ((own["full_scale"] or {}).get("responses") or {}).items():
            if motion.rsplit(".", 1)[-1] in DEGREES_OF_FREEDOM:
                unit = (own["responses"].get(motion) or {}).get("unit") or ""
                rows.append([name, number(own["scale"], 6), motion, number(rao, 4), _ratio_unit(unit, units)])
                keys.append(f"run-{name}")
    if not rows:
        return None
    header = ["run", "scale", "motion", "RAO", "unit"]
    return Table("Response at full scale, by Froude's law", header, rows, ABOUT["full-scale"], keys)


def _curves(runs: Record, units: str) -> dict[tuple[str, str], dict[str, list[Record]]]:
    """By unit of the ratio and body, the points of each motion that is seen in two runs or more; bodies before targets.

    A body turns by the same angle at each of its points: it is shown once.
    """
    points: dict[str, dict[str, list[Record]]] = {}
    for name, own in runs.items():
        T = (own["measured"].get("T_s") or {}).get("value")
        for motion, response in own["responses"].items():
            if T is not None and response["rao"]["value"] is not None:
                point = {"run": name, "T": T, **response}
                points.setdefault(_ratio_unit(response["unit"], units), {}).setdefault(motion, []).append(point)
    out: dict[tuple[str, str], dict[str, list[Record]]] = {}
    for unit, of_unit in points.items():
        for motion, own in _of_bodies({motion: own for motion, own in of_unit.items() if len(own) > 1}).items():
            group, _, dof = motion.rpartition(".")
            body, _, place = group.partition("@")
            if place and dof in DEGREES_OF_FREEDOM[3:] and f"{body}.{dof}" in of_unit:
                continue
            curves = out.setdefault((unit, body or motion), {})
            if len(curves) < MOST_CURVES:
                curves[motion] = own
    return out


def _of_bodies(each: dict[str, Any]) -> dict[str, Any]:
    """The motions of bodies; those of targets where there is no body."""
    bodies = {name: own for name, own in each.items() if name.rsplit(".", 1)[-1] in DEGREES_OF_FREEDOM}
    return bodies or each


def _ratio_unit(unit: str, units: str) -> str:
    return f"{unit or 'its unit'}/{units}"


def _label(name: str, units: str) -> str:
    label = LABELS.get(name, name)
    return f"{label} ({units})" if name in ("H", "H_measured", "Hm0") else label


def _pm(estimate: Record | None) -> str:
    if not estimate or estimate.get("value") is None:
        return "–"
    value, width = measured(estimate["value"], estimate.get("half_width"))
    return f"{value} ± {width}" if width != "–" else value


def _type_a(own: Record) -> list[str]:
    mean, width = measured(own["mean"], own["half_width"])
    return [number(own["n"]), mean, width, number(own["sd"], 2), number(own["u_A"], 2)]
