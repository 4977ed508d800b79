"""Films of one or two balls, each with one disturbance that recordings have, and the truth.

A ball is drawn 6 times as fine as the pixels, shaded, blurred by the lens and averaged over each pixel; what hides it
or is added comes before or after it as light does, then noise, the camera's curve and rounding, then a coder. Nothing
of this is vidtrack's own: neither its rendering nor its model of an edge.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vidtrack.arrays import Array

FINE, SAMPLES = 6, 50
LOSSLESS = ("ffv1", (), "mkv")


@dataclass
class Film:
    """What a film is made of; px, grey levels (0 to 255), pictures.

    place   (pictures, balls, 2), in the middle of a field's exposure where it has two a picture: then (2 pictures, ...)
    look    of each ball: what its levels are multiplied by, at (x, y) in radii of it in picture i
    behind, before, added  change the light of picture i: before and after the balls are painted, and before noise
    after   changes picture i as a camera or recorder does, after noise; films: changes all pictures
    truth   where the balls are in what is written, where that is not `place`; written: its size, where not `size`
    """

    rng: np.random.Generator
    size: tuple[int, int] = (240, 180)
    balls: int = 1
    radius: Array = field(default_factory=lambda: np.zeros(0))
    level: float = 40.0
    light: float = 120.0
    blur: float = 0.7
    noise: float = 2.0
    gamma: float = 1.0
    shade: float = 0.0
    interlaced: bool = False
    readout: float = 0.0
    still: Array = field(default_factory=lambda: np.zeros(0))
    place: Array = field(default_factory=lambda: np.zeros(0))
    look: list[Callable[[int, Array, Array], Array]] = field(default_factory=list)
    behind: list[Callable[[int, Array], Array]] = field(default_factory=list)
    before: list[Callable[[int, Array], Array]] = field(default_factory=list)
    added: list[Callable[[int, Array], Array]] = field(default_factory=list)
    after: list[Callable[[int, Array], Array]] = field(default_factory=list)
    films: list[Callable[[list[Array]], list[Array]]] = field(default_factory=list)
    coder: tuple[str, tuple[str, ...], str] = LOSSLESS
    pix_fmt: str = "gray"
    flags: tuple[str, ...] = ()
    truth: Array | None = None
    written: tuple[int, int] | None = None
    colour: tuple[Array, Array] | None = None  # (3,) of the ball, of the background: shares of red, green, blue

    def grid(self) -> tuple[Array, Array]:
        y, x = np.mgrid[: self.size[1], : self.size[0]].astype(float)
        return x, y

    def pictures(self) -> list[Array]:
        """All pictures, grey levels."""
        step = 2 if self.interlaced else 1
        out = []
        for i in range(len(self.place) // step):
            parts = [self._exposed(step * i + k) for k in range(step)]
            light = parts[0]
            if self.interlaced:
                light[1::2] = parts[1][1::2]
            picture = 255 * (np.clip(light, 0, 255) / 255) ** (1 / self.gamma)
            picture = picture + self.rng.normal(0, self.noise, light.shape)
            for change in self.after:
                picture = change(i, picture)
            out.append(picture)
        for change_all in self.films:
            out = change_all(out)
        return [np.clip(np.rint(picture), 0, 255).astype(np.uint8) for picture in out]

    def _exposed(self, i: int) -> Array:
        light = self.still.copy()
        for change in self.behind:
            light = change(i, light)
        for k in range(self.balls):
            self._paint(light, i, k)
        for change in [*self.before, *self.added]:
            light = change(i, light)
        return light

    def _paint(self, light: Array, i: int, k: int) -> None:
        radius, (x0, y0) = self.radius[k], self.place[i, k]
        reach = int(np.ceil(radius + 4 * self.blur + 2 + 3 * self.readout))
        left, top = int(np.floor(x0)) - reach, int(np.floor(y0)) - reach
        n = 2 * reach + 2
        fine = (np.arange(n * FINE) + 0.5) / FINE - 0.5
        X, Y = np.meshgrid(left + fine - x0, top + fine - y0)
        if self.readout:  # a row of a rolling shutter sees the ball later
            speed = np.gradient(self.place[:, k], axis=0)[i]
            late = self.readout * Y / self.size[1]
            X, Y = X - speed[0] * late, Y - speed[1] * late
        inside = X * X + Y * Y <= radius * radius
        depth = np.sqrt(np.maximum(1 - (X * X + Y * Y) / radius**2, 0))
        levels = self.level + self.light * (1 - self.shade + self.shade * depth)
        for look in self.look:
            levels = levels * look(i, X / radius, Y / radius)
        parts = []
        for values in (inside.astype(float), inside * levels):
            soft = cv2.GaussianBlur(values, (0, 0), self.blur * FINE)
            parts.append(soft.reshape(n, FINE, n, FINE).mean(axis=(1, 3)))
        h, w = light.shape
        rows, columns = slice(max(top, 0), min(top + n, h)), slice(max(left, 0), min(left + n, w))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        cut = slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left)
        light[rows, columns] = light[rows, columns] * (1 - parts[0][cut]) + parts[1][cut]

    def write(self, path: Path) -> Path:
        """The recording; RuntimeError where the encoder refuses it."""
        codec, options, suffix = self.coder
        path = path.with_suffix(f".{suffix}")
        width, height = self.written or self.size
        pictures, given = self.pictures(), "gray"
        if self.colour is not None:
            pictures, given = [self._coloured(picture) for picture in pictures], "rgb24"
        scale = "null" if self.colour is not None else "scale=in_range=tv:out_range=tv"
        command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", given, "-s", f"{width}x{height}"]
        command += ["-r", "25", "-i", "-", "-vf", scale, "-c:v", codec, *options, *self.flags]
        command += ["-pix_fmt", self.pix_fmt, "-threads", "1", str(path)]
        done = subprocess.run(command, input=b"".join(p.tobytes() for p in pictures), capture_output=True, check=False)
        if done.returncode or not path.exists():
            raise RuntimeError(done.stderr.decode()[-300:])
        return path

    def _coloured(self, picture: Array) -> Array:
        ball, about = self.colour or (np.ones(3), np.ones(3))
        share = np.clip((picture.astype(float) - self.level) / self.light, 0, 1)[..., None]
        colour = share * ball + (1 - share) * about
        return np.asarray(np.clip(np.rint(picture[..., None] * colour), 0, 255).astype(np.uint8))


def course(rng: np.random.Generator, size: tuple[int, int], n: int, *, margin: float, speed: float) -> Array:
    """A smooth course (n, 2) px within the picture."""
    t, out = np.linspace(0, 1, n), np.empty((n, 2))
    for axis in (0, 1):
        reach = size[axis] / 2 - margin
        swing = reach * rng.uniform(0.35, 0.95)
        turns = min(rng.uniform(0.3, 1.2), speed * n / (2 * np.pi * swing))
        out[:, axis] = size[axis] / 2 + swing * np.sin(2 * np.pi * turns * t + rng.uniform(0, 2 * np.pi))
    return out


def base(rng: np.random.Generator, *, size: tuple[int, int] = (240, 180), interlaced: bool = False) -> Film:
    """An undisturbed film of one ball."""
    f = Film(rng, size, interlaced=interlaced)
    f.radius = rng.uniform(2.5, 9, 1)
    f.level, f.light = rng.uniform(25, 70), rng.uniform(70, 150)
    f.blur, f.noise = rng.uniform(0.45, 1.1), rng.uniform(0.8, 3)
    f.gamma, f.shade = float(rng.choice([1, 1, 1.4, 2.2])), float(rng.choice([0, 0.15, 0.4]))
    x, y = f.grid()
    kind = rng.integers(3)
    tilt = rng.uniform(-12, 12, 2) if kind else np.zeros(2)
    f.still = f.level + tilt[0] * (x / size[0] - 0.5) + tilt[1] * (y / size[1] - 0.5)
    if kind == 2:
        f.still += cv2.GaussianBlur(rng.normal(0, rng.uniform(5, 25), f.still.shape), (0, 0), 4)
    f.place = course(rng, size, SAMPLES * (2 if interlaced else 1), margin=14, speed=rng.uniform(0.5, 4))[:, None]
    return f


def options(rng: np.random.Generator, *choices: Any) -> Any:
    """One of them."""
    return choices[int(rng.integers(len(choices)))]
