"""A few pictures of a recording, spread evenly over it, taken as its frames pass."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Picture
from vidtrack.timing.frame import Frame


@dataclass(frozen=True)
class Keeping:
    """How many pictures are kept, and how large.

    memory  bytes of them all; most, least: how many, whatever the memory
    pixels  of a picture at most: larger ones are averaged in square blocks. A shift is found to a hundredth of a px,
            so that a coarser picture still shows far less than matters
    first   frames at the beginning that are averaged, so that water and noise leave less in the reference
    stride  every so many frames one is kept, to begin with
    """

    memory: int = 64_000_000
    most: int = 128
    least: int = 12
    pixels: int = 700_000
    first: int = 8
    stride: int = 4


KEEPING = Keeping()


class BackgroundSamples:
    """Keeps some of the frames that pass.

    Where there are too many, every other one is dropped, and from there on half as many are taken.
    A damaged frame is passed over. `block` px of the recording, squared, are one px of what is kept.
    """

    def __init__(self, keeping: Keeping = KEEPING) -> None:
        self._keeping = keeping
        self._pictures: list[Picture] = []
        self._frames: list[int] = []
        self._sum: NDArray[np.float32] | None = None
        self._summed, self._stride, self._shape = 0, keeping.stride, (0, 0)
        self.block = 1

    def over(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames unchanged."""
        for frame in frames:
            if not frame.corrupt:
                self._pass(frame)
            yield frame

    @property
    def pictures(self) -> list[Picture]:
        """What was kept, in order of time."""
        return self._pictures

    @property
    def frames(self) -> NDArray[np.int64]:
        """(n,) the numbers of the frames that were kept."""
        return np.array(self._frames, np.int64)

    @property
    def reference(self) -> NDArray[np.float32] | None:
        """The mean of the first frames, in stored levels; None where no frame was good."""
        return None if self._sum is None else self._sum / np.float32(self._summed)

    def _pass(self, frame: Frame) -> None:
        opening = self._summed < self._keeping.first
        wanted = frame.index % self._stride == 0
        if not (opening or wanted):
            return
        if self._sum is None:
            self._shape = (frame.luma.shape[0], frame.luma.shape[1])
            self.block = max(1, int(np.ceil(np.sqrt(frame.luma.size / self._keeping.pixels))))
        elif frame.luma.shape != self._shape:
            return
        small = averaged(frame.luma, self.block)
        if opening:
            values = small.astype(np.float32)
            self._sum = values if self._sum is None else self._sum + values
            self._summed += 1
        if wanted:
            self._keep(small, frame.index)

    def _keep(self, small: Picture, index: int) -> None:
        most = min(self._keeping.most, max(self._keeping.least, self._keeping.memory // small.nbytes))
        if len(self._pictures) >= most:
            self._pictures, self._frames = self._pictures[::2], self._frames[::2]
            self._stride *= 2
            if index % self._stride:
                return
        self._pictures.append(small)
        self._frames.append(index)


def averaged(luma: Picture, block: int) -> Picture:
    """A picture (h // block, w // block) of means over squares of `block` px; a copy where the block is one px."""
    if block == 1:
        return luma.copy()
    rows, columns = (n // block for n in luma.shape)
    whole = np.ascontiguousarray(luma[: rows * block, : columns * block])
    small: Picture = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    return small


def in_recording(b: Array, block: int) -> Array:
    """Positions (..., 2) in the averaged picture, px, as positions in the recording's."""
    return np.asarray((b + 0.5) * block - 0.5)


def in_averaged(b: Array, block: int) -> Array:
    """The inverse of `in_recording`."""
    return np.asarray((b + 0.5) / block - 0.5)
