"""From the lens of another program to a camera of this package, and back.

OpenCV, COLMAP and Metashape give the distorted position in terms of the undistorted one (`geometry.brown`); the camera
here gives the undistorted one in terms of the distorted one, as Tsai wrote it. Neither is the exact inverse of the
other, so that a lens is converted by a least-squares fit of its lens terms over the whole picture, and what the fit
leaves is measured in px. The focal length and the principal point are kept, as they mean the same in both, where the
terms alone come within 0.02 px; where they do not (decentring with strong distortion), f, Sx, the principal point and a
turn of the camera about its own centre are fitted with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.brown import BrownLens, changed, distorted, undistorted
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    project,
    straightened,
    undistorted_from_distorted,
)
from vidtrack.geometry.jacobian import PARAMETERS, derivatives, stepped
from vidtrack.geometry.lens_terms import EQUIDISTANT, LENS_MODELS, TERMS
from vidtrack.geometry.projection import Projection, equidistant_from_perspective

CLOSE_PX = 0.02
"""px, largest error over the picture from which a plainer lens model is taken; centroids err more."""

GRID = 33
"""Positions along each side of the picture at which lenses are compared; the corners are among them."""


class Converted(NamedTuple):
    """A camera whose lens is that of a `BrownLens`.

    model       the lens model, one of LENS_MODELS
    largest_px  the largest distance between the two lenses over the picture; rms_px its root mean square
    worst       (Xf, Yf) px, where it lies
    covered     the share of the picture where the lens given has a line of sight
    """

    camera: Camera
    model: str
    largest_px: float
    rms_px: float
    worst: tuple[float, float]
    covered: float


class ConvertedBack(NamedTuple):
    """A lens whose distortion is that of a camera, and how far they differ over the picture."""

    lens: BrownLens
    largest_px: float
    rms_px: float


def camera_from_brown(
    lens: BrownLens,
    *,
    dx: float = 1.0,
    dy: float = 1.0,
    R: ArrayLike | None = None,
    T: ArrayLike | None = None,
    model: str = "auto",
    name: str = "",
) -> Converted:
    """The camera with this lens.

    dx, dy  mm, pitch of columns and rows where a sensor is given; 1 gives f in px
    R, T    its attitude and place, c = R p + T; default: at the world's origin, looking along z. Where a turn is
            fitted the camera's R is turned by it; its centre stays
    model   one of LENS_MODELS; auto: the plainest that comes within 0.02 px of the lens everywhere, else the nearest
    Raises ValueError where the lens has no line of sight at all, or where fx or fy is not positive.
    """
    if not (lens.fx > 0 and lens.fy > 0):
        raise ValueError(f"fx and fy must be positive, not {lens.fx:g} and {lens.fy:g}")
    b = _grid(lens.image_size)
    x = undistorted(lens, b)
    seen = np.asarray(np.isfinite(x).all(-1))
    if seen.sum() < 100:
        raise ValueError("the lens has no line of sight over most of the picture: are its coefficients in this order?")
    b, x = b[seen], x[seen]
    f = lens.fy * dy
    start = Camera(
        *(lens.cx, lens.cy, dx, dy, lens.fx * dx / f, f, 0.0),
        np.eye(3) if R is None else np.asarray(R, float),
        np.zeros(3) if T is None else np.asarray(T, float),
        image_size=lens.image_size,
        skew=lens.skew * dx / f,
        name=name,
    )
    candidates = []
    for each in LENS_MODELS if model == "auto" else (model,):
        if lens.skew and "skew" not in LENS_MODELS[each] and model == "auto":
            continue
        candidates.append(_compared(_fitted(start, each, b, x * f), each, b, x, seen, start))
        if candidates[-1].largest_px <= CLOSE_PX:
            return candidates[-1]
    turned = [_compared(_adjusted(each.camera, each.model, b, x), each.model, b, x, seen, start) for each in candidates]
    for done in turned:
        if done.largest_px <= CLOSE_PX:
            return done
    return min([*candidates, *turned], key=lambda done: done.largest_px)


def _compared(camera: Camera, model: str, b: Array, x: Array, seen: NDArray[np.bool_], start: Camera) -> Converted:
    """How far a camera at the origin is from the lens that sees x (n, 2) at b (n, 2) px; it gets the place of start."""
    projected = project(camera, _unit_depth(x))
    off = np.linalg.norm(projected - b, axis=-1)
    off = np.where(np.isfinite(off), off, np.inf)
    worst = b[int(off.argmax())]
    placed = camera.with_(R=camera.R @ start.R, T=camera.R @ start.T)
    rms = float(np.sqrt(np.mean(off**2)))
    return Converted(placed, model, float(off.max()), rms, (float(worst[0]), float(worst[1])), float(seen.mean()))


def _unit_depth(x: Array) -> Array:
    return np.concatenate([x, np.ones((len(x), 1))], -1)


def _adjusted(placed: Camera, model: str, b: Array, x: Array) -> Camera:
    """The camera at the origin whose f, Sx, principal point, turn and lens terms come nearest to the lens, in px."""
    free = ("omega_x", "omega_y", "omega_z", "f", "Sx", "Cx", "Cy", *LENS_MODELS[model])
    columns = [PARAMETERS.index(name) for name in free]
    camera, p, origin = placed.with_(R=np.eye(3), T=np.zeros(3)), _unit_depth(x), np.zeros(3)
    cost = float(((project(camera, p) - b) ** 2).sum())
    for _ in range(20):
        at = derivatives(camera, p, origin)
        if not np.isfinite(cost):
            break
        J = at.by_parameter[..., columns].reshape(-1, len(free))
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        if not (np.isfinite(J).all() and np.isfinite(scale).all()):
            break
        step = np.linalg.lstsq(J / scale, (b - at.projected).reshape(-1), rcond=1e-9)[0] / scale
        try:
            trial = stepped(camera, origin, dict(zip(free, step.tolist(), strict=True)))
        except ValueError:  # f or Sx would turn negative
            break
        found = float(((project(trial, p) - b) ** 2).sum())
        if not found < cost * (1 - 1e-4):
            break
        camera, cost = trial, found
    return camera


def _fitted(start: Camera, model: str, b: Array, u: Array) -> Camera:
    """The camera at the origin whose lens terms lead from b (n, 2) px nearest to undistorted u (n, 2), unit of dx."""
    projection: Projection = "equidistant" if model in EQUIDISTANT else "perspective"
    target = equidistant_from_perspective(u, start.f) if projection == "equidistant" else u
    start = start.with_(projection=projection, R=np.eye(3), T=np.zeros(3))
    d = distorted_from_frame_buffer(start, b)
    names = [name for name in LENS_MODELS[model] if name in TERMS]
    r2 = (d**2).sum(-1)
    A = np.stack([np.stack(TERMS[name].shift(d[:, 0], d[:, 1], r2), -1) for name in names], -1)  # (n, 2, k)
    terms = np.zeros(len(names))
    for _ in range(3):  # the error counts in the picture, where it is that of u, divided by the lens's own slope
        slope = _slope(start.with_(**dict(zip(names, terms.tolist(), strict=True))), d)
        left = np.linalg.solve(slope, (target - d)[..., None])[..., 0].reshape(-1)
        columns = np.linalg.solve(slope, A).reshape(-1, len(names))
        scale = np.linalg.norm(columns, axis=0)
        scale[scale == 0] = 1.0
        terms = np.linalg.lstsq(columns / scale, left, rcond=None)[0] / scale
    return start.with_(**dict(zip(names, terms.tolist(), strict=True)))


def _slope(camera: Camera, d: Array) -> Array:
    """d(u)/d(d), (n, 2, 2), by differences; the identity where the lens folds."""
    h = 1e-6 * float(np.abs(d).max())
    steps = [np.array([h, 0.0]), np.array([0.0, h])]
    J = np.stack([(straightened(camera, d + s) - straightened(camera, d - s)) / (2 * h) for s in steps], -1)
    good = np.isfinite(J).all((-1, -2)) & (np.abs(np.linalg.det(np.nan_to_num(J))) > 0.05)
    return np.where(good[:, None, None], J, np.eye(2))


def brown_from_camera(camera: Camera, *, radial: int = 3, tangential: bool = True) -> ConvertedBack:
    """The lens of a camera from undistorted to distorted, by least squares over the picture.

    radial      how many radial terms, k1 and on: OpenCV's standard five coefficients have 3, its fisheye 4
    tangential  whether p1 and p2 are estimated as well (fisheye lenses have none)
    A camera with an equidistant projection becomes a fisheye lens. Where the terms alone do not come within 0.02 px,
    fx, fy, cx and cy move as well; the camera's attitude is the same in both.
    """
    f = camera.f
    fisheye = camera.projection == "equidistant"
    b = _grid(camera.image_size)
    d = distorted_from_frame_buffer(camera, b)
    u = undistorted_from_distorted(camera, d)
    seen = np.isfinite(u).all(-1)
    d, u, b = d[seen] / f, u[seen] / f, b[seen]
    x = equidistant_from_perspective(u, 1.0) if fisheye else u
    r2 = (x**2).sum(-1, keepdims=True)
    columns = [x * r2**n for n in range(1, radial + 1)]
    if tangential and not fisheye:
        X, Y = x[:, 0], x[:, 1]
        columns.append(np.stack([2 * X * Y, r2[:, 0] + 2 * Y * Y], -1))
        columns.append(np.stack([r2[:, 0] + 2 * X * X, 2 * X * Y], -1))
    A = np.stack(columns, -1).reshape(-1, len(columns))
    scale = np.linalg.norm(A, axis=0)
    terms = np.linalg.lstsq(A / scale, (d - x).reshape(-1), rcond=None)[0] / scale
    p1, p2 = terms[radial:] if len(terms) > radial else (0.0, 0.0)
    lens = BrownLens(
        *(camera.Sx * f / camera.dx, f / camera.dy, camera.Cx, camera.Cy, camera.image_size),
        k=tuple(terms[:radial].tolist()),
        p1=float(p1),
        p2=float(p2),
        skew=camera.skew * f / camera.dx,
        fisheye=fisheye,
    )
    names = ["fx", "fy", "cx", "cy", *(f"k{n}" for n in range(1, radial + 1)), *(("p1", "p2") if p1 or p2 else ())]
    lens = _polished(lens, names, u, b)
    off = np.linalg.norm(distorted(lens, u) - b, axis=-1)
    return ConvertedBack(lens, float(off.max()), float(np.sqrt(np.mean(off**2))))


def _polished(lens: BrownLens, names: list[str], u: Array, b: Array) -> BrownLens:
    """The lens, its named numbers moved so that it sees u (n, 2) nearest to b (n, 2) px; kept where it is near."""
    for _ in range(5):
        left = b - distorted(lens, u)
        if np.linalg.norm(left, axis=-1).max() <= CLOSE_PX:
            break
        steps = [1e-3 * max(lens.fx, 1.0) if name in ("fx", "fy", "cx", "cy") else 1e-3 for name in names]
        moved = [
            distorted(changed(lens, name, h), u) - distorted(changed(lens, name, -h), u)
            for name, h in zip(names, steps, strict=True)
        ]
        J = np.stack([m.reshape(-1) / (2 * h) for m, h in zip(moved, steps, strict=True)], -1)
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        if not (np.isfinite(J).all() and np.isfinite(scale).all()):
            break
        step = np.linalg.lstsq(J / scale, left.reshape(-1), rcond=1e-9)[0] / scale
        trial = lens
        for name, by in zip(names, step.tolist(), strict=True):
            trial = changed(trial, name, by)
        if not ((b - distorted(trial, u)) ** 2).sum() < (1 - 1e-4) * (left**2).sum():
            break
        lens = trial
    return lens


def _grid(image_size: tuple[int, int]) -> Array:
    """Frame buffer px (n, 2) over the whole picture, its edges included."""
    width, height = image_size
    X, Y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID), np.linspace(-0.5, height - 0.5, GRID))
    return np.stack([X.ravel(), Y.ravel()], -1)


def inner_covariance(
    lens: BrownLens, sd: Mapping[str, float], model: str, *, dx: float = 1.0, dy: float = 1.0
) -> tuple[tuple[str, ...], Array]:
    """The covariance (k, k) of f, Sx, Cx, Cy and the lens terms that standard deviations of a lens's numbers mean.

    sd  by name: fx, fy, cx, cy (px), k1, k2 and on, p1, p2
    The names of its rows come first. Numbers without a standard deviation count as known.
    Raises ValueError for a name that the lens does not have.
    """
    names = ("f", "Sx", "Cx", "Cy", *(n for n in LENS_MODELS[model] if n in TERMS))

    def values(moved: BrownLens) -> Array:
        camera = camera_from_brown(moved, dx=dx, dy=dy, model=model).camera
        return np.array([getattr(camera, name) for name in names])

    columns = []
    for name, error in sd.items():
        plus, minus = (changed(lens, name, sign * 0.1 * error) for sign in (1, -1))
        columns.append((values(plus) - values(minus)) / 0.2)
    J = np.stack(columns, -1) if columns else np.zeros((len(names), 0))
    return names, np.asarray(J @ J.T)
