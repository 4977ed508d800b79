"""Comma-separated tables of other programs: a header, then numbers; quickly, and with the reader of last resort "
"for the odd."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import MISSING, Path, number, short


class Table(NamedTuple):
    """A table: names of its columns, and its cells as text, rows by columns; line of its first row in the file."""

    header: list[str]
    text: str
    separator: str
    line: int


def separator_of(line: str) -> str:
    """What separates the cells of a header."""
    return max((",", ";", "\t"), key=line.count) if any(mark in line for mark in ",;\t") else " "


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of one line."""
    if separator == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:  # a cell of more than 131,072 letters
        return [cell.strip() for cell in line.split(separator)]


def split(text: str, heads: int = 1) -> tuple[list[list[str]], Table]:
    """The first `heads` lines that hold anything, as cells, and the table below them; blank lines before them "
    "are left out."""
    at, line = 0, 1
    rows: list[list[str]] = []
    separator = ","
    while at < len(text) and len(rows) < heads:
        end = text.find("\n", at)
        head = text[at:] if end < 0 else text[at:end]
        if re.fullmatch(r"sep=.?", head.strip(), re.IGNORECASE):  # which separator follows, said to Excel
            pass
        elif head.strip():
            separator = separator if rows else separator_of(head)
            rows.append(cells_of(head, separator))
        at, line = (len(text) if end < 0 else end + 1), line + 1
    return rows, Table(rows[-1] if rows else [], text[at:], separator, line)


def numbers_of(path: Path, table: Table, columns: Sequence[int], *, width: int | None = None) -> Array:
    """The numbers (rows, len(columns)) of some columns; missing values are NaN.

    width  how many cells a row must have; None: as many as the header
    VidtrackError, naming the line, for a cell that is no number and for a row that is too short.
    """
    import pandas as pd

    width = len(table.header) if width is None else width
    if not table.text or table.text.isspace():
        raise VidtrackError(f"{path}: no rows below the header. Export it again.")
    content = table.text.encode()
    try:
        if table.separator == " " or (table.separator == ";" and "," in table.text):
            raise ValueError("spaces, or commas that begin decimals")
        if _ragged(content, table.separator, width):
            raise ValueError("rows of other lengths")
        frame = pd.read_csv(
            io.BytesIO(content),
            sep=table.separator,
            header=None,
            names=range(width),
            usecols=list(columns),
            dtype=float,
            na_values=sorted({word for word in MISSING if word} | {"NaN", "nan", "NAN"}),
            skip_blank_lines=True,
            engine="c",
            index_col=False,
        )
        values = frame[list(columns)].to_numpy(float)
        return np.where(np.isfinite(values), values, np.nan)
    except (ValueError, pd.errors.ParserError):
        return _one_by_one(path, table, columns, width)


def _ragged(content: bytes, separator: str, width: int) -> bool:
    """Whether a row may have another number of cells: it breaks off, or its decimals have commas as its cells have.

    A separator at the end of every row is none between cells. Blank rows count as others; rows are then read one by
    one.
    """
    whole = np.frombuffer(content, np.uint8)
    data = whole[: len(content) - len(content[-1000:]) + len(content[-1000:].rstrip())]
    ends = np.append(np.flatnonzero(data == ord("\n")), len(data))
    between = np.diff(np.searchsorted(np.flatnonzero(data == ord(separator)), ends), prepend=0)
    return not ((between == width - 1).all() or ((between == width).all() and (data[ends - 1] == ord(separator)).all()))


def _one_by_one(path: Path, table: Table, columns: Sequence[int], width: int) -> Array:
    rows = []
    for i, line in enumerate(table.text.split("\n")):
        if not line.strip():
            continue
        cells = cells_of(line, table.separator)
        if len(cells) < width:
            raise VidtrackError(
                f"{path}, line {table.line + i}: {len(cells)} cells where the header has {width}. Copy the whole "
                "file again."
            )
        if len(cells) > width and any(cells[width:]):
            raise VidtrackError(
                f"{path}, line {table.line + i}: {len(cells)} cells where the header has {width}. Write decimals "
                "with a "
                "point, or separate cells by semicolons."
            )
        values = [number(cells[k]) for k in columns]
        if None in values:
            bad = columns[values.index(None)]
            raise VidtrackError(
                f"{path}, line {table.line + i}: {short(cells[bad])} in column {bad + 1} is no number. Write one there."
            )
        rows.append(values)
    if not rows:
        raise VidtrackError(f"{path}: no rows below the header. Export it again.")
    return np.array(rows, float)
