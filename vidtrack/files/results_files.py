"""The files under results/ as one `Results`: each is read once, and its place says what it is.

calibration/<camera>/<file>, calibration_after/<camera>/<file>    a camera's calibration
calibration/<file>, calibration_after/<file>                      the whole calibration
runs/<run>/<file>, runs/<run>/centroids/<camera>.<ext>            a run
runs/<run>/background/<camera>.png                                the picture with which a recording begins
verdict.json
report/run_<run>.json, report/calibration.html                    what the first page of the report links to
.failures/...                                                     why a job failed
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.files.timestack_file import read_timestacks
from vidtrack.results import CameraResults, Results, RunResults

READERS: dict[str, Callable[[str], Any]] = {
    ".json": read_json,
    ".parquet": read_parquet,
    ".npz": read_timestacks,
    ".png": str,
    ".jpg": str,
    ".html": str,
}
CAMERA_FILES = {
    "camera.json": "record",
    "labelling.json": "labelling",
    "points.parquet": "points",
    "search.parquet": "search",
    "picture.png": "picture",
}
WHOLE_FILES = {
    "wand.json": "wand",
    "self.json": "by_body",
    "survey.json": "survey",
    "backprojection.json": "back",
    "backprojection.parquet": "back_table",
    "stability.json": "stability",
    "verdict.json": "verdict",
}
OVERLAY, FAILURES, PAGES = "overlay_", ".failures", "report"


def is_of_run(path: str) -> bool:
    """Whether what lies at a path belongs to a run, and not to the calibration or to the whole experiment."""
    parts = os.path.normpath(path).split(os.sep)
    return parts[-3:-2] == ["runs"] or (parts[-4:-3] == ["runs"] and parts[-2] in ("centroids", "background"))


def read_results(paths: Iterable[str], known: Results | None = None) -> Results:
    """What lies at these paths, in their order; ValueError for a file that has no place in `Results`.

    known   the calibration, which was read before; it is left as it is
    """
    results = replace(known, runs=dict(known.runs)) if known else Results()
    for path in paths:
        parts = os.path.normpath(path).split(os.sep)
        kind = os.path.splitext(path)[1]
        content = READERS[kind](path)
        if FAILURES in parts:
            results.failures.append(content)
        elif parts[-2:-1] == [PAGES]:
            if kind == ".json":
                results.summaries[content["run"]] = content
            else:
                results.calibration_page |= parts[-1] == "calibration.html"
                results.campaign_page |= parts[-1] == "campaign.html"
        elif parts[-4:-3] == ["runs"] and parts[-2] == "centroids":
            camera = os.path.splitext(parts[-1])[0]
            own = results.runs.setdefault(parts[-3], RunResults())
            (own.readings if kind == ".json" else own.centroids)[camera] = content
        elif parts[-4:-3] == ["runs"] and parts[-2] == "background":
            results.runs.setdefault(parts[-3], RunResults()).pictures[os.path.splitext(parts[-1])[0]] = content
        elif parts[-3:-2] == ["runs"]:
            _put_in_run(results.runs.setdefault(parts[-2], RunResults()), parts[-1], content)
        elif parts[-1] in WHOLE_FILES:
            after = "_after" if parts[-1] == "survey.json" and parts[-2] == "calibration_after" else ""
            setattr(results, WHOLE_FILES[parts[-1]] + after, content)
        elif parts[-1].startswith(OVERLAY):
            camera = os.path.splitext(parts[-1])[0].removeprefix(OVERLAY)
            results.cameras.setdefault(camera, CameraResults()).overlay = content
        elif parts[-1] in CAMERA_FILES:
            cameras = results.after if parts[-3] == "calibration_after" else results.cameras
            setattr(cameras.setdefault(parts[-2], CameraResults()), CAMERA_FILES[parts[-1]], content)
        else:
            raise ValueError(f"{path}: not a file of which the report knows")
    return results


def _put_in_run(run: RunResults, name: str, content: Any) -> None:
    stem, kind = os.path.splitext(name)
    if kind == ".json":
        run.records[stem] = content
    elif kind == ".npz":
        run.timestacks = content
    elif kind == ".jpg":
        run.posters[stem.removeprefix(OVERLAY)] = content
    else:
        run.tables[stem] = content
