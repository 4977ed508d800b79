"""Whether one axis of the survey is stretched, or two are not at right angles, by all cameras together.

A survey that is stretched along x by a share e shows a camera the points (I + e x x') p. To first order a pinhole
camera takes that up by other pixels than it has (Hartley and Zisserman 2004, 8.5): rows r1, r2 of R along the picture,

    Sx changes by e ((r1 x)^2 - (r2 x)^2),    skew by 2 e (r1 x)(r2 x)

No camera has skew, square pixels have Sx = 1, and cameras that look from several sides would need different ones: so
each stretch and each shear is fitted beside all cameras' parameters, with the survey's errors common to all cameras.
A survey at another scale along all axes no picture can show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.unknowns import Names
from vidtrack.calibration.bundle import LEAST_SD
from vidtrack.calibration.normal_equations import Priors
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives, stepped


@dataclass(frozen=True)
class StretchSettings:
    """What is known of cameras beforehand."""

    skew: float = 1e-3
    """ASSUME: sd of the skew of a camera whose lens model frees it; pixels are at right angles."""

    Sx: float = 0.004
    """ASSUME: sd of Sx where dx and dy are stated alike: a digital camera has 1, frame grabbers lie within 1 %."""

    square: float = 1e-3
    """Share by which dx and dy may differ and are still stated as square."""

    spare: int = 10
    """Measurements beyond the unknowns, below which nothing is said."""


SETTINGS = StretchSettings()

STEPS = 20
"""Of the common refinement, at most: three are usual."""

AXES = "xyz"
KINDS = (*AXES, "xy", "xz", "yz")
"""Stretches along one axis, and shears of two."""


class Stretch(NamedTuple):
    """One way in which the survey may be deformed."""

    kind: str  # of KINDS
    share: float  # surveyed length over the true one, minus 1; of a shear: rad by which the angle is off
    sd: float
    gain: float  # chi squared that it takes away


def stretches(
    cameras: Sequence[Camera], p: Array, b: Array, free: Names, priors: Priors, *, sigma: Array, sd: float
) -> list[Stretch]:
    """Each deformation of KINDS fitted alone beside the cameras' parameters, to first order; the likeliest first.

    p      (n, 3) surveyed points, world units;  sigma (n,) their tolerance
    b      (m, n, 2) px, where cameras see them; NaN where not
    free   for each camera the parameters that its calibration freed; priors: what was known of them
    sd     px, of the centroids; NaN or 0: not known
    Residuals that are larger than sd and sigma explain widen every standard deviation. Empty where too little is seen,
    or where a camera sees through interfaces, which bend a survey as well.
    """
    if any(camera.through for camera in cameras):
        return []
    seen = 2 * int(np.isfinite(b).all(-1).sum())
    if not sd > 0:
        rows, X, e = _whitened(cameras, p, b, free, sigma, 1.0)
        spare = seen - rows.shape[1]
        sd = float(np.linalg.norm(_left(rows, e[:, None]))) / max(spare, 1) ** 0.5
        if spare < SETTINGS.spare or not sd > LEAST_SD:
            return []
    cameras = _settled(cameras, p, b, free, priors, sigma, sd)
    rows, X, e = _whitened(cameras, p, b, free, sigma, sd)
    beside, pull = _beforehand(cameras, free, priors)
    freedom = seen + len(pull) - rows.shape[1] - 1
    if freedom < SETTINGS.spare:
        return []
    X = np.concatenate([X, np.zeros((len(pull), len(KINDS)))])
    both = np.concatenate([np.concatenate([e, pull])[:, None], X], 1)
    left = _left(np.concatenate([rows, beside]), both)
    e, X = left[:, 0], left[:, 1:]
    S, g = (X * X).sum(0), X.T @ e
    found = []
    # errors of a survey without a tolerance are common to all cameras, and count in full for each
    common = 1.0 if (sigma > 0).any() else float(len(cameras))
    for kind, s, along in zip(KINDS, S, g, strict=True):
        if not s > 0:
            continue
        scale = max(float(e @ e - along**2 / s) / freedom, 1.0) * common
        found.append(Stretch(kind, float(along / s), float(np.sqrt(scale / s)), float(along**2 / s / scale)))
    return sorted(found, key=lambda each: -each.gain)


def _settled(
    cameras: Sequence[Camera], p: Array, b: Array, free: Names, priors: Priors, sigma: Array, sd: float
) -> list[Camera]:
    """The cameras refined all together, the survey's errors common to them.

    Each was fitted to the survey alone, whose errors bend it: from there a step to the common answer is so long that
    what it leaves to the second order is more than the noise, and looks like a deformation.
    """
    settled, moved, cost, reach = list(cameras), list(cameras), np.inf, 1.0
    step: Array = np.zeros(sum(len(names) for names in free))
    for _ in range(STEPS):
        rows, _, e = _whitened(moved, p, b, free, sigma, sd)
        beside, pull = _beforehand(moved, free, priors)
        J, r = np.concatenate([rows, beside]), np.concatenate([e, pull])
        if r @ r < cost:
            done = r @ r > (1 - 1e-6) * cost
            settled, cost, reach = moved, float(r @ r), 1.0
            if done:
                break
            size = np.linalg.norm(J, axis=0)
            size = np.where(size > 0, size, 1.0)
            step = np.linalg.lstsq(J / size, r, rcond=1e-12)[0] / size
        else:  # too far
            reach /= 2
        each = iter((reach * step).tolist())
        try:
            moved = [
                stepped(camera, p.mean(0), dict(zip(names, each, strict=False)))
                for camera, names in zip(settled, free, strict=True)
            ]
        except ValueError:  # f or Sx would turn negative
            break
    return settled


def _whitened(
    cameras: Sequence[Camera], p: Array, b: Array, free: Names, sigma: Array, sd: float
) -> tuple[Array, Array, Array]:
    """Derivatives by the cameras' parameters (2 m n, K), by the deformations (2 m n, 6), and residuals (2 m n,).

    All in units of noise and survey, whose errors of one point are common to the cameras that see it.
    """
    m, n = len(cameras), len(p)
    middle = p.mean(0)
    edges = np.concatenate([[0], np.cumsum([len(names) for names in free])])
    J, B, e = np.zeros((n, m, 2, edges[-1])), np.zeros((n, m, 2, 3)), np.zeros((n, m, 2))
    for i, (camera, names) in enumerate(zip(cameras, free, strict=True)):
        at = derivatives(camera, p, middle)
        seen = np.isfinite(b[i]).all(-1) & np.isfinite(at.projected).all(-1)
        J[seen, i, :, edges[i] : edges[i + 1]] = at.by_parameter[seen][..., columns(camera, names)]
        B[seen, i], e[seen, i] = at.by_point[seen], b[i, seen] - at.projected[seen]
    X = -np.einsum("nmra,nak->nmrk", B, _deformed(p - middle))
    flat = B.reshape(n, 2 * m, 3)
    C = sd**2 * np.eye(2 * m) + sigma[:, None, None] ** 2 * (flat @ flat.swapaxes(-1, -2))
    parts = [J.reshape(n, 2 * m, -1), X.reshape(n, 2 * m, -1), e.reshape(n, 2 * m, 1)]
    white = np.linalg.solve(np.linalg.cholesky(C), np.concatenate(parts, -1)).reshape(2 * m * n, -1)
    K = edges[-1]
    return white[:, :K], white[:, K:-1], white[:, -1]


def _left(J: Array, columns: Array) -> Array:
    """What the cameras' parameters, of derivatives J (q, K), leave of columns (q, k)."""
    size = np.linalg.norm(J, axis=0)
    J = J / np.where(size > 0, size, 1.0)
    return np.asarray(columns - J @ np.linalg.lstsq(J, columns, rcond=1e-12)[0])


def _deformed(p: Array) -> Array:
    """By how much points (n, 3) are moved by each deformation (n, 3, 6)."""
    moved = np.zeros((*p.shape, len(KINDS)))
    for k, kind in enumerate(KINDS):
        i, j = AXES.index(kind[0]), AXES.index(kind[-1])
        moved[:, i, k] += p[:, j] / 2
        moved[:, j, k] += p[:, i] / 2
    return moved


def _beforehand(cameras: Sequence[Camera], free: Names, priors: Priors) -> tuple[Array, Array]:
    """What is known of the cameras' parameters, as rows (q, K) and how far off it is (q,), over its sd."""
    rows, pull, start = [], [], 0
    K = sum(len(names) for names in free)
    for camera, names, own in zip(cameras, free, priors, strict=True):
        known = {"skew": (0.0, SETTINGS.skew)}
        if abs(camera.dx / camera.dy - 1) < SETTINGS.square:
            known["Sx"] = 1.0, SETTINGS.Sx
        for name, (mean, sd) in {**known, **own}.items():
            if name in names:
                row = np.zeros(K)
                row[start + list(names).index(name)] = 1 / sd
                rows.append(row)
                pull.append((mean - getattr(camera, name)) / sd)
        start += len(names)
    return np.array(rows).reshape(-1, K), np.array(pull)
