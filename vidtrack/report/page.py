"""A page of a report before it is written: a verdict, and sections of lines, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vidtrack.findings import Level


@dataclass(frozen=True)
class Table:
    """Rows under a header; the first column names the row. `about` explains it to a reader new to the method.

    keys   of the section that each row leads to; empty: rows lead nowhere
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    about: str = ""
    keys: Sequence[str] = ()

    @property
    def worded(self) -> list[bool]:
        """Of each column, whether it holds words, to be read from the left, and not numbers."""
        columns = zip(*self.rows, strict=True) if self.rows else [[name] for name in self.header]
        return [any(c[:1].isalpha() for c in cells) or set(cells) <= {"", "–"} for cells in columns]


@dataclass(frozen=True)
class Figure:
    """A picture, by the address of its data or as SVG, with what it shows.

    link   the address that the picture leads to: a film; empty: none
    live   what a browser draws in its place (`report.js`), as JSON; the picture stays for print and for no script
    svg    the picture itself; empty: it lies at its address
    """

    caption: str
    uri: str = ""
    live: str = ""
    link: str = ""
    svg: str = ""


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
class Reason:
    """Why a verdict is not good, or a note: about what (a section's key and title), how bad, what to do."""

    key: str
    about: str
    level: Level
    text: str
    cure: str


@dataclass(frozen=True)
class Verdict:
    """The first screen: the word for the whole, a line a run and a line a camera, and all reasons, worst first."""

    word: str
    line: str
    tables: Sequence[Table]
    reasons: Sequence[Reason]
    notes: Sequence[Reason]


@dataclass(frozen=True)
class Page:
    """One page of the report.

    verdict   None on a page on which nothing is judged
    links   the addresses of sections that another page has, by their keys
    nav     titles and addresses of other pages
    """

    title: str
    lead: Sequence[str]
    verdict: Verdict | None
    sections: Sequence[Section]
    footer: Sequence[str] = ()
    links: Mapping[str, str] = field(default_factory=dict)
    nav: Sequence[tuple[str, str]] = ()
