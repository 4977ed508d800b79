"""Rigs for tests: cameras in a ring about wires with balls, as in a hall or over a basin (mm)."""

import numpy as np

from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.rig import look_at


def ring(m, rng, *, size=(1920, 1080), distance=7000.0, f=1400.0):
    """m cameras around the origin that look at a place 1 m above it."""
    cameras = []
    for i in range(m):
        angle = 2 * np.pi * i / m + rng.uniform(-0.2, 0.2)
        position = np.array([distance * np.cos(angle), distance * np.sin(angle), rng.uniform(1500, 3500)])
        R = look_at(position, np.array([0, 0, 1000]) + rng.normal(0, 100, 3), roll_deg=rng.normal(0, 2))
        centre = np.array(size) / 2 + rng.normal(0, 10, 2)
        cameras.append(
            Camera(
                *centre,
                dx=1,
                dy=1,
                Sx=1,
                f=f * rng.uniform(0.95, 1.05),
                kappa1=rng.uniform(2e-8, 8e-8),
                R=R,
                T=-R @ position,
                image_size=size,
                name=f"cam{i + 1}",
            )
        )
    return cameras


def wires():
    """Tags and places (25, 3), mm, of five balls on each of five upright wires: A in the middle, B to E at corners."""
    feet = [(0, 0), (-1000, -1000), (1000, -1000), (1000, 1000), (-1000, 1000)]
    p = np.array([[x, y, z] for x, y in feet for z in np.linspace(100, 2000, 5)])
    return [f"{wire}{ball}" for wire in "ABCDE" for ball in range(1, 6)], p


def seen(cameras, p, rng, noise):
    """Where each camera sees points (n, 3): (m, n, 2) px."""
    return np.stack([project(camera, p) + rng.normal(0, noise, (len(p), 2)) for camera in cameras])
