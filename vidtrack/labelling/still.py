"""One still picture from a clip of a scene that does not move, and how noisy it is.

Averaging n frames divides the noise by sqrt(n). A shadow or a person that passes would leave a trace in a plain
mean: a pixel's values that stand off its median are left out. Interlaced clips are averaged whole: both fields
show the same scene.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Picture

KEPT = 64
"""Frames kept at most: the noise is then an eighth, and far below what the survey allows."""
MEDIAN_OF = 15
"""Frames that the median is taken over."""
LEAST_NOISE = 0.6
"""Stored levels: below it whole levels hide the noise."""
OUTLYING = 4.0
"""Noise sigmas from the median beyond which a pixel's value is not used."""
_BLOCK = 1 << 19


class FrameLike(Protocol):
    """What a frame must have: its luma plane and whether the decoder met damage."""

    @property
    def luma(self) -> Picture: ...
    @property
    def corrupt(self) -> bool: ...


class Sample(NamedTuple):
    """Frames spread evenly over a clip.

    lumas     (n, rows, columns) stored values
    seen      how many frames the clip has; damaged: how many of them were damaged, and left out
    """

    lumas: Picture
    seen: int
    damaged: int


class Still(NamedTuple):
    """The mean picture.

    mean      (rows, columns) float32, stored values
    sd        (rows, columns) float32, standard deviation of one frame's pixel; NaN for a single frame
    frames    how many were averaged
    left_out  share of the pixel values that stood off and were not used
    """

    mean: NDArray[np.float32]
    sd: NDArray[np.float32]
    frames: int
    left_out: float


def sample(frames: Iterable[FrameLike], *, memory: int = 150_000_000) -> Sample:
    """At most 64 frames, spread evenly over a clip of unknown length, in `memory` bytes.

    Every frame is kept until there are too many; then every other one is dropped and from there on half as many
    taken. Damaged frames are passed over. Raises ValueError for frames of different sizes or when none is left.
    """
    kept: list[Picture] = []
    stride, seen, damaged, most = 1, 0, 0, KEPT
    for frame in frames:
        if frame.corrupt:
            damaged += 1
        elif seen % stride == 0:
            luma = np.array(frame.luma)
            if kept and (luma.shape != kept[0].shape or luma.dtype != kept[0].dtype):
                raise ValueError(f"frame {seen} is {luma.shape[::-1]}, the first {kept[0].shape[::-1]}")
            most = min(KEPT, max(MEDIAN_OF, memory // luma.nbytes))
            kept.append(luma)
            if len(kept) > most:
                kept = kept[::2]
                stride *= 2
        seen += 1
    if not kept:
        raise ValueError(f"no good frame among {seen}" if seen else "no frame to use")
    return Sample(np.stack(kept), seen, damaged)


def average(lumas: Picture) -> Still:
    """The mean of frames (n, rows, columns), each pixel without the values that stand off its median.

    Fewer than three frames cannot outvote a shadow: they are simply averaged. From three on, a pixel uses its values
    within 4 sigma of the median of up to 15 frames; sigma is that pixel's own, by the median of absolute deviations,
    and at least the picture's usual one: the edge of a ball that moves a little keeps all its values.
    A shadow that covers a pixel in less than half of the frames leaves no trace.
    """
    n, rows, columns = lumas.shape
    if n < 3:
        sd = np.full((rows, columns), np.nan, np.float32)
        if n == 2:
            sd = (np.abs(lumas[0].astype(np.float32) - lumas[1]) / np.float32(2**0.5)).astype(np.float32)
        return Still(lumas.mean(0, dtype=np.float64).astype(np.float32), sd, n, 0.0)
    step = max(1, _BLOCK // (n * columns))
    blocks = [slice(top, top + step) for top in range(0, rows, step)]
    middle, spread = (np.empty((rows, columns), np.float32) for _ in range(2))
    for part in blocks:
        middle[part], spread[part] = _median_and_spread(lumas[:, part])
    width = OUTLYING * np.maximum(spread, max(float(np.median(spread)), LEAST_NOISE))
    mean, sd, used = np.empty_like(middle), np.empty_like(middle), 0
    for part in blocks:
        values = lumas[:, part] - middle[part]
        good = np.abs(values) <= width[part]
        count = np.maximum(good.sum(0), 1)
        values = np.where(good, values, 0)
        shift = values.sum(0) / count
        mean[part] = middle[part] + shift
        sd[part] = np.sqrt(np.maximum((values**2).sum(0) - count * shift**2, 0) / np.maximum(count - 1, 1))
        used += int(good.sum())
    return Still(mean, sd, n, 1 - used / lumas.size)


def _median_and_spread(lumas: Picture) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Median of up to 15 of the frames, and the standard deviation by their median absolute deviation, per pixel."""
    n = len(lumas)
    some = lumas[np.unique(np.linspace(0, n - 1, min(n, MEDIAN_OF)).round().astype(int))]
    half = len(some) // 2
    middle = np.partition(some, half, axis=0)[half].astype(np.float32)
    off = np.abs(some - middle)
    return middle, np.float32(1.4826) * np.partition(off, half, axis=0)[half]
