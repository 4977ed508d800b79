"""From a board's world to that of surveyed points, by the cameras that see both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.tied_cameras import world_motion
from vidtrack.calibration.camera.known_lens import KnownLens, placed
from vidtrack.geometry.camera import Camera

FEWEST_SURVEYED = 4
"""Surveyed points that place a camera whose lens is known."""

Motion = tuple[Array, Array]
"""R (3, 3) and t (3,): points go to R p + t."""


def survey_motion(
    cameras: Mapping[str, Camera], model: str, survey: Mapping[str, tuple[Array, Array]]
) -> Motion | None:
    """The motion that carries the cameras' world to that of the survey, by the camera that its points place best.

    survey  for some of the cameras, the surveyed points (n, 3) that each sees, and where (n, 2) px
    None where no camera sees four of them.
    """
    best: tuple[float, Motion] | None = None
    for name, (p, b) in survey.items():
        if name not in cameras or len(p) < FEWEST_SURVEYED:
            continue
        there = placed(KnownLens(cameras[name], model), p, b, None, None)
        if there is None:
            continue
        unsure = (1 + len(there.rivals)) * there.fit.sigma_px / float(np.sqrt(there.keep.sum()))
        if best is None or unsure < best[0]:
            best = unsure, world_motion(cameras[name], there.fit.camera)
    return best[1] if best else None
