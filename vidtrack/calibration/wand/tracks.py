"""What cameras followed of a wand, on moments that all of them share, each ball in the place of its end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.wand.ends import jointly
from vidtrack.calibration.wand.measured import Views
from vidtrack.calibration.wand.timing import find_shift
from vidtrack.timing.resample import resample

AGAIN = 0.25
"""Of a sampling interval, over which velocities are taken."""


class Follows(NamedTuple):
    """What one camera followed."""

    t: Array  # (T,) s
    b: Array  # (T, q, 2) px; NaN where a ball is lost or in doubt
    sd: Array  # (T, q, 2)
    stretch: Ints  # (T,) the same while every ball surely keeps its place in b


class Timed:
    """The tracks on moments that all cameras share, whatever their clocks.

    late    cameras whose clocks are unknown: their shift is sought by how well the balls of both cameras fit together
    unsure  those of them whose shift could be another one
    """

    def __init__(self, follows: Sequence[Follows], orders: list[tuple[int, ...]], late: Sequence[int]) -> None:
        self.follows = list(follows)
        known = [i for i in range(len(follows)) if i not in late]
        self.reference = known[0] if known else 0
        self.late = tuple(i for i in late if i != self.reference)
        self.shift = np.zeros(len(follows))
        self.unsure: list[int] = []
        base = self.follows[self.reference]
        for i in self.late:
            own = self.follows[i]
            near = float(base.t[0] - own.t[0])
            both = base.stretch, own.stretch
            found = find_shift(base.t, base.b, own.t, own.b, orders, both, near=near)
            if found is None or not found.sure:
                self.unsure.append(i)
            self.shift[i] = found.seconds if found else near
        self.at = base.t

    def sampled(self, clocks: Array) -> Views:
        """What all cameras saw at the moments `at`, the clocks of the late ones changed by so many s more."""
        parts = [self._of(i, float(clocks[i])) for i in range(len(self.follows))]
        return Views(*(np.stack(part) for part in zip(*parts, strict=True)))

    def stretch(self) -> Ints:
        """(n,) the same while every camera keeps its balls in their places."""
        each = []
        for own, shift in zip(self.follows, self.shift, strict=True):
            nearest = np.clip(np.searchsorted(own.t + shift, self.at - 1e-6), 0, len(own.t) - 1)
            each.append(own.stretch[nearest])
        return jointly(each)

    def _of(self, i: int, clock: float) -> tuple[Array, Array, Array]:
        own = self.follows[i]
        t, b = own.t + self.shift[i] + clock, own.b.transpose(1, 0, 2)
        seen = resample(t, b, self.at)
        nearest = np.clip(np.searchsorted(t, self.at), 0, len(t) - 1)
        sd = own.sd[nearest] * seen.gain.T[..., None]
        values = seen.values.transpose(1, 0, 2)
        velocity = np.zeros(values.shape)
        if i in self.late:
            h = AGAIN * float(np.median(np.diff(t)))
            later, sooner = (resample(t + step, b, self.at).values for step in (h, -h))
            velocity = np.nan_to_num((later - sooner).transpose(1, 0, 2) / (2 * h))
        return values, np.where(np.isfinite(sd), sd, 1.0), velocity


class Arranged:
    """Puts balls in the place of their ends, as a rig was found to have them.

    before, after  (m, n, q, 2) the same balls as tracked, and in the places of their ends
    """

    def __init__(self, orders: list[tuple[int, ...]], before: Array, after: Array) -> None:
        self.index = []
        for one, other in zip(before, after, strict=True):
            cost = np.stack([np.nansum(np.abs(one[:, list(way)] - other), (-1, -2)) for way in orders])
            self.index.append(np.array(orders)[cost.argmin(0)])

    def __call__(self, views: Views) -> Views:
        return Views(*(np.stack([self._of(i, own) for i, own in enumerate(part)]) for part in views))

    def _of(self, i: int, values: Array) -> Array:
        return np.take_along_axis(values, self.index[i][..., None], 1)
