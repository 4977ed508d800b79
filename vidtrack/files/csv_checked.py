"""CSV files that people wrote, checked cell by cell without a heavy library: errors name the file and the line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.errors import VidtrackError, first_of
from vidtrack.files.csv_columns import Columns, Header, find_header, unit_problems
from vidtrack.files.csv_numbers import MISSING, NumberStyle, why_not_a_number
from vidtrack.files.csv_text import Path, Row, read_text, short, split_rows

LARGEST = 1e12
"""What no coordinate exceeds, in px or in a unit of length: squares of far larger ones have no digits left."""

_COMMENTS = ("%", "//", "!", ";", "*", "--")
"""What begins a comment in files of other programs."""


def checked_csv(path: Path, columns: Columns, *, others: str = "forbid", units: str = "") -> dict[str, list[Any]]:
    """The wanted columns of a CSV file, absent optional ones left out, and `line`: each row's line in the file.

    others   forbid | ignore: what to do with columns that are not wanted
    units    the experiment's unit of length, compared with units in the header; "" where there is none to compare
    Raises VidtrackError with every bad cell (ten at most), each with its line.
    """
    text = read_text(path)
    if (plain := plain_columns(text, columns)) is not None:
        return plain
    split = split_rows(path, text, columns.names)
    header = find_header(path, split, columns, others)
    problems = unit_problems(path, header, columns, units)
    rows, unclear = _data_rows(path, header, columns)
    problems += unclear
    if problems:
        raise VidtrackError(*first_of(problems, path))
    if not rows:
        raise VidtrackError(f"{path}: has a header but no rows. Add a row for each {header.row.cells[0]}.")
    return _read_rows(path, rows, header, columns, split.separator)


_PLAIN = {"text": r"[A-Za-z][A-Za-z_]{0,99}\d{0,9}", "number": r"-?\d{1,9}(?:\.\d{1,17})?"}


def plain_columns(text: str, columns: Columns) -> dict[str, list[Any]] | None:
    """What `checked_csv` answers for a table as programs write it, ten times sooner; None where that is not certain.

    Plain is a table whose header has just the names that must be there, with commas between cells that are words or
    decimals and nothing else: nothing in it can be wrong but a repeated row.
    """
    head, _, body = text.partition("\n")
    names = head.split(",")
    special = {*columns.times, *columns.positive, *columns.not_negative}
    if sorted(names) != sorted(columns.needed) or special.intersection(names):
        return None
    row = ",".join(_PLAIN["number" if name in columns.numbers else "text"] for name in names)
    # Python before 3.11.5 passes over what a last, incomplete row begins with
    if not body.endswith("\n") or not re.fullmatch(rf"(?:{row}\n)++", body, re.ASCII):
        return None
    cells = body.replace("\n", ",").split(",")
    by_name = {name: cells[place : -1 : len(names)] for place, name in enumerate(names)}
    rows = len(cells) // len(names)
    if columns.unique and len(set(zip(*(by_name[name] for name in columns.unique), strict=True))) < rows:
        return None
    answer: dict[str, list[Any]] = {
        name: list(map(float, by_name[name])) if name in columns.numbers else by_name[name] for name in columns.needed
    }
    return answer | {"line": list(range(2, rows + 2))}


def read_header(path: Path) -> list[str]:
    """The names of the columns of a CSV file as they stand, without those that are empty."""
    rows = split_rows(path, read_text(path), ()).rows
    header = next((row for row in rows if not row.marked), None)
    return [cell for cell in header.cells if cell] if header else []


def _read_rows(
    path: Path, rows: Sequence[Row], header: Header, columns: Columns, separator: str
) -> dict[str, list[Any]]:
    at, width = header.at, len(header.row.cells)
    numeric = [at[name] for name in (*columns.numbers, *columns.times) if name in at]
    style = NumberStyle((row.cells[place] for row in rows for place in numeric if place < len(row.cells)), separator)
    if style.ambiguous:
        raise VidtrackError(_ambiguous(path, rows, header, numeric, style))
    answer: dict[str, list[Any]] = {name: [] for name in columns.names if name in at}
    seen: dict[tuple[str, ...], int] = {}
    problems: list[str] = []
    for row in rows:
        where = f"{path}, line {row.line}"
        problem = _width_problem(row, header, columns, separator)
        if problem:
            problems.append(f"{where}: {problem}")
            continue
        cells = row.cells + [""] * (width - len(row.cells))
        for name, column in answer.items():
            value, problem = _value(name, cells[at[name]], columns, style)
            column.append(value)
            if problem:
                problems.append(f"{where}: {name} is {problem}")
        problems += _repeated(where, row.line, {n: cells[at[n]] for n in columns.unique}, seen)
    if problems:
        raise VidtrackError(*first_of(problems, path))
    answer["line"] = [row.line for row in rows]
    return answer


def _value(name: str, cell: str, columns: Columns, style: NumberStyle) -> tuple[Any, str]:
    """A cell's value, and what is wrong with it: "" where nothing is."""
    blank = name in columns.blanks
    if name in columns.numbers:
        if blank and cell.casefold() in MISSING:
            return math.nan, ""
        value = style.number(cell)
        if value is None:
            return math.nan, f"{short(cell)}, {why_not_a_number(cell)}"
        if name in columns.units and name not in columns.times and abs(value) > LARGEST and not blank:
            return math.nan, f"{short(cell)}, which no place has. Correct the value."
        if (name in columns.positive and value <= 0) or (name in columns.not_negative and value < 0):
            least = "greater than 0" if name in columns.positive else "0 or greater"
            cure = "Correct the value, or leave the cell empty" if blank else "Correct the value"
            return math.nan, f"{short(cell)}; it must be {least}. {cure}."
        return value, ""
    if not cell and not blank:
        return cell, "empty. Fill it in or delete the row."
    if any(ord(letter) < 32 for letter in cell):
        return cell, f"{short(cell)}, which has a line break or a tab in it. Write the text on one line."
    return style.time(cell) if name in columns.times else cell, ""


def _repeated(where: str, line: int, cells: Mapping[str, str], seen: dict[tuple[str, ...], int]) -> list[str]:
    first = seen.setdefault(tuple(cells.values()), line)
    if not cells or first == line:
        return []
    name = ", ".join(f"{n} {k}" for n, k in cells.items())
    return [f"{where}: {name} appears twice (also line {first}). Name each once."]


def _width_problem(row: Row, header: Header, columns: Columns, separator: str) -> str:
    """What is wrong with a row's number of cells; empty cells that a program left out at its end are not."""
    width = len(header.row.cells)
    absent = [name for name, place in header.at.items() if place >= row.width and name not in columns.blanks]
    if len(row.cells) > width or absent:
        cells = len(row.cells) if len(row.cells) > width else row.width
        if separator == "," and cells > width and all(c.lstrip("+-").isdigit() for c in row.cells[-width:]):
            cure = "If commas begin decimals, write points, or put semicolons between the cells."
        elif row.cells[0].startswith(_COMMENTS):
            cure = "If the line is a comment, begin it with #."
        else:
            cure = "Correct the row."
        return f"{cells} cell{'s' * (cells != 1)} where the header names {width}. {cure}"
    for place, cell in enumerate(row.cells):
        if cell and not header.row.cells[place]:
            return f"{short(cell)} stands in column {place + 1}, which has no name. Name the column or empty it."
    return ""


def _ambiguous(path: Path, rows: Sequence[Row], header: Header, places: Sequence[int], style: NumberStyle) -> str:
    for row in rows:
        for place in places:
            if place < len(row.cells) and style.is_ambiguous(row.cells[place]):
                cell, name = row.cells[place], header.row.cells[place]
                return (
                    f"{path}, line {row.line}: {name} is {short(cell)}, and {style.reason}. Write a point before "
                    "decimals and nothing between thousands, in all cells."
                )
    return f"{path}: {style.reason}. Write a point before decimals."


def _data_rows(path: Path, header: Header, columns: Columns) -> tuple[list[Row], list[str]]:
    """The rows of values, without comments, and what is wrong with rows that may be either.

    Where no other row holds values, rows such as `#1,27.0,14.0,12.0` hold tags that begin with #.
    """
    plain = [row for row in header.rest if not row.marked]
    tagged = [row for row in header.rest if row.marked and _looks_tagged(row, header, columns)]
    if not plain or not tagged:
        return plain or tagged, []
    return plain, [
        f"{path}, line {row.line}: {short(row.cells[0])} may be a name, or the row a comment. Put a name in quotation "
        "marks, or a space after # to leave the row out."
        for row in tagged
    ]


def _looks_tagged(row: Row, header: Header, columns: Columns) -> bool:
    first = next((name for name, place in header.at.items() if place == 0), "")
    if (
        first not in columns.texts
        or not row.cells[0][1:]
        or row.cells[0][1].isspace()
        or len(row.cells) > len(header.row.cells)
    ):
        return False
    style = NumberStyle(row.cells, ";")
    places = [header.at[n] for n in columns.numbers if n in header.at and n not in columns.blanks]
    return all(place < len(row.cells) and style.number(row.cells[place]) is not None for place in places)
