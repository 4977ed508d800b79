"""Wide lenses in the search for a rig: pictures that must be straightened before lines in them are lines.

An equidistant lens of focal length f sees a point at f times its angle from the axis, not at f times the tangent.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.outliers import majority
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form
from vidtrack.geometry.camera import Camera, project

WIDE_DEG = (120.0, 150.0, 95.0, 175.0)
"""Degrees that the picture of a wide lens may cover from side to side: those that are tried."""
STRAIGHT_RAD = 1.4
"""From the optical axis, beyond which a straightened picture has no room for a sight."""
FREE = free_parameters("tsai", ("Sx", "Cx", "Cy"))


def focal_trials(f: Sequence[tuple[float, ...]], nominal: Sequence[Camera]) -> list[list[tuple[float, ...]]]:
    """Focal lengths of all cameras that are tried together: all at once where light goes straight on.

    The picture of a wide lens must be straightened before lines in it are lines, and that needs its focal length: each
    of those that `WIDE_DEG` names, and the user's own, is a trial of its own.
    """
    if all(c.projection == "perspective" for c in nominal):
        return [list(f)]
    trials = []
    for degrees in WIDE_DEG:
        trials.append(
            [
                own if c.projection == "perspective" else (_nearest(own, _wide_f(c, degrees)),)
                for own, c in zip(f, nominal, strict=True)
            ]
        )
    return trials


def _wide_f(camera: Camera, degrees: float) -> float:
    """The focal length (unit of dx) of an equidistant lens whose picture is so many degrees wide."""
    return float(camera.image_size[0] * camera.dx / np.radians(degrees))


def _nearest(known: tuple[float, ...], f: float) -> float:
    """Of the focal lengths that the user gives (up to 3) the nearest; f where there are none."""
    return min(known, key=lambda g: abs(g - f)) if len(known) <= 3 else f


def straightened_px(b: Array, camera: Camera, f: float) -> Array:
    """px as of square pixels of the width dx, from the nominal centre; of a wide lens straightened, by its f."""
    flat = (b - (camera.Cx, camera.Cy)) * (1.0, camera.dy / camera.dx)
    if camera.projection == "perspective":
        return np.asarray(flat)
    g = f / camera.dx
    angle = np.linalg.norm(flat, axis=-1, keepdims=True) / g
    with np.errstate(invalid="ignore"):
        out = np.where(angle > STRAIGHT_RAD, np.nan, flat * np.where(angle > 1e-9, np.tan(angle) / angle, 1.0))
    return np.asarray(out)


def plain_camera(nominal: Camera, f: float, R: Array, T: Array) -> Camera:
    return nominal.with_(f=f * nominal.dx, R=R, T=T, Sx=1.0).without_lens()


def resected(p: Array, b: Array, nominal: Camera, rng: np.random.Generator) -> Camera | None:
    if len(p) < 12:
        return None
    some = np.linspace(0, len(p) - 1, min(len(p), 300)).astype(int)
    p, b = p[some], b[some]
    if nominal.projection == "perspective":
        return _straight(p, b, nominal, rng)
    found: tuple[float, Camera] | None = None
    for degrees in WIDE_DEG:
        f = _wide_f(nominal, degrees)
        flat = straightened_px(b, nominal, f)
        seen = np.isfinite(flat).all(-1)
        square = nominal.with_(projection="perspective", Cx=0.0, Cy=0.0, dy=nominal.dx)
        start = _straight(p[seen], flat[seen], square, rng) if seen.sum() >= 12 else None
        if start is None:
            continue
        camera = plain_camera(nominal, f / nominal.dx, start.R, start.T)
        off = float(np.median(np.nan_to_num(np.linalg.norm(project(camera, p) - b, axis=-1), nan=np.inf)))
        if np.isfinite(off) and (found is None or off < found[0]):
            found = off, camera
    if found is None:
        return None
    fit = refine(found[1], p, b, free=FREE, tolerance=1e-4, max_iterations=30)
    return fit.camera if np.isfinite(fit.cost) else found[1]


def _straight(p: Array, b: Array, nominal: Camera, rng: np.random.Generator) -> Camera | None:
    try:
        good = majority(p, b, rng=rng, samples=60)
        if good.sum() < 12:
            return None
        solution = closed_form(p[good], b[good], Cx=nominal.Cx, Cy=nominal.Cy, dx=nominal.dx, dy=nominal.dy, Sx=1.0)
        return camera_from_closed_form(solution, nominal.image_size).with_(name=nominal.name)
    except (ValueError, np.linalg.LinAlgError):
        return None
