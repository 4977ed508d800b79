"""The page of an experiment: which sections, tables and figures it shows, and in which order. The verdict is first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vidtrack.figures import search_map
from vidtrack.figures.style import camera_colours
from vidtrack.files.figure_files import data_uri, file_uri
from vidtrack.report import calibration_sections as calibration
from vidtrack.report import run_sections
from vidtrack.report.numbers import number, one_over
from vidtrack.report.page import Figure, Page, Section
from vidtrack.report.run_figures import run_figures
from vidtrack.report.verdict_section import verdict_section
from vidtrack.results import CameraResults, Results, RunResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

Record = Mapping[str, Any]

FEWEST = 9
"""Places of a search for the optical axis below which its map shows nothing."""


def experiment_page(
    results: Results, *, units: str, cameras: Sequence[str], runs: Sequence[str], title: str, provenance: Record
) -> Page:
    """Compose the page.

    cameras   all cameras of the config, in its order: each has one colour throughout
    runs      all runs of the experiment, in their order
    provenance   of the page: vidtrack, commit, libraries
    """
    colours = camera_colours(cameras)
    sections = []
    if results.cameras or _judged_cameras(results):
        sections.append(Section("calibration", "Calibration", sections=_calibration(results, units)))
    if runs:
        known = {name: results.runs.get(name, RunResults()) for name in runs}
        each = [
            run_sections.run_section(name, own, units, _drawn(run_figures(name, results, colours, units)))
            for name, own in known.items()
        ]
        sections.append(Section("runs", "Runs", tables=[run_sections.runs_table(known, units)], sections=each))
    lead, verdict = _lead(results.back, runs, units), verdict_section(results, units)
    return Page(title, lead, verdict, sections, _footer(provenance, units))


def _footer(provenance: Record, units: str) -> tuple[str, ...]:
    """Units, and by which program the page was made; settings and checksums are in each file that it was made of."""
    made = [f"vidtrack {provenance.get('vidtrack', '')}"]
    if provenance.get("commit"):
        made.append(f"commit {str(provenance['commit'])[:12]}")
    made += [f"{name} {version}" for name, version in (provenance.get("libraries") or {}).items()]
    return (
        f"The unit of length is {units} unless said otherwise; px are frame buffer pixels.",
        f"Made by {', '.join(made)}. Settings and the checksums of what people recorded and wrote stand under "
        "`provenance` in every file of results/.",
    )


def _calibration(results: Results, units: str) -> list[Section]:
    parts = [calibration.accuracy_section(results.back, units)] if results.back and "n_points" in results.back else []
    cameras = {**dict.fromkeys(_judged_cameras(results), CameraResults()), **results.cameras}
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


def _judged_cameras(results: Results) -> list[str]:
    """The cameras of which the verdict speaks, those whose calibration failed included."""
    return list(((results.verdict or {}).get("calibration") or {}).get("cameras") or {})


def _pictures(name: str, own: CameraResults) -> list[Figure]:
    """The overlay, and the map of the search for the optical axis where enough of it was searched."""
    figures = []
    if own.overlay:
        caption = "Measured (+), projected from the survey (circle), located and then projected (cross)"
        figures.append(Figure(caption, file_uri(own.overlay)))
    if own.record and own.search is not None and own.search["rms_px"].notna().sum() >= FEWEST:
        drawn = search_map.search_map(own.search, own.record["Cx"], own.record["Cy"], name)
        caption = "Reprojection error over the search for the optical axis: where it is least, and how flat it is there"
        figures += _drawn([(caption, drawn)])
    return figures


def _drawn(captioned: Iterable[tuple[str, Drawing]]) -> list[Figure]:
    return [Figure(caption, data_uri(drawing)) for caption, drawing in captioned]


def _lead(back: Record | None, runs: Sequence[str], units: str) -> tuple[str, ...]:
    lines = []
    if back and "n_points" in back:
        mean, field = (back.get("held_out") or {}).get("mean_3d"), back.get("diagonal_field")
        survey = (back.get("floor") or {}).get("mean_3d_with_survey")
        ratio = f", {one_over(mean / field)} of the diagonal field" if mean and field else ""
        due = (
            f"; the survey's tolerance and the centroid noise alone make {number(survey, 2)} {units}" if survey else ""
        )
        lines.append(
            f"{len(back.get('cameras') or ())} cameras calibrated from {back['n_points']} points. Points held out of "
            f"the calibration are located to {number(mean, 2)} {units} of their survey on average{ratio}{due}."
        )
    if runs:
        lines.append(f"{len(runs)} run{'s' if len(runs) > 1 else ''}: {', '.join(runs)}.")
    return tuple(lines)
