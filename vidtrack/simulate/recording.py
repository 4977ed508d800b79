"""What one camera records of a moving scene: its frames at its own times, with shutter, fields and losses.

A camera's time is the true time less its clock's correction: what config.yaml adds to it gives true time again.
The exposure is centred on the frame's time (ASSUME), so that blur smears a target without moving it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, camera_from_world, project
from vidtrack.simulate.lamp import CONTOURS, Lamp, lit_parts
from vidtrack.simulate.picture import Levels, Picture, Scene, developed, paint
from vidtrack.simulate.plan import NotNegative, Plan
from vidtrack.simulate.render import fine_enough, outlines, shading, softened, vertices_needed


class Clock(Plan):
    """What must be added to a camera's time to make it true, as in config.yaml."""

    offset_s: float = 0.0
    rate_ppm: float = Field(0.0, description="parts per million by which the camera's time runs slow")


class Shutter(Plan):
    """How the light is gathered."""

    open_s: NotNegative = Field(0.001, description="s, length of the exposure (thesis: 1/1000 s)")
    samples: Annotated[int, Field(ge=1)] = Field(3, description="pictures averaged over the exposure")
    readout_s: float = Field(
        0.0,
        description="s from the exposure of the first row to that of the last; a ball is drawn as its rows see it",
    )


class Actor(NamedTuple):
    """A ball in a scene: where its centre is at times (n,) s, (n, 3); its radius; its grey level where it is brightest;
    when it is hidden; what lights it from one side."""

    path: Callable[[Array], Array]
    radius: float
    level: float
    hidden: Sequence[tuple[float, float]] = ()  # s, true time, from and to
    lamp: Lamp | None = None


Interlace = Literal["none", "top", "bottom"]
"""Which field of a frame is exposed first: that of the rows 0, 2, 4, ... (top), the other, or both at once."""

CHUNK = 128
"""Frames whose balls are drawn in one go: bounds the memory, changes nothing else."""

NO_SMEAR = 0.2
"""px; a ball that travels less during the exposure is drawn in one place: its width changes by 0.003 px^2 or less."""

MEMORY = 20_000_000
"""Bounds the number of large outlines drawn in one go; a piece has about n_vertices^2 / 6 fine pixels."""


def true_times(labels: Array, clock: Clock) -> Array:
    """True times (n,), s, of frames that a camera labels with these times (n,), s: its clock's error taken out."""
    first = labels[:1] if len(labels) else labels
    return np.asarray(labels + clock.offset_s + clock.rate_ppm * 1e-6 * (labels - first))


def exposures(times: Array, rate: Fraction, interlace: Interlace) -> list[tuple[int | None, Array]]:
    """Which field (0 top, 1 bottom; None: both) is exposed at which times (n,): the second half a frame later."""
    if interlace == "none":
        return [(None, times)]
    first = 0 if interlace == "top" else 1
    return [(first, times), (1 - first, times + float(1 / (2 * rate)))]


def frames(
    camera: Camera,
    empty: Scene,
    actors: Sequence[Actor],
    times: Array,
    *,
    picture: Picture,
    shutter: Shutter,
    rate: Fraction,
    interlace: Interlace,
    rng: np.random.Generator,
    moving: Callable[[float], Camera] | None = None,
    wall: Callable[[Camera], Scene] | None = None,
) -> Iterator[Levels]:
    """The frames (height, width) that a camera records at true times (n,), s, of balls before an empty scene.

    empty     (height, width) grey levels, from `picture.empty_scene`
    actors    balls; a nearer one hides a farther one
    moving    the camera at each time, where it moves; wall: what the background behind `empty` adds, by the camera
    """
    size = CHUNK if moving is None else 1
    for begin in range(0, len(times), size):
        chunk = times[begin : begin + size]
        if moving is not None:
            camera = moving(float(chunk[0]))
        behind = empty if wall is None else empty + wall(camera)
        fields = [
            (field, _pieces(camera, actors, when, picture, shutter))
            for field, when in exposures(chunk, rate, interlace)
        ]
        for k, t in enumerate(chunk):
            scene = behind.copy()
            for field, pieces in fields:
                for share, left, top, level in pieces[k]:
                    paint(scene, share, left, top, level, field)
            yield developed(picture, scene, float(t), rng)


class Piece(NamedTuple):
    """A ball as one picture shows it: the share of each pixel that it fills, where, and its grey level."""

    share: Array
    left: int
    top: int
    level: float


def _pieces(
    camera: Camera, actors: Sequence[Actor], times: Array, picture: Picture, shutter: Shutter
) -> list[list[Piece]]:
    """For each time, the balls in view, the farthest first."""
    drawn: list[list[tuple[float, Piece]]] = [[] for _ in times]
    for actor in actors:
        depth = camera_from_world(camera, actor.path(times))[:, 2]
        shown = depth > 0
        for begin, end in actor.hidden:
            shown &= (times < begin) | (times >= end)
        at = np.flatnonzero(shown)
        seen = _row_times(camera, actor, times[at], shutter.readout_s)
        lean = _lean(camera, actor, seen, shutter.readout_s) if shutter.readout_s else None
        for k, piece in zip(at, drawn_ball(camera, actor, seen, picture, shutter, lean), strict=True):
            drawn[k].append((float(depth[k]), piece))
    return [[piece for _, piece in sorted(row, key=lambda entry: -entry[0])] for row in drawn]


def _row_times(camera: Camera, actor: Actor, times: Array, readout_s: float) -> Array:
    """When (n,), s, the row in which a ball's centre lies is exposed, in frames whose first row is at times (n,)."""
    seen = times
    for _ in range(6 if readout_s else 0):  # where it is depends on when, and converges as balls are slower than rows
        row = project(camera, actor.path(seen))[:, 1]
        seen = times + np.where(np.isfinite(row), readout_s * (row + 0.5) / camera.image_size[1], 0.0)
    return seen


def _lean(camera: Camera, actor: Actor, times: Array, readout_s: float) -> Array:
    """px (n, 2) by which a row of the picture shows a ball further on than the row above it does, at times (n,)."""
    step = 1e-3
    ahead, behind = (project(camera, actor.path(times + late)) for late in (step, -step))
    return np.nan_to_num((ahead - behind) / (2 * step)) * readout_s / camera.image_size[1]


def _leaning(outline: Array, centre: Array, lean: Array) -> Array:
    """Outlines (n, ..., 2) px of balls about centres (n, 2) as rows see them that are exposed one after the other."""
    along = tuple(range(1, outline.ndim - 1))
    further, down = (np.expand_dims(lean[:, i], along) for i in (0, 1))
    off = outline[..., 1] - np.expand_dims(centre[:, 1], along)
    later = off / (1 - down)  # rows below the middle, as they are seen
    return np.stack([outline[..., 0] + further * later, outline[..., 1] + down * later], -1)


def drawn_ball(
    camera: Camera, actor: Actor, times: Array, picture: Picture, shutter: Shutter, lean: Array | None = None
) -> list[Piece]:
    """A ball as it looks at times (n,): smeared over the exposure, shaded toward the rim, blurred; lean: of `_lean`."""
    m = shutter.samples if _smear(camera, actor, times, shutter.open_s) > NO_SMEAR else 1
    station = shutter.open_s * ((np.arange(m) + 0.5) / m - 0.5)
    centres = actor.path((times[:, None] + station).ravel()).reshape(len(times), m, 1, 3)
    if len(times) > 1 and not np.ptp(centres, axis=0).any():  # it stays where it is: draw it once
        return drawn_ball(camera, actor, times[:1], picture, shutter) * len(times)
    drawn, weights = _contours(camera, actor, picture)
    n_vertices = vertices_needed(camera, centres, actor.radius) * (1 if actor.lamp is None else 2)
    block = max(1, MEMORY // n_vertices**2)
    pieces = []
    for begin in range(0, len(times), block):
        polygons = drawn(centres[begin : begin + block], n_vertices)
        while not fine_enough(polygons):  # far outside the picture a lens stretches them
            polygons = drawn(centres[begin : begin + block], 2 * polygons.shape[-2])
        if lean is not None:
            middle = project(camera, actor.path(times[begin : begin + block]))
            polygons = _leaning(polygons, middle, lean[begin : begin + block])
        polygons = polygons.reshape(len(polygons), -1, *polygons.shape[-2:])
        patches = softened(polygons, picture.blur_px, np.tile(weights / m, m))
        pieces += [
            Piece(patches.coverage[k], int(patches.left[k]), int(patches.top[k]), actor.level)
            for k in range(len(polygons))
        ]
    return pieces


def _contours(camera: Camera, actor: Actor, picture: Picture) -> tuple[Callable[[Array, int], Array], Array]:
    """What draws the contours of light of a ball at centres (..., 1, 3) with so many vertices, and their weights."""
    radii, weights = shading(picture.limb)
    if actor.lamp is None:
        return lambda at, n: outlines(camera, at, actor.radius * radii, n), weights
    lamp, share = actor.lamp, 1 - actor.lamp.share

    def lit(at: Array, n: int) -> Array:
        parts = lit_parts(camera, at[..., 0, :], actor.radius, lamp, n)
        return np.concatenate([outlines(camera, at, actor.radius * radii, n), parts], axis=-3)

    return lit, np.concatenate([share * weights, np.full(CONTOURS, lamp.share / CONTOURS)])


def _smear(camera: Camera, actor: Actor, times: Array, open_s: float) -> float:
    """How far, px, a ball's image travels at most while the shutter is open."""
    ends = [project(camera, actor.path(times + side * open_s / 2)) for side in (-1, 1)]
    return float(np.nanmax(np.abs(ends[1] - ends[0]), initial=0.0))
