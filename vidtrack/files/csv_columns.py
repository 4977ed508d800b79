"""What a kind of CSV file holds, and the row of a file that names its columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from vidtrack.errors import VidtrackError, first_of
from vidtrack.files.csv_header import LENGTHS, TIMES, column_of, split_unit
from vidtrack.files.csv_numbers import NumberStyle
from vidtrack.files.csv_text import SEPARATORS, CsvText, Path, Row, short
from vidtrack.naming import did_you_mean

NOTES = frozenset({"note", "notes", "comment", "comments", "remark", "remarks", "description"})
"""Columns that people keep for themselves, in any case; they are never read."""

MOST_UNKNOWN = 3
"""Columns that are not known, and are named each on a line of its own."""

LATEST_HEADER = 40
"""Rows, at most, before the header: titles and dates that instruments write."""


class Columns(NamedTuple):
    """What one kind of file holds.

    texts, numbers   the columns that hold words and numbers
    optional         those of them that may be absent
    blanks           columns in which an empty cell is allowed; as a number it becomes NaN
    unique           columns whose cells together may name only one row
    times            the texts that hold times: seconds, time code or ISO 8601
    units            the unit of a column, compared with the one that its header states: px, s, or world, which stands
                     for the experiment's unit of length (IF_A_LENGTH: where it states a length)
    positive         numbers that must lie above 0
    not_negative     numbers that may be 0 but not lie below
    """

    texts: Sequence[str] = ()
    numbers: Sequence[str] = ()
    optional: Sequence[str] = ()
    blanks: Sequence[str] = ()
    unique: Sequence[str] = ()
    times: Sequence[str] = ()
    units: Mapping[str, str] = {}
    positive: Sequence[str] = ()
    not_negative: Sequence[str] = ()

    @property
    def names(self) -> list[str]:
        """Every column that is read."""
        return [*self.texts, *self.numbers]

    @property
    def needed(self) -> list[str]:
        """Every column that must be there."""
        return [name for name in self.names if name not in self.optional]


IF_A_LENGTH = "world if a length"
"""The unit of a column that may hold anything, but is in the experiment's unit of length where it states a length."""
WORLD = dict.fromkeys(("x", "y", "z", "sigma"), "world")
PIXELS = dict.fromkeys(("Xf", "Yf", "width", "height"), "px")
CAMPAIGN = Columns(
    ("run", "repeat", "notes"),
    ("H", "T", "heading", "scale"),
    ("H", "T", "heading", "scale", "repeat", "notes"),
    ("H", "T", "heading", "scale", "repeat", "notes"),
    ("run",),
    units={"H": "world", "T": "s"},
    positive=("T", "scale"),
    not_negative=("H",),
)
POINTS = Columns(
    ("tag",), ("x", "y", "z", "sigma"), ("sigma",), ("sigma",), ("tag",), units=WORLD, not_negative=("sigma",)
)
PICKS = Columns(
    ("camera", "tag"),
    ("Xf", "Yf", "sd"),
    ("sd",),
    ("sd",),
    ("camera", "tag"),
    units={**PIXELS, "sd": "px"},
    positive=("sd",),
)
TARGETS = Columns(
    ("camera", "target"),
    ("Xf", "Yf", "width", "height"),
    ("width", "height"),
    ("width", "height"),
    ("camera", "target"),
    units=PIXELS,
    positive=("width", "height"),
)
TRUTH = Columns(("target",), ("time_s", "x", "y", "z"), unique=("time_s", "target"), units={**WORLD, "time_s": "s"})
PROFILE = Columns(numbers=("x", "y", "z"), units=WORLD)


def reference_record(time: str, value: str) -> Columns:
    """What is read of a contact sensor's record: its column of times and one of values, which may have gaps.

    Times are in seconds; values in the experiment's unit of length, where the header states a length.
    """
    return Columns((time,), (value,), blanks=(value,), times=(time,), units={time: "s", value: IF_A_LENGTH})


_STATED = re.compile(
    r"\b(?:units?|dimensions?|coordinates?|lengths?|distances?)\b(?: of length| used)?\s*(?:are|is)?"
    r"\s*(?:in\b|[:=(\[])?\s*([A-Za-zµμ]+)\b",
    re.IGNORECASE,
)
"""What a title says of units: `units: mm`, `all dimensions in mm`, `coordinates (mm)`."""


class Header(NamedTuple):
    """The row that names the columns, and what it says of them."""

    row: Row
    at: dict[str, int]  # wanted column: its place in a row
    units: dict[str, str]  # wanted column: the unit that the header states
    rest: list[Row]  # the rows below


def find_header(path: Path, split: CsvText, columns: Columns, others: str) -> Header:
    """The row that names the columns, below titles and comments; VidtrackError where it does not name what it must."""
    rows = split.rows
    if all(row.marked for row in rows):
        raise VidtrackError(f"{path}: empty. Write a header and a row for each entry.")
    header = next(row for row in rows if not row.marked)
    for row in rows[:LATEST_HEADER]:
        bare = row._replace(cells=[row.cells[0].lstrip("# "), *row.cells[1:]]) if row.marked else row
        found = {column_of(cell, columns.names)[0] for cell in bare.cells[:1000]}
        if found.issuperset(columns.needed):
            header = bare
            break
    rest = [row for row in rows if row.line > header.line]
    named = [column_of(cell, columns.names) for cell in header.cells]
    at: dict[str, int] = {}
    problems = []
    for place, (name, _) in enumerate(named):
        if name is None:
            continue
        exact = header.cells[place] == name
        if name in at and (others == "forbid" or exact == (header.cells[at[name]] == name)):
            problems.append(f"{path}, line {header.line}: column {name} appears twice. Keep one.")
        if name not in at or exact:
            at[name] = place
    unknown = [
        c for c, (name, _) in zip(header.cells, named, strict=True) if name is None and c and c.casefold() not in NOTES
    ]
    problems += _header_problems(f"{path}, line {header.line}", header, at, unknown, columns, others)
    if problems:
        raise VidtrackError(*first_of(problems, path))
    units = {name: named[place][1] for name, place in at.items()}
    if rest and (below := _units_row(rest[0], at)):
        units |= {name: unit for name, unit in below.items() if not units[name]}
        rest = rest[1:]
    if stated := _unit_above([row for row in rows if row.line < header.line]):
        units |= {name: stated for name, unit in units.items() if not unit and columns.units.get(name) == "world"}
    return Header(header, at, units, rest)


def _header_problems(
    where: str, header: Row, at: Mapping[str, int], unknown: Sequence[str], columns: Columns, others: str
) -> list[str]:
    missing = [name for name in columns.needed if name not in at]
    needed = ",".join(columns.needed)
    if (
        missing
        and all(NumberStyle((c,), ";").number(c) is not None for c in header.cells[1:] if c)
        and header.cells[1:]
    ):
        return [f"{where}: the file begins with values, not with a header. Write {needed} above them."]
    if len(missing) == len(columns.needed) > 1 and len(header.cells) == 1 and " " in header.cells[0]:
        return [f"{where}: {short(header.cells[0])} names no columns. Write {needed}, with commas between the cells."]
    if len(header.cells) == 1 and any(mark in header.cells[0] for mark in SEPARATORS):
        return [f"{where}: each line stands in quotation marks as a whole. Remove those at its beginning and its end."]
    if len(missing) > 1:
        met = f"; it names {_some(unknown)}" if unknown else ""
        return [f"{where}: no columns {', '.join(missing)}{met}. The header must name {needed}."]
    if missing:
        near = did_you_mean(missing[0], unknown)
        hint = f"; is it {short(near)}?" if near else "."
        return [f"{where}: no column {missing[0]}{hint} The header must name {needed}."]
    if others == "ignore" or not unknown:
        return []
    if len(unknown) > MOST_UNKNOWN:
        return [
            f"{where}: {len(unknown)} columns that are not known, {_some(unknown)}. Keep {', '.join(columns.names)}."
        ]
    problems = []
    for name in unknown:
        near = did_you_mean(name, columns.names)
        hint = f"; did you mean {near!r}?" if near else f". Known: {', '.join(columns.names)}."
        problems.append(f"{where}: no such column as {short(name)}{hint}")
    return problems


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(short(name) for name in names[:MOST_UNKNOWN])
    return shown if len(names) <= MOST_UNKNOWN else f"{shown} and {len(names) - MOST_UNKNOWN} more"


def _unit_above(rows: Sequence[Row]) -> str:
    """The unit of length that titles above the header state, as in `# units: mm`; "" for none or several."""
    text = "\n".join(" ".join(row.cells) for row in rows)
    units = {split_unit(f"x ({word})")[1] for word in _STATED.findall(text)} & LENGTHS
    return units.pop() if len(units) == 1 else ""


def _units_row(row: Row, at: Mapping[str, int]) -> dict[str, str] | None:
    """The units that the row below the header gives, where it holds nothing else."""
    found = {}
    for name, place in at.items():
        cell = row.cells[place] if place < len(row.cells) else ""
        unit = split_unit(f"x ({cell.strip('()[]{} ')})")[1]
        if unit:
            found[name] = unit
        elif cell not in ("", "-"):
            return None
    return found or None


def own_unit(name: str, wanted: str = "s") -> str:
    """The unit that a name which the config gives has in itself, as time_ms has; "" for none, or another kind."""
    unit = split_unit(name)[1]
    return unit if unit in (TIMES if wanted == "s" else LENGTHS if wanted in ("world", IF_A_LENGTH) else ()) else ""


def unit_problems(path: Path, header: Header, columns: Columns, units: str) -> list[str]:
    """Columns whose header states another unit than the one in which they are read, a line for each unit."""
    strange: dict[tuple[str, str], list[str]] = {}
    for name, written in header.units.items():
        wanted = columns.units.get(name, "")
        stated = written or own_unit(name, wanted)
        if wanted == IF_A_LENGTH:
            wanted = "world" if stated in LENGTHS else ""
        right = stated == units or (not units and stated in LENGTHS) if wanted == "world" else stated == wanted
        if stated and wanted and not right:
            strange.setdefault((stated, wanted), []).append(short(header.row.cells[header.at[name]]))
    problems = []
    for (stated, wanted), names in strange.items():
        place = f"{path}, line {header.row.line}: column {', '.join(names)}"
        if wanted == "world" and stated in LENGTHS:
            problems.append(
                f"{place} is in {stated}, but config.yaml says units: {units}. Convert it, or correct units."
            )
        elif wanted == "world":
            problems.append(f"{place} is in {stated}, which is no length. Write it in the units of config.yaml.")
        else:
            problems.append(f"{place} is in {stated}, and vidtrack reads it in {wanted}. Convert it.")
    return problems
