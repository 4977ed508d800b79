"""What is seen besides the targets, and may be what was meant: other tracks, what moves while a target stands still.

A dim thing that stands where the target begins (paper, a stain, the edge of a board) may be followed in its place once
the target has left it, or from the first picture on; its positions are steady and their sd is small. A few pictures,
spread over the recording, show what moves besides: from one to the next a thing that moves leaves a dark spot where it
was and a bright one, as large, where it is. Of three pictures the second dark spot lies where the first bright one was.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.following.track_cuts import CutTracks
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import CONTRAST, PIXELS, X, Y


@dataclass(frozen=True)
class Besides:
    """When something moves besides a target that stands still.

    pictures   that are kept at least, evenly spread, and twice as many at most; wide: px to which they are reduced
    rests      px, within which a target stands still
    beyond     times the noise of a difference, and share of the target's contrast, that a spot differs by at least
    restless   times its noise, by which most of a difference may scatter: else light, or the camera, has changed
    alike      ratio of the pixels of two spots of one thing, and of their differences, at most
    least      pixels of a spot, and share of the target's, at least; most: times the target's
    spots      of a difference, at most: else what is behind moves
    near       px, besides their sizes, within which two spots lie at one place
    long       share of the samples that a track besides the targets lasts, to be a target as well
    """

    pictures: int = 5
    wide: int = 960
    rests: float = 1.0
    beyond: tuple[float, float] = (6.0, 0.5)
    restless: float = 2.0
    alike: tuple[float, float] = (2.0, 1.6)
    least: tuple[float, float] = (6.0, 0.04)
    most: float = 4.0
    spots: int = 40
    near: float = 2.0
    long: float = 0.5


BESIDES = Besides()


class _Kept(NamedTuple):
    number: int
    grey: NDArray[np.uint8]


class _Spot(NamedTuple):
    """Where a difference stands out: its middle and half its size (2,) px of the picture, pixels, grey levels."""

    at: Array
    half: Array
    pixels: float
    change: float


class SpreadPictures:
    """A few pictures of a recording, turned bright and reduced, at samples of one parity."""

    def __init__(self, detection: Detection) -> None:
        self._detection, self._every, self._parity = detection, 1, 0
        self.kept: list[_Kept] = []
        self.scale = (1.0, 1.0)

    def passed(self, samples: Sequence[Sample], first: int) -> None:
        """Look at samples, the first of which has this number."""
        for number, sample in enumerate(samples, start=first):
            if number % self._every or sample.corrupt or sample.repeated:
                continue
            if not self.kept:
                self._parity = sample.parity
            elif sample.parity != self._parity:
                continue
            rows, columns = sample.luma.shape
            shrunk = max(1, round(columns / BESIDES.wide))
            self.scale = float(shrunk), float(shrunk * sample.lines)
            grey = self._detection.bright(sample.luma)
            if shrunk > 1:
                grey = cv2.resize(grey, (columns // shrunk, rows // shrunk), interpolation=cv2.INTER_AREA)
            levels = np.clip(np.rint(grey * np.float32(self._detection.scale)), 0, 255).astype(np.uint8)
            self.kept.append(_Kept(number, levels))
        if len(self.kept) >= 2 * BESIDES.pictures:
            self._every *= 2
            self.kept = self.kept[::2]


def more_than_asked(cut: CutTracks, samples: int, n: int, *, chosen: bool) -> list[Finding]:
    """Whether other things than the targets are followed for long, which look like targets.

    chosen   start boxes say which things are the targets; else it is not known which of them were meant
    """
    if not len(cut.target):
        return []
    length = np.bincount(cut.tracklet, minlength=len(cut.target))
    more = int(((cut.target < 0) & (length > BESIDES.long * samples)).sum())
    if not more:
        return []
    things = "one more thing that looks" if more == 1 else f"{more} more things that look"
    text = f"{things} like the {n} target{'s' * (n != 1)} can be seen for more than half of the run."
    if chosen:
        return [Finding("note", "more-targets-seen", text, f"Set targets to {n + more} if they are targets.")]
    taken = "those that move, then the brightest, were taken"
    cure = f"Set targets to {n + more}, or say in targets.csv which are meant: {taken}."
    return [Finding("doubtful", "more-targets-seen", text, cure)]


def still_findings(
    pictures: SpreadPictures, values: Array, names: Sequence[str], detection: Detection, *, chosen: bool
) -> list[Finding]:
    """Which targets stand still while something else moves that may be what was meant.

    values  (MEASURED, samples, n) of the targets
    chosen  start boxes say which things are the targets: then only what moves away from one that stands still counts
    """
    kept = [one for one in pictures.kept if one.number < values.shape[1]]
    where = values[[X, Y]][:, [one.number for one in kept]]
    spots: dict[tuple[int, int], list[tuple[_Spot, _Spot]]] = {}
    out = []
    for t, name in enumerate(names):
        contrast = float(np.nanmedian(values[CONTRAST, :, t])) if np.isfinite(values[CONTRAST, :, t]).any() else 0.0
        pixels = float(np.nanmedian(values[PIXELS, :, t])) if contrast > 0 else 0.0
        if not pixels:
            continue
        for three in _triples(len(kept)):
            if not _rests(where[:, list(three), t]):
                continue
            for pair in pairwise(three):
                if pair not in spots:
                    a, b = (kept[k].grey for k in pair)
                    spots[pair] = _moved(a, b, pictures.scale, detection.noise)
            own = where[:, three[1], t], float(np.sqrt(pixels / np.pi))
            others = np.delete(where[:, list(three)], t, axis=2)
            way = _way(spots[three[:2]], spots[three[1:]], own, (contrast, pixels), others)
            if way is None or (chosen and not _near(own[0], way, own[1])):
                continue
            (x, y), first, last = own[0], way[0].at, way[-1].at
            text = (
                f"{name} stands still at ({x:.0f}, {y:.0f}) px in samples {kept[three[0]].number} to "
                f"{kept[three[-1]].number}, while something that shines as much moves from ({first[0]:.0f}, "
                f"{first[1]:.0f}) to ({last[0]:.0f}, {last[1]:.0f}) px and is no target: it may be what was meant"
            )
            cure = "Place a start box on what moves (targets.csv), cover what stands behind it, or ask for one more."
            out.append(Finding("doubtful", "target-stands-still", text, cure))
            break
    return out


def _triples(n: int) -> Iterator[tuple[int, int, int]]:
    """Three of n pictures at equal steps, the widest first."""
    for step in range((n - 1) // 2, 0, -1):
        for first in range(n - 2 * step):
            yield first, first + step, first + 2 * step


def _rests(at: Array) -> bool:
    """Whether a target is at one place in all of these pictures (2, 3) px."""
    return bool(np.isfinite(at).all() and np.ptp(at, axis=1).max() <= BESIDES.rests)


def _moved(
    a: NDArray[np.uint8], b: NDArray[np.uint8], scale: tuple[float, float], noise: float
) -> list[tuple[_Spot, _Spot]]:
    """Pairs of spots, where something was in picture a and where it is in b."""
    change = b.astype(np.float32) - a
    change -= np.median(change[::2, ::2])
    usual = 1.4826 * float(np.median(np.abs(change[::2, ::2])))
    expected = 2**0.5 * max(noise, 0.5)
    if usual > BESIDES.restless * expected:
        return []
    change = cv2.blur(change, (3, 3))
    level = BESIDES.beyond[0] * max(usual, expected)
    was, now = (_spots(sign * change, level, scale) for sign in (-1, 1))
    if max(len(was), len(now)) > BESIDES.spots:
        return []
    return [(p, q) for p, q in product(was, now) if _alike(p, q)]


def _spots(change: NDArray[np.float32], level: float, scale: tuple[float, float]) -> list[_Spot]:
    mask = (change > level).astype(np.uint8)
    n, labels, stats, middle = cv2.connectedComponentsWithStats(mask, connectivity=8)
    x, y = scale
    out = []
    for i in range(1, min(n, 4 * BESIDES.spots)):
        pixels = float(stats[i, cv2.CC_STAT_AREA]) * x * x
        if pixels < BESIDES.least[0]:
            continue
        left, top, wide, high = stats[i, :4]
        own = change[top : top + high, left : left + wide][labels[top : top + high, left : left + wide] == i]
        at = np.array([(middle[i, 0] + 0.5) * x - 0.5, (middle[i, 1] + 0.5) * y - 0.5])
        out.append(_Spot(at, np.array([wide * x, high * y]) / 2, pixels, float(own.max())))
    return out


def _alike(p: _Spot, q: _Spot) -> bool:
    pixels, change = BESIDES.alike
    return bool(abs(np.log(p.pixels / q.pixels)) < np.log(pixels) and abs(np.log(p.change / q.change)) < np.log(change))


def _way(
    first: Sequence[tuple[_Spot, _Spot]],
    second: Sequence[tuple[_Spot, _Spot]],
    still: tuple[Array, float],
    looks: tuple[float, float],
    others: Array,
) -> tuple[_Spot, _Spot, _Spot, _Spot] | None:
    """The spots of a thing that moves through three pictures, besides a still target and the others (2, 3, m) px.

    still  its place (2,) and radius, px; looks: its contrast and pixels
    """
    contrast, pixels = looks
    for (a, b), (c, d) in product(first, second):
        spots = a, b, c, d
        if min(one.change for one in spots) < BESIDES.beyond[1] * contrast:
            continue
        sizes = [one.pixels for one in spots]
        if min(sizes) < BESIDES.least[1] * pixels or max(sizes) > BESIDES.most * pixels:
            continue
        if not _together(b, c) or not _alike(b, c) or _together(a, d):
            continue
        if any(np.hypot(*(one.at - still[0])) < 0.7 * still[1] for one in spots):
            continue
        if any(
            _near(others[:, k, m], (one,), 0.0) for m in range(others.shape[2]) for k, one in ((0, a), (1, b), (2, d))
        ):
            continue
        return spots
    return None


def _together(p: _Spot, q: _Spot) -> bool:
    return bool((np.abs(p.at - q.at) < p.half + q.half + BESIDES.near).all())


def _near(at: Array, spots: Sequence[_Spot], radius: float) -> bool:
    """Whether one of the spots lies at a place (2,) px, or touches what is about it."""
    return any(bool((np.abs(one.at - at) < radius + 2 * one.half + BESIDES.near).all()) for one in spots)
