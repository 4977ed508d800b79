"""How far a neighbour pulls a target's centroid, by the gap between their edges.

    python benchmarks/neighbours.py [--films 12] [--only 0 4]

A target drifts while something comes in from a random side, from 12 px away down to touching: a second target, or a
straight rope as long as the picture that is no target. Edges are soft (exact area, blurred by 0.5 px), noise is 3 grey
levels. What the tracker makes of it is compared with the truth: bias towards the neighbour and rms error of X and Y,
px; z, the rms of error over the reported sd; and the share that was measured at all, the rest being flagged.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.discs import disc
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Starts
from vidtrack.tracking.tracker import Tracker

NOISE, LEVEL, BLUR = 3.0, 30.0, 0.5
STEP = 0.2
GAPS = (0.0, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 10, 12.1)


class Case(NamedTuple):
    """Radius px and contrast of a target and of its neighbour; of a rope, half of its width."""

    radius: float
    contrast: float
    other: float
    other_contrast: float
    rope: bool = False


CASES = (
    *(Case(r, c, r, c) for r in (1.5, 2.5, 4.0, 6.0, 15.0) for c in (200.0, 60.0)),
    Case(6.0, 200.0, 2.5, 60.0),
    Case(15.0, 200.0, 4.0, 60.0),
    *(Case(r, 200.0, 3.0, c, rope=True) for r in (2.5, 4.0, 15.0) for c in (200.0, 60.0)),
)


def film(case: Case, rng: np.random.Generator) -> tuple[list[Sample], np.ndarray, np.ndarray]:
    """Samples, gaps (k,) px and places (k, 2, 2) px of target and neighbour."""
    gaps = np.concatenate([np.full(10, 12.0), np.arange(12.0, 0.1, -STEP)])
    reach = case.radius + case.other
    side = int(2 * (reach + case.other) + 60)
    angle = rng.uniform(0, 2 * np.pi)
    towards = np.array([np.cos(angle), np.sin(angle)])
    start = (side - 1) / 2 - towards * (case.other + 3) + rng.uniform(-1, 1, 2)
    drift = rng.uniform(-0.07, 0.07, 2)
    samples, places = [], []
    y, x = np.mgrid[:side, :side]
    for k, gap in enumerate(gaps):
        a = start + drift * k
        b = a + towards * (reach + gap)
        if case.rope:
            deep = (x - b[0]) * towards[0] + (y - b[1]) * towards[1]
            beside = np.clip(case.other + 0.5 - np.abs(deep), 0, 1)
        else:
            beside = disc((side, side), *b, case.other)
        light = case.contrast * disc((side, side), *a, case.radius) + case.other_contrast * beside
        picture = LEVEL + cv2.GaussianBlur(light, (0, 0), BLUR) + rng.normal(0, NOISE, light.shape)
        samples.append(Sample(np.clip(np.rint(picture), 0, 255).astype(np.uint8), float(k)))
        places.append((a, b))
    return samples, gaps, np.array(places)


def starts(case: Case, first: np.ndarray) -> Starts:
    """Targets at (n, 2) px, whose looks are roughly known."""
    n = len(first)
    radius = np.array([case.radius, case.other])[:n]
    contrast = np.array([case.contrast, case.other_contrast])[:n]
    still, box = np.full((n, 2), np.nan), np.full((n, 2), 3 * case.radius + 20)
    size = np.repeat(2 * radius[:, None], 2, axis=1)
    return Starts(first, still, still, box, np.zeros(n, np.intp), np.pi * radius**2, contrast, np.full(n, LEVEL), size)


def follow(case: Case, seed: int) -> tuple[np.ndarray, ...]:
    """Gaps (k,), and of each target: errors (k, n, 2) px, their part towards the neighbour (k, n), sd (k, n, 2)."""
    samples, gaps, places = film(case, np.random.default_rng(seed))
    n = 1 if case.rope else 2
    tracker = Tracker(starts(case, places[0, :n]), Detection(noise=NOISE), LEVEL + case.contrast / 2)
    tracker.follow(samples)
    tracker.finish()
    values = tracker.rows().values
    error = values[:2].transpose(1, 2, 0) - places[:, :n]
    away = places[:, 1] - places[:, 0]
    away /= np.hypot(*away.T)[:, None]
    towards = np.einsum("knc,kc->kn", error, away) * np.array([1, -1])[:n]
    return gaps, error, towards, values[2:4].transpose(1, 2, 0)


def table(case: Case, films: int) -> None:
    parts = [follow(case, seed) for seed in range(films)]
    gaps, error, towards, sd = (np.concatenate(column) for column in zip(*parts, strict=True))
    for i in range(error.shape[1]):
        name = "rope" if case.rope else ("target", "neighbour")[i]
        print(f"\nr {case.radius:g} contrast {case.contrast:g}, {name if case.rope else 'target'} "
              f"{case.other:g} contrast {case.other_contrast:g}" + ("" if case.rope else f": the {name}"))  # fmt: skip
        for low, high in itertools.pairwise(GAPS):
            here = (gaps >= low - 1e-9) & (gaps < high - 1e-9)
            seen = here & np.isfinite(error[:, i, 0])
            line = f"gap {low:4.1f} to {high:4.1f}  measured {seen.sum() / here.sum():4.2f}"
            if seen.sum() > 1:
                e, z = error[seen, i], error[seen, i] / sd[seen, i]
                line += (
                    f"  bias {towards[seen, i].mean():+.4f} +- {towards[seen, i].std() / np.sqrt(seen.sum()):.4f}"
                    f"  rms {np.sqrt((e**2).mean()):.4f}  largest {np.abs(e).max():.3f}"
                    f"  z {np.sqrt((z**2).mean()):4.2f}  sd {np.median(sd[seen, i]):.4f}"
                )
            print(line, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--films", type=int, default=12)
    parser.add_argument("--only", nargs="*", type=int, default=range(len(CASES)), help="numbers of cases")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    for i in options.only:
        table(CASES[i], options.films)


if __name__ == "__main__":
    main()
