"""How many samples the tracker measures at once, and in which of them lost targets are sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Bools, Ints
from vidtrack.tracking.centroiding.window import WINDOW
from vidtrack.tracking.state import Appearance


@dataclass(frozen=True)
class Pace:
    """How many samples and pixels are measured at once.

    samples_at_once   at most
    pixels_at_once    about: more no longer fit the processor's caches
    template_share    share of a segmented window's memory that a template needs
    sought_each       samples in each of which a lost target is sought; later it is sought in every samples_at_once-th
    careful_every     every so many readings the unrest of the background is measured as well
    """

    samples_at_once: int = 8
    pixels_at_once: int = 140_000
    template_share: float = 0.3
    sought_each: int = 10
    careful_every: int = 4


PACE = Pace()


class Pacer:
    """As many samples at once as went well lately, but not past one in which something is to be sought or begun."""

    def __init__(self) -> None:
        self._reach = 1
        self._pixels = 1e5

    def samples(self, missing: Ints, met: Bools, later: Ints) -> int:
        """How many to measure next, 1 or more.

        missing  (n,) samples since each target was seen; below 0: it has not begun
        met      (n,) whether it is lost in an occlusion, in which every sample counts
        later    (n,) samples until each target begins
        """
        k = max(1, min(self._reach, int(PACE.pixels_at_once / max(self._pixels, 1.0))))
        lost = missing[missing > 0]
        if lost.size:
            every = PACE.samples_at_once
            due = np.where(lost < PACE.sought_each, 1, every - lost % every)
            k = 1 if met.any() else min(k, int(due.min()))
        waiting = later[missing < 0]
        return max(1, min(k, int(waiting.min()) if waiting.size else k))

    def went(self, taken: int, well: bool) -> None:
        """So many samples were taken; well: all that were measured, and no target was lost."""
        self._reach = min(PACE.samples_at_once, self._reach + 1) if well else taken

    def windows(self, appearance: Appearance, templates: bool) -> None:
        """The targets whose windows were measured; templates: whether one may serve where the edge is soft."""
        width, height = appearance.size + 2 * WINDOW.room_px
        by_template = np.isfinite(appearance.soft) & templates
        self._pixels = float((width * height * np.where(by_template, PACE.template_share, 1.0)).sum())


def sought_now(missing: Ints, met: Bools) -> Ints:
    """The lost targets that are sought in this sample; `missing` and `met` as above."""
    often = (missing <= PACE.sought_each) | (missing % PACE.samples_at_once == 0) | met
    return np.flatnonzero((missing > 0) & often)
