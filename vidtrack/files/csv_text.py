"""A CSV file as programs and people save it: its encoding, its separator and its rows, each cell with its place."""

from __future__ import annotations

import codecs
import csv
import io
import os
import re
from collections.abc import Sequence
from typing import NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_header import column_of
from vidtrack.naming import in_one_form

Path = str | os.PathLike[str]

LONGEST_CELL = 1000
"""Characters. A name or a number is shorter; a longer cell comes from a quotation mark that was never closed."""

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_WORKBOOKS = {
    b"PK\x03\x04": "an Excel or LibreOffice workbook (or a zip file)",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook",
}
_AS_TEXT = re.compile(r'="(.*)"')


class Row(NamedTuple):
    """One line of a CSV file.

    cells    without the spaces around them; empty ones at the end of the line are left out
    width    how many cells the line has, empty ones at its end included
    line     counted from 1 in the file
    marked   whether the line begins with # outside quotation marks: a comment, or a tag such as #1
    """

    cells: list[str]
    width: int
    line: int
    marked: bool


class CsvText(NamedTuple):
    """A CSV file taken apart. rows: those that hold anything, comments among them; separator: what is between cells."""

    rows: list[Row]
    separator: str


def read_bytes(path: Path) -> bytes:
    """The content of a file that a user put there; VidtrackError where it is not there or may not be read."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise VidtrackError(f"{path}: no file but a folder, a pipe or a device. Put the file itself there.")
    try:
        with open(path, "rb") as file:
            return file.read()
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Put it there or correct its name.") from None
    except OSError as error:
        raise VidtrackError(f"{path}: cannot be read ({error.strerror}). Correct its permissions.") from None


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16, UTF-32 or Windows' ANSI code; VidtrackError where it is no text."""
    data = read_bytes(path)
    for magic, what in _WORKBOOKS.items():
        if data.startswith(magic):
            raise VidtrackError(f"{path}: {what}, not CSV. Open it and save the sheet as CSV.")
    text = _decoded(data)
    if text is None:
        raise VidtrackError(
            f"{path}: not a text file (neither UTF-8, UTF-16 nor Windows' ANSI). Save it as CSV in UTF-8."
        )
    return text


def split_rows(path: Path, text: str, names: Sequence[str]) -> CsvText:
    """The rows of a CSV file's text; VidtrackError for a quotation mark that is not closed or a cell that is too long.

    names   the columns that are sought: the separator is the one that shows most of them in a line
    A line `sep=;` names the separator, as Excel writes and reads it.
    """
    stated = re.match(r'\s*"?sep=(.)"?[ \t]*(\r\n|\r|\n|$)', text, re.IGNORECASE)
    skipped = 0
    if stated:
        text, skipped = text[stated.end() :], 1
    separator = stated[1] if stated else _separator(text, names)
    rows = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True, skipinitialspace=True)
    begins = _beginnings(text)
    line = 1
    try:
        for cells in reader:
            _refuse_long_cells(path, cells, line + skipped)
            width, cells = len(cells), [clean(cell) for cell in cells]
            while cells and not cells[-1]:
                cells.pop()
            if any(cells):
                rows.append(Row(cells, width, line + skipped, begins[line - 1].startswith("#")))
            line = reader.line_num + 1
    except csv.Error as error:
        problem = str(error)
        if "field limit" in problem:
            problem = f"a cell of more than {csv.field_size_limit()} characters"
        elif "unexpected end" in problem:
            problem = "a quotation mark is not closed"
        raise VidtrackError(
            f"{path}, line {line + skipped}: not CSV ({problem}). Correct that line, or save the sheet as CSV again."
        ) from None
    return CsvText(rows, separator)


def clean(cell: str) -> str:
    """A cell in one form, without the spaces around it; Excel's `="01"` is 01."""
    cell = in_one_form(cell)
    as_text = _AS_TEXT.fullmatch(cell)
    return as_text[1] if as_text else cell


def short(cell: str) -> str:
    """A cell as a message shows it: in quotation marks, and never long."""
    text = repr(cell[:200])
    return text if len(text) <= 60 else f"{text[:57]}..."


def _decoded(data: bytes) -> str | None:
    encodings = [(encoding, len(mark)) for mark, encoding in _MARKS if data.startswith(mark)][:1]
    if not encodings and data[:400].count(0) * 3 > len(data[:400]):  # UTF-16 without its mark: every other byte is 0
        encodings = [("utf-16-le" if data[1:2] == b"\0" else "utf-16-be", 0)]
    for encoding, mark in encodings or [("utf-8", 0), ("cp1252", 0)]:
        try:
            text = data[mark:].decode(encoding).rstrip("\x1a")  # DOS ends a text file so
        except UnicodeDecodeError:
            continue
        if not re.search(r"[\x00-\x08\x0e-\x1f\x7f]", text):
            return text
    return None


def _beginnings(text: str) -> list[str]:
    return [line.lstrip(" \t\ufeff")[:1] for line in io.StringIO(text, newline="")]


def _refuse_long_cells(path: Path, cells: Sequence[str], line: int) -> None:
    for column, cell in enumerate(cells):
        if len(cell) > LONGEST_CELL:
            raise VidtrackError(
                f"{path}, line {line}, column {column + 1}: a cell of {len(cell)} characters, which begins "
                f"{short(cell)}. Correct the cell; it may lack a quotation mark."
            )


def _separator(text: str, names: Sequence[str]) -> str:
    """The separator that shows most of the names in one of the first lines; else what the first line has most of."""
    lines = [line[:50_000] for line in re.split(r"\r\n|\r|\n", text[:200_000])[:50]]
    best, most = "", 0
    for separator in SEPARATORS:
        for line in lines:
            cells = [clean(cell.strip(' "#')) for cell in line.split(separator)]
            found = len({name for cell in cells[:1000] if (name := column_of(cell, names)[0])})
            if found > most:
                best, most = separator, found
    if best:
        return best
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    return max(SEPARATORS, key=first.count)
