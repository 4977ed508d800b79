"""Samples whose lines of sight miss each other by more than they do in the rest of the run: their sigma grows.

Something touched the target's picture in one camera for a moment (a rope, a flash, a neighbour) and moved its centroid
by more than its sd says. The residuals of the sample show it, where the run as a whole fits: their squares over sd,
compared with the target's usual ones, follow chi squared. A sample beyond chance gets the sigma that its own residuals
stand for (Birge's ratio, sample by sample). What moves a centroid along the other camera's epipolar line leaves no
residual, and is not seen. Which camera it is, where three or more saw the target: `erring_camera`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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


class Grown(NamedTuple):
    """What `with_grown_sigma` returns: positions with the sigma that their residuals stand for; which samples (m, M)
    were changed; by how much (m, M) chi squared usually exceeds what sd leads to expect, at least 1.
    """

    located: Located
    samples: Bools
    usual: Array


def with_grown_sigma(located: Located, sd: Array) -> Grown:
    """Positions with the sigma that their residuals stand for, where these are beyond chance.

    sd   (n_cameras, m, M, 2) px, of the centroids
    """
    used = np.isfinite(located.error[..., 0]) & ~located.left_out & np.isfinite(located.sigma[..., 0])
    z2 = np.where(used[..., None], np.square(located.error / sd), 0.0).sum((0, -1))
    freedom = np.maximum(2 * used.sum(0) - 3, 0)
    growth, excess = np.ones(z2.shape), np.ones(z2.shape)
    for i in range(len(z2)):
        for own in np.unique(freedom[i][freedom[i] > 0]).tolist():
            alike = freedom[i] == own
            if alike.sum() < SUDDEN.fewest:
                continue
            usual = max(float(np.median(z2[i, alike])) / float(unlikely_chi2(own, 0.0)), 1.0)
            excess[i, alike] = usual
            q = z2[i, alike] / usual
            beyond = q > unlikely_chi2(own, SUDDEN.chance)
            growth[i, alike] = np.where(beyond, np.sqrt(q / own), 1.0)
    grown = growth > 1
    if not grown.any():
        return Grown(located, grown, excess)
    wider = located._replace(
        covariance=located.covariance * np.square(growth)[..., None, None], sigma=located.sigma * growth[..., None]
    )
    return Grown(wider, grown, excess)


def unlikely_chi2(freedom: ArrayLike, deviations: float) -> Array:
    """The chi squared that is as unlikely as so many standard deviations of a normal one (Wilson and Hilferty, 1931).

    Within 7 % of the exact one from one degree of freedom on; scipy's takes 0.3 s to import.
    """
    freedom = np.asarray(freedom, float)
    spread = 2 / (9 * freedom)
    return np.asarray(freedom * (1 - spread + deviations * spread**0.5) ** 3)
