"""By how much all lenses of a run magnify more than in their calibration, as the sizes of its targets show it.

`sizes` are those of `locate.json`, from `location.cameras.ball_sizes`. Where targets are the calibration's balls, the
same zoom of all lenses shows by nothing else: their lines of sight still meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from statistics import median
from typing import Any, NamedTuple

FLOOR = 0.0007
"""Standard deviation of a size that does not average away."""

AGREE = 0.5
"""Of their median, up to which sizes of outlines differ from it where cameras see the same: what lasts in those of one
camera is up to 3 %."""


SAME = 0.03
"""Logarithm of a ratio from which on targets are balls of another size than the calibration's."""


class SeenSize(NamedTuple):
    """How much larger a camera sees the targets than its calibration's balls: its logarithm, sd and wander."""

    name: str
    larger: float
    sd: float
    wander: float
    targets: int


class CommonZoom(NamedTuple):
    """How much larger all cameras see the targets: a logarithm, its sd; whether widths are those of outlines; whether
    the cameras see it alike, which outlines of one camera alone do not show; and by how many of its sd at most a
    camera differs from the mean.
    """

    larger: float
    sd: float
    outlines: bool
    agree: bool
    apart: float


def seen_size(name: str, own: Mapping[str, Any]) -> SeenSize:
    """What the sizes of a camera say of all targets together."""
    targets = own["targets"].values()
    n = len(targets)
    sd = sqrt(sum(t["sd"] ** 2 for t in targets) / n**2 + FLOOR**2 + own.get("lasting", 0.0) ** 2)
    return SeenSize(name, median(t["larger"] for t in targets), sd, median(t["wander"] for t in targets), n)


def common_zoom(sizes: Mapping[str, Mapping[str, Any]]) -> CommonZoom | None:
    """The mean of all cameras, weighted by their sd; None of no camera."""
    cameras: Sequence[SeenSize] = [seen_size(name, own) for name, own in sizes.items()]
    if not cameras:
        return None
    balls = median(own.get("among", own["scatter"]) for own in sizes.values())
    weight = [1 / c.sd**2 for c in cameras]
    mean = sum(w * c.larger for w, c in zip(weight, cameras, strict=True)) / sum(weight)
    sd = sqrt(1 / sum(weight) + balls**2 / max(c.targets for c in cameras) + FLOOR**2)
    middle = median(c.larger for c in cameras)
    agree = len(cameras) > 1 and all(abs(c.larger - middle) < AGREE * abs(middle) for c in cameras)
    apart = max(abs(c.larger - mean) / c.sd for c in cameras)
    return CommonZoom(mean, sd, any("lasting" in own for own in sizes.values()), agree, apart)
