"""A rig of cameras, a tag that moves before it, and what the cameras see of it."""

import cv2
import numpy as np

from vidtrack.geometry.camera import Camera, project
from vidtrack.motion.sighted_pose import Sightings

SIDE = 100.0
SQUARE = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * SIDE / 2
SIZE = (1280, 960)
F = 1500.0


def rig(n):
    """n cameras that look at (0, 0, 1500), 0.5 rad apart."""
    out = []
    for i in range(n):
        R = cv2.Rodrigues(np.array([0.1, 0.5 * i, 0.05]))[0]
        T = np.array([0.0, 0.0, 1500.0]) - R @ np.array([0.0, 0.0, 1500.0])
        out.append(Camera(640.2, 478.1, 1, 1, 1.0, F, -0.1 / F**2, R, T, SIZE))
    return out


def poses(T=60, tilt=0.35, distance=1500.0, seed=0):
    """Origins (T, 3) and rotations (T, 3, 3): a tag that faces the first camera, tilted at random."""
    rng = np.random.default_rng(seed)
    R = np.stack([cv2.Rodrigues(rng.normal(0, tilt, 3))[0] @ np.diag([1.0, -1, -1]) for _ in range(T)])
    return rng.uniform([-100, -80, distance - 100], [100, 80, distance + 100], (T, 3)), R


def seen(cameras, body, origin, R, sd=0.03, seed=0, truth=None):
    """Sightings of a body's points; truth: the cameras that made the pictures, where they are not those of the fit."""
    rng = np.random.default_rng(seed)
    p = origin[:, None] + body @ np.swapaxes(R, -1, -2)
    b = np.stack([project(camera, p) + rng.normal(0, sd, (*p.shape[:2], 2)) for camera in truth or cameras])
    return Sightings(cameras, b, np.full(b.shape, sd), body)


def errors(pose, origin, R):
    """(T, 6) small turns about the world axes, and shifts."""
    nothing = np.full(3, np.nan)
    turn = [
        cv2.Rodrigues(a @ b.T)[0][:, 0] if np.isfinite(a).all() else nothing for a, b in zip(pose.R, R, strict=True)
    ]
    return np.concatenate([np.array(turn), pose.origin - origin], -1)


def z_of(error, covariance):
    """Rms of errors over their covariance, all parameters together; 1 where it is honest."""
    good = np.isfinite(error).all(-1)
    e, C = error[good], covariance[good]
    return float(np.sqrt(np.mean(np.einsum("ti,tij,tj->t", e, np.linalg.inv(C), e) / e.shape[-1])))
