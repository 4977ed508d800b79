"""How surely calibration balls get their names: the thesis's rig, a few careless picks, many trials.

    python benchmarks/labelling.py [trials]

Each trial: 64 balls in four clips, survey error 1/16 in, 0.1 px of noise, 4 to 7 picks in one clip, each up to 10 px
off (neighbours are 20 px apart). `clean` shows every ball; `harsh` hides 3 and adds 5 blobs that are no ball.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from vidtrack.geometry.camera import Camera, project
from vidtrack.labelling.configuration import label_with
from vidtrack.labelling.label import Picks, View
from vidtrack.labelling.seeds import on_one_line
from vidtrack.simulate.rig import thesis_points, thesis_rig

TAGS, POINTS = thesis_points()
SIZE = (512, 480)


def trial(camera: Camera, rng: np.random.Generator, hidden: int, stray: int) -> tuple[int, int, int]:
    """How many answers, how many balls named, how many of them wrongly."""
    b = project(camera, POINTS + rng.normal(0, 1 / 16, POINTS.shape)) + rng.normal(0, 0.1, (64, 2))
    gone = rng.choice(64, hidden, replace=False)
    where = rng.integers(0, 4, stray)
    views, truth = [], []
    for clip in range(4):
        row = np.arange(16 * clip, 16 * clip + 16)
        who = np.concatenate([np.setdiff1d(row, gone), np.full((where == clip).sum(), -1)])
        xy = np.where(who[:, None] >= 0, b[who], rng.uniform((100, 80), (420, 400), (len(who), 2)))
        order = rng.permutation(len(who))
        views.append(View(row, xy[order], np.full((len(who), 2), 4.0)))
        truth.append(who[order])
    clip, n = int(rng.integers(4)), int(rng.integers(4, 8))
    chosen = rng.choice(np.arange(16 * clip, 16 * clip + 16), n, replace=False)
    while on_one_line(POINTS[chosen]):
        chosen = rng.choice(np.arange(16 * clip, 16 * clip + 16), n, replace=False)
    angle, off = rng.uniform(0, 2 * np.pi, n), 10 * np.sqrt(rng.uniform(0, 1, n))
    xy = b[chosen] + off[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    found = label_with(POINTS, views, Picks(np.full(n, clip), chosen, xy), SIZE)
    if not found:
        return 0, 0, 0
    named = [(who[j[j >= 0]], v.points[j >= 0]) for v, j, who in zip(views, found[0].blob, truth, strict=True)]
    return len(found), found[0].matched, sum(int((is_ != said).sum()) for is_, said in named)


def main(trials: int) -> None:
    for name, hidden, stray in (("clean", 0, 0), ("harsh", 3, 5)):
        for camera in thesis_rig():
            begin = time.process_time()
            results = [trial(camera, np.random.default_rng(seed), hidden, stray) for seed in range(trials)]
            each = (time.process_time() - begin) / trials
            right = sum(r == (1, 64 - hidden, 0) for r in results)
            wrong = sum(r[2] for r in results)
            print(f"{name} {camera.name}: {right} of {trials} complete, {wrong} wrong names, {each:.2f} s each")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
