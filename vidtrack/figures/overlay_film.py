"""What was found, drawn over the pictures of a recording: one after the other, for a film."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.figures.style import PALETTE, over_picture

if TYPE_CHECKING:
    from vidtrack.timing.frame import Luma

TRAIL = 60
"""Positions of a target that its trail shows."""

LOST = (float("nan"), float("nan"))

WARNING = (60, 60, 255)
"""Blue, green and red of what was lost."""

Picture = NDArray[np.uint8]


class Painter:
    """Draws the marks of one picture after the other, and the trails that they leave.

    names     of tracks: the targets that they are, where those have other names
    caption   what stands in the corner of each picture, before its frame and time
    """

    def __init__(self, targets: Sequence[str], names: Mapping[str, str], caption: str, bits: int = 8) -> None:
        each = dict.fromkeys([names.get(target, target) for target in targets])
        self._colours = {name: _bgr(PALETTE[i % len(PALETTE)]) for i, name in enumerate(each)}
        self._names = names
        self._caption = caption
        self._scale = 255.0 / (2**bits - 1)
        self._trails: dict[str, deque[tuple[float, float]]] = {}

    def painted(self, luma: Luma, marks: Sequence[Any], when: str) -> Picture:
        """A picture (h, w, 3) of blue, green and red with its marks; marks: `stages.overlay_film.Mark` of its frame."""
        import cv2

        grey = luma if luma.dtype == np.uint8 else np.rint(luma * self._scale).astype(np.uint8)
        picture = cv2.cvtColor(np.ascontiguousarray(grey), cv2.COLOR_GRAY2BGR)
        size = max(1, round(picture.shape[1] / 640))
        for mark in marks:
            if mark.kind != "located":
                at = mark.at if mark.kind == "seen" else LOST
                self._trails.setdefault(mark.target, deque(maxlen=TRAIL)).append(at)
        for track, trail in self._trails.items():
            p = np.array(trail)
            for part in np.split(p, np.flatnonzero(np.isnan(p[:, 0]))):
                line = np.round(part[np.isfinite(part[:, 0])] * 16).astype(np.int32)
                if len(line):
                    cv2.polylines(picture, [line[:, None]], False, self._colour(track), size, cv2.LINE_AA, 4)
        for mark in marks:
            self._draw(picture, mark, size)
        _write(picture, f"{self._caption}  {when}", (4, picture.shape[0] - 6 * size), (235, 235, 235), size)
        return np.asarray(picture, np.uint8)

    def _draw(self, picture: Any, mark: Any, size: int) -> None:
        import cv2

        colour = self._colour(mark.target)
        x, y = mark.at
        if not np.isfinite([x, y]).all():
            return
        if mark.kind == "located":
            cv2.circle(picture, _fixed(x, y), 16 * 7 * size, (255, 255, 255), size, cv2.LINE_AA, 4)
            cv2.circle(picture, _fixed(x, y), 16 * 9 * size, colour, size, cv2.LINE_AA, 4)
            return
        left, top, wide, high = mark.box
        if np.isfinite(mark.box).all():
            corner = _fixed(left + wide, top + high)
            shade = WARNING if mark.kind == "lost" else colour
            cv2.rectangle(picture, _fixed(left, top), corner, shade, size, cv2.LINE_AA, 4)
        name = self._names.get(mark.target, mark.target)
        label = name if mark.kind == "seen" and not mark.flag else f"{name}: {mark.flag or mark.kind}"
        where = (left, top - 4) if np.isfinite(mark.box).all() else (x + 8, y - 8)
        held = (max(2.0, where[0]), max(12.0 * size, where[1]))
        _write(picture, label, (round(held[0]), round(held[1])), WARNING if mark.kind == "lost" else colour, size)
        if mark.kind == "lost":
            return
        for dx, dy in ((5 * size, 0), (0, 5 * size)):
            cv2.line(picture, _fixed(x - dx, y - dy), _fixed(x + dx, y + dy), colour, size, cv2.LINE_AA, 4)

    def _colour(self, track: str) -> tuple[int, int, int]:
        return self._colours.get(self._names.get(track, track), (200, 200, 200))


def _fixed(x: float, y: float) -> tuple[int, int]:
    """A place in sixteenths of a pixel, held near the picture."""
    return round(float(np.clip(x, -1e5, 1e5)) * 16), round(float(np.clip(y, -1e5, 1e5)) * 16)


def _write(picture: Any, text: str, at: tuple[int, int], colour: tuple[int, int, int], size: int) -> None:
    import cv2

    plain = text.encode("ascii", "replace").decode()
    for shade, width in (((0, 0, 0), 3 * size), (colour, size)):
        cv2.putText(picture, plain, at, cv2.FONT_HERSHEY_SIMPLEX, 0.42 * size, shade, width, cv2.LINE_AA)


def _bgr(colour: str) -> tuple[int, int, int]:
    """Blue, green and red of #rrggbb as it is drawn over pictures."""
    light = over_picture(colour)
    blue, green, red = (int(light[i : i + 2], 16) for i in (5, 3, 1))
    return blue, green, red
