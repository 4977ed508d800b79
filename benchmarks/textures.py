"""Centroids of opaque balls before strong textures: how far they are off, and whether their sd says so.

    python benchmarks/textures.py --count 120 --first 500       about 1.5 s of processor time a film
    python benchmarks/textures.py --seed 512                    one film alone, ball by ball

Each film has four balls in rows of their own, one at rest and three that swing at up to 0.2, 1 and 3 px a picture,
bright or dark, of 2 to 15 px, before a still texture (a plain wall in one film of nine). Edges are exact areas; balls
and wall are blurred together by a lens of 0.3 to 2 px, or in one film of four the balls alone, which are then out of
focus. Films are not coded, H.264 or MPEG-2. Silent is a centroid with an empty flag more than 5 sd and 0.1 px from the
truth along x or y, and `>1px` those that are on something else, most of them what lies in a start box beside the ball;
z is the rms of errors over their sd, rms px that of errors, both without those; lost: rows with a flag. Everything is
seeded.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from pandas import DataFrame, concat

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.discs import disc
from tests.files.clips import make_clip
from vidtrack.errors import VidtrackError
from vidtrack.stages.track import track
from vidtrack.video.reader import open_video

SIZE, N = (320, 240), 72
NOISE = 1.5
CODECS = {
    "not coded": ("ffv1", "gray", {"level": "3"}, "mkv"),
    "h264 18": ("libx264", "yuv420p", {"crf": "18"}, "mp4"),
    "h264 23": ("libx264", "yuv420p", {"crf": "23"}, "mp4"),
    "h264 28": ("libx264", "yuv420p", {"crf": "28"}, "mp4"),
    "mpeg2": ("mpeg2video", "yuv420p", {"b": "4M", "g": "12", "bf": "2"}, "mpg"),
}
TEXTURES = ("plain", "waves", "grain", "noise 3", "noise 8", "checks", "print", "bricks", "stripes")
SPEEDS = {"at rest": 0.0, "slow": 0.2, "one px": 1.0, "fast": 3.0}


class Film(NamedTuple):
    """What a film shows: sd of the texture, grey levels; blur px; radius px; contrast of the balls, grey levels."""

    texture: str
    strength: float
    blur: float
    own_focus: bool
    radius: float
    contrast: float
    dark: bool
    codec: str


def film_of(seed: int) -> Film:
    rng = np.random.default_rng([seed, 77])
    return Film(
        TEXTURES[seed % len(TEXTURES)],
        float(rng.choice([3, 6, 10, 14, 20])),
        float(rng.choice([0.1, 0.3, 0.5, 0.8, 1.2, 2.0])),
        bool(rng.random() < 0.25),
        float(rng.choice([2, 3, 4, 6, 9, 15])),
        float(rng.choice([80, 120])),
        bool(rng.random() < 0.3),
        str(rng.choice(list(CODECS), p=[0.4, 0.15, 0.15, 0.15, 0.15])),
    )


def wall(film: Film, rng: np.random.Generator) -> np.ndarray:
    """Grey levels of the wall, as sharp as pixels are."""
    width, height = SIZE
    Y, X = np.mgrid[:height, :width].astype(float)
    turn = rng.uniform(0, np.pi)
    U, V = X * np.cos(turn) + Y * np.sin(turn), Y * np.cos(turn) - X * np.sin(turn)
    fresh = rng.normal(size=(height, width))
    period = rng.uniform(6, 24)
    if film.texture == "plain":
        return np.full((height, width), 70.0)
    if film.texture == "waves":
        levels = np.sin(2 * np.pi * X / period) * np.cos(2 * np.pi * Y / (1.3 * period)) + 0.25 * fresh
    elif film.texture == "grain":
        levels = fresh
    elif film.texture.startswith("noise"):
        levels = cv2.GaussianBlur(fresh, (0, 0), float(film.texture.split()[1]))
    elif film.texture == "checks":
        levels = np.sign(np.sin(2 * np.pi * U / period) * np.sin(2 * np.pi * V / period))
    elif film.texture == "stripes":
        levels = np.sign(np.sin(2 * np.pi * U / period))
    elif film.texture == "bricks":
        row = np.floor(Y / (period / 2 + 4))
        mortar = (Y % (period / 2 + 4) < 2) | ((X + 0.5 * period * (row % 2)) % (period + 8) < 2)
        each = rng.normal(size=(height, width))[
            row.astype(int), ((X + 0.5 * period * (row % 2)) // (period + 8)).astype(int)
        ]
        levels = np.where(mortar, 1.5, 0.6 * each)
    else:  # print: strokes as of letters
        levels = np.zeros((height, width))
        for _ in range(900):
            x, y, turned = rng.integers(width), rng.integers(height), rng.random() < 0.5
            long, slim = rng.integers(4, 12), rng.integers(1, 3)
            levels[y : y + (long if turned else slim), x : x + (slim if turned else long)] = 1
    levels = (levels - levels.mean()) / levels.std()
    return np.clip(70 + film.strength * np.clip(levels, -2.5, 2.5), 20, 130)


def paths(film: Film, rng: np.random.Generator) -> np.ndarray:
    """(N, 4, 2) px."""
    width, height = SIZE
    t = np.arange(N)[:, None]
    speed = np.array(list(SPEEDS.values()))
    reach = np.minimum(width / 2 - film.radius - 30, 12 + 60 * speed) * (speed > 0)
    rate = np.divide(speed, reach, out=np.zeros(4), where=reach > 0)
    phase = rng.uniform(0, 2 * np.pi, 4)
    x = width / 2 + rng.uniform(-20, 20, 4) + reach * np.sin(rate * t + phase)
    y = (
        height * (np.arange(4) + 0.5) / 4
        + rng.uniform(-2, 2, 4)
        + 0.3 * np.minimum(reach, 22) * np.sin(0.7 * rate * t + 2 * phase)
    )
    return np.stack([x, y], axis=-1)


def pictures(film: Film, places: np.ndarray, sharp: np.ndarray, seed: int):
    """The i-th picture, uint8."""

    def blurred(levels: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(levels, (0, 0), film.blur) if film.blur > 0.1 else levels

    def picture(i: int) -> np.ndarray:
        height, width = sharp.shape
        cover = np.zeros(sharp.shape)
        for x, y in places[i]:
            reach = int(film.radius + 12)
            left, top = max(0, int(x) - reach), max(0, int(y) - reach)
            right, bottom = min(width, int(x) + reach), min(height, int(y) + reach)
            cover[top:bottom, left:right] += disc((bottom - top, right - left), x - left, y - top, film.radius)
        cover = blurred(cover) if film.own_focus else cover
        levels = sharp + cover * (70 + film.contrast - sharp)
        levels = levels if film.own_focus else blurred(levels)
        levels = np.clip(levels + np.random.default_rng([seed, i]).normal(0, NOISE, levels.shape), 0, 250)
        return np.rint(255 - levels if film.dark else levels).astype(np.uint8)

    return picture


def follow(seed: int, folder: Path) -> DataFrame:
    """Rows of a film with their truth."""
    film = film_of(seed)
    rng = np.random.default_rng([seed, 3])
    sharp, places = wall(film, rng), paths(film, rng)
    codec, pix_fmt, options, ending = CODECS[film.codec]
    path = folder / f"{seed}.{ending}"
    make_clip(path, codec, pix_fmt, n=N, size=SIZE, picture=pictures(film, places, sharp, seed), options=options)
    names = list(SPEEDS)
    boxes = DataFrame({"target": names, "Xf": places[0, :, 0], "Yf": places[0, :, 1]})
    boxes["width"] = boxes["height"] = 2 * film.radius + 14
    try:
        with open_video(str(path)) as video:
            polarity = "dark" if film.dark else "bright"
            table = track(video.frames(), video.info, targets=names, start_boxes=boxes, polarity=polarity,
                          fields="frame").centroids  # fmt: skip
    except VidtrackError as error:
        print(f"{seed}: {error}", file=sys.stderr)
        return DataFrame()
    finally:
        path.unlink()
    who, when = table["target"].map(names.index).to_numpy(), table["frame"].to_numpy()
    out = table[["frame", "target", "Xf", "Yf", "sd_x", "sd_y", "flag"]].assign(seed=seed, **film._asdict())
    out["ex"], out["ey"] = (table[["Xf", "Yf"]].to_numpy() - places[when, who]).T
    return out


def summary(rows: DataFrame, by: str) -> str:
    lines = [
        f"{by:12} {'rows':>7} {'lost':>6} {'silent':>7} {'>1px':>6} {'rms px':>7} {'sd px':>6} {'z':>5} {'z median':>8}"
    ]
    for name, own in [*rows.groupby(by), ("all", rows)]:
        plain = own[own["flag"] == ""]
        error, sd = plain[["ex", "ey"]].to_numpy(), plain[["sd_x", "sd_y"]].to_numpy()
        silent = (np.abs(error) > np.maximum(5 * sd, 0.1)).any(axis=1)
        wrong = (np.abs(error) > 1).any(axis=1)
        z = (error / sd)[~wrong]
        rms = np.sqrt(np.mean(error[~wrong] ** 2))
        each = [np.sqrt(np.mean((part[["ex", "ey"]] / part[["sd_x", "sd_y"]].to_numpy()).to_numpy() ** 2))
                for _, part in plain[~wrong].groupby(["seed", "target"])]  # fmt: skip
        lines.append(
            f"{name!s:12} {len(own):7} {1 - len(plain) / len(own):6.3f} {silent.sum():7} {wrong.sum():6} {rms:7.3f}"
            f" {np.sqrt(np.mean(sd[~wrong] ** 2)):6.3f} {np.sqrt(np.mean(z**2)):5.2f} {np.median(each):8.2f}"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=90)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, help="one film alone")
    parser.add_argument("--save", type=Path, help="all rows, a parquet file")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--by", nargs="*", default=["texture", "strength", "blur", "radius", "target", "codec"])
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.count) if arguments.seed is None else [arguments.seed]
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(arguments.jobs) as pool:
        rows = concat([one for one in pool.map(partial(follow, folder=Path(folder)), seeds) if len(one)])
    if arguments.save:
        rows.to_parquet(arguments.save)
    if arguments.seed is not None:
        print(film_of(arguments.seed))
        print(rows.to_string(columns=["frame", "target", "Xf", "Yf", "ex", "ey", "sd_x", "sd_y", "flag"]))
    for by in ["target"] if arguments.seed is not None else arguments.by:
        print(summary(rows, by), "\n")


if __name__ == "__main__":
    main()
