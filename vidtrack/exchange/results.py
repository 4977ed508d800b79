"""From the results of a run, as they lie under results/, to what the writers take."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vidtrack.errors import VidtrackError
from vidtrack.exchange.formats import FORMATS, Format, Layout
from vidtrack.exchange.measured import Run
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.picture_part import Window

if TYPE_CHECKING:
    from pandas import DataFrame

    from vidtrack.files.experiment import Run as Recorded
    from vidtrack.settings.config import Settings

TABLES = ("trajectories", "kinematics", "bodies", "motions", "associations")


def layout_of(settings: Settings, run: Recorded) -> Layout:
    """What is known of a run before anything is measured in it."""
    own = settings.runs.get(run.name)
    if own is None:
        return Layout(run.name, cameras=tuple(run.videos))
    axes = own.axes or (settings.axes and own.bodies)
    analysed = own.analysis is not None or bool(axes)
    return Layout(run.name, own.mode, tuple(run.videos), tuple(own.bodies), analysed)


def unsuited(settings: Settings, runs: Iterable[Recorded]) -> list[str]:
    """What config.yaml asks for and no run can give, a line each: of `export` for all runs, or of a run's own."""
    layouts = [layout_of(settings, run) for run in runs]
    problems = []
    for name in settings.export:
        taking = [layout for layout in layouts if (own := settings.runs.get(layout.name)) is None or own.export is None]
        reasons = {layout.name: FORMATS[name].lacking(layout) for layout in taking}
        if reasons and all(reasons.values()):
            run, why = next(iter(reasons.items()))
            problems.append(f"config.yaml: export: no run can be written as {name}; run {run}: {why}. Remove {name}.")
    for layout in layouts:
        own = settings.runs.get(layout.name)
        for name in (own.export or ()) if own else ():
            if why := FORMATS[name].lacking(layout):
                where = f"config.yaml: runs.{layout.name}.export"
                problems.append(f"{where}: it cannot be written as {name}: {why}. Remove {name}.")
    return problems


def axes_of(settings: Settings, run: str) -> dict[str, str] | None:
    """{waves, up} of a run, where the config says them."""
    own = settings.runs.get(run)
    axes = (own.axes if own else None) or settings.axes
    return axes.model_dump() if axes else None


def result_paths(results: str, form: Format, layout: Layout) -> dict[str, list[str]]:
    """Where the results of a run lie that a format reads, by their names; tables that it does not have left out."""
    here = f"{results}/runs/{layout.name}"
    there = {"bodies": bool(layout.bodies), "motions": layout.analysed}
    wanted = [table for table in TABLES if table in form.reads and there.get(table, True)]
    paths = {table: [f"{here}/{table}.parquet"] for table in wanted}
    cameras = layout.cameras if layout.mode == "space" else ()
    for part in ("centroids", "tracklets"):
        if part in form.reads:
            paths[part] = [f"{here}/{part}/{camera}.parquet" for camera in layout.cameras]
    if "locate" in form.reads:
        paths["locate"] = [f"{here}/locate.json"]
    if "points" in form.reads:
        paths["points"] = [f"{results}/calibration/{camera}/points.parquet" for camera in cameras]
    if "cameras" in form.reads:
        paths["cameras"] = [f"{results}/calibration/{camera}/camera.json" for camera in cameras]
    return paths


def read_run(
    paths: Mapping[str, Sequence[str]],
    name: str,
    units: str,
    axes: Mapping[str, str] | None = None,
    mode: str = "space",
) -> Run:
    """A run's results at these paths, as `result_paths` names them.

    axes   {waves, up}: directions of the world, where the config says them
    VidtrackError for a file that is not there yet or damaged.
    """
    if missing := [path for several in paths.values() for path in several if not os.path.isfile(path)]:
        raise VidtrackError(f"{missing[0]}: not there yet. Call vidtrack run first.")
    tables: dict[str, DataFrame] = {table: read_parquet(paths[table][0]) for table in TABLES if table in paths}
    first = [p for table in TABLES for p in paths.get(table, ())]
    cameras = [read_camera(path) for path in paths.get("cameras", ())]
    provenance = _provenance(first[0]) if first else cameras[0].record.get("provenance", {}) if cameras else {}
    locate = read_json(paths["locate"][0]) if paths.get("locate") else {}
    if paths.get("points") and (parts := locate.get("pictures")):
        raise VidtrackError(
            f"run {name}: its pictures of {next(iter(parts))} are a part of the calibration's, or of another size, and "
            "the format has one size for both. Export csv."
        )
    return Run(
        name,
        units,
        tables,
        {_stem(path): read_parquet(path) for path in paths.get("centroids", ())},
        {own.camera.name: _shown(own.camera, locate) for own in cameras},
        _clocks(locate),
        (axes or {}).get("waves"),
        (axes or {}).get("up"),
        mode == "plane",
        {_stem(path): read_parquet(path) for path in paths.get("tracklets", ())},
        provenance,
        {os.path.basename(os.path.dirname(path)): read_parquet(path) for path in paths.get("points", ())},
    )


def _shown(camera: Camera, locate: Mapping[str, Any]) -> Camera:
    """The camera as the pictures of the run have it, where those are a part of the calibration's or of another size."""
    part = (locate.get("pictures") or {}).get(camera.name)
    return Window(**part).camera(camera) if part else camera


def _clocks(locate: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    clocks = (locate.get("clocks") or {}).get("cameras") or {}
    return {
        camera: {key: float(own.get(key) or 0.0) for key in ("offset_s", "rate_ppm")}
        for camera, own in clocks.items()
        if isinstance(own, Mapping)
    }


def _provenance(path: str) -> dict[str, Any]:
    import pyarrow.parquet as pq

    return dict(json.loads((pq.read_schema(path).metadata or {}).get(b"provenance", b"{}")))


def _stem(path: str) -> str:
    return os.path.splitext(os.path.basename(path))[0]
