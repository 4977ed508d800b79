"""Drawings as figures of a page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from vidtrack.files.figure_files import data_uri
from vidtrack.report.page import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing


class Chart(NamedTuple):
    """A drawing with its caption; live: what a browser draws in its place, as JSON."""

    caption: str
    drawing: Drawing
    live: str = ""


def drawn(charts: Iterable[Chart]) -> list[Figure]:
    """Each drawing as a picture that lies inside the page."""
    return [Figure(chart.caption, data_uri(chart.drawing), chart.live) for chart in charts]
