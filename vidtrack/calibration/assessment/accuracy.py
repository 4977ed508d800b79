"""The thesis's table of errors (6.8): mean and largest by axis, and as a share of the lengths that matter."""

from __future__ import annotations

from typing import Any

import numpy as np

from vidtrack.arrays import Array

AXES = ("x", "y", "z")


def errors_by_axis(error: Array, *, largest_distance: float, diagonal_field: float) -> dict[str, Any]:
    """The thesis's table (6.8) of errors (n, 3), world units: located minus surveyed; NaN is passed over.

    Mean and largest magnitude by axis, the mean also in percent of the largest distance between two points and of
    the diagonal field; then the same of the 3-D error, and one over its mean's share of the diagonal field.
    """
    e = np.abs(error[np.isfinite(error).all(-1)])
    mean = e.mean(0) if len(e) else np.full(3, np.nan)
    largest = e.max(0) if len(e) else np.full(3, np.nan)
    length = np.linalg.norm(e, axis=-1)
    mean_3d = float(length.mean()) if len(e) else np.nan
    return {
        "n": len(e),
        "mean_abs": by_axis(mean),
        "max_abs": by_axis(largest),
        "mean_abs_percent_of_largest_distance": by_axis(100 * mean / largest_distance),
        "mean_abs_percent_of_diagonal_field": by_axis(100 * mean / diagonal_field),
        "mean_3d": mean_3d,
        "rms_3d": float(np.sqrt((length**2).mean())) if len(e) else np.nan,
        "max_3d": float(length.max()) if len(e) else np.nan,
        "one_over_share_of_diagonal_field": diagonal_field / mean_3d if mean_3d else np.nan,
        "one_over_share_of_diagonal_field_by_axis_mean": diagonal_field / mean.mean() if mean_3d else np.nan,
    }


def largest_distance(p: Array) -> float:
    """The largest distance between any two of n points (n, 3), world units; 0 for a single one."""
    p = p[np.isfinite(p).all(-1)]
    if len(p) > 500:  # only points of the convex hull can be farthest apart
        from scipy.spatial import ConvexHull, QhullError

        try:
            p = p[ConvexHull(p).vertices]
        except QhullError:  # points in one plane, or fewer directions still
            p = p[:: max(len(p) // 2000, 1)]
    return float(max((np.linalg.norm(p - q, axis=-1).max() for q in p), default=0.0))


def by_axis(values: Array) -> dict[str, float]:
    """Three values under the names of their axes."""
    return dict(zip(AXES, np.asarray(values, float).tolist(), strict=True))
