"""From a board's world to that of surveyed points, by the cameras that see both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.tied_cameras import world_motion
from vidtrack.calibration.known_lens import KnownLens, placed
from vidtrack.geometry.camera import Camera

FEWEST_SURVEYED = 4
"""Surveyed points that place a camera whose lens is known."""

Motion = tuple[Array, Array]
"""R (3, 3) and t (3,): points go to R p + t."""


def survey_motion(cameras: Mapping[str, Camera], model: str, survey: Mapping[str, pd.DataFrame]) -> Motion | None:
    """The motion that carries the cameras' world to that of the survey, by the camera that its points place best.

    survey  for some of the cameras, the surveyed points that each sees: x, y, z, Xf, Yf, and found
    None where no camera sees four of them.
    """
    best: tuple[float, Motion] | None = None
    for name, table in survey.items():
        columns = table[["x", "y", "z", "Xf", "Yf"]].to_numpy(float)
        good = np.isfinite(columns).all(1) & (table["found"].to_numpy(bool) if "found" in table else True)
        if name not in cameras or good.sum() < FEWEST_SURVEYED:
            continue
        there = placed(KnownLens(cameras[name], model), columns[good, :3], columns[good, 3:], None, None)
        if there is None:
            continue
        unsure = (1 + len(there.rivals)) * there.fit.sigma_px / float(np.sqrt(there.keep.sum()))
        if best is None or unsure < best[0]:
            best = unsure, world_motion(cameras[name], there.fit.camera)
    return best[1] if best else None
