"""The page of the calibration: its verdict, how well points are located, and each camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vidtrack.figures import search_map, showcalb, space
from vidtrack.figures.style import camera_colours
from vidtrack.files.figure_files import file_uri
from vidtrack.files.records import read_png
from vidtrack.geometry.camera import project
from vidtrack.report import calibration_sections as calibration
from vidtrack.report.addresses import INDEX
from vidtrack.report.drawn import Chart, drawn
from vidtrack.report.footer import footer
from vidtrack.report.page import Figure, Page, Section
from vidtrack.report.provenance_section import provenance_section
from vidtrack.report.space_view import as_json, camera_of, space_view
from vidtrack.report.verdict_section import calibration_verdict, judged_cameras
from vidtrack.report.ways_sections import body_section, wand_section
from vidtrack.results import CameraResults, Results

if TYPE_CHECKING:
    from pandas import DataFrame

Record = Mapping[str, Any]

FEWEST = 9
"""Places of a search for the optical axis below which its map shows nothing."""


def calibration_page(results: Results, *, units: str, cameras: Sequence[str], title: str, provenance: Record) -> Page:
    """Compose the page.

    results   of the calibration, with the verdict on it
    cameras   all cameras of the config, by name: each has one colour throughout
    """
    rig = _rig(results, camera_colours(cameras), units)
    whole = Section("calibration", "Calibration", figures=rig, sections=_calibration(results, units))
    verdict, nav = calibration_verdict(results), [("Overview", f"../{INDEX}")]
    records = [(name, record) for name, own in results.cameras.items() for record in (own.record, own.labelling)]
    made = provenance_section([*records, ("", results.survey), ("", results.back)], units)
    sections = [whole, *([made] if made else [])]
    return Page(f"{title}: calibration", (), verdict, sections, footer(provenance, units), {}, nav)


def _rig(results: Results, colours: Mapping[str, str], units: str) -> list[Figure]:
    """The cameras and the survey in space."""
    view = space_view(results, None, colours, units)
    if not view["cameras"] or not view["points"]:
        return []
    caption = "Cameras with a third of their view, the survey and the calibrated volume, at equal scales"
    return drawn([Chart(caption, space.space(view, "the rig"), as_json(view))])


def _calibration(results: Results, units: str) -> list[Section]:
    parts = [calibration.accuracy_section(results.back, units)] if results.back and "n_points" in results.back else []
    parts += [wand_section(results.wand, units)] if results.wand and "moments" in results.wand else []
    parts += [body_section(results.by_body, units)] if results.by_body and "moments" in results.by_body else []
    cameras = {**dict.fromkeys(judged_cameras(results), CameraResults()), **results.cameras}
    for name, own in cameras.items():
        if own.record is None or "f" not in own.record:
            parts.append(Section(f"camera-{name}", name, ["This camera was not calibrated: see the verdict."]))
        else:
            rows = own.points.to_dict("records") if own.points is not None else []
            labelling = own.labelling or {}
            parts.append(calibration.camera_section(own.record, rows, labelling, units, _pictures(name, results)))  # type: ignore[arg-type]
    if results.stability is not None:
        parts.append(calibration.stability_section(results.stability, units))
    return parts


def _pictures(name: str, results: Results) -> list[Figure]:
    """The overlay, the pictures of showcalb, and the map of the search for the optical axis if enough was searched."""
    own, figures = results.cameras[name], []
    if own.overlay:
        caption = "Measured (+), projected from the survey (circle), located and then projected (cross)"
        figures.append(Figure(caption, file_uri(own.overlay)))
    if own.record and own.picture and results.back_table is not None:
        figures += drawn([_showcalb(name, own.record, own.picture, results.back_table)])
    if own.record and own.search is not None and own.search["rms_px"].notna().sum() >= FEWEST:
        chart = search_map.search_map(own.search, own.record["Cx"], own.record["Cy"], name)
        caption = "Reprojection error over the search for the optical axis: where it is least, and how flat it is there"
        figures += drawn([Chart(caption, chart)])
    return figures


def _showcalb(name: str, record: Record, picture: str, table: DataFrame) -> Chart:
    rows = table[table["camera"] == name].drop_duplicates(["tag", "Xf", "Yf"])
    located = rows[["x_located", "y_located", "z_located"]].to_numpy(float)
    without_lens = project(camera_of(record).without_lens(), located)
    caption = (
        "Calibration points in the picture: measured; projected from the survey, with and without distortion; "
        "located by all cameras and then projected, with and without it; and residuals magnified, the worst named"
    )
    return Chart(caption, showcalb.showcalb(read_png(picture), rows, without_lens, name))
