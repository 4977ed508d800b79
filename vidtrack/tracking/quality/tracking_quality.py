"""How well targets were tracked: pixel locking, pixel counts, what was lost and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array


@dataclass(frozen=True)
class Histogram:
    """How positions within a pixel are counted.

    bins  in a pixel
    """

    bins: int = 20


HISTOGRAM = Histogram()


def pixel_locking(x: Array) -> dict[str, Any]:
    """Histogram of positions within a pixel; flat unless centroids prefer some place in it.

    x  px, any shape; NaN is left out. `excess` is how far the fullest bin stands above the mean, as a share of the
    mean; `expected` what chance alone would give for targets that go everywhere, so resting targets exceed it.
    """
    middle = x[np.isfinite(x)] + 0.5
    place = (HISTOGRAM.bins * (middle - np.floor(middle))).astype(np.intp)
    counts = np.bincount(np.minimum(place, HISTOGRAM.bins - 1), minlength=HISTOGRAM.bins)
    mean = counts.mean()
    return {
        "edges": np.linspace(-0.5, 0.5, HISTOGRAM.bins + 1),
        "counts": counts,
        "excess": float(counts.max() / mean - 1) if mean else np.nan,
        "expected": float(2.2 / np.sqrt(mean)) if mean else np.nan,  # the largest of 20 normal deviates
    }


def pixel_counts(pixels: Array) -> dict[str, Array]:
    """Mean, standard deviation, least and most pixels of each target; pixels (samples, n), NaN left out; (n,) each."""
    seen = np.isfinite(pixels)
    count = np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
    filled = np.where(seen, pixels, 0.0)
    mean = filled.sum(axis=0) / count
    spread = np.where(seen, (pixels - mean) ** 2, 0.0).sum(axis=0) / count
    least, most = (np.where(seen, pixels, fill).T for fill in (np.inf, -np.inf))
    none = ~seen.any(axis=0)
    return {
        "mean": mean,
        "sd": np.sqrt(spread),
        "min": np.where(none, np.nan, least.min(axis=1, initial=np.inf)),
        "max": np.where(none, np.nan, most.max(axis=1, initial=-np.inf)),
    }


def shares(flag: NDArray[np.int64], words: Sequence[str]) -> dict[str, Array]:
    """Share of the samples that bear each flag; flag (samples, n), (n,) each."""
    total = max(len(flag), 1)
    return {word: ((flag >> bit) & 1).sum(axis=0) / total for bit, word in enumerate(words)}


def described(flag: NDArray[np.int64], words: Sequence[str]) -> NDArray[np.object_]:
    """Flags as text, words joined by `;`, empty where all is well; the shape of `flag`."""
    kinds = range(1 << len(words))
    texts = [";".join(word for bit, word in enumerate(words) if kind >> bit & 1) for kind in kinds]
    text: NDArray[np.object_] = np.array(texts, object)[flag]
    return text
