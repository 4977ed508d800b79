"""Coded tags on a body, seen by one camera or several, become its six degrees of freedom.

The pose is fitted to the corners in the pictures of all cameras at once, so that one camera is enough, and two are
used for all that they know. See `motion.sighted_pose`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.location.cameras.followed import rows_of, view_of
from vidtrack.location.cameras.run_pictures import Columns, Pictures, camera_shown, windows
from vidtrack.location.cameras.views import View, brought, same_day, timecodes
from vidtrack.location.sight_lines.shared_survey import joint_of, surveys_of
from vidtrack.motion.planar_start import planar_start
from vidtrack.motion.scale import scale_of
from vidtrack.motion.sighted_pose import Placed, SightedPose, Sightings, sighted_pose, with_calibration
from vidtrack.motion.tag_body import LIMITS, TagPose, body_columns, findings_of, record_of, tag_columns
from vidtrack.tags.corners import CORNER, SQUARE, corners_of
from vidtrack.timing.clock import Clock
from vidtrack.timing.readout import Readout, at_frame_time
from vidtrack.timing.resample import common_times


class TagOrder(NamedTuple):
    """What the config says of a run's coded tags.

    size        world units, a tag's side; sigma: its standard deviation
    ids         numbers of the tags that count; None: those of the bodies, and every other as a body of its own
    bodies      body: {tag's number: its corners (4, 3) in the body's axes}
    targets     body: {other target on it: its place in the body's axes}
    """

    size: float
    sigma: float = 0.0
    ids: Sequence[int] | None = None
    bodies: Mapping[str, Mapping[str, Sequence[Sequence[float]]]] = {}
    targets: Mapping[str, Mapping[str, Sequence[float]]] = {}


class TagPoses(NamedTuple):
    """What `tag_poses` gives: poses of each body at the moments `at`, a record, and findings."""

    at: Array
    timecode: NDArray[np.object_]
    poses: list[TagPose]
    record: dict[str, Any]
    findings: list[Finding]


def tag_poses(
    centroids: Mapping[str, Mapping[str, NDArray[Any]]],
    calibrated: Mapping[str, Any],
    order: TagOrder,
    *,
    clocks: Mapping[str, Mapping[str, float]] | None = None,
    pictures: Mapping[str, Pictures] | None = None,
    points: Mapping[str, Columns] | None = None,
    readouts: Mapping[str, Readout] | None = None,
    trajectories: Mapping[str, NDArray[Any]] | None = None,
    where: str = "tags",
) -> TagPoses:
    """The poses of all bodies with tags.

    centroids   camera: columns of a table that has corners of tags among its targets (tag7_1 ... tag7_4)
    calibrated  camera: (Camera, Uncertainty or None[, record])
    clocks      camera: offset_s, rate_ppm and where they are estimated offset_s_sd
    points      camera: points.parquet, for what the calibrations have in common
    trajectories   columns with the positions of the order's other targets
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
    wanted = _bodies(there, order)
    out, findings = [], _in_no_body(there, order, where)
    for name, tags in wanted.items():
        b, sd = corners_of(views, seen, list(tags), at, slips)
        body = np.array([corner for place in tags.values() for corner in place], float)
        placed = _placed(order.targets.get(name) or {}, trajectories, at)
        own = _one(name, tuple(tags), Sightings(cameras, b, sd, body, placed), known, joint, order)
        out.append(own)
        findings += findings_of(own, order.size, where)
    return TagPoses(at, timecodes(views, times, at, whose), out, {"bodies": record_of(out)}, findings)


def _views(
    centroids: Mapping[str, Mapping[str, NDArray[Any]]],
    calibrated: Mapping[str, Any],
    clocks: Mapping[str, Mapping[str, float]],
    pictures: Mapping[str, Pictures],
    readouts: Mapping[str, Readout],
    where: str,
) -> tuple[list[View], list[float]]:
    """Each camera's corners at its own times, corrected, and by how many s that may be wrong."""
    if missing := [name for name in centroids if name not in calibrated]:
        raise VidtrackError(
            *(f"{where}: camera {c} has no calibration. Add calibration clips, or remove its video." for c in missing)
        )
    shown, _ = windows(pictures, where)
    views = []
    for name, table in centroids.items():
        own = np.array([CORNER.match(str(target)) is not None for target in table["target"]], bool)
        rows = rows_of({column: values[own] for column, values in table.items()})
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


def _joint(calibrated: Mapping[str, Any], views: Sequence[View], points: Mapping[str, Columns] | None) -> Array | None:
    """What the calibrations of the cameras have in common."""
    uncertainties, cameras = [v.uncertainty for v in views], [v.camera for v in views]
    surveyed = points is not None and all(v.uncertainty is not None and v.name in points for v in views)
    surveys = surveys_of(cameras, [points[v.name] for v in views], 1.0) if surveyed and points else None
    return joint_of([calibrated[v.name] for v in views], cameras, uncertainties, surveys) if len(views) > 1 else None


def _bodies(there: Sequence[int], order: TagOrder) -> dict[str, dict[int, Sequence[Sequence[float]]]]:
    """Body: its tags that were seen, with their corners; tags of no body by themselves."""
    wanted: dict[str, dict[int, Sequence[Sequence[float]]]] = {}
    for name, tags in order.bodies.items():
        own = {int(number): place for number, place in tags.items() if int(number) in there}
        if own:
            wanted[name] = own
    used = {number for tags in order.bodies.values() for number in map(int, tags)}
    square = (order.size * np.array(SQUARE)).tolist()
    for number in there:
        if number not in used and (order.ids is None or number in order.ids):
            wanted[f"tag{number}"] = {number: square}
    return wanted


def _in_no_body(there: Sequence[int], order: TagOrder, where: str) -> list[Finding]:
    """Tags that were seen and are on no body, where the config gives bodies with tags."""
    used = {number for tags in order.bodies.values() for number in map(int, tags)}
    others = [number for number in there if number not in used and (order.ids is None or number not in order.ids)]
    if not used or not others:
        return []
    names = ", ".join(f"tag {number}" for number in others[:8])
    text = f"{where}: {names} is seen, but is on no body of the config: its pose is given by itself"
    cure = "Add each tag to the tags of its body, or name in tags.ids the tags to be used."
    return [Finding("note", "tag-not-in-body", text, cure)]


def _placed(
    targets: Mapping[str, Sequence[float]], trajectories: Mapping[str, NDArray[Any]] | None, at: Array
) -> Placed | None:
    """Where the other targets of a body were located at the moments `at`."""
    if not targets or trajectories is None:
        return None
    p, W = np.full((at.size, len(targets), 3), np.nan), np.zeros((at.size, len(targets), 3, 3))
    moment = {time: i for i, time in enumerate(np.round(at, 6).tolist())}
    whose = np.asarray(trajectories["target"]).astype(str)
    for k, name in enumerate(targets):
        rows = whose == str(name)
        place, sigma = (
            np.stack([np.asarray(trajectories[f"{word}{axis}"], float)[rows] for axis in "xyz"], -1)
            for word in ("", "sigma_")
        )
        times = np.round(np.asarray(trajectories["time_s"], float)[rows], 6).tolist()
        for time, own, sd in zip(times, place, sigma, strict=True):
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
    seen: Sightings,
    known: Sequence[CameraUncertainty | None],
    joint: Array | None,
    order: TagOrder,
) -> TagPose:
    body = seen.body
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
    if order.sigma > 0:
        covariance = covariance + scale.covariance_of(order.sigma / order.size)
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


def pose_rows(done: TagPoses) -> Iterator[dict[str, Any]]:
    """The poses, body by body, as columns of bodies.parquet, and n_cameras."""
    return (body_columns(own, done.at, done.timecode) for own in done.poses)


def trajectory_rows(done: TagPoses, *, corners: bool) -> Iterator[dict[str, Any]]:
    """Where each tag's centre was, and where they are asked for its corners, as columns of trajectories.parquet."""
    return (part for own in done.poses for part in tag_columns(own, done.at, done.timecode, corners=corners))
