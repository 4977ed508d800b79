"""The straight line along which a target moves, and its angle to a world axis: a rod is never quite aligned.

The thesis's rod was an inch off over thirty (its figure 6.12): 1.9 degrees, which the video sees and a sensor along
the rod does not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.motion.lag import long_run_covariance

AS_NEAR = 1e-9
"""Direction cosines to axes that are as near to a line: the first of them counts."""


class Line(NamedTuple):
    """A line in the world, pointing the way its nearest axis points.

    axis         0, 1, 2: the world axis that it is compared with
    direction    (3,)  unit vector; 0 along an axis that is NaN throughout (z in mode plane)
    foot         (3,)  world units, the point of the line where that axis's coordinate is zero
    skew_deg     angle between line and axis, and its standard deviation, degrees
    straight     share of the motion's variance that lies along the line
    rms_off      world units, rms distance of the samples from the line
    length       world units, of the path along the line
    """

    axis: int
    direction: Array
    foot: Array
    skew_deg: float
    skew_sd_deg: float
    straight: float
    rms_off: float
    length: float

    def along(self, p: ArrayLike) -> Array:
        """Distance (n,) along the line of points (n, 3), from its foot: the world coordinate where there is no skew."""
        offset = np.asarray(p, float) - self.foot
        used = self.direction != 0
        return np.asarray(offset[..., used] @ self.direction[used])


def fit_line(p: ArrayLike, axis: int | None = None) -> Line:
    """The principal line of a target's positions over time.

    p     (n, 3)  world units, in order of time; rows with NaN are left out, and an axis of nothing else
    axis  0, 1, 2, or None for the one nearest to the line
    Everything NaN for fewer than four positions or a target that does not move.
    Off-line vibration is slow beside the sampling, so the angle's standard deviation counts correlated samples as few.
    """
    places: Array = np.asarray(p, float)
    axes = np.flatnonzero(np.isfinite(places).any(0))
    q = places[:, axes][np.isfinite(places[:, axes]).all(1)]
    nan = float("nan")
    if len(q) < 4 or not len(axes) or not np.ptp(q, axis=0).max() > 0:
        return Line(axis or 0, np.full(3, nan), np.full(3, nan), nan, nan, nan, nan, nan)
    middle = q.mean(0)
    _, s, Vt = np.linalg.svd(q - middle, full_matrices=False)
    d = np.zeros(3)
    d[axes] = Vt[0]
    nearest = int(np.argmax(np.abs(d) > np.abs(d).max() - AS_NEAR))  # between two axes rounding must not choose
    held = nearest if axis is None else axis
    d = d * (np.sign(d[held]) or 1.0)
    centre = np.zeros(3)
    centre[axes] = middle
    foot = centre - d * centre[held] / d[held] if abs(d[held]) > 0.1 else centre
    along = (q - middle) @ d[axes]
    off = (q - middle) - along[:, None] * d[axes]
    return Line(
        held,
        d,
        foot,
        float(np.degrees(np.arctan2(np.sqrt(max(1 - d[held] ** 2, 0.0)), abs(d[held])))),
        _angle_sd(along, off, d[axes], int(np.argmax(axes == held))),
        float(s[0] ** 2 / (s**2).sum()),
        float(np.sqrt((off**2).sum(1).mean())),
        float(np.ptp(along)),
    )


def _angle_sd(along: Array, off: Array, d: Array, held: int) -> float:
    """Degrees: standard deviation of the slope towards the axis, or in any direction where there is no skew."""
    tip = np.eye(len(d))[held] - d[held] * d
    ways = [tip / np.linalg.norm(tip)] if np.linalg.norm(tip) > 1e-6 else list(np.linalg.svd(d[None])[2][1:])
    J = np.column_stack([along, np.ones_like(along)])
    variance = [long_run_covariance(J, off @ way, np.arange(len(along)))[0, 0] for way in ways]
    return float(np.degrees(np.sqrt(np.mean(variance))))
