"""The rays of one camera's measured pixels through interfaces, and how points lie beside them.

Each measurement has one ray in every medium on the light's path. A point is compared with that of the medium in which
it lies. Coordinates come first, (3, n), relative to the origin of a block (see `geometry.sights`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Plane, planes_of
from vidtrack.geometry.refracted import pencil
from vidtrack.geometry.refraction import Rays, chosen, crossed, miss, traced
from vidtrack.geometry.symmetric import ELEMENTS


class Bent(NamedTuple):
    """The light's paths of n measurements."""

    planes: list[Plane]
    path: list[Rays]  # from the camera on; rays along z where there is no light
    there: NDArray[np.bool_]  # (n,)

    def beyond(self, p: Array) -> bool:
        """Whether all points p (3, n) lie behind all planes, as most do."""
        return all(bool((plane.normal @ (p - plane.point[:, None]) > 0).all()) for plane in self.planes)

    def at(self, p: Array | None) -> Rays:
        """The rays in the media in which points p (3, n) lie; None: in the last."""
        if p is None or self.beyond(p):
            return self.path[-1]
        return chosen(self.path, crossed(self.planes, p))

    def seen(self, p: Array) -> tuple[Array, Array, Array]:
        """How points p (3, n) lie beside the rays: rows d(u, v)/dp (2, 3, n), the change (2, n) of the tangents that
        leads to them, and their offset (3, n) from the rays."""
        rows, off = miss(self.at(p), p)
        return rows, np.einsum("kin,in->kn", rows, off), off

    def across(self, p: Array) -> Array:
        """How the nearest points of the rays move across them with u and v, (2, 3, n), at points p (3, n)."""
        rays = self.at(p)
        moved = rays.dq + np.einsum("in,in->n", p - rays.q, rays.d) * rays.dd
        return np.asarray(moved - np.einsum("kin,in->kn", moved, rays.d)[:, None] * rays.d)

    def add_lines(self, N: Array, h: Array, on: Array, near: Array | None) -> None:
        """Add to the normal equations N (6, n), h (3, n) in place those of the points nearest to the rays."""
        rays = self.at(near)
        d, q = rays.d, rays.q
        for k, (i, j) in enumerate(ELEMENTS):
            N[k] += on * ((i == j) - d[i] * d[j])
        h += on * (q - np.einsum("in,in->n", q, d) * d)


def bent(camera: Camera, tangents: Array, origin: Array) -> Bent:
    """The paths of tangents (2, n), relative to origin (3,)."""
    planes = [plane._replace(point=plane.point - origin) for plane in planes_of(camera.through, camera.position)]
    path = traced(planes, pencil(camera, tangents, camera.position - origin))
    last = path[-1]
    there = np.asarray(np.isfinite(last.q + last.d).all(0))
    if not there.all():
        for rays in path:
            for part, filler in zip(rays, _FILLER, strict=True):
                if not part.flags.writeable:
                    continue
                part[..., ~there] = filler
    return Bent(planes, path, there)


_FILLER = np.zeros((3, 1)), np.eye(3)[:, 2:], np.eye(3)[:2, :, None], np.zeros((2, 3, 1))
