"""What a browser draws of a run, as JSON: series over time. The script that draws them is `templates/report.js`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import AXIS_COLOURS, PALETTE
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.report.numbers import plain

if TYPE_CHECKING:
    from pandas import DataFrame

MOST = 6000
"""Samples of a line that a page holds, at most; of more, every so manieth."""


def positions(table: DataFrame, units: str) -> str:
    """x, y, z of every target with its standard deviation; table: trajectories.parquet."""
    shown = [a for a in "xyz" if table[a].notna().any()] or ["x"]
    each = list(table.groupby("target", sort=False))
    every, t0 = _every(max(len(rows) for _, rows in each)), _first(table)
    panels = [_panel(f"{axis} ({units})", each, axis, t0, every) for axis in shown]
    return _series(panels, t0, every)


def _panel(label: str, each: list[Any], column: str, t0: float, every: int) -> dict[str, Any]:
    """One quantity of several things, each (its name, its rows), with its standard deviation."""
    lines = [
        _line(str(name), PALETTE[i % len(PALETTE)], rows.iloc[::every], t0, column, f"sigma_{column}")
        for i, (name, rows) in enumerate(each)
    ]
    return {"label": label, "lines": lines}


def derivatives(table: DataFrame, units: str) -> str:
    """Velocity and acceleration of the first target by axis, where they are certain; table: kinematics.parquet."""
    rows = table[table["target"] == table["target"].iloc[0]]
    shown = [a for a in "xyz" if rows[f"v{a}"].notna().any()] or ["x"]
    names = [letter + axis for letter in "va" for axis in shown]
    sure = ~rows["flag"].str.contains("edge", regex=False)
    rows = rows.assign(**{name: rows[name].where(sure) for name in names})
    every, t0 = _every(len(rows)), _first(rows)
    panels = [
        {
            "label": label,
            "lines": [_line(axis, AXIS_COLOURS[axis], rows.iloc[::every], t0, letter + axis) for axis in shown],
        }
        for letter, label in (("v", f"velocity ({units}/s)"), ("a", f"acceleration ({units}/s²)"))
    ]
    return _series(panels, t0, every)


def motions(table: DataFrame, units: str) -> str:
    """Six degrees of freedom of each point of a body; table: rows of motions.parquet."""
    each = list(table.groupby("point", sort=False))
    every, t0 = _every(max(len(rows) for _, rows in each)), _first(table)
    units_of = [units] * 3 + ["deg"] * 3
    panels = [
        _panel(f"{name} ({unit})", each, name, t0, every)
        for name, unit in zip(DEGREES_OF_FREEDOM, units_of, strict=True)
    ]
    return _series(panels, t0, every)


def comparison(table: DataFrame, units: str) -> str:
    """The contact sensor and the video, as recorded and with the lag removed; table: comparison.parquet."""
    every, t0 = _every(len(table)), _first(table)
    rows = table.iloc[::every]
    video = _line("video", PALETTE[0], rows, t0, "video")
    panels = [
        {
            "label": f"as recorded ({units})",
            "lines": [_line("reference", "", rows, t0, "reference"), video],
        },
        {
            "label": f"lag removed ({units})",
            "lines": [_line("reference", "", rows, t0, "reference_aligned"), video],
        },
        {
            "label": f"difference ({units})",
            "lines": [_line("reference minus video", PALETTE[1], rows, t0, "difference_aligned")],
        },
    ]
    return _series(panels, t0, every)


def _series(panels: Sequence[dict[str, Any]], t0: float, every: int) -> str:
    data = {"kind": "series", "t0": t0, "every": every, "panels": panels}
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _line(name: str, colour: str, rows: DataFrame, t0: float, column: str, sd: str = "") -> dict[str, Any]:
    line = {"name": name, "colour": colour, "t": plain(np.round(rows["time_s"].to_numpy(float) - t0, 5), 9)}
    line["y"] = plain(rows[column].to_numpy(float))
    return line | ({"sd": plain(rows[sd].to_numpy(float), 3)} if sd else {})


def _every(n: int) -> int:
    return max(1, -(-n // MOST))


def _first(table: DataFrame) -> float:
    """The whole second from which a table's times are counted."""
    return float(np.floor(table["time_s"].min()))
