"""Grey levels stretched by a look-up table, for recordings that use but a small part of their range.

The thesis's frame grabber had gain, offset and look-up tables "stretching the image to use all of the 256 values"
(3.2). Here pictures pass through such a table, to 16 bits, before anything is sought in them:

    grey level = gain (stored level - offset), held between 0 and 255; both levels on the scale 0-255

Where gain and offset are left to the recording, most pass untouched. 10 or 12 bits in a file of 16 fill it; any other
contrast too small to be distinguished from what codecs leave is raised to about half of the range: the rest is for
targets that turn brighter later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Picture
from vidtrack.tracking.detection.threshold import THRESHOLD, noise_sd

Counts = NDArray[np.float64]
Auto = Literal["auto"]


@dataclass(frozen=True)
class Levels:
    """When grey levels are stretched, and to what.

    bits      of the pictures that are given
    needed    grey levels: a clip whose targets rise less above its background is stretched
    raised    of 255: where the brightest level in use is put
    spare     of the levels in use: room left at their other end
    defects   pixels a picture that are left out: defects of the sensor
    pictures  that are examined, evenly from those that are given
    depths    bits that sensors store in files of 16
    """

    bits: int = 16
    needed: float = 2 * THRESHOLD.least_contrast
    raised: float = 140.0
    spare: float = 0.2
    defects: int = 3
    pictures: int = 5
    depths: tuple[int, ...] = (10, 12, 14)


LEVELS = Levels()


class Stretch(NamedTuple):
    """offset: grey level (0-255, of the stored depth) that becomes 0; gain: factor; table (stored levels,): 16 bits."""

    offset: float
    gain: float
    table: NDArray[np.uint16]

    def over(self, luma: Picture) -> NDArray[np.uint16]:
        """A picture of stored levels, stretched."""
        return np.asarray(cv2.LUT(luma, self.table) if luma.dtype == np.uint8 else self.table.take(luma), np.uint16)

    def grey(self, level: NDArray[np.float32]) -> NDArray[np.float32]:
        """Grey levels 0-255, not rounded (a mean of pictures), stretched."""
        return np.asarray(np.clip((level - np.float32(self.offset)) * np.float32(self.gain), 0, 255), np.float32)


class _Used(NamedTuple):
    """Grey levels 0-255 in use: least, usual and greatest; noise of a pixel; whether many sit on the greatest."""

    low: float
    usual: float
    high: float
    noise: float
    piled: bool

    @property
    def rise(self) -> float:
        return self.high - self.usual


def stretch(
    pictures: Sequence[Picture],
    bits: int,
    *,
    dark: bool = False,
    gain: float | Auto = "auto",
    offset: float | Auto = "auto",
) -> Stretch | None:
    """The stretch that pictures of one clip need; None where they are to stay as they are.

    pictures  (rows, columns) stored levels, 0 to 2**bits - 1, some of those in which targets are seen
    dark      targets are darker than the background
    gain      factor, offset: grey level 0-255 that becomes black; auto: as the levels in use ask for
    A level at which the sensor ends (the depth's last; in deep files the greatest that occurs, where many pixels sit
    on it) becomes full scale, whatever the gain.
    """
    if gain == 1 and offset == 0:
        return None
    full = float(2**bits - 1)
    used = _used(pictures[:1], bits, dark)
    if used.rise < LEVELS.needed or bits > 8 or gain != "auto":  # few clips go on from here
        used = _used(pictures, bits, dark)
    gain, offset = _chosen(used, bits, dark, gain, offset)
    if gain == 1 and offset == 0:
        return None
    ends = used.high if used.piled else 255.0
    level = np.arange(2 ** (8 if bits == 8 else 16)) * (255.0 / full)
    grey = np.clip((level - offset) * gain, 0, 255)
    if dark:
        grey[level <= 255.0 - ends] = 0
    else:
        grey[level >= ends - 1e-9] = 255
    return Stretch(offset, gain, np.rint(grey * 257).astype(np.uint16))


def _chosen(used: _Used, bits: int, dark: bool, gain: float | Auto, offset: float | Auto) -> tuple[float, float]:
    """Gain and offset for levels as they are used (turned bright); 1 and 0 where all is well."""
    if gain == "auto" and offset == "auto":
        return _needed(used, bits, dark)
    if gain == "auto":
        top = (255.0 - used.low if dark else used.high) - float(offset)
        return (LEVELS.raised / top if 0 < top and used.rise < LEVELS.needed else 1.0), float(offset)
    if offset == "auto":
        low = used.low - max(LEVELS.spare * (used.high - used.low), 4 * used.noise)
        return float(gain), (255.0 - low - 255.0 / gain if dark else max(low, 0.0)) if gain > 1 else 0.0
    return float(gain), float(offset)


def _needed(used: _Used, bits: int, dark: bool) -> tuple[float, float]:
    """Gain and offset; 1 and 0 where none is needed, or where nothing stands out of the noise."""
    full = 2**bits - 1
    short = used.piled and used.high < 128
    if used.rise < THRESHOLD.sigmas * used.noise or (used.rise >= LEVELS.needed and not short):
        return 1.0, 0.0
    greatest = 255.0 - used.low if dark else used.high
    for depth in LEVELS.depths:
        gain = full / (2**depth - 1)
        if depth < bits and greatest * gain <= 255 and used.rise * gain >= LEVELS.needed:
            return (255.0 / used.high if short and not dark else gain), 0.0
    low = used.low - LEVELS.spare * (used.high - used.low)
    gain = (255.0 if used.piled else LEVELS.raised) / (used.high - low)
    return gain, 255.0 - low - 255.0 / gain if dark else max(low, 0.0)


def _used(pictures: Sequence[Picture], bits: int, dark: bool) -> _Used:
    """What levels the pictures use, turned bright."""
    some = [pictures[k] for k in np.unique(np.linspace(0, len(pictures) - 1, LEVELS.pictures).round().astype(int))]
    scale = 255.0 / (2**bits - 1)
    counts = np.array([_counts(picture, bits) for picture in some])
    each = counts[:, ::-1] if dark else counts
    from_below, from_above = np.cumsum(each, axis=1), np.cumsum(each[:, ::-1], axis=1)
    low = int(np.argmax(from_below > LEVELS.defects, axis=1).min())
    high = each.shape[1] - 1 - int(np.argmax(from_above > LEVELS.defects, axis=1).min())
    total = each.sum(axis=0)
    usual = int(np.argmax(np.cumsum(total) >= total.sum() / 2))
    noise = noise_sd(some[0])
    return _Used(low * scale, usual * scale, high * scale, noise * scale, bits > 8 and _piled(total, high, noise))


def _counts(picture: Picture, bits: int) -> Counts:
    """How many pixels each stored level has, (2**bits,)."""
    levels = 2**bits
    return np.asarray(cv2.calcHist([picture], [0], None, [levels], [0, levels]).ravel(), float)


def _piled(counts: Counts, high: int, noise: float) -> bool:
    """Whether the greatest level is where the sensor ends: more pixels sit on it than within three sigmas below.

    Where noise is less than a level, a target of even brightness does that too.
    """
    below = counts[max(0, high - int(np.ceil(3 * noise))) : high].sum()
    return bool(
        noise > 0.8
        and counts[high] > max(below, 10 * LEVELS.defects)
        and counts[high + 1 :].sum() <= LEVELS.defects * LEVELS.pictures
    )
