"""Stage tag_poses: coded tags on a body, seen by one camera or several, become its six degrees of freedom.

The pose is fitted to the corners in the pictures of all cameras at once, so that one camera is enough, and two are
used for all that they know. See `motion.sighted_pose`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.location.followed import rows_of, view_of
from vidtrack.location.run_pictures import Pictures, camera_shown, windows
from vidtrack.location.shared_survey import joint_of, surveys_of
from vidtrack.location.views import Seen, View, brought, same_day, timecodes
from vidtrack.motion.planar_start import planar_start
from vidtrack.motion.scale import scale_of
from vidtrack.motion.sighted_pose import Placed, SightedPose, Sightings, sighted_pose, with_calibration
from vidtrack.motion.tag_body import LIMITS, TagPose, body_columns, findings_of, record_of, tag_columns
from vidtrack.timing.clock import Clock
from vidtrack.timing.readout import Readout, at_frame_time
from vidtrack.timing.resample import common_times

if TYPE_CHECKING:
    from pandas import DataFrame

CORNER = re.compile(r"tag(\d+)_([1-4])$")
SQUARE = ((-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (0.5, -0.5, 0.0), (-0.5, -0.5, 0.0))
"""A tag of side 1 in its own axes: x to the right as it is read, y up, z out of its face."""


class TagPoses(NamedTuple):
    """What the stage gives: poses of each body at the moments `at`, a record, and findings."""

    at: Array
    timecode: NDArray[np.object_]
    poses: list[TagPose]
    record: dict[str, Any]
    findings: list[Finding]


def tag_poses(
    centroids: Mapping[str, DataFrame],
    calibrated: Mapping[str, Any],
    *,
    size: float,
    sigma: float = 0.0,
    ids: Sequence[int] | None = None,
    bodies: Mapping[str, Mapping[str, Sequence[Sequence[float]]]] | None = None,
    clocks: Mapping[str, Mapping[str, float]] | None = None,
    pictures: Mapping[str, Pictures] | None = None,
    points: Mapping[str, DataFrame] | None = None,
    readouts: Mapping[str, Readout] | None = None,
    targets: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
    trajectories: DataFrame | None = None,
    where: str = "tags",
) -> TagPoses:
    """The poses of all bodies with tags.

    centroids   camera: a table that has corners of tags among its targets (tag7_1 ... tag7_4)
    calibrated  camera: (Camera, Uncertainty or None[, record])
    size        world units, a tag's side; sigma: its standard deviation
    ids         numbers of the tags that count; None: those of the bodies, and every other as a body of its own
    bodies      body: {tag's number: its corners (4, 3) in the body's axes}
    clocks      camera: offset_s, rate_ppm and where they are estimated offset_s_sd
    points      camera: points.parquet, for what the calibrations have in common
    targets     body: {other target on it: its place in the body's axes}, whose positions `trajectories` has
    A tag that is in no body is one by itself, tag7: its origin in its centre, x to the right as it is read, y up, z out
    of its face.
    Raises VidtrackError where no camera saw any tag.
    """
    views, slips = _views(centroids, calibrated, clocks or {}, pictures or {}, readouts or {}, where)
    times = [v.t for v in views]
    at, whose = common_times(times)
    seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
    there = sorted({int(match[1]) for v in views for name in v.named if (match := CORNER.match(name))})
    if not there:
        raise VidtrackError(
            f"{where}: no camera saw a coded tag. Are they of the family that the config names, with a white margin, "
            "sharp, and at least 20 px a side?"
        )
    cameras = [v.camera for v in views]
    known = [v.uncertainty for v in views]
    joint = _joint(calibrated, views, points)
    wanted = _bodies(there, bodies or {}, ids, size)
    out, findings = [], _strangers(there, bodies or {}, ids, where)
    for name, tags in wanted.items():
        b, sd = _corners(views, seen, list(tags), at, slips)
        body = np.array([corner for place in tags.values() for corner in place], float)
        placed = _placed((targets or {}).get(name) or {}, trajectories, at)
        own = _one(name, tuple(tags), body, Sightings(cameras, b, sd, body, placed), known, joint, size, sigma)
        out.append(own)
        findings += findings_of(own, size, where)
    return TagPoses(at, timecodes(views, times, at, whose), out, {"bodies": record_of(out)}, findings)


def _views(
    centroids: Mapping[str, DataFrame],
    calibrated: Mapping[str, Any],
    clocks: Mapping[str, Mapping[str, float]],
    pictures: Mapping[str, Pictures],
    readouts: Mapping[str, Readout],
    where: str,
) -> tuple[list[View], list[float]]:
    """Each camera's corners at its own times, corrected, and by how many s that may be wrong."""
    if missing := [name for name in centroids if name not in calibrated]:
        raise VidtrackError(
            *(f"{where}: camera {c} has no calibration. Add calibration clips or drop its video." for c in missing)
        )
    shown, _ = windows(pictures, where)
    views = []
    for name, table in centroids.items():
        own = table[table["target"].astype(str).str.match(CORNER)]
        rows = rows_of({str(column): own[column].to_numpy() for column in own})
        camera, uncertainty = camera_shown(calibrated[name][0], calibrated[name][1], shown.get(name))
        view = view_of(name, rows, None, camera, uncertainty)
        if name in readouts:
            view = view._replace(b=at_frame_time(view.t, view.b, readouts[name]))
        views.append(view)
    views = [v for v in same_day(views) if v.t.size]
    given = [clocks.get(v.name) or {} for v in views]
    out = [
        v._replace(t=Clock(own.get("offset_s", 0.0), own.get("rate_ppm", 0.0)).corrected(v.t))
        for v, own in zip(views, given, strict=True)
    ]
    return out, [float(own.get("offset_s_sd") or 0.0) for own in given]


def _joint(
    calibrated: Mapping[str, Any], views: Sequence[View], points: Mapping[str, DataFrame] | None
) -> Array | None:
    """What the calibrations of the cameras have in common."""
    uncertainties, cameras = [v.uncertainty for v in views], [v.camera for v in views]
    surveyed = points is not None and all(v.uncertainty is not None and v.name in points for v in views)
    surveys = surveys_of(cameras, [points[v.name] for v in views], 1.0) if surveyed and points else None
    return joint_of([calibrated[v.name] for v in views], cameras, uncertainties, surveys) if len(views) > 1 else None


def _bodies(
    there: Sequence[int],
    bodies: Mapping[str, Mapping[str, Sequence[Sequence[float]]]],
    ids: Sequence[int] | None,
    size: float,
) -> dict[str, dict[int, Sequence[Sequence[float]]]]:
    """Body: its tags that were seen, with their corners; tags of no body by themselves."""
    wanted: dict[str, dict[int, Sequence[Sequence[float]]]] = {}
    for name, tags in bodies.items():
        own = {int(number): place for number, place in tags.items() if int(number) in there}
        if own:
            wanted[name] = own
    used = {number for tags in bodies.values() for number in map(int, tags)}
    square = (size * np.array(SQUARE)).tolist()
    for number in there:
        if number not in used and (ids is None or number in ids):
            wanted[f"tag{number}"] = {number: square}
    return wanted


def _strangers(
    there: Sequence[int], bodies: Mapping[str, Mapping[str, Any]], ids: Sequence[int] | None, where: str
) -> list[Finding]:
    """Tags that the config gives bodies for, but not these."""
    used = {number for tags in bodies.values() for number in map(int, tags)}
    strange = [number for number in there if number not in used and (ids is None or number not in ids)]
    if not used or not strange:
        return []
    names = ", ".join(f"tag {number}" for number in strange[:8])
    text = f"{where}: {names} is seen, but is on no body of the config: its pose is given by itself"
    return [
        Finding(
            "note", "tag-not-in-body", text, "Add it to the tags of its body, or name in tags.ids those that count."
        )
    ]


def _corners(
    views: Sequence[View], seen: Sequence[Seen], tags: list[int], at: Array, slips: Sequence[float]
) -> tuple[Array, Array]:
    """Corners (C, T, 4 n, 2) px of some tags and their sd; a tag of which a corner is missing is left out whole."""
    C, T = len(views), at.size
    b, sd = np.full((C, T, 4 * len(tags), 2), np.nan), np.full((C, T, 4 * len(tags), 2), np.nan)
    for c, (view, own) in enumerate(zip(views, seen, strict=True)):
        for k, number in enumerate(tags):
            rows = [
                view.tracks.index(f"tag{number}_{i}") if f"tag{number}_{i}" in view.tracks else -1 for i in range(1, 5)
            ]
            if min(rows) < 0:
                continue
            corners = own.b[rows].swapaxes(0, 1)
            noise = own.sd[rows].swapaxes(0, 1)
            if slips[c] > 0 and at.size > 1:
                velocity = np.nan_to_num(np.gradient(corners, at, axis=0))
                noise = np.hypot(noise, velocity * slips[c])
            whole = np.isfinite(corners).all((-1, -2)) & np.isfinite(noise).all((-1, -2))
            b[c, whole, 4 * k : 4 * k + 4] = corners[whole]
            sd[c, whole, 4 * k : 4 * k + 4] = noise[whole]
    return b, sd


def _placed(targets: Mapping[str, Sequence[float]], trajectories: DataFrame | None, at: Array) -> Placed | None:
    """Where the other targets of a body were located at the moments `at`."""
    if not targets or trajectories is None:
        return None
    p, W = np.full((at.size, len(targets), 3), np.nan), np.zeros((at.size, len(targets), 3, 3))
    moment = {time: i for i, time in enumerate(np.round(at, 6).tolist())}
    for k, name in enumerate(targets):
        rows = trajectories[trajectories["target"].astype(str) == str(name)]
        place, sigma = (rows[[f"{word}{axis}" for axis in "xyz"]].to_numpy(float) for word in ("", "sigma_"))
        for time, own, sd in zip(rows["time_s"].round(6).tolist(), place, sigma, strict=True):
            if time in moment and np.isfinite(own).all() and (sd > 0).all():
                p[moment[time], k], W[moment[time], k] = own, np.diag(sd**-2.0)
    return Placed(np.array(list(targets.values()), float), p, W)


def _start(seen: Sightings, n_tags: int) -> tuple[Array, Array]:
    """A first pose at every time: by the tag that is largest in any camera's picture."""
    C, T = seen.b.shape[:2]
    origin, R, best = np.full((T, 3), np.nan), np.full((T, 3, 3), np.nan), np.zeros(T)
    for c in range(C):
        for k in range(n_tags):
            part = slice(4 * k, 4 * k + 4)
            corners = seen.b[c, :, part]
            diagonal = np.linalg.norm(corners[:, 2] - corners[:, 0], axis=-1)
            better = np.flatnonzero(np.nan_to_num(diagonal) > best)
            if not better.size:
                continue
            o, r = planar_start(seen.cameras[c], corners[better], seen.body[part])
            real = np.isfinite(o).all(-1)
            at = better[real]
            origin[at], R[at], best[at] = o[real], r[real], diagonal[at]
    return origin, R


def _one(
    name: str,
    tags: tuple[int, ...],
    body: Array,
    seen: Sightings,
    known: Sequence[CameraUncertainty | None],
    joint: Array | None,
    size: float,
    sigma: float,
) -> TagPose:
    start = _start(seen, len(tags))
    pose = sighted_pose(seen, start, known)
    reduced = _reduced(pose)
    factor = max(1.0, reduced)
    if factor > 1.0:  # what the corners scatter beyond their sd, of which the choice between two poses must know
        seen = seen._replace(sd=seen.sd * np.sqrt(factor))
        pose = sighted_pose(seen, start, known)
    covariance = with_calibration(pose, known, joint)
    centres = np.repeat(body.reshape(-1, 4, 3).mean(1), 4, axis=0)
    scale = scale_of(seen, pose, body - centres)
    if sigma > 0:
        covariance = covariance + scale.covariance_of(sigma / size)
    points = np.isfinite(seen.b).all(-1)
    n_cameras = points.any(-1).sum(0)
    misfit = pose.chi2 > LIMITS.misfit * np.maximum(pose.spare, 1)
    missing = ~np.isfinite(pose.origin[:, 0])
    words = {"missing": missing, "ambiguous": pose.unsure, "misfit": misfit & ~missing}
    flag = [";".join(word for word, rows in words.items() if rows[i]) for i in range(len(missing))]
    hidden = np.where(pose.unsure, np.nan, 1.0)  # of two poses neither is given
    pose = pose._replace(origin=pose.origin * hidden[:, None], R=pose.R * hidden[:, None, None])
    covariance = covariance * hidden[:, None, None]
    return TagPose(name, tags, body, pose, covariance, factor, points.sum((0, 2)), n_cameras, flag, scale)


def _reduced(pose: SightedPose) -> float:
    """Misfit of a run over what the corners' sd explain; samples that are far off do not count."""
    good = np.isfinite(pose.chi2) & (pose.spare > 0)
    if good.sum() < 10:
        return 1.0
    each = pose.chi2[good] / pose.spare[good]
    kept = each <= 10 * max(np.median(each), 0.1)
    return float(pose.chi2[good][kept].sum() / pose.spare[good][kept].sum())


def table_of(done: TagPoses) -> DataFrame:
    """The poses as rows of bodies.parquet, and n_cameras."""
    import pandas as pd

    return pd.concat([pd.DataFrame(body_columns(own, done.at, done.timecode)) for own in done.poses], ignore_index=True)


def trajectories_of(done: TagPoses, *, corners: bool) -> DataFrame:
    """Where each tag's centre was, and where they are asked for its corners, as rows of trajectories.parquet."""
    import pandas as pd

    parts = [part for own in done.poses for part in tag_columns(own, done.at, done.timecode, corners=corners)]
    return pd.concat([pd.DataFrame(part) for part in parts], ignore_index=True)
