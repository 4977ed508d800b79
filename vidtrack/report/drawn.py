"""Drawings as figures of a page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from vidtrack.files.figure_files import data_uri
from vidtrack.report.page import Figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing


def drawn(captioned: Iterable[tuple[str, Drawing]]) -> list[Figure]:
    """Each drawing as a picture that lies inside the page, with its caption."""
    return [Figure(caption, data_uri(drawing)) for caption, drawing in captioned]
