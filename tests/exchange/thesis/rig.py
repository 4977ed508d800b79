"""The old laboratory in small: two cameras, their points, and the old programs' equations as appendix C prints them."""

from __future__ import annotations

import numpy as np

from vidtrack.exchange.thesis.camparm import Fixed
from vidtrack.geometry.camera import Camera

FIXED = Fixed(510.0, 492.0, 512.0, 259.5, 241.25, 8.8, 6.6)


def cameras() -> list[Camera]:
    """Two cameras 90 degrees apart, tilted, with a sensor of 8.8 x 6.6 mm; world in inches."""
    out = []
    for name, turn, kappa1 in (("cam1", 0.6, 2e-4), ("cam2", -0.7, -1e-4)):
        back = np.array([np.sin(turn), -np.cos(turn) * np.sin(0.6), np.cos(turn) * np.cos(0.6)])
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        R = np.array([right, np.cross(back, right), back])
        T = -R @ (-back * 150 + np.array([30.0, 20, 10]))
        sizes = {"dx": FIXED.dx, "dy": FIXED.dy, "image_size": FIXED.image_size}
        out.append(Camera(Cx=FIXED.Cx, Cy=FIXED.Cy, Sx=1.01, f=16.0, kappa1=kappa1, R=R, T=T, name=name, **sizes))
    return out


def projected_by_back(R, T, Sx, f, k1, fixed: Fixed, p):
    """Xf, Yf as back.c computes them: (n, 2)."""
    c = p @ np.asarray(R).T + T
    Xu, Yu = f * c[:, 0] / c[:, 2], f * c[:, 1] / c[:, 2]
    root = 1 + np.sqrt(1 - 4 * k1 * (Xu**2 + Yu**2))
    Xd, Yd = 2 * Xu / root, 2 * Yu / root
    return np.stack([Sx * Xd * fixed.Nfx / fixed.width + fixed.Cx, Yd * fixed.Ncy / fixed.height + fixed.Cy], -1)


def points(n: int = 24, seed: int = 3):
    """Surveyed points (n, 3), inches, to 0.01."""
    return np.round(np.random.default_rng(seed).uniform([0, 0, 0], [60, 40, 20], (n, 3)), 2)
