"""A camera that was knocked between clips: one clip's balls lie elsewhere as a whole."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one_within
from vidtrack.geometry.pose import RICH, adjust, predicted
from vidtrack.labelling.label import GATE, Index, Labels, px_apart, scatter_of, spacing

ENOUGH = 12
"""Balls that the other clips must show before they predict where those of one clip should be."""


class Shift(NamedTuple):
    """Labels of a view that lies elsewhere as a whole: blob (k,), offset (2,) px."""

    blob: Index
    offset: Array


def shifted(labels: Labels, i: int) -> Shift | None:
    """Labels of view i after moving it as a whole, where that finds most of its points and the fit as it is does not.

    A camera that was knocked between clips does this. Moves up to 0.45 of the balls' spacing can be recognised.
    """
    view, at = labels.views[i], labels.projected[i]
    seen = np.isfinite(at).all(-1).sum()
    if seen < 4 or (labels.blob[i] >= 0).sum() > 0.5 * seen or not len(view.blobs):
        return None
    rough = one_to_one_within(px_apart(at, view.blobs), 0.45 * spacing([view]))
    has = rough >= 0
    if has.sum() < 4:
        return None
    offset = np.median((view.blobs[rough] - at)[has], axis=0)
    blob = one_to_one_within(px_apart(at + offset, view.blobs), 2 * GATE * labels.sd)
    return Shift(blob, offset) if (blob >= 0).sum() > 0.7 * seen else None


def moved(labels: Labels, points: Array) -> dict[int, Array]:
    """The view whose balls lie elsewhere as a whole, and by how much (2,) px, by the fit to all other views; or none.

    points  (m, 3) world units
    Only what is far beyond the uncertainty of that fit counts: five sigma, four times the scatter, and 1 px.
    """
    best: tuple[float, int, Array] | None = None
    for i, view in enumerate(labels.views):
        p, b = _pairs(labels, points, [k for k in range(len(labels.views)) if k != i])
        has = labels.blob[i] >= 0
        fit = adjust(labels.pose.camera, p, b, labels.sd, terms=RICH) if len(p) >= ENOUGH and has.sum() >= 4 else None
        if fit is None:
            continue
        sd = scatter_of(fit)
        at, covariance = predicted(fit, points[view.points[has]])
        offset = (view.blobs[labels.blob[i][has]] - at).mean(0)
        known = covariance.mean(0) * (sd / labels.sd) ** 2 + sd**2 / has.sum() * np.eye(2)
        far = offset @ np.linalg.solve(known, offset) > 25 and np.linalg.norm(offset) > max(1.0, 4 * sd)
        if best is None or sd < best[0]:
            best = (sd, i, offset if far else np.full(2, np.nan))
    return {} if best is None or np.isnan(best[2]).any() else {best[1]: best[2]}


def _pairs(labels: Labels, points: Array, views: list[int]) -> tuple[Array, Array]:
    """World points (n, 3) and their blobs (n, 2) px in some of the views."""
    none: list[tuple[Array, Array]] = [(np.zeros((0, 3)), np.zeros((0, 2)))]
    for k in views:
        view, blob = labels.views[k], labels.blob[k]
        none.append((points[view.points[blob >= 0]], view.blobs[blob[blob >= 0]]))
    return np.concatenate([p for p, _ in none]), np.concatenate([b for _, b in none])
