"""Numbered pictures, a file each, as a recording."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.naming import numbered_like
from vidtrack.timing.frame import Luma
from vidtrack.video.decoded import DecodedVideo
from vidtrack.video.recording import Video
from vidtrack.video.stills.heic_tiles import HeicTiles, is_tiled
from vidtrack.video.stills.picture_stack import PictureStack, StackInfo


def still(path: str, colour: Any = None) -> Video:
    """A file of one picture."""
    return PictureStack(HeicTiles(path, colour), None) if is_tiled(path) else DecodedVideo(path, colour=colour)


class NumberedPictures:
    """The pictures beside `path` whose names differ from its own in the number alone, in order of the numbers."""

    def __init__(self, path: str, colour: Any = None) -> None:
        self.path, self._colour = path, colour
        folder = os.path.dirname(path) or "."
        found = numbered_like(os.path.basename(path), os.listdir(folder))
        if not found:
            raise VidtrackError(f"{path}: no numbered picture. Name pictures as cam1_0001.png, cam1_0002.png.")
        self._paths = [os.path.join(os.path.dirname(path), name) for _, name in found]
        counts = np.array([number for number, _ in found])
        step = int(np.median(np.diff(counts))) if len(counts) > 1 else 1
        self.notes: list[str] = []
        if step > 1:
            self.notes.append(f"the pictures' numbers rise by {step}: they are taken for one picture after the other")
        self.numbers = [int(number) for number in np.rint((counts - counts[0]) / max(step, 1))]
        with still(path, colour) as first:
            own = first.info
            next(first.frames())  # what is wrong with all pictures shows now
        self._bits = own.bits
        self.info = StackInfo(
            own.width, own.height, own.bits, own.codec, own.pix_fmt, rotation=own.rotation, mirrored=own.mirrored
        )

    def picture(self, place: int) -> tuple[Luma, bool]:
        """As `Stack.picture`."""
        with still(self._paths[place], self._colour) as one:
            frame = next(one.frames())
            if one.info.bits != self._bits:
                raise VidtrackError(
                    f"{self._paths[place]}: {one.info.bits} bits a pixel, where the first picture has {self._bits}. "
                    "Save all pictures alike."
                )
            return frame.luma.copy(), frame.corrupt
