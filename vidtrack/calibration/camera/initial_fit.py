"""The first fit of one camera: from the DLT, and from Tsai's closed form at the nominal centre and at the DLT's.

Alone, each of them leads the refinement into a worse minimum now and then: Tsai's where the optical axis lies far
from the nominal centre, the DLT where the lens bends strongly or the points are few.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.camera.dlt import camera_from_dlt, dlt
from vidtrack.calibration.camera.refine import Fit, best_of, free_parameters, refine
from vidtrack.calibration.camera.tsai import ClosedForm, camera_from_closed_form, closed_form
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.lens_terms import COEFFICIENTS, EQUIDISTANT, LENS_MODELS
from vidtrack.geometry.pose import F_STARTS, starting_poses
from vidtrack.geometry.projection import Projection
from vidtrack.geometry.refraction import apparent

COARSE = 1e-4
"""Relative fall of the cost, still to be had, at which a start has shown what it leads to."""


MOST_COARSE_STEPS = 60

ROUNDS = 4
"""Times that points are put where they appear to the last camera, before cameras behind interfaces are refined."""

FEW = 9
"""Points below which single points decide the closed forms, and perspective poses are starts as well."""


class Nominal(NamedTuple):
    """What is known of a camera before it is calibrated."""

    Cx: float  # px
    Cy: float
    dx: float  # mm, or px where no sensor is given
    dy: float
    image_size: tuple[int, int]  # px
    through: tuple[Interface, ...] = ()  # the interfaces through which it sees

    @property
    def optics(self) -> dict[str, float]:
        """Cx, Cy, dx and dy, as the closed form takes them."""
        return {"Cx": self.Cx, "Cy": self.Cy, "dx": self.dx, "dy": self.dy}

    @classmethod
    def of(
        cls,
        image_size: tuple[int, int],
        Cx: float | None = None,
        Cy: float | None = None,
        sensor: tuple[float, float] | None = None,
        through: tuple[Interface, ...] = (),
    ) -> Nominal:
        """From what the config says: the principal point is in the middle of the picture where it says nothing.

        sensor  mm, width and height; lengths on it are in px where it is not known
        """
        width, height = image_size
        dx, dy = (sensor[0] / width, sensor[1] / height) if sensor else (1.0, 1.0)
        x, y = (width - 1) / 2 if Cx is None else Cx, (height - 1) / 2 if Cy is None else Cy
        return cls(x, y, dx, dy, image_size, through)

    def unplaced(self, name: str) -> Camera:
        """The camera without a place, with a usual focal length of 1.5 widths of the picture; both are to be found."""
        f = 1.5 * self.image_size[0] * self.dx
        return Camera(
            self.Cx, self.Cy, self.dx, self.dy, 1.0, f, 0.0, np.eye(3), np.zeros(3), self.image_size, name=name
        )


def tsai_solution(
    p: Array, b: Array, nominal: Nominal, fixed: Mapping[str, float] | None = None, *, coplanar: bool = False
) -> ClosedForm:
    """Tsai's closed form at the nominal centre, Sx and kappa1 held where they are fixed."""
    fixed = fixed or {}
    held = {name: fixed[name] for name in ("Sx", "kappa1") if name in fixed}
    Cx, Cy = fixed.get("Cx", nominal.Cx), fixed.get("Cy", nominal.Cy)
    return closed_form(p, b, Cx=Cx, Cy=Cy, dx=nominal.dx, dy=nominal.dy, coplanar=coplanar, **held)


def starts(
    p: Array, b: Array, nominal: Nominal, fixed: Mapping[str, float] | None = None, *, coplanar: bool = False
) -> list[Camera]:
    """Cameras to refine from, those that can be had: empty where the axes are mirrored or the points too few."""
    if nominal.through:
        return _starts_through(p, b, nominal, fixed, coplanar)
    found: list[Camera] = []
    centres = [nominal]
    if not coplanar:
        try:
            direct = camera_from_dlt(dlt(p, b), dx=nominal.dx, dy=nominal.dy, image_size=nominal.image_size)
        except (ValueError, np.linalg.LinAlgError):
            pass
        else:
            found.append(direct)
            if contains(direct, (direct.Cx, direct.Cy), margin=-max(nominal.image_size)):
                centres.append(nominal._replace(Cx=direct.Cx, Cy=direct.Cy))
    for centre in centres:
        try:
            solution = tsai_solution(p, b, centre, fixed, coplanar=coplanar)
            found.append(camera_from_closed_form(solution, nominal.image_size))
        except (ValueError, np.linalg.LinAlgError):
            continue
    if len(p) < FEW:
        found += _poses(p, b, nominal, fixed)
    return [camera.with_(**fixed) for camera in found] if fixed else found


def _starts_through(
    p: Array, b: Array, nominal: Nominal, fixed: Mapping[str, float] | None, coplanar: bool
) -> list[Camera]:
    """Cameras behind interfaces, from where the points appear to a camera that is known ever better.

    Straight lines put the camera near its place; where points appear depends little on where exactly it is.
    """
    plain, seen = nominal._replace(through=()), p
    found: list[Camera] = []
    for _ in range(ROUNDS):
        fits = [camera.with_(through=nominal.through) for camera in starts(seen, b, plain, fixed, coplanar=coplanar)]
        fits = [camera for camera in fits if np.isfinite(project(camera, p)).all()]
        if not fits:
            break
        found = fits
        best = min(fits, key=lambda camera: float(np.median(distances(camera, p, b))))
        seen = apparent(best.through, best.position, p)
    return found


def appearing(camera: Camera, p: Array) -> Array:
    """Where points (n, 3) appear to a camera; those of a camera that looks through nothing, as they are."""
    return apparent(camera.through, camera.position, p) if camera.through else p


def _poses(p: Array, b: Array, nominal: Nominal, fixed: Mapping[str, float] | None) -> list[Camera]:
    """Cameras of a known or of several focal lengths that see few points where they were measured."""
    width = nominal.image_size[0]
    f_starts = [fixed["f"] / nominal.dy / width] if fixed and "f" in fixed else F_STARTS
    return [
        camera.with_(dx=nominal.dx, dy=nominal.dy, f=camera.f * nominal.dy, Sx=nominal.dx / nominal.dy)
        for camera in starting_poses(p, b, nominal.image_size, f_starts)
    ]


def fit_camera(
    p: Array,
    b: Array,
    nominal: Nominal,
    *,
    model: str = "tsai",
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    sd: ArrayLike | None = None,
    survey: ArrayLike | None = None,
    near: Camera | None = None,
    coplanar: bool = False,
    tolerance: float = 1e-12,
) -> Fit | None:
    """The best full refinement of a lens model over all starts; None where no start makes a camera.

    fixed   name: value of parameters that are held
    near    a camera already close to the answer: the only start then
    The starts are refined coarsely, and to the end only those whose errors differ: as a rule it is one.
    The richer lens models start from the plain one's answer. Other arguments as for `refine`.
    """
    fixed = dict(fixed or {})
    priors = dict(priors or {})
    plain = free_parameters("tsai", tuple(fixed))
    free = free_parameters(model, tuple(fixed))

    def run(camera: Camera, names: tuple[str, ...], to: float) -> Fit:
        known = {name: prior for name, prior in priors.items() if name in names}
        most = MOST_COARSE_STEPS if to > tolerance else 300
        return refine(camera, p, b, free=names, priors=known, sd=sd, survey=survey, tolerance=to, max_iterations=most)

    if near is not None:
        return run(with_lens_of(near, model).with_(**fixed), free, tolerance)
    fits = [run(camera, plain, COARSE) for camera in starts(p, b, nominal, fixed, coplanar=coplanar)]
    if not fits:
        return None
    if model == "tsai":
        return best_of([run(fit.camera, plain, tolerance) for fit in distinct(fits)])
    best = best_of(fits)
    richer = run(with_lens_of(best.camera, model).with_(**fixed), free, tolerance)
    return richer if richer.converged and richer.cost <= best.cost else best_of([richer, best])


def distinct(fits: list[Fit]) -> list[Fit]:
    """Fits of different cost, cheapest first, without those that cost ten times the least: they lead elsewhere."""
    ordered = sorted(fits, key=lambda fit: fit.cost)
    kept = ordered[:1]
    for fit in ordered[1:]:
        if kept[-1].cost * (1 + 30 * COARSE) < fit.cost < 10 * kept[0].cost:
            kept.append(fit)
    return kept


def with_lens_of(camera: Camera, model: str) -> Camera:
    """The camera with a model's projection, without the lens terms that the model does not have.

    Where the projection changes, kappa1 and kappa2 change so that the lens stays the same near its axis:
    tan(t) = t + t^3/3 + 2 t^5/15 + ...
    """
    projection: Projection = "equidistant" if model in EQUIDISTANT else "perspective"
    terms = LENS_MODELS[model]
    if camera.projection != projection:
        sign = 1.0 if projection == "perspective" else -1.0
        cubic = sign / (3 * camera.f**2)
        fifth = 2 / (15 * camera.f**4) if sign > 0 else 1 / (5 * camera.f**4)  # of tan and of arctan
        kappa1 = camera.kappa1 + cubic
        kappa2 = camera.kappa2 + fifth + 3 * cubic * camera.kappa1
        camera = camera.without_lens().with_(projection=projection, kappa1=kappa1, kappa2=kappa2)
    return camera.with_(**{term: 0.0 for term in COEFFICIENTS if term not in terms})


def distances(camera: Camera, p: Array, b: Array) -> Array:
    """How far each measured position (n, 2) lies from its projection, px; inf where the point does not project."""
    off = np.sqrt(((b - project(camera, p)) ** 2).sum(-1))
    return np.where(np.isfinite(off), off, np.inf)
