"""One ball beside, behind or before a rope or an edge that is a little darker or brighter: errors beside their sd.

    python benchmarks/grazed.py [FIRST LAST]

Films of 60 pictures drawn from the seeds FIRST to LAST (0 to 60). Printed: samples with an empty flag, those more
than 5 sd and 0.08 px off, those more than 5 sd and 0.5 px, samples that are not measured or flagged, median sd (px).
"""

from __future__ import annotations

import sys
from fractions import Fraction
from typing import NamedTuple

import cv2
import numpy as np
import pandas as pd
from scipy.special import ndtr

from vidtrack.arrays import Array
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo

RATE, SHAPE, SAMPLES = Fraction(30), (110, 150), 60


class Film(NamedTuple):
    """Pictures, and where the ball is (samples, 2) px."""

    frames: list[Frame]
    place: Array


def film(seed: int) -> Film:
    """The film of a seed."""
    rng, t = np.random.default_rng(seed), np.arange(SAMPLES)
    radius = float(rng.choice([3, 4, 5, 6, 7, 9, 12]))
    level, light = rng.uniform(15, 60), rng.uniform(60, 180)
    noise, blur = rng.uniform(1, 4), rng.uniform(0.4, 1.0)
    edge = rng.choice(["rope", "rope", "edge"]) == "edge"
    width, angle = rng.uniform(1, 8), rng.uniform(0, np.pi)
    dim = -rng.uniform(0.3, 1) * level if rng.random() < 0.7 else rng.uniform(10, 0.6 * light)
    in_front, moving = rng.random() < 0.6, rng.random() < 0.3
    closest = rng.uniform(-0.5 * radius, radius + 4 + width / 2)
    across, along = np.array([np.sin(angle), -np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
    middle, half = np.array([75.0, 55.0]), SAMPLES / 2
    away = closest + (radius + 12) * ((t - half) / half) ** 2
    place = middle + away[:, None] * across + np.linspace(-25, 25, SAMPLES)[:, None] * along
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)
    soft, frames = np.hypot(blur, 0.29), []
    for i in range(SAMPLES):
        off = (x - middle[0]) * across[0] + (y - middle[1]) * across[1] + (3 * np.sin(i / 9) if moving else 0)
        cover = ndtr(-off / soft) if edge else ndtr((width / 2 - np.abs(off)) / soft)
        disc = ndtr((radius - np.hypot(x - place[i, 0], y - place[i, 1])) / soft)
        picture = np.full(SHAPE, level)
        layers = [(disc, level + light), (cover, level + dim)]
        for share, grey in layers if in_front else layers[::-1]:
            picture += share * (grey - picture)
        luma = np.clip(np.rint(picture + rng.normal(0, noise, SHAPE)), 0, 255).astype(np.uint8)
        frames.append(Frame(i, i / RATE, luma, False, None))
    return Film(frames, place)


def main() -> None:
    first, last = (int(a) for a in sys.argv[1:3]) if len(sys.argv) > 2 else (0, 60)
    cv2.setNumThreads(1)
    rows, sds = np.zeros(4, int), []
    for seed in range(first, last):
        one = film(seed)
        boxes = pd.DataFrame({"target": ["a"], "Xf": one.place[:1, 0], "Yf": one.place[:1, 1]})
        info = VideoInfo(SHAPE[1], SHAPE[0], RATE, field_order="progressive")
        table = track(one.frames, info, targets=["a"], start_boxes=boxes).centroids
        error, sd = table[["Xf", "Yf"]].to_numpy() - one.place, table[["sd_x", "sd_y"]].to_numpy()
        plain = (table["flag"] == "").to_numpy() & np.isfinite(error).all(axis=1)
        off = [plain & ((np.abs(error) > 5 * sd) & (np.abs(error) > px)).any(axis=1) for px in (0.08, 0.5)]
        rows += [plain.sum(), off[0].sum(), off[1].sum(), (~plain).sum()]
        sds.append(sd[plain].ravel())
    sd = float(np.median(np.concatenate(sds)))
    print(
        f"samples {rows[0]}, off by 5 sd and 0.08 px {rows[1]}, 0.5 px {rows[2]}, not plain {rows[3]}, sd {sd:.4f} px"
    )


if __name__ == "__main__":
    main()
