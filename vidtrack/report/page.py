"""A page of a report before it is drawn: sections of lines, tables and figures, and what a reader must not overlook."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Table:
    """Rows under a header; the first column names the row."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def worded(self) -> list[bool]:
        """Of each column, whether it holds words, to be read from the left, and not numbers."""
        columns = zip(*self.rows, strict=True) if self.rows else [[name] for name in self.header]
        return [any(cell[:1].isalpha() for cell in cells) for cells in columns]


@dataclass(frozen=True)
class Figure:
    """A picture by the address of its data, with what it shows."""

    caption: str
    uri: str


@dataclass(frozen=True)
class Section:
    """A part of the page; `key` is its address within the page."""

    key: str
    title: str
    lines: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Figure] = ()
    sections: Sequence[Section] = ()


@dataclass(frozen=True)
class Page:
    """The whole report."""

    title: str
    lead: Sequence[str]
    warnings: Sequence[str]
    sections: Sequence[Section]
    footer: Sequence[str] = field(default=())


def number(value: Any, digits: int = 4) -> str:
    """A number to so many significant digits, without needless zeros; a dash for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if isinstance(value, int):
        return str(value)
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, power = text.split("e")
        return f"{mantissa}·10{_superscript(int(power))}"
    return text


def interval(low: Any, high: Any) -> str:
    """Both ends of an interval, to two figures of its width: 0.2 and 0.2003 are 0.20000 to 0.20030."""
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return "–"
    decimals = max(0, 1 - math.floor(math.log10(high - low))) if high > low else 4
    return f"{low:.{decimals}f} to {high:.{decimals}f}"


def share(value: Any, digits: int = 2) -> str:
    """A part of one as a percentage."""
    return "–" if value is None or not math.isfinite(value) else f"{100 * value:.{digits}g} %"


def one_over(part: Any) -> str:
    """A small share as 1/N, N to three digits: 0.000335 is 1/2 990; a dash for what is missing."""
    if part is None or not math.isfinite(part) or part <= 0:
        return "–"
    n = 1 / part
    return f"1/{round(n, 2 - math.floor(math.log10(n))):,.0f}".replace(",", " ")


def pick(record: Mapping[str, Any], *path: str) -> Any:
    """What lies at a path in a nested record; None where the path ends early."""
    value: Any = record
    for part in path:
        if not isinstance(value, Mapping):
            return None
        value = value.get(part)
    return value


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
