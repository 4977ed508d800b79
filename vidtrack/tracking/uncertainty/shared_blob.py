"""One blob for two targets: as long as one of those asked for has never been seen, a long blob may be both of them; and
so may what is found where two were lost in each other.

Two that are too small to be fitted apart, or overlap by too much, are followed as one from the first sample on. Two
equal discs with their middles d apart have second moments along and across their line that differ by d^2 / 4,

    lambda - mu = (d / 2)^2

whatever their size and their blur: the middle of both is sqrt(lambda - mu) from the middle of either. Motion blur makes
a blob long as well: exposure^2 velocity^2 / 12 is taken off. So does a lens, or a pixel that is no square: where it is
known what the targets look like alone, only what is longer counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.discs.clump import elongation
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.state import MERGED, PIXELS, XX, XY, YY, Rows, X, Y


@dataclass(frozen=True)
class SharedBlob:
    """When a blob may be two targets.

    elongated  (lambda - mu) / (lambda + mu), from which on it is long: discs of 2 px radius whose middles are 0.7 radii
               apart have it; alone, with a noise of a fiftieth of their light, they have 0.085 at most, and those of
               1.5 px 0.12 in one sample of twenty
    longer     the same of what is found where two were lost, more than the targets alone have
    found      diameters of such a thing, from the last place of a target, within which it may be that
    looked_at  samples, about, from which it is known what the targets look like alone
    """

    elongated: float = 0.12
    longer: float = 0.02
    found: float = 2.0
    looked_at: int = 2000


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


def lost_pairs_sd(others: Others, rows: Rows, time: Array, exposure: float) -> Array:
    """px (N,), what the sd of other tracks holds because they may be two targets that were lost in each other there, of
    which neither or one was seen since; 0 elsewhere.

    time  (samples,) in samples; exposure: samples
    """
    values, out = others.values, np.zeros(others.sample.size)
    lost, usual = ~np.isfinite(rows.values[X]), None
    for track in np.unique(others.track):
        own = np.flatnonzero((others.track == track) & np.isfinite(values[X]))
        if not own.size:
            continue
        ends = _apart_again(rows, lost, others.sample[own[0]], values[:, own[0]])
        own = own[others.sample[own] < ends]
        if not own.size:
            continue
        usual = usual or _usual(rows)
        xx, yy, xy = (values[row][own] for row in (XX, YY, XY))
        if exposure and own.size > 2:
            v_x, v_y = (np.gradient(values[row][own], time[others.sample[own]]) for row in (X, Y))
            streak = exposure**2 / 12
            xx, yy, xy = xx - streak * v_x * v_x, yy - streak * v_y * v_y, xy - streak * v_x * v_y
        size = xx + yy
        across, slant = (xx - yy) - usual[0] * size, xy - usual[1] * size
        square = np.hypot(across, 2 * slant)
        with np.errstate(invalid="ignore"):
            out[own] = np.where(square > SHARED_BLOB.longer * size, np.sqrt(square), 0.0)
    return np.nan_to_num(out)


def _usual(rows: Rows) -> tuple[float, float]:
    """(xx - yy) and xy over xx + yy as the targets usually have them; 0 where nothing is known."""
    each = 1 + len(rows.flag) // SHARED_BLOB.looked_at
    xx, yy, xy = (rows.values[row, ::each] for row in (XX, YY, XY))
    if not np.isfinite(xx).any():
        return 0.0, 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        size = xx + yy
        return float(np.nanmedian((xx - yy) / size)), float(np.nanmedian(xy / size))


def _apart_again(rows: Rows, lost: Bools, begins: int, first: Array) -> int:
    """The sample up to which a track that begins with values `first` (MEASURED,) may be two targets; 0: it is none.

    lost  (samples, n), where targets were not measured
    """
    again = []
    for i in np.flatnonzero(lost[begins]).tolist():
        before, after = np.flatnonzero(~lost[:begins, i]), np.flatnonzero(~lost[begins:, i])
        if not before.size or not rows.flag[before[-1] + 1, i] & MERGED:
            continue
        off = rows.values[[X, Y], before[-1], i] - first[[X, Y]]
        if np.hypot(*off) < SHARED_BLOB.found * 2 * np.sqrt(first[PIXELS] / np.pi):
            again.append(begins + int(after[0]) if after.size else len(lost))
    return sorted(again)[-2] if len(again) > 1 else 0
