"""The uncertainty statement of a run as tables: per axis and per motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.analysis.uncertainty import PARTS
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import number, share
from vidtrack.report.page import Table

Record = Mapping[str, Any]

ANGLES = ("roll", "pitch", "yaw")


def uncertainty_tables(found: Record, units: str) -> list[Table]:
    """The tables that there is something in; found: `analysis.uncertainty.uncertainty_statement`."""
    tables = []
    k = number(found.get("k"), 2)
    if positions := found.get("positions"):
        rows = {f"{axis} ({units})": own for axis, own in positions.items()}
        tables.append(_table(f"Uncertainty of a position; expanded with k = {k}", rows))
    for body, points in (found.get("motions") or {}).items():
        for point, own in points.items():
            if not own:
                continue
            at = "its origin" if point == "origin" else point
            rows = {f"{dof} ({'deg' if dof in ANGLES else units})": one for dof, one in own.items()}
            tables.append(_table(f"Uncertainty of the motions of {body} at {at}; expanded with k = {k}", rows))
    return tables


def _table(caption: str, each: Mapping[str, Record]) -> Table:
    parts = [part for part in PARTS if any(own["parts"].get(part) for own in each.values())]
    rows = [
        [
            name,
            *(number(own["parts"].get(part), 2) for part in parts),
            number(own["combined"], 2),
            number(own["expanded"], 2),
            f"{own['dominant']}, {share(own['dominant_share'], 2)} of the variance" if own["dominant"] else "–",
            str(own["cure"] or "–"),
        ]
        for name, own in each.items()
    ]
    header = ["", *parts, "combined", "expanded", "what dominates", "what would halve it"]
    return Table(caption, header, rows, ABOUT["uncertainty"])
