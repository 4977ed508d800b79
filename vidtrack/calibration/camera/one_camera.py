"""One camera from its points: which of them are inliers, and the camera that the chosen method gives from those."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.centre_search import best_centre
from vidtrack.calibration.camera.gates import FLAT, flatness
from vidtrack.calibration.camera.initial_fit import ROUNDS, Nominal, appearing, distances, fit_camera, tsai_solution
from vidtrack.calibration.camera.known_lens import KnownLens, Place, placed
from vidtrack.calibration.camera.lens_selection import Ladder, climb, points_needed
from vidtrack.calibration.camera.outliers import ENOUGH, SMALLEST_SCALE, Mask, majority, studentised, trusted
from vidtrack.calibration.camera.refine import Fit, Uncertainty, best_of, covariances, free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.lens_terms import LENS_MODELS

RICH_LENS_POINTS = 30
"""Points from which the richest lens is worth a comparison, and outliers are sought with nothing held."""


ENOUGH_TO_JUDGE = 200
"""Points that a camera is fitted to while bad ones are sought; all are then compared with it."""

ENOUGH_TO_CHOOSE = 2000
"""Points by which the lens model is chosen; the chosen one is then fitted to all."""


class NoCamera(ValueError):
    """The points give no camera; the message says what to do."""


class Points(NamedTuple):
    """What one camera sees of the surveyed points; all finite."""

    p: Array  # (n, 3) world units
    b: Array  # (n, 2) px
    sd: Array | None = None  # (n, 2) px, noise of b
    survey: Array | None = None  # (n,) world units, tolerance of p
    clips: NDArray[np.str_] | None = None  # (n,) which clip shows each

    @property
    def n(self) -> int:
        """How many."""
        return len(self.p)

    def take(self, keep: Mask | NDArray[np.intp]) -> Points:
        """Some of the points."""
        return Points(*(None if value is None else value[keep] for value in tuple(self)))  # type: ignore[arg-type]

    def thinned(self, most: int) -> Points:
        """At most so many of them, always the same, drawn at random, because a stride may fall in step with a grid."""
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
    reject: bool = True  # whether outliers are sought
    lens: KnownLens | None = None

    @property
    def closed(self) -> bool:
        """Whether by closed form, without refinement."""
        return self.refine in ("linear", "centre")

    @property
    def held(self) -> dict[str, float]:
        """What the closed form holds."""
        return {name: self.fixed[name] for name in ("Sx", "kappa1") if name in self.fixed}


class Inliers(NamedTuple):
    """Which points agree with one camera."""

    keep: Mask  # (n,)
    scale: float  # px, the noise of one coordinate that the inliers show; NaN where they are too few
    camera: Camera | None  # the camera that they agree with
    model: str  # its lens model
    plain_keep: Mask  # (n,) the inliers by the plainest lens model alone
    description_length: float = np.inf
    """Minus the log likelihood: inliers normal about the camera, outliers anywhere in the picture, and half the log of
    the number of measurements for each parameter (Schwarz 1978)."""


class Answer(NamedTuple):
    """A calibrated camera and what is left over."""

    camera: Camera
    uncertainty: Uncertainty
    fit: Fit
    model: str
    ladder: Ladder | None  # where the lens model was chosen
    at_edge: bool  # the centre search ended at the edge of its reach
    rivals: Sequence[Place] = ()  # of a camera with a known lens: other places that explain the points as well
    suspect: int = -1  # a point that disagrees, where they are too few to leave it out

    @property
    def max_px(self) -> float:
        """The longest reprojection error."""
        return float(np.sqrt((self.fit.residuals**2).sum(1)).max())


def inliers(points: Points, task: Task, start: Mask) -> Inliers:
    """The points that agree with one camera, grown from those of `start` (n,), as from `better_part`.

    Before a point is called an outlier, richer lens models and another start are tried: a plain lens that misfits the
    rim, fitted to the middle, would leave out every good point of the rim. Of several explanations the likeliest
    counts (`description_length`). Of fewer than 12 points, or with calibration.reject: off, all are kept.
    Raises NoCamera when no camera fits.
    """
    everything = np.ones(points.n, bool)
    if task.lens is not None:
        return _inliers_with_lens(points, task.lens, task.reject)
    if points.n < ENOUGH or not task.reject:
        return Inliers(everything, np.nan, None, "", everything)
    fixed = dict(task.fixed) if points.n < RICH_LENS_POINTS else {}
    if points.coplanar:
        fixed = {"Cx": task.nominal.Cx, "Cy": task.nominal.Cy, **task.fixed}
    models = ["tsai"]
    if not fixed:
        models = [model for model in LENS_MODELS if points.n >= 2 * points_needed(model) or model == "tsai"]
    plain = grown(points, task.nominal, "tsai", fixed, start)
    if plain is None:
        raise NoCamera(_NOTHING_FITS)
    found = grown(points, task.nominal, models[-1], fixed, plain.keep) if models[1:] else plain
    if found is not None and found.keep.all():
        return found._replace(plain_keep=plain.keep)
    others = [
        grown(points, task.nominal, model, fixed, begin)
        for model in models
        for begin in ((start, everything) if model != "tsai" else (everything,))
    ]
    candidates = [each for each in (plain, found, *others) if each is not None and each.keep.sum() > points.n / 2]
    best = min(candidates or [plain], key=lambda each: each.description_length)
    return best._replace(plain_keep=plain.keep)


def _inliers_with_lens(points: Points, lens: KnownLens, reject: bool) -> Inliers:
    found = placed(lens, points.p, points.b, points.sd, points.survey, reject=reject)
    if found is None:
        raise NoCamera(_NOWHERE)
    many = points.n >= ENOUGH
    scale = found.fit.sigma_px if many else np.nan
    return Inliers(found.keep, scale, found.fit.camera if many else None, lens.model, found.keep)


def better_part(points: Points, *, seed: int = 0) -> Mask:
    """The points (n,) that agree best on a camera without a lens (`outliers.majority`); all of fewer than 12."""
    if points.n < ENOUGH:
        return np.ones(points.n, bool)
    return majority(points.p, points.b, rng=np.random.default_rng(seed))


def grown(points: Points, nominal: Nominal, model: str, fixed: dict[str, float], start: Mask) -> Inliers | None:
    """The inliers of one lens model, grown from those of `start` (n,); None where no camera fits."""
    judge = Judge(points, nominal, model, fixed)
    try:
        keep, _, scale = trusted(start, judge.distances, n_parameters=len(judge.free))
        off = distances(judge.camera, points.p, points.b) if judge.camera else judge.distances(keep)
    except NoCamera:
        return None
    k = len(judge.free)
    if 2 * keep.sum() <= k:
        return None
    width, height = nominal.image_size
    variance = max((off[keep] ** 2).sum() / (2 * keep.sum() - k), SMALLEST_SCALE**2)
    length = keep.sum() * (1 + np.log(2 * np.pi * variance)) + (~keep).sum() * np.log(width * height)
    length += 0.5 * k * np.log(2 * points.n)
    return Inliers(keep, scale, judge.camera, model, keep, float(length))


class Judge:
    """Measures all points against a camera fitted to some; each fit starts from the last, the first from `near`."""

    def __init__(
        self,
        points: Points,
        nominal: Nominal,
        model: str,
        fixed: Mapping[str, float],
        near: Camera | None = None,
    ) -> None:
        self.points, self.nominal, self.model, self.fixed = points, nominal, model, fixed
        self.coplanar = points.coplanar
        self.free = free_parameters(model, tuple(fixed))
        self.camera = near

    def distances(self, keep: Mask) -> Array:
        """Studentised distances (n,) px of all points from the camera fitted to those kept."""
        chosen = np.flatnonzero(keep)
        if chosen.size > ENOUGH_TO_JUDGE:
            chosen = chosen[np.sort(np.random.default_rng(0).permutation(chosen.size)[:ENOUGH_TO_JUDGE])]
        fitted = np.zeros(keep.size, bool)
        fitted[chosen] = True
        few = self.points.take(chosen)
        fit = fit_camera(
            few.p,
            few.b,
            self.nominal,
            model=self.model,
            fixed=self.fixed,
            sd=few.sd,
            survey=few.survey,
            near=self.camera,
            coplanar=self.coplanar,
            tolerance=1e-3,
        )
        if fit is None:
            raise NoCamera(_NOTHING_FITS)
        self.camera = fit.camera if fit.converged else None
        at = derivatives(fit.camera, self.points.p, fit.uncertainty.pivot)
        J = at.by_parameter[..., columns(fit.camera, self.free)]
        return studentised(self.points.b - at.projected, J, fitted)


def with_unexplained_noise(points: Points, found: Inliers) -> Points:
    """The points, their sd raised all alike until it explains the scatter that they show.

    A noise stated far too small (a rigid picture, a survey whose tolerance is not given) would weigh the points by
    differences that drown in what it leaves out. Points without any sd stay as they are: they weigh alike already.
    """
    if points.sd is None or found.camera is None:
        return points
    C = covariances(found.camera, points.p, points.sd, points.survey)
    stated = float(np.median((C[:, 0, 0] + C[:, 1, 1]) / 2))
    extra = max(found.scale**2 - stated, 0.0)
    return points._replace(sd=np.sqrt(points.sd**2 + extra))


_NOTHING_FITS = (
    "no camera fits the points. Check that the tags go with the right balls and that points.csv is right-handed."
)


_NOWHERE = (
    "a camera with this lens sees the points from nowhere. Check that the tags go with the right points, that "
    "points.csv is right-handed, and that the lens is this camera's."
)


def calibrated(points: Points, task: Task) -> Answer:
    """The camera by the task's method. Raises NoCamera when there is none."""
    if task.lens is not None:
        return _with_known_lens(points, task.lens, task.reject)
    answer = _by_closed_form(points, task) if task.closed else _by_refinement(points, task)
    if not np.isfinite(answer.fit.rms_px):
        lost = int((~np.isfinite(answer.fit.residuals).all(-1)).sum())
        cure = "Set calibration.refine: full" if task.closed else "Add points"
        raise NoCamera(
            f"{lost} of {points.n} points lie behind the camera that was found, or beyond the fold of its lens. "
            f"{cure}, or check what calibration.fix holds."
        )
    return answer


def _with_known_lens(points: Points, lens: KnownLens, reject: bool) -> Answer:
    found = placed(lens, points.p, points.b, points.sd, points.survey, reject=reject)
    if found is None:
        raise NoCamera(_NOWHERE)
    return Answer(
        found.fit.camera, found.fit.uncertainty, found.fit, lens.model, None, False, found.rivals, found.suspect
    )


def _by_closed_form(points: Points, task: Task) -> Answer:
    """The closed form, at the given centre or the best; its uncertainty is that of a fit with the same freedom."""
    p, b = points.p, points.b
    nominal, held, edge, seen = task.nominal, task.held, False, points.p
    try:
        for _ in range(ROUNDS if nominal.through else 1):
            if task.refine == "centre":
                x, y, edge = best_centre(seen, b, **task.nominal.optics, coplanar=points.coplanar, held=held)
                nominal = nominal._replace(Cx=x, Cy=y)
            solution = tsai_solution(seen, b, nominal, held, coplanar=points.coplanar)
            camera = camera_from_closed_form(solution, nominal.image_size).with_(through=nominal.through)
            seen = appearing(camera, p)
    except ValueError:
        raise NoCamera(
            f"the closed form makes no camera at Cx {nominal.Cx:g}, Cy {nominal.Cy:g}. "
            f"Set calibration.refine: full, or give Cx and Cy nearer to the optical axis."
        ) from None
    centre = () if task.refine == "centre" else ("Cx", "Cy")
    free = free_parameters("tsai", (*task.fixed, *centre))
    at = refine(camera, p, b, free=free, sd=points.sd, survey=points.survey, max_iterations=0)
    return Answer(camera, at.uncertainty, at._replace(converged=True, message=""), "tsai", None, edge)


def _by_refinement(points: Points, task: Task) -> Answer:
    model = "tsai" if task.model == "auto" else task.model
    few = points.thinned(ENOUGH_TO_JUDGE)
    start = fit_points(few, task, model)
    if start is None or not np.isfinite(start.cost):
        raise NoCamera(_NOTHING_FITS)
    ladder = None
    if task.model == "auto":
        some = points.thinned(ENOUGH_TO_CHOOSE)
        ladder = climb(
            some.p,
            some.b,
            start.camera,
            fixed=task.fixed,
            priors=task.priors,
            sd=some.sd,
            survey=some.survey,
            clips=some.clips,
        )
        model, start = ladder.model, ladder.fit  # coarse as yet
    done = points.n == few.n and ladder is None
    fit = start if done else fit_points(points, task, model, start.camera)
    assert fit is not None
    if ladder is not None and model != "tsai":  # rung after rung may lead to a worse minimum than one step
        other = fit_points(points, task, model, ladder.rungs[0].fit.camera)
        fit = best_of([fit, other]) if other else fit
    return Answer(fit.camera, fit.uncertainty, fit, model, ladder, False)


def fit_points(points: Points, task: Task, model: str, near: Camera | None = None) -> Fit | None:
    """The best fit of a lens model to the points by the task's settings, from all starts or from near."""
    free = free_parameters(model, tuple(task.fixed))
    return fit_camera(
        points.p,
        points.b,
        task.nominal,
        model=model,
        fixed=task.fixed,
        priors={name: prior for name, prior in task.priors.items() if name in free},
        sd=points.sd,
        survey=points.survey,
        near=near,
        coplanar=near is None and points.coplanar,
    )
