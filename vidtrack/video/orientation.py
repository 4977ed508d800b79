"""How a player turns the stored pictures before it shows them: the display matrix of a video, EXIF of a still.

A camera that stands on its side stores its pictures lying and writes beside them how to turn them. Positions hold in
the picture that a person sees, so that picks and boxes read off in any player fit: the frame buffer is the stored
picture after the turn.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from vidtrack.timing.frame import Luma

_TAG = 274
"""EXIF's tag of the orientation."""

_HEAD = 1 << 18
"""Bytes at the beginning of a still in which its EXIF is looked for."""


class Orientation(NamedTuple):
    """One of the eight ways to lay a picture down: rows and columns exchanged first, then either axis reversed."""

    transposed: bool = False
    flip_x: bool = False
    flip_y: bool = False

    @property
    def mirrored(self) -> bool:
        """Whether left and right are exchanged, after the turn by `rotation`."""
        return self.transposed ^ self.flip_x ^ self.flip_y

    @property
    def rotation(self) -> int:
        """Degrees anticlockwise, 0, 90, 180 or 270."""
        unmirrored = self._replace(flip_x=self.flip_x ^ self.mirrored)
        return _ROTATIONS[unmirrored]

    def field_order(self, stored: str, height: int) -> str:
        """The field that comes first in the turned picture, of `height` stored lines.

        On pictures that lie on their side fields are columns, and nothing here takes those apart: "progressive".
        """
        if self.transposed:
            return "progressive"
        swapped = self.flip_y and height % 2 == 0
        return {"top": "bottom", "bottom": "top"}.get(stored, stored) if swapped else stored

    def applied(self, read: Callable[[Any], Luma]) -> Callable[[Any], Luma]:
        """`read`, its pictures turned; `read` itself, without a copy, where nothing is to be done."""
        if self == STORED:
            return read
        import cv2  # turned pictures only: numpy takes ten times as long to exchange rows and columns

        axes = {(True, False): 1, (False, True): 0, (True, True): -1}.get(self[1:])

        def turned(picture: Any) -> Luma:
            luma = read(picture)
            if self.transposed:
                luma = cv2.transpose(luma)
            if axes is not None:
                luma = cv2.flip(luma, axes)
            luma.setflags(write=False)
            return luma

        return turned


STORED = Orientation()

_ROTATIONS = {
    STORED: 0,
    Orientation(True, False, True): 90,
    Orientation(False, True, True): 180,
    Orientation(True, True, False): 270,
}

_OF_EXIF = {
    1: STORED,
    2: Orientation(False, True, False),
    3: Orientation(False, True, True),
    4: Orientation(False, False, True),
    5: Orientation(True, False, False),
    6: Orientation(True, True, False),
    7: Orientation(True, True, True),
    8: Orientation(True, False, True),
}


def orientation_of(picture: Any, path: str) -> Orientation | None:
    """The orientation of a decoded picture; None where it asks for a turn that is no quarter of a circle.

    path  of its file, read for EXIF where the decoder found some
    """
    try:
        matrix = picture.side_data.get("DISPLAYMATRIX")
    except ValueError:  # PyAV 18 gives no side data at all where it does not know one of its kinds, such as EXIF
        with open(path, "rb") as file:
            return orientation_in_exif(file.read(_HEAD)) or _of_degrees(picture.rotation)
    return STORED if matrix is None else _of_matrix(*np.frombuffer(matrix, np.int32)[[0, 1, 3, 4]].tolist())


def orientation_in_exif(head: bytes) -> Orientation | None:
    """The orientation in the EXIF block of a JPEG, PNG, WebP or TIFF, from the first bytes of the file; None without.

    Source: Exif 2.32, tag 274; TIFF 6.0, sections 2 and 8.
    """
    for start in (b"II*\0", b"MM\0*"):
        order = "<" if start[:1] == b"I" else ">"
        at = head.find(start)
        if at < 0:
            continue
        block = head[at:]
        try:
            (first,) = struct.unpack_from(order + "I", block, 4)
            (count,) = struct.unpack_from(order + "H", block, first)
            for entry in range(first + 2, first + 2 + 12 * count, 12):
                tag, _, _, value = struct.unpack_from(order + "HHIH", block, entry)
                if tag == _TAG:
                    return _OF_EXIF.get(value)
        except struct.error:
            continue
    return None


def _of_matrix(a: int, b: int, c: int, d: int) -> Orientation | None:
    """Where the stored pixel (x, y) is shown: (a x + c y, b x + d y), whatever the scale."""
    along, across = abs(a) + abs(d), abs(b) + abs(c)
    if along > 100 * across:
        return Orientation(False, a < 0, d < 0)
    if across > 100 * along:
        return Orientation(True, c < 0, b < 0)
    return None


def _of_degrees(anticlockwise: int) -> Orientation | None:
    return next((own for own, degrees in _ROTATIONS.items() if (degrees - anticlockwise) % 360 == 0), None)
