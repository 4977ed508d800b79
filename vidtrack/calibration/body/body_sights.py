"""What cameras saw of a rigid body, and a first pose of it at each moment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import locate_points


class Body(NamedTuple):
    """A rigid body.

    targets  their names
    p        (q, 3) world units, their places in the body's axes
    sd       world units, standard deviation of each coordinate
    """

    targets: tuple[str, ...]
    p: Array
    sd: float

    @property
    def size(self) -> float:
        """The largest distance between two targets."""
        return float(np.linalg.norm(self.p[:, None] - self.p, axis=-1).max())


class BodySights(NamedTuple):
    """What m cameras saw of the q targets at n moments.

    b, sd  (m, n, q, 2) px; NaN where a camera lacks a target
    run    (n,) of which run a moment is; moments of a run follow each other in time
    """

    b: Array
    sd: Array
    run: Ints

    def at(self, rows: Ints | Bools) -> BodySights:
        return BodySights(self.b[:, rows], self.sd[:, rows], self.run[rows])


class SurveySights(NamedTuple):
    """The surveyed points by which m cameras were calibrated.

    p, sigma  (n, 3), (n,) world units, as surveyed and how well
    b, sd     (m, n, 2) px; NaN where a camera's calibration used no sight of a point
    """

    p: Array
    sigma: Array
    b: Array
    sd: Array


ROUNDS = 8
"""Rounds in which a shape is located: a stated place that is far off moves the poses at first."""
FLAT = 0.02
"""Second singular value of the targets' places over the first one, below which they lie on one line."""


def usable(cameras: Sequence[Camera], sights: BodySights, body: Body) -> tuple[BodySights, Array]:
    """The moments at which three targets that are not on one line are located, and a pose (n, 3, 4) at each.

    A sight that no other camera supports is left out.
    """
    seen = np.isfinite(sights.b).all(-1)
    b = np.where(((seen.sum(0) >= 2) & seen)[..., None], sights.b, np.nan)
    found = (
        locate_points(cameras, b, sd=sights.sd, most_unsure=np.inf).point if b.size else np.zeros((*b.shape[1:3], 3))
    )
    lost: Bools = np.asarray(~np.isfinite(found).all(-1))
    b = np.where(lost[..., None], np.nan, b)
    rows = np.flatnonzero((~lost).sum(-1) >= 3)
    poses = poses_of(body.p, found[rows], ~lost[rows])
    fine = np.isfinite(poses).all((-1, -2))
    return sights._replace(b=b).at(rows[fine]), poses[fine]


def shape_seen(cameras: Sequence[Camera], sights: BodySights, p: Array) -> Array:
    """The places (q, 3) of the targets as cameras locate them, in axes near to those of the stated places p.

    Targets that are located at no moment stay where they are stated.
    """
    x = locate_points(cameras, sights.b, sd=sights.sd, most_unsure=np.inf).point
    good: Bools = np.asarray(np.isfinite(x).all(-1))
    shape = p
    for _ in range(ROUNDS):
        poses = poses_of(shape, x, good)
        back = (x - poses[:, None, :, 3]) @ poses[..., :3]
        mean = np.array(
            [
                np.nanmedian(own, 0) if np.isfinite(own).any() else at
                for own, at in zip(back.swapaxes(0, 1), shape, strict=True)
            ]
        )
        shape = mean
    home = poses_of(shape, p[None], np.ones((1, len(p)), bool))[0]
    return np.asarray(shape @ home[:, :3].T + home[:, 3])


def poses_of(p: Array, x: Array, good: Bools) -> Array:
    """Poses (n, 3, 4) that bring a body's points p (q, 3) nearest to x (n, q, 3), those that are `good` (n, q).

    NaN where the good ones lie on one line (Kabsch 1976).
    """
    w = good.astype(float)
    n = np.maximum(w.sum(-1), 1)[:, None]
    x = np.where(good[..., None], x, 0.0)
    middle, centre = (w @ p) / n, x.sum(1) / n
    a = (p - middle[:, None]) * w[..., None]
    c = (x - centre[:, None]) * w[..., None]
    U, _, Vt = np.linalg.svd(np.swapaxes(c, -1, -2) @ a)
    D = np.ones((len(x), 3))
    D[:, 2] = np.sign(np.linalg.det(U @ Vt))
    R = (U * D[:, None]) @ Vt
    poses = np.concatenate([R, (centre - (R @ middle[..., None])[..., 0])[..., None]], -1)
    spread = np.linalg.svd(a, compute_uv=False)
    poses[spread[:, 1] < FLAT * np.maximum(spread[:, 0], 1e-300)] = np.nan
    return np.asarray(poses)
