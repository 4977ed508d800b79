"""What is known of n targets while they are followed, and what was measured of them in each sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints

LOST, RECOVERED, PREDICTED, EDGE, SATURATED, MERGED, SMALL, CORRUPT, REPEATED = (1 << bit for bit in range(9))
FLAGS = ("lost", "recovered", "predicted", "edge", "saturated", "merged", "small", "corrupt", "repeated")
"""The words of the flags, by bit."""

X, Y, SD_X, SD_Y, PIXELS, MASS, CONTRAST, BACKGROUND, XX, YY, XY, WIDTH, HEIGHT, SOFT, UNREST, PLATEAU = range(16)
SHIFT_X, SHIFT_Y = PLATEAU + 1, PLATEAU + 2
"""Rows of measured values: frame-buffer px, grey levels; XX to XY second moments of the light, px^2; HEIGHT in rows of
the sample; SOFT, UNREST and PLATEAU as in `Centroids`; SHIFT_X and SHIFT_Y of `surface`, NaN where not looked for."""
VALUES = SHIFT_Y + 1
"""Their number."""
POSITION = slice(X, Y + 1)
"""Their first two."""
MEASURED = XY + 1
"""Values that are kept of every sample: X to XY."""


@dataclass(frozen=True)
class Memory:
    """How much of the past the state of a target holds.

    samples  the last ones, on which a prediction rests
    follow   share by which the appearance of a target follows each new reading
    """

    samples: int = 8
    follow: float = 0.2


MEMORY = Memory()

NEVER = 1 << 60
"""The first sample of a target that has not been seen yet."""
_APPEARANCE = [PIXELS, CONTRAST, BACKGROUND, WIDTH, HEIGHT, SOFT, UNREST, PLATEAU]
_ROW = {quantity: row for row, quantity in enumerate(_APPEARANCE)}
"""Which row of `Appearance.values` holds which measured quantity."""


class Starts(NamedTuple):
    """Where targets begin, (n,) or (n, 2): frame-buffer px, px a sample, grey levels.

    position, velocity (px a sample), acceleration (px a sample^2)  at sample `first`; NaN: not known
    box                 width and height of its mask
    pixels, contrast, background, size (width and height of the target in its sample's own rows)
                        its appearance; NaN where it has not been seen yet: it is then sought in its box
    """

    position: Array
    velocity: Array
    acceleration: Array
    box: Array
    first: Ints
    pixels: Array
    contrast: Array
    background: Array
    size: Array

    def with_spare(self, places: int) -> Starts:
        """With places behind the targets for whatever else is followed; they have no first sample."""
        if not places:
            return self
        one, two = np.full(places, np.nan), np.full((places, 2), np.nan)
        box = np.tile(np.median(self.box, axis=0) if len(self.box) else np.full(2, 50.0), (places, 1))
        spare = Starts(two, two, two, box, np.full(places, NEVER, np.intp), one, one, one, two)
        return Starts._make(np.concatenate(columns) for columns in zip(self, spare, strict=True))


class Rows(NamedTuple):
    """What was measured.

    values  (MEASURED, samples, n), NaN where nothing was measured
    corner  (samples, n, 2) px, left and top of the box; flag (samples, n) bits of FLAGS; total_pixels (samples,)
    """

    values: Array
    corner: Array
    flag: NDArray[np.int64]
    total_pixels: Array


class Found(NamedTuple):
    """Targets `who` (m,) as a search found them in one sample.

    values   (MEASURED, m); size (2, m) width px and height in rows of the sample; plateau (m,) grey levels
    flag     (m,) bits of FLAGS
    """

    who: Ints
    values: Array
    size: Array
    plateau: Array
    flag: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Appearance:
    """What n targets look like: one row of `values` a quantity, one column a target; NaN where it is not known."""

    values: Array

    @classmethod
    def of_starts(cls, starts: Starts) -> Appearance:
        """What is known before the first sample."""
        unknown = np.full((2, len(starts.first)), np.nan)
        return cls(
            np.stack([starts.pixels, starts.contrast, starts.background, *starts.size.T, *unknown, starts.contrast])
        )

    @property
    def pixels(self) -> Array:
        """Above the threshold."""
        return np.asarray(self.values[_ROW[PIXELS]])

    @property
    def contrast(self) -> Array:
        """Grey levels, mean above the background."""
        return np.asarray(self.values[_ROW[CONTRAST]])

    @property
    def background(self) -> Array:
        """Grey level."""
        return np.asarray(self.values[_ROW[BACKGROUND]])

    @property
    def size(self) -> Array:
        """(2, n) width px and height in rows of the sample."""
        return np.asarray(self.values[_ROW[WIDTH] : _ROW[HEIGHT] + 1])

    @property
    def soft(self) -> Array:
        """px of soft edge; NaN: the target's window is segmented before a template may measure it."""
        return np.asarray(self.values[_ROW[SOFT]])

    @property
    def unrest(self) -> Array:
        """Grey levels, what the background leaves after its plane."""
        return np.asarray(self.values[_ROW[UNREST]])

    @property
    def plateau(self) -> Array:
        """Grey levels, mean of the pixels above the threshold over the background."""
        return np.asarray(self.values[_ROW[PLATEAU]])

    @property
    def known(self) -> Bools:
        """Whether count, light, background and size are all known, (n,)."""
        return np.asarray(np.isfinite(self.values[: _ROW[HEIGHT] + 1]).all(axis=0))

    def of(self, who: Ints | slice) -> Appearance:
        """That of some targets."""
        return Appearance(self.values[:, who])

    def following(self, values: Array, good: Bools, who: Ints | slice) -> Appearance:
        """As readings (VALUES, k, m) of targets `who` change it, those that are good (k, m).

        What motion alone has shown of a target is rough: its first reading counts whole.
        """
        count = good.sum(axis=0)
        readings = values[PIXELS:] if good.all() else np.where(good, values[PIXELS:], 0)
        mean = readings.sum(axis=1)[[row - PIXELS for row in _APPEARANCE]] / np.where(count, count, np.nan)
        old = self.values[:, who]
        old = np.where((np.isfinite(old) & np.isfinite(old[_ROW[SOFT]])) | (count == 0), old, mean)
        new = self.values.copy()
        new[:, who] = np.where(count, old + (1 - (1 - MEMORY.follow) ** count) * (mean - old), old)
        return Appearance(new)

    def found(self, found: Found) -> Appearance:
        """As a search has shown it; soft edge and unrest are those of before."""
        new = self.values.copy()
        width, height = found.size
        shown = {quantity: found.values[quantity] for quantity in (PIXELS, CONTRAST, BACKGROUND)}
        for quantity, value in (shown | {WIDTH: width, HEIGHT: height, PLATEAU: found.plateau}).items():
            new[_ROW[quantity], found.who] = value
        return Appearance(new)

    def begun(self, target: int, values: Sequence[float]) -> Appearance:
        """With a target that had not been seen before: pixels, contrast, background, width, height."""
        new = self.values.copy()
        pixels, contrast, background, width, height = values
        new[:, target] = [pixels, contrast, background, width, height, np.nan, np.nan, contrast]
        return Appearance(new)


@dataclass(frozen=True, slots=True)
class TargetState:
    """What is known of n targets after a sample.

    appearance
    missing     (n,) samples since each was measured; 0: just now, -1: not begun
    times       (MEMORY.samples,) of the last samples, in samples
    positions   (MEMORY.samples, n, 2) px in those samples, NaN where not measured
    box         (n, 2) px, width and height of the moving box mask
    """

    appearance: Appearance
    missing: Ints
    times: Array
    positions: Array
    box: Array

    @classmethod
    def before(cls, starts: Starts) -> TargetState:
        """Before the first sample, which is at time 0."""
        n = len(starts.first)
        positions = np.full((MEMORY.samples, n, 2), np.nan)
        return cls(Appearance.of_starts(starts), np.full(n, -1), np.arange(-MEMORY.samples, 0.0), positions, starts.box)

    def sizes(self, lines: int, who: Ints | slice = slice(None)) -> Array:
        """Width and height (n, 2), frame-buffer px; a row of the sample is `lines` px high."""
        return np.asarray(self.appearance.size[:, who].T * (1, lines))

    def started(self, who: Ints, starts: Starts, time: float) -> TargetState:
        """With targets that begin at this time, as if they had been measured on their way there."""
        position = starts.position[who]
        v, a = np.nan_to_num(starts.velocity[who]), np.nan_to_num(starts.acceleration[who])
        t = self.times[-3:, None, None] - time
        moving = np.isfinite(starts.velocity[who, 0])
        positions, missing = self.positions.copy(), self.missing.copy()
        positions[-3:, who[moving]] = (position + t * v + t * t * a / 2)[:, moving]
        positions[-1, who[~moving]] = position[~moving]
        missing[who] = np.where(np.isfinite(self.appearance.pixels[who]), 0, 1)
        return replace(self, positions=positions, missing=missing)

    def begun(self, target: int, positions: Array, times: Array, appearance: Sequence[float]) -> TargetState:
        """With a target that was seen for the first time at positions (m, 2) px at `times` (m,).

        appearance  its pixels, contrast, background, width and height
        """
        where, missing = self.positions.copy(), self.missing.copy()
        for time, position in zip(times, positions, strict=True):
            where[np.abs(self.times - time) < 1e-6, target] = position
        missing[target] = 0 if abs(times[-1] - self.times[-1]) < 1e-6 else 1
        return replace(self, appearance=self.appearance.begun(target, appearance), positions=where, missing=missing)

    def split(self, one: int, other: int, place: Array, looks: Array) -> TargetState:
        """With what was followed as target `one` in the last samples known to be two, at places (2, 2) px now.

        looks  (2, 5) of each as of `begun`. They moved as what was followed did; neither was measured
        """
        positions, missing, box = self.positions.copy(), self.missing.copy(), self.box.copy()
        way = positions[:, one] - positions[-1, one]
        positions[:, one], positions[:, other] = way + place[0], way + place[1]
        missing[[one, other]], box[other] = 1, box[one]
        appearance = self.appearance.begun(one, looks[0]).begun(other, looks[1])
        return replace(self, appearance=appearance, positions=positions, missing=missing, box=box)

    def remembering(self, times: Array, fresh: Array, home: Array) -> TargetState:
        """After samples at `times` (k,) with positions `fresh` (k, n, 2) px, NaN where nothing was measured.

        home (n, 2) px: where a target is that was never measured. The last position stays, so that the box does.
        """
        kept = np.concatenate([self.positions, fresh])[-MEMORY.samples :]
        gone = np.isnan(kept[..., 0]).all(axis=0) & (self.missing >= 0)
        if gone.any():
            kept[0, gone] = self._last_known(gone, home)
        return replace(self, positions=kept, times=np.concatenate([self.times, times])[-MEMORY.samples :])

    def missed(self, who: Ints, samples: int) -> TargetState:
        """After samples in which targets already lost stayed so, and `who` were lost in the last one."""
        missing = np.where(self.missing > 0, self.missing + samples, self.missing)
        missing[who] = 1
        return replace(self, missing=missing)

    def found(self, found: Found) -> TargetState:
        """With targets found in the last sample; the box of one that is seen for the first time is forgotten."""
        positions, missing = self.positions.copy(), self.missing.copy()
        positions[:, found.who[~np.isfinite(self.appearance.pixels[found.who])]] = np.nan
        positions[-1, found.who] = found.values[[X, Y]].T
        missing[found.who] = 0
        return replace(self, appearance=self.appearance.found(found), positions=positions, missing=missing)

    def still_sought(self, who: Ints) -> TargetState:
        """With targets that were measured just now and are not plainly themselves: the next sample is searched too."""
        missing = self.missing.copy()
        missing[who] = 1
        return replace(self, missing=missing)

    def going(self, who: Ints, velocity: Array, samples: int) -> TargetState:
        """With what targets did before forgotten: they are taken to have moved at these velocities (n, 2), px a sample,
        in the last few samples.
        """
        if not who.size:
            return self
        positions = self.positions.copy()
        now = positions[-1, who]
        positions[:, who] = np.nan
        positions[-samples:, who] = now + velocity * (self.times[-samples:, None, None] - self.times[-1])
        return replace(self, positions=positions)

    def last_seen(self, who: Ints) -> tuple[Array, Array]:
        """Where targets were last (m, 2) px, NaN: not remembered; the fastest of their last steps, px a sample, -inf:
        none is known.
        """
        where = self.positions[:, who]
        last = where[MEMORY.samples - 1 - np.argmax(np.isfinite(where[::-1, :, 0]), axis=0), np.arange(len(who))]
        steps = np.diff(where, axis=0)
        return last, np.nanmax(np.hypot(steps[..., 0], steps[..., 1]), axis=0, initial=-np.inf)

    def _last_known(self, gone: Bools, home: Array) -> Array:
        positions = self.positions[:, gone]
        seen = np.isfinite(positions[..., 0])
        newest = MEMORY.samples - 1 - np.argmax(seen[::-1], axis=0)
        last: Array = positions[newest, np.arange(positions.shape[1])]
        return np.where(np.isfinite(last), last, home[gone])


@dataclass(frozen=True, slots=True)
class Searched:
    """State and measurements of one sample while it is searched: values (MEASURED, n), flag (n,)."""

    state: TargetState
    values: Array
    flag: NDArray[np.int64]

    def measured(self, n: int) -> Array:
        """Where the first n targets were measured in this sample, (2, m) px."""
        values = self.values[POSITION, :n]
        return values[:, np.isfinite(values[X])]

    def found(self, found: Found) -> Searched:
        """With targets that were found."""
        values, flag = self.values.copy(), self.flag.copy()
        values[:, found.who], flag[found.who] = found.values, found.flag
        return Searched(self.state.found(found), values, flag)

    def missed(self, who: Ints, why: NDArray[np.int64] | int) -> Searched:
        """With the reason why targets were not found."""
        flag = self.flag.copy()
        flag[who] = why
        return replace(self, flag=flag)


def present(rows: Rows) -> Bools:
    """Where a target was measured, (samples, n)."""
    return np.asarray(np.isfinite(rows.values[X]))
