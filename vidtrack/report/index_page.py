"""The first page of a report: the verdict, a line a run and a line a camera, and links to the other pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.report import run_sections
from vidtrack.report.addresses import CAMPAIGN, FOLDER, addresses
from vidtrack.report.footer import footer
from vidtrack.report.numbers import number, one_over
from vidtrack.report.page import Page, Section
from vidtrack.report.provenance_section import provenance_section
from vidtrack.report.verdict_section import judged_cameras, verdict_section
from vidtrack.results import Results

Record = Mapping[str, Any]


def index_page(results: Results, *, units: str, runs: Sequence[str], title: str, provenance: Record) -> Page:
    """Compose the page; of the runs it needs their summaries alone, and links to the pages that there are.

    runs         all runs of the experiment, in their order
    provenance   of the page: vidtrack, commit, libraries
    """
    known = [name for name in runs if name in results.summaries]
    cameras = {**dict.fromkeys(judged_cameras(results)), **results.cameras}
    links = addresses(known, cameras, calibration=results.calibration_page, folder=f"{FOLDER}/")
    sections = []
    if known:
        table = run_sections.runs_table([results.summaries[name] for name in known], units)
        sections.append(Section("runs", "Runs", tables=[table]))
    lead, verdict = _lead(results.back, runs, units), verdict_section(results, units)
    if made := provenance_section([("", {"provenance": provenance})], units):
        sections.append(made)
    nav = [("Calibration", links["calibration"])] if results.calibration_page else []
    nav += [("Campaign", f"{FOLDER}/{CAMPAIGN}")] if results.campaign_page else []
    return Page(title, lead, verdict, sections, footer(provenance, units), links, nav)


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
        some = ", ".join(runs[:12]) + (" and more" if len(runs) > 12 else "")
        lines.append(f"{len(runs)} run{'s' if len(runs) > 1 else ''}: {some}.")
    return tuple(lines)
