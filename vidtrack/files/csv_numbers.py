"""Numbers as people and spreadsheets write them: which mark begins the decimals is decided for a whole file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", re.ASCII)
_DATE = re.compile(r"\d{1,4}[-./ ]+([^\W\d_]{3,9}\.?|\d{1,2}[-./ ]+\d{1,4})|[^\W\d_]{3,9}[-. ]+\d{1,4}")
_MANY_GROUPS = re.compile(r"[+-]?\d{1,3}(([,.' ])\d{3})(\2\d{3})*([.,]\d+)?", re.ASCII)
_WITH_UNIT = re.compile(r"([+-]?[\d.,]+)\s*([A-Za-zµμ°\"']{1,12})\.?")
_FEET_AND_INCHES = re.compile(
    r"[+-]?\d+\s*(?:['’′-]|ft\.?|feet)\s*-?\s*(?:\d+[.,]\d+|\d+[ -]\d+/\d+|\d+/\d+|\d+)\s*"
    r"(?:[\"”″]|''|in\.?|inch|inches)"
)
_CLOCK_TIME = re.compile(r"[\d:T Z+-]*\d,\d+([Zz]|[+-]\d\d:?\d\d)?", re.ASCII)
MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "none", "null", "-", "--", "---"})
"""What stands, in any case, for a value that is not there."""

_MINUS = dict.fromkeys(map(ord, "\u2212\u2012\u2013\ufe63\uff0d"), "-")
_EXCEL_ERRORS = ("#REF", "#VALUE", "#DIV", "#NAME", "#NULL", "#NUM")


class NumberStyle:
    """How the numbers of one file are written.

    comma       whether commas begin the decimals
    ambiguous   the cell that may be read in two ways, if there is one; no number of the file is then used
    """

    def __init__(self, cells: Iterable[str], separator: str) -> None:
        """Decide by all cells of the columns of numbers, and by what separates the cells of a line.

        Semicolons stand between cells where commas begin decimals. Elsewhere a comma is taken for the decimal mark if
        at least one cell can mean nothing else: 27,0159 and 0,125 can, 1,250 cannot. Where commas do not stand between
        cells, points may be what separates thousands: 1.250 beside 500 is then either.
        """
        cells = [plain_minus(cell) for cell in cells]
        commas = [cell for cell in cells if _COMMA.fullmatch(cell)]
        clear = [cell for cell in commas if not _GROUPED.fullmatch(cell)]
        pointed = [cell for cell in cells if "." in cell and _NUMBER.fullmatch(cell)]
        points = bool(pointed)
        whole = any(re.fullmatch(r"[+-]?[1-9]\d{0,2}", cell) for cell in cells)
        self.comma = bool(commas)
        trusted = bool(clear) or (separator == ";" and not whole)
        self.ambiguous = commas[0] if commas and (points or not trusted) else None
        self.reason = (
            "commas and points both begin decimals in this file"
            if points
            else "the comma may begin decimals or separate thousands"
        )
        if not commas and whole and separator != "," and pointed and all(_GROUPED.fullmatch(c) for c in pointed):
            self.ambiguous, self.reason = pointed[0], "the point may begin decimals or separate thousands"

    def is_ambiguous(self, cell: str) -> bool:
        """Whether this is the cell that may be read in two ways."""
        return plain_minus(cell) == self.ambiguous

    def number(self, cell: str) -> float | None:
        """The value of a cell, None where it is no number."""
        cell = plain_minus(cell)
        if self.comma and _COMMA.fullmatch(cell):
            cell = cell.replace(",", ".")
        value = float(cell) if _NUMBER.fullmatch(cell) else math.inf
        return value if math.isfinite(value) else None

    def time(self, cell: str) -> str:
        """A cell of times (seconds, time code or ISO) with a point before its decimals."""
        cell = plain_minus(cell) if cell[:1] not in "0123456789" else cell
        return cell.replace(",", ".") if _COMMA.fullmatch(cell) or _CLOCK_TIME.fullmatch(cell) else cell


def plain_minus(cell: str) -> str:
    """A cell whose first minus, and that of its exponent, is the one on the keyboard; typesetters have others."""
    return cell.translate(_MINUS)


def why_not_a_number(cell: str) -> str:
    """What is the matter with a cell that should be a number, and what to write; for a message that shows the cell."""
    cell = plain_minus(cell)
    if not cell:
        return "not a number. Write a number."
    if cell.upper().startswith(_EXCEL_ERRORS):
        return "not a number but an error of the spreadsheet. Correct the formula there and save again."
    if _MANY_GROUPS.fullmatch(cell):
        return "not a number: it has marks between thousands. Write it without them."
    if _DATE.fullmatch(cell):
        return "a date, which a spreadsheet may have made of a number. Correct the cell there, as text."
    if _FEET_AND_INCHES.fullmatch(cell):
        return "in feet and inches. Write it in one unit with decimals, as a number alone."
    with_unit = _WITH_UNIT.fullmatch(cell)
    if with_unit and cell.casefold() != "nan":
        return f"not a number alone. Write {with_unit[1]}, and the unit in the header if it is wanted there."
    if re.fullmatch(r"#+", cell):
        return "not a number: the spreadsheet's column was too narrow. Widen it there and save again."
    return "not a number. Write a number."
