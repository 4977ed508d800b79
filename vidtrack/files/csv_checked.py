"""CSV files that people wrote, checked cell by cell without a heavy library: errors name the file and the line."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.naming import did_you_mean

Path = str | os.PathLike[str]


class Columns(NamedTuple):
    """What one kind of file holds.

    texts, numbers   the columns that hold words and numbers
    optional         those of them that may be absent
    blanks           number columns in which an empty cell is allowed, and becomes NaN
    unique           columns whose cells together may name only one row
    """

    texts: Sequence[str] = ()
    numbers: Sequence[str] = ()
    optional: Sequence[str] = ()
    blanks: Sequence[str] = ()
    unique: Sequence[str] = ()


POINTS = Columns(("tag",), ("x", "y", "z", "sigma"), ("sigma",), ("sigma",), ("tag",))
PICKS = Columns(("camera", "tag"), ("Xf", "Yf"), unique=("camera", "tag"))
TARGETS = Columns(
    ("camera", "target"),
    ("Xf", "Yf", "width", "height"),
    ("width", "height"),
    ("width", "height"),
    ("camera", "target"),
)
TRUTH = Columns(("target",), ("time_s", "x", "y", "z"), unique=("time_s", "target"))


def checked_csv(path: Path, columns: Columns, *, others: str = "forbid") -> dict[str, list[Any]]:
    """The wanted columns of a CSV file, absent optional ones left out, and `line`: each row's line in the file.

    others   forbid | ignore: what to do with columns that nobody asked for
    Raises VidtrackError with every bad cell (ten at most), each with its line.
    """
    header, rows = _rows(path)
    problems = _header_problems(path, header, columns, others)
    if problems:
        raise VidtrackError(*problems)
    if not rows:
        raise VidtrackError(f"{path}: has a header but no rows. Add a row for each {header[0]}.")
    answer: dict[str, list[Any]] = {n: [] for n in (*columns.texts, *columns.numbers) if n in header}
    seen: dict[tuple[str, ...], int] = {}
    for row, line in rows:
        if len(row) != len(header):
            problems.append(
                f"{path}, line {line}: {len(row)} cells where the header names {len(header)}. Mend the row."
            )
            continue
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        for name, column in answer.items():
            read = _number if name in columns.numbers else _text
            column.append(read(path, line, name, cells[name], name in columns.blanks, problems))
        problems += _repeated(path, line, cells, columns.unique, seen)
    if problems:
        more = [f"{path}: and {len(problems) - 10} more problems"] if len(problems) > 10 else []
        raise VidtrackError(*problems[:10], *more)
    answer["line"] = [line for _, line in rows]
    return answer


def _repeated(
    path: Path, line: int, cells: Mapping[str, str], unique: Sequence[str], seen: dict[tuple[str, ...], int]
) -> list[str]:
    key = tuple(cells[name] for name in unique)
    first = seen.setdefault(key, line)
    if not unique or first == line:
        return []
    name = ", ".join(f"{n} {k}" for n, k in zip(unique, key, strict=True))
    return [f"{path}, line {line}: {name} appears twice (also line {first}). Name each once."]


def _text(path: Path, line: int, name: str, cell: str, blank: bool, problems: list[str]) -> str:
    if not cell and not blank:
        problems.append(f"{path}, line {line}: {name} is empty. Fill it in or delete the row.")
    return cell


def _rows(path: Path) -> tuple[list[str], list[tuple[list[str], int]]]:
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            read = [(row, reader.line_num) for row in reader if any(cell.strip() for cell in row)]
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Put it there or correct its name.") from None
    except UnicodeDecodeError:
        raise VidtrackError(f"{path}: not a text file in UTF-8. Save it as CSV.") from None
    except csv.Error as error:
        raise VidtrackError(f"{path}: not CSV ({error}). Save it as CSV.") from None
    read = [(row, line) for row, line in read if not row[0].lstrip().startswith("#")]
    if not read:
        raise VidtrackError(f"{path}: empty. Write a header and a row for each entry.")
    return [cell.strip() for cell in read[0][0]], read[1:]


def _header_problems(path: Path, header: list[str], columns: Columns, others: str) -> list[str]:
    wanted = [*columns.texts, *columns.numbers]
    needed = [name for name in wanted if name not in columns.optional]
    unknown = [name for name in header if name not in wanted]
    missing = [name for name in needed if name not in header]
    problems = [
        f"{path}, line 1: column {name} appears twice. Keep one." for i, name in enumerate(header) if name in header[:i]
    ]
    for name in missing:
        near = did_you_mean(name, unknown)
        hint = f"; is it {near!r}?" if near else "."
        problems.append(f"{path}, line 1: no column {name}{hint} The header must name {','.join(needed)}.")
    if others == "forbid" and not missing:
        for name in unknown:
            near = did_you_mean(name, wanted)
            hint = f"; did you mean {near!r}?" if near else f". Known: {', '.join(wanted)}."
            problems.append(f"{path}, line 1: no such column as {name!r}{hint}")
    return problems


def _number(path: Path, line: int, name: str, cell: str, blank: bool, problems: list[str]) -> float:
    try:
        value = float(cell) if cell or not blank else math.nan
    except ValueError:
        value = math.inf
    if not (math.isfinite(value) or (blank and math.isnan(value))):
        problems.append(f"{path}, line {line}: {name} is {cell!r}, not a number. Write a number.")
    return value
