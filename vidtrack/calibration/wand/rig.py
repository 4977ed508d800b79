"""All cameras of a waved wand, roughly: the best pair first, then every other camera by what is already located.

A camera that joins sees balls whose places are known by now, and Tsai's closed form gives its lens and place
(`calibration.tsai`), for either order of its balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.calibration.adjustment.adjust import minimise
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.calibration.wand.ends import chosen, complete, orders
from vidtrack.calibration.wand.measured import Views, Wand, wand_problem, wand_state
from vidtrack.calibration.wand.pairs import SETTINGS as PAIRS
from vidtrack.calibration.wand.pairs import Pair, Start, find_pair, starts
from vidtrack.calibration.wand.wide import focal_trials, plain_camera, resected, straightened_px
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points


class RigSettings(NamedTuple):
    """How the cameras are joined."""

    moments: int = 150
    """Moments that the rough adjustments use at most."""
    candidates: int = 4
    """Pairs of focal lengths that are adjusted."""
    agree: float = 0.01
    """Share of the picture's width within which a camera that joins must see the balls."""
    fewest: int = 12
    """Moments by which a camera joins."""
    enough: float = 0.002
    """Share of the picture's width below which a pair fits well enough not to look for a better one."""


SETTINGS = RigSettings()
FREE = free_parameters("tsai", ("Sx", "Cx", "Cy"))
RADIAL_SD, LOG_F_SD = 0.15, 0.7
"""ASSUME: of distortion at the side of the picture, and of a focal length about one and a half picture widths."""


class Rig(NamedTuple):
    """Cameras in the axes of the first of them."""

    cameras: tuple[Camera, ...]
    b: Array  # (m, n, q, 2) px, each ball in the place of its end
    points: Array  # (n, q, 3) world units; NaN where fewer than two cameras see the wand


def find_rig(
    b: Array,
    stretch: Ints,
    nominal: Sequence[Camera],
    wand: Wand,
    f: Sequence[tuple[float, ...] | None],
    rng: np.random.Generator,
) -> Rig:
    """Cameras from what they saw of a wand.

    b        (m, n, q, 2) px, balls in any order that is the same within a stretch
    stretch  (n,) number of the stretch of each moment (see `ends`)
    nominal  cameras of which Cx, Cy, dx, dy and the size count
    f        of each camera the focal lengths to try (unit of dx); None: a ladder
    Raises ValueError with a line that says which cameras do not fit together.
    """
    tried = [own or tuple(g * c.image_size[0] * c.dx for g in PAIRS.f) for own, c in zip(f, nominal, strict=True)]
    ways = orders(wand.lengths)
    found: _FirstPair | None = None
    problem = ValueError("no two cameras see the wand at enough common moments so that they fit together")
    for f_tried in focal_trials(tried, nominal):
        flat = [straightened_px(own, c, g[0]) for own, c, g in zip(b, nominal, f_tried, strict=True)]
        pairs = _pairs(flat, nominal, stretch, ways, rng)
        try:
            trial = _first(b, flat, nominal, wand, f_tried, pairs, ways) if pairs else None
        except ValueError as error:
            problem = error
            continue
        if trial is not None and (found is None or trial.error < found.error):
            found = trial
        if found is not None and found.error < SETTINGS.enough * nominal[0].image_size[0]:
            break
    if found is None:
        raise problem
    joined, arranged, points = found.cameras, found.b, found.points
    while len(joined) < len(b):
        k = max((i for i in range(len(b)) if i not in joined), key=lambda i: _shared(b[i], points))
        if _shared(b[k], points) < SETTINGS.fewest:
            raise ValueError(f"camera {k} sees the wand at too few moments at which two others see it")
        camera, arranged[k] = _join(b[k], nominal[k], points, stretch, ways, rng, k)
        joined[k] = camera
        joined, points = _adjusted(joined, arranged, points, wand)
    cameras = [joined[i] for i in range(len(b))]
    return Rig(*_in_axes_of_the_first(cameras, arranged, points))


class _FirstPair(NamedTuple):
    """The pair from which the rig grows."""

    error: float  # px
    cameras: dict[int, Camera]
    b: Array  # (m, n, q, 2), balls of the pair in order
    points: Array


def _pairs(
    flat: Sequence[Array],
    nominal: Sequence[Camera],
    stretch: Ints,
    ways: list[tuple[int, ...]],
    rng: np.random.Generator,
) -> list[tuple[int, int, Pair]]:
    """Pairs of cameras that fit together, those with the most moments first."""
    found = []
    for i, j in combinations(range(len(flat)), 2):
        width = max(nominal[i].image_size[0], nominal[j].image_size[0])
        pair = find_pair(flat[i], flat[j], stretch, ways, width, rng)
        if pair is not None:
            found.append((i, j, pair))
    return sorted(found, key=lambda each: -int(each[2].inlier.sum()))


def _first(
    b: Array,
    flat: Sequence[Array],
    nominal: Sequence[Camera],
    wand: Wand,
    f: Sequence[tuple[float, ...]],
    pairs: Sequence[tuple[int, int, Pair]],
    ways: list[tuple[int, ...]],
) -> _FirstPair:
    """The pair that fits best among those with the most moments, adjusted, its balls in order, and where they were."""
    best: tuple[float, dict[int, Camera], Array, Array] | None = None
    for i, j, pair in pairs[:4]:
        arranged = b.copy()
        arranged[j] = _arranged(b[j], pair.order, ways)
        order = _arranged(flat[j], pair.order, ways)
        ladder = tuple(g / nominal[i].dx for g in f[i]), tuple(g / nominal[j].dx for g in f[j])
        none = np.zeros(2)
        guesses = starts(pair, flat[i], order, wand.lengths, (none, none), ladder)
        for guess in guesses[: SETTINGS.candidates]:
            cameras = {i: plain_camera(nominal[i], guess.f[0], np.eye(3), np.zeros(3)), j: _second(nominal[j], guess)}
            points = np.where(pair.inlier[:, None, None], guess.points, np.nan)
            points *= _scale(points, wand)
            try:
                found, located = _adjusted(cameras, arranged, points, wand)
            except (ValueError, np.linalg.LinAlgError):
                continue
            error = _error(found, arranged, located, wand)
            if best is None or error < best[0]:
                best = error, found, arranged, located
        if best is not None and best[0] < SETTINGS.enough * nominal[0].image_size[0]:
            break
    if best is None:
        raise ValueError("no focal lengths make the wand equally long at all moments")
    return _FirstPair(*best)


def _scale(points: Array, wand: Wand) -> float:
    i, j, _ = wand.pairs[0]
    apart = np.linalg.norm(points[:, i] - points[:, j], axis=-1)
    return float(wand.lengths[i, j] / np.nanmedian(apart))


def _second(nominal: Camera, guess: Start) -> Camera:
    return plain_camera(nominal, guess.f[1], guess.R, guess.t)


def _arranged(b: Array, order: Ints, ways: list[tuple[int, ...]]) -> Array:
    return np.take_along_axis(b, np.array(ways)[order][..., None], 1)


def _adjusted(cameras: dict[int, Camera], b: Array, points: Array, wand: Wand) -> tuple[dict[int, Camera], Array]:
    """The cameras after a rough adjustment, and where they locate the balls. The first camera stays where it is."""
    some = list(cameras)
    known = np.flatnonzero(complete(points))
    rows = known[np.linspace(0, len(known) - 1, min(SETTINGS.moments, len(known))).astype(int)]
    views = Views(b[some][:, rows], np.ones(1), np.zeros(1))
    views = views._replace(sd=np.ones(views.b.shape), velocity=np.zeros(views.b.shape))
    free = [FREE[6:], *[FREE] * (len(some) - 1)]
    priors = [rough_priors(cameras[i]) for i in some]
    own = wand._replace(sd=0.0, play=0.003 * float(wand.lengths.max()))
    problem = wand_problem(views, points[rows], own, free, priors, scaled=False)
    state = wand_state([cameras[i] for i in some], points[rows], own)
    found = minimise(problem, state, max_steps=40, tolerance=1e-4).cameras
    return dict(zip(some, found, strict=True)), located(found, b[some])


def rough_priors(camera: Camera) -> dict[str, tuple[float, float]]:
    """What is known of any lens: it distorts little, and is neither fisheye nor telescope."""
    half = camera.image_size[0] * camera.dx / 2
    width = 2 * half
    return {"kappa1": (0.0, RADIAL_SD / half**2), "f": (1.5 * width, 4 * LOG_F_SD * width)}


def located(cameras: Sequence[Camera], b: Array) -> Array:
    """Balls (n, q, 3) from their sights (m, n, q, 2); NaN where fewer than two cameras see one."""
    return np.asarray(locate_points(cameras, b, sd=1.0).point)


def _error(cameras: dict[int, Camera], b: Array, points: Array, wand: Wand) -> float:
    """Median distance of the sights from the located balls, px, and what the lengths lack, as px."""
    some = list(cameras)
    off = np.concatenate([np.linalg.norm(project(cameras[i], points) - b[i], axis=-1).ravel() for i in some])
    i, j, _ = wand.pairs[0]
    apart = np.linalg.norm(points[:, i] - points[:, j], axis=-1) - wand.lengths[i, j]
    depth = float(np.nanmedian([(points @ c.R.T + c.T)[..., 2] for c in cameras.values()]))
    px = np.nanmedian(np.abs(apart)) * cameras[some[0]].f / cameras[some[0]].dx / depth
    return float(np.nanmedian(off) + px) if np.isfinite(off).sum() > len(off) / 4 else np.inf


def _shared(b: Array, points: Array) -> int:
    return int((complete(b) & complete(points)).sum())


def _join(
    b: Array,
    nominal: Camera,
    points: Array,
    stretch: Ints,
    ways: list[tuple[int, ...]],
    rng: np.random.Generator,
    number: int,
) -> tuple[Camera, Array]:
    """A camera that sees balls whose places are known, and its balls in order."""
    both = complete(b) & complete(points)
    counts = np.bincount(stretch[both], minlength=stretch.max() + 1)
    best: tuple[float, Camera] | None = None
    tolerance = (SETTINGS.agree * nominal.image_size[0]) ** 2
    for where in np.argsort(-counts)[:3]:
        rows = np.flatnonzero(both & (stretch == where))
        if len(rows) < 6:
            continue
        for way in ways:
            camera = resected(points[rows].reshape(-1, 3), b[rows][:, list(way)].reshape(-1, 2), nominal, rng)
            if camera is None:
                continue
            _, each = chosen(_sight_costs(camera, b, points, both, ways), stretch, tolerance)
            total = float(np.minimum(np.nan_to_num(each[both], nan=tolerance), tolerance).mean())
            if best is None or total < best[0]:
                best = total, camera
    if best is None or best[0] > 0.5 * tolerance:
        raise ValueError(f"camera {number} does not fit the others: nothing that it sees agrees with the wand's places")
    camera = best[1]
    for _ in range(3):
        order, each = chosen(_sight_costs(camera, b, points, both, ways), stretch, tolerance)
        arranged = _arranged(b, order, ways)
        rows = np.flatnonzero(both & (np.nan_to_num(each, nan=np.inf) < tolerance))
        again = resected(points[rows].reshape(-1, 3), arranged[rows].reshape(-1, 2), nominal, rng)
        camera = again or camera
    return camera, arranged


def _sight_costs(camera: Camera, b: Array, points: Array, both: Bools, ways: list[tuple[int, ...]]) -> Array:
    seen = project(camera, points)
    cost = [((b[:, list(way)] - seen) ** 2).sum(-1).mean(-1) for way in ways]
    return np.where(both, np.stack(cost), np.nan)


def _in_axes_of_the_first(
    cameras: Sequence[Camera], b: Array, points: Array
) -> tuple[tuple[Camera, ...], Array, Array]:
    R, T = cameras[0].R, cameras[0].T
    moved = tuple(c.with_(R=c.R @ R.T, T=c.T - c.R @ R.T @ T) for c in cameras)
    return moved, b, points @ R.T + T
