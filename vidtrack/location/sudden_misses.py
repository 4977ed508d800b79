"""Samples whose lines of sight miss each other by more than they do in the rest of the run: their sigma grows.

Something touched the target's picture in one camera for a moment (a rope, a flash, a neighbour) and moved its centroid
by more than its sd says. The residuals of the sample show it, where the run as a whole fits: their squares over sd,
compared with the target's usual ones, follow chi squared. A sample beyond chance gets the sigma that its own residuals
stand for (Birge's ratio, sample by sample). What moves a centroid along the other camera's epipolar line leaves no
residual, and is not seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.triangulate import Located


@dataclass(frozen=True)
class Sudden:
    """Which samples count as missing suddenly.

    chance   standard deviations of the normal distribution that chance exceeds once in ten thousand times
    fewest   samples of a target by the same number of cameras whose median says what is usual
    """

    chance: float = 3.719
    fewest: int = 20


SUDDEN = Sudden()


def with_grown_sigma(located: Located, sd: Array) -> tuple[Located, Bools]:
    """Positions with the sigma that their residuals stand for, and which samples (m, M) were changed.

    sd   (n_cameras, m, M, 2) px, of the centroids
    """
    used = np.isfinite(located.error[..., 0]) & ~located.left_out & np.isfinite(located.sigma[..., 0])
    z2 = np.where(used[..., None], np.square(located.error / sd), 0.0).sum((0, -1))
    freedom = np.maximum(2 * used.sum(0) - 3, 0)
    growth = np.ones(z2.shape)
    for i in range(len(z2)):
        for own in np.unique(freedom[i][freedom[i] > 0]).tolist():
            alike = freedom[i] == own
            if alike.sum() < SUDDEN.fewest:
                continue
            usual = max(float(np.median(z2[i, alike])) / float(unlikely_chi2(own, 0.0)), 1.0)
            q = z2[i, alike] / usual
            beyond = q > unlikely_chi2(own, SUDDEN.chance)
            growth[i, alike] = np.where(beyond, np.sqrt(q / own), 1.0)
    grown = growth > 1
    if not grown.any():
        return located, grown
    return (
        located._replace(
            covariance=located.covariance * np.square(growth)[..., None, None],
            sigma=located.sigma * growth[..., None],
        ),
        grown,
    )


def unlikely_chi2(freedom: ArrayLike, deviations: float) -> Array:
    """The chi squared that is as unlikely as so many standard deviations of a normal one (Wilson and Hilferty, 1931).

    Within 7 % of the exact one from one degree of freedom on; scipy's takes 0.3 s to import.
    """
    freedom = np.asarray(freedom, float)
    spread = 2 / (9 * freedom)
    return np.asarray(freedom * (1 - spread + deviations * spread**0.5) ** 3)
