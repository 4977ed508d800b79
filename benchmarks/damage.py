"""How many wrong pictures of damaged recordings pass without a flag.

    python benchmarks/damage.py                      1200 recordings, about 4 minutes on one core
    python benchmarks/damage.py --count 240 --kinds raw.dv h264-pyramid.mp4
    python benchmarks/damage.py --count 240 --centroids

Small recordings of a ball that moves over texture, in many codecs and containers, are damaged in the middle of the file
in seven ways (a byte, a stretch of noise or zeros, bytes cut out or put in) and read. A picture is wrong where a block
of 8 x 8 pixels is off by more than 6 grey levels on the mean from the same moment of the undamaged reading, or where
that has no such moment. Wrong and not flagged, by the decoder or by what the background shows, is what must not be.
With --centroids two targets are followed as well: off is a centroid with an empty flag that is more than 5 sd and
0.05 px from where the scene has its balls at that moment, and `by damage` those of them that are as far from where the
undamaged reading has them: texture behind a ball's soft rim moves both. Everything is seeded: one number makes
one recording again (--seed). But the encoder of H.264 does not make the same file twice (38,087 or 38,100 bytes), so
that another picture is hit: to compare two versions, keep the undamaged recordings (--clips).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.files.clips import make_clip
from vidtrack.errors import VidtrackError
from vidtrack.stages.track import track
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.video.reader import open_video

N = 60
RATE = Fraction(30000, 1001)
EDGE = 12
"""px from the left and right edge, where a ball leaves the picture and comes back on the other side."""
WRONG = 6.0
"""Grey levels, on the mean over a block of 8 x 8 pixels."""


class Kind(NamedTuple):
    """How a recording is made."""

    codec: str
    pix_fmt: str
    options: dict[str, str]
    size: tuple[int, int] = (160, 120)


X264 = {"g": "24", "crf": "18", "sc_threshold": "0"}
KINDS = {
    "h264.mp4": Kind("libx264", "yuv420p", X264 | {"bf": "2", "x264-params": "b-pyramid=none"}),
    "h264-pyramid.mp4": Kind("libx264", "yuv420p", X264 | {"bf": "7", "x264-params": "b-pyramid=normal:b-adapt=0"}),
    "h264-pyramid.mkv": Kind("libx264", "yuv420p", X264 | {"bf": "3", "x264-params": "b-pyramid=normal:b-adapt=0"}),
    "h264-open-gop.ts": Kind("libx264", "yuv420p", X264 | {"bf": "3", "x264-params": "open-gop=1:b-adapt=0"}),
    "h264-slices.mov": Kind("libx264", "yuv420p", X264 | {"bf": "0", "x264-params": "slices=4"}),
    "hevc.mp4": Kind("libx265", "yuv420p", {"x265-params": "log-level=none:keyint=24:bframes=4:pools=1"}),
    "mpeg2.mpg": Kind("mpeg2video", "yuv420p", {"b": "3M", "bf": "2", "g": "12"}),
    "mpeg2.mxf": Kind("mpeg2video", "yuv422p", {"b": "5M", "g": "12"}),
    "mpeg4.avi": Kind("mpeg4", "yuv420p", {"b": "2M", "bf": "2", "g": "24"}),
    "mjpeg.avi": Kind("mjpeg", "yuvj420p", {"qmin": "2", "qmax": "3"}),
    "mjpeg.mov": Kind("mjpeg", "yuvj420p", {"qmin": "2", "qmax": "3"}),
    "raw.dv": Kind("dvvideo", "yuv411p", {}, (720, 480)),
    "dv.avi": Kind("dvvideo", "yuv411p", {}, (720, 480)),
    "ffv1.mkv": Kind("ffv1", "gray", {"level": "3", "g": "1", "slicecrc": "1"}),
    "ffv1.avi": Kind("ffv1", "gray", {"level": "1", "g": "1"}),
    "prores.mov": Kind("prores_ks", "yuv422p10le", {}),
    "vp9.webm": Kind("libvpx-vp9", "yuv420p", {"crf": "20", "b": "0", "g": "24", "cpu-used": "8"}),
    "av1.mkv": Kind("libsvtav1", "yuv420p", {"crf": "25", "preset": "10", "g": "24"}),
}

BALLS = (1.5, 0.3), (-1.1, 0.7)
"""Of each ball: px a picture to the right, and where it is in the height."""

WAYS = ("a byte", "a few bytes", "noise", "much noise", "zeros", "cut out", "put in")


def balls(size: tuple[int, int], i: int) -> np.ndarray:
    """Where the scene's two balls are in picture i: (2, 2) px."""
    width, height = size
    return np.array(
        [((20 + speed * i) % width, row * height + 12 * np.sin(i / 9 + k)) for k, (speed, row) in enumerate(BALLS)]
    )


def scene(size: tuple[int, int], deep: bool, *, opaque: bool = False) -> Callable[[int], np.ndarray]:
    """Pictures of two balls that move over a still texture, with noise; the texture shows through those not opaque."""
    width, height = size
    Y, X = np.mgrid[:height, :width].astype(np.float32)
    still = 70 + 25 * np.sin(X / 7) * np.cos(Y / 9) + np.random.default_rng(1).normal(0, 6, (height, width))

    def picture(i: int) -> np.ndarray:
        levels = still.copy()
        for x, y in balls(size, i):
            cover = 1 / (1 + np.exp(np.clip(1.2 * (np.hypot(X - x, Y - y) - 6), -50, 50)))
            levels += cover * (190 - levels if opaque else 120)
        levels = np.clip(levels + np.random.default_rng(i).normal(0, 1.5, levels.shape), 16, 235)
        return np.rint(levels * 4).astype(np.uint16) if deep else np.rint(levels).astype(np.uint8)

    return picture


def damaged(data: bytes, way: str, rng: np.random.Generator) -> bytes:
    """The bytes of a file, spoilt somewhere in its middle eight tenths."""
    at = int(rng.integers(len(data) // 10, 9 * len(data) // 10))
    length = int(
        {
            "a byte": 1,
            "a few bytes": rng.integers(2, 17),
            "noise": rng.integers(50, 500),
            "cut out": rng.integers(1, 300),
        }.get(way, rng.integers(500, 5000))
    )
    if way == "cut out":
        return data[:at] + data[at + length :]
    fresh = bytes(length) if way == "zeros" else rng.integers(0, 256, length, dtype=np.uint8).tobytes()
    return data[:at] + fresh + data[at + (0 if way == "put in" else length) :]


class Reading(NamedTuple):
    """Levels, and whether it is flagged, by the nearest whole frame of a picture's time; seen: flagged by what the
    background shows alone; what the account says; centroids (rows of moment, X, Y, sd x, sd y) with an empty flag."""

    levels: dict[int, np.ndarray]
    flags: dict[int, bool]
    seen: int
    problems: tuple[str, ...]
    centroids: np.ndarray


def read(path: Path, *, centroids: bool) -> Reading:
    levels: dict[int, np.ndarray] = {}
    flags: dict[int, bool] = {}
    with open_video(str(path)) as video:
        scale = 255 / (2**video.info.bits - 1)
        damage = DamagedPictures(video.info.bits, video.look_again, video.info.codec)
        frames = [frame._replace(luma=frame.luma.copy()) for frame in damage.over(video.frames())]
        for frame in frames:
            moment = round(float(frame.time * RATE))
            hurt = frame.corrupt or frame.index in damage.indices
            flags[moment] = flags.get(moment, True) and hurt
            if not (moment in levels and hurt):
                levels[moment] = frame.luma.astype(np.float32) * np.float32(scale)
        places = np.zeros((0, 5))
        if centroids:
            table = track(frames, video.info, targets=2).centroids
            table = table[table["Xf"].notna() & (table["flag"] == "")]
            moments = {frame.index: round(float(frame.time * RATE)) for frame in frames}
            places = table[["frame", "Xf", "Yf", "sd_x", "sd_y"]].to_numpy(float)
            places[:, 0] = [moments[int(frame)] for frame in places[:, 0]]
        return Reading(levels, flags, len(damage.indices), video.account.problems, places)


Places = dict[tuple[int, int], tuple[np.ndarray, np.ndarray, bool]]
"""By moment and ball: where it was measured, how far that may be off, px, and whether it is farther."""


def placed(own: np.ndarray, size: tuple[int, int]) -> Places:
    """Rows by the ball nearest to them; near the picture's edge none is."""
    found = Places()
    for moment, x, y, *sd in own.tolist():
        apart = np.abs(balls(size, int(moment)) - (x, y))
        k, limit = int(np.argmin(np.hypot(*apart.T))), np.maximum(0.05, 5 * np.array(sd))
        if EDGE < balls(size, int(moment))[k, 0] < size[0] - EDGE:
            found[int(moment), k] = np.array([x, y]), limit, bool(np.any(apart[k] > limit))
    return found


def moved_by_damage(own: Places, whole: Places) -> int:
    """How many are off, and farther from where the undamaged reading has them than they may be."""
    aside = [(at, place, limit) for at, (place, limit, away) in own.items() if away]
    return sum(at not in whole or bool(np.any(np.abs(place - whole[at][0]) > limit)) for at, place, limit in aside)


def off(a: np.ndarray, b: np.ndarray) -> float:
    """Grey levels, the worst block of 8 x 8 pixels."""
    if a.shape != b.shape:
        return np.inf
    height, width = (8 * (n // 8) for n in a.shape)
    blocks = np.abs(a - b)[:height, :width].reshape(height // 8, 8, width // 8, 8)
    return float(blocks.mean(axis=(1, 3)).max())


class Outcome(NamedTuple):
    """wrong: pictures; silent: of them, without a flag; flagged: pictures; needless: of them, not wrong; off: centroids
    with an empty flag; by_damage: of them, not there in the undamaged reading."""

    wrong: int
    silent: int
    flagged: int
    needless: int
    seen: int
    centroids: int
    off: int
    by_damage: int
    said: bool
    refused: bool


def outcome(path: Path, whole: Reading, size: tuple[int, int], *, centroids: bool) -> Outcome:
    try:
        own = read(path, centroids=centroids)
    except VidtrackError:
        return Outcome(0, 0, 0, 0, 0, 0, 0, 0, True, True)
    wrong = {t for t, one in own.levels.items() if t not in whole.levels or off(one, whole.levels[t]) > WRONG}
    flagged = {t for t, flag in own.flags.items() if flag}
    counts = len(wrong), len(wrong - flagged), len(flagged), len(flagged - wrong), own.seen
    places = placed(own.centroids, size)
    by_damage = moved_by_damage(places, placed(whole.centroids, size))
    aside = sum(away for _, _, away in places.values())
    return Outcome(*counts, len(own.centroids), aside, by_damage, bool(own.problems), False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1200, help="recordings in all")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--centroids", action="store_true", help="follow the targets as well")
    parser.add_argument("--seed", type=int, help="one recording alone, with all that is said of it")
    parser.add_argument("--clips", type=Path, help="folder for the undamaged recordings: those in it are used again")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        clips: dict[str, tuple[bytes, Reading]] = {}
        kept = arguments.clips or Path(folder)
        kept.mkdir(parents=True, exist_ok=True)
        for name in arguments.kinds:
            kind = KINDS[name]
            path = kept / name
            picture = scene(kind.size, kind.pix_fmt.endswith("10le"), opaque=True)
            if not path.exists():
                make_clip(path, kind.codec, kind.pix_fmt, n=N, size=kind.size, picture=picture, options=kind.options)
            clips[name] = path.read_bytes(), read(path, centroids=arguments.centroids)
        found: dict[str, list[Outcome]] = {name: [] for name in arguments.kinds}
        seeds = (
            range(arguments.first, arguments.first + arguments.count) if arguments.seed is None else [arguments.seed]
        )
        for seed in seeds:
            name = list(KINDS)[seed % len(KINDS)] if arguments.seed is not None else arguments.kinds[seed % len(clips)]
            rng = np.random.default_rng([seed, list(KINDS).index(name)])
            way = WAYS[int(rng.integers(len(WAYS)))]
            path = Path(folder) / f"hurt-{name}"
            data, whole = clips[name]
            path.write_bytes(damaged(data, way, rng))
            one = outcome(path, whole, KINDS[name].size, centroids=arguments.centroids)
            found[name].append(one)
            if one.silent or one.by_damage or arguments.seed is not None:
                print(f"  {name} {seed}: {way}: {one}", file=sys.stderr)
    heads = {
        "files": 6,
        "refused": 8,
        "wrong": 6,
        "unflagged": 10,
        "in files": 9,
        "flagged": 8,
        "needless": 9,
        "seen": 6,
    }
    heads |= {"centroids": 9, "off": 5, "by damage": 9}
    print(f"{'kind':18} " + " ".join(f"{word:>{width}}" for word, width in heads.items()))
    for name, ones in [*found.items(), ("all", [one for own in found.values() for one in own])]:
        print(
            f"{name:18} {len(ones):6} {sum(o.refused for o in ones):8} {sum(o.wrong for o in ones):6}"
            f" {sum(o.silent for o in ones):10} {sum(o.silent > 0 for o in ones):9} {sum(o.flagged for o in ones):8}"
            f" {sum(o.needless for o in ones):9} {sum(o.seen for o in ones):6} {sum(o.centroids for o in ones):9}"
            f" {sum(o.off for o in ones):5} {sum(o.by_damage for o in ones):9}"
        )


if __name__ == "__main__":
    main()
