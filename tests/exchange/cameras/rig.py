"""A camera in OpenCV's terms, points in front of it, and what an independent program sees of them."""

from __future__ import annotations

import cv2
import numpy as np

from vidtrack.exchange.cameras.given import Said

SIZE = (1280, 960)
K = np.array([[1100.0, 0, 655.25], [0, 1080.0, 470.5], [0, 0, 1]])
RVEC = np.array([0.3, -0.2, 0.1])
TVEC = np.array([-0.4, 0.25, 5.0])
BROWN = np.array([-0.12, 0.03, 6e-4, -4e-4, -0.002])


def points(n: int = 60, seed: int = 0):
    """Points (n, 3) that the camera sees."""
    R = cv2.Rodrigues(RVEC)[0]
    c = np.random.default_rng(seed).uniform([-1.9, -1.4, 4], [1.9, 1.4, 6], (n, 3))
    c[:, :2] *= c[:, 2:] / 5
    return (c - TVEC) @ R


def seen(distortion=BROWN, p=None):
    """Where OpenCV sees points, (n, 2) px."""
    return cv2.projectPoints(points() if p is None else p, RVEC, TVEC, K, distortion)[0][:, 0]


def said(**more) -> Said:
    return Said(**({"name": "cam1", "world": "m"} | more))
