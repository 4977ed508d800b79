"""The threshold with which a target is measured first: of two that lie half-way up it, the lower one.

Half-way up is what the pixels above a threshold are half as bright again as: a threshold that depends on itself. A ball
that a lamp lights from one side may have two of them. Above the lower one lies the ball, above the higher one its lit
side alone, and a target that begins with that one goes over to the other within some samples, a few pixels at a time,
as if it became another thing. Sought from below, the lower one is found first; it counts where what lies above it is
rounder, whole and alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Picture
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.target_threshold import PER_TARGET
from vidtrack.tracking.discs.clump import elongation
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance


@dataclass(frozen=True)
class FromBelow:
    """Where the lower threshold is sought, and when it counts.

    begin     of a target's threshold over its background: from where on
    steps     thresholds that are tried, each half-way up what the one before shows; down: as many from the one that is
              known, which the first sight of a small target makes too high
    larger    times the pixels at the higher one, and `grain` pixels
    round     elongation of second moments, at most
    full      of the area of the ellipse with those moments, that is filled at least
    beside    of a target's length, and px: what is looked at on each side of its middle
    """

    begin: float = 0.4
    steps: int = 12
    down: int = 1
    larger: float = 1.25
    grain: float = 3.0
    round: float = 0.25
    full: float = 0.93
    beside: tuple[float, float] = (1.2, 5.0)


FROM_BELOW = FromBelow()


class _Thing(NamedTuple):
    """A connected part of a piece: pixels, mean grey level, width, height (rows), elongation, share of its ellipse that
    is filled; inside: it does not reach the piece's edge.
    """

    mask: NDArray[np.bool_]
    pixels: int
    mean: float
    width: int
    height: int
    elongation: float
    full: float
    inside: bool


def from_below(
    sample: Sample, predicted: Array, known: Appearance, threshold: Array, detection: Detection
) -> tuple[Appearance, Array]:
    """Appearance and thresholds (n,) with those of targets that were not measured yet and have a lower one.

    predicted  (n, 2) px; threshold  grey levels of pictures turned bright. Nothing changes with a threshold of the
               user's, and for targets that have been measured, of which nothing is known, or that are cut by an edge
    """
    new = np.flatnonzero(np.isnan(known.unrest) & known.known & np.isfinite(predicted).all(axis=1))
    if detection.level is not None or not new.size:
        return known, threshold
    looks, levels = Appearance(known.values.copy()), threshold.copy()
    for i in new.tolist():
        found = _lower(sample, predicted[i], known.of(slice(i, i + 1)), float(threshold[i]), detection)
        if found is not None:
            levels[i], thing = found
            looks.pixels[i], looks.size[:, i] = thing.pixels, (thing.width, thing.height)
    return looks, levels


def _lower(
    sample: Sample, at: Array, known: Appearance, threshold: float, detection: Detection
) -> tuple[float, _Thing] | None:
    """The lower threshold and what lies above it; None where there is none."""
    wide, high = known.size[:, 0] * (1, sample.lines)
    reach = FROM_BELOW.beside[0] * max(wide, high) + FROM_BELOW.beside[1]
    column, row = float(at[0]), float(sample.row(at[1]))
    rows, columns = sample.luma.shape
    left, top = max(round(column - reach), 0), max(round(row - reach / sample.lines), 0)
    right, bottom = min(round(column + reach) + 1, columns), min(round(row + reach / sample.lines) + 1, rows)
    if right - left < 3 or bottom - top < 3:
        return None
    grey = detection.bright(sample.luma[top:bottom, left:right])
    background, least = float(known.background[0]), SURROUNDINGS.stands_out * detection.noise
    place = column - left, row - top

    def half_way(level: float, steps: int) -> tuple[float, _Thing] | None:
        """Thresholds half-way up what the one before shows, as long as that changes."""
        thing = _thing(grey, level, place, detection.scale, sample.lines)
        for _ in range(steps):
            if thing is None:
                return None
            new = background + max(PER_TARGET.half * (thing.mean - background), least)
            if abs(new - level) < 0.5 * detection.scale:
                break
            level = new
            thing = _thing(grey, level, place, detection.scale, sample.lines)
        return None if thing is None else (level, thing)

    begin = background + max(FROM_BELOW.begin * (threshold - background), least)
    if begin >= threshold or (upper := half_way(threshold, FROM_BELOW.down)) is None:
        return None
    lower = half_way(begin, FROM_BELOW.steps)
    if lower is None or lower[0] >= upper[0]:
        return None
    one, before = lower[1], upper[1]
    larger = one.pixels > FROM_BELOW.larger * before.pixels + FROM_BELOW.grain
    rounder = one.elongation < min(before.elongation, FROM_BELOW.round) and one.full > FROM_BELOW.full
    if not (larger and rounder and one.inside):
        return None
    others = (grey > upper[0] / detection.scale) & one.mask & ~before.mask
    return None if np.count_nonzero(others) > FROM_BELOW.grain else lower


def _thing(grey: Picture, level: float, at: tuple[float, float], scale: float, lines: int) -> _Thing | None:
    """The part above a level, grey levels, that is nearest to a place (column, row) in the piece."""
    n, labels, stats, middle = cv2.connectedComponentsWithStats(
        (grey > level / scale).astype(np.uint8), connectivity=8, ltype=cv2.CV_32S
    )
    if n < 2:
        return None
    off = np.hypot(middle[1:, 0] - at[0], lines * (middle[1:, 1] - at[1])) - np.sqrt(stats[1:, cv2.CC_STAT_AREA])
    k = 1 + int(np.argmin(off))
    left, top, width, height, pixels = (int(v) for v in stats[k])
    mask = labels == k
    y, x = np.nonzero(mask)
    xx, yy = x.var() + 1 / 12, lines**2 * (y.var() + 1 / 12)
    xy = lines * np.mean((x - x.mean()) * (y - y.mean()))
    filled = float(lines * pixels / (4 * np.pi * np.sqrt(max(xx * yy - xy * xy, 1e-6))))
    inside = left > 0 and top > 0 and left + width < grey.shape[1] and top + height < grey.shape[0]
    mean = float(grey[mask].mean()) * scale
    return _Thing(mask, pixels, mean, width, height, float(elongation(*np.array([xx, yy, xy]))), filled, inside)
