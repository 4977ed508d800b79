"""Refine a camera by least squares on the picture: the measured minus the projected position, in px.

Levenberg's and Marquardt's method with the analytic derivatives of `vidtrack.geometry.jacobian`. The error is measured
where the noise lies, in the distorted frame buffer: undistorted errors can be made small by a lens that shrinks
the picture. A surveyed point's own tolerance is projected into the picture and weighs with the centroid's noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, fold_radius, project
from vidtrack.geometry.interface import free_of, pulls_of
from vidtrack.geometry.jacobian import PARAMETERS, Derivatives, derivatives, stepped
from vidtrack.geometry.jacobian import columns as columns_of
from vidtrack.geometry.lens_terms import LENS_MODELS

POSE = PARAMETERS[:6]
INNER = ("f", "Sx", "Cx", "Cy")


class Uncertainty(NamedTuple):
    """How well a calibration knows the camera; the attitude is varied about the pivot (see `geometry.jacobian`)."""

    names: tuple[str, ...]  # of the freed parameters, in the order of PARAMETERS
    pivot: Array  # (3,) world units
    covariance: Array  # (k, k), units of the parameters

    @property
    def standard_errors(self) -> Array:
        """One standard error of each parameter, (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """Correlation of each pair of parameters, (k, k), no unit."""
        s = self.standard_errors
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.covariance / s[:, None] / s


class Fit(NamedTuple):
    """A refined camera and what is left over."""

    camera: Camera
    uncertainty: Uncertainty
    residuals: Array  # (n, 2) measured minus projected, px
    rms_px: float  # root of the mean squared distance
    sigma_px: float  # noise of one coordinate that the residuals show, with the freed parameters counted
    misfit: float  # residuals over the sd they were said to have: 1 when the sd is right
    cost: float  # weighted sum of squares, priors included
    iterations: int
    converged: bool
    message: str


def free_parameters(model: str, fixed: Sequence[str] = ()) -> tuple[str, ...]:
    """The parameters that a lens model frees, in the order of PARAMETERS, without the fixed ones.

    dx and dy are never free: Sx and f already scale the two axes of the picture.
    Raises ValueError for an unknown model.
    """
    if model not in LENS_MODELS:
        raise ValueError(f"no such lens model: {model!r}; there are {', '.join(LENS_MODELS)}")
    names = {*POSE, *INNER, *LENS_MODELS[model]} - set(fixed)
    return tuple(name for name in PARAMETERS if name in names)


def refine(
    camera: Camera,
    p: ArrayLike,
    b: ArrayLike,
    *,
    free: Sequence[str],
    sd: ArrayLike | None = None,
    survey: ArrayLike | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    pivot: ArrayLike | None = None,
    max_iterations: int = 300,
    tolerance: float = 1e-12,
) -> Fit:
    """Find the camera whose projections lie nearest, in the least-squares sense, to the measured positions.

    camera   where to start
    p        (n, 3)  surveyed points, world units
    b        (n, 2)  measured, px; n finite points (leave lost ones out)
    free     names out of PARAMETERS; the rest stays as in `camera`. Interfaces that are not known exactly are refined
             with them, what is known of them as prior; their names may be among these
    sd       px, noise of the positions: a number, (n,) or (n, 2); None: unknown, and taken from the residuals
    survey   world units, tolerance of the points in each coordinate: a number or (n,); None: exact
    priors   name: (mean, sd) for any freed parameter but the attitude's, in its own unit
    pivot    (3,)  default: the mean of p
    The covariance is scaled by the misfit, so that a noise said too small does not flatter the standard errors.
    With an unknown noise and priors a second pass weighs the priors with the noise that the first one found.
    Never raises for a fit that fails: `converged` is False and `message` says why.
    Raises ValueError for shapes that do not match, unknown names, or priors on what is not freed.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    _check(p, b, [name for name in free if name not in free_of(camera.through)], priors or {})
    names = (*(name for name in PARAMETERS if name in set(free)), *free_of(camera.through))
    pivot = p.mean(0) if pivot is None else np.asarray(pivot, float)
    problem = _Problem(p, b, names, pivot, dict(priors or {}), max_iterations, tolerance)
    camera = _start_that_sees_all(camera, p)
    fit = _descend(problem, camera, whiteners(camera, p, sd, survey))
    if survey is not None:  # the tolerance was projected through the start; project it through the answer
        fit = _descend(problem, fit.camera, whiteners(fit.camera, p, sd, survey))
    if sd is None and survey is None and (priors or free_of(camera.through)) and np.isfinite(fit.sigma_px):
        fit = _descend(problem, fit.camera, whiteners(fit.camera, p, max(fit.sigma_px, 1e-9), None))
    return fit


class _Problem(NamedTuple):
    p: Array
    b: Array
    names: tuple[str, ...]
    pivot: Array
    priors: dict[str, tuple[float, float]]
    max_iterations: int
    tolerance: float


def _check(p: Array, b: Array, free: Sequence[str], priors: Mapping[str, tuple[float, float]]) -> None:
    if p.ndim != 2 or p.shape[1] != 3 or b.shape != (len(p), 2):
        raise ValueError(f"points must be (n, 3) and positions (n, 2), not {p.shape} and {b.shape}")
    if not (np.isfinite(p).all() and np.isfinite(b).all()):
        raise ValueError("points and positions must be finite: leave out those that were not found")
    unknown = set(free) - set(PARAMETERS)
    if unknown:
        raise ValueError(f"no such parameters: {', '.join(sorted(unknown))}")
    if bad := [name for name in priors if name not in free or name in POSE]:
        raise ValueError(f"a prior needs a freed parameter of the camera itself, not {', '.join(bad)}")


def _start_that_sees_all(camera: Camera, p: Array) -> Camera:
    """The start, its lens straightened when it folds some point away."""
    if np.isfinite(project(camera, p)).all():
        return camera
    return camera.without_lens()


def whiteners(camera: Camera, p: Array, sd: ArrayLike | None, survey: ArrayLike | None) -> Array:
    """Matrices W (n, 2, 2), 1/px, with W^T W the inverse of `covariances`."""
    return inverse_root(covariances(camera, p, sd, survey))


def covariances(camera: Camera, p: Array, sd: ArrayLike | None, survey: ArrayLike | None) -> Array:
    """Covariance (n, 2, 2), px^2, of measured minus projected positions: the centroid's own noise (1 px where unknown)
    and the survey's, as the camera projects it. Arguments as for `refine`."""
    n = len(p)
    sd = np.asarray(1.0 if sd is None else sd, float)
    sd = np.broadcast_to(sd[:, None] if sd.ndim == 1 else sd, (n, 2))
    if not (sd > 0).all():
        raise ValueError("sd must be positive")
    C = np.zeros((n, 2, 2))
    C[:, 0, 0], C[:, 1, 1] = sd[:, 0] ** 2, sd[:, 1] ** 2
    if survey is not None and np.any(np.asarray(survey) > 0):
        J = np.nan_to_num(derivatives(camera, p, p.mean(0), ()).by_point)
        C += J @ np.swapaxes(J, -1, -2) * (np.broadcast_to(np.asarray(survey, float), n) ** 2)[:, None, None]
    return C


def inverse_root(C: Array) -> Array:
    """W (..., 2, 2), lower triangular, with W^T W = C^-1, of covariances C (..., 2, 2)."""
    W = np.zeros(C.shape)
    a = C[..., 0, 0]
    rest = np.maximum(C[..., 1, 1] - C[..., 0, 1] ** 2 / a, 1e-15 * C[..., 1, 1])  # rounding makes no variance negative
    W[..., 0, 0] = 1 / np.sqrt(a)
    W[..., 1, 1] = 1 / np.sqrt(rest)
    W[..., 1, 0] = -C[..., 0, 1] / a * W[..., 1, 1]
    return W


def _descend(problem: _Problem, camera: Camera, W: Array) -> Fit:
    """Levenberg-Marquardt with Marquardt's scaling and Nielsen's damping."""
    at = derivatives(camera, problem.p, problem.pivot, problem.names)
    r, J = _weighted(problem, camera, at, W)
    cost = _cost(r)
    damping, growth, message, steps = 1e-4, 2.0, "the fit ran out of iterations", 0
    if not np.isfinite(cost):
        return _finish(problem, camera, at, W, 0, False, "the start does not see every point")
    while steps < problem.max_iterations:
        steps += 1
        gradient, H = J.T @ r, J.T @ J
        scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
        step = _step(H / scale[:, None] / scale, gradient / scale, damping) / scale
        predicted = float(step @ (gradient + gradient - H @ step))  # the fall of the cost that the tangent predicts
        if predicted <= problem.tolerance * cost + 1e-26:
            message = ""
            break
        trial = _stepped(problem, camera, step)
        if trial is not None:
            at_trial = derivatives(trial, problem.p, problem.pivot, problem.names)
            r_trial, J_trial = _weighted(problem, trial, at_trial, W)
            gain = (cost - _cost(r_trial)) / predicted
            if gain > 0:
                camera, at, r, J, cost = trial, at_trial, r_trial, J_trial, _cost(r_trial)
                damping, growth = damping * max(1 / 10, 1 - (2 * gain - 1) ** 3), 2.0
                continue
        damping, growth = damping * growth, growth * 2
        if damping > 1e12:  # no step helps: as far down as rounding allows
            message = ""
            break
    return _finish(problem, camera, at, W, steps, message == "", message)


def _step(H: Array, gradient: Array, damping: float) -> Array:
    damped = H + damping * np.eye(len(H))
    try:
        return np.asarray(np.linalg.solve(damped, gradient))
    except np.linalg.LinAlgError:  # damping too small to count, and something that no point settles: it stays
        return np.asarray(np.linalg.lstsq(damped, gradient, rcond=None)[0])


def _stepped(problem: _Problem, camera: Camera, step: Array) -> Camera | None:
    try:
        return stepped(camera, problem.pivot, dict(zip(problem.names, step.tolist(), strict=True)))
    except ValueError:  # f or Sx would turn negative
        return None


def _weighted(problem: _Problem, camera: Camera, at: Derivatives, W: Array) -> tuple[Array, Array]:
    """Weighted residuals (m,) and minus their derivatives by the freed parameters (m, k); priors come last."""
    columns = columns_of(camera, problem.names)
    r = (W @ (problem.b - at.projected)[..., None]).reshape(-1)
    J = (W @ at.by_parameter[..., columns]).reshape(r.size, len(columns))
    known = {name: (mean - getattr(camera, name), sd) for name, (mean, sd) in problem.priors.items()}
    known |= pulls_of(camera.through)
    if not known:
        return r, J
    pull = np.array([off / sd for off, sd in known.values()])
    rows = np.zeros((len(pull), len(columns)))
    for row, (name, (_, sd)) in zip(rows, known.items(), strict=True):
        row[problem.names.index(name)] = 1 / sd
    return np.concatenate([r, pull]), np.concatenate([J, rows])


def _cost(r: Array) -> float:
    cost = float(r @ r)
    return cost if np.isfinite(cost) else np.inf


def _finish(
    problem: _Problem, camera: Camera, at: Derivatives, W: Array, iterations: int, converged: bool, message: str
) -> Fit:
    r, J = _weighted(problem, camera, at, W)
    residuals = problem.b - at.projected
    n, k = len(problem.p), len(problem.names)
    freedom = max(2 * n + len(problem.priors) + len(free_of(camera.through)) - k, 1)
    misfit = np.sqrt(_cost(r) / freedom)
    covariance = covariance_of(J) * misfit**2 if np.isfinite(misfit) else np.full((k, k), np.nan)
    if converged and not np.isfinite(covariance).all():
        converged, message = False, "the points do not settle every freed parameter"
    sse = float((residuals**2).sum())
    return Fit(
        camera=camera,
        uncertainty=Uncertainty(problem.names, problem.pivot, covariance),
        residuals=residuals,
        rms_px=float(np.sqrt(sse / n)),
        sigma_px=float(np.sqrt(sse / max(2 * n - k, 1))),
        misfit=float(misfit),
        cost=_cost(r),
        iterations=iterations,
        converged=converged,
        message=message,
    )


def covariance_of(J: Array) -> Array:
    """(J^T J)^-1, (k, k), of weighted derivatives J (m, k), column by column scaled; NaN where J does not settle it."""
    if not np.isfinite(J).all():
        return np.full((J.shape[1],) * 2, np.nan)
    scale = np.linalg.norm(J, axis=0)
    scale[scale == 0] = 1.0
    _, s, Vt = np.linalg.svd(np.linalg.qr(J / scale, mode="r"))
    if s.size < J.shape[1] or s[-1] < 1e-11 * s[0]:
        return np.full((J.shape[1],) * 2, np.nan)
    root = Vt.T / s / scale[:, None]
    return np.asarray(root @ root.T)


def best_of(fits: Sequence[Fit]) -> Fit:
    """The converged fit of least cost whose lens does not fold away a point; the least cost when none converged."""

    def rank(fit: Fit) -> tuple[bool, bool, float]:
        return (not fit.converged, not fold_radius(fit.camera) > 0, fit.cost)

    return min(fits, key=rank)
