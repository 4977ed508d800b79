"""Every blob of a picture: where it is, how large, how well known.

The picture is thresholded, the outlines of what is left are followed, and each one is measured in its own window
by the kernels of `measurement/centroid.py`. Calibration clips use this; the tracker uses `candidates.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture
from vidtrack.tracking.centroiding.centroid import measure
from vidtrack.tracking.centroiding.components import Windows, components_of, cut
from vidtrack.tracking.detect_settings import Kind
from vidtrack.tracking.detection.threshold import THRESHOLD, automatic, background_level, grey_scale, noise_sd
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class BlobSettings:
    """How blobs of a whole picture are measured.

    room_px  about a blob: three for its soft edge, three for the background
    uneven   noise sigmas: where the background varies over the picture by more, it is mapped
    raised   a patch has a threshold of its own where by its brightness that is so many times the picture's: what else
             stands out of the picture, a pattern behind the balls, sets it too low
    """

    room_px: int = 6
    uneven: float = 4.0
    raised: float = 1.5


BLOBS = BlobSettings()


class Blobs(NamedTuple):
    """Blobs from top to bottom, then left to right; every field has shape (n,).

    Xf, Yf, sd_x, sd_y         px
    pixels                     pixels above the threshold; mass: grey levels above the background, summed
    left, top, width, height   px, the box that holds the pixels above the threshold
    edge                       the blob touches the picture's edge: its centroid is not the target's
    saturated                  part of it is at full scale
    xx, yy, xy                 px^2, second moments of its light, as in `Centroids`
    """

    Xf: Array
    Yf: Array
    pixels: Ints
    mass: Array
    sd_x: Array
    sd_y: Array
    left: Ints
    top: Ints
    width: Ints
    height: Ints
    edge: Bools
    saturated: Bools
    xx: Array
    yy: Array
    xy: Array


def find_blobs(
    image: Picture,
    *,
    threshold: float | Literal["auto"] = "auto",
    polarity: Literal["bright", "dark"] = "bright",
    min_pixels: int = 4,
    centroid: Kind = "weighted",
    bits: int | None = None,
    noise: float | None = None,
) -> Blobs:
    """Find and measure every blob of a picture.

    image      (rows, columns) uint8, uint16, or floats in grey levels 0-255 (a mean of frames)
    threshold  grey level 0-255 on any depth; "auto" sets it from the picture's own background, noise and bright
               objects, and follows a background that varies over the picture
    polarity   bright: the blobs are brighter than the threshold; dark: darker
    bits       significant bits of a uint16 picture (10 for yuv420p10); all 16 when not given
    noise      grey levels, standard deviation of a pixel; estimated from the picture when not given
    Returns Blobs, none for a picture without any. Raises ValueError for a picture that is not 2-D.
    """
    if image.ndim != 2:
        raise ValueError(f"a picture has two axes, rows and columns, not {image.ndim}")
    scale = grey_scale(image.dtype, bits)
    if image.dtype.kind == "f":
        image = image.astype(np.float32, copy=False)
    image, mask, sigma = thresholded(image, scale, polarity=polarity, threshold=threshold, noise=noise)
    return measure_mask(image, mask, scale=scale, noise=sigma, min_pixels=min_pixels, centroid=centroid)


def thresholded(
    image: Picture,
    scale: float,
    *,
    polarity: str = "bright",
    threshold: float | Literal["auto"] = "auto",
    noise: float | None = None,
) -> tuple[Picture, NDArray[np.uint8], float]:
    """The picture with targets turned bright, 1 where it is above the threshold, and the noise of a pixel; as in
    `find_blobs`.
    """
    image, level = brightened(image, scale, polarity, threshold)
    sigma = noise_sd(image, scale=scale) if noise is None else noise
    mask = above_local_background(image, scale, sigma) if level is None else above(image, level / scale)
    return image, mask, sigma


def brightened(
    image: Picture, scale: float, polarity: str, threshold: float | Literal["auto"]
) -> tuple[Picture, float | None]:
    """The picture and the threshold turned so that targets are bright; None for an automatic threshold."""
    level = None if threshold == "auto" else float(threshold)
    if polarity == "bright":
        return image, level
    full = 255.0 if image.dtype.kind == "f" else round(255.0 / scale)
    return image.dtype.type(full) - image, None if level is None else 255.0 - level


def above(image: Picture, level: float) -> NDArray[np.uint8]:
    """1 where the stored value is above the level, 0 elsewhere."""
    if image.dtype == np.uint8:
        return np.asarray(cv2.threshold(image, level, 1, cv2.THRESH_BINARY)[1], np.uint8)
    return (image > level).view(np.uint8)


def above_local_background(image: Picture, scale: float, noise: float) -> NDArray[np.uint8]:
    """1 where the picture stands out of its own background by the automatic threshold, 0 elsewhere."""
    background = background_map(image, scale, noise)
    over = image.astype(np.float32)
    if scale != 1:  # in place: a fresh array of this size costs more than the arithmetic
        over *= np.float32(scale)
    over -= np.float32(background_level(image, scale=scale)) if background is None else background
    level = automatic(over, noise)
    mask = (over > np.float32(level)).view(np.uint8)
    return _by_their_own_level(over, mask, level)


def _by_their_own_level(over: NDArray[np.float32], mask: NDArray[np.uint8], level: float) -> NDArray[np.uint8]:
    """The mask, in each patch that is far brighter than the threshold without what is dim in it.

    over   grey levels above the background; level: the threshold that made the mask, likewise
    """
    smooth = cv2.blur(over, (3, 3))
    high = np.float32(BLOBS.raised * level / THRESHOLD.share)
    if not bool((smooth[mask > 0] > high).any()):
        return mask
    n, labels = cv2.connectedComponents(mask, connectivity=8)
    peak = np.zeros(n, np.float32)
    np.maximum.at(peak, labels[mask > 0], smooth[mask > 0])
    own = np.where(peak > high, np.float32(THRESHOLD.share) * peak, np.float32(level))
    own[0] = np.inf
    return np.asarray(over > own[labels], np.uint8)


def background_map(image: Picture, scale: float, noise: float) -> NDArray[np.float32] | None:
    """The background's grey level under every pixel; None where it is even.

    Block means, then their median over a quarter of the picture's height: whatever is smaller than an eighth of
    the picture leaves no trace.
    """
    block = max(2, min(image.shape) // 64)
    size = (max(1, image.shape[1] // block), max(1, image.shape[0] // block))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.float32) * np.float32(scale)
    wide = 2 * (min(image.shape) // block // 8) + 1
    smooth = cv2.medianBlur(np.clip(np.rint(small), 0, 255).astype(np.uint8), max(3, wide)).astype(np.float32)
    low, high = np.percentile(smooth, [2, 98])
    if high - low <= max(BLOBS.uneven * noise, 2.0):
        return None
    smooth = cv2.blur(smooth, (3, 3))
    full = cv2.resize(smooth, image.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(full, np.float32)


def measure_mask(
    image: Picture,
    mask: NDArray[np.uint8],
    *,
    scale: float,
    noise: float,
    min_pixels: int,
    centroid: Kind,
    known: Array | None = None,
) -> Blobs:
    """Measure every connected patch of a mask on the picture (targets bright), but those at known places (2, m) px."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    boxes = np.array([(*cv2.boundingRect(line), *line[0, 0]) for line in outlines], np.intp).reshape(-1, 6)
    boxes = boxes[boxes[:, 2] * boxes[:, 3] >= min_pixels]
    if known is not None and known.size and len(boxes):
        inside = [
            (p - low[:, None] >= -1) & (p - low[:, None] <= wide[:, None])
            for p, low, wide in zip(known, boxes.T[:2], boxes.T[2:4], strict=True)
        ]
        boxes = boxes[~(inside[0] & inside[1]).any(axis=1)]
    side = _window_side(boxes[:, 2:4].max(axis=1, initial=0) + 2 * BLOBS.room_px)
    parts = [
        _measure_boxes(image, mask, boxes[side == size], int(size), scale=scale, noise=noise, centroid=centroid)
        for size in np.unique(side)
    ]
    if not parts:
        return no_blobs()
    blobs = Blobs._make(np.concatenate(column) for column in zip(*parts, strict=True))
    keep = np.flatnonzero((blobs.pixels >= min_pixels) & np.isfinite(blobs.Xf) & np.isfinite(blobs.Yf))
    order = keep[np.lexsort((blobs.Xf[keep], blobs.Yf[keep]))]
    return Blobs._make(column[order] for column in blobs)


def no_blobs() -> Blobs:
    """What an empty picture shows."""
    kinds = [float, float, np.intp, float, float, float, np.intp, np.intp, np.intp, np.intp, bool, bool, *[float] * 3]
    return Blobs._make(np.empty(0, kind) for kind in kinds)


def _window_side(need: Ints) -> Ints:
    """A few standard sizes, so that blobs share windows: 16, 24, 32, 48, 64, 96, ..."""
    power = 2.0 ** np.ceil(np.log2(np.maximum(need, 16)))
    return np.where(need <= 0.75 * power, 0.75 * power, power).astype(np.intp)


def _measure_boxes(
    image: Picture,
    mask: NDArray[np.uint8],
    boxes: Ints,
    side: int,
    *,
    scale: float,
    noise: float,
    centroid: Kind,
) -> Blobs:
    """Measure patches that fit windows of one size; boxes (n, 6): left, top, width, height, a pixel's x and y."""
    rows, columns = image.shape
    width, height = min(side, columns), min(side, rows)
    left = np.clip(boxes[:, 0] + boxes[:, 2] // 2 - width // 2, 0, columns - width)
    top = np.clip(boxes[:, 1] + boxes[:, 3] // 2 - height // 2, 0, rows - height)
    windows = Windows(cut(image, left, top, width, height), left, top, scale)
    found = components_of(cut(mask, left, top, width, height), windows)
    each = np.arange(len(boxes))
    chosen = found.labels[boxes[:, 5] - top, each, boxes[:, 4] - left].astype(np.intp) - 1
    c = measure(windows, found, chosen, noise=noise, kind=centroid)
    box_left, box_top = boxes[:, 0], boxes[:, 1]
    box_width, box_height = boxes[:, 2], boxes[:, 3]
    edge = (box_left == 0) | (box_top == 0) | (box_left + box_width == columns) | (box_top + box_height == rows)
    box = (box_left, box_top, box_width, box_height)
    return Blobs(c.x, c.y, c.pixels, c.mass, c.sd_x, c.sd_y, *box, edge, c.saturated, c.xx, c.yy, c.xy)


def rough_blobs(image: Picture, mask: NDArray[np.uint8], *, scale: float, min_pixels: int) -> Blobs:
    """Every connected patch of a mask, measured quickly: the mean of its pixels, its brightness at that place.

    For finding out what is there before anything is measured; mass is that brightness times the pixels, above the
    darkest of the corners of a box twice as large; sd is NaN.
    """
    rows, columns = image.shape
    few = len(cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]) < 30_000
    kind = cv2.CV_16U if few else cv2.CV_32S  # 16 bits take a third of the time
    _, _, stats, middle = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=kind)
    stats, middle = stats[1:], middle[1:]
    many = stats[:, cv2.CC_STAT_AREA] >= min_pixels
    left, top, width, height, pixels = stats[many].T.astype(np.intp)
    x, y = middle[many].T
    column, row = np.rint(x).astype(np.intp), np.rint(y).astype(np.intp)
    level = image[row, column].astype(float)
    beside_x = np.clip(column + [[-1], [1], [-1], [1]] * (width + 3), 0, columns - 1)
    beside_y = np.clip(row + [[-1], [-1], [1], [1]] * (height + 3), 0, rows - 1)
    contrast = scale * (level - image[beside_y, beside_x].astype(float).min(axis=0))
    unknown = np.full(x.size, np.nan)
    edge = (left == 0) | (top == 0) | (left + width == columns) | (top + height == rows)
    order = np.lexsort((x, y))
    box, whole = (left, top, width, height), edge & False
    found = Blobs(x, y, pixels, contrast * pixels, unknown, unknown, *box, edge, whole, unknown, unknown, unknown)
    return Blobs._make(column[order] for column in found)


def in_frame_buffer(blobs: Blobs, sample: Sample, left: int = 0, top: int = 0) -> Blobs:
    """Blobs of a piece of a sample, whose first pixel is (left, top), in coordinates of the frame buffer.

    Boxes keep the sample's own rows as height, so that sizes compare between samples of one kind; pixels likewise.
    """
    return blobs._replace(
        Xf=blobs.Xf + left,
        Yf=(blobs.Yf + top) * sample.lines + sample.parity,
        sd_y=blobs.sd_y * sample.lines,
        yy=blobs.yy * sample.lines**2,
        xy=blobs.xy * sample.lines,
        left=blobs.left + left,
        top=(blobs.top + top) * sample.lines + sample.parity,
    )


def joined(parts: list[Blobs]) -> Blobs:
    """Blobs of several pieces, each blob once: pieces may overlap. At least one part."""
    whole = Blobs._make(np.concatenate(column) for column in zip(*parts, strict=True))
    if len(parts) == 1:
        return whole
    _, first = np.unique(np.stack([whole.left, whole.top, whole.pixels]), axis=1, return_index=True)
    return Blobs._make(column[np.sort(first)] for column in whole)
