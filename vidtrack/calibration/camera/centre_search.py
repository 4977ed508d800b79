"""The thesis's search by hand, as a map: how the error depends on Cx, Cy and the width of the sensor.

The thesis (6.8) moved Cx and Cy by up to 25 px and the sensor's size by up to 0.2 mm until the error was least. A map
shows what a hunt does not: how flat the floor is. Two errors are mapped: that of the closed form with the centre
held there, and that of the full refinement with the centre held there and all else fitted anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.camera.tsai import ClosedForm, closed_form
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import PARAMETERS
from vidtrack.geometry.lens_terms import TERMS

REACH_PX = 25.0
REACH_MM = 0.2


class SearchMap(NamedTuple):
    """Errors over the search, one row a trial; the same camera's other parameters fitted anew at each."""

    varied: tuple[str, ...]  # (m,) "centre" or "sensor"
    Cx: Array  # (m,) px; NaN in the rows that vary the sensor
    Cy: Array
    sensor_width: Array  # (m,) mm
    rms_closed_form: Array  # (m,) px; NaN where the closed form makes no camera
    rms_refined: Array  # (m,) px; NaN where not sought


def closed_form_error(p: ArrayLike, b: ArrayLike, s: ClosedForm) -> Array:
    """Root of the mean squared distance, px (...), between measured b (n, 2) and projected p (n, 3), of closed forms.

    The lens is inverted to first order at the measured position, which is exact to the second order of the error.
    NaN where f < 0 or a point lies behind the camera.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    c = p @ np.swapaxes(s.R, -1, -2) + s.T[..., None, :]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # closed forms that make no camera
        u = s.f[..., None, None] * c[..., :2] / c[..., 2:]
        X = s.dx[..., None] / s.Sx[..., None] * (b[:, 0] - s.Cx[..., None])
        Y = s.dy[..., None] * (b[:, 1] - s.Cy[..., None])
        kr2 = s.kappa1[..., None] * (X * X + Y * Y)
        ex, ey = X * (1 + kr2) - u[..., 0], Y * (1 + kr2) - u[..., 1]
        along = 2 * s.kappa1[..., None] * (X * ex + Y * ey) / (1 + 3 * kr2)  # the radial part is stretched more
        ex, ey = (ex - along * X) / (1 + kr2), (ey - along * Y) / (1 + kr2)
        px = (ex * s.Sx[..., None] / s.dx[..., None]) ** 2 + (ey / s.dy[..., None]) ** 2
        good = (s.f > 0) & (s.depth > 0).all(-1) & ((1 + 3 * kr2) > 0).all(-1)
        return np.asarray(np.where(good, np.sqrt(px.mean(-1)), np.nan))


def best_centre(
    p: ArrayLike,
    b: ArrayLike,
    *,
    Cx: float,
    Cy: float,
    dx: float,
    dy: float,
    reach: float = REACH_PX,
    precision: float = 0.02,
    coplanar: bool = False,
    held: Mapping[str, float] | None = None,
) -> tuple[float, float, bool]:
    """The centre within `reach` px of Cx, Cy where the closed form's error is least, and whether it lies at the edge.

    A grid of 11 x 11 is laid ever finer about the best of the last one. Raises ValueError where no centre
    makes a camera.
    """
    x, y, half = Cx, Cy, reach
    while half > precision:
        steps = np.linspace(-half, half, 11)
        gx, gy = np.meshgrid(np.clip(x + steps, Cx - reach, Cx + reach), np.clip(y + steps, Cy - reach, Cy + reach))
        solved = closed_form(p, b, Cx=gx, Cy=gy, dx=dx, dy=dy, coplanar=coplanar, **(held or {}))
        error = closed_form_error(p, b, solved)
        if not np.isfinite(error).any():
            raise ValueError("no centre within reach makes a camera")
        best = np.unravel_index(np.nanargmin(error), error.shape)
        x, y, half = float(gx[best]), float(gy[best]), half * 0.3
    edge = max(abs(x - Cx), abs(y - Cy)) > reach - 2 * precision
    return x, y, bool(edge)


def search_map(
    camera: Camera,
    p: ArrayLike,
    b: ArrayLike,
    *,
    Cx: float,
    Cy: float,
    free: Sequence[str] = (),
    held: Mapping[str, float] | None = None,
    coplanar: bool = False,
    steps: int = 11,
    most_points: int = 100,
) -> SearchMap:
    """The error over Cx, Cy within 25 px, and over the sensor's width within 0.2 mm with Sx held at the camera's.

    camera   the calibrated camera, from which each refinement starts
    Cx, Cy   px, the middle of the map
    free     parameters that the refinement frees (Cx, Cy and Sx left out here); empty: no refined errors
    held     Sx, kappa1 where the closed form holds them
    Of more than `most_points` points as many are taken, always the same: the map is for looking at.
    A wrong sensor width and Sx undo each other exactly, so that the width only shows when Sx is held.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    pick = np.sort(np.random.default_rng(0).permutation(len(p))[:most_points])
    p, b = p[pick], b[pick]
    offsets = np.linspace(-REACH_PX, REACH_PX, steps)
    gx, gy = (g.ravel() for g in np.meshgrid(Cx + offsets, Cy + offsets))
    # the pitch may be in px: then 0.2 mm is taken as the share of 8.8 mm that it was in the thesis
    columns = camera.image_size[0]
    width = columns * camera.dx
    reach = REACH_MM if camera.dx < 0.2 else width * REACH_MM / 8.8
    widths = width + np.linspace(-reach, reach, steps)
    size = gx.size + widths.size

    closed = np.full(size, np.nan)
    known: dict[str, float] = dict(held or {})
    centres = closed_form(p, b, Cx=gx, Cy=gy, dx=camera.dx, dy=camera.dy, coplanar=coplanar, **known)
    closed[: gx.size] = closed_form_error(p, b, centres)
    known["Sx"] = camera.Sx
    wide = closed_form(p, b, Cx=camera.Cx, Cy=camera.Cy, dx=widths / columns, dy=camera.dy, coplanar=coplanar, **known)
    closed[gx.size :] = closed_form_error(p, b, wide)
    refined = np.full(size, np.nan)
    if free:
        others = [name for name in free if name not in ("Cx", "Cy")]
        pitch = np.full(gx.size, camera.dx)
        refined[: gx.size] = refined_error(camera, p, b, Cx=gx, Cy=gy, dx=pitch, free=others)
        others = [name for name in free if name != "Sx"]
        here = np.full(widths.size, 1.0)
        refined[gx.size :] = refined_error(
            camera, p, b, Cx=camera.Cx * here, Cy=camera.Cy * here, dx=widths / columns, free=others
        )
    return SearchMap(
        ("centre",) * gx.size + ("sensor",) * widths.size,
        np.concatenate([gx, np.full(widths.size, np.nan)]),
        np.concatenate([gy, np.full(widths.size, np.nan)]),
        np.concatenate([np.full(gx.size, width), widths]),
        closed,
        refined,
    )


def refined_error(
    camera: Camera, p: ArrayLike, b: ArrayLike, *, Cx: Array, Cy: Array, dx: Array, free: Sequence[str], rounds: int = 8
) -> Array:
    """Root of the mean squared distance, px (m,), of refinements with Cx, Cy and dx (m,) held there, all in one call.

    camera   the start of each trial; free: the parameters fitted anew (names of PARAMETERS)
    Gauss-Newton on all trials at once. The lens is linearised at the measured position as in `closed_form_error`,
    so that its own terms enter linearly and nothing need be inverted. NaN where it does not settle.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    pivot = p.mean(0)
    names = [name for name in PARAMETERS if name in set(free)]
    columns = [PARAMETERS.index(name) for name in names]
    m = len(Cx)
    R = np.broadcast_to(camera.R, (m, 3, 3))
    inner = np.array([getattr(camera, name) for name in PARAMETERS[6:]])
    theta = np.tile(np.concatenate([np.zeros(3), camera.R @ pivot + camera.T, inner]), (m, 1))
    theta[:, 8], theta[:, 9] = Cx, Cy
    best = np.full(m, np.nan)
    with np.errstate(all="ignore"):
        for _ in range(rounds):
            e, J = _linearised(theta, R, p - pivot, b, dx, camera.dy)
            rms = np.sqrt((e**2).sum(-1).mean(-1))
            settled = np.nanmax(np.abs(rms - best) / rms, initial=0.0) < 1e-4 and np.isfinite(best).any()
            best = np.fmin(best, rms)
            if settled:
                return np.asarray(best)
            J = np.where(np.isfinite(J), J, 0)[..., columns].reshape(m, -1, len(columns))
            size = np.linalg.norm(J, axis=1) + 1e-300
            J = J / size[:, None]
            Jt = np.swapaxes(J, 1, 2)
            H = Jt @ J + 1e-9 * np.eye(len(columns))
            step = np.linalg.solve(H, Jt @ np.nan_to_num(e).reshape(m, -1, 1))[..., 0] / size
            theta[:, columns] += np.nan_to_num(step)
            R = _turned(theta[:, :3], R)
            theta[:, :3] = 0
        e, _ = _linearised(theta, R, p - pivot, b, dx, camera.dy)
    return np.asarray(np.fmin(best, np.sqrt((e**2).sum(-1).mean(-1))))


def _linearised(theta: Array, R: Array, q: Array, b: Array, dx: Array, dy: float) -> tuple[Array, Array]:
    """Measured minus projected (m, n, 2) px, and the derivatives (m, n, 2, k) of the projected by PARAMETERS."""
    inner = dict(zip(PARAMETERS[6:], (column[:, None] for column in theta[:, 6:].T), strict=True))
    f, Sx, Cx, Cy, skew = (inner[name] for name in ("f", "Sx", "Cx", "Cy", "skew"))
    pitch = dx[:, None]
    arm = q @ np.swapaxes(R, 1, 2)
    c = arm + theta[:, None, 3:6]
    x, y, z = c[..., 0], c[..., 1], c[..., 2]
    Y = dy * (b[:, 1] - Cy)
    X = (pitch * (b[:, 0] - Cx) - skew * Y) / Sx
    r2 = X * X + Y * Y
    shifts = {name: term.shift(X, Y, r2) for name, term in TERMS.items()}
    used = [name for name in TERMS if inner[name].any()]
    bend = [np.ones_like(X), np.zeros_like(X), np.zeros_like(X), np.ones_like(X)]
    for name in used:
        bend = [b + inner[name] * part for b, part in zip(bend, TERMS[name].slope(X, Y, r2), strict=True)]
    xx, xy, yx, yy = bend
    det = xx * yy - xy * yx

    def px(u: Array, v: Array) -> Array:
        """A small change of (Xu, Yu) in px of the frame buffer."""
        X_, Y_ = (yy * u - xy * v) / det, (xx * v - yx * u) / det
        return np.stack([(Sx * X_ + skew * Y_) / pitch, Y_ / dy], -1)

    ux, uy = f * x / z, f * y / z
    e = px(
        X + sum(inner[name] * shifts[name][0] for name in used) - ux,
        Y + sum(inner[name] * shifts[name][1] for name in used) - uy,
    )
    J = np.zeros((*x.shape, 2, len(PARAMETERS)))
    t = np.stack([px(f / z, 0 * z), px(0 * z, f / z), px(-ux / z, -uy / z)], -1)
    J[..., 0] = t[..., 2] * arm[..., 1, None] - t[..., 1] * arm[..., 2, None]
    J[..., 1] = t[..., 0] * arm[..., 2, None] - t[..., 2] * arm[..., 0, None]
    J[..., 2] = t[..., 1] * arm[..., 0, None] - t[..., 0] * arm[..., 1, None]
    J[..., 3:6] = t
    J[..., 6] = px(x / z, y / z)
    J[..., 0, 7] = X / pitch
    J[..., 0, 8] = J[..., 1, 9] = 1
    for name, shift in shifts.items():
        J[..., PARAMETERS.index(name)] = -px(*shift)
    J[..., 0, PARAMETERS.index("skew")] = Y / pitch
    return e, J


def _turned(omega: Array, R: Array) -> Array:
    """Each R (m, 3, 3) turned by omega (m, 3) rad: Rodrigues' formula."""
    angle = np.linalg.norm(omega, axis=1)
    K = np.cross(np.eye(3), omega[:, None])  # rows: e_i x omega; so that K v = omega x v
    s, h = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi))
    return np.asarray((np.eye(3) + s[:, None, None] * K + 0.5 * h[:, None, None] ** 2 * (K @ K)) @ R)
