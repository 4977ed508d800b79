"""What a browser draws of a run, as JSON: series over time. The script that draws them is `templates/report.js`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vidtrack.figures.style import AXIS_COLOURS, PALETTE
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.report.numbers import plain_json

if TYPE_CHECKING:
    from pandas import DataFrame

MOST = 6000
"""Samples of a line that a page holds, at most; of more, every so manieth."""


class Thing(NamedTuple):
    """What a line of a panel is of: its name, its rows that are shown, and their times as JSON."""

    name: str
    rows: DataFrame
    times: str


def positions(table: DataFrame, units: str) -> str:
    """x, y, z of every target with its standard deviation; table: trajectories.parquet."""
    shown = [a for a in "xyz" if table[a].notna().any()] or ["x"]
    each, t0, every = _things(table, "target")
    return _series([_panel(f"{axis} ({units})", each, axis) for axis in shown], t0, every)


def derivatives(table: DataFrame, units: str) -> str:
    """Velocity and acceleration of the first target by axis, where they are certain; table: kinematics.parquet."""
    rows = table[table["target"] == table["target"].iloc[0]]
    shown = [a for a in "xyz" if rows[f"v{a}"].notna().any()] or ["x"]
    names = [letter + axis for letter in "va" for axis in shown]
    sure = ~rows["flag"].str.contains("edge", regex=False).to_numpy(bool)
    shown_rows = {name: np.where(sure, rows[name].to_numpy(float), np.nan) for name in names}
    thing, t0, every = _thing("", rows.assign(**shown_rows))
    panels = [
        _joined(label, [_line(thing, letter + axis, AXIS_COLOURS[axis], name=axis) for axis in shown])
        for letter, label in (("v", f"velocity ({units}/s)"), ("a", f"acceleration ({units}/s²)"))
    ]
    return _series(panels, t0, every)


def motions(table: DataFrame, units: str) -> str:
    """Six degrees of freedom of each point of a body; table: rows of motions.parquet."""
    each, t0, every = _things(table, "point")
    units_of = [units] * 3 + ["deg"] * 3
    panels = [_panel(f"{name} ({unit})", each, name) for name, unit in zip(DEGREES_OF_FREEDOM, units_of, strict=True)]
    return _series(panels, t0, every)


def comparison(table: DataFrame, units: str) -> str:
    """The contact sensor and the video, as recorded and with the lag removed; table: comparison.parquet."""
    thing, t0, every = _thing("", table)
    video = _line(thing, "video", PALETTE[0])
    panels = [
        _joined(f"as recorded ({units})", [_line(thing, "reference", ""), video]),
        _joined(f"lag removed ({units})", [_line(thing, "reference_aligned", "", name="reference"), video]),
        _joined(
            f"difference ({units})",
            [_line(thing, "difference_aligned", PALETTE[1], name="reference minus video")],
        ),
    ]
    return _series(panels, t0, every)


def _things(table: DataFrame, column: str) -> tuple[list[Thing], float, int]:
    """Those that a column names, in their order; the second from which times count; every how manieth row is shown."""
    each = [(str(name), rows) for name, rows in table.groupby(column, sort=False)]
    every, t0 = _every(max(len(rows) for _, rows in each)), _first(table)
    return [_shown(name, rows, t0, every) for name, rows in each], t0, every


def _thing(name: str, rows: DataFrame) -> tuple[Thing, float, int]:
    every, t0 = _every(len(rows)), _first(rows)
    return _shown(name, rows, t0, every), t0, every


def _shown(name: str, rows: DataFrame, t0: float, every: int) -> Thing:
    rows = rows.iloc[::every]
    return Thing(name, rows, plain_json(np.round(rows["time_s"].to_numpy(float) - t0, 5), 9))


def _panel(label: str, each: Sequence[Thing], column: str) -> str:
    """One quantity of several things with its standard deviation."""
    lines = [
        _line(thing, column, PALETTE[i % len(PALETTE)], name=thing.name, sd=f"sigma_{column}")
        for i, thing in enumerate(each)
    ]
    return _joined(label, lines)


def _line(thing: Thing, column: str, colour: str, *, name: str = "", sd: str = "") -> str:
    values = f'"t":{thing.times},"y":{plain_json(thing.rows[column].to_numpy(float))}'
    values += f',"sd":{plain_json(thing.rows[sd].to_numpy(float), 3)}' if sd else ""
    return f'{{"name":{_text(name or column)},"colour":{_text(colour)},{values}}}'


def _joined(label: str, lines: Sequence[str]) -> str:
    return f'{{"label":{_text(label)},"lines":[{",".join(lines)}]}}'


def _series(panels: Sequence[str], t0: float, every: int) -> str:
    begin = json.dumps(t0, allow_nan=False)
    return f'{{"kind":"series","t0":{begin},"every":{every},"panels":[{",".join(panels)}]}}'


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _every(n: int) -> int:
    return max(1, -(-n // MOST))


def _first(table: DataFrame) -> float:
    """The whole second from which a table's times are counted."""
    return float(np.floor(table["time_s"].min()))
