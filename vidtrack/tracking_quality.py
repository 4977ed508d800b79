"""How well targets were tracked: pixel locking, pixel counts, what was lost and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 20


def pixel_locking(x: Array) -> dict[str, Any]:
    """Histogram of positions within a pixel; flat unless centroids prefer some place in it.

    x  px, any shape; NaN is left out. `excess` is how far the fullest bin stands above the mean, as a share of the
    mean; `expected` what chance alone would give for targets that go everywhere, so resting targets exceed it.
    """
    fraction = np.mod(x[np.isfinite(x)] + 0.5, 1.0)
    counts, edges = np.histogram(fraction, bins=BINS, range=(0, 1))
    mean = counts.mean()
    return {
        "edges": edges - 0.5,
        "counts": counts,
        "excess": float(counts.max() / mean - 1) if mean else np.nan,
        "expected": float(2.2 / np.sqrt(mean)) if mean else np.nan,  # the largest of 20 normal deviates
    }


def pixel_counts(pixels: Array) -> dict[str, float]:
    """Mean, standard deviation, least and most of the pixels of a target, NaN left out."""
    seen = pixels[np.isfinite(pixels)]
    if seen.size == 0:
        return {"mean": np.nan, "sd": np.nan, "min": np.nan, "max": np.nan}
    return {
        "mean": float(seen.mean()),
        "sd": float(seen.std()),
        "min": float(seen.min()),
        "max": float(seen.max()),
    }


def shares(flag: NDArray[np.int64], words: Sequence[str]) -> dict[str, float]:
    """Share of the samples that bear each flag; only those that occur."""
    if flag.size == 0:
        return {}
    share = {word: float(((flag >> bit) & 1).mean()) for bit, word in enumerate(words)}
    return {word: value for word, value in share.items() if value}


def described(flag: NDArray[np.int64], words: Sequence[str]) -> NDArray[np.object_]:
    """Flags as text, words joined by `;`, empty where all is well; the shape of `flag`."""
    kinds, which = np.unique(flag, return_inverse=True)
    texts = [";".join(word for bit, word in enumerate(words) if kind >> bit & 1) for kind in kinds.tolist()]
    text: NDArray[np.object_] = np.array(texts, object)[which.reshape(flag.shape)]
    return text
