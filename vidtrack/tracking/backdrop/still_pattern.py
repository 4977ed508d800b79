"""What a still pattern of the background does to the centroids of targets that move over it.

The pixels of a target's soft rim show the background in part, and the plane under it is fitted to what is about it. A
background with a grain pulls the centroid to its brighter side: an error of about a tenth of a pixel and more that
varies along the path and that the scatter of the path shows only where the target is quick. The pull is linear in the
background's pixels, so that a picture of the background without the targets says what it is at each place; it is taken
off, and a share of its usual size is added to the sd for what that picture does not show.

A codec's noise may stand still for a while. So the pattern must be there at the end of the recording too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.side_by_side import side_by_side
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MASS, PIXELS, SD_X, SD_Y, Rows, X, Y


@dataclass(frozen=True)
class StillPatterns:
    """How the pull of a pattern is estimated.

    soft_px      width of a target's rim, over which the background shows through less and less
    mask_px      about the radius of its pixels that its centroid is taken over
    free_px      about that radius from where on pixels show the background alone; ring_px: the width of their ring
    step_px      radii that differ by less have the same weights
    places       where the pull is compared between the beginning and the end of the recording, about
    fewest       so few places say nothing
    significant  times the sd of its estimate from which on a pull is more than chance
    worth        share of the centroids' sd below which a pull adds nothing to it
    bright       standard deviations of the background beyond which a pixel is of static clutter, no pattern
    coarse       px of the background that are one of the picture of its light
    about        radii of the target about a place, even, over which the local size of the pull is taken
    unknown      share of the pull, and of its local size, that is not known
    at_once      places that are worked on together
    looks        calls, of those while the recording is read, at which it is looked whether there is a pattern
    ahead_bytes  of pictures of the pull, at most, that are made meanwhile
    """

    soft_px: float = 0.8
    mask_px: float = 2.0
    free_px: float = 4.0
    ring_px: float = 4.0
    step_px: float = 0.5
    places: int = 400
    fewest: int = 20
    significant: float = 4.0
    worth: float = 0.3
    bright: float = 6.0
    coarse: int = 16
    about: int = 6
    unknown: float = 0.45
    at_once: int = 50_000
    looks: tuple[int, ...] = (1, 2, 4, 8)
    ahead_bytes: int = 32_000_000


STILL_PATTERN = StillPatterns()

Pull = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Pictures of the moment that a pattern makes of a target at each place, and of its size thereabouts."""


@lru_cache(maxsize=64)
def kernels(half_width: float, half_height: float) -> Array:
    """Weights (2, height, width) of the background's pixels for the moments m_x, m_y of an elliptical target there."""
    room = STILL_PATTERN.free_px + STILL_PATTERN.ring_px
    half_w, half_h = int(np.ceil(half_width + room)), int(np.ceil(half_height + room))
    y, x = np.mgrid[-half_h : half_h + 1, -half_w : half_w + 1].astype(float)
    mean = np.sqrt(half_width * half_height)
    away = (np.hypot(x / half_width, y / half_height) - 1) * mean  # px beyond the rim, about
    within = (away <= STILL_PATTERN.mask_px).astype(float)
    ring = ((away > STILL_PATTERN.free_px) & (away <= room)).astype(float)
    shown = np.clip(0.5 + away / (2 * STILL_PATTERN.soft_px), 0.0, 1.0)
    powers = np.stack([np.ones_like(x), x, y])
    plane = np.linalg.pinv((powers * ring).reshape(3, -1).T).reshape(3, *x.shape) * ring
    pulls = []
    for along in (x, y):
        moments = (powers * (within * along)).sum(axis=(1, 2))  # of the plane
        pulls.append(within * along * shown - np.tensordot(moments, plane, 1))
    return np.stack(pulls)


class StillPattern:
    """The still pattern of a recording, and pictures of its pull.

    backgrounds  from the opening of the recording, by parity, as `background_of` makes them
    lines        of the frame buffer to a row of a sample
    """

    def __init__(self, backgrounds: Mapping[int, NDArray[Any]], detection: Detection, lines: int = 1) -> None:
        self._backgrounds, self._detection, self._lines = backgrounds, detection, lines
        self._patterns: dict[int, NDArray[np.float32]] = {}  # by parity
        self._pulls: dict[tuple[int, float], list[Pull]] = {}  # by parity and radius: along x, along y
        self._early: dict[tuple[int, float], Array] = {}  # the same: moments at some places of the background
        self._ahead: Iterator[None] | None = None
        self._calls = 0

    def prepare(self, rows: Callable[[], Rows], late: Sequence[Sample]) -> None:
        """Make one of the pictures that `take_off` will need: a decoder works meanwhile, and waits for nothing.

        rows, late  what was measured until now, and the latest samples: they say, when this is called for the first
                    few times, whether there is a pattern, and how large the targets are
        """
        self._calls += 1
        if self._ahead is not None:
            next(self._ahead, None)
        elif self._calls in STILL_PATTERN.looks:
            now = rows()
            measured, radius = self._measured(now)
            if len(shown := list(self._shown(now, measured, radius, late))) == len(self._backgrounds):
                self._ahead = self._made_ahead(_all_rounded(radius[measured]), shown)

    def take_off(self, rows: Rows, parity: Ints, late: Sequence[Sample]) -> bool:
        """Take the pull of the pattern off the positions and add what is not known of it to the sd, in place: rows of
        two hours are too large for a second copy. Whether anything was done.

        parity  (samples,) of their fields; late: the last samples of the recording
        Where no pattern shows, or one too weak to matter, the rows stay as they are.
        """
        measured, radius = self._measured(rows)
        changed = False
        for one in self._shown(rows, measured, radius, late):
            own = measured & (parity == one)[:, None]
            if own.any():
                self._correct(rows.values, own, radius, one)
                changed = True
        self._pulls.clear()
        return changed

    def _measured(self, rows: Rows) -> tuple[Bools, Array]:
        """Where targets (k, n) were measured, and their radii, px."""
        mass, pixels = rows.values[MASS], rows.values[PIXELS]
        return np.isfinite(rows.values[X]) & (mass > 0) & (pixels > 0), np.sqrt(self._lines * pixels / np.pi)

    def _shown(self, rows: Rows, measured: Bools, radius: Array, late: Sequence[Sample]) -> Iterator[int]:
        """The parities of the fields in which a pattern shows that matters."""
        if not measured.any():
            return
        mass = rows.values[MASS][measured]
        usual = rounded_radius(median_of(radius[measured]))
        sds = [median_of(rows.values[row][measured] * mass) for row in (SD_X, SD_Y)]
        weights = kernels(usual, usual / self._lines)
        least = STILL_PATTERN.worth * np.array(sds) / (1, self._lines)  # of a centroid along x and along y
        for one, background in self._backgrounds.items():
            last = next((s for s in reversed(late) if s.parity == one and not s.corrupt), None)
            if last is None:
                continue
            d, places = self._detection, STILL_PATTERN.places
            if (one, usual) not in self._early:
                self._early[one, usual] = moments_of(grey_levels(background, d), weights, places)
            now = moments_of(grey_levels(d.bright(last.luma), d), weights, places)
            if (_pull(self._early[one, usual], now) > least).any():
                yield one

    def _made_ahead(self, radii: Array, parities: Sequence[int]) -> Iterator[None]:
        """Makes a picture at each step, those of the usual radii first, as long as they take no more than they may."""
        sizes, count = np.unique(radii, return_counts=True)
        left = STILL_PATTERN.ahead_bytes
        for size in sizes[np.argsort(-count, kind="stable")].tolist():
            for one in parities:
                left -= 4 * self._backgrounds[one].size * np.dtype(np.float32).itemsize
                if left < 0:
                    return
                pulls = []
                for weights in kernels(size, size / self._lines):
                    pulls.append(_pull_and_size(self._pattern(one), (weights, size)))
                    yield
                self._pulls[one, size] = pulls

    def _pattern(self, parity: int) -> NDArray[np.float32]:
        if parity not in self._patterns:
            self._patterns[parity] = _pattern(grey_levels(self._backgrounds[parity], self._detection))
        return self._patterns[parity]

    def _correct(self, values: Array, own: Bools, radius: Array, parity: int) -> None:
        """Take the pull off values (MEASURED, samples, n), in place, where they are measurements of this parity."""
        rounded = np.where(own, _all_rounded(radius), 0.0)
        several = max(1, STILL_PATTERN.at_once // max(rounded.shape[1], 1))
        sizes, lines = np.unique(rounded[own]).tolist(), self._lines
        new = [size for size in sizes if (parity, size) not in self._pulls]
        parts = [(weights, size) for size in new for weights in kernels(size, size / lines)]
        made = side_by_side(partial(_pull_and_size, self._pattern(parity)), parts)
        pulls = {size: made[2 * i : 2 * i + 2] for i, size in enumerate(new)}
        for size in sizes:
            along = pulls.get(size) or self._pulls[parity, size]
            for first in range(0, len(rounded), several):
                here = rounded[first : first + several] == size
                part = values[:, first : first + several]
                x, y, mass = part[X][here], (part[Y][here] - parity) / lines, part[MASS][here]
                for pull, place, sd, unit in zip(along, (X, Y), (SD_X, SD_Y), (1, lines), strict=True):
                    off, unknown = (between_pixels(picture, x, y) / mass * unit for picture in pull)
                    part[place][here] -= off
                    part[sd][here] = np.hypot(part[sd][here], STILL_PATTERN.unknown * unknown)


def grey_levels(picture: NDArray[Any], detection: Detection) -> NDArray[np.float32]:
    """A stored picture in grey levels."""
    return np.asarray(np.multiply(picture, np.float32(detection.scale), dtype=np.float32))


def rounded_radius(radius: float) -> float:
    """The radius, px, of which the weights are for those about it."""
    return max(1.0, round(radius / STILL_PATTERN.step_px) * STILL_PATTERN.step_px)


def _all_rounded(radius: Array) -> Array:
    return np.maximum(np.rint(radius / STILL_PATTERN.step_px) * STILL_PATTERN.step_px, 1.0)


def moments_of(picture: NDArray[np.float32], weights: Array, places: int) -> Array:
    """The moments (m, 2) that a picture makes at about so many places; none where it is too small."""
    height, width = weights.shape[1:]
    rows, columns = picture.shape[0] - height, picture.shape[1] - width
    if rows < 1 or columns < 1:
        return np.zeros((0, 2))
    step = max(1, int(np.sqrt(rows * columns / places)))
    views = np.lib.stride_tricks.sliding_window_view(picture, (height, width))[::step, ::step]
    return np.asarray(np.tensordot(views.astype(float), weights, ((2, 3), (1, 2))).reshape(-1, 2))


def _pull(early: Array, late: Array) -> Array:
    """sd (2,) of the moments (m, 2) that what stands still makes at places of the picture; 0 where it may be chance."""
    count = len(early)
    if count < STILL_PATTERN.fewest:
        return np.zeros(2)
    alike, unlike = (_spread((early + sign * late) / 2) ** 2 for sign in (1, -1))
    still = alike - unlike  # the covariance of both
    chance = 2.33 / np.sqrt(count) * np.hypot(alike, unlike)  # of a variance by the median of deviations
    return np.where(still > STILL_PATTERN.significant * chance, np.sqrt(np.maximum(still, 0.0)), 0.0)


def _spread(values: Array) -> Array:
    middle = np.array([median_of(column) for column in values.T], values.dtype)
    off = np.abs(values - middle)
    return np.asarray(1.4826 * np.array([median_of(column) for column in off.T], off.dtype))


def _pattern(grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """The background without its static clutter."""
    rows, columns = grey.shape
    small = (max(1, columns // STILL_PATTERN.coarse), max(1, rows // STILL_PATTERN.coarse))
    light = cv2.medianBlur(cv2.resize(grey, small, interpolation=cv2.INTER_AREA), 5)
    light = cv2.resize(light, (columns, rows), interpolation=cv2.INTER_LINEAR)
    over = grey - light
    usual = float(_spread(over.ravel()[:: 1 + over.size // 40_000, None])[0])
    over[np.abs(over) > STILL_PATTERN.bright * usual] = 0.0
    return np.asarray(light + over, np.float32)


def _pull_and_size(pattern: NDArray[np.float32], target: tuple[Array, float]) -> Pull:
    """Pictures of the moment that a pattern makes of a target at each place, and of its size thereabouts.

    target  weights of the moment and radius, px
    """
    weights, size = target
    moment = cv2.filter2D(pattern, cv2.CV_32F, weights.astype(np.float32), borderType=cv2.BORDER_REPLICATE)
    about = STILL_PATTERN.about * int(np.ceil(size)) + 1
    square = moment * moment
    local = np.asarray(cv2.blur(square, (about, about)), np.float32)
    np.maximum(local, 0.0, out=local)
    local += square
    return moment, np.sqrt(local, out=local)


def between_pixels(picture: NDArray[np.float32], x: Array, y: Array) -> Array:
    """The picture between its pixels."""
    rows, columns = picture.shape
    x, y = np.clip(x, 0, columns - 1.001), np.clip(y, 0, rows - 1.001)
    left, top = x.astype(np.intp), y.astype(np.intp)
    across, down = x - left, y - top
    above = picture[top, left] * (1 - across) + picture[top, left + 1] * across
    below = picture[top + 1, left] * (1 - across) + picture[top + 1, left + 1] * across
    return np.asarray(above * (1 - down) + below * down, float)
