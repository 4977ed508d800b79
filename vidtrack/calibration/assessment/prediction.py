"""Predict the accuracy of a rig before it is built: the covariances, without a single picture.

The measurements' noise is carried through the calibration to the cameras' parameters, with the survey's errors that
all cameras share, and from there with the target's own centroid noise to the place where it is located.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.normal_equations import covariance
from vidtrack.calibration.adjustment.unknowns import Names, columns
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.normal_equations import linearised, normal_equations
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.geometry.triangulate import locate_points

Mask = NDArray[np.bool_]


class Layout(NamedTuple):
    """A rig on paper: m cameras, n calibration points, q places where targets will be."""

    cameras: Sequence[Camera]
    p: Array  # (n, 3) world units, calibration points
    q: Array  # (q, 3) world units, the volume that matters
    sigma: float  # world units, the survey's standard deviation a coordinate
    calibration_sd: Array  # (m,) px, centroid noise of the calibration points
    target_sd: Array  # (m,) px, centroid noise of the moving targets
    free: Names  # the parameters that each camera's calibration frees
    refine: str = "full"  # full or bundle


class Case(NamedTuple):
    """One rig out of a sweep."""

    sweep: str  # what was varied; "" for the rig as planned
    value: Any  # to what
    layout: Layout
    diameter: float  # world units, of the moving targets
    uniform_survey: bool = False  # the survey's errors are spread evenly within +- sqrt(3) sigma


class Prediction(NamedTuple):
    """What `predicted` returns, world units."""

    covariance: Array  # (q, 3, 3) of a located target, calibration included; NaN where two cameras do not see it
    floor: Array  # (q, 3, 3) of a target located by perfectly known cameras
    parameters: tuple[Uncertainty, ...]  # how well each camera will be known
    joint: Array  # (K, K) of all cameras together
    n_points: NDArray[np.intp]  # (m,) calibration points in each picture
    n_cameras: NDArray[np.intp]  # (q,) cameras that see each place


def in_picture(cameras: Sequence[Camera], p: ArrayLike) -> Mask:
    """(m, n) whether each camera's picture shows each point (n, 3)."""
    return np.array([contains(camera, project(camera, p)) for camera in cameras])


def predicted(layout: Layout) -> Prediction:
    """The accuracy of a layout, to first order in all errors.

    Raises ValueError where the calibration points in the picture do not settle some camera.
    """
    seen = in_picture(layout.cameras, layout.p)
    for i, (sights, names) in enumerate(zip(seen, layout.free, strict=True)):
        if 2 * sights.sum() < len(names):
            raise ValueError(f"camera {i + 1} sees {sights.sum()} calibration points for {len(names)} parameters")
    pivot = layout.p[seen.any(0)].mean(0)
    joint = calibration_covariance(layout, seen, pivot)
    known = tuple(
        Uncertainty(tuple(names), pivot, joint[place, place])
        for names, (place, _) in zip(layout.free, columns(layout.free), strict=True)
    )
    visible = in_picture(layout.cameras, layout.q)
    b = np.array([project(camera, layout.q) for camera in layout.cameras])
    b = np.where(visible[..., None], b, np.nan)
    sd = np.asarray(layout.target_sd, float)
    floor = locate_points(layout.cameras, b, sd=sd)
    whole = locate_points(layout.cameras, b, sd=sd, uncertainties=known, joint=joint)
    return Prediction(whole.covariance, floor.covariance, known, joint, seen.sum(1), visible.sum(0))


def calibration_covariance(layout: Layout, seen: Mask, pivot: Array) -> Array:
    """The covariance (K, K) of all cameras' free parameters after calibration on the points that each sees (m, n).

    bundle: the inverse of the normal equations, the points eliminated.
    full: each camera weighs centroid noise and survey together, W = (sd^2 + sigma^2 B B^T)^-1, and its parameters err
    by N^-1 J^T W (noise + B s), where the survey's errors s of a point are the same for all cameras.
    """
    view = linearised(layout.cameras, layout.p, pivot)
    variance = np.broadcast_to(np.asarray(layout.calibration_sd, float)[:, None, None] ** 2, view.projected.shape)
    if layout.refine == "bundle" and layout.sigma > 0:
        weight = np.where(seen[..., None], 1 / variance, 0.0)
        information = np.full(layout.p.shape, layout.sigma**-2)
        nothing = np.zeros(layout.p.shape)
        normal = normal_equations(view, np.zeros(weight.shape), weight, layout.free, information, nothing)
        return covariance(normal, []).shared
    places = columns(layout.free)
    K = places[-1][0].stop
    joint, shared = np.zeros((K, K)), np.zeros((K, *layout.p.shape))
    for i, (place, names) in enumerate(places):
        own = seen[i]
        J, B = view.by_parameter[i, own][..., names], view.by_point[i, own]
        noise = variance[i, own][..., None] * np.eye(2)
        W = np.linalg.inv(noise + layout.sigma**2 * (B @ B.swapaxes(-1, -2)))
        JW = J.swapaxes(-1, -2) @ W
        scale = 1 / np.sqrt(np.einsum("nka,nak->k", JW, J))
        N = np.einsum("nka,nal->kl", JW, J) * np.outer(scale, scale)
        if not np.linalg.cond(N) < 1e14:
            raise ValueError(f"the calibration points leave some parameter of camera {i + 1} open")
        gain = np.linalg.inv(N) @ (scale[:, None, None] * np.moveaxis(JW, 0, 1)).reshape(len(names), -1)
        gain = (scale[:, None] * gain).reshape(len(names), -1, 2)
        joint[place, place] += np.einsum("kna,nab,lnb->kl", gain, noise, gain)
        shared[place, own] = layout.sigma * np.einsum("kna,nab->knb", gain, B)
    flat = shared.reshape(K, -1)
    return np.asarray(joint + flat @ flat.T)
