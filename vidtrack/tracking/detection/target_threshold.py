"""The threshold of each target: half-way between its own background and its own peak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.threshold import THRESHOLD
from vidtrack.tracking.state import Appearance


@dataclass(frozen=True)
class PerTarget:
    """Where the threshold of one target lies.

    half  of the mean of a target's pixels: half of its peak, as those on the rim are dimmer
    """

    half: float = 0.54


PER_TARGET = PerTarget()


def target_levels(appearance: Appearance, detection: Detection, level: float) -> Array:
    """Thresholds (n,), grey levels of pictures turned bright: half-way up each target, or the user's.

    level  grey level for the whole picture. A target that has not been seen yet has a threshold below that: a dim one
           falls to pieces at the level for lone pixels, and enough side by side are no chance at a lower one
    """
    if detection.level is not None:
        return np.full(appearance.pixels.size, detection.level)
    own = appearance.background + np.maximum(
        PER_TARGET.half * appearance.plateau, SURROUNDINGS.stands_out * detection.noise
    )
    return np.where(np.isfinite(own), own, level - (THRESHOLD.sigmas - SURROUNDINGS.stands_out) * detection.noise)
