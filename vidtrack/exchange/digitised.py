"""Positions in each camera's pictures, row by row of one camera's frames, as digitising programs keep them.

A row is a frame of the first camera, whose moments are those of the trajectories; another camera's frame stands in the
row that is nearest in time, by a whole number of frames for each camera (its offset). Nothing is interpolated between
frames; a note says how far a camera's moments are from those of its rows. Of an interlaced frame the first field is
taken, because these programs count frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.ideal_to_distorted import straight
from vidtrack.exchange.measured import TIME_DECIMALS, Run, series
from vidtrack.geometry.camera import Camera, frame_buffer_from_distorted, undistorted_from_frame_buffer
from vidtrack.timing.clock import Clock

if TYPE_CHECKING:
    from pandas import Series


COLUMNS = ["frame", "time_s", "Xf", "Yf"]
MOMENT = 1e-6
"""s, within which two times are one."""
MUCH = 1e-3
"""Of a frame, beyond which it is said that a camera's moments are beside those of its rows."""


class Digitised(NamedTuple):
    """Rows n, targets m, cameras c.

    names (m,), cameras (c,); b (n, m, c, 2) frame buffer px as in the pictures; flat (n, m, c, 2) without lens
    distortion: where a pinhole of the same f, Cx, Cy sees them; xyz (n, m, 3) world units; offsets (c,) frames
    """

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    b: Array
    flat: Array
    xyz: Array
    offsets: Any
    notes: list[str]


class _Frames(NamedTuple):
    """A camera's frames (k,) and their moments (k,), s, on the run's time."""

    number: Any
    time: Array


def digitised(run: Run) -> Digitised:
    """The measured positions of each target in each camera; VidtrackError where nothing joins them."""
    if not run.cameras:
        raise VidtrackError("no calibrated camera. Call vidtrack run first.")
    cameras = tuple(straight(run.cameras[name]) for name in sorted(run.cameras))
    names = [camera.name for camera in cameras]
    frames = [_frames(run, name) for name in names]
    s = series(run.tables["trajectories"])
    first = _reference(frames, s.time)
    order = [first, *(i for i in range(len(names)) if i != first)]
    cameras, names = tuple(cameras[i] for i in order), [names[i] for i in order]
    frames = [frames[i] for i in order]
    rows = int(frames[0].number.max()) + 1 if len(frames[0].number) else 0
    time = np.full(rows, np.nan)
    time[frames[0].number] = frames[0].time
    offsets, notes = _offsets(names, frames)
    b = np.full((rows, len(s.names), len(names), 2), np.nan)
    for c, name in enumerate(names):
        for m, target in enumerate(s.names):
            number, px = _seen(run, name, target)
            row = number - offsets[c]
            inside = (row >= 0) & (row < rows)
            b[row[inside], m, c] = px[inside]
    flat = np.stack([without_lens(camera, b[:, :, c]) for c, camera in enumerate(cameras)], 2)
    xyz = np.full((rows, len(s.names), 3), np.nan)
    known = np.flatnonzero(np.isfinite(time))
    at = np.searchsorted(s.time.round(TIME_DECIMALS), time[known].round(TIME_DECIMALS))
    at = np.minimum(at, max(len(s.time) - 1, 0))
    if len(s.time):
        same = np.abs(s.time[at] - time[known]) < 2e-6
        xyz[known[same]] = s.stacked("x", "y", "z")[at[same]]
    shift = [np.nanmax(np.abs(flat[:, :, c] - b[:, :, c]), initial=0.0) for c in range(len(names))]
    for c, name in enumerate(names):
        notes.append(f"camera {c + 1} is {name}; its lens moves the points by up to {shift[c]:.3g} px")
    return Digitised(s.names, cameras, b, flat, xyz, offsets, notes)


def coefficients(camera: Camera, picture: Array) -> Array:
    """The 11 coefficients of the direct linear transformation, of the camera without its lens terms.

    picture   (3, 3), from frame buffer px (Xf, Yf, 1) to the program's pixels
    VidtrackError where the world's origin lies in the plane of the camera: the coefficients have no finite values.
    """
    inner = np.array([[camera.Sx / camera.dx, camera.skew / camera.dx, 0], [0, 1 / camera.dy, 0], [0, 0, 1]])
    inner[:2] *= camera.f
    inner[:2, 2] = camera.Cx, camera.Cy
    P = picture @ inner @ np.concatenate([camera.R, camera.T[:, None]], 1)
    if abs(P[2, 3]) < 1e-9 * float(np.linalg.norm(camera.T)):
        raise VidtrackError(f"camera {camera.name}: the world's origin lies beside it, so that it has no coefficients.")
    return np.asarray((P / P[2, 3]).ravel()[:11])


def _frames(run: Run, camera: str) -> _Frames:
    """The first field of each frame of a camera."""
    moments = _first_fields(run, camera)
    clock = Clock(**run.clocks.get(camera, {}))
    return _Frames(moments.index.to_numpy(np.int64), clock.corrected(moments.to_numpy(float)))


def _first_fields(run: Run, camera: str) -> Series:
    """The time of the first field of each frame, by frame, without the clock."""
    return run.centroids[camera][["frame", "time_s"]].dropna().groupby("frame")["time_s"].min()


def _reference(frames: list[_Frames], time: Array) -> int:
    """The camera most of whose moments are those of the trajectories, the first of several."""
    own = time.round(TIME_DECIMALS)
    return int(np.argmax([np.isin(f.time.round(TIME_DECIMALS), own).sum() for f in frames]))


def _offsets(names: list[str], frames: list[_Frames]) -> tuple[Any, list[str]]:
    """Whole frames by which each camera's count is ahead, and notes of what they leave."""
    offsets, notes = np.zeros(len(names), np.int64), []
    first = frames[0]
    for c, own in enumerate(frames[1:], 1):
        both = (first.time >= own.time[0]) & (first.time <= own.time[-1]) if len(own.time) else np.zeros(0, bool)
        if not both.any():
            raise VidtrackError(f"camera {names[c]}: it was not recording together with {names[0]}.")
        ahead = np.interp(first.time[both], own.time, own.number) - first.number[both]
        offsets[c] = round(float(np.median(ahead)))
        left = float(np.abs(ahead - offsets[c]).max())
        if left > MUCH:
            notes.append(f"{names[c]}: its frames lie up to {left:.3g} of a frame from the moments of their rows")
    return offsets, notes


def _seen(run: Run, camera: str, target: str) -> tuple[Any, Array]:
    """Frames (k,) in whose first field a camera measured a target, and where (k, 2) px: by what located it."""
    joined = run.tables["associations"]
    joined = joined[(joined["camera"] == camera) & (joined["target"] == target)]
    tracklets, centroids = run.tracklets[camera], run.centroids[camera]
    parts = [tracklets[tracklets["tracklet"].isin(joined["tracklet"])][COLUMNS]]
    alone = joined[joined["tracklet"] < 0]  # what the centroid table alone shows
    at = centroids["time_s"].to_numpy(float)
    for track, start, end in zip(
        alone["track"].astype(str), alone["start_s"].to_numpy(float), alone["end_s"].to_numpy(float), strict=True
    ):
        inside = (at >= start - MOMENT) & (at <= end + MOMENT) & (centroids["target"].astype(str) == track)
        parts.append(centroids[inside][COLUMNS])
    frame, time, b = [], [], []
    for part in parts:
        whole = part.dropna()
        frame.append(whole["frame"].to_numpy(np.int64))
        time.append(whole["time_s"].to_numpy(float))
        b.append(whole[["Xf", "Yf"]].to_numpy(float))
    numbers, moments, px = np.concatenate(frame), np.concatenate(time), np.concatenate(b)
    first = _first_fields(run, camera)
    early = np.abs(first.reindex(numbers).to_numpy(float) - moments) < MOMENT
    return numbers[early], px[early]


def without_lens(camera: Camera, b: Array) -> Array:
    """Where a pinhole of the same f, Cx, Cy sees what the camera sees at b (..., 2), px; NaN beyond its lens."""
    pinhole = camera.without_lens().with_(projection="perspective", skew=camera.skew)
    return frame_buffer_from_distorted(pinhole, undistorted_from_frame_buffer(camera, b))
