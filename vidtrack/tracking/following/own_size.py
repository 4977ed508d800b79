"""How large each target usually is: what looks like it but covers far more or far fewer pixels is not it alone.

Two that have become one blob, or a target of which something in front leaves a part, differ from the target in size
and not in light; a lamp that flickers differs in light as well. A target that comes nearer changes slowly, or keeps
its shape: a part of it, or two in one, are longer than they are wide, or fill more or less of their box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.window import WINDOW
from vidtrack.tracking.discs.clump import elongation
from vidtrack.tracking.state import CONTRAST, HEIGHT, PIXELS, SD_X, SD_Y, WIDTH, XX, XY, YY, Found


@dataclass(frozen=True)
class OwnSizes:
    """When a size is not a target's own.

    following    share by which the size and the light that are remembered follow each reading
    nearer       |log| of the ratio of pixel counts, from sample to sample, by which the size follows at once: a target
                 that comes nearer and goes by 6 % of its distance at 0.8 Hz makes 0.02 at 30 Hz
    odd          |log| of the ratio of pixel counts from which it is another thing, or a part
    light        of that: |log| of the ratio of contrasts from which it is a change of light
    doubtful_px  of its rim, the error of a pixel count: three of it are no chance
    shift        of the radius, by which a part that is missing or added moves the middle, for each share of the area
    remembered   samples without a measurement after which a size is no longer known, but that it is one
    still        |log| of the ratio of pixel counts up to which a blob is the one that covered a target before
    round        elongation of a blob of fewer pixels than a shape is known of, up to which it may be one; |log| of the
                 ratio of width to height from which a size is that of a part
    shape        |log| of the ratio of width to height, and of the share of the box that is filled, by which a shape may
                 differ: this, and shape_px over the diameter, for boxes are counted in whole pixels
    sure         readings of its size, less those of a part, after which it is sure; it counts twice as many at most
    shape_from   px, smallest diameter of which a shape is known
    """

    following: float = 0.04
    nearer: float = 0.025
    odd: float = 0.33
    light: float = 0.5
    doubtful_px: float = 0.45
    shift: float = 0.6
    remembered: int = 8
    still: float = 0.2
    round: float = 0.3
    shape: float = 0.06
    shape_px: float = 1.3
    shape_from: float = 6.0
    sure: int = 12


OWN_SIZES = OwnSizes()

_USUAL = [PIXELS, CONTRAST, WIDTH, HEIGHT]
_COUNT, _CONTRAST, _WIDTH, _HEIGHT = range(len(_USUAL))
_SHAPE = slice(_WIDTH, _HEIGHT + 1)


class OwnSize:
    """Usual pixel counts, contrasts (grey levels), widths and heights of so many places; NaN where none is known."""

    def __init__(self, places: int) -> None:
        self._usual = np.full((len(_USUAL), places), np.nan)
        self._read = np.zeros(places, np.intp)  # readings of that size, less those of a part
        self._former = self._usual.copy()  # of those that were lost for long
        self._covering = np.full(places, np.nan)  # pixels of what they were last seen to be a part of

    def forget(self, who: Ints) -> None:
        """Whatever is in these places is another thing now."""
        self._usual[:, who] = self._former[:, who] = self._covering[who] = np.nan
        self._read[who] = 0

    def cover(self, who: Ints, pixels: Array) -> None:
        """These (m,) are sought within blobs of so many pixels, which are more than themselves; NaN: in none."""
        seen = np.isfinite(pixels)
        self._covering[who[seen]] = pixels[seen]

    def outdate(self, who: Ints, lines: int = 1) -> None:
        """These were lost for so long that they may be of another size by now.

        What was long was a part, of a ball behind a rope, and says nothing of the size of the whole.
        lines  of the frame buffer to a row of the sample
        """
        who = who[np.isfinite(self._usual[_COUNT, who])]
        usual = self._usual[:, who]
        with np.errstate(divide="ignore", invalid="ignore"):
            long = np.abs(np.log(usual[_WIDTH] / usual[_HEIGHT] / lines)) > OWN_SIZES.round
        self._former[:, who], self._usual[:, who] = np.where(long, np.nan, usual), np.nan

    def several(self, found: Found, missing: Ints) -> Bools:
        """Which targets (m,) that a search found after so many samples (m,) are several, or more than themselves.

        They are larger than before they were lost, and neither the light nor their distance explains it: of what only
        comes nearer the shape stays, and where that is too small to be seen, it is round and took its time. And what
        was known to be more than the target, three balls side by side, is as large as it was.
        """
        former, now = self._former[:, found.who], [found.values[PIXELS], found.values[CONTRAST], *found.size]
        with np.errstate(divide="ignore", invalid="ignore"):
            area, light, wide, high = np.log(np.maximum(now, 1e-3) / former)
            limit = OWN_SIZES.odd + WINDOW.grain / former[_COUNT]
            larger = (area > limit) & (np.abs(light) <= OWN_SIZES.light * area)
            diameter = np.sqrt(former[_WIDTH] * former[_HEIGHT])
            slack = OWN_SIZES.shape + OWN_SIZES.shape_px / diameter
            same = (np.abs(wide - high) < slack) & (np.abs(area - wide - high) < slack)
            nearer = area < limit + OWN_SIZES.nearer * missing
            nearer &= elongation(*found.values[[XX, YY, XY]]) < OWN_SIZES.round
            still = np.abs(np.log(found.values[PIXELS] / self._covering[found.who])) < OWN_SIZES.still
        return np.asarray(larger & (still | ~np.where(diameter >= OWN_SIZES.shape_from, same, nearer)))

    def _off(self, pixels: Array, contrast: Array, who: Ints | slice) -> tuple[Array, Bools]:
        """Log of the ratio to the usual count, targets on the last axis, and where the light explains it."""
        usual = self._usual[:, who]
        with np.errstate(divide="ignore", invalid="ignore"):
            size, light = np.log(pixels / usual[_COUNT]), np.log(np.maximum(contrast, 1e-3) / usual[_CONTRAST])
        return size, np.abs(light) > OWN_SIZES.light * np.abs(size)

    def odd(self, pixels: Array, contrast: Array, who: Ints) -> Bools:
        """Which readings, targets `who` on the last axis, are of another size."""
        size, explained = self._off(pixels, contrast, who)
        return np.asarray((np.abs(size) > OWN_SIZES.odd + WINDOW.grain / self._usual[_COUNT, who]) & ~explained)

    def _same_shape(self, values: Array, who: Ints) -> Bools:
        """Which readings (k, m) are the target whole and alone, only nearer or farther: of the same shape."""
        usual = self._usual[:, who]
        with np.errstate(divide="ignore", invalid="ignore"):
            area = np.log(values[PIXELS] / usual[_COUNT])
            wide, high = np.log(values[WIDTH] / usual[_WIDTH]), np.log(values[HEIGHT] / usual[_HEIGHT])
            diameter = np.sqrt(usual[_WIDTH] * usual[_HEIGHT])
            limit = OWN_SIZES.shape + OWN_SIZES.shape_px / diameter
            alike = (np.abs(wide - high) < limit) & (np.abs(area - wide - high) < limit)
        return np.asarray(alike & (diameter >= OWN_SIZES.shape_from))

    def unlike(self, values: Array, who: Ints) -> Bools:
        """As `odd`, of readings (VALUES, k, m), by their shape too: none where none is `changed`."""
        odd = self.odd(values[PIXELS], values[CONTRAST], who)
        return odd & ~self._same_shape(values, who) if odd.any() else odd

    def _part(self, values: Array, who: Ints) -> tuple[Array, Bools]:
        """Log of the ratio to the usual count (k, m), and where neither chance nor light explains it."""
        size, explained = self._off(values[PIXELS], values[CONTRAST], who)
        usual = self._usual[_COUNT, who]
        chance = 3 * OWN_SIZES.doubtful_px * np.sqrt(2 * np.sqrt(np.pi * usual)) / usual
        with np.errstate(invalid="ignore"):
            return size, np.asarray((np.abs(size) > chance) & ~explained)

    def usual(self, who: Ints) -> Array:
        """Pixel counts, contrasts, widths and heights (rows) (4, m) as they usually are; NaN: they are not sure yet."""
        return np.where(self._read[who] >= OWN_SIZES.sure, self._usual[:, who], np.nan)

    def changed(self, values: Array, who: Ints) -> Ints:
        """Which columns of readings (VALUES, k, m) hold one of another size, whose shape has to be looked at."""
        return np.flatnonzero(self._part(values, who)[1].any(axis=0))

    def doubted(self, values: Array, who: Ints, shaped: Array | None = None) -> Array:
        """Values (VALUES, k, m) with sd_x, sd_y grown by what a missing or added part may have moved the middle.

        shaped  the same with widths and heights from the shape, where values do not
        """
        size, part = self._part(values, who)
        if part.any():
            part &= ~self._same_shape(values if shaped is None else shaped, who)
        if not part.any():
            return values
        values = values.copy()
        radius = np.sqrt(self._usual[_COUNT, who] / np.pi)
        shift = np.where(part, OWN_SIZES.shift * np.abs(size) * radius, 0.0)
        values[[SD_X, SD_Y]] = np.hypot(values[[SD_X, SD_Y]], shift)
        return values

    def follow(self, values: Array, clear: Bools, who: Ints) -> None:
        """Take in readings (VALUES, k, m) where they are clear (k, m)."""
        count = clear.sum(axis=0)
        share = (1 - (1 - OWN_SIZES.following) ** count) * (count > 0)
        if clear.all():
            total, newest = values[_USUAL].sum(axis=1), values[:, -1:]
        else:
            total = np.where(clear, values[_USUAL], 0.0).sum(axis=1)
            last = np.where(count > 0, clear.shape[0] - 1 - clear[::-1].argmax(axis=0), 0)
            newest = values[:, last, np.arange(who.size)][:, None]
        mean = total / np.maximum(count, 1)
        whole = self._part(newest, who)[1][0] & (count > 0)
        part = whole
        if whole.any():
            whole = part & self._same_shape(newest, who)[0]
        old = self._usual[:, who]
        new = np.where(np.isfinite(old), old + share * (mean - old), np.where(count > 0, mean, np.nan))
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.log(mean[_COUNT] / old[_COUNT])
            most = OWN_SIZES.nearer * count
            at_once = old[_COUNT] * np.exp(np.minimum(np.maximum(off, -most), most))
            known = np.isfinite(old[_COUNT]) & (count > 0)
            further = known & (np.abs(at_once - old[_COUNT]) > np.abs(new[_COUNT] - old[_COUNT]))
            new[_COUNT] = np.where(further, at_once, new[_COUNT])
            new[_COUNT] = np.where(whole, newest[PIXELS, 0], new[_COUNT])
            grown = np.sqrt(new[_COUNT] / old[_COUNT])
        new[_SHAPE] = np.where(whole, old[_SHAPE] * grown, new[_SHAPE])
        self._usual[:, who] = new
        read = self._read[who] + np.where(part & ~whole, -count, count)
        self._read[who] = np.minimum(np.maximum(read, 0), 2 * OWN_SIZES.sure)
