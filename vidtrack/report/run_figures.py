"""Which figures a run's section shows, in their order: each only where there is something to be seen in it."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures import analysis, bodies, comparison, motions, space, tracking, trajectories, waterline
from vidtrack.files.records import read_png
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.report import live
from vidtrack.report.drawn import Chart
from vidtrack.report.space_view import as_json, space_view
from vidtrack.results import Results, RunResults

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_CYCLES = 6
"""Motions whose mean cycle is shown."""


def run_figures(name: str, results: Results, colours: Mapping[str, str], units: str) -> Iterator[Chart]:
    """The figures of one run, each after its caption. colours: of each camera, for the whole page."""
    own = results.runs.get(name, RunResults())
    if own.timestacks:
        drawn = waterline.timestacks(own.tables["waterline"], own.timestacks, units)
        yield Chart("Timestack and the water's edge", drawn)
    if "trajectories" in own.tables:
        yield from _positions(name, results, colours, units)
        yield from _motion(name, own, units)
        yield from _analysed(name, own, units)
    if own.centroids:
        yield from _tracks(name, own, colours)


def _survey(results: Results) -> DataFrame | None:
    return next((own.points for own in results.cameras.values() if own.points is not None), None)


def _positions(name: str, results: Results, colours: Mapping[str, str], units: str) -> Iterator[Chart]:
    own = results.runs[name]
    table = own.tables["trajectories"]
    if not table["x"].notna().any():
        return
    in_space = own.record("locate").get("mode") == "space"
    if in_space:
        view = space_view(results, table, colours, units)
        caption = (
            "Cameras with a third of their view, calibrated volume and paths, at equal scales; on the screen it turns, "
            f"and ellipsoids of one sigma are magnified {view['magnified']:g} times"
        )
        yield Chart(caption, space.space(view, name), as_json(view))
    caption = "Position against time; two standard deviations shaded"
    yield Chart(caption, trajectories.against_time(table, units, name), live.positions(table, units))
    survey = _survey(results) if in_space else None
    caption = "From above and from the side, among the calibration points" if survey is not None else "The paths"
    yield Chart(caption, trajectories.views(table, units, name, survey))
    record = own.record("comparison")
    if record.get("lag_s") is not None and "comparison" in own.tables:
        series = own.tables["comparison"]
        first, *others = comparison.comparisons(series, record, units)
        yield Chart(*first, live.comparison(series, units))
        yield from (Chart(*other) for other in others)


def _motion(name: str, own: RunResults, units: str) -> Iterator[Chart]:
    if "kinematics" in own.tables and own.tables["kinematics"]["vx"].notna().any():
        caption = "Velocity and acceleration; left out, or dotted, where uncertain (flag edge): at ends and at gaps"
        table = own.tables["kinematics"]
        yield Chart(caption, trajectories.derivatives(table, units, name), live.derivatives(table, units))
    if "motions" in own.tables and len(own.tables["motions"]):
        yield from _motions(own, units)
    elif "bodies" in own.tables:
        yield Chart(
            "Six degrees of freedom; two standard deviations shaded",
            bodies.six_degrees(own.tables["bodies"], units, name),
        )


def _motions(own: RunResults, units: str) -> Iterator[Chart]:
    """Motions of each body, and the excursions of its named points, or of its origin where no point has a name."""
    table, record = own.tables["motions"], own.record("analysis").get("motions") or {}
    for body, rows in table.groupby("body", sort=False):
        points = list(dict.fromkeys(rows["point"]))
        named = [point for point in points if point != "origin"] or points
        shown = rows[rows["point"].isin(named)]
        caption = "Motions of a body in the basin's axes; two standard deviations shaded"
        yield Chart(caption, motions.motions(shown, units, str(body)), live.motions(shown, units))
        for point in named:
            about = record.get(str(body), {}).get(point)
            if about and about.get("envelope"):
                hull = np.asarray(about["envelope"], float)
                drawing = motions.envelope(
                    rows[rows["point"] == point], hull, about["watch_circle"], units, f"{body}, {point}"
                )
                yield Chart("From above: horizontal excursions, their envelope, and the watch circle", drawing)


def _analysed(name: str, own: RunResults, units: str) -> Iterator[Chart]:
    decay, waves = own.record("analysis").get("decay") or {}, own.record("analysis").get("waves") or {}
    if decay.get("fit"):
        caption = "Free decay: the equation of motion over the data, what is left, and the decrement of half cycles"
        yield Chart(caption, analysis.free_decay(decay, name))
    if waves.get("cycle"):
        cycles = [other for other, own in (waves.get("responses") or {}).items() if own.get("cycle")]
        moved = [other for other in cycles if other.rsplit(".", 1)[-1] in DEGREES_OF_FREEDOM and "@" not in other]
        yield Chart(
            "The mean cycle of the wave and of motions; one standard deviation over the cycles shaded",
            analysis.mean_cycle(waves, (moved or cycles)[:MOST_CYCLES], units, name),
        )
    found = [other for other, own in (waves.get("responses") or {}).items() if "coherence" in own]
    if found:
        caption = "Response to the waves; 95 % bands shaded, only where the coherence is at least 0.6"
        yield Chart(caption, analysis.transfer_functions(waves, found[:6], units, name))


def _tracks(name: str, own: RunResults, colours: Mapping[str, str]) -> Iterator[Chart]:
    clocks = (own.record("locate").get("clocks") or {}).get("cameras") or {}
    if any(clock.get("offsets_s") for clock in clocks.values()):
        yield Chart("Epipolar error against the clock offset of each camera", tracking.clock_search(clocks, colours))
    yield Chart(
        "Centroids of each target in each camera's picture against time",
        tracking.tracks(own.centroids, colours, name),
    )
    for camera, path in own.pictures.items():
        if camera in own.centroids:
            drawing = tracking.tracks_over_picture(read_png(path), own.centroids[camera], camera)
            yield Chart("Tracks over the picture with which the recording begins", drawing)
    caption = "Pixel locking: where within a pixel centroids lie; flat is good, and a target at rest makes a peak"
    yield Chart(caption, tracking.pixel_locking(own.readings, colours))
    for camera, record in own.readings.items():
        if record.get("worst"):
            moments = [{**moment, "picture": _picture(moment["picture"])} for moment in record["worst"]]
            yield Chart("The samples that went worst", tracking.worst_moments(moments, camera))


def _picture(text: str) -> Any:
    """A picture that stands in a record as text."""
    import cv2

    data = np.frombuffer(base64.b64decode(text.rsplit(",", 1)[-1]), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
