"""One camera, one plane: from the frame buffer to the plane in which the target moves.

    frame buffer Xf, Yf --aspect, lens--> square px --scale or homography or polynomial--> world x, y

The thesis's chapter 4.2 multiplies by a scale factor, X by 1.25 more because its pixels are not square; its
section 5.2 asks for a polynomial or a lens function where the points allow. The models, from plain to rich:

    scale       x = s Q(angle) (aspect Xf, Yf) + t     4 numbers, from two points on
    affine      any linear map                         6, three points: finds the aspect by itself
    homography  a tilted plane                         8, four points
    radial      a tilted plane behind Tsai's kappa1    9, five points
    quadratic   polynomial of the second degree       12, six points
    cubic       polynomial of the third degree        20, ten points

Coordinates lie on the last axis; NaN in, NaN out. Lengths of b are px, of p world units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array

MODELS = ("scale", "affine", "homography", "radial", "quadratic", "cubic")
"""From plain to rich; `fit_plane` climbs while points that it has not seen come out better."""

PARAMETERS = {"scale": 4, "affine": 6, "homography": 8, "radial": 9, "quadratic": 12, "cubic": 20}
_EXPONENTS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]


@dataclass(frozen=True, eq=False)
class Plane:
    """A map from the frame buffer to a plane, with the covariance of its numbers.

    theta        (k,)    the model's numbers, for coordinates normalised by the next four
    covariance   (k, k)  of theta
    aspect       Xf is multiplied by it: the width of a pixel over its height
    origin       (2,)    px, (Xf, Yf) where the normalised coordinates are zero
    span         px, one unit of the normalised coordinates
    centre       (2,)    px, where the optical axis meets the frame buffer (model radial)
    side         +1: world y runs down in the picture where x runs right (z away from the camera); -1: it runs up
    world_origin (2,), world_span: the same normalisation in the plane, world units
    """

    model: str
    theta: Array
    covariance: Array
    aspect: float
    origin: Array
    span: float
    centre: Array
    side: int
    world_origin: Array
    world_span: float


LEAST_SPREAD = 0.02
"""Second over first singular value of points, below which they are taken to lie on one line."""


class PlaneFit(NamedTuple):
    """A fitted plane and how far to trust it; lengths in world units."""

    plane: Plane
    residuals: Array  # (n, 2) surveyed minus located, at the points of the fit
    held_out: dict[str, float]  # model: rms distance at points left out, NaN where there are too few points
    chi2: float  # reduced: 1 where the stated noise explains the residuals, nan without redundancy


def scaled_plane(scale: float, aspect: float = 1.0, relative_sd: float = 0.0) -> Plane:
    """The thesis's plane: x = scale aspect Xf, y = scale Yf; y runs down, as in the picture (4.2.6, 4.2.7, 4.2.5).

    scale        world units per px of Yf
    relative_sd  of the scale, no unit
    Raises ValueError when scale or aspect is not positive. Check in the head: 39 px a foot, Xf = 78: 2.00 ft.
    """
    if not (scale > 0 and aspect > 0):
        raise ValueError(f"scale and aspect must be positive, not {scale} and {aspect}")
    covariance = np.zeros((4, 4))
    covariance[0, 0] = relative_sd**2
    theta, zero = np.array([1.0, 0, 0, 0]), np.zeros(2)
    return Plane("scale", theta, covariance, aspect, zero, 1.0, zero, 1, zero, scale)


def world_from_frame_buffer(plane: Plane, b: ArrayLike) -> Array:
    """World x, y (..., 2) of frame buffer positions (..., 2) px."""
    return _world(plane, plane.theta, np.asarray(b, float))


def world_covariance(plane: Plane, b: ArrayLike, sd: ArrayLike) -> Array:
    """Covariance (..., 2, 2), world units squared, of the located position: centroid noise and the plane's own.

    b   (..., 2)  px
    sd  scalar or (..., 2), px: standard deviation of Xf and Yf
    """
    b = np.asarray(b, float)
    sd = np.broadcast_to(np.asarray(sd, float), b.shape)
    Jb, Jt = jacobian_by_position(plane, b), _by_theta(plane, plane.theta, b)
    noise: Array = (Jb * sd[..., None, :] ** 2) @ np.swapaxes(Jb, -1, -2)
    return noise + Jt @ plane.covariance @ np.swapaxes(Jt, -1, -2)


def jacobian_by_position(plane: Plane, b: ArrayLike) -> Array:
    """d(x, y)/d(Xf, Yf), (..., 2, 2), world units per px."""
    b = np.asarray(b, float)
    steps = (b + 1e-30j * e for e in np.eye(2))  # complex step: exact, no difference is taken
    return np.stack([_world(plane, plane.theta, s).imag / 1e-30 for s in steps], -1)


def fit_plane(
    b: ArrayLike,
    p: ArrayLike,
    *,
    sd: ArrayLike = 0.1,
    sigma: ArrayLike = 0.0,
    aspect: float = 1.0,
    centre: ArrayLike | None = None,
    model: str = "auto",
) -> PlaneFit:
    """Fit the plane to known points, and choose the model by points it has not seen.

    A richer model always fits its own points better; so each model is fitted again and again with some
    points left out and judged there. The plainest one within 5 % of the best wins. Where points are too few to
    leave any out, a model is accepted when its residuals are what the stated noise explains.

    b       (n, 2)  px, sightings; a row of NaN is left out
    p       (n, 2)  world units, surveyed
    sd      scalar, (n,) or (n, 2), px; sigma scalar or (n,), world units: noise of sightings and survey
    centre  (2,)    px, of the lens; the middle of the points where none is given
    model   one of MODELS, or auto
    Raises ValueError for fewer than two distinct points, an unknown model, or one that the points cannot hold.
    """
    pixels: Array = np.asarray(b, float)
    places: Array = np.asarray(p, float)
    sd = np.broadcast_to(np.asarray(sd, float).T, pixels.T.shape).T
    sigma = np.broadcast_to(np.asarray(sigma, float), pixels.shape[:1])
    good = np.isfinite(pixels).all(-1) & np.isfinite(places).all(-1)
    pixels, places = pixels[good], places[good]
    start = _normalised(pixels, places, aspect, centre)
    noise = np.sqrt((sd[good] ** 2).mean(-1) * start.world_span**2 / start.span**2 + sigma[good] ** 2)
    allowed = [m for m in MODELS if holds(m, pixels)]

    def fitted(model: str) -> PlaneFit:
        return _finished(_fit(start, model, pixels, places, noise), pixels, places, noise, held_out)

    held_out: dict[str, float] = {}
    if model != "auto":
        if model not in MODELS:
            raise ValueError(f"no model '{model}'; there are {', '.join(MODELS)}")
        if model not in allowed:
            raise ValueError(f"{len(pixels)} points as they lie cannot hold the model '{model}'")
        return fitted(model)
    held_out = {m: _held_out(start, m, pixels, places, noise) for m in allowed}
    known = {m: e for m, e in held_out.items() if np.isfinite(e)}
    chosen = _plainest(known) if known else allowed[0]
    # Four points cannot judge a homography, nor three an affine map; the stated noise can.
    fit = fitted(chosen)
    for richer in ("affine", "homography"):
        if fit.chi2 > 4 and richer in allowed[allowed.index(chosen) + 1 :] and richer not in known:
            fit = fitted(richer)
    return fit


def _plainest(held_out: dict[str, float]) -> str:
    floor = 1.05 * min(held_out.values())
    return next(m for m in held_out if held_out[m] <= floor)


def _normalised(b: Array, p: Array, aspect: float, centre: ArrayLike | None) -> Plane:
    if len(b) < 2 or not np.ptp(p, axis=0).any() or not np.ptp(b, axis=0).any():
        raise ValueError(f"{len(b)} usable points; a scale needs two that differ")
    span = float(np.sqrt(((b - b.mean(0)) ** 2 * [aspect**2, 1]).sum(-1).mean()))
    world_span = float(np.sqrt(((p - p.mean(0)) ** 2).sum(-1).mean()))
    middle = b.mean(0) if centre is None else np.asarray(centre, float)
    side = -1  # ASSUME: points on one line leave the side open; z then points towards the camera, y up
    if _spread(p) > 1e-3 and _spread(b) > 1e-3:
        A = np.linalg.lstsq(b - b.mean(0), p - p.mean(0), rcond=None)[0]
        side = 1 if np.linalg.det(A) > 0 else -1
    return Plane("scale", np.zeros(4), np.zeros((4, 4)), aspect, b.mean(0), span, middle, side, p.mean(0), world_span)


def _spread(p: Array) -> float:
    """Second over first singular value of the centred points: 0 when they lie on a line."""
    s = np.linalg.svd(p - p.mean(0), compute_uv=False)
    return float(s[1] / s[0]) if len(s) > 1 and s[0] > 0 else 0.0


def on_one_line(b: Array) -> bool:
    """Whether points (n, 2) lie nearly on a line, however it runs: they say nothing of what is across it."""
    return _spread(b) < LEAST_SPREAD


def holds(model: str, b: Array) -> bool:
    """Whether points as they lie determine the model: enough of them, and of full rank."""
    if len(b) < 2 or 2 * len(b) < PARAMETERS[model]:
        return False
    if model == "scale":
        return True
    if on_one_line(b):
        return False
    q = (b - b.mean(0)) / max(float(np.ptp(b)), 1e-300)
    powers = {"affine": 3, "homography": 3, "radial": 3, "quadratic": 6, "cubic": 10}[model]
    monomials = np.stack([q[:, 0] ** i * q[:, 1] ** j for i, j in _EXPONENTS[:powers]], -1)
    s = np.linalg.svd(monomials / np.maximum(np.abs(monomials).max(0), 1e-300), compute_uv=False)
    if s[-1] < 1e-3 * s[0]:
        return False
    return model not in ("homography", "radial") or _four_apart(q)


def _four_apart(q: Array) -> bool:
    """Whether the DLT has a one-dimensional answer: false when all but one of the points lie on a line."""
    s = np.linalg.svd(_dlt_rows(q / np.abs(q).max(), q / np.abs(q).max()), compute_uv=False)
    return len(s) >= 8 and bool(s[7] > 1e-4 * s[0])


def _q(plane: Plane, b: Array) -> Array:
    q: Array = (b - plane.origin) * np.array([plane.aspect, 1.0]) / plane.span
    return q


def _world(plane: Plane, theta: Array, b: Array) -> Array:
    """The map itself; works with complex arguments, so that its derivatives are exact."""
    q = _q(plane, b)
    if plane.model == "scale":
        a, c, tx, ty = theta
        x, y = q[..., 0], plane.side * q[..., 1]
        w = np.stack([a * x - c * y + tx, c * x + a * y + ty], -1)
    elif plane.model in ("homography", "radial"):
        if plane.model == "radial":
            m = _q(plane, plane.centre)
            d = q - m
            q = m + d * (1 + theta[8] * (d * d).sum(-1, keepdims=True))
        depth = 1 + q[..., 0] * theta[6] + q[..., 1] * theta[7]
        w = (q @ theta[:6].reshape(2, 3)[:, :2].T + theta[:6].reshape(2, 3)[:, 2]) / depth[..., None]
    else:
        k = len(theta) // 2
        monomials = np.stack([q[..., 0] ** i * q[..., 1] ** j for i, j in _EXPONENTS[:k]], -1)
        w = monomials @ theta.reshape(2, k).T
    return plane.world_origin + plane.world_span * w


def _by_theta(plane: Plane, theta: Array, b: Array) -> Array:
    steps = (theta + 1e-30j * e for e in np.eye(len(theta)))
    return np.stack([_world(plane, s, b).imag / 1e-30 for s in steps], -1)


def _fit(start: Plane, model: str, b: Array, p: Array, noise: Array) -> Plane:
    """The weighted least-squares fit; noise (n,) in world units."""
    floor = 1e-12 * start.world_span
    plane = replace(start, model=model)
    theta = np.zeros(PARAMETERS[model])
    if model in ("homography", "radial"):
        theta[:8] = _dlt(_q(start, b), (p - start.world_origin) / start.world_span)
    for _ in range(30 if model in ("homography", "radial") else 1):
        J = (_by_theta(plane, theta, b) / (noise + floor)[:, None, None]).reshape(-1, len(theta))
        r = ((p - _world(plane, theta, b)) / (noise + floor)[:, None]).ravel()
        step = np.linalg.lstsq(J, r, rcond=None)[0]
        theta = theta + step
        if np.abs(step).max() < 1e-13:
            break
    J = (_by_theta(plane, theta, b) / (noise + floor)[:, None, None]).reshape(-1, len(theta))
    return replace(plane, theta=theta, covariance=np.asarray(np.linalg.pinv(J.T @ J), float))


def _dlt_rows(q: Array, w: Array) -> Array:
    one, zero = np.ones(len(q)), np.zeros((len(q), 3))
    h = np.column_stack([q, one])
    first = np.hstack([h, zero, -w[:, :1] * h])
    second = np.hstack([zero, h, -w[:, 1:] * h])
    return np.vstack([first, second])


def _dlt(q: Array, w: Array) -> Array:
    """The homography's eight numbers from normalised points: direct linear transform (Hartley & Zisserman, 4.1)."""
    h = np.linalg.svd(_dlt_rows(q, w))[2][-1]
    h = h / h[8]
    return np.array([h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7]])


def _finished(plane: Plane, b: Array, p: Array, noise: Array, held_out: dict[str, float]) -> PlaneFit:
    residuals = p - world_from_frame_buffer(plane, b)
    spare = residuals.size - len(plane.theta)
    with np.errstate(divide="ignore", invalid="ignore"):
        chi2 = float(((residuals / noise[:, None]) ** 2).sum() / spare) if spare > 0 and (noise > 0).all() else np.nan
    # A model that misses by more than the stated noise is no surer than its misses.
    if chi2 > 1:
        plane = replace(plane, covariance=plane.covariance * chi2)
    return PlaneFit(plane, residuals, held_out, chi2)


def _held_out(start: Plane, model: str, b: Array, p: Array, noise: Array) -> float:
    """Rms distance, world units, at points left out in turn (ten parts at most)."""
    parts = min(len(b), 10)
    fold = np.arange(len(b)) % parts
    errors = []
    for k in range(parts):
        seen = fold != k
        if not holds(model, b[seen]) or (model == "scale" and len(b) == 2):
            return float("nan")
        plane = _fit(start, model, b[seen], p[seen], noise[seen])
        errors.append(((p[~seen] - world_from_frame_buffer(plane, b[~seen])) ** 2).sum(-1))
    return float(np.sqrt(np.concatenate(errors).mean()))
