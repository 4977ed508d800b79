"""Stage overlay_film: what is drawn over each picture of a recording: boxes, centroids, located points projected back.

The points are those of the trajectories at the moment of the picture, by straight lines between neighbouring samples,
projected by the camera as it was calibrated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.timing.clock import Clock
from vidtrack.timing.resample import interval

LONGEST_STEP = 1.6
"""Usual intervals between two samples of a trajectory, at most, between which a line is drawn."""


class Mark(NamedTuple):
    """What is drawn of one target in one picture: px; NaN where there is none.

    target    the name that the tracker gave, or that of a located point
    kind      seen: a centroid and its box; lost: the box alone; located: a point projected back
    at        (X, Y); box: left, top, width, height, of the kinds seen and lost
    flag      what the tracker, or stage locate, said of it
    """

    target: str
    kind: str
    at: tuple[float, float]
    box: tuple[float, float, float, float]
    flag: str


NO_BOX = (float("nan"),) * 4


def overlay_marks(
    centroids: pd.DataFrame,
    trajectories: pd.DataFrame | None = None,
    camera: Camera | None = None,
    *,
    clock: Clock | None = None,
    shift_s: float = 0.0,
) -> dict[int, list[Mark]]:
    """The marks of each frame, by its number.

    centroids      frame, field, time_s, target, Xf, Yf, box_x, box_y, box_w, box_h, flag of one camera
    trajectories   time_s, target, x, y, z, flag of the run; None, or no camera: no point is projected back
    camera         as the run's pictures have it
    clock          what stage locate found of the camera's clock; shift_s: to the run's scale of time
    """
    marks: dict[int, list[Mark]] = {}
    for row in centroids.itertuples(index=False):
        seen = bool(np.isfinite(row.Xf))  # type: ignore[arg-type]
        left, top, wide, high = (float(v) for v in (row.box_x, row.box_y, row.box_w, row.box_h))  # type: ignore[arg-type]
        at = (float(row.Xf), float(row.Yf)) if seen else (left + wide / 2, top + high / 2)  # type: ignore[arg-type]
        kind = "seen" if seen else "lost"
        marks.setdefault(int(row.frame), []).append(  # type: ignore[arg-type]
            Mark(str(row.target), kind, at, (left, top, wide, high), str(row.flag))
        )
    if trajectories is not None and camera is not None and len(centroids):
        _add_located(marks, centroids, trajectories, camera, clock or Clock(), shift_s)
    return marks


def names_of_tracks(record: Mapping[str, Any], camera: str) -> dict[str, str]:
    """For each track of a camera that located one target, the target; record: locate.json."""
    found: dict[str, str] = {}
    for target, own in (record.get("correspondence", {}).get("targets") or {}).items():
        for track in own["tracks"].get(camera, ()):
            found.setdefault(str(track), str(target))
    return found


def _add_located(
    marks: dict[int, list[Mark]],
    centroids: pd.DataFrame,
    trajectories: pd.DataFrame,
    camera: Camera,
    clock: Clock,
    shift_s: float,
) -> None:
    moments = centroids.drop_duplicates(["frame", "field"])
    frames = moments["frame"].to_numpy(int)
    times = clock.corrected(moments["time_s"].to_numpy(float) + shift_s)
    for target, rows in trajectories.groupby("target", sort=False):
        own = rows.sort_values("time_s").drop_duplicates("time_s")
        b = project(camera, _at(own["time_s"].to_numpy(float), own[["x", "y", "z"]].to_numpy(float), times))
        for i in np.flatnonzero(np.isfinite(b).all(-1)):
            marks.setdefault(int(frames[i]), []).append(
                Mark(str(target), "located", (float(b[i, 0]), float(b[i, 1])), NO_BOX, "")
            )


def _at(t: Array, p: Array, when: Array) -> Array:
    """Positions (n, 3) at `when` (n,) on straight lines between neighbouring samples; NaN in gaps and outside."""
    good = np.isfinite(p).all(-1)
    t_good, p_good = t[good], p[good]
    if len(t_good) < 2:
        return np.full((len(when), 3), np.nan)
    after = np.clip(np.searchsorted(t_good, when), 1, len(t_good) - 1)
    step = t_good[after] - t_good[after - 1]
    share = (when - t_good[after - 1]) / step
    usual = interval(t)
    use = (share >= -1e-6) & (share <= 1 + 1e-6) & (step <= LONGEST_STEP * usual)
    # the moment of a sample itself counts, whatever lies beside it
    nearest = np.where(share > 0.5, after, after - 1)
    alone = np.abs(when - t_good[nearest]) < 1e-3 * usual
    on_line = p_good[after - 1] + share[:, None] * (p_good[after] - p_good[after - 1])
    return np.where(alone[:, None], p_good[nearest], np.where(use[:, None], on_line, np.nan))


def targets_of(marks: Mapping[int, Iterable[Mark]]) -> list[str]:
    """All names among the marks, in the order in which they come."""
    return list(dict.fromkeys(mark.target for frame in sorted(marks) for mark in marks[frame]))
