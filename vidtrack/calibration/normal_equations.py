"""The normal equations of many cameras that see the same points, with the points eliminated.

Every sight (camera, point) gives two equations in that camera's parameters and the point's three
coordinates. All together they are large, but a point meets another point only through the cameras:

    [ U   E^T ] [ step of the cameras ]   [ g ]
    [ E   V   ] [ step of the points  ] = [ h ]       V is block diagonal, 3 x 3 a point

so the points are solved in terms of the cameras (Schur's complement; Brown 1958): U - E^T V^-1 E is as
small as the cameras' parameters are few, however many the points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import PARAMETERS, derivatives

Names = Sequence[Sequence[str]]
Priors = Sequence[Mapping[str, tuple[float, float]]]


def priors_for(prior: Priors | Mapping[str, tuple[float, float]] | None, free: Names) -> Priors:
    """For each camera its priors, {name: (mean, sd)}, on parameters that are free; given for each, or one for all."""
    each = [prior or {}] * len(free) if prior is None or isinstance(prior, Mapping) else prior
    return [{name: own[name] for name in own if name in names} for own, names in zip(each, free, strict=True)]


class Linearised(NamedTuple):
    """How every camera sees every point, to first order; NaN where a camera cannot see it."""

    projected: Array  # (m, n, 2) px
    by_parameter: Array  # (m, n, 2, 15)
    by_point: Array  # (m, n, 2, 3)


class Normal(NamedTuple):
    """The normal equations; K parameters of the cameras that are free, n points."""

    U: Array  # (K, K)
    E: Array  # (n, 3, K)
    V: Array  # (n, 3, 3)
    g: Array  # (K,)
    h: Array  # (n, 3)
    held: NDArray[np.bool_]  # (n, 3), coordinates that stay as surveyed


class Covariance(NamedTuple):
    """What the equations leave uncertain, in the units of the weights."""

    cameras: Array  # (K, K)
    points: Array  # (n, 3, 3)
    fitted: Array  # (m, n, 2), the variance of each fitted position, px^2


def linearised(cameras: Sequence[Camera], p: ArrayLike, pivot: ArrayLike) -> Linearised:
    """The projections of world points (n, 3) in each of m cameras and their derivatives (see `jacobian`)."""
    each = [derivatives(camera, p, pivot) for camera in cameras]
    return Linearised(*(np.stack(part) for part in zip(*each, strict=True)))


def columns(free: Names) -> list[tuple[slice, list[int]]]:
    """Where each camera's free parameters stand among all K, and which of PARAMETERS they are.

    Raises ValueError for a name that is no parameter.
    """
    places, start = [], 0
    for names in free:
        unknown = [name for name in names if name not in PARAMETERS]
        if unknown:
            raise ValueError(f"{unknown[0]} is no camera parameter; they are {', '.join(PARAMETERS)}")
        places.append((slice(start, start + len(names)), [PARAMETERS.index(name) for name in names]))
        start += len(names)
    return places


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
    places = columns(free)
    K = places[-1][0].stop if places else 0
    n = residual.shape[1]
    root = np.sqrt(weight)
    lost = weight == 0
    r = np.where(lost, 0.0, residual) * root
    B = np.where(lost[..., None], 0.0, seen.by_point) * root[..., None]
    U, g, E = np.zeros((K, K)), np.zeros(K), np.zeros((n, 3, K))
    for i, (place, parameters) in enumerate(places):
        A = np.where(lost[i, ..., None], 0.0, seen.by_parameter[i][..., parameters]) * root[i, ..., None]
        flat = A.reshape(-1, len(parameters))
        U[place, place] = flat.T @ flat
        g[place] = flat.T @ r[i].reshape(-1)
        E[..., place] = B[i].swapaxes(-1, -2) @ A
    held = ~np.isfinite(information)
    told = np.where(held, 0.0, information)
    V = (B.swapaxes(-1, -2) @ B).sum(0)
    h = (B.swapaxes(-1, -2) @ r[..., None])[..., 0].sum(0) + told * np.where(held, 0.0, shift)
    E[held], h[held] = 0, 0
    V[held[:, :, None] | held[:, None, :]] = 0
    V[:, range(3), range(3)] += np.where(held, 1.0, told)
    return Normal(U, E, V, g, h, held)


def with_priors(normal: Normal, cameras: Sequence[Camera], free: Names, priors: Priors) -> Normal:
    """The equations with what is known beforehand of some parameters: for each camera {name: (mean, sd)}.

    A name that is not free is passed over. Raises ValueError for a prior on the attitude, whose zero is arbitrary.
    """
    U, g = normal.U.copy(), normal.g.copy()
    for camera, names, prior, (place, _) in zip(cameras, free, priors, columns(free), strict=True):
        for name, (mean, sd) in prior.items():
            if name in PARAMETERS[:6]:
                raise ValueError(f"a prior on {name} has no meaning: it is a step from where the camera stands")
            if name in names:
                k = place.start + list(names).index(name)
                U[k, k] += 1 / sd**2
                g[k] += (mean - getattr(camera, name)) / sd**2
    return normal._replace(U=U, g=g)


def solved(normal: Normal, damping: float = 0.0) -> tuple[Array, Array]:
    """The step of the cameras (K,) and of the points (n, 3); damped as Levenberg and Marquardt do."""
    U = normal.U + damping * np.diag(np.diag(normal.U))
    inverse = np.linalg.inv(normal.V * (1 + damping * np.eye(3)))
    Y = inverse @ normal.E
    y = (inverse @ normal.h[..., None])[..., 0]
    S = U - _flat(normal.E).T @ _flat(Y)
    scale = _scale(S)
    cameras = scale * np.linalg.lstsq(S * np.outer(scale, scale), scale * (normal.g - _flat(Y).T @ normal.h.ravel()))[0]
    return cameras, y - Y @ cameras


def covariance(normal: Normal, seen: Linearised, free: Names) -> Covariance:
    """The covariance of every parameter, of every point, and the variance of every fitted position.

    Raises ValueError where the measurements leave some parameter open.
    """
    inverse = np.asarray(np.linalg.inv(normal.V))
    inverse[:, range(3), range(3)] -= normal.held
    Y = inverse @ normal.E
    S = normal.U - _flat(normal.E).T @ _flat(Y)
    scale = _scale(S)
    scaled = S * np.outer(scale, scale)
    if S.size and np.linalg.cond(scaled) > 1e14:
        raise ValueError("the measurements leave some parameter open; fix it or give it a prior")
    cameras = np.linalg.inv(scaled) * np.outer(scale, scale)
    points = inverse + Y @ cameras @ Y.swapaxes(-1, -2)
    return Covariance(cameras, points, _variance_of_fitted(seen, free, inverse, np.asarray(Y), cameras))


def _variance_of_fitted(seen: Linearised, free: Names, inverse: Array, Y: Array, cameras: Array) -> Array:
    # a fitted position moves by J theta + B (y - Y theta); y, the points for fixed cameras, is independent of theta
    variance = np.empty(seen.projected.shape)
    for i, (place, parameters) in enumerate(columns(free)):
        B = np.nan_to_num(seen.by_point[i])
        H = -B @ Y
        H[..., place] += np.nan_to_num(seen.by_parameter[i][..., parameters])
        variance[i] = ((H @ cameras) * H).sum(-1) + ((B @ inverse) * B).sum(-1)
    return variance


def _scale(S: Array) -> Array:
    diagonal = np.diag(S)
    return 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _flat(A: Array) -> Array:
    return A.reshape(-1, A.shape[-1])
