"""One blob for two targets: as long as one of those asked for has never been seen, a long blob may be both of them.

Two that are too small to be fitted apart, or overlap by too much, are followed as one from the first sample on. Two
equal discs with their middles d apart have second moments along and across their line that differ by d^2 / 4,

    lambda - mu = (d / 2)^2

whatever their size and their blur: the middle of both is sqrt(lambda - mu) from the middle of either. Motion blur makes
a blob long as well: exposure^2 velocity^2 / 12 is taken off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.tracking.measurement.clump import elongation
from vidtrack.tracking.state import XX, XY, YY, Rows, X, Y


@dataclass(frozen=True)
class SharedBlob:
    """When a blob may be two targets.

    elongated  (lambda - mu) / (lambda + mu), from which on it is long: discs of 2 px radius whose middles are 0.7 radii
               apart have it; alone, with a noise of a fiftieth of their light, they have 0.085 at most, and those of
               1.5 px 0.12 in one sample of twenty
    """

    elongated: float = 0.12


SHARED_BLOB = SharedBlob()


def shared_blob_sd(rows: Rows, time: Array, exposure: float) -> Array:
    """px (samples, n), what the sd of each target holds because its blob may be two; 0 where it is plainly one, and
    where all targets were seen by then.

    time  (samples,) in samples; exposure: samples
    """
    values = rows.values
    out = np.zeros(values.shape[1:])
    seen = np.isfinite(values[X])
    unseen = ~np.logical_or.accumulate(seen, axis=0).all(axis=1)
    if not unseen.any() or seen.shape[1] < 2:
        return out
    k = np.flatnonzero(unseen)
    xx, yy, xy = (values[row][k].copy() for row in (XX, YY, XY))
    if exposure and len(time) > 2:
        v_x, v_y = (np.gradient(values[row], time, axis=0)[k] for row in (X, Y))
        streak = exposure**2 / 12
        for of, made in ((xx, v_x * v_x), (yy, v_y * v_y), (xy, v_x * v_y)):
            of -= streak * np.nan_to_num(made)
    long = elongation(xx, yy, xy)
    half = np.sqrt(np.hypot(xx - yy, 2 * xy))
    out[k] = np.where(np.isfinite(long) & (long > SHARED_BLOB.elongated), half, 0.0)
    return out
