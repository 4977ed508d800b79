"""Residuals of located points as a linear system: what an error of a camera's pixels leaves in them.

A point p located from the pixels of several cameras leaves, in units of the centroids' standard deviation,

    e = H (noise + D k),     H = 1 - P (P' P)^-1 P'

P = d(px)/dp, D = d(px)/d(parameters), k the calibration's error, of covariance C.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.triangulate import Located


class SightSystem(NamedTuple):
    """n samples of c cameras; pixels in units of their standard deviation, 0 where a camera is not used."""

    e: Array  # (n, 2 c)
    H: Array  # (n, 2 c, 2 c)
    G: Array  # (n, 3, 2 c) dp / d(px)
    sd: Array  # (n, 2 c) px
    sigma2: Array  # (n,) squared sigma of the point, world units


def sight_system(
    cameras: Sequence[Camera],
    p: Array,
    located: Located,
    target: NDArray[np.intp],
    moment: NDArray[np.intp],
    on: NDArray[np.bool_],
    sd: Array,
) -> SightSystem:
    weight = np.where(on[..., None], 1 / np.nan_to_num(sd[:, target, moment], nan=1.0), 0.0)
    P = np.stack([derivatives(camera, p, camera.position, ()).by_point for camera in cameras])
    P = _rows(np.nan_to_num(P) * weight[..., None])
    e = _rows(np.nan_to_num(located.error[:, target, moment]) * weight)
    G = np.asarray(np.linalg.pinv(P), float)
    H = np.eye(P.shape[1]) - P @ G
    counts = _rows(np.sign(weight))
    H = H * counts[:, None] * counts[:, :, None]
    px = _ratio(np.ones_like(weight), weight)
    sigma2 = (located.sigma[target, moment] ** 2).sum(-1)
    return SightSystem(np.einsum("nij,nj->ni", H, e), H, G, _rows(px), sigma2)


def _ratio(a: Array, b: Array) -> Array:
    """a over b; 0 where b is 0."""
    return np.asarray(np.where(b > 0, a / np.where(b > 0, b, 1.0), 0.0))


def one_over(a: Array) -> Array:
    """1 / a; 0 where a is 0."""
    return _ratio(np.ones_like(a), a)


def _rows(by_camera: Array) -> Array:
    """(c, n, 2, ...) as (n, 2 c, ...)."""
    moved = np.moveaxis(by_camera, 0, 1)
    return np.asarray(moved.reshape(moved.shape[0], -1, *moved.shape[3:]))


def by_camera_px(squares: Array, sd: Array) -> Array:
    """Root mean square over the samples that each camera has part in, px.

    squares (n, 2 c) in units of sd (n, 2 c) px; weighted by 1 / sd^2: what single samples of a large sd may miss says
    nothing of the others.
    """
    by = (len(squares), -1, 2)
    weight = _ratio(np.ones_like(sd), sd**2).reshape(by).sum((0, 2))
    return np.asarray(np.sqrt(_ratio(squares.reshape(by).sum((0, 2)), weight)))


def over_sigma(system: SightSystem, moved2: Array) -> float:
    """Rms over the samples of errors in space, of squares moved2 (n,), each over its own sigma."""
    return float(np.sqrt(_ratio(moved2, system.sigma2).mean()))


def left_by(system: SightSystem, camera: int, columns: Array) -> Array:
    """What px (n, 2, k) of one camera leave in the residuals (n, 2 c, k)."""
    rows = slice(2 * camera, 2 * camera + 2)
    sd = system.sd[:, rows, None]
    return system.H[:, :, rows] @ _ratio(columns, sd)


def whitened(system: SightSystem, camera: int, px: Array) -> Array:
    """Px (n, 2, k) of one camera as rows (n, 2 c, k) in units of its standard deviation."""
    out = np.zeros((*system.e.shape, px.shape[-1]))
    rows = slice(2 * camera, 2 * camera + 2)
    out[:, rows] = _ratio(px, system.sd[:, rows, None])
    return out


def calibration_of(
    cameras: Sequence[Camera],
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    p: Array,
    system: SightSystem,
) -> tuple[Array, Array]:
    """How residuals follow the parameters (n, 2 c, k), and the parameters' covariance (k, k)."""
    parts, blocks = [np.zeros((*system.e.shape, 0))], [np.zeros((0, 0))]
    for i, (camera, known) in enumerate(zip(cameras, uncertainties, strict=True)):
        if known is not None:
            which = columns(camera, known.names)
            moved = np.nan_to_num(derivatives(camera, p, known.pivot).by_parameter[..., which])
            parts.append(left_by(system, i, moved))
            blocks.append(np.asarray(known.covariance, float))
    A = np.concatenate(parts, -1)
    if joint is not None:
        return A, np.nan_to_num(joint)
    C, edge = np.zeros((A.shape[-1],) * 2), 0
    for block in blocks:
        C[edge : edge + len(block), edge : edge + len(block)] = np.nan_to_num(block)
        edge += len(block)
    return A, C


def root_of(C: Array) -> Array:
    """L with L L' = C, also where C is singular."""
    values, vectors = np.linalg.eigh(C / np.sqrt(_scales(C)) / np.sqrt(_scales(C))[:, None])
    root: Array = np.sqrt(_scales(C))[:, None] * vectors * np.sqrt(np.maximum(values, 0))
    return root


def _scales(C: Array) -> Array:
    return np.maximum(np.diag(C), 1e-300)
