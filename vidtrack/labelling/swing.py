"""How far a ball moves within its clip, as the grey levels along its rim show it."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array, Ints, Picture
from vidtrack.tracking.detection.blobs import Blobs

ROOM = 3
"""px about a ball's box in which its rim lies."""


def rim_movement(pictures: Picture, mean: Picture, blobs: Blobs, which: Ints) -> Array:
    """px rms (m,) by which some of the balls move, from picture to picture.

    pictures  (k, rows, columns) grey levels, of which `mean` is about the mean
    By least squares, a picture's levels less the mean's are their slopes times the movement, with none of its noise
    but what its pixels have in common. A dim or thin ball's centroid scatters with the pixels that noise lifts over
    the threshold, too. Of a ball that moves by more than its rim is wide this shows a part.
    """
    rows, columns = mean.shape
    moved = np.full(len(which), np.nan)
    for j, i in enumerate(which):
        top, left = max(0, int(blobs.top[i]) - ROOM), max(0, int(blobs.left[i]) - ROOM)
        bottom = min(rows, int(blobs.top[i] + blobs.height[i]) + ROOM)
        right = min(columns, int(blobs.left[i] + blobs.width[i]) + ROOM)
        here = mean[top:bottom, left:right].astype(float)
        slopes = np.stack(np.gradient(here)).reshape(2, -1).T
        change = (pictures[:, top:bottom, left:right] - here).reshape(len(pictures), -1).T
        change -= change.mean(axis=1, keepdims=True)
        way, left_over, *_ = np.linalg.lstsq(slopes, change, rcond=None)
        noise = left_over.sum() / (change.size - change.shape[0]) if left_over.size else 0.0
        by_noise = noise * np.trace(np.linalg.pinv(slopes.T @ slopes))
        moved[j] = np.sqrt(max(0.0, float((way**2).sum()) / (len(pictures) - 1) - by_noise))
    return moved
