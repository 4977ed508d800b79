"""How what a camera sees through interfaces follows the point, the camera's centre and the interfaces.

A ray through the tangents (u, v) runs through x(u, v, C, k, s) at the distance s along it. A point p that moves, a
centre C or a parameter k that moves its ray, are met again by a change of (u, v): with rows such that
rows dx = d(u, v) and rows d = 0 along the ray (`refraction.miss`),

    d(u, v) = rows (dp - dx/dC dC - dx/dk dk)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import parameters_of, planes_of
from vidtrack.geometry.refraction import Rays, chosen, crossed, miss, traced

POSE = ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z")
"""The parameters of a camera's attitude and place (see `geometry.jacobian`)."""


class Followed(NamedTuple):
    """Derivatives of the tangents (u, v) of n points."""

    by_point: Array  # (..., 2, 3)
    by_centre: Array  # (..., 2, 3)
    by_interface: Array  # (..., 2, m), m = len(parameters_of(camera.through))


def followed(camera: Camera, p: Array, c: Array) -> Followed:
    """The derivatives at world points p (..., 3) that appear at c (..., 3), camera coordinates."""
    tangents = (c[..., :2] / c[..., 2:]).reshape(-1, 2).T
    centre = camera.position
    planes = planes_of(camera.through, centre)
    names = parameters_of(camera.through)
    flat = np.ascontiguousarray(p.reshape(-1, 3).T)
    start = pencil(camera, tangents, centre, centre_moves=True)
    rays = chosen(traced(planes, start, names), crossed(planes, flat))
    rows, _ = miss(rays, flat)
    moves = carried(rays, rows, flat)
    shape = p.shape[:-1]
    by_point = np.moveaxis(rows, -1, 0).reshape(*shape, 2, 3)
    rest = np.moveaxis(moves, -1, 0).reshape(*shape, 2, -1)
    return Followed(by_point, rest[..., :3], rest[..., 3:])


def pencil(camera: Camera, tangents: Array, centre: Array, *, centre_moves: bool = False) -> Rays:
    """Rays of tangents (2, n) from a centre (3,), with their changes by u and v, and by the centre where wanted."""
    n = tangents.shape[1]
    ahead = np.concatenate([tangents, np.ones((1, n))])
    length = np.sqrt(np.einsum("in,in->n", ahead, ahead))
    d = camera.R.T @ (ahead / length)
    dd = camera.R[:2, :, None] / length
    dd = dd - np.einsum("kin,in->kn", dd, d)[:, None] * d
    m = 5 if centre_moves else 2
    dq = np.zeros((m, 3, n))
    if centre_moves:
        dq[2:] = np.eye(3)[:, :, None]
        dd = np.concatenate([dd, np.zeros((3, 3, n))])
    return Rays(np.broadcast_to(centre[:, None], d.shape), d, dq, dd)


def carried(rays: Rays, rows: Array, p: Array) -> Array:
    """How the tangents follow every change but the first two, (2, m - 2, n), for points p (3, n) on the rays."""
    s = np.einsum("in,in->n", p - rays.q, rays.d)
    moved = rays.dq[2:] + s * rays.dd[2:]
    return np.asarray(-np.einsum("kin,min->kmn", rows, moved))


def tangent_moves(
    camera: Camera, tangents: Array, p: Array, origin: Array, names: Sequence[str]
) -> tuple[Array, Array]:
    """How the tangents (2, n) at which a camera sees points p (3, n), relative to origin (3,), follow its centre,
    (2, 3, n), and named parameters of its interfaces, (2, k, n)."""
    planes = [plane._replace(point=plane.point - origin) for plane in planes_of(camera.through, camera.position)]
    start = pencil(camera, tangents, camera.position - origin, centre_moves=True)
    rays = chosen(traced(planes, start, names), crossed(planes, p))
    rows, _ = miss(rays, p)
    moves = carried(rays, rows, p)
    return moves[:, :3], moves[:, 3:]


def pose_moves(tangents: Array, by_centre: Array, pivot: Array) -> Array:
    """How the tangents (..., 2) at which a camera sees points through interfaces follow its `POSE`: (..., 2, 6).

    by_centre   (..., 2, 3), by the camera's centre in camera axes; pivot (3,), camera coordinates
    Turning a camera moves the tangents of a direction that stays, and its centre by R^T (omega x t - dt).
    """
    u, v = tangents[..., 0], tangents[..., 1]
    turned = np.stack([np.stack([-u * v, 1 + u * u, -v], -1), np.stack([-1 - v * v, u * v, u], -1)], -2)
    x, y, z = pivot
    lever = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # omega x t = lever omega
    return np.concatenate([turned + by_centre @ lever, -by_centre], -1)
