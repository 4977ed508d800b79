"""Job calibrate: a camera's sightings in; points.parquet, camera.json and the search map out."""

from __future__ import annotations

import sys
from typing import Any

from pandas import DataFrame

from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.errors import VidtrackError
from vidtrack.exchange.lens import known_lens
from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import read_json, read_png
from vidtrack.files.tables import read_parquet, write_parquet
from vidtrack.stages.calibrate import calibrate
from vidtrack.workflow.job import Job

FRESH = ("standard_errors", "correlations", "uncertainty", "provenance", "position", "position_sd")
"""Keys of a camera.json that are written anew."""


def run(job: Job) -> None:
    """Inputs sightings, labelling, picture; survey where there are several cameras, lens where it is in a file.

    Outputs points, camera, search.
    """
    if read_labelling(job.path("labelling")).get("placed_by") == "board":
        _placed_by_board(job)
        return
    settings = {name: value for name, value in job.settings.items() if name not in ("units", "lens", "flat")}
    board = _board_record(job)
    height, width = read_png(job.path("picture")).shape[:2]
    sightings = read_parquet(job.path("sightings"))
    done = calibrate(
        sightings.assign(flat=True) if job.settings.get("flat") else sightings,
        image_size=(width, height),
        units=job.settings["units"],
        left_out=_left_out(job),
        lens=None if board.get("found") is False else _lens(job, (width, height)),
        **settings,
    )
    for warning in done.warnings:
        sys.stderr.write(f"warning: {warning}\n")
    units, provenance = job.settings["units"], job.provenance
    write_parquet(job.outputs["points"], done.points, units=units, provenance=provenance)
    if done.search is not None and "search" in job.outputs:
        columns = {
            "sensor_width": "mm",
            **dict.fromkeys(("Cx", "Cy", "rms_closed_form", "rms_refined", "rms_px"), "px"),
        }
        write_parquet(job.outputs["search"], done.search, units=units, provenance=provenance, columns=columns)
    record = done.record | {"findings": [*done.record["findings"], *board.get("findings", [])]}
    if "board" in board:
        record["board"] = board["board"]
    write_camera(job.outputs["camera"], done.camera, done.uncertainty, record, provenance)


def _board_record(job: Job) -> dict[str, Any]:
    """What the board's views gave for the lens, where the lens is theirs."""
    by_board = (job.settings.get("lens") or {}).get("board")
    return read_json(job.paths("lens")[0]) if by_board else {}


def _left_out(job: Job) -> dict[tuple[str, str], str]:
    """What all cameras together leave out of this one."""
    paths = job.paths("survey")
    own = read_json(paths[0])["left_out"].get(job.settings["camera"], []) if paths else []
    return {(each["clip"], each["tag"]): each["reason"] for each in own}


def _placed_by_board(job: Job) -> None:
    """The camera as the board's views placed it: its corners are no surveyed points, and nothing is fitted again."""
    given = read_json(job.paths("lens")[0])
    if given.get("found") is False:
        raise VidtrackError(*(finding["text"] for finding in given["findings"]))
    found = read_camera(job.paths("lens")[0])
    record = {key: value for key, value in found.record.items() if key not in FRESH}
    units, provenance = job.settings["units"], job.provenance
    write_parquet(job.outputs["points"], read_parquet(job.path("sightings")), units=units, provenance=provenance)
    nothing = DataFrame({name: [] for name in ("varied", "Cx", "Cy", "sensor_width", "rms_px")})
    write_parquet(job.outputs["search"], nothing, units=units, provenance=provenance)
    write_camera(job.outputs["camera"], found.camera, found.uncertainty, record, provenance)


def _lens(job: Job, image_size: tuple[int, int]) -> KnownLens | None:
    """The lens that the config names, if any."""
    if not (given := job.settings.get("lens")):
        return None
    paths = job.paths("lens")
    return known_lens(given, paths[0] if paths else None, job.settings["camera"], image_size)
