"""Calibration of all cameras and the surveyed points together.

Calibrated one by one, each camera takes the survey for exact and bends to its errors. Together they see
that a ball hangs beside its surveyed place, for all of them say so. The survey then counts as what it is, a
measurement of known tolerance, and weighs against the pixels (Brown 1958; Triggs et al. 2000):

    minimise  sum |b - project(camera, x)|^2 / sd^2  +  sum |p - x|^2 / sigma^2  +  priors

over every camera's free parameters and every point x, by `vidtrack.calibration.adjustment`, whose blocks are the
points. The pixel noise need not be known: it is found from what the sights leave over.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.adjustment.adjust import Problem, adjust, minimise
from vidtrack.calibration.adjustment.measurements import (
    CameraPriors,
    InterfacePriors,
    KnownCameras,
    Measurement,
    Sights,
)
from vidtrack.calibration.adjustment.tied_cameras import TiedCameras
from vidtrack.calibration.adjustment.unknowns import Family, Names, State, Unknowns
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.normal_equations import Priors
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface, free_of

Mask = NDArray[np.bool_]

LEAST_REDUNDANCY = 0.5
"""Survey measurements that the fit must leave over before they say how rough the survey is."""

LEAST_SD = 1e-3
"""px; ASSUME: no centroid is better, so that perfect simulated sights do not make the survey worthless."""


class Bundle(NamedTuple):
    """What `bundle` returns: m cameras, n points, K free parameters in all."""

    cameras: tuple[Camera, ...]
    points: Array  # (n, 3) world units, where the points are thought to be
    free: tuple[tuple[str, ...], ...]  # for each camera, the names of its free parameters, in the order of PARAMETERS,
    # and behind them those of its interfaces, which cameras share
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
        start = sum(len(names) for names in self.free[:i])
        place = slice(start, start + len(self.free[i]))
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
    lenses: KnownCameras | None = None,
    tied: Sequence[TiedCameras] = (),
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
    lenses    what is known beforehand of the cameras' lenses, with its covariance
    tied      what is known beforehand of lenses and of places to each other, of groups of the cameras
    Interfaces that are not known exactly are refined, one of a name for all cameras; they begin as they are known.
    Raises ValueError for shapes that do not match, fewer measurements than unknowns, or measurements that leave
    a parameter open. `converged` is False where the last step still gained.
    With sigma = inf nothing ties the world down but the other points.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    if p.shape != (len(p), 3) or b.shape != (len(cameras), len(p), 2) or len(free) != len(cameras):
        raise ValueError(f"p must be (n, 3), b (m, n, 2) and free m names, not {p.shape}, {b.shape}, {len(free)}")
    spread = np.broadcast_to(np.asarray(sd, float), b.shape)
    survey = _Survey(p, b, sigma)
    cameras = with_common_interfaces(cameras)
    problem = survey.problem(free, spread, priors or [{} for _ in cameras], scale_sd, cameras, lenses, tied)
    names, place = _with_interfaces(problem.unknowns, cameras)
    found = adjust(problem, State(tuple(cameras), {}, (p,)), max_steps=max_steps)
    factor = found.factors.get("px", 1.0)
    shift = found.state.blocks[0] - p
    survey_shift, survey_factor = survey.judged(shift, found.blocks[0])
    measured = survey.measured
    return Bundle(
        cameras=found.state.cameras,
        points=found.state.blocks[0],
        free=names,
        pivot=problem.unknowns.pivot,
        covariance=found.covariance[np.ix_(place, place)],
        point_covariance=found.blocks[0],
        residuals=np.stack(found.residuals[: len(cameras)]),
        sd=spread * factor,
        sigma_px=float(np.sqrt(np.mean((spread * factor)[measured] ** 2))) if measured.any() else np.nan,
        survey_factor=survey_factor,
        survey_shift=survey_shift,
        steps=found.steps,
        converged=found.converged,
    )


def cameras_only(
    cameras: Sequence[Camera],
    p: ArrayLike,
    b: ArrayLike,
    *,
    sigma: ArrayLike,
    free: Names,
    sd: ArrayLike,
    priors: Priors | None = None,
    tied: Sequence[TiedCameras] = (),
    tolerance: float = 1e-6,
) -> tuple[Camera, ...]:
    """The cameras of `bundle` with known noise sd, without any covariance: for refits that start near the answer.

    tolerance  share of the cost below which a step's gain ends the search; 1e-6 is a hundredth of a standard error
    Raises ValueError as `bundle` does.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    spread = np.broadcast_to(np.asarray(sd, float), b.shape)
    cameras = with_common_interfaces(cameras)
    known = priors or [{} for _ in cameras]
    problem = _Survey(p, b, sigma).problem(free, spread, known, False, cameras, tied=tied)
    return minimise(problem, State(tuple(cameras), {}, (p,)), tolerance=tolerance).cameras


def with_common_interfaces(cameras: Sequence[Camera]) -> tuple[Camera, ...]:
    """The cameras, all interfaces of one name alike: as they are known beforehand, moved by the cameras' mean."""
    found: dict[str, list[Interface]] = {}
    for camera in cameras:
        for interface in camera.through:
            found.setdefault(interface.name, []).append(interface)
    common = {}
    for name, each in found.items():
        known = each[0].known or each[0]
        mean = np.mean([interface.deviation(known) for interface in each], 0)
        common[name] = known.stepped(dict(zip(known.parameters, mean.tolist(), strict=True)))
    return tuple(
        camera.with_(through=tuple(common[own.name] for own in camera.through)) if camera.through else camera
        for camera in cameras
    )


def _with_interfaces(unknowns: Unknowns, cameras: Sequence[Camera]) -> tuple[tuple[tuple[str, ...], ...], Ints]:
    """Each camera's free parameters, those of its interfaces behind them, and where they stand among the unknowns."""
    names: list[tuple[str, ...]] = []
    place: list[Ints] = []
    for i, (own, camera) in enumerate(zip(unknowns.free, cameras, strict=True)):
        interfaces = free_of(camera.through)
        names.append((*own, *interfaces))
        place += [unknowns.of_camera(i)[0], unknowns.of_shared(*interfaces)]
    return tuple(names), np.concatenate(place)


class _Survey:
    """The points as surveyed, and which sights of them count."""

    def __init__(self, p: Array, b: Array, sigma: ArrayLike) -> None:
        self.p, self.b = p, b
        self.measured: Mask = np.asarray(np.isfinite(b).all(-1))
        with np.errstate(divide="ignore"):
            self.information = 1 / _tolerance(sigma, p.shape) ** 2
        # an unsurveyed point that fewer than two cameras see says nothing, and may as well stay
        idle = (self.information == 0).any(-1) & (self.measured.sum(0) < 2)
        self.measured &= ~idle
        self.information[idle] = np.inf

    def problem(
        self,
        free: Names,
        sd: Array,
        priors: Priors,
        scale_sd: bool,
        cameras: Sequence[Camera],
        lenses: KnownCameras | None = None,
        tied: Sequence[TiedCameras] = (),
    ) -> Problem:
        """What is minimised. Raises ValueError for a camera with fewer measurements than free parameters."""
        shared = tuple(dict.fromkeys(name for camera in cameras for name in free_of(camera.through)))
        free = [[name for name in names if name not in shared] for names in free]
        for i, names in enumerate(free):
            known = 2 * int(self.measured[i].sum()) + sum(name in names for name in priors[i])
            known += sum(len(set(each.names[i]) & set(names)) for each in (lenses, *tied) if each)
            if known < len(names):
                raise ValueError(f"camera {i}: {known} measurements for {len(names)} unknown parameters")
        pivot = self.p[self.measured.any(0)].mean(0) if self.measured.any() else np.zeros(3)
        b = np.where(self.measured[..., None], self.b, np.nan)
        sights = [Sights(i, own[:, None], own_sd[:, None]) for i, (own, own_sd) in enumerate(zip(b, sd, strict=True))]
        families = [Family(3, self.p, self.information)]
        beforehand: list[Measurement] = [CameraPriors(priors), *([lenses] if lenses else []), *tied]
        groups = {"px": LEAST_SD / float(sd.mean())} if scale_sd else {}
        if shared:
            beforehand.append(InterfacePriors())
        return Problem(Unknowns(free, pivot, shared), families, [*sights, *beforehand], groups)

    def judged(self, shift: Array, covariance: Array) -> tuple[Array, float]:
        """How far points moved (n, 3) in standard deviations of it, and how many times rougher than sigma they are."""
        surveyed = np.isfinite(self.information) & (self.information > 0)
        variance = np.einsum("naa->na", covariance)
        with np.errstate(divide="ignore", invalid="ignore"):
            redundancy = np.where(surveyed, 1 - variance * self.information, np.nan)
            normalised = shift * np.sqrt(self.information / redundancy)
        spare = float(np.nansum(redundancy))
        squares = float(np.sum(self.information[surveyed] * shift[surveyed] ** 2))
        factor = float(np.sqrt(squares / spare)) if spare > LEAST_REDUNDANCY else np.nan
        return np.where(redundancy > 1e-6, normalised, np.nan), factor


def _tolerance(sigma: ArrayLike, shape: tuple[int, ...]) -> Array:
    sigma = np.asarray(sigma, float)
    if not (sigma >= 0).all():
        raise ValueError("sigma must be 0 or more for every point")
    return np.broadcast_to(sigma[:, None] if sigma.ndim == 1 else sigma, shape).copy()
