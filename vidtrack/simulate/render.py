"""How much of each pixel a ball fills: the true outline of a sphere in a lens with distortion, integrated exactly.

A sphere's outline is the circle where the cone of sight touches it. Its perspective image is an ellipse, whose
centre is not quite the image of the sphere's centre; through the lens it is a distorted ellipse. The outline is
projected as a polygon with edges shorter than a pixel, and the polygon's area in each pixel is exact, by
Green's theorem: an edge adds its height times what lies to its right. No sampling, so no noise or bias of its own.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    directions,
    distorted_from_undistorted,
    frame_buffer_from_distorted,
    project,
    undistorted_from_camera,
)
from vidtrack.geometry.interface import planes_of
from vidtrack.geometry.refraction import chosen, crossed, paths

FINE = 4
"""How many times finer than the sensor's the pixels are on which blur is worked out."""

MOST_VERTICES = 4096
"""Of an outline; one that needs more is refused by `coverage`."""


class Patches(NamedTuple):
    """Square pieces of a picture, one a ball: the share of each pixel that the ball fills."""

    coverage: Array  # (n, size, size), 0 to 1
    left: NDArray[np.int64]  # (n,) column of the piece's first pixel; may lie outside the picture
    top: NDArray[np.int64]  # (n,) row


def outlines(camera: Camera, centres: ArrayLike, radius: ArrayLike, n_vertices: int | None = None) -> Array:
    """Outlines (..., n_vertices, 2), px, of spheres centred at (..., 3) with radius (...), world units, broadcast.

    A point c of the sphere's surface is on the outline where its radius is at right angles to the line of sight:
    a circle about (1 - r^2/D^2) c, of radius r sqrt(1 - r^2/D^2), D = |c|. The polygon is widened a little so that it
    holds the area of the smooth outline. NaN where any part of the sphere is not in front of the camera.
    n_vertices: None takes `vertices_needed`.
    """
    n_vertices = n_vertices or vertices_needed(camera, centres, radius)
    if camera.through:
        return _outlines_through(camera, centres, radius, n_vertices)
    c = camera_from_world(camera, centres)
    shape = np.broadcast_shapes(c.shape[:-1], np.shape(radius))
    c, r = np.broadcast_to(c, (*shape, 3)), np.broadcast_to(np.asarray(radius, float), shape)
    D = np.linalg.norm(c, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        forward = c / D[..., None]
        near = 1 - (r / D) ** 2
        seen = np.where((c[..., 2] > r) & (near > 0), near, np.nan)
        e1 = np.cross(forward, [0.0, 1.0, 0.0])
        e1 = e1 / np.linalg.norm(e1, axis=-1, keepdims=True)
    e2 = np.cross(forward, e1)
    angle = 2 * np.pi * np.arange(n_vertices) / n_vertices
    widening = np.sqrt(angle[1] / np.sin(angle[1]))
    reach = (r * np.sqrt(seen) * widening)[..., None, None]
    ring = np.cos(angle)[:, None] * e1[..., None, :] + np.sin(angle)[:, None] * e2[..., None, :]
    surface = (c * seen[..., None])[..., None, :] + reach * ring
    return frame_buffer_from_distorted(
        camera, distorted_from_undistorted(camera, undistorted_from_camera(camera, surface))
    )


def _outlines_through(camera: Camera, centres: ArrayLike, radius: ArrayLike, n_vertices: int) -> Array:
    """The outlines through interfaces: of each sphere the circle at right angles to the light from its centre, every
    point of it projected exactly. The outline's own circle lies nearer by r^2/D, which moves it by less than 1e-3 of
    its radius where D is 30 radii or more. NaN where a sphere is not seen."""
    p, r = np.broadcast_arrays(np.asarray(centres, float), np.asarray(radius, float)[..., None])
    r = r[..., 0]
    forward, _ = sights(camera, p)
    e1 = np.cross(forward, [0.0, 0.0, 1.0])
    steep = np.linalg.norm(e1, axis=-1, keepdims=True) < 1e-3
    e1 = np.where(steep, np.cross(forward, [1.0, 0.0, 0.0]), e1)
    e1 = e1 / np.linalg.norm(e1, axis=-1, keepdims=True)
    e2 = np.cross(forward, e1)
    angle = 2 * np.pi * np.arange(n_vertices) / n_vertices
    reach = (r * np.sqrt(angle[1] / np.sin(angle[1])))[..., None, None]
    ring = np.cos(angle)[:, None] * e1[..., None, :] + np.sin(angle)[:, None] * e2[..., None, :]
    return project(camera, p[..., None, :] + reach * ring)


def sights(camera: Camera, centres: ArrayLike) -> tuple[Array, Array]:
    """Unit directions (..., 3), world axes, in which light comes from a camera to points (..., 3), and how far, (...),
    they are from it on a straight line, world units. NaN where a point is not in front of the camera."""
    p = np.asarray(centres, float)
    away = p - camera.position
    D = np.linalg.norm(away, axis=-1)
    if camera.through:
        planes = planes_of(camera.through, camera.position)
        path = paths(camera.through, camera.position, directions(camera, project(camera, p)))
        return chosen(path, crossed(planes, p.reshape(-1, 3).T)).d.T.reshape(p.shape), D
    ahead = camera_from_world(camera, p)[..., 2] > 0
    return np.where(ahead[..., None], away / D[..., None], np.nan), D


def vertices_needed(camera: Camera, centres: ArrayLike, radius: ArrayLike) -> int:
    """How many vertices keep every edge of these spheres' outlines under 1 / FINE px; at least 64."""
    c = camera_from_world(camera, centres)
    with np.errstate(invalid="ignore", divide="ignore"):
        near = c[..., 2] - np.max(radius)
        stretch = np.linalg.norm(c, axis=-1) / c[..., 2]  # off the axis, an image grows along the radius
        size = np.where(near > 0, np.max(radius) / near * stretch, 0.0)
    px = float(np.nanmax(size, initial=0.0)) * camera.f * max(camera.Sx / camera.dx, 1 / camera.dy)
    return max(64, 16 * int(np.ceil(1.2 * FINE * 2 * np.pi * px / 16)))


def fine_enough(polygons: Array) -> bool:
    """Whether every edge of outlines (..., n_vertices, 2), px, is under 1 / FINE px, or they have MOST_VERTICES."""
    longest = np.nanmax(np.abs(np.diff(polygons, axis=-2)), initial=0.0)
    return bool(longest * FINE <= 1 or polygons.shape[-2] >= MOST_VERTICES)


def coverage(polygons: ArrayLike, weights: ArrayLike | None = None, *, align: int = 1) -> Patches:
    """The share of each pixel inside closed polygons (n, n_vertices, 2), px, as square pieces all of one size.

    Polygons (n, m, n_vertices, 2), all of one sense of rotation, are m outlines in one piece, summed with weights (m,):
    the stations of an exposure, or the contours of a shaded ball. weights: None takes their mean.
    align    the pieces begin at multiples of this number of pixels, and are a multiple of it wide
    A polygon with a NaN gives an empty piece at (0, 0). Raises ValueError for an edge longer than 1 px.
    """
    b = np.asarray(polygons, float) + 0.5  # pixel (0, 0) now covers 0 to 1
    b = b[:, None] if b.ndim == 3 else b
    m = b.shape[1]
    share = np.full(m, 1 / m) if weights is None else np.asarray(weights, float)
    whole = np.asarray(np.isfinite(b).all((-3, -2, -1)))
    b = np.where(whole[:, None, None, None], b, 0.0)
    if (longest := np.abs(np.diff(b, axis=-2)).max(initial=0.0)) > 1:
        raise ValueError(f"an edge of {longest:.3g} px: give the outline more vertices, so that none exceeds 1 px")
    corner = align * np.floor(b.min((1, 2)) / align).astype(np.int64)
    size = align * (int(np.ceil((b.max((1, 2)) - corner).max(initial=0.0)) // align) + 1)
    added = _accumulated(b - corner[:, None, None, :], share, size)
    area = np.abs(np.cumsum(added, -1))[:, :, :size]
    return Patches(area, corner[:, 0], corner[:, 1])


def shading(limb: float, n_contours: int = 5) -> tuple[Array, Array]:
    """Contours of a ball that darkens toward its rim: their radii (m,) as shares of the ball's, and weights (m,).

    The brightness 1 - limb (1 - sqrt(1 - rho^2)), rho the share of the radius, is built in equal steps of its depth.
    """
    if not limb > 0:
        return np.ones(1), np.ones(1)
    depth = (np.arange(n_contours) + 0.5) / n_contours
    radii = np.concatenate([[1.0], np.sqrt(1 - depth**2)])
    weights = np.concatenate([[1 - limb], np.full(n_contours, limb / n_contours)])
    return radii, weights


def _accumulated(b: Array, weights: Array, size: int) -> Array:
    """What the edges of (n, m, vertices, 2) add, (n, size, size + 1); the sum along a row is the area inside."""
    n = len(b)
    begin = b.reshape(n, -1, 2)
    step = (np.roll(b, -1, axis=2) - b).reshape(n, -1, 2)
    t = _cuts(begin, step)
    height = np.diff(t, axis=-1) * step[..., None, 1] * np.repeat(weights, b.shape[2])[:, None]
    middle = begin[..., None, :] + ((t[..., 1:] + t[..., :-1]) / 2)[..., None] * step[..., None, :]
    cell = np.clip(np.floor(middle).astype(np.int64), 0, size - 1)
    right = height * (middle[..., 0] - cell[..., 0])
    index = ((np.arange(n)[:, None, None] * size + cell[..., 1]) * (size + 1) + cell[..., 0]).ravel()
    total = n * size * (size + 1)
    here = np.bincount(index, (height - right).ravel(), minlength=total)
    beyond = np.bincount(index + 1, right.ravel(), minlength=total)[:total]
    return np.asarray(here + beyond, float).reshape(n, size, size + 1)


def _cuts(begin: Array, step: Array) -> Array:
    """Where along each edge (0 to 1) it meets a pixel's border, (..., 4), in order, 0 and 1 included."""
    end = begin + step
    line = np.maximum(np.floor(begin), np.floor(end))
    crosses = np.floor(begin) != np.floor(end)
    t = np.divide(line - begin, step, out=np.zeros_like(begin), where=crosses)
    t = np.clip(t, 0.0, 1.0)
    cuts = np.zeros((*t.shape[:-1], 4))
    np.minimum(t[..., 0], t[..., 1], out=cuts[..., 1])
    np.maximum(t[..., 0], t[..., 1], out=cuts[..., 2])
    cuts[..., 3] = 1.0
    return cuts


def softened(polygons: ArrayLike, sigma: float, weights: ArrayLike | None = None) -> Patches:
    """As `coverage`, seen through a Gaussian blur of `sigma` px; light is conserved.

    A lens blurs before the pixels sample, which takes off most of the sampling's own error in the centre of light
    (5 mpx for a sharp disc of radius 4 px). So the shares are found on pixels FINE times as fine, blurred there,
    and summed, in one product with a matrix on either side.
    Raises ValueError for an edge longer than 1 / FINE px.
    """
    if not sigma > 0:
        return coverage(polygons, weights)
    fine = coverage((np.asarray(polygons, float) + 0.5) * FINE - 0.5, weights, align=FINE)
    margin = int(np.ceil(4 * sigma))
    blur = _blur_matrix(fine.coverage.shape[-1] // FINE, margin, sigma)
    return Patches(blur @ fine.coverage @ blur.T, fine.left // FINE - margin, fine.top // FINE - margin)


@lru_cache(maxsize=16)
def _blur_matrix(n_whole: int, margin: int, sigma: float) -> Array:
    """What each of n_whole + 2 margin pixels takes of each of n_whole * FINE fine ones within."""
    to = (np.arange((n_whole + 2 * margin) * FINE) + 0.5) / FINE - margin
    origin = (np.arange(n_whole * FINE) + 0.5) / FINE
    weight = np.exp(-0.5 * ((to[:, None] - origin) / sigma) ** 2)
    weight /= weight.sum(0)
    return np.asarray(weight.reshape(-1, FINE, n_whole * FINE).sum(1) / FINE)
