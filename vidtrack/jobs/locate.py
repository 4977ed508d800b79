"""Job locate: centroid tables and cameras -> results/runs/<run>/trajectories.parquet, .csv and locate.json."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json, write_json
from vidtrack.files.run_inputs import pictures_of, readouts_of
from vidtrack.files.tables import read_parquet, write_csv, write_parquet
from vidtrack.findings import as_records
from vidtrack.geometry.picture_part import Picture
from vidtrack.location.readout_search import sought_readouts
from vidtrack.location.run_pictures import Pictures, camera_shown, windows
from vidtrack.stages.steadiness import at_rest
from vidtrack.stages.tag_poses import CORNER, TagPoses, tag_poses, trajectories_of
from vidtrack.steadiness.turn import law_of_camera, law_of_picture
from vidtrack.timing.run_scale import code_from_record, run_scale
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from pandas import DataFrame

    from vidtrack.stages.locate import Locations
    from vidtrack.stages.locate_plane import PlaneLocations


def run(job: Job) -> None:
    """inputs: centroids, readings; tracklets, windows, cameras, points and, where clocks are sought, clocks (mode
    space); sightings (mode plane, where there are any); labelling of the cameras whose calibration is used;
    steadiness, where positions are corrected by it.

    settings: run, units, mode, cameras (in the order of the inputs), targets, clocks, crop, tolerance_px, plane,
    follow, readout_ms[, max_miss, bodies, through].
    outputs: trajectories, csv, associations, record; or sights alone, for self-calibration.
    """
    from vidtrack.location.associations import COLUMNS

    if "sights" in job.outputs:
        _write_sights(job)
        return
    located: Locations | PlaneLocations = _in_plane(job) if job.settings["mode"] == "plane" else _in_space(job)
    trajectories, record = located.trajectories, located.record
    write_parquet(
        job.outputs["associations"], located.associations, units="", provenance=job.provenance, columns=COLUMNS
    )
    write_parquet(job.outputs["trajectories"], trajectories, units=job.settings["units"], provenance=job.provenance)
    write_csv(job.outputs["csv"], trajectories)
    write_json(job.outputs["record"], record, job.provenance)


def _write_sights(job: Job) -> None:
    """The sights of a body's targets alone: by them `self_calibrate` refines the cameras that located them."""
    from pandas import DataFrame

    from vidtrack.location.run_sights import COLUMNS, sight_columns

    table = DataFrame(sight_columns(_in_space(job).sights))
    write_parquet(job.outputs["sights"], table, units="", provenance=job.provenance, columns=COLUMNS)


def _in_space(job: Job) -> Locations:
    from vidtrack.stages.locate import locate

    names = list(job.settings["cameras"])
    options = {
        key: job.settings[key]
        for key in ("targets", "clocks", "tolerance_px", "max_miss", "bodies")
        if key in job.settings
    }
    points = {n: read_parquet(path) for n, path in zip(names, job.paths("points"), strict=False)}
    points = {name: table for name, table in points.items() if len(table)}  # cameras of other programs have none
    readings = {n: read_json(p) for n, p in zip(names, job.paths("readings"), strict=False)}
    codes = {n: code_from_record(own) for n, own in readings.items()}
    scale = run_scale(codes, f"runs.{job.settings['run']}")
    tables = {name: read_parquet(path) for name, path in zip(names, job.paths("centroids"), strict=True)}
    followed = {name: read_parquet(path) for name, path in zip(names, job.paths("tracklets"), strict=False)}
    kept = {PurePath(path).stem: read_parquet(path) for path in job.paths("windows")}
    for name, later in scale.shift.items():
        for shifted in (tables, followed, kept):
            if name in shifted:
                shifted[name]["time_s"] += later
    calibrated = {name: read_camera(path) for name, path in zip(names, job.paths("cameras"), strict=False)}
    sizes = {name: Picture(*own.camera.image_size) for name, own in calibrated.items()}
    unset = bool(codes) and all(code is None for code in codes.values()) and len(tables) > 1
    unset = unset and not all((own.get("imported") or {}).get("together") for own in readings.values())
    options["clocks"] = {  # without any time code nothing says that the recordings began at one moment
        name: own if own is not None else "motion" if unset else {} for name, own in options["clocks"].items()
    }
    pictures = _pictures(job, sizes)
    readouts = readouts_of(names, job.paths("readings"), job.settings.get("readout_ms") or {})
    if moved := _moved(job):
        kept = {}  # they show what the cameras saw, not what they would have seen at rest
        shown = windows(pictures, f"runs.{job.settings['run']}")[0]
        for name, own in calibrated.items():
            law = law_of_camera(camera_shown(own.camera, None, shown.get(name))[0])
            tables[name] = at_rest(tables[name], moved[name], law)
            followed[name] = at_rest(followed[name], moved[name], law)
    where = f"runs.{job.settings['run']}"
    tags: dict[str, Any] = job.settings.get("tags") or {}

    def tags_by(clocks: Mapping[str, Any], trajectories: DataFrame | None) -> TagPoses:
        return tag_poses(
            tables,
            calibrated,
            size=tags["size"],
            sigma=tags["sigma"],
            ids=tags["ids"],
            bodies=job.settings["tag_bodies"],
            clocks=clocks,
            pictures=pictures,
            points=points or None,
            readouts=readouts,
            targets=job.settings["tag_targets"],
            trajectories=trajectories,
            where=where,
        )

    if tags:
        options["targets"] = _with_corners(options["targets"], _corner_names(tables))
    if tags and len(names) == 1:
        clock = options["clocks"][names[0]]
        clock = clock if isinstance(clock, dict) else {}
        return _by_one_camera(tags_by({names[0]: clock}, None), names[0], clock, job.settings["units"])
    once = partial(
        locate,
        tables,
        calibrated,
        pictures=pictures,
        tracklets=followed,
        kept=kept,
        points=points or None,
        heard=next((read_json(path)["cameras"] for path in job.paths("clocks")), None),
        units=job.settings["units"],
        where=where,
        **options,
    )
    by_motion = [c for c, ms in (job.settings.get("readout_ms") or {}).items() if ms == "motion"]
    if by_motion:
        done = sought_readouts(lambda tried: once(readouts=tried), readouts, by_motion, where)
        located: Locations = done.located
        readouts = done.readouts
        located.record["readout_by_motion"] = {
            c: {"seconds": done.readouts[c].seconds if c in done.readouts else None, "sd": sd}
            for c, sd in done.sd.items()
        }
        located.record["findings"] = [*located.record["findings"], *as_records(done.findings)]
    else:
        located = once(readouts=readouts)
    if tags:
        located = _with_centres(located, tags_by(located.record["clocks"]["cameras"], located.trajectories))
    located.record["time"] = {"scale": scale.note, "shift_s": scale.shift}
    located.record["findings"] = [*located.record["findings"], *as_records(scale.findings)]
    return located


def _corner_names(tables: Mapping[str, DataFrame]) -> list[str]:
    """The targets that are corners of coded tags."""
    named = {name for table in tables.values() for name in table["target"].astype(str).unique() if CORNER.match(name)}
    return sorted(named, key=lambda name: [int(part) for part in CORNER.match(name).groups()])  # type: ignore[union-attr]


def _with_corners(targets: Any, corners: list[str]) -> Any:
    """The targets of a run, and the corners of its tags."""
    if targets == "all":
        return targets
    return [*([f"t{n + 1}" for n in range(targets)] if isinstance(targets, int) else targets), *corners]


def _with_centres(located: Locations, poses: TagPoses) -> Locations:
    """The trajectories of the tags' centres beside those of their corners."""
    import pandas as pd

    whole = pd.concat([located.trajectories, trajectories_of(poses, corners=False)], ignore_index=True)
    if "outside" in located.trajectories:
        whole["outside"] = whole["outside"].fillna(False).astype(bool)
    return located._replace(trajectories=whole)


def _by_one_camera(poses: TagPoses, camera: str, clock: Any, units: str) -> Locations:
    """Where one camera alone sees the tags: its trajectories are those that the poses of the tags give."""
    import pandas as pd

    from vidtrack.location.associations import COLUMNS
    from vidtrack.location.run_sights import RunSights
    from vidtrack.stages.locate import Locations

    table = trajectories_of(poses, corners=True)
    seen = table["x"].notna()
    record = {
        "mode": "space",
        "units": units,
        "cameras": [camera],
        "clocks": {"cameras": {camera: {"offset_s": 0.0, "rate_ppm": 0.0, **clock, "source": "config"}}},
        "samples": {"total": len(table), "located": int(seen.sum())},
        "findings": [],
        "warnings": [],
    }
    nothing = np.zeros((1, 0, 0, 2))
    sights = RunSights(np.zeros(0), (), (camera,), nothing, nothing, np.zeros((1, 0, 0), bool), {})
    return Locations(table, record, pd.DataFrame({name: [] for name in COLUMNS}), sights)


def _moved(job: Job) -> dict[str, DataFrame]:
    """How each camera moved, where positions are to be corrected by it; empty where not."""
    if not job.settings.get("follow"):
        return {}
    table = read_parquet(job.path("steadiness"))
    return {name: table[table["camera"] == name] for name in job.settings["cameras"]}


def _pictures(job: Job, sizes: Mapping[str, Picture]) -> dict[str, Pictures]:
    crops = job.settings.get("crop") or {}
    return pictures_of(job.settings["cameras"], job.paths("labelling"), job.paths("readings"), sizes, crops)


def _in_plane(job: Job) -> PlaneLocations:
    from vidtrack.stages.locate_plane import locate_plane

    where = f"runs.{job.settings['run']}"
    tables = job.paths("centroids")
    if len(tables) != 1:
        raise VidtrackError(f"{where}: mode plane uses one camera; there are {len(tables)}. Drop the other videos.")
    plane = job.settings["plane"] or {}
    pictures = _pictures(job, {}) if plane.get("points") else {}
    clip = next((own.calibration for own in pictures.values()), None)
    clock = job.settings["clocks"].get(job.settings["cameras"][0])
    table = read_parquet(tables[0])
    if moved := _moved(job):
        video = read_json(job.path("readings"))["video"]
        law = law_of_picture((video["width"], video["height"]))
        table = at_rest(table, moved[job.settings["cameras"][0]], law)
    return locate_plane(
        table,
        tracklets=next((read_parquet(path) for path in job.paths("tracklets")), None),
        targets=job.settings.get("targets"),
        camera=job.settings["cameras"][0],
        scale=plane.get("scale"),
        aspect=plane.get("aspect", 1.0),
        points=_known_points(job, plane.get("clip"), where) if plane.get("points") else None,
        units=job.settings["units"],
        pictures=pictures,
        image_size=(clip.width, clip.height) if clip else None,
        clock=clock if isinstance(clock, dict) else None,
        through=job.settings.get("through") or (),
        where=where,
    )


def _known_points(job: Job, clip: str | None, where: str) -> DataFrame:
    """The known points as the camera saw them, in the clip that is named."""
    sightings = read_parquet(job.path("sightings"))
    if clip is None or "clip" not in sightings:
        return sightings
    known = sightings[sightings["clip"] == clip].reset_index(drop=True)
    if known.empty:
        clips = ", ".join(sorted(set(sightings["clip"].astype(str)))) or "none"
        raise VidtrackError(
            f"{where}.plane.clip: the camera saw no points in '{clip}' (clips: {clips}). Name one of them."
        )
    return known
