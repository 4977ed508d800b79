"""The files under results/ as one `Results`: each is read once, and its place says what it is.

The folder that holds them is called `results`; the experiment, a run or a camera may be called as any folder in it.

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
from itertools import pairwise
from typing import Any

from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.files.timestack_file import read_timestacks
from vidtrack.results import CameraResults, Results, RunResults

READERS: dict[str, Callable[[str], Any]] = {
    ".json": read_json,
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
OVERLAY, VERDICT = "overlay_", "verdict.json"
FAILURES, PAGES, OF_RUNS = (["results", name] for name in (".failures", "report", "runs"))
IN_RUN = ("centroids", "background")
USED = {
    "centroids": ("time_s", "target", "Xf", "Yf"),
    "trajectories": ("time_s", "target", *"xyz", "sigma_x", "sigma_y", "sigma_z"),
    "kinematics": ("time_s", "target", "vx", "vy", "vz", "ax", "ay", "az", "flag"),
}
"""Columns of a run's long tables that the verdict and the report use: the others are not read, for two hours of three
targets they take 300 MB."""


def is_of_run(path: str) -> bool:
    """Whether what lies at a path belongs to a run, and not to the calibration or to the whole experiment."""
    return _run_of(_parts(path)) is not None


def _parts(path: str) -> list[str]:
    return os.path.normpath(path).split(os.sep)


def _run_of(parts: list[str]) -> str | None:
    """The run to which what lies at a path belongs; None where it belongs to none."""
    if parts[-4:-2] == OF_RUNS and parts[-1] != VERDICT:  # of an experiment that is called runs
        return parts[-2]
    return parts[-3] if parts[-5:-3] == OF_RUNS and parts[-2] in IN_RUN else None


def _used(parts: list[str], stem: str) -> tuple[str, ...] | None:
    """The columns of the table at a path that are used; None: all."""
    if _run_of(parts) is None:
        return None
    return USED.get(stem if parts[-4:-2] == OF_RUNS else parts[-2])


def read_results(paths: Iterable[str], known: Results | None = None) -> Results:
    """What lies at these paths, in their order; ValueError for a file that has no place in `Results`.

    known   the calibration, which was read before; it is left as it is
    """
    results = replace(known, runs=dict(known.runs)) if known else Results()
    for path in paths:
        parts, (stem, kind) = _parts(path), os.path.splitext(os.path.basename(path))
        content: Any = read_parquet(path, _used(parts, stem)) if kind == ".parquet" else READERS[kind](path)
        if FAILURES in ([*pair] for pair in pairwise(parts)):
            results.failures.append(content)
        elif parts[-3:-1] == PAGES:
            if kind == ".json":
                results.summaries[content["run"]] = content
            else:
                results.calibration_page |= stem == "calibration"
                results.campaign_page |= stem == "campaign"
        elif (run := _run_of(parts)) is not None:
            own = results.runs.setdefault(run, RunResults())
            if parts[-5:-3] != OF_RUNS:
                _put_in_run(own, stem, kind, content)
            elif parts[-2] == "background":
                own.pictures[stem] = content
            else:
                (own.readings if kind == ".json" else own.centroids)[stem] = content
        elif parts[-1] in WHOLE_FILES:
            after = "_after" if parts[-1] == "survey.json" and parts[-2] == "calibration_after" else ""
            setattr(results, WHOLE_FILES[parts[-1]] + after, content)
        elif parts[-1].startswith(OVERLAY):
            results.cameras.setdefault(stem.removeprefix(OVERLAY), CameraResults()).overlay = content
        elif parts[-1] in CAMERA_FILES:
            cameras = results.after if parts[-3] == "calibration_after" else results.cameras
            setattr(cameras.setdefault(parts[-2], CameraResults()), CAMERA_FILES[parts[-1]], content)
        else:
            raise ValueError(f"{path}: not a file of which the report knows")
    return results


def _put_in_run(run: RunResults, stem: str, kind: str, content: Any) -> None:
    if kind == ".json":
        run.records[stem] = content
    elif kind == ".npz":
        run.timestacks = content
    elif kind == ".jpg":
        run.posters[stem.removeprefix(OVERLAY)] = content
    else:
        run.tables[stem] = content
