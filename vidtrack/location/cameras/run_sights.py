"""The sights on which a run's trajectories rest, in the picture of the calibration: what self-calibration needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.picture_part import Window

COLUMNS = {"time_s": "s", "target": "", "camera": "", "Xf": "px", "Yf": "px", "sd_x": "px", "sd_y": "px"}


class RunSights(NamedTuple):
    """m cameras, q targets, M moments.

    b, sd     (m, q, M, 2) px; NaN where a camera lacks a target
    left_out  (m, q, M) sights that disagree with the other cameras
    shown     camera: the part of the calibration's picture that the run's shows, where it is another one
    """

    at: Array  # (M,) s
    targets: tuple[str, ...]
    cameras: tuple[str, ...]
    b: Array
    sd: Array
    left_out: NDArray[np.bool_]
    shown: Mapping[str, Window]


def sight_columns(sights: RunSights) -> dict[str, Any]:
    """A row for each moment, target and camera that saw it: COLUMNS, px of the calibration's picture."""
    seen = np.isfinite(sights.b).all(-1) & np.isfinite(sights.sd).all(-1) & ~sights.left_out
    camera, target, moment = np.nonzero(seen)
    b, sd = sights.b.copy(), sights.sd.copy()
    for i, name in enumerate(sights.cameras):
        if (part := sights.shown.get(name)) is not None:
            b[i], sd[i] = part.back(b[i]), sd[i] / part.scale
    at, spread = b[seen], sd[seen]
    return {
        "time_s": sights.at[moment],
        "target": np.array(sights.targets, object)[target],
        "camera": np.array(sights.cameras, object)[camera],
        "Xf": at[:, 0],
        "Yf": at[:, 1],
        "sd_x": spread[:, 0],
        "sd_y": spread[:, 1],
    }
