"""One sample of a recording as the tracker sees it: a whole frame, or one field of an interlaced one.

Positions are always those of the frame buffer; a sample states how its rows lie in it: Yf = lines * row + parity.
"""

from __future__ import annotations

from typing import NamedTuple

from vidtrack.arrays import Array
from vidtrack.timing.frame import Luma


class Sample(NamedTuple):
    """A picture to measure.

    luma    (rows, width) as stored; time  samples after the first
    corrupt, repeated  the picture is damaged; it is the one before once more: it measures nothing
    parity  0 or 1 and lines 2 for a field, 0 and 1 for a whole frame
    """

    luma: Luma
    time: float
    parity: int = 0
    lines: int = 1
    corrupt: bool = False
    repeated: bool = False

    def row(self, y: Array) -> Array:
        """The sample's rows at Yf, px."""
        return (y - self.parity) / self.lines
