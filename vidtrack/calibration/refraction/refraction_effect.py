"""How much a calibration's interfaces matter: the same points calibrated and located as if light went straight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.unknowns import Names
from vidtrack.calibration.camera.initial_fit import Nominal, fit_camera
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import LENS_MODELS
from vidtrack.geometry.triangulate import locate_points

MOST_POINTS = 500
"""Points that the straight cameras are fitted to."""


class Effect(NamedTuple):
    """What interfaces do to n located points; world units and px."""

    interfaces: tuple[str, ...]
    shift_rms: float  # between the points located with and without them
    shift_max: float
    mean_3d: float  # from the survey, with them
    mean_3d_without: float
    rms_px: float  # reprojection error, with them
    rms_px_without: float


def refraction_effect(cameras: Sequence[Camera], p: Array, b: Array, free: Names) -> Effect | None:
    """Calibrate m cameras on points p (n, 3) seen at b (m, n, 2) px (NaN: not used) without their interfaces.

    None where no camera looks through any, fewer than two cameras see, or straight cameras cannot be had.
    """
    through = tuple(dict.fromkeys(interface.name for camera in cameras for interface in camera.through))
    if not through or len(cameras) < 2:
        return None
    straight = [_straight(camera, p, own, names) for camera, own, names in zip(cameras, b, free, strict=True)]
    plain = [camera for camera in straight if camera is not None]
    if len(plain) < len(cameras):
        return None
    bent, without = locate_points(cameras, b), locate_points(plain, b)
    shift = np.linalg.norm(bent.point - without.point, axis=-1)
    if not np.isfinite(shift).any():
        return None
    return Effect(
        through,
        float(np.sqrt(np.nanmean(shift**2))),
        float(np.nanmax(shift)),
        float(np.nanmean(np.linalg.norm(bent.point - p, axis=-1))),
        float(np.nanmean(np.linalg.norm(without.point - p, axis=-1))),
        _rms(bent.error),
        _rms(without.error),
    )


def _straight(camera: Camera, p: Array, b: Array, names: Sequence[str]) -> Camera | None:
    """The camera calibrated with the same lens model and no interface."""
    if not camera.through:
        return camera
    seen = np.flatnonzero(np.isfinite(b).all(-1))
    seen = np.sort(np.random.default_rng(0).permutation(seen)[:MOST_POINTS])
    own = {name for name in names if "." not in name}
    model = next((each for each in LENS_MODELS if own <= set(free_parameters(each))), "tsai")
    nominal = Nominal(camera.Cx, camera.Cy, camera.dx, camera.dy, camera.image_size)
    held = {name: getattr(camera, name) for name in free_parameters(model) if name not in own and name[:2] not in _POSE}
    try:
        fit = fit_camera(p[seen], b[seen], nominal, model=model, fixed=held, tolerance=1e-6)
    except (ValueError, np.linalg.LinAlgError):
        return None
    return fit.camera if fit and np.isfinite(fit.cost) else None


_POSE = ("om", "t_")


def _rms(error: ArrayLike) -> float:
    return float(np.sqrt(np.nanmean(np.sum(np.asarray(error) ** 2, -1))))


def effect_finding(effect: Effect, units: str) -> Finding:
    """What the report says of it."""
    names = " and ".join(effect.interfaces)
    text = (
        f"calibration: refraction at {names} matters by {effect.shift_rms:.3g} {units} (rms; at most "
        f"{effect.shift_max:.3g}): so far off the located points would lie if light went straight. Their mean error is "
        f"{effect.mean_3d:.3g} {units} with the interfaces and {effect.mean_3d_without:.3g} {units} without"
    )
    if effect.mean_3d_without < effect.mean_3d:
        cure = f"The points fit better without {names}: compare their description under interfaces with the tank."
        return Finding("doubtful", "interface-wrong", text, cure)
    return Finding("note", "refraction-matters", text, "")
