"""Calibration of all cameras and the surveyed points together.

Calibrated one by one, each camera takes the survey for exact and bends to its errors. Together they see
that a ball hangs beside its surveyed place, for all of them say so. The survey then speaks as what it is, a
measurement of known tolerance, and weighs against the pixels (Brown 1958; Triggs et al. 2000):

    minimise  sum |b - project(camera, x)|^2 / sd^2  +  sum |p - x|^2 / sigma^2  +  priors

over every camera's free parameters and every point x. Levenberg-Marquardt on the normal equations of
`normal_equations`, which eliminate the points. The pixel noise need not be known: it is found from what the
sights leave over, by the share of each that the fit cannot follow (its redundancy; Foerstner 1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.normal_equations import (
    Covariance,
    Linearised,
    Names,
    Normal,
    Priors,
    columns,
    covariance,
    linearised,
    normal_equations,
    solved,
    with_priors,
)
from vidtrack.calibration.refine import Uncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import PARAMETERS, stepped

Mask = NDArray[np.bool_]

LEAST_SD = 1e-3
"""px; ASSUME: no centroid is better, so that perfect simulated sights do not make the survey worthless."""


class Bundle(NamedTuple):
    """What `bundle` returns: m cameras, n points, K free parameters in all."""

    cameras: tuple[Camera, ...]
    points: Array  # (n, 3) world units, where the points are thought to be
    free: tuple[tuple[str, ...], ...]  # for each camera, the names of its free parameters, in the order of PARAMETERS
    pivot: Array  # (3,) about which the cameras' omega turn
    covariance: Array  # (K, K) of all cameras' free parameters, in the order of `free`
    point_covariance: Array  # (n, 3, 3) world units^2
    residuals: Array  # (m, n, 2) measured minus projected, px; NaN where not seen
    sd: Array  # (m, n, 2) px, standard deviation of each measurement, after scaling
    sigma_px: float  # px, root mean square of sd
    survey_factor: float  # how many times larger the survey's errors are than sigma says; NaN for an exact survey
    survey_shift: Array  # (n, 3) point minus survey, in standard deviations of itself; NaN where the point cannot move
    steps: int
    converged: bool

    def uncertainty(self, i: int) -> Uncertainty:
        """How well camera i alone is known; its ties to the other cameras are in `covariance`."""
        place, _ = columns(self.free)[i]
        return Uncertainty(self.free[i], self.pivot, self.covariance[place, place])


def bundle(
    cameras: Sequence[Camera],
    p: ArrayLike,
    b: ArrayLike,
    *,
    sigma: ArrayLike,
    free: Names,
    sd: ArrayLike = 1.0,
    scale_sd: bool = True,
    priors: Priors | None = None,
    max_steps: int = 100,
) -> Bundle:
    """Refine m cameras and n surveyed points together, from cameras that are nearly right.

    p         (n, 3)     surveyed world points
    b         (m, n, 2)  frame buffer px; NaN where a camera does not show the point
    sigma     world units, the survey's tolerance (1 sigma): a number, (n,) or (n, 3). 0 holds a point where it was
              surveyed; inf says nothing of it. With 0 for all, every camera is refined on its own
    free      for each camera the names of its free parameters (see `jacobian.PARAMETERS`)
    sd        px, standard deviation of the centroids: a number, (m, 1, 1) or whatever spreads to (m, n, 2)
    scale_sd  sd is right but for one factor, which is found from the sights
    priors    for each camera {name: (mean, standard deviation)} of what is known beforehand
    Raises ValueError for shapes that do not match, fewer measurements than unknowns, or measurements that leave
    a parameter open. `converged` is False where the last step still gained.
    With sigma = inf nothing ties the world down but the other points.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    if p.shape != (len(p), 3) or b.shape != (len(cameras), len(p), 2) or len(free) != len(cameras):
        raise ValueError(f"p must be (n, 3), b (m, n, 2) and free m names, not {p.shape}, {b.shape}, {len(free)}")
    problem = _Problem(p, b, sigma, free, priors or [{} for _ in cameras])
    spread = np.broadcast_to(np.asarray(sd, float), b.shape)
    state = problem.start(cameras, spread)
    scale = problem.first_scale(state, spread) if scale_sd else 1.0
    steps = 0
    for _ in range(20):
        state, taken, converged = problem.minimise(state, spread * scale, max_steps)
        steps += taken
        known = covariance(problem.normal(state, spread * scale), state.seen, problem.free)
        found = problem.scale(state, known, spread, scale) if scale_sd else scale
        if abs(found / scale - 1) < 1e-3:
            break
        scale = found
    return problem.result(state, known, spread * scale, steps, converged)


def cameras_only(
    cameras: Sequence[Camera],
    p: ArrayLike,
    b: ArrayLike,
    *,
    sigma: ArrayLike,
    free: Names,
    sd: ArrayLike,
    priors: Priors | None = None,
    tolerance: float = 1e-6,
) -> tuple[Camera, ...]:
    """The cameras of `bundle` with known noise sd, without any covariance: for refits that start near the answer.

    tolerance  share of the cost below which a step's gain ends the search; 1e-6 is a hundredth of a standard error
    Raises ValueError as `bundle` does.
    """
    b = np.asarray(b, float)
    problem = _Problem(np.asarray(p, float), b, sigma, free, priors or [{} for _ in cameras])
    spread = np.broadcast_to(np.asarray(sd, float), b.shape)
    return problem.minimise(problem.start(cameras, spread), spread, 100, tolerance)[0].cameras


class _State(NamedTuple):
    """Cameras and points on the way to the least cost."""

    cameras: tuple[Camera, ...]
    x: Array  # (n, 3)
    seen: Linearised
    cost: float


class _Problem:
    """All that is measured, and what may move."""

    def __init__(self, p: Array, b: Array, sigma: ArrayLike, free: Names, priors: Priors) -> None:
        self.p, self.b, self.priors = p, b, priors
        self.free = tuple(tuple(sorted(names, key=PARAMETERS.index)) for names in free)
        self.measured: Mask = np.asarray(np.isfinite(b).all(-1))
        with np.errstate(divide="ignore"):
            self.information = 1 / _tolerance(sigma, p.shape) ** 2
        # an unsurveyed point that fewer than two cameras see says nothing, and may as well stay
        idle = (self.information == 0).any(-1) & (self.measured.sum(0) < 2)
        self.measured &= ~idle
        self.information[idle] = np.inf
        self.moves = np.isfinite(self.information)
        self.pivot = p[self.measured.any(0)].mean(0) if self.measured.any() else np.zeros(3)
        for i, names in enumerate(self.free):
            told = 2 * int(self.measured[i].sum()) + sum(name in names for name in priors[i])
            if told < len(names):
                raise ValueError(f"camera {i}: {told} measurements for {len(names)} unknown parameters")

    def start(self, cameras: Sequence[Camera], sd: Array) -> _State:
        state = self.at(tuple(cameras), self.p, sd)
        if not np.isfinite(state.cost):
            raise ValueError("a measured point does not project through the starting cameras")
        return state

    def at(self, cameras: tuple[Camera, ...], x: Array, sd: Array) -> _State:
        seen = linearised(cameras, x, self.pivot)
        return _State(cameras, x, seen, self.cost(cameras, x, seen, sd))

    def cost(self, cameras: Sequence[Camera], x: Array, seen: Linearised, sd: Array) -> float:
        """What is minimised, no unit; inf where a measured point does not project."""
        left = ((self.b - seen.projected) / sd)[self.measured]
        survey = (self.information[self.moves]) * ((x - self.p)[self.moves]) ** 2
        prior = [
            ((mean - getattr(camera, name)) / spread) ** 2
            for camera, names, known in zip(cameras, self.free, self.priors, strict=True)
            for name, (mean, spread) in known.items()
            if name in names
        ]
        total = float((left**2).sum() + survey.sum() + sum(prior))
        return total if np.isfinite(total) else np.inf

    def normal(self, state: _State, sd: Array) -> Normal:
        weight = np.where(self.measured[..., None], 1 / sd**2, 0.0)
        left = self.b - state.seen.projected
        normal = normal_equations(state.seen, left, weight, self.free, self.information, self.p - state.x)
        return with_priors(normal, state.cameras, self.free, self.priors)

    def minimise(self, state: _State, sd: Array, max_steps: int, tolerance: float = 1e-9) -> tuple[_State, int, bool]:
        """Levenberg-Marquardt: damp until the cost falls, relax after each success."""
        state = state._replace(cost=self.cost(*state[:3], sd))
        damping = 1e-8
        for taken in range(max_steps):
            normal = self.normal(state, sd)
            while True:
                cameras, points = solved(normal, damping)
                promised = float(cameras @ normal.g + (points * normal.h).sum())
                if promised <= tolerance * state.cost + 1e-12:
                    return state, taken, True
                trial = self.stepped(state, cameras, points, sd)
                if trial.cost <= state.cost:
                    break
                damping = max(damping, 1e-8) * 100
                if damping > 1e12:
                    return state, taken, False
            state, damping = trial, damping / 10
        return state, max_steps, False

    def stepped(self, state: _State, cameras: Array, points: Array, sd: Array) -> _State:
        try:
            moved = tuple(
                stepped(camera, self.pivot, dict(zip(names, cameras[place], strict=True)))
                for camera, names, (place, _) in zip(state.cameras, self.free, columns(self.free), strict=True)
            )
        except ValueError:  # so large a step that f or Sx would be negative
            return state._replace(cost=np.inf)
        return self.at(moved, state.x + points, sd)

    def first_scale(self, state: _State, spread: Array) -> float:
        """The scale of sd if all that remains before the first step were centroid noise."""
        left = ((self.b - state.seen.projected) / spread)[self.measured]
        return max(float(np.sqrt(np.mean(left**2))), LEAST_SD / float(spread.mean())) if left.size else 1.0

    def scale(self, state: _State, known: Covariance, spread: Array, scale: float) -> float:
        """The scale of sd that makes the sights' residuals as large as their redundancy says they should be."""
        left = ((self.b - state.seen.projected) / spread)[self.measured]
        redundancy = (1 - known.fitted / (spread * scale) ** 2)[self.measured].sum()
        if redundancy < 0.5:
            return scale
        return max(float(np.sqrt((left**2).sum() / redundancy)), LEAST_SD / float(spread.mean()))

    def result(self, state: _State, known: Covariance, sd: Array, steps: int, converged: bool) -> Bundle:
        left = np.where(self.measured[..., None], self.b - state.seen.projected, np.nan)
        shift = state.x - self.p
        variance = np.einsum("naa->na", known.points)
        surveyed = self.moves & (self.information > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            redundancy = np.where(surveyed, 1 - variance * self.information, np.nan)
            normalised = shift * np.sqrt(self.information / redundancy)
        normalised = np.where(redundancy > 1e-6, normalised, np.nan)
        told = float(np.nansum(redundancy))
        factor = np.sqrt(np.sum(self.information[surveyed] * shift[surveyed] ** 2) / told) if told > 0.5 else np.nan
        sigma_px = np.sqrt(np.mean(sd[self.measured] ** 2)) if self.measured.any() else np.nan
        return Bundle(
            cameras=state.cameras,
            points=state.x,
            free=self.free,
            pivot=self.pivot,
            covariance=known.cameras,
            point_covariance=known.points,
            residuals=left,
            sd=sd,
            sigma_px=float(sigma_px),
            survey_factor=float(factor),
            survey_shift=normalised,
            steps=steps,
            converged=converged,
        )


def _tolerance(sigma: ArrayLike, shape: tuple[int, ...]) -> Array:
    sigma = np.asarray(sigma, float)
    if not (sigma >= 0).all():
        raise ValueError("sigma must be 0 or more for every point")
    return np.broadcast_to(sigma[:, None] if sigma.ndim == 1 else sigma, shape).copy()
