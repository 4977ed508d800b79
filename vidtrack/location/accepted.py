"""Which positions are accepted, and for which moments each target has a row."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.triangulate import Located

BY_CHANCE = 0.3
"""Share of a target's samples on which cameras disagree above which two that agree now and then do so by chance."""


def limits_of(sd: Array, b: Array, least_px: float, beyond: float) -> Array:
    """How far (n_cameras, m, M), px, each measurement may lie from the located point.

    sd, b    (n_cameras, m, M, 2) px, NaN in b where nothing was measured
    beyond   so many of its own sd, or of the usual one, or `least_px`, whichever is most: a camera that says itself how
             roughly it sees a target does not contradict the others
    """
    known = sd[np.isfinite(b)]
    least = max(least_px, beyond * float(np.median(known))) if known.size else least_px
    return np.asarray(np.fmax(beyond * sd.max(axis=-1), least))


def without_chance(located: Located) -> Located:
    """Positions of two cameras dropped where a target's cameras disagree so often that agreement says nothing."""
    found = np.isfinite(located.point[..., 0])
    tried = (found | located.disagree).sum(-1, keepdims=True)
    chance = located.disagree.sum(-1, keepdims=True) > BY_CHANCE * tried
    drop = chance & found & (located.n_cameras == 2)
    return located._replace(
        point=np.where(drop[..., None], np.nan, located.point),
        sigma=np.where(drop[..., None], np.nan, located.sigma),
        n_cameras=np.where(drop, 0, located.n_cameras),
        disagree=located.disagree | drop,
    )


def without_far(located: Located, max_miss: float) -> Located:
    """Positions dropped where lines of sight miss them by more than so many world units."""
    far = located.miss > max_miss
    return located._replace(
        point=np.where(far[..., None], np.nan, located.point),
        sigma=np.where(far[..., None], np.nan, located.sigma),
        n_cameras=np.where(far, 0, located.n_cameras),
    )


def rows_kept(point: Array, short: Bools) -> Bools:
    """The rows (m, M) of points (m, M, d): all moments; of those that are `short` (m,) from first to last fix."""
    found = np.isfinite(point[..., 0])
    inside = (np.cumsum(found, axis=1) > 0) & (np.cumsum(found[:, ::-1], axis=1)[:, ::-1] > 0)
    return np.asarray(inside | ~np.asarray(short, bool)[:, None])
