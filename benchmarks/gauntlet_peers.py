"""What the usual chain of other programs makes of a scene of the gauntlet: matched frame by frame, then linked.

At each moment detections of two cameras that lie within the tolerance of each other's epipolar lines are triangulated
by OpenCV and supported by what other cameras show where the point is projected to (OpenPTV's way); the sets of most
cameras and least error come first, and a detection is used once. The points are then linked by trackpy (nearest
velocity) or by laptrack (linear assignment with gap closing). Neither gets to know which detections are one tracklet.

trackpy, laptrack, lap and looseversion are installed beside vidtrack, see README.md.
"""

from __future__ import annotations

from itertools import combinations

import cv2
import numpy as np
import pandas as pd
from gauntlet_scenes import Scene

from vidtrack.arrays import Array, Ints
from vidtrack.geometry.camera import Camera, distorted_from_frame_buffer, undistorted_from_distorted

SIGMAS = 4.0
"""Of a detection's noise: how far a camera may see a point from where the others have it."""
REACH = 3.0
"""Times the median step between moments: how far a link may go beyond the prediction."""
MEMORY = 5
"""Moments that a link may skip."""


def by_peers(s: Scene, linker: str) -> tuple[Array, Array, Array]:
    """Moments, positions and sigma (m, M, 3), as `gauntlet.located_by_stage`."""
    found = _points(s)
    number = {"trackpy": _trackpy, "laptrack": _laptrack}[linker](found, _step(found))
    M = s.views[0].t.size
    fix = np.full((int(number.max(initial=-1)) + 1, M, 3), np.nan)
    fix[number, found["frame"]] = found[["x", "y", "z"]]
    pixel = s.diameter / 8
    return s.views[0].t, fix, np.full(fix.shape, 2 * s.noise * pixel)


def _points(s: Scene) -> pd.DataFrame:
    """Points of all moments, frame by frame."""
    cameras = [v.camera for v in s.views]
    P = [np.hstack([c.R, c.T[:, None]]) for c in cameras]
    u = [_tangents(c, v.tracklets.b) for c, v in zip(cameras, s.views, strict=True)]
    tolerance = SIGMAS * s.noise * np.sqrt(2) / cameras[0].f
    rows = []
    order = [np.argsort(v.tracklets.sample, kind="stable") for v in s.views]
    edges = [
        np.searchsorted(v.tracklets.sample[o], np.arange(v.t.size + 1)) for v, o in zip(s.views, order, strict=True)
    ]
    for moment in range(s.views[0].t.size):
        own = [x[o[e[moment] : e[moment + 1]]] for x, o, e in zip(u, order, edges, strict=True)]
        rows += [(moment, *point) for point in _at_moment(own, P, tolerance)]
    return pd.DataFrame(rows, columns=["frame", "x", "y", "z"]).astype({"frame": int})


def _at_moment(u: list[Array], P: list[Array], tolerance: float) -> list[Array]:
    """Points (3,) of one moment from tangents (n, 2) of each camera."""
    sets = []
    for i, j in combinations(range(len(u)), 2):
        if not len(u[i]) or not len(u[j]):
            continue
        a, b = (k.ravel() for k in np.meshgrid(np.arange(len(u[i])), np.arange(len(u[j])), indexing="ij"))
        h = cv2.triangulatePoints(P[i], P[j], u[i][a].T, u[j][b].T)
        p = (h[:3] / h[3]).T
        members = np.full((len(p), len(u)), -1)
        members[:, i], members[:, j] = a, b
        error = np.zeros(len(p))
        for k, own in enumerate(u):
            q = p @ P[k][:, :3].T + P[k][:, 3]
            off = np.linalg.norm(q[:, None, :2] / q[:, None, 2:] - own[None], axis=-1)
            if k in (i, j):
                error = np.maximum(error, off[np.arange(len(p)), members[:, k]])
            elif len(own):
                near = off.argmin(1)
                members[:, k] = np.where(off.min(1) < tolerance, near, -1)
        good = error < tolerance
        sets += [(-(m >= 0).sum(), e, tuple(m), x) for m, e, x in zip(members[good], error[good], p[good], strict=True)]
    used: list[set[int]] = [set() for _ in u]
    points = []
    for _, _, members, point in sorted(sets, key=lambda one: one[:3]):
        if all(m < 0 or m not in used[k] for k, m in enumerate(members)):
            points.append(point)
            for k, m in enumerate(members):
                used[k].add(m) if m >= 0 else None
    return points


def _tangents(camera: Camera, b: Array) -> Array:
    return np.asarray(undistorted_from_distorted(camera, distorted_from_frame_buffer(camera, b)) / camera.f)


def _step(found: pd.DataFrame) -> float:
    """Median distance to the nearest point of the next moment."""
    steps = []
    frames = {int(k): rows[["x", "y", "z"]].to_numpy() for k, rows in found.groupby("frame")}
    for k, p in frames.items():
        if k + 1 in frames:
            steps.append(np.linalg.norm(p[:, None] - frames[k + 1][None], axis=-1).min(1))
    return float(np.median(np.concatenate(steps))) if steps else 1.0


def _trackpy(found: pd.DataFrame, step: float) -> Ints:
    import trackpy

    trackpy.quiet()
    predict = trackpy.predict.NearestVelocityPredict()
    options = {"pos_columns": ["x", "y", "z"], "memory": MEMORY, "adaptive_stop": step / 10, "adaptive_step": 0.8}
    linked = predict.link_df(found.copy(), REACH * step, **options)
    return linked.sort_index()["particle"].to_numpy(np.intp)


def _laptrack(found: pd.DataFrame, step: float) -> Ints:
    from laptrack import LapTrack

    reach = (REACH * step) ** 2
    tracker = LapTrack(cutoff=reach, gap_closing_cutoff=4 * reach, gap_closing_max_frame_count=MEMORY)
    tracks = tracker.predict_dataframe(found, ["x", "y", "z"], frame_col="frame", only_coordinate_cols=False)[0]
    both = found.reset_index().merge(tracks[["frame", "x", "y", "z", "track_id"]], on=["frame", "x", "y", "z"])
    return both.sort_values("index")["track_id"].to_numpy(np.intp)
