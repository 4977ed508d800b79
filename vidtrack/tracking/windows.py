"""Pieces of pictures kept for a second search, when it is known from other cameras where a target is.

A piece is kept where a target was sought and not measured, where what was measured is no disc and may be two targets,
and from the samples before a new track begins, or a target is found again that was lost for long. A few megabytes a
recording are kept, the first that come.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.outlines.lighting import Lighting
from vidtrack.tracking.pace import PACE
from vidtrack.tracking.recovery.separation import Scene, hidden_by_static
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance, TargetState, X, Y


@dataclass(frozen=True)
class Keeping:
    """Which pieces are kept, and how large they are.

    sizes, room_px   on each side of a target: so many times its size, and so many px more
    lost_px          on each side of a target that was lost, besides
    widest_px        half of a piece, at most
    most_bytes       of all pieces; of_each: of those about one place, so that a target that always looks odd leaves
                     room for others; many: pieces of one place that are kept however large they are
    aspect, fill     of a disc: ratio of its sides at most, share of its box at least; uneven_px: by which sides differ
                     at least where that is no disc
    before           samples before a new track from which pieces are kept
    """

    sizes: float = 1.5
    room_px: float = 8.0
    lost_px: float = 20.0
    widest_px: float = 100.0
    most_bytes: int = 12_000_000
    of_each: int = 400_000
    many: int = 40
    aspect: float = 1.3
    fill: float = 0.64
    uneven_px: float = 3.0
    before: int = 8


KEEPING = Keeping()

HIDDEN = 0
"""Grey level of a pixel that static clutter lights."""


COLUMNS = (
    "frame",  # as in the centroid table, as are field and time_s
    "field",
    "time_s",
    "left",  # px, first column; top: first row of the sample
    "top",
    "parity",  # as those of `Sample`, as is lines
    "lines",
    "width",  # columns
    "grey",  # a byte a pixel, row by row: grey levels turned bright, from 1; 0: of no use
    "noise",  # grey levels, standard deviation of a pixel; the same in all rows, as are the next two
    "grown_x",  # by which the sd of fits in it are to be grown, as those of the recording's tracks were
    "grown_y",
    "exposure",  # samples, as the recording's streaks show it, the same in all rows; 0: too short to be seen
    "lit_x",  # from the middle of the light of a target to that of its outline, of its radius; lit_sd: sd of that
    "lit_y",
    "lit_sd",
)
"""Columns of results/runs/<run>/windows/<camera>.parquet, one row a piece, in order of time."""


class Window(NamedTuple):
    """A piece of a sample.

    sample     its number; left, top: first column and row of the sample; parity, lines  as those of `Sample`
    grey       (rows, columns) grey levels turned bright, from 1; HIDDEN: of no use
    """

    sample: int
    left: int
    top: int
    parity: int
    lines: int
    grey: NDArray[np.uint8]


class Windows:
    """Collects the pieces of a recording with so many places for tracks."""

    def __init__(self, places: int) -> None:
        self.kept: list[Window] = []
        self._bytes = 0
        self._of_place, self._pieces = np.zeros((2, places), np.int64)
        self._long_lost = np.zeros(places, bool)
        self._recent: deque[tuple[int, Sample]] = deque(maxlen=KEEPING.before)

    def sought(
        self, scene: Scene, sample: Sample, number: int, who: Ints, expected: Array, values: Array, state: TargetState
    ) -> None:
        """Keep what a sample shows of the targets `who` that were sought in it and not found, or look like no disc.

        expected (n, 2) px, where all targets were; values (MEASURED, n) what was measured
        Of those that are found again after long, which were sought in few samples alone, what the last ones show too.
        """
        size = state.sizes(sample.lines)
        lost = who[np.isnan(values[X, who]) & (state.missing[who] > 0)]
        self._keep(scene, sample, number, lost, expected, size, KEEPING.lost_px)
        odd = who[np.isfinite(values[X, who]) & no_disc(state.appearance, sample.lines)[who]]
        self._keep(scene, sample, number, odd, values[[X, Y]].T, size, 0.0)
        self.begun(scene, who[np.isfinite(values[X, who]) & self._long_lost[who]], state)
        self._long_lost[who] = np.isnan(values[X, who]) & (state.missing[who] > PACE.sought_each)

    def odd(self, scene: Scene, samples: Sequence[Sample], first: int, values: Array, state: TargetState) -> None:
        """Keep what samples, the first of which has this number, show of targets that look like no disc.

        values   (MEASURED, samples or more, n) what was measured in them
        """
        if self._bytes > KEEPING.most_bytes:
            return
        odd = np.flatnonzero(no_disc(state.appearance, samples[0].lines) & self._has_room())
        for j, sample in enumerate(samples if odd.size else ()):
            who = odd[np.isfinite(values[X, j, odd])]
            self._keep(scene, sample, first + j, who, values[[X, Y], j].T, state.sizes(sample.lines), 0.0)

    def passed(self, samples: Sequence[Sample], first: int) -> None:
        """Remember samples, the first of which has this number, for tracks that will begin."""
        self._recent.extend((first + k, sample) for k, sample in enumerate(samples))

    def backwards(self, other: Windows, first: int) -> None:
        """Take over what was kept while samples were followed backwards; first: the number of the one after them."""
        self.kept += [one._replace(sample=first - 1 - one.sample) for one in other.kept]

    def begun(self, scene: Scene, who: Ints, state: TargetState) -> None:
        """Keep what the samples before show where new tracks `who` begin."""
        self._of_place[who] = self._pieces[who] = self._long_lost[who] = 0
        begun = who[np.isfinite(state.positions[-1, who, 0])]
        for number, sample in self._recent if begun.size else ():
            self._keep(scene, sample, number, begun, state.positions[-1], state.sizes(sample.lines), KEEPING.lost_px)

    def _keep(self, scene: Scene, sample: Sample, number: int, who: Ints, at: Array, size: Array, more: float) -> None:
        """Keep what a sample shows about targets `who`; at, size (n, 2) px of all; more: px on each side."""
        if self._bytes > KEEPING.most_bytes:
            return
        who = who[self._has_room()[who] & np.isfinite(at[who]).all(axis=1)]
        if not who.size:
            return
        half = np.minimum(KEEPING.sizes * np.nan_to_num(size[who]) + KEEPING.room_px + more, KEEPING.widest_px)
        middle, half = np.stack([at[who, 0], sample.row(at[who, 1])], axis=1), half / [1, sample.lines]
        first = np.maximum(np.floor(middle - half), 0).astype(int)
        last = np.minimum(np.ceil(middle + half) + 1, sample.luma.shape[::-1]).astype(int)
        for place, (left, top), (right, bottom) in zip(who.tolist(), first.tolist(), last.tolist(), strict=True):
            if self._bytes > KEEPING.most_bytes:
                return
            if right - left < 4 or bottom - top < 4:
                continue
            grey = _cut(scene, sample, slice(top, bottom), slice(left, right))
            self.kept.append(Window(number, left, top, sample.parity, sample.lines, grey))
            self._bytes += grey.size
            self._of_place[place] += grey.size
            self._pieces[place] += 1

    def _has_room(self) -> Bools:
        """Of each place whether another piece about it may be kept."""
        return np.asarray((self._of_place <= KEEPING.of_each) | (self._pieces < KEEPING.many))


def no_disc(looks: Appearance, lines: int) -> Bools:
    """Which targets (n,) look so little like a disc that they may be two."""
    width, height = looks.size[0], looks.size[1] * lines
    with np.errstate(invalid="ignore"):
        low, high = np.minimum(width, height), np.maximum(width, height)
        long = (high > KEEPING.aspect * low) & (high - low >= KEEPING.uneven_px)
        thin = (looks.pixels * lines < KEEPING.fill * width * height) & (low >= 2 * KEEPING.uneven_px)
    return np.asarray(long | thin)


def _cut(scene: Scene, sample: Sample, rows: slice, columns: slice) -> NDArray[np.uint8]:
    """A piece of the sample, as `Window.grey` has it."""
    detection = scene.detection
    bright = detection.bright(sample.luma[rows, columns])
    if bright.dtype == np.uint8 and detection.scale == 1:
        grey = np.maximum(bright, np.uint8(HIDDEN + 1))
    else:
        grey = np.clip(np.rint(bright * detection.scale), HIDDEN + 1, 255).astype(np.uint8)
    if scene.static is not None:
        grey[hidden_by_static(scene.static, sample.parity, (columns.start, rows.start), grey.shape)] = HIDDEN
    return grey


def lit_pieces(kept: Sequence[Window], lit: Lighting | None) -> dict[str, Array]:
    """The columns lit_x, lit_y, lit_sd (kept,) of pieces of a recording whose targets are lit so."""
    way = np.zeros((3, len(kept)))
    if lit is not None and kept:
        corner = np.array([[one.left, one.top * one.lines + one.parity] for one in kept], float).T
        size = np.array([[one.grey.shape[1], one.grey.shape[0] * one.lines] for one in kept], float).T
        way[:2], way[2] = lit.ways(-1, corner + size / 2, np.ones(len(kept)))
    return dict(zip(("lit_x", "lit_y", "lit_sd"), way, strict=True))
