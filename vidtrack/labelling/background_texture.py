"""What a pattern behind the balls does to their centroids.

A background with a grain lights the pixels about a ball's rim unevenly, the same in every frame: averaging takes
nothing of it away, and the scatter of single frames does not show it. How large it is can be read off the picture:
the first moment of the pixels of such a rim, taken where there is no ball, over the ball's mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.labelling.still import Still
from vidtrack.tracking.detection.blobs import Blobs


@dataclass(frozen=True)
class TextureSettings:
    """Where and how the background is looked at.

    inside_px, outside_px  the rim, from the radius of the blob's pixels
    places                 at most so many places without a ball
    fewest                 so few places say nothing
    nearby                 places next to a ball by which its background is judged: a pattern may be in one part
    over_noise             times the variance that noise alone leads to expect, from which on there is a pattern
    """

    inside_px: float = 0.5
    outside_px: float = 2.5
    places: int = 400
    fewest: int = 20
    nearby: int = 30
    over_noise: float = 3.0


TEXTURE = TextureSettings()


def texture_sd(still: Still, blobs: Blobs, noise: float | None = None) -> Array:
    """(n, 2) px, standard deviation of each blob's centroid by the background's pattern; 0 where there is none.

    noise  grey levels, of a pixel of a lone frame
    """
    n = len(blobs.Xf)
    out = np.zeros((n, 2))
    if not n:
        return out
    radius = np.sqrt(blobs.pixels / np.pi)
    flat = _without_shading(still.mean, blobs, 4.0 * float(np.median(radius)) + 1.0)
    each = still.sd if still.frames > 1 else np.full(still.mean.shape, noise or 0.0, np.float32)
    variance = float(np.median(each)) ** 2 / still.frames
    rounded = np.maximum(np.rint(2 * radius) / 2, 1.0)
    for r in np.unique(rounded):
        reach = int(np.ceil(r + TEXTURE.outside_px))
        windows, places = _windows(flat, blobs, reach)
        if len(windows) < TEXTURE.fewest:
            continue
        y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        d = np.hypot(x, y)
        rim = (d >= r - TEXTURE.inside_px) & (d <= r + TEXTURE.outside_px)
        own = np.flatnonzero(rounded == r)
        off = np.hypot(places[:, 0] - blobs.Xf[own, None], places[:, 1] - blobs.Yf[own, None])
        near = np.argsort(off, axis=1, kind="stable")[:, : TEXTURE.nearby]
        for k, along in enumerate((x * rim, y * rim)):
            moment = np.tensordot(windows, along.astype(float), 2)[near]
            middle = np.median(moment, axis=1, keepdims=True)
            spread = (1.4826 * np.median(np.abs(moment - middle), axis=1)) ** 2
            alone = variance * float((along**2).sum())
            patterned = spread > TEXTURE.over_noise * alone
            out[own, k] = np.sqrt(np.where(patterned, spread - alone, 0.0)) / np.maximum(blobs.mass[own], 1e-9)
    return out


def _without_shading(mean: NDArray[np.float32], blobs: Blobs, wide: float) -> Array:
    """The picture without what varies over more than `wide` px; of the background, the blobs left out."""
    other = _free(mean.shape, blobs, 4).astype(np.float32)
    share = cv2.GaussianBlur(other, (0, 0), wide)
    smooth = cv2.GaussianBlur(np.asarray(mean, np.float32) * other, (0, 0), wide) / np.maximum(share, 1e-3)
    return np.asarray(mean - smooth)


def _free(shape: tuple[int, ...], blobs: Blobs, room: int) -> NDArray[np.bool_]:
    """Where no blob is, nor `room` px about it."""
    free = np.ones(shape, bool)
    for left, top, w, h in zip(blobs.left, blobs.top, blobs.width, blobs.height, strict=True):
        free[max(top - room, 0) : top + h + room, max(left - room, 0) : left + w + room] = False
    return free


def _windows(flat: Array, blobs: Blobs, reach: int) -> tuple[Array, Array]:
    """Windows (m, 2 reach + 1, 2 reach + 1) of the picture at places of a grid where no blob is, and their middles
    (m, 2) px."""
    rows, columns = flat.shape
    if min(rows, columns) <= 2 * reach + 1:
        return np.zeros((0, 2 * reach + 1, 2 * reach + 1)), np.zeros((0, 2))
    free = _free(flat.shape, blobs, 2 * reach)
    step = max(1, int(np.sqrt((rows - 2 * reach) * (columns - 2 * reach) / (4 * TEXTURE.places))))
    at = np.argwhere(free[reach : rows - reach : step, reach : columns - reach : step]) * step
    at = at[:: max(1, len(at) // TEXTURE.places)]
    views = np.lib.stride_tricks.sliding_window_view(flat, (2 * reach + 1, 2 * reach + 1))
    middles = np.asarray(at[:, ::-1] + float(reach), float)
    return np.asarray(views[at[:, 0], at[:, 1]], float), middles
