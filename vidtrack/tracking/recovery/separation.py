"""Targets that overlap each other, or that static clutter hides in part, measured by a fit of all of them at once.

What each looks like is known from when it was alone, and better from the first fit on. What else is bright nearby
(static clutter, other targets) is left out of the fit. Where the pixels do not show where each target is, none is
measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.detection.target_threshold import target_levels
from vidtrack.tracking.discs.clump import Clump, clump_at
from vidtrack.tracking.discs.fit_apart import Piece, fit_apart
from vidtrack.tracking.discs.half_hidden import fit_half_hidden, usual_disc
from vidtrack.tracking.discs.joint_fit import JOINT_FIT, SHAPE, Joint, Shapes, shapes_again, shapes_of
from vidtrack.tracking.discs.three_discs import three_discs
from vidtrack.tracking.discs.two_discs import Pair, two_discs
from vidtrack.tracking.following.own_size import OwnSize
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MERGED, POSITION, SATURATED, Found, Searched, X


@dataclass(frozen=True)
class Separating:
    """When targets are fitted together.

    at_most      targets in one fit; widest_px: half axis of one
    ring_px      about the pixels that count, for the background
    about        of half a blob's size, on each side, in which it is looked at
    hidden_for   samples for which a lost target is measured by what something dark in front leaves of it
    no_course    places of a track, at most, from which it is not known where it goes: it is sought in its box
    soft_px      about other targets and static clutter, which their light may reach
    resized      of log half axes: by how much a target looks larger or smaller than it was fitted, where it is that
    """

    at_most: int = 4
    widest_px: float = 60.0
    ring_px: float = 6.0
    about: float = 1.15
    hidden_for: int = 8
    no_course: int = 2
    soft_px: int = 2
    resized: float = 0.05


SEPARATING = Separating()
_ROUND5 = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)).astype(np.uint8)


@dataclass(frozen=True)
class Scene:
    """What a search may rest on: settings, and what of the picture is no target.

    level     grey level of pictures turned bright, for the whole picture
    clutter   (2, m) px, blobs that stand still and are no target
    static    all static clutter; None: there is none
    """

    detection: Detection
    level: float
    clutter: Array
    static: StaticClutter | None = None


class Separation:
    """Fits targets together; remembers the shapes of those in so many places, and which were fitted in this sample.

    course  (places, 2) px, where targets are that overlap by too much to be measured; NaN: nothing shows it
    """

    def __init__(self, places: int, own_size: OwnSize) -> None:
        self.fitted = np.zeros(places, bool)
        self.course = np.full((places, 2), np.nan)
        self._shape = np.full((SHAPE, places), np.nan)
        self._looked = np.full(places, np.nan)  # pixels of its looks when that shape was fitted
        self._own_size = own_size

    def forget(self, who: Ints) -> None:
        """What was known of other tracks that had these places."""
        self._shape[:, who] = np.nan

    def measured(
        self, now: Searched, sample: Sample, who: Ints, middle: Array, scene: Scene, *, behind: Shapes | None = None
    ) -> Searched | None:
        """With targets `who`, expected at `middle` (m, 2) px, measured by one fit; None where it does not hold.

        behind  the shapes of those of which something dark may hide a part
        """
        detection, looks = scene.detection, now.state.appearance.of(who)
        self.course[who] = np.nan
        known = behind or self._known(who, looks.pixels, looks.size, looks.contrast)
        if not 0 < who.size <= SEPARATING.at_most or not np.isfinite(looks.pixels).all():
            return None
        column, row = middle[:, 0], np.asarray(sample.row(middle[:, 1]))
        axes = np.exp(known.value[:2])
        if axes.max() > SEPARATING.widest_px:
            return None
        room = axes.max(axis=1) + JOINT_FIT.reach_px + SEPARATING.ring_px
        rows, columns = sample.luma.shape
        half = axes.max(axis=1)
        if (column - half[0]).min() < 0 or (column + half[0]).max() > columns - 1:
            return None
        if (row - half[1]).min() < 0 or (row + half[1]).max() > rows - 1:
            return None
        left, top, grey = piece_about(sample, detection, column, row, room)
        hidden = self._hidden(now, sample, who, (left, top), grey.shape, scene.static)
        x, y = column - left, row - top
        if behind is not None:
            fit, piece = fit_half_hidden(grey, hidden, x, y, behind, detection.noise)
        else:
            fit, piece = fit_apart(grey, hidden, x, y, known, detection.noise, courses=True)
        if fit is None:
            return None
        if not fit.good:
            self.course[who] = np.stack([fit.x + left, (fit.y + top) * sample.lines + sample.parity], axis=1)
            return None
        self._shape[:, who], self._looked[who] = fit.shape, looks.pixels
        self.fitted[who] = True
        return _with(now, sample, who, fit, left, top, piece, looks.pixels)

    def behind_dark(self, now: Searched, sample: Sample, who: Ints, middle: Array, scene: Scene) -> Searched | None:
        """As `measured`, of targets that touch, of which something dark hides a part."""
        shapes = usual_disc(self._own_size.usual(who))
        return None if shapes is None else self.measured(now, sample, who, middle, scene, behind=shapes)

    def several(self, now: Searched, sample: Sample, i: int, scene: Scene) -> tuple[Pair | float | None, bool]:
        """What place i shows where it is plainly two discs, or three: as `pair`, or pixels of one of the three; and
        whether its shape is that of one.
        """
        if (looked_at := self._clump(now, sample, i, scene)) is None:
            return None, False
        found = self._pair(*looked_at, sample) or three_discs(looked_at[1])
        return found, found is None and not looked_at[1].against_one

    def pair(self, now: Searched, sample: Sample, i: int, scene: Scene) -> Pair | None:
        """The two discs that place i shows, in px of the frame buffer; None: it is not plainly two."""
        looked_at = self._clump(now, sample, i, scene)
        return None if looked_at is None else self._pair(*looked_at, sample)

    def _pair(self, corner: tuple[int, int], clump: Clump, sample: Sample) -> Pair | None:
        found = two_discs(clump)
        if found is None:
            return None
        return found._replace(x=found.x + corner[0], y=(found.y + corner[1]) * sample.lines + sample.parity)

    def pair_in(self, now: Searched, sample: Sample, who: Ints, blob: Array, scene: Scene) -> Array | None:
        """Places (2, 2) px of the two discs that a blob (x, y, width, height px) is, and targets `who` may be; None: it
        is not plainly two.
        """
        contrast = float(now.state.appearance.contrast[who].min())
        looked_at = self._clump_at(now, sample, who, blob[:2], blob[2:] / (2, 2 * sample.lines), contrast, scene)
        found = None if looked_at is None else self._pair(*looked_at, sample)
        return None if found is None else np.stack([found.x, found.y], axis=1)

    def _clump(self, now: Searched, sample: Sample, i: int, scene: Scene) -> tuple[tuple[int, int], Clump] | None:
        """The blob that place i shows, and the left top corner of its window."""
        looks = now.state.appearance.of(slice(i, i + 1))
        half, contrast = looks.size[:, 0] / 2, float(looks.contrast[0])
        return self._clump_at(now, sample, np.array([i]), now.values[POSITION, i], half, contrast, scene)

    def _clump_at(
        self, now: Searched, sample: Sample, who: Ints, at: Array, half: Array, contrast: float, scene: Scene
    ) -> tuple[tuple[int, int], Clump] | None:
        """The blob at a place (2,) px that belongs to `who`; half of its width, px, and height, rows."""
        room = half * SEPARATING.about + JOINT_FIT.reach_px + SEPARATING.ring_px
        if not np.isfinite(half).all() or half.max() > 2 * SEPARATING.widest_px:
            return None
        column, row = at[:1], np.asarray(sample.row(at[1:]))
        left, top, grey = piece_about(sample, scene.detection, column, row, room)
        hidden = self._hidden(now, sample, who, (left, top), grey.shape, scene.static)
        x, y = float(column[0]) - left, float(row[0]) - top
        clump = clump_at(grey, hidden, x, y, contrast, scene.detection.noise, sample.lines)
        return None if clump is None else ((left, top), clump)

    def shapes(self, who: Ints) -> Array:
        """What is known of targets (SHAPE, m) from a fit; NaN: nothing."""
        return self._shape[:, who]

    def known(self, who: Ints, shape: Array, pixels: Array) -> None:
        """Of targets that look like so many pixels (m,) these shapes (SHAPE, m) are known from a fit."""
        self._shape[:, who], self._looked[who] = shape, pixels

    def beside_static(
        self, now: Searched, sample: Sample, who: Ints, predicted: Array, scene: Scene
    ) -> tuple[Searched, Ints]:
        """With targets `who` (m,) that static clutter or something dark hides in part measured by what is seen of them.

        predicted  (m, 2) px; returns for each target 0 where it was measured, else -1
        """
        chosen = np.full(who.size, -1, np.intp)
        hidden = np.zeros(who.size, bool)
        if scene.static is not None:
            size = now.state.appearance.size[:, who]
            hidden = scene.static.touched([sample], *predicted.T[:, None], *size)[0]
        behind = ~hidden & (now.state.missing[who] <= SEPARATING.hidden_for)
        if np.count_nonzero(behind) <= SEPARATING.at_most:
            for i in np.flatnonzero(behind).tolist():
                if (shape := usual_disc(self._own_size.usual(who[i : i + 1]))) is not None:
                    seen = self.measured(now, sample, who[i : i + 1], predicted[i : i + 1], scene, behind=shape)
                    if seen is not None:
                        now, chosen[i] = seen, 0
        for i in np.flatnonzero(hidden & (now.flag[who] & MERGED > 0)).tolist():
            one = who[i : i + 1]
            seen = self.measured(now, sample, one, predicted[i : i + 1], scene)
            if seen is None and np.isfinite(now.state.positions[:, who[i], 0]).sum() <= SEPARATING.no_course:
                place = self._showing(now, sample, one, predicted[i], scene)
                seen = None if place is None else self.measured(now, sample, one, place, scene)
            if seen is not None:
                now, chosen[i] = seen, 0
        return now, chosen

    def _showing(self, now: Searched, sample: Sample, one: Ints, predicted: Array, scene: Scene) -> Array | None:
        """Place (1, 2) px of the largest thing in a target's box that nothing else lights; None: there is none."""
        looks, x, row = now.state.appearance.of(one), predicted[:1], np.asarray(sample.row(predicted[1:]))
        room = now.state.box[one[0]] / (2, 2 * sample.lines)
        left, top, grey = piece_about(sample, scene.detection, x, row, room)
        hidden = self._hidden(now, sample, one, (left, top), grey.shape, scene.static)
        lit = ~hidden & (grey > target_levels(looks, scene.detection, scene.level)[0])
        stats = cv2.connectedComponentsWithStats(lit.astype(np.uint8), connectivity=8)[2][1:]
        if not len(stats):
            return None
        column, line, width, height, _ = stats[np.argmax(stats[:, cv2.CC_STAT_AREA])]
        at = left + column + (width - 1) / 2, (top + line + (height - 1) / 2) * sample.lines + sample.parity
        return np.array([at])

    def _known(self, who: Ints, pixels: Array, size: Array, contrast: Array) -> Shapes:
        first, own = shapes_of(pixels, size, contrast), self._shape[:, who]
        seen = np.isfinite(own[0])
        again = shapes_again(own)
        # seen alone since then it is as large as it looked last: it may have come nearer
        nearer = 0.5 * (np.log(np.maximum(pixels, 1.0) / np.pi) - own[:2].sum(axis=0))
        resized = (np.abs(nearer) > SEPARATING.resized) & (pixels != self._looked[who])
        value, sd = np.where(seen, again.value, first.value), np.where(seen, again.sd, first.sd)
        value[:2, resized] += nearer[resized]
        sd[:2, resized] = first.sd[:2, resized]
        return Shapes(value, sd)

    def _hidden(
        self,
        now: Searched,
        sample: Sample,
        who: Ints,
        corner: tuple[int, int],
        shape: tuple[int, ...],
        static: StaticClutter | None,
    ) -> NDArray[np.bool_]:
        """Pixels of a piece of the sample that something else may light."""
        hidden = np.zeros(shape, np.uint8)
        if static is not None:
            hidden |= hidden_by_static(static, sample.parity, corner, shape)
        others = np.setdiff1d(np.flatnonzero(np.isfinite(now.values[X])), who)
        if others.size:
            x, y = now.values[POSITION, others]
            y = np.asarray(sample.row(y))
            half = now.state.appearance.size[:, others] / 2
            hidden[cover_discs(corner, shape, x, y, half)] = 1
        return hidden > 0


def piece_about(
    sample: Sample, detection: Detection, column: Array, row: Array, room: Array
) -> tuple[int, int, NDArray[np.float32]]:
    """Left column, top row and grey levels of a piece of a sample about places (m,), with room (2,) px on each side."""
    rows, columns = sample.luma.shape
    left, right = int(np.floor(column.min() - room[0])), int(np.ceil(column.max() + room[0])) + 1
    top, bottom = int(np.floor(row.min() - room[1])), int(np.ceil(row.max() + room[1])) + 1
    left, top, right, bottom = max(0, left), max(0, top), min(columns, right), min(rows, bottom)
    grey = detection.bright(sample.luma[top:bottom, left:right]).astype(np.float32) * np.float32(detection.scale)
    return left, top, grey


def cover_discs(
    corner: tuple[int, int], shape: tuple[int, ...], x: Array, row: Array, half: Array
) -> NDArray[np.bool_]:
    """Pixels of a piece of a sample that discs at x, row (m,), half axes (2, m) px and rows, may light."""
    hidden = np.zeros(shape, bool)
    half = half + SEPARATING.soft_px
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    near = np.flatnonzero(
        (np.abs(x - corner[0] - shape[1] / 2) < half[0] + shape[1] / 2)
        & (np.abs(row - corner[1] - shape[0] / 2) < half[1] + shape[0] / 2)
    )
    for i in near.tolist():
        off = ((columns + corner[0] - x[i]) / half[0, i]) ** 2 + ((rows + corner[1] - row[i]) / half[1, i]) ** 2
        hidden |= off < 1
    return hidden


def hidden_by_static(
    static: StaticClutter, parity: int, corner: tuple[int, int], shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Pixels of a piece of a sample, from its left top corner on, that static clutter may light."""
    return np.asarray(cv2.dilate(static.piece(parity, *corner, *shape), _ROUND5) > 0)


def _with(
    now: Searched, sample: Sample, who: Ints, fit: Joint, left: int, top: int, piece: Piece, pixels: Array
) -> Searched:
    """With the targets measured; their appearance stays, and they are still sought in the next sample."""
    y = (fit.y + top) * sample.lines + sample.parity
    values = np.stack(
        [
            fit.x + left,
            y,
            fit.sd_x,
            fit.sd_y * sample.lines,
            pixels,
            fit.mass,
            fit.mass / np.maximum(pixels, 1),
            piece.background,
            *np.full((3, who.size), np.nan),
        ]
    )
    row, column = np.rint(fit.y).astype(int), np.rint(fit.x).astype(int)
    height, width = piece.over.shape
    full = piece.clipped[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    looks = now.state.appearance
    found = now.found(Found(who, values, looks.size[:, who], looks.plateau[who], full * SATURATED))
    return replace(found, state=replace(found.state, appearance=looks))
