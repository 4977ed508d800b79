"""Stage steadiness: the background of every camera of a run, compared with its calibration and along the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.picture_part import Window
from vidtrack.steadiness.clips import clips_from_record, covers
from vidtrack.steadiness.findings import CameraCase, findings_of
from vidtrack.steadiness.flipped import flipped
from vidtrack.steadiness.follow import movement_at, undone
from vidtrack.steadiness.history import LIMITS, History, displaced, episode, history, since_calibration
from vidtrack.steadiness.patches import CHOICE
from vidtrack.steadiness.samples import in_averaged
from vidtrack.steadiness.series import Course, covered
from vidtrack.steadiness.turn import Law, law_of_camera, law_of_picture

THETA = ("theta_1", "theta_2", "theta_3", "zoom")
"""Columns of the table that hold `Turn.theta`."""

PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]
COVARIANCES = tuple(f"cov_{i + 1}{j + 1}" for i, j in PAIRS)


class Calibration(NamedTuple):
    """What the calibration's clips show of one camera's background.

    picture  (h, w) grey levels, of the clip `clip`; balls (n, 3) px: Xf, Yf and radius of each
    clips    `ClipMovements.as_record`, and how many points the calibration has of each clip
    """

    picture: NDArray[Any]
    balls: Array
    clips: Mapping[str, Any]
    counts: Mapping[str, int]


def calibration_of(
    picture: NDArray[Any], sightings: pd.DataFrame, labelling: Mapping[str, Any], clip: str | None = None
) -> Calibration:
    """What the calibration's records say of one camera.

    sightings, labelling   of rule calibration_points
    clip   the only one that places the run, as in a plane; None: all clips
    """
    found = sightings[sightings["found"]]
    own = found[found["clip"] == labelling["background"]["clip"]]
    counts = {str(name): int(n) for name, n in found.groupby("clip").size().items()}
    if clip:
        counts = {name: n for name, n in counts.items() if name == clip}
    return Calibration(picture, covers(own[["Xf", "Yf"]], own["pixels"]), labelling.get("steadiness") or {}, counts)


class Background(NamedTuple):
    """What is known of one camera in a run.

    course    a row a frame and patch: frame, time_s, patch, Xf, Yf (px at the beginning), dx, dy, sd_x, sd_y (px)
    picture   (h, w) its background at the beginning, grey levels; block: px of the recording a px of it, either way
    size      px, width and height of the recording's picture
    camera    as the run's pictures have it; None where the run uses no calibration
    window    what the run shows of the calibration's picture, where that is another
    calibration  None where there is no clip of it
    per_px    world units that a px spans at the calibration points; None where not known
    """

    course: pd.DataFrame
    picture: NDArray[Any]
    block: int
    size: tuple[int, int]
    camera: Camera | None = None
    window: Window | None = None
    calibration: Calibration | None = None
    per_px: float | None = None


class Steadiness(NamedTuple):
    """What the stage gives.

    table   a row a camera and moment: camera, frame, time_s, THETA, COVARIANCES, shift_px, sd_px (rms over the
            picture, since the calibration where that is known), patches, flag
    record  by camera what was found, and findings
    """

    table: pd.DataFrame
    record: dict[str, Any]


def steadiness(
    backgrounds: Mapping[str, Background], *, where: str = "run", units: str = "", follow: bool = False
) -> Steadiness:
    """Whether each camera of a run stood where it was calibrated, and stayed there.

    follow  whether positions are corrected by what is found here: what is not known is then a doubt
    """
    parts, cameras = [], {}
    findings: list[Finding] = []
    for name, own in backgrounds.items():
        law = law_of_camera(own.camera) if own.camera is not None else law_of_picture(own.size)
        found = _history(own, law)
        moved = [displaced(law, *values, own.size) for values in zip(found.theta, found.covariance, strict=True)]
        parts.append(_rows(name, own.course, found, [each[:2] for each in moved]))
        start = None
        if found.since is not None and not found.since.why and len(moved):
            start = next((each for each, why in zip(moved, found.why, strict=True) if not why), None)
        along = episode(found, law, own.size)
        flip, part = _flipped(own, found), own.window is not None
        case = CameraCase(name, where, found, start, along, own.per_px, units, follow, flip, part)
        findings += findings_of(case)
        cameras[name] = case.record()
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
    return Steadiness(table, {"follow": follow, "cameras": cameras, "findings": as_records(findings)})


def _history(own: Background, law: Law) -> History:
    course, time = course_of(own.course)
    known = own.calibration
    if known is None or not len(course.middles):
        return history(course, time, law, own.size)
    shut = _shut(own, known)
    begun = np.asarray(own.picture, np.float32)
    since, alike = since_calibration(_as_in_run(own, known.picture), begun, law, own.size, own.block, shut)
    at_rest = None
    if own.window is None:  # how its clips differ is known in px of the calibration's picture
        at_rest = clips_from_record(known.clips).mean(known.counts, law, own.size)
    return history(course, time, law, own.size, since, alike, at_rest)


def _flipped(own: Background, found: History) -> str | None:
    """How the run's pictures are mirrored or turned beside the calibration's, where they resemble it nowhere."""
    if own.calibration is None or not found.resembles < LIMITS.unlike:
        return None
    calibrated = _as_in_run(own, own.calibration.picture)
    return flipped(calibrated, np.asarray(own.picture, np.float32), own.block, _shut(own, own.calibration))


def course_of(table: pd.DataFrame) -> tuple[Course, Array]:
    """The course that a table holds, and its times (k,) s."""
    frames, first = np.unique(table["frame"].to_numpy(np.int64), return_index=True)
    time = table["time_s"].to_numpy(float)[first]
    k = max(len(frames), 1)
    columns = table.sort_values(["frame", "patch"], kind="stable")
    values = columns[["Xf", "Yf", "dx", "dy", "sd_x", "sd_y"]].to_numpy(float).reshape(k, -1, 6)
    return Course(values[0, :, :2], frames, values[: len(frames), :, 2:4], values[: len(frames), :, 4:]), time


def at_rest(table: pd.DataFrame, moved: pd.DataFrame, law: Law) -> pd.DataFrame:
    """A table of centroids as the camera would have given it from where it was calibrated.

    table   time_s, Xf, Yf and, where they are known, sd_x, sd_y (px), which grow by what is not known of the movement
    moved   one camera's rows of `Steadiness.table`, on the same scale of time
    Where nothing is known of the movement the table stays as it is.
    """
    if not moved["theta_1"].notna().any():
        return table
    spread = np.empty((len(moved), 4, 4))
    for word, (i, j) in zip(COVARIANCES, PAIRS, strict=True):
        spread[:, i, j] = spread[:, j, i] = moved[word]
    times = moved["time_s"].to_numpy(float)
    at, back = np.unique(table["time_s"].to_numpy(float), return_inverse=True)
    theta, covariance = movement_at(times, moved[list(THETA)].to_numpy(float), spread, at)
    rest = undone(law, table[["Xf", "Yf"]].to_numpy(float), theta[back], covariance[back])
    sds = [name for name in ("sd_x", "sd_y") if name in table]
    grown = {name: np.hypot(table[name], np.sqrt(rest.variance[:, i])) for i, name in enumerate(sds)}
    return table.assign(Xf=rest.b[:, 0], Yf=rest.b[:, 1], **grown)


def _as_in_run(own: Background, picture: NDArray[Any]) -> NDArray[np.float32]:
    """The calibration's picture (h, w) as the run's, averaged in the same way, would show it."""
    values = np.asarray(picture, np.float32)
    rows, columns = own.picture.shape
    if own.window is None and own.block == 1 and values.shape == (rows, columns):
        return values
    size = (columns * own.block, rows * own.block)
    if own.window is not None:
        x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        at = own.window.back(np.stack([x, y], -1)).astype(np.float32)
        values = cv2.remap(values, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    values = np.ascontiguousarray(values[: size[1], : size[0]])
    answer: NDArray[np.float32] = cv2.resize(values, (columns, rows), interpolation=cv2.INTER_AREA)
    return answer


def _shut(own: Background, known: Calibration) -> NDArray[np.bool_]:
    """Where no patch of the calibration may lie: its balls are gone in the run."""
    at, radius = known.balls[:, :2], known.balls[:, 2]
    if own.window is not None:
        at, radius = own.window.seen(at), radius * float(own.window.scale.max())
    rows, columns = own.picture.shape
    return covered((columns, rows), in_averaged(at, own.block), radius / own.block + CHOICE.blur * 2 + 2)


def _rows(name: str, course: pd.DataFrame, own: History, moved: list[tuple[float, float]]) -> pd.DataFrame:
    px, sd = np.array(moved, float).reshape(-1, 2).T
    columns: dict[str, Any] = {"camera": np.full(len(px), name, object)}
    columns |= {"frame": np.unique(course["frame"].to_numpy(np.int64)), "time_s": own.time}
    columns |= dict(zip(THETA, own.theta.T, strict=True))
    columns |= {word: own.covariance[:, i, j] for word, (i, j) in zip(COVARIANCES, PAIRS, strict=True)}
    columns |= {"shift_px": px, "sd_px": sd, "patches": own.patches, "flag": np.array(own.why, object)}
    return pd.DataFrame(columns)
