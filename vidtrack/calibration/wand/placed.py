"""A rig that knows only itself, brought into the world's axes, with what is uncertain of those axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.adjust import Adjusted
from vidtrack.calibration.adjustment.measurements import CameraPriors, Sights
from vidtrack.calibration.adjustment.unknowns import Family, columns
from vidtrack.calibration.camera.refine import POSE, free_parameters
from vidtrack.calibration.wand import axes as world
from vidtrack.calibration.wand.judged import LIMITS, Axes
from vidtrack.calibration.wand.measured import Wand
from vidtrack.calibration.wand.refined import Refined, refine_further
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import derivatives
from vidtrack.geometry.triangulate import locate_points

PICK_SD = 0.5
"""px, ASSUME: of a point that was picked by hand."""


class Marks(NamedTuple):
    """Points that cameras see, m cameras and n points.

    seen      (m, n, 2) px; NaN where a camera lacks one
    sd        (m, n, 2) px
    p, sigma  (n, 3) and (n,) world units, where the points are surveyed
    """

    tags: tuple[str, ...]
    seen: Array
    sd: Array
    p: Array | None = None
    sigma: Array | None = None

    def at(self, some: Array) -> Marks:
        rows = np.flatnonzero(some)
        tags = tuple(self.tags[k] for k in rows)
        p = None if self.p is None else self.p[rows]
        sigma = None if self.sigma is None else self.sigma[rows]
        return Marks(tags, self.seen[:, rows], self.sd[:, rows], p, sigma)


class Placed(NamedTuple):
    """The rig in the world's axes."""

    cameras: tuple[Camera, ...]
    free: tuple[tuple[str, ...], ...]  # of each camera, the parameters that `joint` is of
    pivot: Array
    joint: Array  # covariance of all cameras' free parameters
    adjusted: Adjusted
    points: Array  # (n, q, 3) the balls
    axes: Axes


def placed(
    done: Refined,
    wand: Wand,
    *,
    surveyed: Marks | None = None,
    picked: Marks | None = None,
    axes: Mapping[str, Any] | str | None = None,
    fall: world.Fall | None = None,
) -> Placed:
    """The rig in axes that surveyed points, or directions between picked points, or a falling ball give.

    axes   None: the surveyed points where there are any, else the fall, else the first camera's own axes; a word: the
           first camera's; else {origin, x, y, up: tags, level: tags}
    Raises ValueError where they leave the axes open.
    """
    if isinstance(axes, str) or (axes is None and surveyed is None and fall is None):
        K = done.problem.unknowns.cameras[-1][0].stop
        joint = done.found.covariance[:K, :K]
        kind = Axes("camera", explicit=isinstance(axes, str), fall=fall)
        unknowns = done.problem.unknowns
        return Placed(done.cameras, unknowns.free, unknowns.pivot, joint, done.found, done.points, kind)
    if axes is None and surveyed is not None:
        return _by_points(done, wand, surveyed, fall)
    return _by_directions(done, picked, {} if axes is None else dict(axes), fall)


def _by_points(done: Refined, wand: Wand, marks: Marks, fall: world.Fall | None) -> Placed:
    """Surveyed points and the wand together: the points' sights and tolerance join the adjustment."""
    marks = marks.at(np.isfinite(marks.seen).all(-1).sum(0) >= 2)
    m = len(done.cameras)
    assert marks.p is not None
    assert marks.sigma is not None
    where = locate_points(done.cameras, marks.seen, sd=marks.sd).point
    motion = world.fitted(where, marks.p)
    agree = same_unit(motion, wand)
    held: Wand = wand if agree else wand._replace(sd=0.1 * float(wand.lengths.max()))
    near = motion if agree else world.fitted(where, marks.p, with_scale=True)
    with np.errstate(divide="ignore"):
        family = Family(3, marks.p, np.repeat(1 / marks.sigma[:, None] ** 2, 3, 1))
    sights = [Sights(i, marks.seen[i][:, None], marks.sd[i][:, None], family=1) for i in range(m)]
    priors = next(each.priors for each in done.problem.measurements if isinstance(each, CameraPriors))
    cameras, ends = world.moved(done.cameras, near), world.moved_points(done.points, near)
    free = _with_places(done)
    found, problem = refine_further(done, held, [family], sights, [marks.p], free, priors, cameras, ends)
    each = np.stack([np.nan_to_num(np.abs(own)).max(-1) for own in found.normalised[-m:]])
    kind = Axes("points", explicit=True, fall=fall, motion=motion, tags=marks.tags, off=each.max(0))
    K = problem.unknowns.cameras[-1][0].stop
    points = found.state.blocks[0].reshape(ends.shape)
    joint = found.covariance[:K, :K]
    return Placed(found.state.cameras, problem.unknowns.free, problem.unknowns.pivot, joint, found, points, kind)


def same_unit(motion: world.Motion, wand: Wand) -> bool:
    """Whether the survey and the wand have one unit of length, within what is known of both."""
    sd = np.hypot(motion.scale_sd, wand.sd / float(wand.lengths.max()))
    return bool(abs(motion.scale - 1) < max(LIMITS.scale * sd, LIMITS.scale_share))


def _with_places(done: Refined) -> list[tuple[str, ...]]:
    """All that is free of each camera when its place is: the first camera's place was the world's before."""
    every = free_parameters(done.model)
    return [tuple(name for name in every if name in own or name in POSE) for own in done.problem.unknowns.free]


def _by_directions(done: Refined, marks: Marks | None, axes: dict[str, Any], fall: world.Fall | None) -> Placed:
    """Directions between picked points: a rigid motion, and its covariance by what the picks may be off."""
    tags = marks.tags if marks else ()
    if marks:
        located = locate_points(done.cameras, marks.seen, sd=marks.sd)
        places, spread = located.point, located.covariance
    else:
        places, spread = np.zeros((0, 3)), np.zeros((0, 3, 3))
    motion, kind = _motion(done, dict(zip(tags, places, strict=True)), axes, fall)
    old = done.problem.unknowns
    pivot = world.moved_points(old.pivot, motion)
    free = _with_places(done)

    def moves(changed: Array) -> Array:
        other, _ = _motion(done, dict(zip(tags, changed, strict=True)), axes, fall)
        turn = other.R @ motion.R.T
        epsilon = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        return np.concatenate([epsilon, world.moved_points(old.pivot, other) - pivot])

    cameras = world.moved(done.cameras, motion)
    turned = np.zeros((sum(map(len, free)), 6))
    for camera, (place, _) in zip(cameras, columns(free), strict=True):
        turned[place.start : place.start + 3, :3] = -camera.R
        turned[place.start + 3 : place.start + 6, 3:] = -camera.R
    J = turned @ _followed(moves, places, spread)
    # the marks are located by these cameras, and err as they do: what both have in common moves with the axes
    own = np.eye(len(turned)) + (J @ _located_by(done, free, marks, places) if marks else 0.0)
    picks = sum((J[:, 3 * k : 3 * k + 3] @ np.nan_to_num(C) @ J[:, 3 * k : 3 * k + 3].T for k, C in enumerate(spread)))
    joint = own @ _expanded(done, free) @ own.T + picks
    points = world.moved_points(done.points, motion)
    heading = kind != "x, y" and not axes.get("x") and not axes.get("y")
    found = Axes(kind, explicit=True, fall=fall, heading=heading)
    return Placed(cameras, tuple(free), pivot, joint, done.found, points, found)


def _expanded(done: Refined, free: Sequence[tuple[str, ...]]) -> Array:
    """The covariance with the first camera's place in it, which was exact in its own axes."""
    K = sum(len(names) for names in free)
    first = len(free[0]) - len(done.problem.unknowns.free[0])
    joint = np.zeros((K, K))
    joint[first:, first:] = done.found.covariance[: K - first, : K - first]
    return joint


def _followed(moves: Callable[[Array], Array], places: Array, spread: Array) -> Array:
    """How a motion (6,) follows the points (n, 3) that give it, (6, 3 n), by small steps of each."""
    J = np.zeros((6, 3 * len(places)))
    for k in range(len(places)):
        if np.isfinite(spread[k]).all():
            for axis in range(3):
                step = 1e-3 * float(np.sqrt(spread[k, axis, axis]))
                changed = places.copy()
                changed[k, axis] += step
                J[:, 3 * k + axis] = moves(changed) / step
    return J


def _located_by(done: Refined, free: Sequence[tuple[str, ...]], marks: Marks, places: Array) -> Array:
    """How located points (n, 3) follow the cameras' free parameters, (3 n, K): dp = -(B^T W B)^-1 B^T W A dk."""
    n, where = len(places), columns(free)
    N, BA = np.zeros((n, 3, 3)), np.zeros((n, 3, where[-1][0].stop))
    for i, (place, parameters) in enumerate(where):
        at = derivatives(done.cameras[i], places, done.problem.unknowns.pivot)
        seen = np.isfinite(marks.seen[i]).all(-1) & np.isfinite(at.projected).all(-1)
        B = np.where(seen[:, None, None], at.by_point, 0.0) / marks.sd[i][..., None]
        A = np.where(seen[:, None, None], at.by_parameter[..., parameters], 0.0) / marks.sd[i][..., None]
        N += B.swapaxes(-1, -2) @ B
        BA[..., place] = B.swapaxes(-1, -2) @ A
    known = np.isfinite(places).all(-1)
    N[~known], BA[~known] = np.eye(3), 0.0
    return np.asarray(-np.linalg.solve(N, BA).reshape(3 * n, -1))


def _motion(
    done: Refined, places: Mapping[str, Array], axes: Mapping[str, Any], fall: world.Fall | None
) -> tuple[world.Motion, str]:
    def place(tag: str) -> Array:
        if tag not in places or not np.isfinite(places[tag]).all():
            raise ValueError(f"point {tag} is not seen in two cameras (picks.csv of the wand's clip)")
        return np.asarray(places[tag])

    def along(key: str) -> Array | None:
        return place(str(axes[key][1])) - place(str(axes[key][0])) if axes.get(key) else None

    up, kind = along("up"), "up"
    if axes.get("level"):
        middle = np.mean([c.position for c in done.cameras], 0)
        up, kind = world.normal_of(np.stack([place(str(tag)) for tag in axes["level"]]), middle), "level"
    elif up is None and fall is not None:
        up, kind = -fall.acceleration, "drop"
    first = next((axes[key] for key in ("x", "y", "up", "level") if axes.get(key)), None)
    if axes.get("origin"):
        origin = place(str(axes["origin"]))
    else:
        origin = place(str(first[0])) if first else done.cameras[0].position
    motion = world.from_directions(origin, up=up, x=along("x"), y=along("y"), heading=done.cameras[0].R[0])
    return motion, kind if up is not None else "x, y"
