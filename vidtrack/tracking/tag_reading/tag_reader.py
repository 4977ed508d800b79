"""Coded tags in a recording: every picture is searched as it passes, field by field where it is interlaced."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.timing.fields import split
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.initiation.clip import OPENING, field_order
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.tracking.tag_reading.coded_tags import TagFinder
from vidtrack.tracking.tag_reading.tag_corners import Tone, tag_corners
from vidtrack.tracking.tag_reading.tag_cover import Hull, cover
from vidtrack.tracking.tag_reading.tag_tone import misfits, tone_of

CORNERS = ("1", "2", "3", "4")
"""Of a tag: upper left, upper right, lower right, lower left, as the tag is read."""


class TagsSeen(NamedTuple):
    """What a recording shows of tags: n of them at k samples.

    ids       (n,) in order
    frame     (k,); field (k,) frame, top or bottom; stamp (k,) s; offset (k,) frames by which a field is later
    b, sd     (k, n, 4, 2) px; NaN where a corner was not measured
    flag      (k, n) 0 measured, else one of FLAGS
    side      (k, n) px, mean side; NaN where the tag was not found
    blur      (k, n) px, sd of the edges' blur
    contrast  (k, n) grey levels
    gamma     levels are light to the power of 1/gamma, by the tags themselves; NaN: they do not show it
    """

    ids: NDArray[np.intp]
    frame: NDArray[np.int64]
    field: NDArray[np.object_]
    stamp: Array
    offset: Array
    b: Array
    sd: Array
    flag: NDArray[np.intp]
    side: Array
    blur: Array
    contrast: Array
    gamma: float = np.nan


TONE_SIGHTINGS, TONE_WAITS = 4, 300
"""Sightings by which a recording's gamma is found, and how many are kept at most until it is."""


class _Waiting(NamedTuple):
    """A tag as it was seen before the recording's gamma was known; rough is relative to the piece of the picture."""

    at: int  # which of those found
    piece: NDArray[np.generic]
    origin: Array
    rough: Array
    parity: int | None


FLAGS = ("", "lost", "twice", "blurred")
"""lost: not found; twice: two tags of one number, so that neither is named; blurred: found, but a corner is not sharp,
or at the picture's edge."""


class TagReader:
    """Notes the tags of frames as they pass.

    family  one of `detection.coded_tags.FAMILIES`
    ids     those that count; None: every one
    fields  as `detect.fields`
    cover   the frames are handed on with the tags painted over: for other targets in them
    damage  what the frames have passed: nothing is seen in those that it found
    """

    def __init__(
        self,
        family: str,
        info: VideoInfo,
        *,
        ids: Sequence[int] | None = None,
        fields: str = "auto",
        cover: bool = False,
        damage: DamagedPictures | None = None,
    ) -> None:
        self._finder, self._info, self._fields = TagFinder(family), info, fields
        self._ids = None if ids is None else set(ids)
        self._samples: list[tuple[int, str, float, float]] = []
        self._found: list[tuple[int, int, Array, Array, float, float, float, int]] = []
        self._tone: Tone | None = None
        self._misfits: list[Array] = []
        self._waiting: list[_Waiting] = []
        self._damaged = damage.indices if damage else set[int]()
        self._cover, self.patches = cover, dict[tuple[int, str], list[Hull]]()
        self.order = "frame"
        self.modules = self._finder.modules

    def over(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames, unchanged or with tags painted over; where, px, is in `patches`, by frame and field."""
        frames, opening = iter(frames), list[Frame]()
        if self._fields != "frame":
            opening = list(islice(frames, OPENING.frames))
            if opening:
                self.order = field_order(self._fields, self._info, opening)[0]
        for frame in chain(opening, frames):
            found = self._look(frame)
            yield self._covered(frame, found) if self._cover and any(found.values()) else frame

    def _look(self, frame: Frame) -> dict[tuple[str, int | None], list[Array]]:
        """The corners of the tags in the picture, or in each field of it: by its name and parity, px of its own."""
        if self.order == "frame":
            return {("frame", None): self._sample(frame, "frame", 0.0, frame.luma, None)}
        return {
            (field.name, field.parity): self._sample(frame, field.name, field.offset, field.luma, field.parity)
            for field in split(frame.luma, self.order)
        }

    def _covered(self, frame: Frame, found: dict[tuple[str, int | None], list[Array]]) -> Frame:
        luma = np.array(frame.luma)
        for (field, parity), tags in found.items():
            own = luma if parity is None else luma[parity::2]
            for corners in tags:
                hull = cover(own, corners, self.modules)
                if hull is not None:
                    if parity is not None:
                        hull = (hull * [1, 2] + [0, parity]).astype(np.float32)
                    self.patches.setdefault((frame.index, field), []).append(hull)
        return frame._replace(luma=luma)

    def _sample(
        self, frame: Frame, field: str, offset: float, luma: NDArray[np.generic], parity: int | None
    ) -> list[Array]:
        import cv2

        k = len(self._samples)
        self._samples.append((frame.index, field, float(frame.time), offset))
        if frame.corrupt:
            return []
        picture = _eight_bits(luma, self._info.bits)
        if parity is not None:  # square again for the detector; the corners are measured in the field itself
            picture = cv2.resize(picture, (picture.shape[1], 2 * picture.shape[0]))
        found = self._finder.found(picture)
        each = [corners if parity is None else corners * [1.0, 0.5] - [0.0, 0.25] for corners in found.corners]
        numbers, count = np.unique(found.ids, return_counts=True)
        for number, several in zip(numbers.tolist(), count.tolist(), strict=True):
            if self._ids is not None and number not in self._ids:
                continue
            rough = found.corners[found.ids == number][0]
            side = float(np.linalg.norm(np.roll(rough, -1, 0) - rough, axis=-1).mean())
            if several > 1:
                nothing = np.full((4, 2), np.nan)
                self._found.append((k, number, nothing, nothing, side, np.nan, np.nan, 2))
                continue
            if parity is not None:
                rough = rough * [1.0, 0.5] - [0.0, 0.25]
            own = tag_corners(luma, rough, self.modules, self._tone or Tone(1.0, self._top))
            b, sd, flag = _in_frame(own.b, own.sd, parity)
            if self._tone is None:
                self._wait(luma, rough, parity)
            self._found.append((k, number, b, sd, side, own.blur, own.contrast, flag))
            if self._tone is None and (len(self._misfits) == TONE_SIGHTINGS or len(self._waiting) == TONE_WAITS):
                self._decide()
        return each

    @property
    def _top(self) -> float:
        return float(2**self._info.bits - 1)

    def _wait(self, luma: NDArray[np.generic], rough: Array, parity: int | None) -> None:
        """Keep a tag until the recording's gamma is known."""
        fits = misfits(luma, rough, self.modules, self._top)
        if fits is not None:
            self._misfits.append(fits)
        margin = np.ptp(rough, axis=0).max() / self.modules + 8
        low = np.maximum(np.floor(rough.min(0) - margin), 0).astype(int)
        high = np.ceil(rough.max(0) + margin).astype(int)
        piece = np.array(luma[low[1] : high[1], low[0] : high[0]])
        self._waiting.append(_Waiting(len(self._found), piece, low.astype(float), rough - low, parity))

    def _decide(self) -> None:
        """The recording's gamma from the tags so far, which are measured again by it."""
        self._tone = tone_of(self._misfits, self._top)
        for each in self._waiting if self._tone.power != 1 else ():
            own = tag_corners(each.piece, each.rough, self.modules, self._tone)
            b, sd, flag = _in_frame(own.b + each.origin, own.sd, each.parity)
            k, number, _, _, side, _, _, _ = self._found[each.at]
            self._found[each.at] = (k, number, b, sd, side, own.blur, own.contrast, flag)
        self._waiting.clear()

    def seen(self) -> TagsSeen:
        """All that was noted."""
        if self._tone is None:
            self._decide()
        assert self._tone is not None
        k = len(self._samples)
        ids = np.unique([found[1] for found in self._found]).astype(np.intp)
        if self._ids is not None:
            ids = np.array(sorted(self._ids), np.intp)
        n = len(ids)
        b, sd = np.full((k, n, 4, 2), np.nan), np.full((k, n, 4, 2), np.nan)
        flag = np.ones((k, n), np.intp)
        side, blur, contrast = (np.full((k, n), np.nan) for _ in range(3))
        column = {int(number): i for i, number in enumerate(ids)}
        for row, number, own_b, own_sd, own_side, own_blur, own_contrast, own_flag in self._found:
            if self._samples[row][0] in self._damaged:
                continue
            at = row, column[number]
            b[at], sd[at], flag[at] = own_b, own_sd, own_flag
            side[at], blur[at], contrast[at] = own_side, own_blur, own_contrast
        frame, field, stamp, offset = zip(*self._samples, strict=True) if k else ((), (), (), ())
        return TagsSeen(
            ids,
            np.array(frame, np.int64),
            np.array(field, object),
            np.array(stamp, float),
            np.array(offset, float),
            b,
            sd,
            flag,
            side,
            blur,
            contrast,
            1 / self._tone.power if self._misfits else np.nan,
        )


def _in_frame(b: Array, sd: Array, parity: int | None) -> tuple[Array, Array, int]:
    """Corners and sd, px of the frame, from those of a field, and which of FLAGS they have."""
    if parity is not None:
        b, sd = b * [1.0, 2.0] + [0.0, parity], sd * [1.0, 2.0]
    return b, sd, 0 if np.isfinite(b).all() else 3


def _eight_bits(luma: NDArray[np.generic], bits: int) -> NDArray[np.uint8]:
    if luma.dtype == np.uint8:
        return np.ascontiguousarray(luma, np.uint8)
    scaled = luma.astype(np.float32) * (255 / (2**bits - 1))
    return np.asarray(np.clip(scaled, 0, 255), np.uint8)
