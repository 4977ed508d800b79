"""The still wall behind the targets, where it has so strong a pattern that it moves their centroids.

It is known from the opening, and made even about each target before that is measured (`even_wall`). Where a target has
always been, the wall was never seen: how much of the rim is such goes with each measurement, and what a pattern like
the one beside it can do there is added to its sd.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture
from vidtrack.tracking.backdrop.even_wall import EVEN_WALL, SOFT, Grey, even_wall
from vidtrack.tracking.backdrop.still_pattern import (
    StillPattern,
    between_pixels,
    grey_levels,
    kernels,
    moments_of,
    rounded_radius,
)
from vidtrack.tracking.centroiding.order_statistics import median_of
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MASS, PIXELS, SD_X, SD_Y, XX, YY, Appearance, Rows, X, Y


@dataclass(frozen=True)
class StillWalls:
    """When a wall counts, and what is not known of it.

    places, share    where its pull is looked at in the opening, and the share of them, with the most, that decides
    worth_px         by which it pulls the centroids of targets there, at least
    still            times that the pull exceeds how it differs from one picture to another, at least
    usual_px         radius of targets for that; usual_contrast: grey levels, theirs where it is not known
    pictures         of the opening, in which targets are looked for; covered: of them, in which they hide the wall
    stands_out       share of the contrast of the faintest target by which what hides the wall is above its light
    dimmed           share of the contrast of the faintest target in the opening, that one has at least: a piece of the
                     wall is none
    coarse           px of the picture that are one of that of its light
    uncovered        samples from look to look at what had been hidden
    grown_px         about the pixels half-way up that a target's moments are taken over
    soft_px          sd of the blur of its edge, within; unless: where its second moments do not say it
    width            of that, over which the wall shows less and less
    doubt, at_px     share of the pull that is not known where the wall is; of its size over so many px
    unseen           share of the local size of the pull that is not known where the wall is not
    about, about_px  radii, and px besides, of what is local; seen: share of it that is known, at least
    """

    places: int = 400
    share: float = 0.4
    worth_px: float = 0.03
    still: float = 3.0
    usual_px: float = 4.0
    usual_contrast: float = 100.0
    pictures: int = 5
    covered: int = 4
    stands_out: float = 0.35
    dimmed: float = 0.6
    coarse: int = 16
    uncovered: int = 16
    grown_px: float = 3.0
    soft_px: tuple[float, float] = (0.5, 2.5)
    unless: float = 0.8
    width: float = 3.4
    doubt: float = 0.15
    at_px: int = 7
    unseen: float = 1.0
    about: int = 8
    about_px: int = 17
    seen: float = 0.02


STILL_WALL = StillWalls()


class Wall:
    """A wall with a pattern, and how much of it was not known behind each of n targets in each sample.

    levels, hidden  by parity, (rows, columns): grey levels, and where they are not known; contrast: grey levels, of the
                    faintest target in the opening; lines: of the frame buffer to a row of a sample
    """

    def __init__(
        self,
        levels: Mapping[int, Grey],
        hidden: Mapping[int, Bools],
        detection: Detection,
        contrast: float,
        lines: int = 1,
    ) -> None:
        self._levels, self._hidden = dict(levels), dict(hidden)
        self._detection, self._contrast, self._lines = detection, contrast, lines
        self._unknown = np.ones((0, 0), np.float32)
        self._look = 0

    def evened(self, samples: Sequence[Sample], first: int, predicted: Array, appearance: Appearance) -> list[Sample]:
        """Samples, the first of which has this number, in which the wall is even where targets of known looks
        are predicted (k, n, 2) px.
        """
        out = []
        size, contrast = appearance.size.T, appearance.plateau
        known = np.isfinite(size).all(axis=1) & np.isfinite(contrast)
        for j, sample in enumerate(samples):
            unknown = np.ones(predicted.shape[1])
            luma = sample.luma
            if not sample.corrupt and sample.parity in self._levels:
                if first + j >= self._look:
                    self._uncover(sample)
                    self._look = first + j + STILL_WALL.uncovered
                for i in np.flatnonzero(known & np.isfinite(predicted[j]).all(axis=1)).tolist():
                    x, y = predicted[j, i].tolist()
                    here = _window((x, (y - sample.parity) / sample.lines), size[i], luma.shape)
                    piece, unknown[i] = self._piece(sample, here, float(contrast[i]))
                    if piece is not None:
                        luma = luma.copy() if luma is sample.luma else luma
                        luma[here] = piece
            out.append(sample if luma is sample.luma else sample._replace(luma=luma))
            self._record(first + j, unknown)
        return out

    def _record(self, number: int, unknown: Array) -> None:
        """Take down what is not known in a sample; memory is doubled where it is full."""
        if number >= len(self._unknown):
            more = np.ones((max(64, number), unknown.size), np.float32)
            self._unknown = np.concatenate([self._unknown.reshape(-1, unknown.size), more])
        self._unknown[number] = unknown

    def _piece(self, sample: Sample, here: tuple[slice, slice], contrast: float) -> tuple[NDArray[Any] | None, float]:
        """What is to be put in the picture there, as stored, None: nothing; and the share of the wall not known."""
        d, (rows, columns) = self._detection, here
        if rows.stop - rows.start < 5 or columns.stop - columns.start < 5:
            return None, 1.0
        contrast = max(contrast, STILL_WALL.dimmed * self._contrast)
        wall, hidden = self._levels[sample.parity][here], self._hidden[sample.parity][here]
        grey = grey_levels(d.bright(sample.luma[here]), d)
        even, unknown = even_wall(grey, wall, hidden, contrast, d.moving_noise)
        if even is None:
            return None, unknown
        stored = np.clip(np.rint(even / np.float32(d.scale)), 0, d.full).astype(sample.luma.dtype)
        return d.bright(stored), unknown

    def _uncover(self, sample: Sample) -> None:
        """Take in what is no longer hidden."""
        hidden = self._hidden[sample.parity]
        if not hidden.any():
            return
        bright = self._detection.bright(sample.luma)
        now = _by_targets(bright, self._detection, STILL_WALL.stands_out * self._contrast)
        if (new := hidden & ~now).any():
            self._levels[sample.parity][new] = bright[new] * np.float32(self._detection.scale)
            hidden[new] = False

    def prepare(self, rows: Callable[[], Rows], late: Sequence[Sample]) -> None:
        """Nothing, as `StillPattern` has it: nothing takes long at the end."""

    def take_off(self, rows: Rows, parity: Ints, late: Sequence[Sample]) -> bool:
        """What `StillPattern` does to rows, in place: the pull of the wall is in none that was measured before an even
        one, so that only what is not known of it is added to their sd.
        """
        lines, values, unknown = self._lines, rows.values, np.ones(rows.flag.shape)
        k, n = min(len(unknown), len(self._unknown)), rows.flag.shape[1]
        if k:
            unknown[:k] = self._unknown[:k, :n]
        mass, pixels = values[MASS], values[PIXELS]
        measured = np.isfinite(values[X]) & (mass > 0) & (pixels > 0)
        unseen = STILL_WALL.unseen * np.sqrt(unknown)
        alike: dict[tuple[float, float], list[int]] = {}  # by radius and softness: each has pictures of its own
        for i in np.flatnonzero(measured.any(axis=0)).tolist():
            radius = rounded_radius(median_of(np.sqrt(lines * pixels[measured[:, i], i] / np.pi)))
            alike.setdefault((radius, _softness(values[[XX, YY]][:, measured[:, i], i], radius)), []).append(i)
        for ((radius, soft), who), (one, level) in product(alike.items(), self._levels.items()):
            here = np.zeros(measured.shape, bool)
            here[:, who] = measured[:, who] & (parity == one)[:, None]
            place = values[X][here], (values[Y][here] - one) / lines
            weights = _shown(radius, radius / lines, soft)
            for weight, row, unit in zip(weights, (SD_X, SD_Y), (1, lines), strict=True):
                sizes = _sizes(level, self._hidden[one], weight, radius)
                at, about = (between_pixels(size, *place) / mass[here] * unit for size in sizes)
                more = np.hypot(STILL_WALL.doubt * at, unseen[here] * about)
                values[row][here] = np.hypot(values[row][here], more)
        return bool(measured.any())


def _window(at: tuple[float, float], size: Array, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns about a target of this size, width px and height in rows."""
    (x, y), (half_w, half_h) = at, (size / 2 + EVEN_WALL.room_px).tolist()
    rows = slice(max(0, int(y - half_h)), min(shape[0], int(y + half_h) + 2))
    return rows, slice(max(0, int(x - half_w)), min(shape[1], int(x + half_w) + 2))


def _softness(second: Array, radius: float) -> float:
    """sd of the blur of a disc's edge, px, to half a px, by its second moments (2, k) px^2: r^2 / 4 of a sharp one."""
    blur = second.mean(axis=0) - radius**2 / 4
    blur = blur[np.isfinite(blur)]
    if not blur.size:
        return STILL_WALL.unless
    least, most = STILL_WALL.soft_px
    return round(2 * min(max(float(np.sqrt(max(median_of(blur), 0.0))), least), most)) / 2


def _sizes(level: Grey, hidden: Bools, weight: Array, radius: float) -> tuple[Grey, Grey]:
    """How large a moment of the wall is at each place, and about it."""
    moment = cv2.filter2D(level, cv2.CV_32F, weight.astype(np.float32), borderType=cv2.BORDER_REPLICATE)
    good = cv2.erode((~hidden).view(np.uint8), np.ones(weight.shape, np.uint8)).astype(np.float32)
    about = (STILL_WALL.about * int(np.ceil(radius)) + STILL_WALL.about_px,) * 2
    square, seen = cv2.blur(moment * moment * good, about), cv2.blur(good, about)
    whole = good if good.any() else np.ones_like(good)
    usual = np.float32((moment * moment * whole).sum() / whole.sum())
    near = square / np.maximum(seen, np.float32(1e-3))
    here = cv2.blur(moment * moment * good, (STILL_WALL.at_px,) * 2)
    about_it = np.where(seen > STILL_WALL.seen, near, usual)
    return _root(here), _root(about_it)


def _root(square: Array) -> Grey:
    return np.asarray(np.sqrt(np.maximum(square, 0)), np.float32)


def _by_targets(bright: Picture, detection: Detection, least: float) -> Bools:
    """Where a picture shows a target, or its rim: about pixels that are so many grey levels above the light there."""
    grey = grey_levels(bright, detection)
    rows, columns = grey.shape
    small = (max(1, columns // STILL_WALL.coarse), max(1, rows // STILL_WALL.coarse))
    light = cv2.medianBlur(cv2.resize(grey, small, interpolation=cv2.INTER_AREA), 5)
    light = cv2.resize(light, (columns, rows), interpolation=cv2.INTER_LINEAR)
    return np.asarray(cv2.dilate((grey - light > least).view(np.uint8), SOFT) > 0)


def _within(boxes: Array, sample: Sample, shape: tuple[int, ...]) -> Bools:
    """Which pixels of a sample lie in boxes (n, 4), with room for soft rims."""
    inside, room = np.zeros(shape, bool), 2 * EVEN_WALL.soft_px
    for left, top, right, bottom in boxes.tolist():
        up, down = sample.row(np.array([top, bottom])).tolist()
        rows = slice(max(0, int(up) - room), max(0, int(down) + room))
        inside[rows, max(0, int(left) - room) : max(0, int(right) + room)] = True
    return inside


@lru_cache(maxsize=64)
def _shown(half_width: float, half_height: float, soft: float) -> Array:
    """Weights (2, height, width) of the wall's pixels for the moments of what shows of it through the rim of an
    elliptical target, of which the light falls as the integral of a Gaussian of this sd, px.
    """
    within = STILL_WALL.grown_px
    half_w, half_h = int(np.ceil(half_width + within)), int(np.ceil(half_height + within))
    y, x = np.mgrid[-half_h : half_h + 1, -half_w : half_w + 1].astype(float)
    away = (np.hypot(x / half_width, y / half_height) - 1) * np.sqrt(half_width * half_height)
    shown = (away <= within) * np.clip(0.5 + away / (STILL_WALL.width * soft), 0, 1)
    return np.stack([x * shown, y * shown])


def still_wall(
    backgrounds: Mapping[int, NDArray[Any]],
    samples: Sequence[Sample],
    detection: Detection,
    own: Array,
    contrast: float,
) -> Wall | None:
    """The wall in the opening's samples, where it has a pattern that moves centroids; None where it has none.

    backgrounds  of them, turned bright, as `background_of` makes them
    own          (n, 4) left, top, right, bottom px: where the targets begin; contrast: grey levels, of the faintest
    """
    if not len(own):
        return None
    radius, contrast = STILL_WALL.usual_px, contrast if np.isfinite(contrast) else STILL_WALL.usual_contrast
    lines, pictures, strong = samples[0].lines, dict[int, list[Picture]](), False
    for parity, background in backgrounds.items():
        shown = [sample.luma for sample in samples if sample.parity == parity and not sample.corrupt]
        if len(shown) < STILL_WALL.pictures:
            return None
        which = np.rint(np.linspace(0, len(shown) - 1, STILL_WALL.pictures)).astype(int).tolist()
        late = pictures.setdefault(parity, [detection.bright(shown[k]) for k in which])[-2]
        early, late = grey_levels(background, detection), grey_levels(late, detection)
        pull = _pull(early, late, kernels(radius, radius / lines))
        strong |= pull > STILL_WALL.worth_px * np.pi * radius**2 / lines * contrast
    if not strong:
        return None
    hidden = {}
    for parity, some in pictures.items():
        hides = [_by_targets(picture, detection, STILL_WALL.stands_out * contrast) for picture in some]
        first = next(sample for sample in samples if sample.parity == parity)
        hidden[parity] = (np.sum(hides, axis=0) >= STILL_WALL.covered) & _within(own, first, some[0].shape)
    levels = {parity: grey_levels(background, detection) for parity, background in backgrounds.items()}
    return Wall(levels, hidden, detection, contrast, lines)


def behind_targets(
    backgrounds: Mapping[int, NDArray[Any]],
    samples: Sequence[Sample],
    detection: Detection,
    own: Array,
    contrast: float,
) -> tuple[Wall | None, Wall | StillPattern]:
    """The wall, as `still_wall` has it, and what takes off what a pattern does to rows: it, or where there is none what
    knows those that move centroids less.
    """
    wall = still_wall(backgrounds, samples, detection, own, contrast)
    return wall, wall or StillPattern(backgrounds, detection, samples[0].lines)


def _pull(early: Grey, late: Grey, weights: Array) -> float:
    """The moments that what stands still makes at the places of a picture that have the most; 0: it does not stand."""
    one, other = (moments_of(picture, weights, STILL_WALL.places) for picture in (early, late))
    if not len(one):
        return 0.0
    size = np.hypot(*one.T)
    most = size >= np.quantile(size, 1 - STILL_WALL.share)
    pull, apart = median_of(size[most]), median_of(np.hypot(*(one - other)[most].T))  # balls are in a few alone
    return pull if pull > STILL_WALL.still * apart else 0.0
