"""The page of the calibration: its verdict, how well points are located, and each camera."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.figures import search_map
from vidtrack.files.figure_files import file_uri
from vidtrack.report import calibration_sections as calibration
from vidtrack.report.addresses import INDEX
from vidtrack.report.drawn import Chart, drawn
from vidtrack.report.footer import footer
from vidtrack.report.page import Figure, Page, Section
from vidtrack.report.verdict_section import calibration_verdict, judged_cameras
from vidtrack.results import CameraResults, Results

Record = Mapping[str, Any]

FEWEST = 9
"""Places of a search for the optical axis below which its map shows nothing."""


def calibration_page(results: Results, *, units: str, title: str, provenance: Record) -> Page:
    """Compose the page; results: of the calibration, with the verdict on it."""
    whole = Section("calibration", "Calibration", sections=_calibration(results, units))
    verdict, nav = calibration_verdict(results), [("Overview", f"../{INDEX}")]
    return Page(f"{title}: calibration", (), verdict, [whole], footer(provenance, units), {}, nav)


def _calibration(results: Results, units: str) -> list[Section]:
    parts = [calibration.accuracy_section(results.back, units)] if results.back and "n_points" in results.back else []
    cameras = {**dict.fromkeys(judged_cameras(results), CameraResults()), **results.cameras}
    for name, own in cameras.items():
        if own.record is None or "f" not in own.record:
            parts.append(Section(f"camera-{name}", name, ["This camera was not calibrated: see the verdict."]))
        else:
            rows = own.points.to_dict("records") if own.points is not None else []
            labelling = own.labelling or {}
            parts.append(calibration.camera_section(own.record, rows, labelling, units, _pictures(name, own)))  # type: ignore[arg-type]
    if results.stability is not None:
        parts.append(calibration.stability_section(results.stability, units))
    return parts


def _pictures(name: str, own: CameraResults) -> list[Figure]:
    """The overlay, and the map of the search for the optical axis where enough of it was searched."""
    figures = []
    if own.overlay:
        caption = "Measured (+), projected from the survey (circle), located and then projected (cross)"
        figures.append(Figure(caption, file_uri(own.overlay)))
    if own.record and own.search is not None and own.search["rms_px"].notna().sum() >= FEWEST:
        chart = search_map.search_map(own.search, own.record["Cx"], own.record["Cy"], name)
        caption = "Reprojection error over the search for the optical axis: where it is least, and how flat it is there"
        figures += drawn([Chart(caption, chart)])
    return figures
