"""Why a target that was sought is not measured: what there is shows several things, a part of it, or nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.candidates import within
from vidtrack.tracking.discs.clump import FEWEST, elongation
from vidtrack.tracking.discs.two_discs import TWO_DISCS
from vidtrack.tracking.recovery.separation import Scene, Separation
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import EDGE, LOST, MERGED, PIXELS, POSITION, SMALL, XX, XY, YY, Found, Searched, X, Y


@dataclass(frozen=True)
class Unmeasured:
    """When what is there is no single target.

    larger   of a target's pixels: what it lies in is more than itself
    beside   of a blob's radius, and px besides, from its middle: what was measured there is a part of it
    """

    larger: float = 1.5
    beside: float = 0.15
    beside_px: float = 1.0


UNMEASURED = Unmeasured()


def two_in_one(now: Searched, sample: Sample, found: Found, separation: Separation, scene: Scene) -> Bools:
    """Which of the targets that a search would find (m,) are a blob of two, as a followed one is looked at.

    A blob beside whose middle another track was measured in this sample is that one and more.
    """
    out = np.zeros(found.who.size, bool)
    long = elongation(*found.values[[XX, YY, XY]]) > TWO_DISCS.elongated
    large = found.values[PIXELS] * sample.lines >= FEWEST
    others = np.setdiff1d(np.flatnonzero(np.isfinite(now.values[X])), found.who)
    if others.size:
        off = np.abs(found.values[POSITION][:, :, None] - now.values[POSITION, None, others])
        half = found.size * np.array([[1], [sample.lines]]) / 2
        beside = np.hypot(*off) > UNMEASURED.beside * half.mean(axis=0)[:, None] + UNMEASURED.beside_px
        out |= ((off < half[..., None]).all(axis=0) & beside).any(axis=1)
    if (long & large & ~out).any():
        seen = now.found(found)
        for i in np.flatnonzero(long & large & ~out).tolist():
            out[i] = separation.pair(seen, sample, int(found.who[i]), scene) is not None
    return out


def covering(now: Searched, lines: int, who: Ints, predicted: Array, near: Blobs) -> Array:
    """Pixels of the largest blob about each predicted place (m, 2) px that is more than the target; NaN: there is none.

    lines  of the frame buffer to a row of the sample
    """
    large = near.pixels > UNMEASURED.larger * np.nan_to_num(now.state.appearance.pixels[who, None], nan=np.inf)
    over = within(near, predicted, lines) & large & ~near.edge
    most = np.where(over, near.pixels, 0).max(axis=1, initial=0)
    return np.where(most > 0, most, np.nan)


def reasons(now: Searched, sample: Sample, who: Ints, predicted: Array, near: Blobs, scene: Scene) -> NDArray[np.int64]:
    """Why targets `who` were not measured: merged, cut by the picture's edge, too small; or simply lost.

    predicted  (m, 2) px, where they were sought; near: what was there
    """
    appearance = now.state.appearance
    over = within(near, predicted, sample.lines)
    why = np.where((over & near.edge).any(axis=1), EDGE, 0)
    shared = within(near, predicted, sample.lines, slack=0.0).sum(axis=0) > 1
    covered = np.isfinite(covering(now, sample.lines, who, predicted, near))
    why = np.where(covered | (over & shared & ~near.edge).any(axis=1), MERGED, why)
    others = np.flatnonzero(np.isfinite(now.values[X]))
    if others.size:
        apart = np.abs(predicted[:, None] - now.values[[X, Y]][:, others].T)
        close = apart < now.state.sizes(sample.lines, others)
        why = np.where((why == 0) & np.all(close, axis=-1).any(axis=1), MERGED, why)
    if scene.static is not None:
        hidden = scene.static.touched([sample], *predicted.T[:, None], *appearance.size[:, who])[0]
        why = np.where(hidden & (why == 0), MERGED, why)
    tiny = over & (near.pixels < scene.detection.min_pixels)
    why = np.where((why == 0) & tiny.any(axis=1), SMALL, why)
    return np.where(why > 0, why, LOST)
