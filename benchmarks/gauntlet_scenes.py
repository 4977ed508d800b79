"""Random scenes at the level of detections: trajectories in space, and the tracklets that cameras make of them.

A scene is made of a kind and a seed. Each camera sees every target as a disc: noise, drops, occlusion, merging of
discs that touch, clutter, blind stretches. A model of a follower makes tracklets that never change their target: they
end at meetings, at gaps of more than two samples, and where another thing is near while the target is not seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.tracklets import LONGEST_GAP, Tracklets, tracklets_of
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.simulate.rig import look_at, position_from_angles

CLUTTER = -1
"""Owner of a tracklet that shows no target."""
NEAR = 2.5
"""Diameters: another disc so near while the target is not seen leaves its identity open."""


@dataclass(frozen=True)
class Plan:
    """What a kind of scene has; m and s, px and samples."""

    targets: tuple[int, int] = (2, 12)
    cameras: tuple[int, int] = (2, 4)
    samples: tuple[int, int] = (150, 300)
    rate: float = 30.0
    motion: str = "wander"
    speed: float = 1.0  # times the usual speed of about 0.6 m/s
    noise: tuple[float, float] = (0.02, 0.15)
    drop: float = 0.0
    blind: str = ""  # one: a camera is blind for a while; all: all of them are
    late: bool = False  # targets come late
    leave: bool = False  # targets leave for good
    reach: float = 1.0  # times the volume that all cameras see; more: out of the picture and back
    clutter: int = 0  # things that stand in each picture and are no target
    moving: int = 0  # things that move in each picture and are no target
    post: bool = False  # a post hides part of each picture
    flicker: bool = False
    offset: float = 0.0  # samples, by which cameras start apart
    radius: float = 4.0  # px
    known: bool = True  # the number of targets is stated


KINDS: dict[str, Plan] = {
    "one": Plan(targets=(1, 1)),
    "few": Plan(targets=(2, 4)),
    "wanderers": Plan(targets=(5, 15)),
    "bodies": Plan(motion="bodies", targets=(3, 12)),
    "waves": Plan(motion="waves", targets=(3, 12)),
    "fast": Plan(speed=4.0, targets=(2, 8)),
    "slow starts": Plan(motion="slow", targets=(2, 8)),
    "at rest, then moving": Plan(motion="release", targets=(2, 8)),
    "thrown": Plan(motion="thrown", targets=(2, 8)),
    "late comers": Plan(late=True, known=False),
    "leavers": Plan(leave=True, known=False),
    "out and back": Plan(reach=1.8, targets=(2, 6)),
    "a camera blind": Plan(blind="one"),
    "all blind": Plan(blind="all", targets=(2, 8), motion="waves"),
    "random drops": Plan(drop=0.15),
    "crossings in one view": Plan(motion="crossing", targets=(4, 12)),
    "passing in space": Plan(motion="passing", targets=(2, 6)),
    "clutter that stands": Plan(clutter=8),
    "clutter that moves": Plan(moving=12),
    "behind a post": Plan(post=True),
    "dim": Plan(noise=(0.3, 0.5), drop=0.08, radius=3.0),
    "dark": Plan(noise=(0.1, 0.3), drop=0.03, clutter=3, moving=3),
    "flickering": Plan(flicker=True),
    "clocks not locked": Plan(offset=6.0, targets=(3, 12)),
    "interlaced": Plan(rate=59.94, samples=(200, 400)),
    "many, two cameras": Plan(targets=(25, 35), cameras=(2, 2), known=False),
    "many": Plan(targets=(40, 50), cameras=(3, 4)),
    "sixty": Plan(targets=(60, 60), cameras=(4, 4), samples=(300, 500)),
    "all of it": Plan(late=True, drop=0.05, clutter=4, moving=4, post=True, blind="one", known=False),
}
"""Kinds of scenes by name."""


class View(NamedTuple):
    """What one camera makes of a scene."""

    camera: Camera
    t: Array  # (M,) s, when its samples truly are
    tracklets: Tracklets
    owner: Ints  # (n_tracklets,) the target of each; CLUTTER
    seen: Bools  # (K, M) whether the target is measured alone


class Scene(NamedTuple):
    """A scene with the truth."""

    name: str
    views: list[View]
    truth: Callable[[Array], Array]  # times (m,) s -> (K, m, 3) m
    present: Callable[[Array], Bools]  # times (m,) -> (K, m)
    targets: int | None  # what the user states
    noise: float  # px
    diameter: float  # m
    locked: bool
    rate: float


def scene(kind: str, seed: int) -> Scene:
    """The scene of a kind and a seed."""
    plan = KINDS[kind]
    rng = np.random.default_rng([seed, *kind.encode()])
    K = int(rng.integers(plan.targets[0], plan.targets[1] + 1))
    M = int(rng.integers(plan.samples[0], plan.samples[1] + 1))
    cameras = rig(int(rng.integers(plan.cameras[0], plan.cameras[1] + 1)), rng)
    noise = float(rng.uniform(*plan.noise))
    length = M / plan.rate
    course = _course(plan, K, length, cameras, rng)
    begin, end = np.zeros(K), np.full(K, np.inf)
    if plan.late:
        begin = np.where(rng.random(K) < 0.5, rng.uniform(0.1, 0.6, K) * length, 0.0)
    if plan.leave:
        end = np.where(rng.random(K) < 0.5, rng.uniform(0.4, 0.9, K) * length, np.inf)
    dark = _blind(plan, M, len(cameras), rng)
    views = []
    for i, camera in enumerate(cameras):
        shift = float(rng.uniform(-plan.offset, plan.offset)) if plan.offset and i else 0.0
        t = (np.arange(M) + shift) / plan.rate
        there = (t >= begin[:, None]) & (t < end[:, None])
        views.append(_view(camera, t, course(t), there, ~dark[i], plan, noise, rng))
    depth = float(np.median([np.linalg.norm(c.position) for c in cameras]))
    diameter = 2 * plan.radius * depth / cameras[0].f
    known = K if plan.known else None

    def present(t: Array) -> Bools:
        return (t >= begin[:, None]) & (t < end[:, None])

    return Scene(f"{kind} {seed}", views, course, present, known, noise, diameter, not plan.offset, plan.rate)


def rig(n: int, rng: np.random.Generator) -> list[Camera]:
    """n cameras about the origin that see a ball of 1 m radius there, 720 x 480 px, at least 25 degrees apart."""
    pan = np.sort(rng.uniform(0, 200, n))
    while n > 1 and np.min(np.diff(pan)) < 25:
        pan = np.sort(rng.uniform(0, 200, n))
    out = []
    for i, angle in enumerate(rng.permutation(pan)):
        distance, tilt = rng.uniform(3, 5), rng.uniform(5, 50)
        aim = rng.normal(0, 0.05, 3)
        place = position_from_angles(aim, pan_deg=float(angle), tilt_deg=float(tilt), distance=float(distance))
        R = look_at(place, aim, roll_deg=float(rng.normal(0, 2)))
        f = 225.0 * distance  # px: 1 m about the middle is 225 px
        k = -0.05 / f**2
        out.append(Camera(359.5, 239.5, 1.0, 1.0, 1.0, f, k, R, -R @ place, (720, 480), name=f"cam{i + 1}"))
    return out


def _course(
    plan: Plan, K: int, length: float, cameras: list[Camera], rng: np.random.Generator
) -> Callable[[Array], Array]:
    """Where the targets are: times (m,) -> (K, m, 3), m."""
    room = 0.8 * plan.reach
    if plan.motion == "bodies":
        return _bodies(K, rng)
    if plan.motion == "thrown":
        return _thrown(K, length, rng)
    terms = 4
    low, high = (0.3, 1.5) if plan.motion == "waves" else (0.05, 0.35)
    hz = rng.uniform(low, high, (K, terms, 3)) * plan.speed
    amplitude = rng.uniform(0.2, 1.0, (K, terms, 3)) * (0.12 if plan.motion == "waves" else 0.25) * plan.reach
    if plan.motion == "waves":  # all ride on the same waves
        hz = np.broadcast_to(rng.uniform(low, high, (1, terms, 1)), hz.shape)
    phase = rng.uniform(0, 2 * np.pi, (K, terms, 3))
    middle = _inside(K, room, rng)
    start = rng.uniform(0.1, 0.6, K) * length

    def clock(t: Array) -> Array:
        """The motion's own time (K, m)."""
        since = t - start[:, None]
        if plan.motion == "release":
            return np.maximum(since, 0.0)
        if plan.motion == "slow":
            return np.where(since > 0, np.maximum(since, 0) ** 2 / (np.maximum(since, 0) + 1.0), 0.0)
        return np.broadcast_to(t, since.shape)

    def course(t: Array) -> Array:
        own = clock(np.asarray(t, float))[:, :, None, None]
        waves = amplitude[:, None] * np.sin(2 * np.pi * hz[:, None] * own + phase[:, None])
        return np.asarray(middle[:, None] + waves.sum(2))

    if plan.motion in ("crossing", "passing"):
        return _meeting(plan.motion, course, length, cameras[0], rng, K)
    return course


def _inside(K: int, room: float, rng: np.random.Generator) -> Array:
    """Places (K, 3) in a flattened ball, apart from each other where there is room."""
    places: list[Array] = []
    gap = 0.25
    while len(places) < K:
        p = rng.uniform(-1, 1, 3)
        p = p * (room, room, 0.6 * room)
        if np.linalg.norm(p / (1, 1, 0.6)) < room and all(np.linalg.norm(p - q) > gap for q in places):
            places.append(p)
        gap *= 0.995
    return np.array(places)


def _bodies(K: int, rng: np.random.Generator) -> Callable[[Array], Array]:
    """Rigid bodies of three or four targets that ride on waves."""
    body = np.arange(K) // 3
    n = int(body.max()) + 1
    at = _inside(n, 0.7, rng)
    arm = rng.normal(0, 0.12, (K, 3))
    hz, phase = rng.uniform(0.3, 1.5, (n, 6)), rng.uniform(0, 2 * np.pi, (n, 6))
    swing = rng.uniform(0.3, 1.0, (n, 6)) * (0.15, 0.1, 0.1, 0.3, 0.3, 0.2)

    def course(t: Array) -> Array:
        q = swing * np.sin(2 * np.pi * hz * t[:, None, None] + phase)  # (m, n, 6)
        w = q[..., 3:]
        angle = np.linalg.norm(w, axis=-1, keepdims=True)
        axis = w / np.maximum(angle, 1e-12)
        v, u, a = arm[None], axis[:, body], angle[:, body]
        turned = v * np.cos(a) + np.cross(u, v) * np.sin(a) + u * np.sum(u * v, -1, keepdims=True) * (1 - np.cos(a))
        return np.asarray(np.swapaxes(at[body] + q[:, body, :3] + turned, 0, 1))

    return course


def _thrown(K: int, length: float, rng: np.random.Generator) -> Callable[[Array], Array]:
    """Balls that fly on parabolas and bounce on a floor."""
    period = rng.uniform(0.7, 1.2, K)
    begin, phase = _inside(K, 0.6, rng), rng.uniform(0, 1, K)
    drift = rng.uniform(-0.6, 0.6, (K, 2)) / max(length, 1.0)

    def course(t: Array) -> Array:
        s = (t / period[:, None] + phase[:, None]) % 1.0
        height = 9.81 / 2 * period[:, None] ** 2 * s * (1 - s)
        across = begin[:, None, :2] + drift[:, None] * t[:, None]
        return np.concatenate([across, (height - 0.7)[..., None]], -1)

    return course


def _meeting(
    motion: str, course: Callable[[Array], Array], length: float, camera: Camera, rng: np.random.Generator, K: int
) -> Callable[[Array], Array]:
    """Pairs are brought together at a moment: in space, or on one line of sight of the first camera."""
    when = rng.uniform(0.25, 0.75, K // 2) * length

    def with_meetings(t: Array) -> Array:
        p = course(t)
        for k, moment in enumerate(when):
            a, b = 2 * k, 2 * k + 1
            there = course(np.array([moment]))[:, 0]
            to = there[a] + (0.12 * _away(there[a], camera) if motion == "crossing" else [0.03, 0.02, 0.02])
            pull = np.exp(-(((t - moment) / 1.5) ** 2))[:, None]
            p[b] = p[b] + pull * (to - there[b])
        return p

    return with_meetings


def _away(p: Array, camera: Camera) -> Array:
    """The direction (3,) of the camera's line of sight through p."""
    d = p - camera.position
    return np.asarray(d / np.linalg.norm(d))


def _blind(plan: Plan, M: int, n: int, rng: np.random.Generator) -> Bools:
    """(n_cameras, M): the camera sees nothing."""
    dark = np.zeros((n, M), bool)
    if plan.blind:
        first = int(rng.integers(M // 4, M // 2))
        last = first + int(rng.integers(M // 10, M // 4)) if plan.blind == "one" else first + int(rng.integers(8, 25))
        dark[int(rng.integers(n)) if plan.blind == "one" else slice(None), first:last] = True
    return dark


def _view(
    camera: Camera,
    t: Array,
    p: Array,
    there: Bools,
    open_: Bools,
    plan: Plan,
    noise: float,
    rng: np.random.Generator,
) -> View:
    """What a camera sees of targets p (K, M, 3), and its tracklets."""
    K, M = p.shape[:2]
    b = project(camera, p)
    shown = there & open_ & np.nan_to_num(contains(camera, b, plan.radius)).astype(bool)
    if plan.post:
        at, width = rng.uniform(150, 570), rng.uniform(20, 60)
        shown &= np.abs(b[..., 0] - at) > width / 2 + plan.radius
    if plan.flicker:
        on = np.ones((K, M), bool)
        for k in range(K):
            for first in rng.integers(0, M, max(1, M // 40)):
                on[k, first : first + int(rng.integers(1, 6))] = False
        shown &= on
    discs, owners = [b], [np.arange(K)]
    shows = [shown]
    if plan.clutter:
        place = rng.uniform((20, 20), (700, 460), (plan.clutter, 1, 2))
        discs.append(np.repeat(place, M, axis=1))
        shows.append(np.repeat(open_[None], plan.clutter, 0))
    if plan.moving:
        discs.append(_flies(plan.moving, t, rng))
        life = rng.integers(10, 80, plan.moving)
        first = rng.integers(0, M, plan.moving)
        at = np.arange(M)
        alive = (at >= first[:, None]) & (at < (first + life)[:, None])
        shows.append(alive & open_ & contains(camera, discs[-1], plan.radius))
    owners.append(np.full(sum(len(d) for d in discs[1:]), CLUTTER))
    disc, show, owner = np.concatenate(discs), np.concatenate(shows), np.concatenate(owners)
    reach = 2.1 * plan.radius
    apart = np.full((len(disc), M), np.inf)
    for k in range(len(disc)):
        d = np.linalg.norm(disc - disc[k], axis=-1)
        d[~show] = np.inf
        d[k] = np.inf
        apart[k] = d.min(0)
    dropped = rng.random(show.shape) < plan.drop
    alone = show & (apart > reach) & ~dropped
    measured = disc + rng.normal(0, noise, disc.shape)
    number, sample, which = [], [], []
    n = 0
    for k in range(len(disc)):
        rows = np.flatnonzero(alone[k])
        if not rows.size:
            continue
        near = np.cumsum(apart[k] < NEAR * 2 * plan.radius)
        gap = np.diff(rows)
        broken = (gap > LONGEST_GAP + 1) | ((gap > 1) & (near[rows[1:] - 1] > near[rows[:-1]]))
        broken |= np.diff(np.cumsum(show[k] & (apart[k] <= reach))[rows]) > 0
        broken |= rng.random(gap.size) < 0.002
        part = np.concatenate([[0], np.cumsum(broken)])
        number.append(n + part)
        sample.append(rows)
        which.append(np.full(part[-1] + 1, owner[k]))
        n += part[-1] + 1
    if n:
        rows = np.concatenate(sample)
        disc_of = np.concatenate([np.full(len(s), k) for s, k in zip(sample, _used(alone), strict=True)])
        tracklets = tracklets_of(np.concatenate(number), rows, measured[disc_of, rows], np.full((rows.size, 2), noise))
        owned = np.concatenate(which)
    else:
        tracklets, owned = tracklets_of([], np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros((0, 2))), np.zeros(0, int)
    order = rng.permutation(tracklets.n)
    return View(camera, t, _reordered(tracklets, order), owned[order], alone[:K])


def _used(alone: Bools) -> list[int]:
    return [k for k in range(len(alone)) if alone[k].any()]


def _reordered(tracklets: Tracklets, order: Ints) -> Tracklets:
    """The same tracklets in another order."""
    rank = np.empty(len(order), np.intp)
    rank[order] = np.arange(len(order))
    return tracklets_of(rank[tracklets.owner], tracklets.sample, tracklets.b, tracklets.sd)


def _flies(n: int, t: Array, rng: np.random.Generator) -> Array:
    """Things that fly before a camera: places (n, M, 2), px."""
    hz, phase = rng.uniform(0.2, 1.0, (n, 3, 2)), rng.uniform(0, 2 * np.pi, (n, 3, 2))
    size = rng.uniform(20, 80, (n, 3, 2))
    middle = rng.uniform((60, 60), (660, 420), (n, 2))
    own = t[None, :, None, None]
    return np.asarray(middle[:, None] + (size[:, None] * np.sin(2 * np.pi * hz[:, None] * own + phase[:, None])).sum(2))
