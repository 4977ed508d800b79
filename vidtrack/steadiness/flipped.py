"""Whether a picture resembles another one only where it is mirrored or turned upside down.

A camera that hangs upside down, a setting of it or of a player that mirrors: the files have the same size and say
nothing of it. Where hardly a patch of the calibration's background is found again in a run, its picture is mirrored
and turned, and sought again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Bools
from vidtrack.steadiness.history import LIMITS, since_calibration
from vidtrack.steadiness.turn import law_of_picture

WAYS: dict[str, tuple[slice, slice]] = {
    "mirrored left to right": (slice(None), slice(None, None, -1)),
    "upside down and mirrored": (slice(None, None, -1), slice(None)),
    "turned by 180 degrees": (slice(None, None, -1), slice(None, None, -1)),
}

LEAST = 0.5
"""Share of the patches that must be found again; of a picture that is another one, under `LIMITS.unlike` are."""


def flipped(calibrated: NDArray[Any], begun: NDArray[Any], block: float, shut: Bools) -> str | None:
    """How the run's picture differs from the calibration's, one of `WAYS`; None where no way makes them alike.

    calibrated, begun  (h, w) the two pictures, grey levels, averaged over squares of `block` px
    shut               (h, w) what no patch may cover in the calibration's picture
    """
    h, w = np.shape(calibrated)
    size = (round(w * block), round(h * block))
    law = law_of_picture(size)
    best, most = None, max(LEAST, 2 * LIMITS.unlike)
    for words, way in WAYS.items():
        turned, covered = np.ascontiguousarray(calibrated[way]), np.ascontiguousarray(shut[way])
        turn, alike = since_calibration(turned, begun, law, size, block, covered)
        if not turn.why and alike > most:
            best, most = words, alike
    return best
