"""Calibration balls whose pictures touch: all that share one blob are measured by one fit of discs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.labelling.label import GATE, Labels
from vidtrack.labelling.shot import Shot
from vidtrack.tracking.discs.fit_apart import fit_apart
from vidtrack.tracking.discs.joint_fit import JOINT_FIT, shapes_of


@dataclass(frozen=True)
class Touching:
    """How touching balls are separated.

    at_most   balls in one blob
    alike     single balls nearest to them, whose size and contrast they are taken to have
    ring_px   of background about them, to which a plane is fitted
    noise     grey levels of a pixel at least: the mean of many frames has its own of quantisation
    model_px  sd at least: real balls are no even discs
    """

    at_most: int = 4
    alike: int = 6
    ring_px: int = 5
    noise: float = 0.05
    model_px: float = 0.02


TOUCHING = Touching()


class Separated(NamedTuple):
    """Balls (m,): row of the view's points; at (m, 2) px, sd (m, 2) px; pixels each one covers by itself."""

    row: Ints
    at: Array
    sd: Array
    pixels: Ints


def separated(shot: Shot, labels: Labels, view: int) -> Separated:
    """The balls of a view that share a blob and that one fit of all of them separates.

    The fit begins where the labels put them; a ball that ends up elsewhere leaves its whole group unmeasured.
    """
    shared, found = labels.shared[view], labels.blob[view]
    groups = [np.flatnonzero(shared == blob) for blob in np.unique(shared[shared >= 0])]
    parts = [part for rows in groups if (part := _group(shot, labels, view, rows, found[found >= 0])) is not None]
    if not parts:
        none = np.zeros(0, np.intp)
        return Separated(none, np.zeros((0, 2)), np.zeros((0, 2)), none)
    return Separated(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _group(shot: Shot, labels: Labels, view: int, rows: Ints, single: Ints) -> Separated | None:
    """The balls `rows` of one blob; single: blobs that are one ball each."""
    expected, blobs = labels.projected[view][rows], shot.blobs
    single = single[~blobs.edge[single] & (blobs.pixels[single] > 0)]
    if not 2 <= len(rows) <= TOUCHING.at_most or not single.size or not np.isfinite(expected).all():
        return None
    away = np.linalg.norm(shot.at[single] - expected.mean(axis=0), axis=-1)
    like = single[np.argsort(away, kind="stable")[: TOUCHING.alike]]
    pixels = np.full(len(rows), np.median(blobs.pixels[like]))
    size = np.repeat([[np.median(blobs.width[like])], [np.median(blobs.height[like])]], len(rows), axis=1)
    contrast = np.full(len(rows), np.median(blobs.mass[like] / blobs.pixels[like]))
    reach = int(np.ceil(size.max() / 2 + JOINT_FIT.reach_px)) + TOUCHING.ring_px
    low = np.floor(expected.min(axis=0)).astype(int) - reach
    high = np.ceil(expected.max(axis=0)).astype(int) + reach + 1
    height, width = shot.still.mean.shape
    left, top, right, bottom = max(0, low[0]), max(0, low[1]), min(width, high[0]), min(height, high[1])
    grey = shot.still.mean[top:bottom, left:right]
    if shot.settings.get("polarity") == "dark":
        grey = np.float32(255) - grey
    hidden = _boxes(grey.shape, left, top, shot, np.setdiff1d(np.arange(len(blobs.Xf)), labels.shared[view][rows]))
    noise = float(np.median(shot.still.sd)) / np.sqrt(max(shot.still.frames, 1))
    x, y = (expected - (left, top)).T
    fit, _ = fit_apart(grey, hidden, x, y, shapes_of(pixels, size, contrast), max(noise, TOUCHING.noise))
    if fit is None:
        return None
    at = np.stack([fit.x + left, fit.y + top], axis=-1)
    if (np.linalg.norm(at - expected, axis=-1) > GATE * labels.sd).any():
        return None
    sd = np.maximum(np.stack([fit.sd_x, fit.sd_y], axis=-1), TOUCHING.model_px)
    return Separated(rows, at, sd, np.rint(pixels).astype(np.intp))


def _boxes(shape: tuple[int, ...], left: int, top: int, shot: Shot, others: Ints) -> Bools:
    """Which pixels of a window other blobs have."""
    out, b = np.zeros(shape, bool), shot.blobs
    x0, y0 = b.left[others] - 1 - left, b.top[others] - 1 - top
    x1, y1 = x0 + b.width[others] + 2, y0 + b.height[others] + 2
    for y_0, y_1, x_0, x_1 in np.maximum([y0, y1, x0, x1], 0).T.tolist():
        out[y_0:y_1, x_0:x_1] = True
    return out
