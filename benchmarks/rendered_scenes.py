"""Random scenes drawn as pictures: what 2 to 4 cameras record of balls in space, with the circumstances of a kind.

A ball is a disc about the middle of its outline (of the cone of rays that touch it) with the area of that, opaque,
nearer ones before farther ones, its edge that of a Gaussian blur seen by pixels. Motion blur is the mean over stations
of the exposure, which is centred on the sample's time. Pictures are made when they are asked for and never written: no
codec stands between the scene and the tracker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from gauntlet_scenes import Plan as Course
from gauntlet_scenes import _course as course_of
from gauntlet_scenes import rig
from scipy.special import ndtr

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import Camera, camera_from_world, contains, project
from vidtrack.timing.frame import Frame, VideoInfo

RATE = Fraction(30)
SEEN_SHARE = 0.6
"""Share of a ball's disc that must be visible to count as seen by a camera."""
OVERLAP = 0.6
"""Share of a diameter by which two balls may overlap and both still count as seen."""


@dataclass(frozen=True)
class Look:
    """What a kind of scene looks like; px, grey levels, samples."""

    targets: tuple[int, int] = (2, 6)
    cameras: tuple[int, int] = (2, 4)
    samples: int = 80
    motion: str = "wander"  # as in gauntlet_scenes; `grazing`: pairs that touch in some view
    speed: float = 1.0
    reach: float = 1.0
    radius: tuple[float, float] = (3.5, 6.0)
    alike: bool = True  # all balls of one size
    blur: float = 0.7
    noise: tuple[float, float] = (1.5, 4.0)
    level: float = 30.0
    contrast: tuple[float, float] = (120.0, 190.0)
    shutter: float = 0.0  # share of a sample that it is open
    gradient: float = 0.0  # grey levels from one side of the picture to the other
    texture: float = 0.0  # grey levels, sd of a still, smooth background
    flicker: float = 0.0  # share by which each ball's light swings
    glitter: int = 0  # bright spots a picture on the water, each of a few samples
    ropes: int = 0  # still ropes before the scene
    rope_level: float = 8.0
    rope_width: float = 3.0
    mirror: float = 0.0  # share of a ball's contrast that its image below the water has
    still: int = 0  # bright things of the static clutter
    moving: int = 0  # bright things that move about, each seen by one camera
    blind: bool = False  # one camera is covered for a while
    late: bool = False
    leave: bool = False
    offset: float = 0.0  # samples, by which one camera is late
    interlaced: bool = False
    boxes: float = 0.0  # px, width of start boxes; 0: none are given
    known: bool = True


LOOKS: dict[str, Look] = {
    "one": Look(targets=(1, 1)),
    "few": Look(),
    "bodies": Look(motion="bodies", targets=(3, 6)),
    "waves": Look(motion="waves"),
    "fast": Look(speed=4.0),
    "thrown": Look(motion="thrown", targets=(2, 4)),
    "slow starts": Look(motion="slow"),
    "at rest, then moving": Look(motion="release"),
    "tiny": Look(radius=(1.3, 2.0), noise=(1.0, 2.5)),
    "large": Look(radius=(25.0, 40.0), targets=(1, 3), cameras=(2, 3)),
    "larger than its box": Look(radius=(35.0, 65.0), targets=(1, 1), boxes=50.0, cameras=(2, 2), reach=0.5),
    "of several sizes": Look(radius=(2.5, 14.0), alike=False),
    "dim": Look(contrast=(22.0, 28.0), noise=(2.5, 2.5)),
    "dark": Look(level=180.0, contrast=(-150.0, -90.0)),
    "saturated": Look(level=60.0, contrast=(260.0, 400.0)),
    "flickering": Look(flicker=0.35),
    "motion blur": Look(shutter=0.9, speed=4.0),
    "uneven light": Look(gradient=60.0, texture=4.0),
    "behind a dark rope": Look(ropes=4, rope_level=8.0),
    "behind a bright rope": Look(ropes=4, rope_level=150.0),
    "behind a mast": Look(ropes=2, rope_level=5.0, rope_width=7.0, radius=(5.0, 9.0)),
    "glitter": Look(glitter=120),
    "mirror images": Look(mirror=0.5, targets=(1, 3)),
    "clutter that stands": Look(still=6),
    "clutter that moves": Look(moving=4),
    "grazing": Look(motion="grazing", targets=(2, 6)),
    "many": Look(targets=(25, 30), cameras=(3, 4), radius=(3.0, 4.0), samples=60),
    "a camera blind": Look(blind=True, cameras=(3, 4)),
    "late comers": Look(late=True, known=False),
    "leavers": Look(leave=True, known=False),
    "interlaced": Look(interlaced=True),
}
"""Kinds of scenes by name."""


class Shot(NamedTuple):
    """What one camera records of a scene; M samples (two a frame where it is interlaced)."""

    camera: Camera
    t: Array  # (M,) s, when its samples truly are
    frames: Callable[[], Iterator[Frame]]
    info: VideoInfo
    seen: Bools  # (K, M) whether a ball can be measured
    place: Array  # (K, M, 2) px
    box: Array | None  # (K, 4) middle, width and height of start boxes, px


class Scene(NamedTuple):
    """A scene with the truth."""

    name: str
    shots: list[Shot]
    truth: Callable[[Array], Array]  # times (m,) s -> (K, m, 3) m
    present: Callable[[Array], Bools]  # times (m,) -> (K, m)
    others: Callable[[Array], Array]  # times (m,) -> (L, m, 3) m: what may be located besides (mirror images)
    targets: int
    known: bool
    dark: bool
    diameter: float  # m
    look: Look


def scene(kind: str, seed: int) -> Scene:
    """The scene of a kind and a seed."""
    look = LOOKS[kind]
    rng = np.random.default_rng([seed, *kind.encode()])
    K = int(rng.integers(look.targets[0], look.targets[1] + 1))
    cameras = rig(int(rng.integers(look.cameras[0], look.cameras[1] + 1)), rng)
    M = look.samples * (2 if look.interlaced else 1)
    rate = float(RATE) * (2 if look.interlaced else 1)
    length = M / rate
    course = _grazing(K, length, cameras, rng) if look.motion == "grazing" else course_of(
        Course(motion=look.motion, speed=look.speed, reach=look.reach), K, length, cameras, rng
    )  # fmt: skip
    size = rng.uniform(*look.radius, K)  # px at the middle of the scene
    if look.alike:
        size[:] = size[0]
    contrast = rng.uniform(*look.contrast) * np.ones(K)
    begin, end = np.full(K, -np.inf), np.full(K, np.inf)
    if look.late:
        begin = np.where(rng.random(K) < 0.5, rng.uniform(0.2, 0.6, K) * length, -np.inf)
    if look.leave:
        end = np.where(rng.random(K) < 0.5, rng.uniform(0.4, 0.8, K) * length, np.inf)
    ball = size / 225.0  # m, radius: rig() sees 1 m as 225 px
    water = -0.55

    def present(t: Array) -> Bools:
        return (t >= begin[:, None]) & (t < end[:, None])

    def mirrored(t: Array) -> Array:
        p = course(t)
        return p * (1, 1, -1) + (0, 0, 2 * water)

    def others(t: Array) -> Array:
        return mirrored(t) if look.mirror else np.zeros((0, t.size, 3))

    blind = int(rng.integers(len(cameras))) if look.blind else -1
    dark = (M // 3, M // 3 + 30)
    shots = []
    for i, camera in enumerate(cameras):
        t = (np.arange(M) + (look.offset if i == 1 else 0.0)) / rate
        things = [_Thing(course, ball, contrast, present)]
        if look.mirror:
            things.append(_Thing(mirrored, ball, look.mirror * contrast, present))
        drawing = _Drawing(look, camera, things, t, dark if i == blind else None, int(rng.integers(1 << 30)))
        shots.append(drawing.shot())
    is_dark, diameter = look.contrast[0] < 0, 2 * float(ball.min())
    return Scene(f"{kind} {seed}", shots, course, present, others, K, look.known, is_dark, diameter, look)


def _grazing(K: int, length: float, cameras: list[Camera], rng: np.random.Generator) -> Callable[[Array], Array]:
    """Pairs of balls that come near each other as the first camera sees them, and stay there for a while."""
    base = course_of(Course(), K, length, cameras, rng)
    eye = cameras[0].position
    when = rng.uniform(0.4, 0.6, K) * length
    swing = rng.uniform(0.025, 0.06, K)
    away = rng.normal(0, 0.25, (K, 3))

    def course(t: Array) -> Array:
        p = base(t)
        for k in range(1, K, 2):
            partner = p[k - 1]
            sight = partner - eye
            depth = np.linalg.norm(sight, axis=-1, keepdims=True)
            side = np.cross(sight, (0.0, 0.0, 1.0))
            side /= np.linalg.norm(side, axis=-1, keepdims=True)
            beside = partner + sight / depth * 0.25 + side * swing[k] * np.cos(3 * (t - when[k]))[:, None]
            beside += np.array([0.0, 0.0, 0.035])
            share = np.exp(-(((t - when[k]) / (0.3 * length)) ** 2))[:, None]
            p[k] = share * beside + (1 - share) * (partner + away[k])
        return p

    return course


class _Thing(NamedTuple):
    """Balls (n,): where, radius m, grey levels above the background, when they are there."""

    course: Callable[[Array], Array]
    radius: Array
    contrast: Array
    present: Callable[[Array], Bools]


class _Drawing:
    """Draws what one camera sees."""

    def __init__(
        self, look: Look, camera: Camera, things: list[_Thing], t: Array, dark: tuple[int, int] | None, seed: int
    ) -> None:
        self.look, self.camera, self.t, self.dark = look, camera, t, dark
        self.rng = np.random.default_rng(seed)
        self.things = things
        self.size = camera.image_size
        stations = 1 if not look.shutter else 12
        self.stations = look.shutter / float(RATE) * ((np.arange(stations) + 0.5) / stations - 0.5)
        p = things[0].course(t)
        depth = camera_from_world(camera, p)[..., 2]
        self.place, self.radius = _outline(camera, p, things[0].radius[:, None])
        self.noise = float(self.rng.uniform(*look.noise))
        self.base = self._base()
        self.ropes = [self._rope() for _ in range(look.ropes)]
        self.cover, self.rope_paint = self._covers()
        self.spots = self._glitter()
        self.flies = self._flies()
        n = len(p)
        self.phase, self.hz = self.rng.uniform(0, 2 * np.pi, n), self.rng.uniform(0.5, 6.0, n)
        self.seen = self._seen(p, depth)

    def shot(self) -> Shot:
        width, height = self.size
        order = "top" if self.look.interlaced else "progressive"
        info = VideoInfo(width, height, RATE, field_order=order)
        box = None
        if self.look.boxes:
            size = np.full((len(self.place), 2), self.look.boxes)
            box = np.concatenate([self.place[:, 0], size], axis=1)
        return Shot(self.camera, self.t, self.frames, info, self.seen, self.place, box)

    def frames(self) -> Iterator[Frame]:
        rng = np.random.default_rng(int(self.rng.integers(1 << 30)))
        width, height = self.size
        grains = rng.normal(0, self.noise, (6, height + 64, width + 64)).astype(np.float32)
        step = 2 if self.look.interlaced else 1
        for k in range(0, self.t.size, step):
            picture = self._light(k)
            if step == 2:
                picture[1::2] = self._light(k + 1)[1::2]
            y, x = rng.integers(0, 64, 2)
            picture = picture + grains[k % 6, y : y + height, x : x + width]
            luma = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
            yield Frame(k // step, Fraction(k // step) / RATE, luma, False, None)

    def _light(self, k: int) -> Array:
        """The picture of sample k before noise."""
        if self.dark and self.dark[0] <= k < self.dark[1]:
            return np.full(self.base.shape, 12.0, np.float32)
        out = np.zeros_like(self.base)
        for late in self.stations:
            out += self._moment(k, self.t[k] + late)
        out /= len(self.stations)
        for x, y, radius, light in self.spots[k]:
            _paint(out, x, y, radius, 0.6, None, light)
        return out

    def _moment(self, k: int, t: float) -> Array:
        picture = self.base.copy()
        at = np.array([t])
        balls = []
        for thing in self.things:
            p = thing.course(at)[:, 0]
            there = thing.present(at)[:, 0]
            depth = camera_from_world(self.camera, p)[:, 2]
            b, radius = _outline(self.camera, p, thing.radius)
            light = thing.contrast * (1 + self.look.flicker * np.sin(2 * np.pi * self.hz * t + self.phase))
            balls += [(depth[i], *b[i], radius[i], light[i]) for i in range(len(p)) if there[i]]
        for _, x, y, radius, light in sorted(balls, key=lambda ball: -ball[0]):
            _paint(picture, x, y, radius, self.look.blur, self.look.level + light, None)
        for x, y, radius, light in self.flies(t):
            _paint(picture, x, y, radius, self.look.blur, self.look.level + light, None)
        if self.cover is not None:
            picture += self.cover * (self.rope_paint - picture)
        return picture

    def _base(self) -> Array:
        import cv2

        width, height = self.size
        base = np.full((height, width), self.look.level, np.float32)
        base += np.float32(self.look.gradient) * (np.arange(width, dtype=np.float32) / width - 0.5)
        if self.look.texture:
            rough = cv2.GaussianBlur(self.rng.normal(0, 1, base.shape).astype(np.float32), (0, 0), 6)
            base += rough / rough.std() * np.float32(self.look.texture)
        for _ in range(self.look.still):
            x, y = self.rng.uniform((30, 30), (width - 30, height - 30))
            radius = self.rng.uniform(3, 7)
            _paint(base, x, y, radius, self.look.blur, self.look.level + self.rng.uniform(60, 190), None)
        return base

    def _rope(self) -> tuple[float, float, float]:
        """A line: a point on it, and its direction."""
        width, height = self.size
        angle = self.rng.uniform(-0.5, 0.5) + (np.pi / 2 if self.rng.random() < 0.7 else 0.0)
        return self.rng.uniform(0.25, 0.75) * width, self.rng.uniform(0.3, 0.7) * height, angle

    def _covers(self) -> tuple[Array | None, float]:
        """The share of each pixel that ropes cover, and their grey level."""
        if not self.ropes:
            return None, 0.0
        width, height = self.size
        y, x = np.mgrid[:height, :width].astype(np.float32)
        cover = np.zeros((height, width), np.float32)
        for x0, y0, angle in self.ropes:
            off = np.abs((x - x0) * np.sin(angle) - (y - y0) * np.cos(angle))
            own = ndtr((self.look.rope_width / 2 - off) / np.hypot(self.look.blur, 0.29))
            cover = 1 - (1 - cover) * (1 - own.astype(np.float32))
        return cover, self.look.rope_level

    def _glitter(self) -> list[list[tuple[float, float, float, float]]]:
        """Spots (x, y, radius, light) of each sample, on the lower two thirds of the picture."""
        M, n = self.t.size, self.look.glitter
        spots: list[list[tuple[float, float, float, float]]] = [[] for _ in range(M)]
        if not n:
            return spots
        width, height = self.size
        for _ in range(int(n * M / 2.2)):
            first, lasts = int(self.rng.integers(M)), int(self.rng.choice([1, 1, 2, 2, 3, 4]))
            x, y = self.rng.uniform(0, width), self.rng.uniform(height / 3, height)
            radius, light = self.rng.uniform(0.8, 2.8), self.rng.uniform(40, 220)
            drift = self.rng.normal(0, 0.7, 2)
            for j in range(first, min(M, first + lasts)):
                spots[j].append((x + drift[0] * (j - first), y + drift[1] * (j - first), radius, light))
        return spots

    def _flies(self) -> Callable[[float], list[tuple[float, float, float, float]]]:
        n = self.look.moving
        hz, phase = self.rng.uniform(0.2, 1.0, (n, 3, 2)), self.rng.uniform(0, 2 * np.pi, (n, 3, 2))
        size = self.rng.uniform(20, 70, (n, 3, 2))
        middle = self.rng.uniform((80, 80), (640, 400), (n, 2))
        light, radius = self.rng.uniform(80, 190, n), self.rng.uniform(3, 6, n)

        def at(t: float) -> list[tuple[float, float, float, float]]:
            where = middle + (size * np.sin(2 * np.pi * hz * t + phase)).sum(axis=1)
            return [(*where[i], radius[i], light[i]) for i in range(n)]

        return at

    def _seen(self, p: Array, depth: Array) -> Bools:
        """Which balls can be measured in which samples: whole in the picture, most of them to be seen."""
        M = depth.shape[1]
        seen = self.things[0].present(self.t) & np.asarray(contains(self.camera, self.place, 1.0), bool)
        margin = self.radius + 3
        width, height = self.size
        x, y = self.place[..., 0], self.place[..., 1]
        seen &= (x > margin) & (y > margin) & (x < width - 1 - margin) & (y < height - 1 - margin)
        if self.dark:
            seen[:, self.dark[0] : self.dark[1]] = False
        discs = [(self.place, self.radius, self.things[0].present(self.t))]
        for thing in self.things[1:]:
            q = thing.course(self.t)
            discs.append((*_outline(self.camera, q, thing.radius[:, None]), thing.present(self.t)))
        flies = [self.flies(t) for t in self.t]
        if self.look.moving:
            other = np.array(flies)  # (M, n, 4)
            discs.append((other[..., :2].swapaxes(0, 1), other[..., 2].T, np.ones(other.shape[1::-1], bool)[:, :M]))
        for j, (place, radius, there) in enumerate(discs):
            for i in range(len(place)):
                off = np.linalg.norm(self.place - place[i], axis=-1)
                gap = off - (self.radius + radius[i]) + 2 * OVERLAP * np.minimum(self.radius, radius[i])
                near = (gap < 0) & there[i]
                if j == 0:
                    near[i] = False
                seen &= ~near
        if self.look.still:
            free = np.abs(self.base - self.look.level) < 10
            seen &= self._visible(free.astype(float)) > 0.999
        if self.cover is not None:
            seen &= self._visible(1 - self.cover) > SEEN_SHARE
        return seen

    def _visible(self, free: Array) -> Array:
        """Mean of a picture over each ball (K, M)."""
        out = np.zeros(self.radius.shape)
        angle = 2 * np.pi * np.arange(12) / 12
        for share in (0.25, 0.55, 0.75, 0.95):
            for a in angle:
                x = np.clip(np.rint(self.place[..., 0] + share * self.radius * np.cos(a)), 0, free.shape[1] - 1)
                y = np.clip(np.rint(self.place[..., 1] + share * self.radius * np.sin(a)), 0, free.shape[0] - 1)
                out += free[y.astype(int), x.astype(int)] * share
        return out / (12 * 2.5)


def _outline(camera: Camera, p: Array, radius: Array) -> tuple[Array, Array]:
    """The middles (..., 2), px, of the outlines of balls about p (..., 3), radius (...) m, and the radii (...), px, of
    discs as large as they: by 48 of the rays that touch a ball."""
    sight = p - camera.position
    far = np.linalg.norm(sight, axis=-1, keepdims=True)
    along = sight / far
    right = np.cross(along, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    r = np.broadcast_to(radius, p.shape[:-1])[..., None]
    wide = r * np.sqrt(1 - (r / far) ** 2)
    angle = 2 * np.pi * np.arange(48) / 48
    ring = np.cos(angle)[:, None] * right[..., None, :] + np.sin(angle)[:, None] * np.cross(along, right)[..., None, :]
    b = project(camera, (p - along * r * r / far)[..., None, :] + wide[..., None] * ring)
    after = np.roll(b, -1, axis=-2)
    cross = b[..., 0] * after[..., 1] - after[..., 0] * b[..., 1]
    area = cross.sum(axis=-1) / 2
    middle = ((b + after) * cross[..., None]).sum(axis=-2) / (6 * area[..., None])
    return middle, np.sqrt(np.abs(area) / np.pi)


def _paint(
    picture: Array, x: float, y: float, radius: float, blur: float, level: float | None, light: float | None
) -> None:
    """Cover part of a picture, in place, with a disc of a grey level, or add light to it."""
    height, width = picture.shape
    reach = radius + 4 * blur + 2
    x0, x1 = max(0, int(x - reach)), min(width, int(x + reach) + 2)
    y0, y1 = max(0, int(y - reach)), min(height, int(y + reach) + 2)
    if x0 >= x1 or y0 >= y1:
        return
    off = np.hypot(np.arange(x0, x1) - x, np.arange(y0, y1)[:, None] - y)
    share = ndtr((radius - off) / np.hypot(blur, 0.29)).astype(np.float32)
    here = picture[y0:y1, x0:x1]
    here += share * (np.float32(level) - here) if level is not None else share * np.float32(light)
