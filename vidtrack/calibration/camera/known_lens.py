"""A camera whose lens is known, placed by few points: from four on, only its attitude and its place are sought.

Three points leave up to four places, four or more in one plane two that may differ by less than the noise. So every
place is started from (three points at a time, Haralick et al. 1994; all points, Terzakis and Lourakis 2020), all are
refined, and those that the points cannot distinguish are given beside the best.

The lens is held, or known with a covariance: then it is refined with the place, its covariance as prior.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.adjust import Problem, adjust
from vidtrack.calibration.adjustment.measurements import KnownCameras, Sights
from vidtrack.calibration.adjustment.unknowns import Family, State, Unknowns
from vidtrack.calibration.camera.outliers import Mask
from vidtrack.calibration.camera.refine import POSE, Fit, Uncertainty, covariances, refine, whiteners
from vidtrack.geometry.camera import Camera, project, undistorted_from_frame_buffer


@dataclass(frozen=True)
class Limits:
    """When places are alike, and what a point must be to be left out."""

    most_triples: int = 60  # of points from which places are started
    refined: int = 5  # starts, at most, that are refined
    same_start: float = 0.02  # of the distance to the points: starts nearer than this lead to one place
    same_place: float = 1e-3  # of the distance to the points: two places nearer than this are one
    as_likely: float = 9.0  # by which the sum of squares of another place may be larger: three standard deviations
    few_residuals: int = 20  # below it a small misfit is chance, and the stated noise counts
    fewest_to_reject: int = 6  # points, below which an outlier can be suspected and not left out
    gross: float = 8.0  # times the noise of the others that a point must be off to be left out
    most_rejected: float = 0.25  # share of the points
    worth: float = 3.0  # times by which the noise must be larger with it
    noise_unknown: float = 0.5  # px, of positions of which nothing is known: ASSUME a person picked them
    most_tried: int = 12  # points that are left out one after the other


LIMITS = Limits()


class KnownLens(NamedTuple):
    """A lens as it was given.

    camera      its f, Sx, Cx, Cy, dx, dy and lens terms; R and T mean nothing
    model       its lens model
    names       the parameters that its covariance is of; empty: it is held
    covariance  (k, k)
    source      where it is from, for people
    largest_px  how far the converted lens is from the one given, at most; rms_px its root mean square; 0 where it was
                given as this package's own
    """

    camera: Camera
    model: str
    names: tuple[str, ...] = ()
    covariance: Array | None = None
    source: str = ""
    largest_px: float = 0.0
    rms_px: float = 0.0


class Place(NamedTuple):
    """One place of the camera: a refinement of its attitude and place alone, and how likely it is."""

    fit: Fit
    squares: float  # sum of squares in standard deviations


def places(lens: Camera, p: Array, b: Array, sd: Array | None, survey: Array | None) -> list[Place]:
    """Every place from which a camera with this lens sees points p (n, 3), n >= 3, at b (n, 2) px; the best first.

    sd      (n, 2) px; None: unknown, 1 px is taken
    survey  (n,) world units, tolerance of the points; None: exact
    Empty where no place sees all of them.
    """
    found: list[Place] = []
    for camera in _different(_starts(lens, p, b), p, b):
        fit = refine(camera, p, b, free=POSE, sd=sd, survey=survey, max_iterations=60, tolerance=1e-9)
        if not np.isfinite(fit.cost):
            continue
        W = whiteners(fit.camera, p, sd, survey)
        found.append(Place(fit, float(((W @ fit.residuals[..., None]) ** 2).sum())))
    kept: list[Place] = []
    for place in sorted(found, key=lambda each: each.squares):
        apart = float(np.linalg.norm(p.mean(0) - place.fit.camera.position)) * LIMITS.same_place
        if all(np.linalg.norm(place.fit.camera.position - k.fit.camera.position) > apart for k in kept):
            kept.append(place)
    return kept


def _different(starts: list[Camera], p: Array, b: Array) -> list[Camera]:
    """The best starts that see every point, without those near to a better one: three points at a time give many."""
    kept: list[Camera] = []
    apart = LIMITS.same_start * max((float(np.linalg.norm(p.mean(0) - c.position)) for c in starts), default=0.0)
    for camera in sorted(starts, key=lambda c: _squares(c, p, b)):
        near = any(np.linalg.norm(camera.position - other.position) < apart for other in kept)
        if not near and np.isfinite(project(camera, p)).all():
            kept.append(camera)
        if len(kept) == LIMITS.refined:
            break
    return kept


def _squares(camera: Camera, p: Array, b: Array) -> float:
    """A robust measure of how far points lie from where they are seen: the sum over the better three quarters."""
    off = np.nan_to_num(((project(camera, p) - b) ** 2).sum(-1), nan=1e12)
    return float(np.sort(off)[: max(4, (3 * len(p) + 3) // 4)].sum())


def _starts(lens: Camera, p: Array, b: Array) -> list[Camera]:
    import cv2

    x = undistorted_from_frame_buffer(lens, b) / lens.f
    seen = np.isfinite(x).all(-1)
    if seen.sum() < 3:
        return []
    p, x = p[seen], x[seen]
    centre = p.mean(0)
    scale = float(np.abs(p - centre).max()) or 1.0
    q, x = np.ascontiguousarray((p - centre) / scale), np.ascontiguousarray(x)
    K = np.eye(3)
    answers = []
    spread = np.linalg.svd(q, compute_uv=False)
    if len(p) >= 4:
        flat = spread[2] < 0.05 * spread[0]
        for method in (cv2.SOLVEPNP_SQPNP, cv2.SOLVEPNP_IPPE) if flat else (cv2.SOLVEPNP_SQPNP,):
            try:
                answers.append(cv2.solvePnPGeneric(q, x[:, None], K, None, flags=method)[1:3])
            except cv2.error:  # a degenerate view for this method; the others still answer
                continue
    triples = list(combinations(range(len(p)), 3))
    if len(triples) > LIMITS.most_triples:
        order = np.random.default_rng(0).permutation(len(triples))[: LIMITS.most_triples]
        triples = [triples[i] for i in order]
    for triple in triples:
        rows = list(triple)
        try:
            answers.append(cv2.solveP3P(q[rows], x[rows][:, None], K, None, flags=cv2.SOLVEPNP_P3P)[1:3])
        except cv2.error:  # three points on one line
            continue
    cameras = []
    for turns, shifts in answers:
        for turn, shift in zip(turns, shifts, strict=True):
            R = cv2.Rodrigues(turn)[0]
            if np.isfinite(R).all() and np.isfinite(shift).all():
                cameras.append(lens.with_(R=R, T=np.asarray(shift).reshape(3) * scale - R @ centre))
    return cameras


def rivals(found: list[Place]) -> list[Place]:
    """The places that explain the points about as well as the first of them."""
    return [each for each in found[1:] if each.squares - found[0].squares < LIMITS.as_likely]


class Placed(NamedTuple):
    """The camera at its place.

    rivals   other places that the points do not distinguish from it
    keep     (n,) the points used
    suspect  a point that disagrees with the others where they are too few to leave it out; -1: none
    """

    fit: Fit
    rivals: list[Place]
    keep: Mask
    suspect: int = -1


def placed(
    lens: KnownLens, p: Array, b: Array, sd: Array | None, survey: Array | None, *, reject: bool = True
) -> Placed | None:
    """The camera with a known lens that sees points p (n, 3), n >= 4, at b (n, 2) px; None where there is none.

    A point that lies far off where all others agree is left out (of 6 or more), or suspected (of 5).
    Other arguments as for `places`.
    """
    keep = np.ones(len(p), bool)

    def among(rows: Mask) -> list[Place]:
        return places(lens.camera, p[rows], b[rows], _some(sd, rows), _some(survey, rows))

    found, suspect = among(keep), -1
    while reject and len(p) > 4:
        better = _without_one(found, keep, among, p, b, sd, survey)
        if better is None:
            break
        row, fits = better
        if len(p) < LIMITS.fewest_to_reject:
            suspect = row
            break
        if (~keep).sum() + 1 > LIMITS.most_rejected * len(p):
            break
        keep[row] = False
        found = fits
    if not found:
        return None
    best = _honest(found[0].fit, sd is not None or survey is not None)
    if lens.covariance is not None and lens.names:
        best = _with_prior(best, lens, p[keep], b[keep], _some(sd, keep), _some(survey, keep))
    return Placed(best, rivals(found), keep, suspect)


def _some(value: Array | None, rows: Mask) -> Array | None:
    return None if value is None else value[rows]


def _without_one(
    found: list[Place],
    keep: Mask,
    among: Callable[[Mask], list[Place]],
    p: Array,
    b: Array,
    sd: Array | None,
    survey: Array | None,
) -> tuple[int, list[Place]] | None:
    """The one point without which all others agree, and their places; None where no point stands out."""
    stated = LIMITS.noise_unknown
    if found and sd is not None:
        C = covariances(found[0].fit.camera, p[keep], sd[keep], _some(survey, keep))
        stated = float(np.sqrt(np.median((C[:, 0, 0] + C[:, 1, 1]) / 2)))
    whole = found[0].fit.sigma_px if found else np.inf
    if whole < LIMITS.worth * stated:
        return None
    best: tuple[float, int, list[Place]] | None = None
    order = np.flatnonzero(keep)
    if found and len(order) > LIMITS.most_tried:  # of many points the outlier is among those that lie farthest off
        off = np.linalg.norm(project(found[0].fit.camera, p[order]) - b[order], axis=-1)
        order = order[np.argsort(-np.nan_to_num(off, nan=np.inf))[: LIMITS.most_tried // 2]]
    for row in order.tolist():
        rest = keep.copy()
        rest[row] = False
        fits = among(rest)
        if not fits:
            continue
        noise = max(fits[0].fit.sigma_px, stated)
        off_px = float(np.linalg.norm(project(fits[0].fit.camera, p[row]) - b[row]))
        ratio = (off_px if np.isfinite(off_px) else np.inf) / noise
        if ratio > LIMITS.gross and LIMITS.worth * noise < whole and (best is None or ratio > best[0]):
            best = (ratio, row, fits)
    return None if best is None else (best[1], best[2])


def _honest(fit: Fit, stated: bool) -> Fit:
    """The fit, its covariance not smaller than the stated noise makes it: a few small residuals are chance."""
    k = len(fit.uncertainty.names)
    freedom = 2 * len(fit.residuals) - k
    if not stated or freedom >= LIMITS.few_residuals or not 0 < fit.misfit < 1:
        return fit
    covariance = fit.uncertainty.covariance / fit.misfit**2
    return fit._replace(uncertainty=fit.uncertainty._replace(covariance=covariance))


def _with_prior(fit: Fit, lens: KnownLens, p: Array, b: Array, sd: Array | None, survey: Array | None) -> Fit:
    """The camera refined with its lens, whose covariance is what is known of it beforehand."""
    pivot = fit.uncertainty.pivot
    unknowns = Unknowns([(*POSE, *lens.names)], pivot)
    noise = np.full(b.shape, max(fit.sigma_px, 1e-3)) if sd is None else sd * max(fit.misfit, 1.0)
    with np.errstate(divide="ignore"):
        information = 1 / np.broadcast_to(0.0 if survey is None else survey[:, None], p.shape) ** 2
    sights = Sights(0, b[:, None], noise[:, None])
    assert lens.covariance is not None
    known = KnownCameras([lens.camera.with_(R=fit.camera.R, T=fit.camera.T)], [lens.names], pivot, lens.covariance)
    problem = Problem(unknowns, [Family(3, p, information)], [sights, known])
    done = adjust(problem, State((fit.camera,), {}, (p,)))
    camera = done.state.cameras[0]
    residuals = b - project(camera, p)
    squares = float((residuals**2).sum())
    return fit._replace(
        camera=camera,
        uncertainty=Uncertainty(unknowns.free[0], pivot, done.covariance),
        residuals=residuals,
        rms_px=float(np.sqrt(squares / len(p))),
        converged=fit.converged and done.converged,
    )
