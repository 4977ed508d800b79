"""Cameras around a tank: through a window, through the water's surface, and beside interfaces that are not parallel."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface

AIR, GLASS, WATER = 1.0, 1.49, 1.333
WINDOW = Interface("window", np.array([0.0, -500, 0]), np.array([0.03, 1, 0.01]), (AIR, GLASS, WATER), (30.0,))
SURFACE = Interface("surface", np.array([0.0, 0, 120]), np.array([0.0, 0, 1]), (AIR, WATER))
SLOPED = Interface("bottom", np.array([0.0, -300, 0]), np.array([0.15, 1, 0.1]), (WATER, 1.2))


def looking(position: tuple[float, float, float], *through: Interface, f: float = 8.0) -> Camera:
    """A camera at a place, world units, that looks at the origin."""
    place = np.array(position, float)
    z = -place / np.linalg.norm(place)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    R = np.array([x, np.cross(z, x), z])
    return Camera(320, 240, 0.01, 0.01, 1.01, f, 1e-4, R, -R @ place, (640, 480), skew=1e-3, through=through)


LEFT = looking((-500, -1500, 50), WINDOW)
RIGHT = looking((500, -1500, -100), WINDOW)
ABOVE = looking((200, -300, 1500), SURFACE)
WEDGE = looking((300, -1400, 100), WINDOW, SLOPED)
CAMERAS = (LEFT, RIGHT, ABOVE, WEDGE)


def places(n: int = 60, seed: int = 0) -> Array:
    """World points (n, 3) in the water, and some above it."""
    return np.random.default_rng(seed).uniform(-200, 200, (n, 3))
