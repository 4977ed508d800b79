"""How a far lamp lights a matt ball: contours of its light, each drawn as exactly as the ball's outline.

By Lambert's law the light of a surface goes as the cosine of the angle between its normal and the lamp. So where a ball
is at least so bright is a cap about the point that faces the lamp. What a camera sees of it lies between two circles on
the ball: the cap's, and that where the cone of sight touches.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.plan import Plan, Vector
from vidtrack.simulate.render import sights

CONTOURS = 8
"""Steps in which the light of the lamp is drawn."""


class Lamp(Plan):
    """A lamp far away."""

    toward: Vector = Field(description="direction to it, world axes")
    share: Annotated[float, Field(ge=0, le=1)] = Field(
        0.7, description="of the light of what faces it; the rest comes from everywhere alike"
    )

    @field_validator("toward")
    @classmethod
    def _somewhere(cls, value: Vector) -> Vector:
        if not any(value):
            raise ValueError("a lamp's direction is not 0, 0, 0")
        return value


def lit_parts(camera: Camera, centres: Array, radius: float, lamp: Lamp, n_vertices: int) -> Array:
    """Outlines (..., CONTOURS, n_vertices, 2), px, of what a camera sees of each cap of spheres centred at (..., 3),
    world units: of its level each adds lamp.share / CONTOURS to a ball's light.

    A cap that is not seen is a point. NaN where a sphere is not in front of the camera.
    """
    L = np.asarray(lamp.toward, float)
    L = L / np.linalg.norm(L)
    forward, D = sights(camera, centres)
    v, reach_v = -forward[..., None, :], np.arccos(np.clip(radius / D, 0, 1))[..., None]
    reach_l = np.arccos((np.arange(CONTOURS) + 0.5) / CONTOURS)
    cos = np.clip(v @ L, -1, 1)
    gamma, sin = np.arccos(cos), np.sqrt(1 - cos**2)
    # from the camera's side of the ball toward the lamp's; any way where those are the same or opposite
    u = np.where((sin > 1e-6)[..., None], L - cos[..., None] * v, np.cross(v, np.eye(3)[np.argmin(np.abs(L))]))
    u = u / np.linalg.norm(u, axis=-1, keepdims=True)
    t, sin = sin[..., None] * v - cos[..., None] * u, np.maximum(sin, 1e-9)
    w = -np.cross(v, u)

    def half(own: Array, other: Array) -> Array:
        """Up to which angle a circle of angular radius `own` lies within the other one."""
        most = (np.cos(other) - np.cos(own) * cos) / (np.sin(own) * sin)
        return np.asarray(np.arccos(np.clip(most, -1, 1)))

    half_v, half_l = half(reach_v, reach_l), half(reach_l, reach_v)
    step = np.linspace(-1, 1, n_vertices // 2)
    near = _circle(v, u, w, reach_v, half_v[..., None] * step)
    far = _circle(L, t, w, reach_l, -half_l[..., None] * step)
    inside, outside = (gamma + reach_l <= reach_v), gamma + reach_v <= reach_l
    near = np.where(inside[..., None, None], far[..., :1, :], near)
    far = np.where(outside[..., None, None], near[..., -1:, :], far)
    normals = np.concatenate([near, far], axis=-2)
    normals = np.where((gamma >= reach_v + reach_l)[..., None, None], v[..., None, :], normals)
    points = centres[..., None, None, :] + radius * normals
    return project(camera, points)


def _circle(axis: Array, first: Array, second: Array, reach: Array, angle: Array) -> Array:
    """Points of circles on a unit sphere, (..., n, 3), at angles (..., n) from `first` toward `second`."""
    along = np.cos(angle)[..., None] * first[..., None, :] + np.sin(angle)[..., None] * second[..., None, :]
    return np.asarray(
        np.cos(reach)[..., None, None] * np.broadcast_to(axis, first.shape)[..., None, :]
        + np.sin(reach)[..., None, None] * along
    )
