"""Rolling shutter: a camera that reads its rows one after the other sees each of them at another moment.

The time of a frame is that of its first row; a centroid in row Yf of a picture of H rows was seen

    read-out (Yf + 1/2) / H

later. Positions are brought to the time of their frame along their own track, so that all targets of a camera, and all
cameras, can be compared at one moment. Rows are those of the stored picture: where the file has it turned before it is
shown, they are columns, or count from the bottom.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.timing.resample import resample

HANGS_TOGETHER = 1.9
"""Of a usual interval between samples: those farther apart are not of one stretch of a track. Rows may make a moving
target's samples farther apart than frames."""


class Readout(NamedTuple):
    """How a camera reads its picture.

    seconds   s, from its first to its last row; below 0 where it begins at the last row; 0 for a global shutter
    size      px, width and height of the picture as it is shown
    rotation  degrees anticlockwise, 0, 90, 180 or 270, by which the stored picture was turned; mirrored: left and right
              exchanged after that
    """

    seconds: float
    size: tuple[int, int]
    rotation: int = 0
    mirrored: bool = False

    def share(self, b: Array) -> Array:
        """Share (...) of the read-out after which positions (..., 2) px were seen; NaN where they are."""
        across, down = ((b[..., i] + 0.5) / self.size[i] for i in (0, 1))
        if self.mirrored:
            across = 1 - across
        # turned anticlockwise by 90 degrees, the first row stands at the left
        return np.asarray({0: down, 90: across, 180: 1 - down, 270: 1 - across}[self.rotation])

    def delay(self, b: Array) -> Array:
        """s (...) by which positions (..., 2) px were seen later than their frame's first row."""
        return self.seconds * self.share(b)


def at_frame_time(t: Array, b: Array, readout: Readout) -> Array:
    """Positions (n, T, 2) px of tracks at the times of their frames (T,) s, from those at the times of their rows.

    Beside a gap or an end, where no track runs through the frame's time, it is drawn on by a cubic, or a parabola; a
    sample with fewer than two neighbours becomes NaN.
    """
    if not readout.seconds:
        return b
    out = np.full(b.shape, np.nan)
    for k, track in enumerate(b):
        seen = np.isfinite(track[:, 0])
        if not seen.any():
            continue
        delay = readout.delay(track)
        rows = t + np.where(seen, delay, float(np.nanmean(delay)))
        if not (np.diff(rows) > 0).all():  # a track that jumps back across the picture: each sample by itself
            rows = t + float(np.nanmean(delay))
        moved = resample(rows, track, t).values
        for i in np.flatnonzero(seen & ~np.isfinite(moved[:, 0])).tolist():
            moved[i] = _drawn_on(rows, track, seen, i, float(t[i]))
        moved[~seen] = np.nan
        out[k] = moved
    return out


def table_at_frame_time(columns: Mapping[Any, Any], track: str, readout: Readout) -> dict[str, Array]:
    """The columns Xf and Yf of a table of tracks at the times of their frames, time_s.

    columns  by name, each (n,); track: the one that says which track a row belongs to
    NaN for what belongs to no track (a number below 0), and has no velocity.
    """
    b = np.stack([np.asarray(columns[name], float) for name in ("Xf", "Yf")], -1)
    if readout.seconds:
        t, out = np.asarray(columns["time_s"], float), np.full(b.shape, np.nan)
        names, whose = np.unique(np.asarray(columns[track]), return_inverse=True)
        for k, name in enumerate(names.tolist()):
            if isinstance(name, str) or name >= 0:
                rows = np.flatnonzero((whose == k) & np.isfinite(t))
                at, first = np.unique(t[rows], return_index=True)
                rows = rows[first]
                out[rows] = at_frame_time(at, b[rows][None], readout)[0]
        b = out
    return {"Xf": b[:, 0], "Yf": b[:, 1]}


def _drawn_on(rows: Array, track: Array, seen: Bools, i: int, at: float) -> Array:
    """A track (2,) px at a moment just outside its samples, by up to four of them without a gap, the i-th among them.

    NaN for fewer than three: two samples say nothing of how the velocity changes.
    """
    apart = HANGS_TOGETHER * float(np.median(np.diff(rows)))
    first = last = i
    while last - first < 3:
        if first > 0 and seen[first - 1] and rows[first] - rows[first - 1] < apart:
            first -= 1
        elif last + 1 < len(rows) and seen[last + 1] and rows[last + 1] - rows[last] < apart:
            last += 1
        else:
            break
    nodes = rows[first : last + 1]
    if len(nodes) < 3:
        return np.full(2, np.nan)
    others = ~np.eye(len(nodes), dtype=bool)
    steps = np.where(others, nodes[:, None] - nodes, 1.0)
    weight = np.where(others, at - nodes, 1.0).prod(1) / steps.prod(1)  # Lagrange's
    return np.asarray(weight @ track[first : last + 1])
