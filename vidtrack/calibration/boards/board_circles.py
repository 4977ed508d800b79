"""Circles of a board: their centroids in the picture, and how far these lie from where their centres are seen.

A circle that is seen aslant is an ellipse (bent by the lens) whose centroid is not where its centre is seen: nearer
parts are larger in the picture (Heikkila 2000). At 30 degrees and 40 px across that is a tenth of a pixel, and it goes
all one way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project

RIM = 48
"""Points along a circle by which its picture is drawn: the polygon's centroid is good to 1e-3 of the shift."""
AROUND = 2
"""px that are taken beyond the edge at half contrast: as wide as a sharp edge is blurred."""
RING = 2
"""px beyond these, of which the level of the paper is taken."""
LEAST_SD = 0.002
"""px"""


def centroid_shift(camera: Camera, R: Array, T: Array, centres: Array, diameter: float) -> Array:
    """How far from where each centre is seen the centroid of its circle lies, (n, q, 2) px.

    R, T      (n, 3, 3), (n, 3) the board in the world
    centres   (q, 3) on the board, whose circles lie in its plane z = 0
    diameter  world units
    NaN where a part of the circle does not project.
    """
    turn = 2 * np.pi * np.arange(RIM) / RIM
    rim = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1) * diameter / 2
    p = np.asarray(centres)[:, None] + np.concatenate([np.zeros((1, 3)), rim])  # the centre, then its rim
    world = np.einsum("nab,qkb->nqka", R, p) + np.asarray(T)[:, None, None]
    b = project(camera, world)
    middle, edge = b[..., :1, :], b[..., 1:, :]
    d = edge - middle
    after = np.roll(d, -1, axis=-2)
    cross = d[..., 0] * after[..., 1] - d[..., 1] * after[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(((d + after) * cross[..., None]).sum(-2) / (3 * cross.sum(-1))[..., None])


def disc_centroids(picture: NDArray[np.uint8], b: Array) -> tuple[Array, Array]:
    """Centroids (n, 2) of the discs at b (n, 2) px, grey levels as weights, and the sd of each (n,) px.

    A disc that touches another, or the picture's edge, stays where it was given, with an sd of a pixel's tenth.
    """
    import cv2

    apart = np.linalg.norm(b[:, None] - b[None], axis=-1) + 1e9 * np.eye(len(b))
    noise = max(float(np.median(np.abs(cv2.Laplacian(picture, cv2.CV_32F)))) / 0.6745 / np.sqrt(20.0), 0.3)
    found, sd = b.copy(), np.full(len(b), 0.1)
    grow = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * AROUND + 1,) * 2)
    ring = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * (AROUND + RING) + 1,) * 2)
    for k, near in enumerate(apart.min(1).tolist()):
        x, y = np.rint(b[k]).astype(int).tolist()
        half = int(np.ceil(near))
        left, top = x - half, y - half
        if left < 0 or top < 0 or x + half >= picture.shape[1] or y + half >= picture.shape[0]:
            half = min(x, y, picture.shape[1] - 1 - x, picture.shape[0] - 1 - y)
            left, top = x - half, y - half
            if half < 4:
                continue
        patch = picture[top : y + half + 1, left : x + half + 1].astype(np.float32)
        own = float(np.median(patch[half - 1 : half + 2, half - 1 : half + 2]))
        paper = float(np.percentile(patch, 90)) if own < np.median(patch) else float(np.percentile(patch, 10))
        sign = np.sign(paper - own)
        inside = (sign * (patch - (own + paper) / 2) < 0).astype(np.uint8)
        _, labels = cv2.connectedComponents(inside)
        disc = (labels == labels[half, half]).astype(np.uint8) if inside[half, half] else np.zeros_like(inside)
        wide, wider = cv2.dilate(disc, grow) > 0, cv2.dilate(disc, ring) > 0
        rim = wider & ~wide
        touches = (inside.astype(bool) & ~disc.astype(bool) & wider).any()
        edge = wider[0].any() or wider[-1].any() or wider[:, 0].any() or wider[:, -1].any()
        if not disc.any() or touches or edge or rim.sum() < 8:
            continue
        weight = np.where(wide, np.median(patch[rim]) - patch, 0.0)
        total = float(weight.sum())
        rows, columns = np.nonzero(wide)
        centre = np.array([(weight[rows, columns] * columns).sum(), (weight[rows, columns] * rows).sum()]) / total
        found[k] = centre + np.array([left, top])
        spread = ((np.stack([columns, rows], -1) - centre) ** 2).sum() / 2
        sd[k] = max(noise * float(np.sqrt(spread)) / abs(total), LEAST_SD)
    return found, sd
