"""Light through plane interfaces: the ray that a camera's direction becomes, and where a point appears.

At a plane with normal n, a ray of unit direction d goes on by Snell's law in vector form, r = n1/n2, a = n . d,

    d' = r d + (sqrt(1 - r^2 (1 - a^2)) - r a) n

and its derivatives by whatever moves the ray or the plane are carried along with it. The way back has no closed form.
For parallel planes the lateral distance is a sum over layers of height h_i and index n_i,

    sum h_i tan(theta_i) = lateral,     tan(theta_i) = s_i t / sqrt(1 + t^2 (1 - s_i^2)),     s_i = n_least / n_i

which grows with t, the tangent in the medium of least index, and is concave: Newton's method from the paraxial answer,
which lies below the root, cannot overshoot. Planes that are not parallel: Newton's method on the traced ray.

A point is seen through those planes, counted from the camera, behind which it lies; on the camera's side of the first
it is seen directly. Arrays hold coordinates first, (3, n).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.geometry.interface import Interface, Plane, planes_of

PARALLEL = 1e-14
"""Sine of the angle between planes below which they count as parallel: no more than rounding."""


class Rays(NamedTuple):
    """Rays behind a plane: where they start, their unit directions, and how both follow m changes."""

    q: Array  # (3, n)
    d: Array  # (3, n)
    dq: Array  # (m, 3, n)
    dd: Array  # (m, 3, n)


def traced(planes: Sequence[Plane], rays: Rays, names: Sequence[str] = ()) -> list[Rays]:
    """The rays from the camera and behind each plane in turn; NaN where a plane is not met or reflects all light.

    names   of interface parameters: the changes that follow those which the rays bring along
    """
    own = np.zeros((len(names), *rays.q.shape))
    if names:
        rays = rays._replace(dq=np.concatenate([rays.dq, own]), dd=np.concatenate([rays.dd, own]))
    path = [rays]
    for plane in planes:
        rays = _refracted(plane, rays, names)
        path.append(rays)
    return path


def _refracted(plane: Plane, rays: Rays, names: Sequence[str]) -> Rays:
    q, d, dq, dd = rays
    n = plane.normal
    r, m = plane.ratio, len(dq) - len(names)
    moved = [(m + k, *plane.moves[name]) for k, name in enumerate(names) if name in plane.moves]
    with np.errstate(invalid="ignore", divide="ignore"):
        a = n @ d
        a = np.where(a > 0, a, np.nan)
        from_point = plane.point[:, None] - q
        t = (n @ from_point) / a
        t = np.where(t >= 0, t, np.nan)
        c = np.sqrt(1 - r * r * (1 - a * a))
        da, dw = n @ dd, -(n @ dq)
        dr = np.zeros(len(dq))
        for k, d_point, d_normal, d_ratio in moved:
            da[k] += d_normal @ d
            dw[k] += d_normal @ from_point + n @ d_point
            dr[k] = d_ratio
        dt = (dw - t * da) / a
        dc = (r * r * a * da - r * (1 - a * a) * dr[:, None]) / c
        bend = c - r * a
        q_on = q + t * d
        d_on = r * d + bend * n[:, None]
        dq_on = dq + dt[:, None] * d + t * dd
        dd_on = r * dd + (dc - r * da)[:, None] * n[:, None]
        for k, _, d_normal, d_ratio in moved:
            if d_ratio:
                dd_on[k] += d_ratio * (d - a * n[:, None])
            dd_on[k] += bend * d_normal[:, None]
    return Rays(q_on, d_on, dq_on, dd_on)


def paths(through: Sequence[Interface], centre: Array, d: Array) -> list[Rays]:
    """The rays (3, n) that leave a camera at centre (3,) in directions d (..., 3): from it and behind each plane."""
    d = np.ascontiguousarray(d.reshape(-1, 3).T)
    none = np.empty((0, *d.shape))
    return traced(planes_of(through, centre), Rays(np.broadcast_to(centre[:, None], d.shape), d, none, none))


def crossed(planes: Sequence[Plane], p: Array) -> Ints:
    """How many planes, counted from the camera, lie between it and points p (3, n)."""
    behind = np.ones(p.shape[1], bool)
    count = np.zeros(p.shape[1], np.intp)
    for plane in planes:
        behind &= plane.normal @ (p - plane.point[:, None]) > 0
        count += behind
    return count


def apparent(through: Sequence[Interface], centre: Array, p: Array) -> Array:
    """Where points p (..., 3) appear to a camera at centre (3,): as far from it, in the direction of their light.

    Points that are seen directly stay where they are. NaN where no light comes from a point to the camera.
    """
    flat = np.ascontiguousarray(p.reshape(-1, 3).T)
    planes = planes_of(through, centre)
    count = crossed(planes, flat)
    seen = flat.copy()
    parallel = all(np.linalg.norm(np.cross(planes[0].normal, plane.normal)) <= PARALLEL for plane in planes)
    for m in range(1, len(planes) + 1):
        own = np.flatnonzero(count == m)
        if not own.size:
            continue
        aim = flat[:, own] - centre[:, None]
        d = _through_parallel(planes[:m], centre, aim) if parallel else _through_any(planes[:m], centre, aim)
        seen[:, own] = centre[:, None] + d * np.linalg.norm(aim, axis=0)
    return np.ascontiguousarray(seen.T).reshape(p.shape)


def _through_parallel(planes: Sequence[Plane], centre: Array, aim: Array) -> Array:
    """Unit directions (3, n) from the centre along which light comes from points at centre + aim (3, n)."""
    n = planes[0].normal
    height = n @ aim
    lateral = aim - n[:, None] * height
    r = np.sqrt(np.einsum("in,in->n", lateral, lateral))
    at = [float(n @ (plane.point - centre)) for plane in planes]
    layers = [np.full(r.size, b - a) for a, b in zip([0.0, *at[:-1]], at, strict=True)] + [height - at[-1]]
    index = 1 / np.cumprod([1.0, *(plane.ratio for plane in planes)])
    s = index.min() / index
    t = r / sum(h * each for h, each in zip(layers, s, strict=True))
    one = 1 - s * s
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(100):
            value, slope = -r, np.zeros(r.size)
            for h, each, rest in zip(layers, s, one, strict=True):
                w = 1 + t * t * rest
                root = each * h / np.sqrt(w)
                value, slope = value + root * t, slope + root / w
            step = value / slope
            t = t - step
            if not (np.abs(step) > 1e-11 * (1 + t)).any():  # the next step would be its square
                break
        first = s[0] * t / np.sqrt(1 + t * t * one[0])
        gain = np.where(r > 0, first / r, 0.0)
    d = n[:, None] + lateral * gain
    return np.asarray(d / np.sqrt(1 + first * first))


def _through_any(planes: Sequence[Plane], centre: Array, aim: Array) -> Array:
    """As `_through_parallel`, for planes of any attitude."""
    distance = np.sqrt(np.einsum("in,in->n", aim, aim))
    d = _through_parallel([plane._replace(normal=planes[0].normal) for plane in planes], centre, aim)
    d = np.where(np.isfinite(d), d, aim / distance)
    best, left = np.full_like(d, np.nan), np.full(distance.size, np.inf)
    target = aim + centre[:, None]
    step = np.zeros_like(d)
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(60):
            side = np.cross(d.T, np.eye(3)[np.argmin(np.abs(d), axis=0)]).T
            side /= np.linalg.norm(side, axis=0)
            across = np.stack([side, np.cross(d.T, side.T).T])
            start = Rays(np.broadcast_to(centre[:, None], d.shape), d, np.zeros_like(across), across)
            last = traced(planes, start)[-1]
            rows, off = miss(last, target)
            size = np.sqrt(np.einsum("in,in->n", off, off)) / distance
            better = size < left
            best, left = np.where(better, d, best), np.where(better, size, left)
            if not (left > 1e-14).any() or not better.any():
                break
            step = np.where(better, np.einsum("kn,kin->in", np.einsum("kin,in->kn", rows, off), across), step / 4)
            d = best + step
            d /= np.linalg.norm(d, axis=0)
    return np.where(left < 1e-9, best, np.nan)


def miss(rays: Rays, p: Array) -> tuple[Array, Array]:
    """How points p (3, n) lie beside rays: rows (2, 3, n), and the offset (3, n) of each point from the nearest of its
    ray. rows . offset is by how much the first two changes must be made for the ray to meet the point, to first order.
    """
    off = p - rays.q
    s = np.einsum("in,in->n", off, rays.d)
    off = off - s * rays.d
    a, b = rays.dq[0] + s * rays.dd[0], rays.dq[1] + s * rays.dd[1]
    by_a = cross(b, rays.d)
    by_b = cross(rays.d, a)
    with np.errstate(invalid="ignore", divide="ignore"):
        per = 1 / np.einsum("in,in->n", a, by_a)
    return np.stack([by_a * per, by_b * per]), off


def cross(a: Array, b: Array) -> Array:
    """The cross products of vectors (3, n)."""
    out = np.empty_like(a)
    np.subtract(a[1] * b[2], a[2] * b[1], out=out[0])
    np.subtract(a[2] * b[0], a[0] * b[2], out=out[1])
    np.subtract(a[0] * b[1], a[1] * b[0], out=out[2])
    return out


def chosen(path: Sequence[Rays], count: Ints) -> Rays:
    """Of each point's path (one member per medium) the part in the medium that `count` (n,) says."""
    least, most = int(count.min(initial=len(path) - 1)), int(count.max(initial=0))
    if least >= most:
        return path[min(least, len(path) - 1)]
    return Rays(*(np.choose(count, part) for part in zip(*path, strict=True)))
