"""One sample of a recording as the tracker sees it: a whole frame, or one field of an interlaced one.

Positions are always those of the frame buffer; a sample knows how its rows lie in it: Yf = lines * row + parity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.timing.frame import Luma
from vidtrack.tracking.detection.blobs import Blobs


class Sample(NamedTuple):
    """A picture to measure.

    luma    (rows, width) as stored; time  samples after the first
    parity  0 or 1 and lines 2 for a field, 0 and 1 for a whole frame
    """

    luma: Luma
    time: float
    parity: int = 0
    lines: int = 1
    corrupt: bool = False

    def row(self, y: Array) -> Array:
        """The sample's rows at Yf, px."""
        return (y - self.parity) / self.lines


def in_frame_buffer(blobs: Blobs, sample: Sample, left: int = 0, top: int = 0) -> Blobs:
    """Blobs of a piece of a sample, whose first pixel is (left, top), in coordinates of the frame buffer.

    Boxes keep the sample's own rows as height, so that sizes compare between samples of one kind; pixels likewise.
    """
    return blobs._replace(
        Xf=blobs.Xf + left,
        Yf=(blobs.Yf + top) * sample.lines + sample.parity,
        sd_y=blobs.sd_y * sample.lines,
        left=blobs.left + left,
        top=(blobs.top + top) * sample.lines + sample.parity,
    )


def joined(parts: list[Blobs]) -> Blobs:
    """Blobs of several pieces, each blob once: pieces may overlap. At least one part."""
    whole = Blobs._make(np.concatenate(column) for column in zip(*parts, strict=True))
    if len(parts) == 1:
        return whole
    _, first = np.unique(np.stack([whole.left, whole.top, whole.pixels]), axis=1, return_index=True)
    return Blobs._make(column[np.sort(first)] for column in whole)
