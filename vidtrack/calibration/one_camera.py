"""One camera from its points: which of them belong, and the camera that the chosen method gives from those."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.centre_search import best_centre
from vidtrack.calibration.gates import FLAT, flatness
from vidtrack.calibration.initial_fit import Nominal, distances, fit_camera, tsai_solution
from vidtrack.calibration.lens_selection import Ladder, climb
from vidtrack.calibration.outliers import ENOUGH, Mask, majority, trusted
from vidtrack.calibration.refine import Fit, Uncertainty, covariances, free_parameters, refine
from vidtrack.calibration.tsai import camera_from_closed_form
from vidtrack.geometry.camera import Camera

RICH_LENS_POINTS = 30
"""Points from which bad ones are sought with the richest lens, lest a plain one's misfit be taken for bad points."""


ENOUGH_TO_JUDGE = 200
"""Points that a camera is fitted to while bad ones are sought; all are then held against it."""

ENOUGH_TO_CHOOSE = 400
"""Points by which the lens model is chosen; the chosen one is then fitted to all."""


class NoCamera(ValueError):
    """The points give no camera; the message says what to do."""


class Points(NamedTuple):
    """What one camera sees of the surveyed points; all finite."""

    p: Array  # (n, 3) world units
    b: Array  # (n, 2) px
    sd: Array | None = None  # (n, 2) px, noise of b
    survey: Array | None = None  # (n,) world units, tolerance of p

    @property
    def n(self) -> int:
        """How many."""
        return len(self.p)

    def take(self, keep: Mask | NDArray[np.intp]) -> Points:
        """Some of the points."""
        return Points(*(None if value is None else value[keep] for value in tuple(self)))  # type: ignore[arg-type]

    def thinned(self, most: int) -> Points:
        """At most so many of them, always the same, drawn at random lest a stride falls in step with a grid."""
        if self.n <= most:
            return self
        return self.take(np.sort(np.random.default_rng(0).permutation(self.n)[:most]))

    @property
    def coplanar(self) -> bool:
        """Whether they lie in one plane."""
        return flatness(self.p) < FLAT


class Task(NamedTuple):
    """How a camera is to be calibrated; see `vidtrack.stages.calibrate`."""

    nominal: Nominal
    model: str
    refine: str
    fixed: dict[str, float]
    priors: dict[str, tuple[float, float]]

    @property
    def closed(self) -> bool:
        """Whether by closed form, without refinement."""
        return self.refine in ("linear", "centre")

    @property
    def held(self) -> dict[str, float]:
        """What the closed form holds."""
        return {name: self.fixed[name] for name in ("Sx", "kappa1") if name in self.fixed}


class Belonging(NamedTuple):
    """Which points belong to the camera."""

    keep: Mask  # (n,)
    scale: float  # px, the noise of one coordinate that the good points show; NaN where too few to tell
    camera: Camera | None  # the camera they were held against


class Answer(NamedTuple):
    """A calibrated camera and what is left over."""

    camera: Camera
    uncertainty: Uncertainty
    fit: Fit
    model: str
    ladder: Ladder | None  # where the lens model was chosen
    at_edge: bool  # the centre search ended at the edge of its reach

    @property
    def max_px(self) -> float:
        """The longest reprojection error."""
        return float(np.sqrt((self.fit.residuals**2).sum(1)).max())


def belonging(points: Points, task: Task, best: Mask) -> Belonging:
    """The points that belong: from the better part of them, grown to all that agree with a camera fitted to those.

    best   (n,) as from `better_part`
    With 30 points or more the richest lens has the last word, whichever lens was asked for. Of fewer than 12 points
    all are kept. Raises NoCamera when no camera fits.
    """
    if points.n < ENOUGH:
        return Belonging(np.ones(points.n, bool), np.nan, None)
    fixed = {}
    if points.coplanar:
        fixed = {"Cx": task.nominal.Cx, "Cy": task.nominal.Cy, **task.fixed}
    n_plain = len(free_parameters("tsai", tuple(fixed)))
    judge = _Judge(points, task.nominal, "tsai", fixed)
    keep, _, scale = trusted(best, judge.distances, n_parameters=n_plain)
    if keep.sum() >= RICH_LENS_POINTS and not fixed:
        judge = _Judge(points, task.nominal, "affine", fixed)
        keep, _, scale = trusted(keep, judge.distances, n_parameters=15)
    return Belonging(keep, scale, judge.camera)


def better_part(points: Points, *, seed: int = 0) -> Mask:
    """The points (n,) that agree best on a camera without a lens (`outliers.majority`); all of fewer than 12."""
    if points.n < ENOUGH:
        return np.ones(points.n, bool)
    return majority(points.p, points.b, rng=np.random.default_rng(seed))


class _Judge:
    """Holds all points against a camera fitted to some; each fit starts from the last."""

    def __init__(self, points: Points, nominal: Nominal, model: str, fixed: Mapping[str, float]) -> None:
        self.points, self.nominal, self.model, self.fixed = points, nominal, model, fixed
        self.coplanar = points.coplanar
        self.camera: Camera | None = None

    def distances(self, keep: Mask) -> Array:
        """Distances (n,) px of all points from the camera fitted to those kept."""
        p, b, sd, survey = self.points.take(keep).thinned(ENOUGH_TO_JUDGE)
        fit = fit_camera(
            p,
            b,
            self.nominal,
            model=self.model,
            fixed=self.fixed,
            sd=sd,
            survey=survey,
            near=self.camera,
            coplanar=self.coplanar,
            tolerance=1e-3,
        )
        if fit is None:
            raise NoCamera(_NOTHING_FITS)
        self.camera = fit.camera if fit.converged else None
        return distances(fit.camera, self.points.p, self.points.b)


def with_unexplained_noise(points: Points, found: Belonging) -> Points:
    """The points, their sd raised all alike until it explains the scatter that they show.

    A noise foretold far too small (a rigid picture, a survey whose tolerance nobody gave) would weigh the points by
    differences that drown in what it leaves out. Points without any sd stay as they are: they weigh alike already.
    """
    if points.sd is None or found.camera is None:
        return points
    C = covariances(found.camera, points.p, points.sd, points.survey)
    foretold = float(np.median((C[:, 0, 0] + C[:, 1, 1]) / 2))
    extra = max(found.scale**2 - foretold, 0.0)
    return points._replace(sd=np.sqrt(points.sd**2 + extra))


_NOTHING_FITS = (
    "no camera fits the points. Check that the tags go with the right balls and that points.csv is right-handed."
)


def calibrated(points: Points, task: Task) -> Answer:
    """The camera by the task's method. Raises NoCamera when there is none."""
    return _by_closed_form(points, task) if task.closed else _by_refinement(points, task)


def _by_closed_form(points: Points, task: Task) -> Answer:
    """The closed form, at the given centre or the best; its uncertainty is that of a fit with the same freedom."""
    p, b, sd, survey = points
    nominal, held, edge = task.nominal, task.held, False
    try:
        if task.refine == "centre":
            x, y, edge = best_centre(p, b, **nominal.optics, coplanar=points.coplanar, held=held)
            nominal = nominal._replace(Cx=x, Cy=y)
        solution = tsai_solution(p, b, nominal, held, coplanar=points.coplanar)
        camera = camera_from_closed_form(solution, nominal.image_size)
    except ValueError:
        raise NoCamera(
            f"the closed form makes no camera at Cx {nominal.Cx:g}, Cy {nominal.Cy:g}. "
            f"Set calibration.refine: full, or give Cx and Cy nearer to the optical axis."
        ) from None
    centre = () if task.refine == "centre" else ("Cx", "Cy")
    free = free_parameters("tsai", (*task.fixed, *centre))
    at = refine(camera, p, b, free=free, sd=sd, survey=survey, max_iterations=0)
    return Answer(camera, at.uncertainty, at._replace(converged=True, message=""), "tsai", None, edge)


def _by_refinement(points: Points, task: Task) -> Answer:
    model = "tsai" if task.model == "auto" else task.model
    few = points.thinned(ENOUGH_TO_JUDGE)
    start = _fit(few, task, model)
    if start is None or not np.isfinite(start.cost):
        raise NoCamera(_NOTHING_FITS)
    ladder = None
    if task.model == "auto":
        p, b, sd, survey = points.thinned(ENOUGH_TO_CHOOSE)
        ladder = climb(p, b, start.camera, fixed=task.fixed, priors=task.priors, sd=sd, survey=survey)
        model, start = ladder.model, ladder.fit  # coarse as yet
    done = points.n == few.n and ladder is None
    fit = start if done else _fit(points, task, model, start.camera)
    assert fit is not None
    return Answer(fit.camera, fit.uncertainty, fit, model, ladder, False)


def _fit(points: Points, task: Task, model: str, near: Camera | None = None) -> Fit | None:
    p, b, sd, survey = points
    free = free_parameters(model, tuple(task.fixed))
    return fit_camera(
        p,
        b,
        task.nominal,
        model=model,
        fixed=task.fixed,
        priors={name: prior for name, prior in task.priors.items() if name in free},
        sd=sd,
        survey=survey,
        near=near,
        coplanar=near is None and points.coplanar,
    )


def noise_with_rich_lens(points: Points, task: Task, near: Camera) -> float:
    """The noise, px, that the richest lens leaves, its parameters counted; NaN where the points are too few."""
    if points.n < RICH_LENS_POINTS:
        return float("nan")
    fit = _fit(points.thinned(ENOUGH_TO_JUDGE), task._replace(priors={}), "affine", near)
    return fit.sigma_px if fit else float("nan")
