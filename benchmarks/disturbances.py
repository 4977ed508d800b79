"""What disturbs the films of `disturbed.py`: a function a kind, which takes a random generator and gives a film."""

from __future__ import annotations

import cv2
import numpy as np
from disturbed_films import SAMPLES, Film, base, options
from scipy.special import ndtr

from vidtrack.arrays import Array

Rng = np.random.Generator


def plain(rng: Rng) -> Film:
    return base(rng)


def x264(rng: Rng) -> Film:
    f = base(rng)
    preset = str(options(rng, "ultrafast", "veryfast", "medium"))
    f.coder, f.pix_fmt = ("libx264", ("-crf", str(rng.integers(20, 41)), "-preset", preset), "mp4"), "yuv420p"
    return f


def x264_steady(rng: Rng) -> Film:
    """A constant rate that is too low."""
    f = base(rng)
    f.coder = ("libx264", ("-b:v", f"{rng.integers(20, 150)}k", "-g", "25", "-preset", "veryfast"), "mp4")
    f.pix_fmt = "yuv420p"
    return f


def mpeg2(rng: Rng) -> Film:
    f = base(rng)
    f.coder, f.pix_fmt = ("mpeg2video", ("-q:v", str(rng.integers(6, 31)), "-g", "12", "-bf", "2"), "mpg"), "yuv420p"
    return f


def mpeg4(rng: Rng) -> Film:
    f = base(rng)
    f.coder, f.pix_fmt = ("mpeg4", ("-q:v", str(rng.integers(6, 31))), "avi"), "yuv420p"
    return f


def dv(rng: Rng) -> Film:
    f = base(rng, size=(720, 576), interlaced=bool(rng.random() < 0.5))
    f.still += cv2.GaussianBlur(rng.normal(0, rng.uniform(0, 60), f.still.shape), (0, 0), 1.2)
    f.coder, f.pix_fmt = ("dvvideo", (), "avi"), "yuv420p"
    return f


def mjpeg(rng: Rng) -> Film:
    f = base(rng)
    f.coder, f.pix_fmt = ("mjpeg", ("-q:v", str(rng.integers(5, 32))), "avi"), "yuvj420p"
    return f


def comb(rng: Rng) -> Film:
    f = base(rng, interlaced=True)
    if rng.random() < 0.5:
        f.coder, f.pix_fmt = ("mpeg2video", ("-q:v", "3", "-flags", "+ildct+ilme", "-top", "1"), "mpg"), "yuv420p"
    return f


def _text(f: Film, i: int, at: tuple[int, int], scale: float) -> Array:
    cover = np.zeros(f.still.shape, np.uint8)
    words = f"10:00:{i // 25 % 60:02d}:{i % 25:02d}"
    cv2.putText(cover, words, at, cv2.FONT_HERSHEY_SIMPLEX, scale, 255, 1, cv2.LINE_AA)
    return np.asarray(cover / 255.0)


def stamp(rng: Rng) -> Film:
    """A running time of day, which the ball passes beside or under."""
    f = base(rng)
    middle, scale = f.place[SAMPLES // 2, 0], rng.uniform(0.35, 0.7)
    below = rng.uniform(-4, 30)
    at = int(middle[0] - rng.uniform(0, 150 * scale)), int(middle[1] + below)
    grey, boxed = rng.uniform(130, 250), rng.random() < 0.3

    def text(i: int, picture: Array) -> Array:
        cover = _text(f, i, at, scale)
        out = picture.copy()
        if boxed:
            x, y = max(at[0] - 3, 0), max(at[1] - int(24 * scale), 0)
            out[y : at[1] + 4, x : x + int(210 * scale)] = 20
        return out + cover * (grey - out)

    f.after.append(text)
    return f


def bars(rng: Rng) -> Film:
    """Black bars, under which the ball may go."""
    f = base(rng)
    deep, across = int(rng.integers(10, 45)), rng.random() < 0.5

    def bar(i: int, picture: Array) -> Array:
        out = (picture if across else picture.T).copy()
        out[:deep] = out[-deep:] = 16
        return out if across else out.T

    f.after.append(bar)
    return f


def _spot(f: Film, x0: float, y0: float, sx: float, sy: float = 0.0) -> Array:
    x, y = f.grid()
    return np.asarray(np.exp(-0.5 * (((x - x0) / sx) ** 2 + ((y - y0) / (sy or sx)) ** 2)))


def glare(rng: Rng) -> Film:
    """Saturated spots on the background that the ball passes before or beside."""
    f = base(rng)
    for _ in range(rng.integers(1, 4)):
        at = f.place[rng.integers(SAMPLES), 0] + rng.normal(0, 2 * f.radius[0], 2)
        f.still = f.still + rng.uniform(150, 900) * _spot(f, *at, *rng.uniform(1, 8, 2))
    return f


def glitters(rng: Rng) -> Film:
    """Small bright spots that come and go on the water."""
    f = base(rng)

    def glitter(i: int, light: Array) -> Array:
        own = np.random.default_rng([int(1000 * f.light), i // 2])
        for _ in range(12):
            at = f.place[min(i, len(f.place) - 1), 0] + own.normal(0, 25, 2)
            light = light + own.uniform(20, 200) * _spot(f, *at, 0.8)
        return light

    f.behind.append(glitter)
    return f


def highlight(rng: Rng) -> Film:
    """A bright point on the ball that wanders over it."""
    f = base(rng)
    phase, turns, strong, wide = *rng.uniform(0, 6, 2), rng.uniform(0.2, 1.2), rng.uniform(0.1, 0.4)

    def look(i: int, x: Array, y: Array) -> Array:
        angle = phase + turns * i / 10
        off = (x - 0.6 * np.cos(angle)) ** 2 + (y - 0.6 * np.sin(angle)) ** 2
        return np.asarray(1 + strong * np.exp(-0.5 * off / wide**2))

    f.look.append(look)
    return f


def marked(rng: Rng) -> Film:
    """A ball with a dark mark that turns with it."""
    f = base(rng)
    turns, wide, dark = rng.uniform(-0.3, 0.3), rng.uniform(0.1, 0.35), rng.uniform(0.2, 0.8)

    def look(i: int, x: Array, y: Array) -> Array:
        angle = turns * i
        across = x * np.cos(angle) + y * np.sin(angle) - 0.3
        return np.asarray(1 - dark * (np.abs(across) < wide))

    f.look.append(look)
    return f


def shadow(rng: Rng) -> Film:
    """A shadow's edge on the background and on the ball that crosses it."""
    f = base(rng)
    middle, angle = f.place[SAMPLES // 2, 0], rng.uniform(0, np.pi)
    dim, soft = rng.uniform(0.3, 0.85), rng.uniform(0.5, 12)
    x, y = f.grid()
    lit = dim + (1 - dim) * ndtr(((x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle)) / soft)
    f.added.append(lambda i, light: light * lit)
    return f


def uneven(rng: Rng) -> Film:
    """A lamp from one side: background and ball are several times as bright there."""
    f = base(rng)
    x, y = f.grid()
    at = rng.uniform(0, 1, 2) * f.size
    lit = 0.25 + rng.uniform(0.5, 1.2) * np.exp(
        -0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / rng.uniform(40, 150) ** 2
    )
    f.added.append(lambda i, light: light * lit)
    return f


def edge(rng: Rng) -> Film:
    """A ball that leaves the picture and comes back."""
    f = base(rng)
    side, half = rng.integers(4), f.radius[0]
    out = rng.uniform(-0.3, 1.2) * half
    t = np.linspace(-1, 1, SAMPLES)
    away = (0.5 * f.size[side % 2]) * np.minimum(1, 1.6 * t**2) - out
    f.place[:, 0, side % 2] = away if side < 2 else f.size[side % 2] - 1 - away
    return f


def waterline(rng: Rng) -> Film:
    """A ball that floats half under water, whose image stands below it."""
    f = base(rng)
    deep, strong = rng.uniform(0.1, 0.9) * f.radius[0], rng.uniform(0, 0.5)
    f.place[:, 0, 1] = 90 + 12 * np.sin(np.arange(SAMPLES) / rng.uniform(4, 9))
    water = rng.uniform(20, 60)
    moved = rng.uniform(0, 0.4) * f.radius[0] * np.sin(np.arange(SAMPLES) / rng.uniform(2, 5))
    _, y = f.grid()

    def covered(i: int, light: Array) -> Array:
        at = f.place[i, 0, 1] + deep + moved[i]
        below = ndtr((y - at) / 0.6)
        rows = np.clip(np.rint(2 * at - np.arange(f.size[1])), 0, f.size[1] - 1).astype(int)
        mirrored = cv2.GaussianBlur(light[rows], (0, 0), 1.0)
        return light + below * (water + strong * (mirrored - f.level) - light)

    f.before.append(covered)
    return f


def rolling(rng: Rng) -> Film:
    f = base(rng)
    f.readout = rng.uniform(0.3, 1.0)
    return f


def hot_pixels(rng: Rng) -> Film:
    """Pixels and lines of the sensor that are always bright or dead."""
    f = base(rng)
    spots = rng.integers(0, f.size[0] * f.size[1], rng.integers(20, 400))
    bright, value = rng.random(spots.size) < 0.7, rng.uniform(60, 255, spots.size)
    lines = rng.integers(0, f.size[1], rng.integers(0, 3))

    def spoil(i: int, picture: Array) -> Array:
        out = picture.copy()
        out.ravel()[spots] = np.where(bright, value, 5)
        out[lines] = 0
        return out

    f.after.append(spoil)
    return f


def curve(rng: Rng) -> Film:
    """Levels squeezed or stretched, bent and clipped, as a wrong range or profile does."""
    f = base(rng)
    gain, offset, power = rng.uniform(0.5, 2.2), rng.uniform(-40, 20), rng.uniform(0.5, 2)
    f.after.append(lambda i, p: 255 * (np.clip(gain * p + offset, 0, 255) / 255) ** power)
    return f


def coloured(rng: Rng) -> Film:
    """A coloured ball before another colour, in 4:2:0."""
    f = base(rng)
    f.colour = rng.uniform(0.1, 1, 3), rng.uniform(0.1, 1, 3)
    f.coder, f.pix_fmt = ("libx264", ("-crf", str(rng.integers(12, 28)), "-preset", "veryfast"), "mp4"), "yuv420p"
    return f


def blended(rng: Rng) -> Film:
    """Another rate by mixing of neighbours: each picture is a mean of two."""
    f = base(rng)
    ratio = rng.uniform(0.7, 1.0)

    def mixed(pictures: list[Array]) -> list[Array]:
        out = []
        for k in range(len(pictures)):
            at = k * ratio
            i, part = int(at), at % 1
            after = pictures[min(i + 1, len(pictures) - 1)]
            out.append((1 - part) * pictures[i] + part * after)
        return out

    f.films.append(mixed)
    every, t = np.arange(SAMPLES) * ratio, np.arange(SAMPLES)
    f.truth = np.stack([np.interp(every, t, f.place[:, 0, a]) for a in (0, 1)], axis=-1)[:, None]
    return f


def ghost(rng: Rng) -> Film:
    """What a deinterlacer or a slow screen leaves: part of the picture before."""
    f = base(rng)
    share = rng.uniform(0.1, 0.4)
    f.films.append(lambda ps: [p if i == 0 else (1 - share) * p + share * ps[i - 1] for i, p in enumerate(ps)])
    return f


def averaged(rng: Rng) -> Film:
    """Noise reduction over time: what moves leaves a trail."""
    f = base(rng)
    share, limit = rng.uniform(0.2, 0.6), rng.uniform(6, 40)

    def reduce(pictures: list[Array]) -> list[Array]:
        out = [pictures[0]]
        for picture in pictures[1:]:
            change = picture - out[-1]
            out.append(picture - share * change * np.exp(-((change / limit) ** 2)))
        return out

    f.films.append(reduce)
    return f


def sharpened(rng: Rng) -> Film:
    f = base(rng)
    strong, wide = rng.uniform(0.3, 1.5), rng.uniform(0.8, 2)
    f.after.append(lambda i, p: p + strong * (p - cv2.GaussianBlur(p, (0, 0), wide)))
    return f


def resized(rng: Rng) -> Film:
    """Made larger: the noise of neighbours is alike."""
    f = base(rng)
    factor, how = rng.uniform(1.2, 2), int(options(rng, cv2.INTER_LINEAR, cv2.INTER_CUBIC, cv2.INTER_NEAREST_EXACT))
    width, height = (round(s * factor / 2) * 2 for s in f.size)
    small = f.size
    scale = np.array([width / small[0], height / small[1]])
    f.films.append(lambda ps: [cv2.resize(p, (width, height), interpolation=how) for p in ps])
    f.truth = (f.place + 0.5) * scale - 0.5
    f.written = width, height
    return f


def exposure(rng: Rng) -> Film:
    """A camera that sets its exposure anew."""
    f = base(rng)
    gain = np.ones(SAMPLES)
    for _ in range(rng.integers(1, 4)):
        at, last, to = rng.integers(5, SAMPLES - 8), rng.integers(1, 6), rng.uniform(0.5, 1.6)
        gain[at : at + last] *= np.linspace(1, to, last)
        gain[at + last :] *= to
    f.added.append(lambda i, light: light * gain[i])
    return f


def flicker(rng: Rng) -> Film:
    f = base(rng)
    deep, rate = rng.uniform(0.05, 0.4), rng.uniform(0.3, 3)
    f.added.append(lambda i, light: light * (1 + deep * np.sin(rate * i)))
    return f


def flare(rng: Rng) -> Film:
    """The lens mirrors the ball about the middle of the picture, dim and wide, beside a still veil."""
    f = base(rng)
    strong, wide = rng.uniform(5, 60), rng.uniform(2, 20)
    veil, at = rng.uniform(10, 80), rng.uniform(0, 1, 2) * f.size
    f.still = f.still + veil * _spot(f, *at, rng.uniform(20, 80))
    middle = np.array(f.size) / 2
    f.added.append(lambda i, light: light + strong * _spot(f, *(2 * middle - f.place[i, 0]), wide))
    return f


def _bar(f: Film, x0: float, y0: float, angle: float, width: float) -> Array:
    x, y = f.grid()
    off = np.abs((x - x0) * np.sin(angle) - (y - y0) * np.cos(angle))
    return np.asarray(ndtr((width / 2 - off) / 0.7))


def _crosses(rng: Rng, f: Film) -> tuple[Array, float, float, float]:
    """Where something long is in each picture, its angle, width and level; it meets the ball half-way."""
    angle, width = rng.uniform(0, np.pi), rng.uniform(1.5, 30)
    middle = f.place[SAMPLES // 2, 0]
    way = np.linspace(-1, 1, SAMPLES)[:, None] * rng.normal(0, 60, 2)
    return middle + way, angle, width, rng.uniform(10, f.level + 0.75 * f.light)


def behind(rng: Rng) -> Film:
    """A hand or a rope that passes behind the ball."""
    f = base(rng)
    at, angle, width, level = _crosses(rng, f)

    def pass_by(i: int, light: Array) -> Array:
        return light + _bar(f, *at[i], angle, width) * (level - light)

    f.behind.append(pass_by)
    return f


def before(rng: Rng) -> Film:
    """The same before it."""
    f = base(rng)
    at, angle, width, level = _crosses(rng, f)

    def pass_by(i: int, light: Array) -> Array:
        return light + _bar(f, *at[i], angle, min(width, f.radius[0])) * (level - light)

    f.before.append(pass_by)
    return f


def bright_dim(rng: Rng) -> Film:
    """Dim bright things that stand where the ball passes: paper, the edge of a board, a stain."""
    f = base(rng)
    for _ in range(rng.integers(1, 4)):
        at = f.place[rng.integers(SAMPLES), 0] + rng.normal(0, 1.5 * f.radius[0], 2)
        rise = rng.uniform(0.06, 0.45) * f.light
        if rng.random() < 0.5:
            cover = _bar(f, *at, rng.uniform(0, np.pi), rng.uniform(1, 12))
        else:
            x, y = f.grid()
            cover = ndtr((rng.uniform(1, 15) - np.hypot(x - at[0], y - at[1])) / 0.7)
        f.still = f.still + cover * rise
    return f


def cast(rng: Rng) -> Film:
    """The ball's own shadow on the wall behind it."""
    f = base(rng)
    off, dim, wide = rng.normal(0, 1.5 * f.radius[0], 2), rng.uniform(0.2, 0.8), f.radius[0] * rng.uniform(0.8, 1.3)
    soft = rng.uniform(0.6, 4)
    x, y = f.grid()

    def shade(i: int, light: Array) -> Array:
        at = f.place[i, 0] + off
        return light * (1 - dim * ndtr((wide - np.hypot(x - at[0], y - at[1])) / soft))

    f.behind.append(shade)
    return f


def drop(rng: Rng) -> Film:
    """A drop on the lens, which blurs and bends what is behind it."""
    f = base(rng)
    at, wide = f.place[rng.integers(SAMPLES), 0] + rng.normal(0, 6, 2), rng.uniform(5, 20)
    x, y = f.grid()
    share = ndtr((wide - np.hypot(x - at[0], y - at[1])) / 2)
    blur, gain = rng.uniform(1, 5), rng.uniform(0.7, 1.2)
    f.before.append(lambda i, light: light + share * (gain * cv2.GaussianBlur(light, (0, 0), blur) - light))
    return f


def small_pair(rng: Rng) -> Film:
    """Two small balls that pass each other and may overlap by half."""
    f = base(rng)
    f.balls, size = 2, rng.uniform(1.5, 3)
    f.radius = size * rng.uniform(0.85, 1.15, 2)
    f.noise = rng.uniform(0.8, 2)
    angle, nearest = rng.uniform(0, 2 * np.pi), rng.uniform(0.9, 3) * size
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    apart = np.linspace(-1, 1, SAMPLES)[:, None] * rng.uniform(8, 30) * along + nearest * across
    f.place = np.stack([f.place[:, 0] - apart / 2, f.place[:, 0] + apart / 2], axis=1)
    return f


def small_beside(rng: Rng) -> Film:
    """Two small balls of one body that move together, beside or partly before each other."""
    f = small_pair(rng)
    angle = rng.uniform(0, 2 * np.pi) + rng.uniform(-1, 1) * np.arange(SAMPLES)[:, None] / SAMPLES
    apart = rng.uniform(1, 3) * f.radius.mean() * np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    middle = f.place.mean(axis=1)
    f.place = np.stack([middle - apart / 2, middle + apart / 2], axis=1)
    return f


KINDS = {
    one.__name__: one
    for one in (
        *(plain, x264, x264_steady, mpeg2, mpeg4, dv, mjpeg, comb, stamp, bars, glare, glitters, highlight, marked),
        *(shadow, uneven, edge, waterline, rolling, hot_pixels, curve, coloured, blended, ghost, averaged, sharpened),
        *(resized, exposure, flicker, flare, behind, before, bright_dim, cast, drop, small_pair, small_beside),
    )
}
