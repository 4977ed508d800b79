"""The adjustment of cameras that are known from another calibration by a body that they see.

    minimise  sum |b - project(camera, R_k p + T_k)|^2 / sd^2
              + what the other calibration knows of the cameras + what is known of the body's places p

over the cameras, the body's pose R_k, T_k at each moment, and its places. A body that moves says nothing of where the
world lies: that stays as the other calibration has it, with its uncertainty.

What a calibration knows is its covariance, where the cameras look through air. Behind an interface the cameras' places,
its own and the index follow each other along lines that bend, and a covariance holds for short steps only: there the
sights of the surveyed points stand in its place, with what is known of the interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.adjustment.adjust import Adjusted, Problem, adjust, minimise
from vidtrack.calibration.adjustment.measurements import (
    InterfacePriors,
    KnownCameras,
    Measurement,
    PointsOf,
    SharedPriors,
    Sights,
)
from vidtrack.calibration.adjustment.unknowns import Family, State, Unknowns, points_of_poses, pose_blocks
from vidtrack.calibration.body.body_sights import Body, BodySights, SurveySights
from vidtrack.calibration.bundle import with_common_interfaces
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import parameters_of
from vidtrack.geometry.jacobian import PARAMETERS


class FitSettings(NamedTuple):
    """How the adjustment decides."""

    outlier: float = 4.5
    """Standard deviations of its residual beyond which a sight is left out."""
    rounds: int = 5
    """Of leaving out."""
    most_lag: int = 50
    """Moments over which residuals may be alike."""


SETTINGS = FitSettings()


class BodyFit(NamedTuple):
    """What the adjustment gives, K unknowns of all cameras."""

    cameras: tuple[Camera, ...]
    names: tuple[tuple[str, ...], ...]  # of each camera, those of its interfaces behind its own
    pivot: Array
    covariance: Array  # (K, K) of these, one camera after the other
    shape: Array  # (q, 3) the body's places as refined
    shape_covariance: Array  # (3 q, 3 q)
    poses: Array  # (n, 3, 4)
    sights: BodySights  # without outliers, sd as the residuals show it
    factor: float  # by which the stated sd of the sights were multiplied, to be those of the residuals
    alike: float  # moments that count as one, because their residuals are alike
    residuals: Array  # (m, n, q, 2) px
    converged: bool


def fit_body(
    known: KnownCameras,
    sights: BodySights,
    body: Body,
    poses: Array,
    *,
    shape_sd: float | None = None,
    survey: SurveySights | None = None,
) -> BodyFit:
    """The cameras and the noise of the sights, found from what the fit leaves.

    shape_sd  world units, what is known of the body's coordinates, in place of body.sd
    survey    what the calibration of the cameras rests on, in place of the covariance of `known`
    Raises ValueError where the sights and what is known leave a parameter open.
    """
    sd = body.sd if shape_sd is None else shape_sd
    cameras: Sequence[Camera] = with_common_interfaces(known.cameras)
    at = body.p
    for _ in range(SETTINGS.rounds):
        problem = body_problem(known, sights, body, poses, sd, scaled=True, survey=survey)
        found = adjust(problem, body_state(cameras, at, body, poses, survey))
        cameras, poses = found.state.cameras, found.state.blocks[0]
        far = _outliers(found, sights)
        if not far.any():
            break
        sights = sights._replace(b=np.where(far[..., None], np.nan, sights.b))
    alike = alikeness(np.stack([each.reshape(sights.b.shape[1:]) for each in found.residuals[: len(cameras)]]), sights)
    factor = float(found.factors["px"])
    sights = sights._replace(sd=sights.sd * factor * np.sqrt(alike))
    problem = body_problem(known, sights, body, poses, sd, survey=survey)
    found = adjust(problem, found.state)
    unknowns = problem.unknowns
    names, place = _of_cameras(unknowns, known)
    shape = unknowns.of_shared(*(name for row in _names(body) for name in row))
    return BodyFit(
        found.state.cameras,
        names,
        unknowns.pivot,
        found.covariance[np.ix_(place, place)],
        _shape_of(found.state, body),
        found.covariance[np.ix_(shape, shape)],
        found.state.blocks[0],
        sights,
        factor,
        alike,
        np.stack([each.reshape(sights.b.shape[1:]) for each in found.residuals[: len(cameras)]]),
        found.converged,
    )


def refitted(
    known: KnownCameras, sights: BodySights, body: Body, poses: Array, survey: SurveySights | None = None
) -> tuple[Camera, ...]:
    """The cameras alone, the noise of the sights as stated."""
    problem = body_problem(known, sights, body, poses, body.sd, survey=survey)
    start = body_state(with_common_interfaces(known.cameras), body.p, body, poses, survey)
    return minimise(problem, start, tolerance=1e-7).cameras


def body_problem(
    known: KnownCameras,
    sights: BodySights,
    body: Body,
    poses: Array,
    shape_sd: float,
    *,
    scaled: bool = False,
    survey: SurveySights | None = None,
) -> Problem:
    """The adjustment; scaled: the noise of the sights is found."""
    names = [name for row in _names(body) for name in row]

    def points(state: State) -> PointsOf:
        at = state.blocks[0]
        where, J = points_of_poses(at, _shape_of(state, body))
        follows = {}
        for j, row in enumerate(_names(body)):
            for k, name in enumerate(row):
                moved = np.zeros(where.shape)
                moved[:, j] = at[:, :, k]
                follows[name] = moved
        return PointsOf(where, J, follows)

    seen = [Sights(i, b, sd, points=points) for i, (b, sd) in enumerate(zip(sights.b, sights.sd, strict=True))]
    prior = {name: (float(v), shape_sd) for name, v in zip(names, body.p.ravel(), strict=True)}
    own = [[name for name in each if name in PARAMETERS] for each in known.names]
    unknowns = Unknowns(own, poses[:, :, 3].mean(0), [*_interfaces(known), *names])
    groups = {"px": 1e-3 / float(np.nanmedian(sights.sd))} if scaled else {}
    families = [pose_blocks(len(poses))]
    before: list[Measurement] = [known]
    if survey is not None:
        with np.errstate(divide="ignore"):
            families.append(Family(3, survey.p, np.repeat(1 / survey.sigma[:, None] ** 2, 3, 1)))
        each = enumerate(zip(survey.b[:, :, None], survey.sd[:, :, None], strict=True))
        before = [*(Sights(i, b, own, family=1, noise="") for i, (b, own) in each), InterfacePriors()]
    return Problem(unknowns, families, [*seen, *before, SharedPriors(prior)], groups)


def body_state(
    cameras: Sequence[Camera], p: Array, body: Body, poses: Array, survey: SurveySights | None = None
) -> State:
    """Where the adjustment starts."""
    shared = {name: float(v) for row, at in zip(_names(body), p, strict=True) for name, v in zip(row, at, strict=True)}
    return State(tuple(cameras), shared, (poses,) if survey is None else (poses, survey.p))


def _interfaces(known: KnownCameras) -> tuple[str, ...]:
    """The parameters of interfaces that are known with a covariance: each is one unknown for all cameras."""
    return tuple(dict.fromkeys(name for each in known.names for name in each if name not in PARAMETERS))


def _of_cameras(unknowns: Unknowns, known: KnownCameras) -> tuple[tuple[tuple[str, ...], ...], Ints]:
    """Each camera's parameters, those of its interfaces behind them, and where they stand among the unknowns."""
    names, place = [], []
    for i, (own, camera) in enumerate(zip(unknowns.free, known.cameras, strict=True)):
        bent = [name for name in parameters_of(camera.through) if name in _interfaces(known)]
        names.append((*own, *bent))
        place += [*unknowns.of_camera(i)[0], *unknowns.of_shared(*bent)]
    return tuple(names), np.array(place, int)


def _names(body: Body) -> list[list[str]]:
    return [[f"body {target} {axis}" for axis in "xyz"] for target in body.targets]


def _shape_of(state: State, body: Body) -> Array:
    return np.array([[state.shared[name] for name in row] for row in _names(body)])


def _outliers(found: Adjusted, sights: BodySights) -> Array:
    size = np.stack([np.abs(each).reshape(sights.b.shape[1:]) for each in found.normalised[: len(sights.b)]])
    known = np.nan_to_num(size).max(-1)
    # only the worst sight of a moment goes at once: it drags the pose along
    return np.asarray((known > SETTINGS.outlier) & (known == known.max((0, 2), keepdims=True)))


def alikeness(residuals: Array, sights: BodySights) -> float:
    """How many moments count as one: the residuals' correlation (m, n, q, 2) summed over lags, 1 where there is none.

    What a centroid errs changes slowly where a target's picture does: a thousand samples then say less than a thousand
    independent ones.
    """
    series = residuals - np.nanmean(residuals, 1, keepdims=True)
    total = 1.0
    variance = np.nanmean(series**2)
    for lag in range(1, min(SETTINGS.most_lag, series.shape[1] // 4)):
        same = (sights.run[lag:] == sights.run[:-lag])[None, :, None, None]
        products = np.where(same, series[:, lag:] * series[:, :-lag], np.nan)
        rho = float(np.nanmean(products) / variance) if np.isfinite(products).any() else 0.0
        if not rho > 0.03:
            break
        total += 2 * rho
    return total
