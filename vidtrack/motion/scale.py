"""How large the points of a body truly are, as several cameras or several of its parts show it.

One plane seen by one camera says nothing of its size: twice as large is twice as far. Anything more does.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.motion.sighted_pose import SightedPose, Sightings, by_pose_of

STEPS = 6
MOST = 200
"""Times, evenly spread, that are looked at."""


class Scale(NamedTuple):
    """A factor to the points' distances, from all times together.

    factor, sd  1 where the body is as it was given; sd inf where it cannot be known
    by_pose     (T, 6) how the pose follows the factor
    """

    factor: float
    sd: float
    by_pose: Array

    def off(self, sure: float, share: float) -> float | None:
        """The factor where it differs from 1 by more than `sure` standard errors and `share`; else None."""
        apart = abs(self.factor - 1)
        return self.factor if apart > max(sure * self.sd, share) else None

    def covariance_of(self, share: float) -> Array:
        """What an error of the size, as a share of it, adds to the poses' covariance (T, 6, 6)."""
        return np.asarray(share**2 * self.by_pose[:, :, None] * self.by_pose[:, None, :])

    def as_record(self) -> dict[str, Any]:
        """For a record; None where it cannot be known."""
        known = bool(np.isfinite(self.sd))
        return {"factor": self.factor if known else None, "factor_sd": self.sd if known else None}


def scale_of(seen: Sightings, pose: SightedPose, arms: Array) -> Scale:
    """The factor by which `arms` must grow for the pictures to agree best.

    arms   (n, 3) of each point, body's axes: what a growth of 1 moves it by
    """
    by_pose = np.full((len(pose.origin), 6), np.nan)
    factor = 1.0
    good = np.flatnonzero(np.isfinite(pose.origin).all(-1) & np.isfinite(pose.covariance).all((-1, -2)) & ~pose.unsure)
    some = good[np.linspace(0, good.size - 1, min(good.size, MOST)).astype(int)] if good.size else good
    origin, R = pose.origin.copy(), pose.R.copy()
    sd = np.inf
    for step in range(STEPS):
        which = good if step == 0 else some
        if not which.size:
            break
        body = seen.body + (factor - 1) * arms
        p = origin[which][:, None] + body @ np.swapaxes(R[which], -1, -2)
        grown = arms @ np.swapaxes(R[which], -1, -2)
        N = np.zeros((which.size, 7, 7))
        g = np.zeros((which.size, 7))
        for camera, b, noise in zip(seen.cameras, seen.b[:, which], seen.sd[:, which], strict=True):
            at = derivatives(camera, p, np.zeros(3))
            used = np.isfinite(b) & np.isfinite(noise) & np.isfinite(at.projected)
            J = np.concatenate(
                [by_pose_of(at.by_point, p - origin[which][:, None]), at.by_point @ grown[..., None]], -1
            )
            J = np.where(used[..., None], J / noise[..., None], 0.0)
            r = np.where(used, (b - at.projected) / noise, 0.0)
            N += np.einsum("tnik,tnil->tkl", J, J)
            g += np.einsum("tnik,tni->tk", J, r)
        follow = np.linalg.solve(N[:, :6, :6] + 1e-12 * np.eye(6), N[:, :6, 6:])[..., 0]
        if step == 0:
            by_pose[which] = -follow
            inside = np.isin(good, some)
            N, g, follow = N[inside], g[inside], follow[inside]
        schur = N[:, 6, 6] - np.einsum("tk,tk->t", N[:, 6, :6], follow)
        own = g[:, 6] - np.einsum("tk,tk->t", follow, g[:, :6])
        known = schur > 1e-6 * N[:, 6, 6]  # else a plane in one camera: size and distance are one
        if not known.any():
            break
        information = float(schur[known].sum())
        sd = information**-0.5
        change = float(np.clip(own[known].sum() / information, -0.3, 0.3))
        factor += change
        free = np.linalg.solve(N[:, :6, :6] + 1e-12 * np.eye(6), (g[:, :6] - N[:, :6, 6] * change)[..., None])[..., 0]
        R[some] = rotation_from_vector(free[:, :3]) @ R[some]
        origin[some] += free[:, 3:]
        if abs(change) < 0.1 * sd:
            break
    return Scale(factor, sd, by_pose)
