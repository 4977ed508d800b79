"""Whether the surveyed places are in the units that the config says, by how large the balls come out in them."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import derivatives
from vidtrack.lengths import METRES

BALLS_M = (0.0005, 0.5)
"""m; no calibration ball has another diameter: inches that are millimetres make 0.6 m of 1 in."""

USUAL_M = (0.004, 0.12)
"""m; diameters that a laboratory's balls have: they show which unit was meant."""

FEWEST = 6
"""Balls whose sizes are known, at least."""


def unlikely_units(camera: Camera, p: Array, radius: Array, units: str) -> list[Finding]:
    """A doubt where balls at p (n, 3) that look radius (n,) px large are of no size that balls have.

    radius  NaN or 0 where it is not known, and of what is no ball
    units   of p; '' where they are not known
    """
    known = np.isfinite(radius) & (radius > 0)
    if units not in METRES or known.sum() < FEWEST or camera.through:
        return []
    J = derivatives(camera, p[known], camera.position, ()).by_point
    px_per_unit = np.linalg.det(J @ np.swapaxes(J, -1, -2)) ** 0.25
    size = float(np.median(2 * radius[known] / px_per_unit))
    metres = size * METRES[units]
    if not np.isfinite(metres) or BALLS_M[0] < metres < BALLS_M[1]:
        return []
    meant = [name for name, length in METRES.items() if USUAL_M[0] < size * length < USUAL_M[1]]
    says = f": points.csv is likely in {' or '.join(meant)}" if meant else ""
    width = f"{metres:.2g} m" if metres > 0.1 else f"{1000 * metres:.2g} mm"
    text = f"the balls come out {size:.3g} {units} ({width}) wide, which no calibration ball is{says}."
    cure = "Set units as points.csv has its places, or convert these: all positions are wrong by that factor."
    return [Finding("doubtful", "units-unlikely", text, cure)]
