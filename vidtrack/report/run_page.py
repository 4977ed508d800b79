"""The page of one run: its verdict with the reasons, its tables and its figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from vidtrack.figures.style import camera_colours
from vidtrack.files.figure_files import file_uri
from vidtrack.report import run_sections
from vidtrack.report.addresses import INDEX, addresses
from vidtrack.report.drawn import drawn
from vidtrack.report.footer import footer
from vidtrack.report.page import Figure, Page
from vidtrack.report.provenance_section import provenance_section
from vidtrack.report.run_figures import run_figures
from vidtrack.report.run_summary import run_uncertainty
from vidtrack.report.uncertainty_sections import uncertainty_tables
from vidtrack.report.verdict_section import run_verdict
from vidtrack.results import Results, RunResults

Record = Mapping[str, Any]


def run_page(
    name: str, results: Results, *, units: str, cameras: Sequence[str], title: str, provenance: Record
) -> Page:
    """Compose the page.

    results   of the run, with the calibration that it uses, and the verdict on both
    cameras   all cameras of the config, by name: each has one colour throughout
    """
    own = results.runs.get(name, RunResults())
    figures = [*posters(name, own), *drawn(run_figures(name, results, camera_colours(cameras), units))]
    stated = uncertainty_tables(run_uncertainty(name, results), units)
    section = run_sections.run_section(name, own, units, figures, stated)
    calibration = bool(results.cameras)
    links = addresses([], results.cameras, calibration=calibration)
    nav = [("Overview", f"../{INDEX}")] + ([("Calibration", links["calibration"])] if calibration else [])
    verdict = run_verdict(name, results, units)
    records = [*own.readings.items(), *(("", record) for record in own.records.values())]
    made = provenance_section(records, units)
    sections = [section, *([made] if made else [])]
    return Page(f"{title}: {name}", (), verdict, sections, footer(provenance, units), links, nav)


def posters(name: str, own: RunResults) -> list[Figure]:
    """A picture of each overlay film, which leads to it."""
    return [
        Figure(
            f"the recording of {camera}: boxes, centroids (+), trails, and the located points projected back (circles)",
            file_uri(poster),
            link=f"../runs/{quote(name)}/overlay_{quote(camera)}.mp4",
        )
        for camera, poster in own.posters.items()
    ]
