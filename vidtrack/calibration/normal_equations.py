"""The normal equations of many cameras that see the same points, with the points eliminated.

The plainest case of `vidtrack.calibration.adjustment`: every block is a point, surveyed or not, and every measurement
a sight of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.measurements import spread_over_block
from vidtrack.calibration.adjustment.normal_equations import Equations, Normal, Prior, summed
from vidtrack.calibration.adjustment.unknowns import Known, Names, columns
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import derivatives

Priors = Sequence[Known]


def priors_for(prior: Priors | Mapping[str, tuple[float, float]] | None, free: Names) -> Priors:
    """For each camera its priors, {name: (mean, sd)}, on parameters that are free; given for each, or one for all."""
    each = [prior or {}] * len(free) if prior is None or isinstance(prior, Mapping) else prior
    return [{name: own[name] for name in own if name in names} for own, names in zip(each, free, strict=True)]


class Linearised(NamedTuple):
    """How every camera sees every point, to first order; NaN where a camera cannot see it."""

    projected: Array  # (m, n, 2) px
    by_parameter: Array  # (m, n, 2, 15)
    by_point: Array  # (m, n, 2, 3)


def linearised(cameras: Sequence[Camera], p: ArrayLike, pivot: ArrayLike) -> Linearised:
    """The projections of world points (n, 3) in each of m cameras and their derivatives (see `jacobian`)."""
    each = [derivatives(camera, p, pivot) for camera in cameras]
    return Linearised(*(np.stack(part) for part in zip(*each, strict=True)))


def sight_equations(seen: Linearised, residual: Array, weight: Array, free: Names) -> list[Equations]:
    """For each camera its sights as equations: arguments as for `normal_equations`."""
    return [
        Equations(
            residual[i],
            weight[i],
            np.arange(place.start, place.stop),
            seen.by_parameter[i][..., parameters],
            0,
            spread_over_block(seen.by_point[i][:, None]),
        )
        for i, (place, parameters) in enumerate(columns(free))
    ]


def normal_equations(
    seen: Linearised, residual: Array, weight: Array, free: Names, information: Array, shift: Array
) -> Normal:
    """The normal equations of all sights and of the survey.

    seen         derivatives at the present cameras and points
    residual     (m, n, 2)  measured minus projected, px; anything where the weight is zero
    weight       (m, n, 2)  one over the variance of each measurement, px^-2; zero where a camera lacks the point
    free         for each camera the names of its free parameters
    information  (n, 3)  one over the survey's variance by axis; zero: unsurveyed, inf: the point stays
    shift        (n, 3)  surveyed minus present position
    """
    K = sum(len(names) for names in free)
    return summed(sight_equations(seen, residual, weight, free), K, [Prior(information, shift)])
