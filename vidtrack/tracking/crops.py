"""Pieces of pictures that show what targets looked like at their worst moments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Few:
    """How many pieces are kept: in all, and of each target."""

    in_all: int = 12
    of_each: int = 3


KEPT = Few()


class Crop(NamedTuple):
    """A piece of a picture: (rows, columns) of the sample, its number, the target and the flag."""

    sample: int
    target: int
    flag: int
    picture: NDArray[np.uint8]


def wanted(crops: list[Crop], target: int) -> bool:
    """Whether there is room for one more of this target."""
    return len(crops) < KEPT.in_all and sum(crop.target == target for crop in crops) < KEPT.of_each


def keep_piece(
    crops: list[Crop], sample: Sample, corner: Array, box: Array, moment: tuple[int, int, int], scale: float
) -> None:
    """Keep what a box shows at a bad moment, where there is room; moment: number of the sample, target and flag."""
    if wanted(crops, moment[1]) and np.isfinite(corner).all():
        crops.append(Crop(*moment, piece_of(sample, corner, box, scale)))


def piece_of(sample: Sample, corner: Array, box: Array, scale: float) -> NDArray[np.uint8]:
    """What a box (width, height) px with this left top corner shows, in grey levels."""
    rows, columns = sample.luma.shape
    wide, high = int(box[0]), int(np.ceil(box[1] / sample.lines))
    left = int(np.clip(corner[0], 0, max(columns - wide, 0)))
    top = int(np.clip(sample.row(corner[1]), 0, max(rows - high, 0)))
    piece = sample.luma[top : top + high, left : left + wide] * scale
    return np.clip(np.rint(piece), 0, 255).astype(np.uint8)
