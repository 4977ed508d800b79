"""Where the patches of a recording's background lie, from its beginning to its end.

Few pictures are compared where nothing moves, and more of the pictures that were kept where something does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Picture
from vidtrack.steadiness.patches import CHOICE, chosen_patches
from vidtrack.steadiness.registration import Reference, Shifts
from vidtrack.steadiness.samples import BackgroundSamples, in_averaged, in_recording


@dataclass(frozen=True)
class Density:
    """How many pictures are compared.

    coarse   of them all, evenly spread
    moved_px and share: patches that move by so much between two of them ask for those between
    reach    frames within which a target counts as in a picture
    room     px about a target in which no patch is used
    """

    coarse: int = 14
    moved_px: float = 0.1
    share: float = 0.4
    reach: int = 4
    room: float = 3.0


DENSITY = Density()


class Targets(NamedTuple):
    """What a recording's tracker measured: frame (m,), px of the recording: middle (m, 2), radius (m,)."""

    frame: NDArray[np.int64]
    at: Array
    radius: Array


class Course(NamedTuple):
    """The background of one recording.

    middles  (n, 2) px of the recording, where the patches lie at its beginning
    frames   (k,) numbers of the frames that were compared
    shift    (k, n, 2) px, by which each patch has moved since; NaN where it was not found or a target covers it
    sd       (k, n, 2) px
    """

    middles: Array
    frames: NDArray[np.int64]
    shift: Array
    sd: Array

    def columns(self, times: Array, first: int, last: int) -> dict[str, NDArray[Any]]:
        """A row a patch and frame compared from `first` to `last`: where the patch lay at first, how far it moved, px.

        times  (m,) s of all frames of the recording
        """
        within = (self.frames >= first) & (self.frames <= last)
        frames, n = self.frames[within], len(self.middles)
        each = {
            "frame": np.repeat(frames, n),
            "time_s": np.repeat(times[frames], n),
            "patch": np.tile(np.arange(n), len(frames)),
        }
        each |= dict(zip(("Xf", "Yf"), np.tile(self.middles, (len(frames), 1)).T, strict=True))
        each |= dict(zip(("dx", "dy"), self.shift[within].reshape(-1, 2).T, strict=True))
        return each | dict(zip(("sd_x", "sd_y"), self.sd[within].reshape(-1, 2).T, strict=True))


def background_course(
    samples: BackgroundSamples, targets: Targets, *, scale: float, density: Density = DENSITY
) -> Course:
    """The course of a recording's background; without patches where it has no texture.

    scale   grey levels (0 to 255) of one of the recording's levels
    """
    picture, frames, block = samples.reference, samples.frames, samples.block
    empty = Course(np.empty((0, 2)), np.empty(0, np.int64), np.empty((0, 0, 2)), np.empty((0, 0, 2)))
    if picture is None or not len(frames):
        return empty
    at, radius = in_averaged(targets.at, block), targets.radius / block + density.room
    early = targets.frame <= frames[0] + density.reach
    shut = covered((picture.shape[1], picture.shape[0]), at[early], radius[early])
    middles = chosen_patches(picture, scale=scale, shut=shut)
    if not len(middles):
        return empty
    done = _compared(Reference(picture, middles), samples.pictures, density)
    order = sorted(done)
    shift, sd = (np.stack([getattr(done[k], name) for k in order]) for name in ("shift", "sd"))
    for k, frame in enumerate(frames[order]):
        here = np.abs(targets.frame - frame) <= density.reach
        lies = middles + np.where(np.isfinite(shift[k]), shift[k], 0.0)
        shift[k][_touched(np.asarray(lies, float), at[here], radius[here] + CHOICE.half)] = np.nan
    return Course(in_recording(middles.astype(float), block), frames[order], shift * block, sd * block)


def covered(size: tuple[int, int], at: Array, radius: Array) -> Bools:
    """Which px (h, w) of a picture (width, height) lie within the squares about some places."""
    mask = np.zeros(size[::-1], bool)
    low, high = np.floor(at - radius[:, None]), np.ceil(at + radius[:, None]) + 1
    low, high = (np.clip(np.nan_to_num(edge, nan=-1), 0, np.array(size)).astype(int) for edge in (low, high))
    for (x0, y0), (x1, y1) in zip(low.tolist(), high.tolist(), strict=True):
        mask[y0:y1, x0:x1] = True
    return mask


def _touched(middles: Array, at: Array, reach: Array) -> Bools:
    """Which patches (n,) come nearer to any of some places than reach (m,), px in either direction."""
    if not len(at):
        return np.zeros(len(middles), bool)
    near = np.abs(middles[:, None] - at).max(-1) < reach
    return np.asarray(near.any(1))


def _compared(reference: Reference, pictures: list[Picture], density: Density) -> dict[int, Shifts]:
    """The shifts in some of the pictures, by their number."""
    last = len(pictures) - 1
    waiting = np.unique(np.linspace(0, last, min(density.coarse, last + 1)).round().astype(int)).tolist()
    done: dict[int, Shifts] = {}
    latest = None
    for k in waiting:
        done[k] = reference.shifts(pictures[k], latest)
        latest = done[k].shift
    gaps = list(pairwise(waiting))
    while gaps:
        a, b = gaps.pop()
        between = (a + b) // 2
        if between == a or not _differ(done[a], done[b], density):
            continue
        done[between] = reference.shifts(pictures[between], done[a].shift)
        gaps += [(a, between), (between, b)]
    return done


def _differ(a: Shifts, b: Shifts, density: Density) -> bool:
    """Whether the background moved between two pictures, or is seen in one of them only."""
    both = a.found & b.found
    if both.sum() < density.share * max(a.found.sum(), b.found.sum()):
        return True
    moved = np.abs(a.shift[both] - b.shift[both]).max(1) > density.moved_px
    return bool(both.any() and moved.mean() > density.share)
