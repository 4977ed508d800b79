"""A beach, rendered with its own code: a plane of sand, moving water with ripples and foam, one camera."""

from fractions import Fraction
from typing import NamedTuple

import cv2
import numpy as np

from vidtrack.geometry.camera import Camera, line_of_sight
from vidtrack.simulate.rig import look_at
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timebase import TimeBase

SLOPE = 0.1
RATE = Fraction(15)
ENDS = {"from": [0.5, 0.0, 0.05], "to": [10.0, 0.0, 1.0]}
"""A transect along y = 0, m."""


class Shore(NamedTuple):
    camera: Camera
    pictures: list
    time_s: np.ndarray
    edge: np.ndarray
    """x of the waterline on y = 0, m."""


def shore(*, frames=90, dark=True, foam=True, noise=3.0, seed=0, supersampling=2):
    """Swash of two periods on a beach of 1 in 10, seen obliquely by 320 x 240 px; about 20 px a metre at the edge."""
    rng = np.random.default_rng(seed)
    width, height, ss = 320, 240, supersampling
    position = np.array([-4, -9.0, 7])
    R = look_at(position, (5, 0, 0.3))
    camera = Camera(158, 121, 1, 1, 1, 330, 2e-7, R, -R @ position, (width, height), name="cam1")
    X, Y = np.meshgrid((np.arange(width * ss) + 0.5) / ss - 0.5, (np.arange(height * ss) + 0.5) / ss - 0.5)
    origin, ray = line_of_sight(camera, np.stack([X, Y], -1))
    normal = np.array([-SLOPE, 0, 1])
    ground = origin - (origin @ normal / (ray @ normal))[..., None] * ray
    x, y = ground[..., 0], ground[..., 1]
    sand, ripple = _texture(rng, 1.5), _texture(rng, 2.5)
    t = np.arange(frames) / float(RATE)
    level = 5 + 1.6 * np.sin(2 * np.pi * t / 3.1) + 0.5 * np.sin(2 * np.pi * t / 1.3 + 1)
    dry = 130 + 8 * _look(sand, x + 50, y + 50, 20)
    pictures = []
    for now, at in zip(t, level, strict=True):
        edge = at + 0.25 * np.sin(0.6 * y + now)
        water = (
            (70 if dark else 175) + 12 * _look(ripple, x + 1.5 * now, y - 0.7 * now, 12) + 8 * np.sin(3 * (x + 2 * now))
        )
        if foam:
            front = x > edge - 0.25 - 0.15 * np.sin(3 * y + 2 * now)
            water = np.where(front, 225 + 6 * _look(ripple, x, y, 20), water)
            water = np.where(np.abs(_look(ripple, x - now, y + now, 9)) > 2.2, 200, water)
        grey = np.where(x < edge, water, dry).reshape(height, ss, width, ss).mean((1, 3))
        pictures.append(np.clip(np.round(grey + rng.normal(0, noise, grey.shape)), 0, 255).astype(np.uint8))
    return Shore(camera, pictures, t, level + 0.25 * np.sin(t))


def video(beach, corrupt=()):
    """The pictures as a reader gives them."""
    frames = [Frame(i, Fraction(i) / RATE, picture, i in corrupt, None) for i, picture in enumerate(beach.pictures)]
    return frames, VideoInfo(320, 240, RATE, time=TimeBase(RATE, RATE))


def _texture(rng, smoothness):
    grain = cv2.GaussianBlur(rng.normal(size=(256, 256)), (0, 0), smoothness)
    return grain / grain.std()


def _look(texture, u, v, scale):
    return texture[(u * scale).astype(int) % 256, (v * scale).astype(int) % 256]
