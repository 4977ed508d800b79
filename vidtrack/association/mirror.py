"""Mirror images: of two trajectories one may be the other's reflection, in still water or in a window.

What is mirrored in a plane of normal n lies opposite: p - p' is along n at all times, and so is the middle of both a
plane's distance from the origin along n. The target itself is on the side of the plane on which the cameras are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Ints


@dataclass(frozen=True)
class Limits:
    """When two trajectories mirror each other.

    fewest   moments at which both are located, at least
    leaves   rms of what a reflection leaves, over the rms by which the distance of the two changes, at most: a water
             surface is never quite plane
    changes  rms by which the distance of the two changes, over their noise, at least: two points of a rigid body that
             keeps its attitude would else mirror each other too
    some     moments, about, at which all pairs are looked at before any is judged
    """

    fewest: int = 20
    leaves: float = 0.1
    changes: float = 10.0
    some: int = 400


LIMITS = Limits()


def reflected(one: Array, other: Array, eyes: Array) -> int | None:
    """Which of two trajectories (n, 3), 0 or 1, is the mirror image of the other; None where neither is.

    one, other   at the same moments, NaN where they are not located
    eyes         (n_cameras, 3) where the cameras are
    """
    known = np.isfinite(one).all(-1) & np.isfinite(other).all(-1)
    if known.sum() < LIMITS.fewest:
        return None
    p, q = one[known], other[known]
    apart = p - q
    n = np.linalg.svd(apart, full_matrices=False)[2][0]
    along = apart @ n
    aside = apart - along[:, None] * n
    plane = (p + q) @ n / 2
    leaves = np.sqrt((aside**2).sum(-1).mean() + 4 * plane.var())
    changes = along.std()
    noise = max(_noise(p), _noise(q))
    if changes < LIMITS.changes * noise or leaves > LIMITS.leaves * changes:
        return None
    if np.sign(along).min() != np.sign(along).max():
        return None  # they pass through each other
    side = eyes @ n - plane.mean()
    if np.sign(side).min() != np.sign(side).max():
        return None
    return int(np.sign(side[0]) == np.sign(along[0]))


def images_among(moments: Sequence[Ints], places: Sequence[Array], eyes: Array) -> dict[int, int]:
    """Which of m trajectories are mirror images, each with that which it is the image of.

    moments   (k,) of each, rising; places (k, 3) there
    """
    images: dict[int, int] = {}
    for i, j in _opposite(moments, places):
        _, a, b = np.intersect1d(moments[i], moments[j], assume_unique=True, return_indices=True)
        which = reflected(places[i][a], places[j][b], eyes)
        if which is not None:
            images[(i, j)[which]] = (i, j)[1 - which]
    return images


def _opposite(moments: Sequence[Ints], places: Sequence[Array]) -> list[tuple[int, int]]:
    """Pairs of trajectories whose difference keeps its direction, at some of the moments."""
    if len(moments) < 2:
        return []
    last = max(int(own[-1]) for own in moments if own.size) if any(own.size for own in moments) else -1
    there = np.zeros(last + 1, bool)
    for own in moments:
        there[own] = True
    at = np.flatnonzero(there)
    some = at[:: max(1, at.size // LIMITS.some)]
    p = np.full((len(moments), some.size, 3), np.nan)
    for k, (own, place) in enumerate(zip(moments, places, strict=True)):
        if own.size:
            a = np.minimum(np.searchsorted(own, some), own.size - 1)
            b = np.flatnonzero(own[a] == some)
            p[k, b] = place[a[b]]
    out = []
    for i in range(len(p) - 1):
        apart = np.nan_to_num(p[i] - p[i + 1 :])
        values = np.linalg.eigvalsh(np.einsum("kmi,kmj->kij", apart, apart))
        alike = (values[:, 0] + values[:, 1] <= LIMITS.leaves**2 * values[:, 2]) & (values[:, 2] > 0)
        out += [(i, i + 1 + int(k)) for k in np.flatnonzero(alike)]
    return out


def _noise(p: Array) -> float:
    """Standard deviation of the noise of a smooth course, world units: by its second differences."""
    bend = np.diff(p, 2, axis=0)
    return float(np.sqrt(np.median((bend**2).sum(-1)) / 6)) if len(bend) else 0.0
