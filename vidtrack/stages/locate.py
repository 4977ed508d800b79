"""Stage locate, mode space: what several cameras saw becomes trajectories in the world, with time and uncertainty."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Bools
from vidtrack.findings import as_records
from vidtrack.geometry.triangulate import Located, locate_points
from vidtrack.location.accepted import limits_of, rows_kept, without_chance, without_far
from vidtrack.location.associations import COLUMNS, association_columns
from vidtrack.location.cameras.ball_diameters import resized
from vidtrack.location.cameras.ball_middles import perspective_findings
from vidtrack.location.cameras.light_aside import with_light_aside
from vidtrack.location.cameras.run_pictures import Pictures, columns_shown, record_of, windows
from vidtrack.location.cameras.run_sights import RunSights
from vidtrack.location.cameras.run_sizes import run_sizes
from vidtrack.location.cameras.run_views import run_views
from vidtrack.location.cameras.seen_late import with_lateness
from vidtrack.location.cameras.views import Labels, View, balls_by_target, brought, by_target, same_day, timecodes
from vidtrack.location.cameras.wrong_pictures import wrong_pictures
from vidtrack.location.cameras.zoom_in_sigma import with_zoom
from vidtrack.location.clocks.clock_far_off import clock_far_off
from vidtrack.location.clocks.common_moments import check_overlap, recorded_twice
from vidtrack.location.clocks.cut_recording import cut_recordings
from vidtrack.location.clocks.late_cameras import cameras_apart, late_cameras
from vidtrack.location.clocks.readout_search import sought_readouts
from vidtrack.location.clocks.run_clocks import run_clocks
from vidtrack.location.locate_findings import caused_by, findings_of
from vidtrack.location.locate_record import (
    clock_record,
    match_record,
    noise_record,
    sample_record,
    sight_line_record,
    volume_record,
)
from vidtrack.location.lost_targets.second_search import LOOKS, searched_again
from vidtrack.location.matching import matched
from vidtrack.location.sample_flags import sample_flags
from vidtrack.location.sight_lines.budget import calibration_field, error_budget
from vidtrack.location.sight_lines.centroid_noise import noise_factor
from vidtrack.location.sight_lines.erring_camera import places_of_errors, without_erring
from vidtrack.location.sight_lines.shared_survey import Survey, joint_of, survey_covariance, surveys_of
from vidtrack.location.sight_lines.sight_misses import sight_misses, with_misses
from vidtrack.location.sight_lines.sudden_misses import with_grown_sigma
from vidtrack.location.sight_lines.unseen import shares_seen, unseen
from vidtrack.location.sight_lines.volume import distance_outside
from vidtrack.memory import columns_of
from vidtrack.tags import one_camera_run
from vidtrack.tags.corners import corner_names, with_corners
from vidtrack.tags.poses import TagOrder, TagPoses, tag_poses, trajectory_rows
from vidtrack.timing.clock_methods import given_clocks, methods_of
from vidtrack.timing.readout import Readout, at_frame_time
from vidtrack.timing.resample import interval

SD_PX = 0.1
"""ASSUME: noise of a centroid, where neither the tracker nor the reprojection errors show it."""

TOLERANCE_PX, TOLERANCE_SD = 3.0, 6.0
"""How far a sample may lie from the located point where the config does not say: px, or its sd, or what is usual."""

MISFITS = {"nothing-matched", "track-unmatched", "match-contradicted", "sight-lines-miss", "cameras-disagree"}
"""Findings that may have their reason in a camera whose pictures are not those of its calibration."""


class Locations(NamedTuple):
    """What `locate` returns."""

    trajectories: pd.DataFrame
    record: dict[str, Any]
    associations: pd.DataFrame  # a row a tracklet: the target that it is of and what holds it to that, or why none
    sights: RunSights  # on which the trajectories rest


def locate(
    centroids: Mapping[str, pd.DataFrame],
    cameras: Mapping[str, Any],
    *,
    targets: int | Sequence[str] | Literal["all"] | None = None,
    clocks: Mapping[str, Mapping[str, float] | str] | str | None = None,
    heard: Mapping[str, Any] | None = None,
    tolerance_px: float | None = None,
    max_miss: float | None = None,
    points: Mapping[str, pd.DataFrame] | None = None,
    volume: ArrayLike | None = None,
    pictures: Mapping[str, Pictures] | None = None,
    tracklets: Mapping[str, pd.DataFrame] | None = None,
    kept: Mapping[str, pd.DataFrame] | None = None,
    readouts: Mapping[str, Readout] | None = None,
    bodies: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    widths: Mapping[str, Any] | None = None,
    lit: Mapping[str, float] | None = None,
    flat: bool = False,
    lit_otherwise: Collection[str] = (),
    same_balls: bool = True,
    late: Mapping[str, float] | None = None,
    units: str = "in",
    where: str = "locate",
) -> Locations:
    """Locate every target of a run at every moment at which two cameras or more were recording.

    centroids      camera: table of time_s, target, Xf, Yf (px), flag; timecode, sd_x, sd_y (px) where there are any
    cameras        camera: (Camera, Uncertainty or None), or a Calibrated; more cameras than tables do no harm
    targets        their names, or how many there are; all: as many as the cameras agree upon, each with rows from its
                   first fix to its last; None: as all, with rows at all moments
    clocks         camera: {"offset_s", "rate_ppm"}, added to its time; or the method that estimates it: "auto",
                   "motion", "sound", "flash"
    heard          the estimates of stage clocks: camera: method: its answer; None: only the motion is used
    tolerance_px   how far from its epipolar line a match may lie, and how far from the located point a sample;
                   None: 3 px, for samples 6 sd of the centroids where that is more
    max_miss       world units; a fix whose lines of sight miss it by more is left out
    points         camera: points.parquet, for the calibrated volume and what the calibrations have in common
    volume         (n, 3) calibration points, where `points` is not given
    pictures       camera: the sizes of its pictures; None: the run's are those of the calibration
    readouts       camera: how it reads its picture; those of a global shutter have 0 s, and show where that is wrong
    tracklets      camera: all that it followed, `association.tracklets.COLUMNS`; None: what `centroids` has
    kept           camera: pieces of its pictures, `tracking.windows.COLUMNS`, in which targets that other cameras show
                   are sought again
    bodies         body: {target: its place in the body's axes}: their distances say which target is which
    late           camera: samples by which what moves is seen late at most, where its pictures are mixed
    widths         camera: how wide its tracks look (`ball_widths`), to be compared with the calibration's balls
    lit            camera: what its centroids' sd does not hold of a lamp that lights the targets from one side, px
    flat           targets are flat marks and no balls
    lit_otherwise  cameras whose targets are lit otherwise than those balls: widths are not compared there
    same_balls     targets may be balls of the calibration's size
    A moment without a fix is a row of NaN whose flag says why: lost (fewer than two cameras saw the target), parallel
    (their lines of sight are too nearly parallel, or meet behind one of them),
    disagree (they do not see one point), far (max_miss), or what the tracker said, as cam1:edge. A fix where another
    camera should see the target, and followed nothing near, is flagged cam3:unseen.
    Raises VidtrackError for fewer than two calibrated cameras or cameras that share no moment.
    """
    shown, findings = windows(pictures or {}, where)
    rolling = readouts or {}
    sighted = run_views(centroids, tracklets or {}, cameras, shown, widths or {}, where, flat)
    views = same_day(sighted.views)
    views = [v._replace(b=at_frame_time(v.t, v.b, rolling[v.name])) if v.name in rolling else v for v in views]
    if points is not None:
        points = {name: table.assign(**columns_shown(table, shown.get(name))) for name, table in points.items()}
    names = None if targets is None or targets == "all" or isinstance(targets, int) else list(targets)
    limit = targets if isinstance(targets, int) else None if names is None else len(names)
    reach = tolerance_px or TOLERANCE_PX
    given = given_clocks([view.name for view in views], clocks)
    timed = run_clocks(
        views,
        given,
        methods_of(given),
        heard or {},
        names=names,
        limit=limit,
        tolerance_px=reach,
        units=units,
        findings=findings,
    )
    times = [clock.corrected(view.t) for view, clock in zip(views, timed.clocks, strict=True)]
    check_overlap(views, times, where)
    findings += cameras_apart(views, times)
    at, whose = recorded_twice(times)
    seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
    match = matched(views, seen, names, limit, reach, findings, list((bodies or {}).values()))
    b, sd = by_target(seen, match.trajectory, len(match.labels))
    followed, tracked = (views, match), b
    again: dict[str, int] = {}
    if kept and match.labels:
        pieces = {n: columns_of(own) for n, own in kept.items() if n not in rolling or not rolling[n].seconds}
        rows = {name: columns_of(own, LOOKS) for name, own in (tracklets or {}).items()}
        views, match, again = searched_again(views, times, at, match, pieces, rows)
        seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
        b, sd = by_target(seen, match.trajectory, len(match.labels))
    rig, m = [v.camera for v in views], len(match.labels)
    rough = locate_points(rig, b, sd=sd).point if any(s.ball is not None for s in seen) else b[0]
    sized = resized(rig, b, sd, balls_by_target(seen, match.trajectory, m), rough)
    b, sd = sized.b, sized.sd
    relative = not all(v.has_sd for v in views)
    fallback = SD_PX if relative else 1.0
    lag = 3 if any(s.between for s in seen) else 1
    aside = [(lit or {}).get(v.name) for v in views]
    sd = with_light_aside(sd, aside)
    noise = noise_factor(rig, b, sd, fallback, lag=lag, relative=relative, alike=[own is not None for own in aside])
    quick, sd = (np.hypot(sd * by[:, :, None, None], sized.lasting) for by in (noise.each, noise.whole))
    reject = tolerance_px or limits_of(sd, b, TOLERANCE_PX, TOLERANCE_SD)
    surveys, uncertainties = _surveys(views, points, noise.factor), [v.uncertainty for v in views]
    slips = timed.slips(b, at)
    joint = joint_of([cameras[v.name] for v in views], rig, uncertainties, surveys)
    points_of = partial(locate_points, rig, b, sd=sd, uncertainties=uncertainties, joint=joint, slips=slips)
    located = without_chance(points_of(reject=reject))
    # why cameras disagree is seen where they do; what lasts is what is looked for
    same = not located.disagree.any() and (noise.each == noise.whole).all()
    whole = located if same else points_of(sd=quick)
    misses = sight_misses(rig, uncertainties, joint, whole, b, quick, at, _shares(views, rolling, b))
    located = located if max_miss is None else without_far(located, max_miss)
    grown = with_grown_sigma(located, sd)

    def of_some(which: Bools, own_sd: Array) -> Located:
        own = None if slips is None else slips[:, which]
        return locate_points(rig, b[:, which], sd=own_sd, uncertainties=uncertainties, joint=joint, slips=own)

    located, erring = without_erring(*grown, sd, of_some)
    old = [late[v.name] * interval(t) for v, t in zip(views, times, strict=True) if late and late.get(v.name)]
    located, aged = with_lateness(located, at, max(old, default=0.0))
    located, growth = with_misses(located, whole, misses)
    bare = {} if flat else {n: columns_of(own) for n, own in (points or {}).items() if shown.get(n) is None}
    there = (at, located.point, match.labels)
    sizes = run_sizes(views, times, there, widths or {}, bare, lit or {}, lit_otherwise)
    hinted = with_zoom(located, rig, b, sd, sizes if same_balls else {}, where)
    table = _table(at, timecodes(views, times, at, whose), match.labels, located := hinted.located)
    nothing = [unseen(v, own, t, at, located.point) for v, own, t in zip(views, seen, times, strict=True)]
    table["flag"] = sample_flags(views, seen, match, located, max_miss, nothing).ravel()
    table = table[rows_kept(located.point, match.open | (targets == "all")).ravel()].reset_index(drop=True)
    if (outside := _outside(points, volume, table)) is not None:
        table["outside"] = outside > 0
    record: dict[str, Any] = {"mode": "space", "units": units, "cameras": [v.name for v in views]}
    record |= {"clocks": clock_record(views, given, timed), "volume": volume_record(outside, units)}
    record |= {"correspondence": match_record(views, match, located, at, reach)}
    record |= {"noise": noise_record(views, located, sd, noise), "samples": sample_record(views, located, at)}
    record["samples"] |= {"sought_again": again, "sudden_misses": int(grown.samples.sum())}
    record["samples"]["erring"] = places_of_errors(erring, b, {v.name: v.camera.image_size[0] for v in views})
    record["samples"]["in_view"] = shares_seen(views, times, at, located.point, tracked, b, match.labels)
    record |= {"readout": {name: own.seconds for name, own in rolling.items()}}
    record |= {"sight_lines": sight_line_record(views, misses), "pictures": record_of(shown)}
    of_survey = survey_covariance(rig, uncertainties, surveys) if surveys else None
    record |= {
        "uncertainty": error_budget(rig, b, sd, uncertainties, joint, of_survey, slips, aged, growth, hinted.added)
    }
    field = calibration_field(rig, located.point, uncertainties, joint)
    record["uncertainty"] |= {"gradients": None} if field is None else field._asdict()
    findings += findings_of(record, units) + perspective_findings(sighted.balls, where) + hinted.findings
    if any(finding.code in MISFITS for finding in findings):
        findings = [*wrong_pictures(views, seen, reach, bool(match.labels)), *findings]
        if far := clock_far_off(views, times, [bool(own) for own in timed.used]):
            findings = [far, *(caused_by(far, f) if f.code in MISFITS else f for f in findings)]
        findings[:0] = late_cameras(views, seen, match, located, at, reach)
    findings[:0] = cut_recordings(views, match, times, reach)
    record |= {"sizes": sizes, "perspective": {name: own._asdict() for name, own in sighted.balls.items()}}
    record |= {"findings": as_records(findings), "warnings": [f"{f.text}. {f.cure}".rstrip() for f in findings]}
    sights = RunSights(at, tuple(match.labels), tuple(v.name for v in views), b, sd, located.left_out, shown)
    return Locations(table, record, pd.DataFrame(association_columns(*followed)), sights)


def locate_run(
    centroids: Mapping[str, pd.DataFrame],
    cameras: Mapping[str, Any],
    *,
    tags: TagOrder | None = None,
    by_motion: Sequence[str] = (),
    targets: int | Sequence[str] | Literal["all"] | None = None,
    clocks: Mapping[str, Any],
    readouts: Mapping[str, Readout] | None = None,
    units: str = "in",
    where: str = "locate",
    **how: Any,
) -> Locations:
    """A run as its config describes it: `locate`, with coded tags beside the targets and read-outs from the motion.

    tags       of the run: the trajectories of their centres are added; with one camera they are those of their poses
    by_motion  cameras whose read-out the motion is to show
    how        all else that `locate` takes
    """
    both = {key: how.get(key) for key in ("pictures", "points")}
    if tags is not None:
        tables = {name: columns_of(table) for name, table in centroids.items()}
        names = [str(name) for table in tables.values() for name in table["target"]]
        targets = with_corners(targets, corner_names(names))
        if len(tables) == 1:
            (camera,) = tables
            own = clocks[camera] if isinstance(clocks[camera], Mapping) else {}
            poses = tag_poses(tables, cameras, tags, clocks={camera: own}, readouts=readouts, where=where, **both)
            return _by_one_camera(poses, camera, own, units)

    def once(tried: Mapping[str, Readout]) -> Locations:
        options = how | {"targets": targets, "clocks": clocks, "units": units, "where": where}
        return locate(centroids, cameras, readouts=tried, **options)

    if by_motion:
        done = sought_readouts(once, readouts or {}, by_motion, where)
        located: Locations = done.located
        readouts = done.readouts
        located.record["readout_by_motion"] = done.as_record()
        located.record["findings"] = [*located.record["findings"], *as_records(done.findings)]
    else:
        located = once(readouts or {})
    if tags is None:
        return located
    used, at = located.record["clocks"]["cameras"], columns_of(located.trajectories)
    poses = tag_poses(tables, cameras, tags, clocks=used, readouts=readouts, trajectories=at, where=where, **both)
    whole = pd.concat([located.trajectories, _centres(poses, corners=False)], ignore_index=True)
    if "outside" in whole:
        whole["outside"] = whole["outside"].fillna(False).astype(bool)
    return located._replace(trajectories=whole)


def _by_one_camera(poses: TagPoses, camera: str, clock: Mapping[str, Any], units: str) -> Locations:
    table = _centres(poses, corners=True)
    record = one_camera_run.record_of(camera, clock, units, len(table), int(table["x"].notna().sum()))
    return Locations(table, record, pd.DataFrame({n: [] for n in COLUMNS}), one_camera_run.no_sights(camera))


def _centres(poses: TagPoses, *, corners: bool) -> pd.DataFrame:
    """The trajectories of the tags' centres, and where they are asked for their corners."""
    return pd.concat([pd.DataFrame(part) for part in trajectory_rows(poses, corners=corners)], ignore_index=True)


def _shares(views: Sequence[View], readouts: Mapping[str, Readout], b: Array) -> Array | None:
    """The share (n_cameras, m, M) of each camera's read-out after which samples (n_cameras, m, M, 2) were seen."""
    if any(view.name not in readouts for view in views):
        return None
    return np.stack([readouts[view.name].share(own) for view, own in zip(views, b, strict=True)])


def _surveys(views: Sequence[View], points: Mapping[str, pd.DataFrame] | None, noise: float) -> list[Survey] | None:
    """The points of each calibration, where they and their tolerances are known of all."""
    if points is None or any(v.uncertainty is None or v.name not in points for v in views):
        return None
    return surveys_of([v.camera for v in views], [points[v.name] for v in views], noise)


def _outside(points: Mapping[str, pd.DataFrame] | None, volume: ArrayLike | None, table: pd.DataFrame) -> Array | None:
    """How far every located point lies outside the calibrated volume, world units; None where that is not known."""
    if volume is None:
        if not points:
            return None
        used = [t[t["used"].astype(bool)] if "used" in t else t for t in points.values()]
        volume = np.concatenate([t[["x", "y", "z"]].to_numpy(float) for t in used])
    return distance_outside(volume, table[["x", "y", "z"]].to_numpy(float))


def _table(at: Array, timecode: Labels, labels: Sequence[str], located: Located) -> pd.DataFrame:
    m = len(labels)
    columns: dict[str, Any] = {
        "time_s": np.tile(at, m),
        "timecode": np.tile(timecode, m),
        "target": np.repeat(np.array(labels, object), at.size),
    }
    columns |= dict(zip("xyz", located.point.reshape(-1, 3).T, strict=True))
    columns |= dict(zip(("sigma_x", "sigma_y", "sigma_z"), located.sigma.reshape(-1, 3).T, strict=True))
    columns |= {"miss": located.miss.ravel(), "n_cameras": located.n_cameras.ravel().astype(np.int64)}
    return pd.DataFrame(columns)
