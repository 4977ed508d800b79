"""A background with a pattern, as a camera that may turn sees it: a wall far away, the same in every picture."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    distorted_from_frame_buffer,
    distorted_from_undistorted,
    frame_buffer_from_distorted,
    undistorted_from_camera,
    undistorted_from_distorted,
)
from vidtrack.simulate.picture import Scene
from vidtrack.simulate.plan import NotNegative, Plan

MARGIN = 96
"""px of pattern beyond the picture of the camera at rest, either way: as far as it may turn."""

FINE = 4
"""Cells of the pattern to a px: linear interpolation between them errs by a few thousandths of its contrast."""


class Texture(Plan):
    """A random pattern."""

    contrast: NotNegative = Field(12.0, description="grey levels, rms")
    grain_px: Annotated[float, Field(ge=1)] = Field(2.0, description="px, sigma of its finest detail")
    cover: tuple[float, float, float, float] = Field(
        (0.0, 0.0, 1.0, 1.0),
        description="left, top, right, bottom: the part of the picture at rest that it fills, as shares of it",
    )


def turned(camera: Camera, turn_deg: Array, zoom: float = 0.0) -> Camera:
    """A camera that was turned in its place by (3,) degrees about its own axes, its f longer by the share `zoom`."""
    turn = np.radians(turn_deg)
    angle = float(np.linalg.norm(turn))
    K = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    about = np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)
    R = about.T @ camera.R
    return camera.with_(R=R, T=-R @ camera.position, f=camera.f * (1 + zoom))


@lru_cache(maxsize=8)
def pattern(texture: Texture, size: tuple[int, int], seed: int) -> Scene:
    """The pattern (rows, columns), grey levels about 0, FINE cells a px, of a picture (width, height) with MARGIN."""
    rng = np.random.Generator(np.random.SFC64([seed, *size]))
    width, height = (n + 2 * MARGIN for n in size)
    coarse = rng.standard_normal((height, width)).astype(np.float32)
    fine = cv2.GaussianBlur(coarse, (0, 0), texture.grain_px)
    fine = fine / fine.std() + 0.7 * (wide := cv2.GaussianBlur(coarse, (0, 0), 4 * texture.grain_px)) / wide.std()
    fine = cv2.resize(fine / fine.std(), None, fx=FINE, fy=FINE, interpolation=cv2.INTER_CUBIC)
    left, top, right, bottom = texture.cover
    x = ((np.arange(fine.shape[1]) + 0.5) / FINE - MARGIN) / size[0]
    y = ((np.arange(fine.shape[0]) + 0.5) / FINE - MARGIN) / size[1]
    whole = left <= 0 and top <= 0 and right >= 1 and bottom >= 1
    inside = np.outer((y >= top) & (y < bottom), (x >= left) & (x < right)) | whole
    return np.asarray(texture.contrast * fine * inside, np.float32)


def seen(texture: Texture, at_rest: Camera, now: Camera, seed: int) -> Scene:
    """What the pattern adds to the picture (height, width) of a camera that now stands otherwise, grey levels.

    The wall is so far away that where the camera stands does not matter, only how it is turned.
    """
    width, height = now.image_size
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    u = undistorted_from_distorted(now, distorted_from_frame_buffer(now, np.stack([x, y], -1)))
    ray = np.concatenate([u / now.f, np.ones((height, width, 1))], -1) @ now.R
    c = camera_from_world(at_rest.with_(T=np.zeros(3)), ray)
    b = frame_buffer_from_distorted(at_rest, distorted_from_undistorted(at_rest, undistorted_from_camera(at_rest, c)))
    at = ((b + MARGIN + 0.5) * FINE - 0.5).astype(np.float32)
    cells = pattern(texture, at_rest.image_size, seed)
    shown: Scene = cv2.remap(cells, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return shown
