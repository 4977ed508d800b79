"""Where the world's axes lie, for cameras that know only each other.

Surveyed points, or directions that the user names: an upright (a plumb line), a level surface, a ball that falls, an
L-frame. A rig in its own axes is moved as a whole: the cameras' errors about their own axes stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera


class Motion(NamedTuple):
    """world = scale R p + t, from the rig's own axes."""

    R: Array  # (3, 3)
    t: Array  # (3,)
    scale: float
    scale_sd: float
    rms: float  # world units, by which the points miss


def fitted(p: Array, q: Array, *, with_scale: bool = False) -> Motion:
    """The rigid motion, or the similarity, that brings p (n, 3) nearest to q (n, 3) (Umeyama 1991).

    scale and its standard deviation are found in either case; the motion uses the scale only where asked.
    Raises ValueError for fewer than three points or points on one line.
    """
    if len(p) < 3:
        raise ValueError(f"{len(p)} points are seen by two cameras; axes need 3 that are not on one line")
    a, b = p - p.mean(0), q - q.mean(0)
    U, s, Vt = np.linalg.svd(b.T @ a)
    spread = np.linalg.svd(b, compute_uv=False)
    if spread[1] < 0.02 * spread[0]:
        raise ValueError("the points lie on one line: axes need 3 that do not")
    D = np.array([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    R = (U * D) @ Vt
    scale = float((s * D).sum() / (a**2).sum())
    left = b - scale * a @ R.T
    sd = float(np.sqrt((left**2).sum() / max(3 * len(p) - 7, 1) / (a**2).sum()))
    used = scale if with_scale else 1.0
    return Motion(R, q.mean(0) - used * R @ p.mean(0), scale, sd, float(np.sqrt((left**2).sum(-1).mean())))


def from_directions(
    origin: Array, *, up: Array | None = None, x: Array | None = None, y: Array | None = None, heading: Array
) -> Motion:
    """The motion to axes of which directions (3,) in the rig's own axes are known.

    up       of z; it is kept exactly, x (or y) as nearly as it can be. Without it x is kept and y as nearly
    heading  along which x points as nearly as possible where neither x nor y is known
    Raises ValueError where the directions leave the axes open: one of them alone but up, or both along one line.
    """
    if up is None:
        if x is None or y is None:
            raise ValueError("name up, level or drop, or both x and y")
        ex = _unit(x)
        ez = _unit(np.cross(ex, y))
    else:
        ez = _unit(up)
        if x is None:
            x = heading if y is None else np.cross(y, ez)
        ex = _unit(x - (x @ ez) * ez)
    R = np.stack([ex, np.cross(ez, ex), ez])
    return Motion(R, -R @ origin, 1.0, 0.0, 0.0)


def _unit(v: Array) -> Array:
    length = float(np.linalg.norm(v))
    if not length > 1e-9:
        raise ValueError("two of the named directions are the same line, or a direction has no length")
    return np.asarray(v, float) / length


def normal_of(p: Array, towards: Array) -> Array:
    """The normal (3,) of the plane nearest to points p (n, 3), on the side of a point (3,): of still water, upward."""
    if len(p) < 3:
        raise ValueError(f"{len(p)} points are seen by two cameras; a level surface needs 3 that are not on one line")
    middle = p.mean(0)
    _, s, Vt = np.linalg.svd(p - middle)
    if s[1] < 0.02 * s[0]:
        raise ValueError("the points on the level surface lie on one line")
    return np.asarray(Vt[2] * np.sign(Vt[2] @ (towards - middle)))


FALL_SAMPLES = (60, 48, 40, 34, 28, 24, 20, 17, 14, 12, 10, 8)
"""Samples of a fall that are tried, the most first."""
FALL_MISFIT = 1.5
"""Times sigma that positions may miss one parabola: a ball that is held or has landed misses it by more."""


class Fall(NamedTuple):
    """A ball that falls freely."""

    acceleration: Array  # (3,) world units / s^2
    sd: float  # of its length
    used: int


def falling(t: Array, p: Array, sigma: Array) -> Fall:
    """The acceleration of a ball located at p (n, 3), NaN where lost, at t (n,) s, with sigma (n, 3): a parabola.

    The longest stretch that one parabola explains: a ball that is still held, or has landed, is not used.
    Raises ValueError where it falls for fewer than 8 samples.
    """
    good = np.flatnonzero(np.isfinite(p).all(-1) & np.isfinite(sigma).all(-1))
    best: Fall | None = None
    worth = np.inf
    for length in FALL_SAMPLES:
        for start in range(len(good) - length + 1):
            rows = good[start : start + length]
            tau = t[rows] - t[rows].mean()
            w = 1 / np.maximum(sigma[rows].mean(-1), 1e-12)[:, None]
            A = np.stack([np.ones_like(tau), tau, tau**2 / 2], -1) * w
            fit, *_ = np.linalg.lstsq(A, p[rows] * w)
            left = p[rows] * w - A @ fit
            chi = float(np.sqrt((left**2).sum() / (3 * length - 9)))
            size = float(np.linalg.norm(fit[2]))
            sd = float(np.sqrt(np.linalg.inv(A.T @ A)[2, 2])) * max(chi, 1.0)
            if chi < FALL_MISFIT and size > 8 * sd and (best is None or chi < worth):
                best, worth = Fall(fit[2], sd, length), chi
        if best is not None:
            break
    if best is None:
        raise ValueError("no ball falls freely for 8 samples or more in two cameras")
    return best


def moved(cameras: Sequence[Camera], motion: Motion) -> tuple[Camera, ...]:
    """Cameras of the rig in the world's axes."""
    R = [c.R @ motion.R.T for c in cameras]
    return tuple(c.with_(R=r, T=motion.scale * c.T - r @ motion.t) for c, r in zip(cameras, R, strict=True))


def moved_points(p: Array, motion: Motion) -> Array:
    """Points (..., 3) of the rig in the world's axes."""
    return np.asarray(motion.scale * p @ motion.R.T + motion.t)
