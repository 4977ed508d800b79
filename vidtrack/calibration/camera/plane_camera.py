"""A camera that sees one plane of known points through interfaces: from pixels to the plane along bent light.

The camera is fitted to points of one plane. Its focal length, distance and the lens are then hardly separated from each
other; their uncertainty goes into that of the positions, where most of it cancels.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.initial_fit import Nominal, fit_camera, starts
from vidtrack.calibration.camera.refine import Fit, best_of
from vidtrack.geometry.camera import Camera, line_of_sight, project
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.pose import starting_poses


class PlaneCameraSettings(NamedTuple):
    """What is assumed where points of one plane do not show it."""

    f: tuple[float, float] = (1.5, 0.7)
    """Picture widths: focal length and its standard deviation, of any lens but fisheye and telescope."""
    bend: float = 0.05
    """Share by which a lens moves what lies at the side of the picture, one standard deviation."""
    folds: int = 8
    fewest: int = 6


SETTINGS = PlaneCameraSettings()


class PlaneCamera(NamedTuple):
    """The camera, the height of its plane, and what points left out say."""

    fit: Fit
    z: float
    held_out: float  # rms, world units, of points that are left out in turn

    def located(self, b: Array, sd: Array) -> tuple[Array, Array]:
        """Positions (n, 2) in the plane and their covariance (n, 2, 2), of px (n, 2) with sd (n, 2)."""
        camera, known = self.fit.camera, self.fit.uncertainty
        p = positions(camera, b, self.z)
        at = derivatives(camera, np.concatenate([p, np.full((len(p), 1), self.z)], -1), known.pivot)
        with np.errstate(invalid="ignore"):
            back = _inverse(at.by_point[..., :2])
            noise = back * sd[:, None, :]
            follows = -back @ at.by_parameter[..., columns(camera, known.names)]
            covariance = noise @ np.swapaxes(noise, -1, -2) + follows @ known.covariance @ np.swapaxes(follows, -1, -2)
        return p, covariance


def positions(camera: Camera, b: Array, z: float) -> Array:
    """Where the lines of sight of px (n, 2) meet the plane of height z: x, y (n, 2); NaN where they do not."""
    origin, d = line_of_sight(camera, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (z - np.broadcast_to(origin, d.shape)[..., 2]) / d[..., 2]
        p = origin + along[..., None] * d
    return np.asarray(np.where((along > 0)[..., None], p, np.nan)[..., :2])


def _inverse(A: Array) -> Array:
    det = A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
    turned = np.stack([np.stack([A[..., 1, 1], -A[..., 0, 1]], -1), np.stack([-A[..., 1, 0], A[..., 0, 0]], -1)], -2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(turned / det[..., None, None])


def plane_camera(
    p: Array,
    b: Array,
    through: Sequence[Interface],
    *,
    centre: Sequence[float],
    image_size: tuple[int, int],
    aspect: float = 1.0,
    sd: Array,
    sigma: Array,
) -> PlaneCamera | None:
    """The camera that sees points p (n, 3) of one z at b (n, 2) px; None where they do not give one.

    centre, image_size  px, of the lens and of the picture; aspect: width of a pixel over its height
    sd, sigma           (n, 2) px and (n,) world units: noise of the sights and of the survey
    """
    if len(p) < SETTINGS.fewest:
        return None
    nominal = Nominal(centre[0], centre[1], aspect, 1.0, image_size, tuple(through))
    whole = _fitted(p, b, nominal, sd, sigma, None)
    if whole is None:
        return None
    z = float(p[:, 2].mean())
    fold = np.arange(len(p)) % min(len(p), SETTINGS.folds)
    off = []
    for k in range(fold.max() + 1):
        seen = fold != k
        own = _fitted(p[seen], b[seen], nominal, sd[seen], sigma[seen], whole.camera)
        if own is None:
            return None
        off.append(positions(own.camera, b[~seen], z) - p[~seen, :2])
    return PlaneCamera(whole, z, float(np.sqrt((np.concatenate(off) ** 2).sum(-1).mean())))


def _fitted(p: Array, b: Array, nominal: Nominal, sd: Array, sigma: Array, near: Camera | None) -> Fit | None:
    width = nominal.image_size[0] * nominal.dx
    fixed = {"Cx": nominal.Cx, "Cy": nominal.Cy, "Sx": 1.0}
    priors = {
        "f": (SETTINGS.f[0] * width, SETTINGS.f[1] * width),
        "kappa1": (0.0, SETTINGS.bend / (width / 2) ** 2),
    }
    survey = sigma if sigma.any() else None
    fits = []
    for start in [near] if near is not None else _starts(p, b, nominal):
        fit = fit_camera(p, b, nominal, fixed=fixed, priors=priors, sd=sd, survey=survey, near=start, tolerance=1e-8)
        if fit is not None and np.isfinite(fit.cost) and np.isfinite(fit.uncertainty.covariance).all():
            fits.append(fit)
    return best_of(fits) if fits else None


def _starts(p: Array, b: Array, nominal: Nominal) -> list[Camera]:
    """Cameras that see the points about where they are, as if light went straight, with the interfaces put in."""
    square = b * [nominal.dx, 1.0]  # px as wide as they are high
    size = (round(nominal.image_size[0] * nominal.dx), nominal.image_size[1])
    found = [
        c.with_(dx=nominal.dx, dy=1.0, Cx=nominal.Cx, Cy=nominal.Cy, image_size=nominal.image_size)
        for c in starting_poses(p, square, size)
    ]
    with suppress(ValueError, np.linalg.LinAlgError):
        found += starts(p, b, nominal._replace(through=()), {"Sx": 1.0}, coplanar=True)
    bent = [camera.with_(through=nominal.through) for camera in found]
    return [camera for camera in bent if np.isfinite(project(camera, p)).all()]
