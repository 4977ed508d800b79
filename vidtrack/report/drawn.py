"""Drawings as figures of a page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from vidtrack.figures.drawing import Drawing
from vidtrack.figures.svg import svg
from vidtrack.files.figure_files import data_uri
from vidtrack.report.page import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot


class Chart(NamedTuple):
    """A drawing with its caption; live: what a browser draws in its place, as JSON."""

    caption: str
    drawing: Drawing | Plot
    live: str = ""


def drawn(charts: Iterable[Chart]) -> list[Figure]:
    """Each drawing as a picture that lies inside the page: SVG, or a PNG by its address."""
    return [_drawn(*chart) for chart in charts]


def _drawn(caption: str, drawing: Drawing | Plot, live: str) -> Figure:
    if isinstance(drawing, Drawing):
        return Figure(caption, "", live, svg=svg(drawing, caption))
    return Figure(caption, data_uri(drawing), live)
