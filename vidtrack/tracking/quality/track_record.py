"""What the track stage records of a recording besides its tables: plain values, and pictures of the worst moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.tracking.crops import Crop
from vidtrack.tracking.quality.tracking_quality import described, pixel_counts, pixel_locking, shares
from vidtrack.tracking.state import FLAGS, PIXELS, Rows, X, Y, present
from vidtrack.tracking.uncertainty.empirical_sd import Scatter


def diagnosed(
    rows: Rows, frame: NDArray[np.int64], field: NDArray[np.object_], names: Sequence[str], crops: Sequence[Crop]
) -> dict[str, Any]:
    """Pixel locking, pixel counts, what was lost and why, and pieces of pictures at the worst moments.

    frame, field   (samples,) which a sample is of
    """
    measured = present(rows).mean(axis=0) if len(rows.flag) else np.zeros(len(names))
    counts, share = pixel_counts(rows.values[PIXELS]), shares(rows.flag, FLAGS)
    each = {
        name: {
            "measured": float(measured[i]),
            "flags": {word: float(values[i]) for word, values in share.items() if values[i]},
            "pixels": {word: float(values[i]) for word, values in counts.items()},
        }
        for i, name in enumerate(names)
    }
    total = {word: float(values[0]) for word, values in pixel_counts(rows.total_pixels[:, None]).items()}
    return {
        "samples": len(rows.flag),
        "measured": float(measured.mean()) if len(names) else 0.0,
        "targets": each,
        "total_pixels": total,
        "pixel_locking": {"x": pixel_locking(rows.values[X]), "y": pixel_locking(rows.values[Y])},
        "worst": [
            {
                "frame": int(frame[crop.sample]),
                "field": str(field[crop.sample]),
                "target": names[crop.target],
                "flag": str(described(np.array(crop.flag), FLAGS)),
                "picture": crop.picture,
            }
            for crop in crops
        ],
    }


def record_scatter(diagnostics: dict[str, Any], seen: Scatter, names: Sequence[str]) -> None:
    """Add to the diagnostics by how much the sd was grown."""
    for i, name in enumerate(names):
        x, y = seen.factor[:, i]
        diagnostics["targets"][name]["sd_grown"] = {"x": float(x), "y": float(y)}
    if names:
        x, y = np.median(seen.factor, axis=1)
        diagnostics["sd"] = (
            f"sd grown by {x:.2f} in X, {y:.2f} in Y: so much more do the tracks scatter than noise "
            "and contrast explain (median of the targets)"
        )
