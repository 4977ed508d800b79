"""Job locate: centroid tables and cameras -> results/runs/<run>/trajectories.parquet, .csv and locate.json."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.calibration.ball_points import ball_radii
from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json, write_json
from vidtrack.files.run_inputs import pictures_of, videos_of
from vidtrack.files.tables import read_parquet, write_csv, write_parquet
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.location.cameras.ball_middles import SIZE, sd_in_a_plane
from vidtrack.location.cameras.light_aside import light_aside
from vidtrack.location.cameras.lit_shapes import lit_shape_findings
from vidtrack.location.cameras.run_pictures import Pictures, camera_shown, windows
from vidtrack.location.cameras.zoom_in_sigma import hinted_zoom, zoom_finding
from vidtrack.location.clocks.chosen_readout import chosen_readouts
from vidtrack.location.one_camera.leaning_targets import leaning_targets
from vidtrack.location.one_camera.plane_sizes import plane_sizes
from vidtrack.memory import columns_of
from vidtrack.stages.steadiness import at_rest
from vidtrack.steadiness.turn import law_of_camera, law_of_picture
from vidtrack.tags.poses import TagOrder
from vidtrack.timing.clock_methods import clocks_to_use
from vidtrack.timing.readout import Readout, table_at_frame_time
from vidtrack.timing.resample import interval
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

    from vidtrack.location.cameras.run_sights import COLUMNS, sight_columns

    table = DataFrame(sight_columns(_in_space(job).sights))
    write_parquet(job.outputs["sights"], table, units="", provenance=job.provenance, columns=COLUMNS)


def _in_space(job: Job) -> Locations:
    from vidtrack.stages.locate import locate_run

    names = list(job.settings["cameras"])
    options = {
        key: job.settings[key]
        for key in ("targets", "clocks", "tolerance_px", "max_miss", "bodies", "flat", "same_balls")
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
    together = all((own.get("imported") or {}).get("together") for own in readings.values())
    options["clocks"] = clocks_to_use(options["clocks"], codes, together)
    pictures = _pictures(job, sizes)
    said = job.settings.get("readout_ms") or {}
    chosen = chosen_readouts(videos_of(names, job.paths("readings")), said)
    where = f"runs.{job.settings['run']}"
    if moved := _moved(job):
        kept = {}  # they show what the cameras saw, not what they would have seen at rest
        shown = windows(pictures, where)[0]
        for name, own in calibrated.items():
            law = law_of_camera(camera_shown(own.camera, None, shown.get(name))[0])
            tables[name] = at_rest(tables[name], moved[name], law)
            followed[name] = at_rest(followed[name], moved[name], law)
    located = locate_run(
        tables,
        calibrated,
        tags=_tags(job),
        by_motion=[camera for camera, ms in said.items() if ms == "motion"],
        readouts=chosen.readouts,
        pictures=pictures,
        tracklets=followed,
        kept=kept,
        points=points or None,
        widths=_widths(readings, scale.shift),
        lit=light_aside(readings),
        lit_otherwise=_lit_otherwise(job, readings),
        late={name: own.get("late", 0.0) for name, own in readings.items()},
        heard=next((read_json(path)["cameras"] for path in job.paths("clocks")), None),
        units=job.settings["units"],
        where=where,
        **options,
    )
    located.record["time"] = {"scale": scale.note, "shift_s": scale.shift}
    lean = _leaning(tables, readings, chosen.readouts, located.record)
    shown = windows(pictures, where)[0]
    cameras = {name: camera_shown(own.camera, None, shown.get(name))[0] for name, own in calibrated.items()}
    cut = lit_shape_findings({name: own.get("lighting") for name, own in readings.items()}, cameras, where)
    more = [*cut, *lean, *chosen.findings, *scale.findings]
    located.record["findings"] = [*located.record["findings"], *as_records(more)]
    return located


def _leaning(
    tables: Mapping[str, DataFrame],
    readings: Mapping[str, Mapping[str, Any]],
    chosen: Mapping[str, Readout],
    record: Mapping[str, Any],
) -> list[Finding]:
    """What the shapes of moving targets show of the read-outs that were used."""
    found = record.get("readout", {})
    used = {name: own._replace(seconds=found.get(name, own.seconds)) for name, own in chosen.items()}
    leans = {name: own.get("leaning") for name, own in readings.items()}
    intervals = {name: interval(table["time_s"].drop_duplicates()) for name, table in tables.items()}
    return leaning_targets(leans, used, intervals, record["findings"])


def _tags(job: Job) -> TagOrder | None:
    """What the config says of the run's coded tags; None where it has none."""
    if not (tags := job.settings.get("tags")):
        return None
    bodies, others = job.settings["tag_bodies"], job.settings["tag_targets"]
    return TagOrder(tags["size"], tags["sigma"], tags["ids"], bodies, others)


def _moved(job: Job) -> dict[str, DataFrame]:
    """How each camera moved, where positions are to be corrected by it; empty where not."""
    if not job.settings.get("follow"):
        return {}
    table = read_parquet(job.path("steadiness"))
    return {name: table[table["camera"] == name] for name in job.settings["cameras"]}


def _pictures(job: Job, sizes: Mapping[str, Picture]) -> dict[str, Pictures]:
    crops = job.settings.get("crop") or {}
    return pictures_of(job.settings["cameras"], job.paths("labelling"), job.paths("readings"), sizes, crops)


def _lit_otherwise(job: Job, readings: Mapping[str, Mapping[str, Any]]) -> set[str]:
    """The cameras whose targets are lit from one side where the calibration's balls are not, or the other way round:
    widths of outlines and of light are not compared.
    """
    labelled = [read_json(path) for path in job.paths("labelling")]
    lit = {own["camera"]: "lighting" in own for own in labelled if "camera" in own}
    return {name for name, own in readings.items() if lit.get(name, "lighting" in own) != ("lighting" in own)}


def _widths(readings: Mapping[str, Mapping[str, Any]], later: Mapping[str, float]) -> dict[str, Any]:
    """How wide the tracks of each camera look, at the times of its shifted tables."""
    return {
        name: {
            track: {**looks, "time_s": [t + later.get(name, 0.0) for t in looks["time_s"]]}
            for track, looks in (own.get("widths") or {}).items()
        }
        for name, own in readings.items()
    }


def _in_plane(job: Job) -> PlaneLocations:
    from vidtrack.location.cameras.followed import ROWS
    from vidtrack.stages.locate_plane import locate_plane

    where = f"runs.{job.settings['run']}"
    tables = job.paths("centroids")
    if len(tables) != 1:
        raise VidtrackError(f"{where}: mode plane uses one camera; there are {len(tables)}. Remove the other videos.")
    plane = job.settings["plane"] or {}
    pictures = _pictures(job, {}) if plane.get("points") else {}
    clip = next((own.calibration for own in pictures.values()), None)
    clock = job.settings["clocks"].get(job.settings["cameras"][0])
    table = read_parquet(tables[0], {*ROWS, *SIZE})
    followed = next((read_parquet(path, {*ROWS, *SIZE}) for path in job.paths("tracklets")), None)
    videos = videos_of(job.settings["cameras"], job.paths("readings"))
    chosen = chosen_readouts(videos, job.settings.get("readout_ms") or {}, by_motion=False)
    for readout in chosen.readouts.values():
        table = table.assign(**table_at_frame_time(dict(table), "target", readout))
        if followed is not None:
            followed = followed.assign(**table_at_frame_time(dict(followed), "tracklet", readout))
    if moved := _moved(job):
        video = read_json(job.path("readings"))["video"]
        law = law_of_picture((video["width"], video["height"]))
        table = at_rest(table, moved[job.settings["cameras"][0]], law)
    names = job.settings["cameras"]
    readings = {name: read_json(path) for name, path in zip(names, job.paths("readings"), strict=False)}
    points = _known_points(job, plane.get("clip"), where) if plane.get("points") else None
    if points is not None and (video := videos.get(job.settings["cameras"][0])):
        table = _unsure(table, points, video)
        followed = None if followed is None else _unsure(followed, points, video)
    aspect = _aspect(job, plane.get("aspect"), clip, videos)
    sizes: dict[str, Any] = {}
    if points is not None and not windows(pictures, where)[0]:
        for name, own in readings.items():
            alike = None if _lit_otherwise(job, {name: own}) else own.get("widths")
            sizes |= plane_sizes(name, alike, columns_of(points))
    zoom = hinted_zoom(sizes) if job.settings.get("same_balls", True) else 0.0
    located = locate_plane(
        table,
        tracklets=followed,
        targets=job.settings.get("targets"),
        camera=job.settings["cameras"][0],
        scale=plane.get("scale"),
        aspect=aspect.value,
        points=points,
        units=job.settings["units"],
        pictures=pictures,
        image_size=(clip.width, clip.height) if clip else None,
        clock=clock if isinstance(clock, dict) else None,
        through=job.settings.get("through") or (),
        zoom=zoom,
        where=where,
    )
    if any(own.seconds for own in chosen.readouts.values()):
        located.record["readout"] = {name: own.seconds for name, own in chosen.readouts.items()}
    if points is not None:
        located.record["sizes"] = sizes
    hint = [zoom_finding(zoom, where, "the lens was zoomed or focused, or targets left the plane,")] if zoom else []
    lean = _leaning(dict.fromkeys(videos, table), readings, chosen.readouts, located.record)
    located.record["findings"] = [
        *located.record["findings"],
        *as_records([*lean, *hint, *chosen.findings, *aspect.findings]),
    ]
    return located


def _unsure(table: DataFrame, points: DataFrame, video: Mapping[str, Any]) -> DataFrame:
    """A table of a plane's camera with sd of what is not known of its balls' perspective, beside its points'."""
    radius = ball_radii(points)
    usual = float(np.median(radius[radius > 0])) if (radius > 0).any() else 0.0
    return table.assign(**sd_in_a_plane(columns_of(table), (int(video["width"]), int(video["height"])), usual))


class _Aspect(NamedTuple):
    """The width of a pixel over its height, and what to know of it."""

    value: float
    findings: list[Finding]


def _aspect(job: Job, given: float | None, clip: Picture | None, videos: Mapping[str, Mapping[str, Any]]) -> _Aspect:
    """By the config, else the sensor over the pixels that it has, else the file; 1 where nothing states it.

    Where the run shows a part of a picture that is not known, the sensor says nothing of its pixels.
    """
    if given is not None:
        return _Aspect(given, [])
    name, sensor = job.settings["cameras"][0], job.settings.get("sensor")
    shown = clip or next((picture_from_record(own) for own in videos.values()), None)
    if shown is None:
        return _Aspect(1.0, [])
    value, source = float(shown.sample_aspect), "the file"
    if sensor and (clip or name not in (job.settings.get("crop") or {})):
        value, source = sensor[0] / shown.width / (sensor[1] / shown.height), f"cameras.{name}.sensor"
    if value == 1:
        return _Aspect(1.0, [])
    text = f"{name}: a pixel is {value:.4g} times as wide as high by {source}: X is multiplied by that"
    return _Aspect(value, [Finding("note", "plane-aspect", text, "Give plane.aspect where you know another.")])


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
