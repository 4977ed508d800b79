"""Job report: everything that the other rules made in, one page out."""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures import bodies, comparison, search_map, tracking, trajectories, waterline
from vidtrack.figures.style import camera_colours
from vidtrack.files.figure_files import data_uri, file_uri
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.files.timestack_file import read_timestacks
from vidtrack.report import story as stage
from vidtrack.report.page import Figure, Page, Section
from vidtrack.report.page_file import write_page
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing
    from pandas import DataFrame


def run(job: Job) -> None:
    """Inputs: see workflow/rules/report.smk; output report."""
    story = stage.report(
        cameras={record["camera"]: record for record in map(read_json, job.paths("cameras"))},
        points={_folder(path): read_parquet(path) for path in job.paths("points")},
        labellings={_folder(path): read_json(path) for path in job.paths("labellings")},
        back=next((read_json(p) for p in job.paths("backprojection") if p.endswith(".json")), None),
        stability=next(map(read_json, job.paths("stability")), None),
        runs=_runs(job),
        units=job.settings["units"],
        title=job.settings["title"],
        version=job.provenance["vidtrack"],
    )
    sections = _with(story.sections, dict(_figures(job, story)))
    write_page(job.outputs["report"], Page(story.title, story.lead, story.warnings, sections, story.footer))


def _folder(path: str) -> str:
    return os.path.basename(os.path.dirname(path))


def _runs(job: Job) -> dict[str, dict[str, Any]]:
    """What is known of each run, by name."""
    runs: dict[str, dict[str, Any]] = {name: {"readings": {}} for name in job.settings["runs"]}
    for path in job.paths("readings"):
        record = read_json(path)
        runs[record["run"]]["readings"][record["camera"]] = record
    for key in ("trajectories", "kinematics", "bodies"):
        for path in job.paths(key):
            runs[_folder(path)][key] = read_parquet(path)
    for path in job.paths("locations"):
        runs[_folder(path)]["locate"] = read_json(path)
    for path in job.paths("comparisons"):
        key = "comparison" if path.endswith(".json") else "series"
        runs[_folder(path)][key] = read_json(path) if path.endswith(".json") else read_parquet(path)
    for path in job.paths("waterlines"):
        if path.endswith(".parquet"):
            runs[_folder(path)]["waterline"] = read_parquet(path)
        else:
            runs[_folder(path)]["timestack"] = read_timestacks(path)
    return runs


def _figures(job: Job, story: stage.Story) -> Iterator[tuple[str, list[Figure]]]:
    """The figures of each section, by the section's key."""
    units, colours = job.settings["units"], camera_colours(list(job.settings["cameras"]))
    searches = {_folder(path): path for path in job.paths("searches")}
    cameras = {record["camera"]: record for record in map(read_json, job.paths("cameras"))}
    for path in job.paths("overlays"):
        camera = os.path.basename(path)[len("overlay_") : -len(".png")]
        caption = "Measured (+), projected from the survey (circle), located and then projected (cross)"
        yield f"camera-{camera}", [Figure(caption, file_uri(path)), *_map(camera, searches[camera], cameras[camera])]
    points = [read_parquet(path) for path in job.paths("points")]
    centroids = _centroids(job)
    for name, own in story.runs.items():
        yield f"run-{name}", _run_figures(name, own, centroids.get(name, {}), points, colours, units)


def _map(camera: str, path: str, record: dict[str, Any]) -> list[Figure]:
    search = read_parquet(path)
    if search["rms_px"].notna().sum() < 9:
        return []
    drawn = search_map.search_map(search, record["Cx"], record["Cy"], camera)
    return [Figure("Where the least error lies, and how flat it is about it", data_uri(drawn))]


def _centroids(job: Job) -> dict[str, dict[str, DataFrame]]:
    found: dict[str, dict[str, Any]] = {}
    for path in job.paths("centroids"):
        run = os.path.basename(os.path.dirname(os.path.dirname(path)))
        camera = os.path.splitext(os.path.basename(path))[0]
        found.setdefault(run, {})[camera] = read_parquet(path)
    return found


def _run_figures(
    name: str,
    own: dict[str, Any],
    centroids: dict[str, DataFrame],
    points: list[DataFrame],
    colours: dict[str, str],
    units: str,
) -> list[Figure]:
    figures: list[Figure] = []

    def add(caption: str, drawing: Drawing) -> None:
        figures.append(Figure(caption, data_uri(drawing)))

    if "waterline" in own:
        add("Timestack and the water's edge", waterline.timestacks(own["waterline"], own["timestack"], units))
    if "trajectories" not in own:
        return figures
    table = own["trajectories"]
    if table["x"].notna().any():
        add("Position against time; two standard deviations shaded", trajectories.against_time(table, units, name))
        survey = points[0] if points and own["locate"].get("mode") == "space" else None
        add("From above and from the side, amid the calibration points", trajectories.views(table, units, name, survey))
    if "series" in own and own["comparison"].get("lag_s") is not None:
        for caption, drawing in comparison.comparisons(own["series"], own["comparison"], units):
            add(caption, drawing)
    if own["kinematics"]["vx"].notna().any():
        caption = "Velocity and acceleration; dotted where unsure (flag edge), as at the ends of the record and of gaps"
        add(caption, trajectories.derivatives(own["kinematics"], units, name))
    if "bodies" in own:
        add("Six degrees of freedom", bodies.six_degrees(own["bodies"], units, name))
    if any(c.get("offsets_s") for c in (own["locate"].get("clocks") or {}).get("cameras", {}).values()):
        add("Which clock offset fits the motion", tracking.clock_search(own["locate"]["clocks"]["cameras"], colours))
    add("Tracks in each picture", tracking.tracks(centroids, colours, name))
    caption = "Pixel locking: flat is good where targets move; one at rest makes a peak"
    add(caption, tracking.pixel_locking(own["readings"], colours))
    for camera, record in own["readings"].items():
        if record["worst"]:
            add("The moments that went worst", tracking.worst_moments(_unpacked(record["worst"]), camera))
    return figures


def _unpacked(worst: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The pictures of the worst moments as arrays again."""
    import cv2

    def picture(text: str) -> Any:
        data = np.frombuffer(base64.b64decode(text.rsplit(",", 1)[-1]), np.uint8)
        return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)

    return [{**moment, "picture": picture(moment["picture"])} for moment in worst]


def _with(sections: tuple[Section, ...], figures: dict[str, list[Figure]]) -> tuple[Section, ...]:
    """The sections, each with the figures that bear its key."""
    return tuple(
        Section(
            s.key,
            s.title,
            s.lines,
            s.tables,
            (*s.figures, *figures.get(s.key, ())),
            _with(tuple(s.sections), figures),
        )
        for s in sections
    )
