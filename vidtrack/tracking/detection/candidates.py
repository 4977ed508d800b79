"""A wider search: every blob of a piece of a sample, or of the whole, and which of them can be a lost target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.centroiding.window import WINDOW
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import (
    Blobs,
    above,
    above_local_background,
    in_frame_buffer,
    joined,
    measure_mask,
    no_blobs,
)
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Gate:
    """Which blobs may be a target.

    unlike       |log| of the ratio of pixel counts, and of contrasts, up to which a blob may be the target: between 0.4
                 and 2.5
    unreachable  a grey level that no pixel reaches
    """

    unlike: float = 0.9
    unreachable: float = 1e3


GATE = Gate()


def blobs_of(sample: Sample, detection: Detection, level: float | None, known: Array | None = None) -> Blobs:
    """Every blob of a whole sample above a grey level (of pictures turned bright); None: automatic threshold.

    known  (2, m) frame-buffer px, places whose blobs are not wanted
    """
    if known is not None:
        known = np.stack([known[0], sample.row(known[1])])
    image = detection.bright(sample.luma)
    if level is None:
        mask = above_local_background(image, detection.scale, detection.noise)
    else:
        mask = above(image, level / detection.scale)
    found = measure_mask(
        image,
        mask,
        scale=detection.scale,
        noise=detection.noise,
        min_pixels=detection.min_pixels,
        centroid=detection.centroid,
        known=known,
    )
    return in_frame_buffer(found, sample)


def blobs_near(sample: Sample, detection: Detection, boxes: Array, levels: Array) -> Blobs:
    """Every blob that lies wholly in one of the boxes (n, 4: left, top, width, height, frame-buffer px)."""
    rows, columns = sample.luma.shape
    parts = []
    for (x, y, w, h), level in zip(boxes, levels, strict=True):
        left, right = (int(np.clip(v, 0, columns)) for v in (np.floor(x), np.ceil(x + w)))
        first, last = sample.row(np.array([y, y + h]))
        top, bottom = int(np.clip(np.floor(first), 0, rows)), int(np.clip(np.ceil(last), 0, rows))
        if right - left < 3 or bottom - top < 3:
            continue
        image = detection.bright(sample.luma[top:bottom, left:right])
        found = measure_mask(
            image,
            above(image, level / detection.scale),
            scale=detection.scale,
            noise=detection.noise,
            min_pixels=1,
            centroid=detection.centroid,
        )
        parts.append(in_frame_buffer(_whole(found, image.shape, left, top, columns, rows), sample, left, top))
    return joined(parts) if parts else no_blobs()


def _whole(found: Blobs, shape: tuple[int, ...], left: int, top: int, columns: int, rows: int) -> Blobs:
    """The blobs that the piece's own border does not cut; `edge` then means the picture's edge."""
    right, bottom = found.left + found.width, found.top + found.height
    cut = ((found.left == 0) & (left > 0)) | ((right == shape[1]) & (left + shape[1] < columns))
    cut |= ((found.top == 0) & (top > 0)) | ((bottom == shape[0]) & (top + shape[0] < rows))
    return Blobs._make(values[~cut] for values in found)


def contrast_of(blobs: Blobs) -> Array:
    """Grey levels above the background, the mean of each blob."""
    return blobs.mass / np.maximum(blobs.pixels, 1)


def unlikeness(blobs: Blobs, pixels: Array, contrast: Array) -> Array:
    """How unlike blobs (m,) are to targets (n,): (n, m), inf where one cannot be the other.

    Sum of the |log| ratios of pixel counts and contrasts. Targets of unknown looks (NaN) are like anything.
    """
    size = np.abs(np.log(blobs.pixels[None] / pixels[:, None]))
    light = np.abs(np.log(np.maximum(contrast_of(blobs), 1e-3)[None] / contrast[:, None]))
    unlike = np.where(
        (size < GATE.unlike + WINDOW.grain / pixels[:, None]) & (light < GATE.unlike), size + light, np.inf
    )
    return np.where(np.isfinite(pixels)[:, None], unlike, 0.0)


def within(blobs: Blobs, position: Array, lines: int, slack: float = 2.0) -> Bools:
    """Whether positions (n, 2) px lie in the blobs' boxes, (n, m); a row of the sample is `lines` px high."""
    x, y = position[:, :1], position[:, 1:]
    inside: Bools = (x > blobs.left - slack) & (x < blobs.left + blobs.width + slack)
    return inside & (y > blobs.top - slack) & (y < blobs.top + blobs.height * lines + slack)


def levels_beside(sample: Sample, blobs: Blobs, which: Ints, detection: Detection) -> Array:
    """Grey levels beside and on some blobs, (2, n).

    Beside: the lower quarter of the pixels in a box three times as large; on: the mean of the brightest in their own
    boxes, as many as they have pixels.
    """
    levels = np.empty((2, which.size))
    rows, columns = sample.luma.shape
    top = np.rint(sample.row(blobs.top.astype(float))).astype(int)
    for i, b in enumerate(which):
        w, h, x, y = int(blobs.width[b]), int(blobs.height[b]), int(blobs.left[b]), int(top[b])
        piece = sample.luma[max(0, y - h) : min(rows, y + 2 * h), max(0, x - w) : min(columns, x + 2 * w)]
        rank = piece.size // 4
        levels[0, i] = np.partition(detection.bright(piece).ravel(), rank)[rank]
        own = detection.bright(sample.luma[y : y + h, x : x + w]).ravel()
        levels[1, i] = np.sort(own)[-int(blobs.pixels[b]) :].mean(dtype=float)
    return levels * detection.scale


def levels_in_boxes(sample: Sample, boxes: Array, pixels: Array, detection: Detection) -> Array:
    """Half-way, grey levels (n,), from what is usual in boxes (n, 4: left, top, width, height, px) to as many of their
    brightest pixels as each target has; out of reach where nothing stands out of the noise.
    """
    levels = np.full(len(boxes), GATE.unreachable)
    rows, columns = sample.luma.shape
    for i, (x, y, w, h) in enumerate(boxes):
        left, right = (int(np.clip(v, 0, columns)) for v in (x, x + w))
        top, bottom = (int(np.clip(v, 0, rows)) for v in sample.row(np.array([y, y + h])))
        light = np.sort(detection.bright(sample.luma[top:bottom, left:right]), axis=None)
        n = int(pixels[i])
        if light.size < 4 * n:
            continue
        base, on = float(np.median(light)), float(light[-n:].mean())
        half = (on - base) / 2 * detection.scale
        if half > SURROUNDINGS.stands_out * detection.noise:
            levels[i] = base * detection.scale + half
    return levels
