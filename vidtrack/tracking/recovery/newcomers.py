"""Track initiation at any time: what the whole picture shows besides the targets gets a track of its own.

The tracker keeps some spare places behind those of its targets. Every few samples the whole picture is searched; a
candidate that can be a target takes a spare place and is followed from then on like any target. A track that is lost
for longer than a few samples, or that turns out to be one of the targets, gives its place back. A track of few
samples counts for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.candidates import blobs_near, contrast_of, levels_beside
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.following.occlusion import Occlusions
from vidtrack.tracking.recovery.beside_clutter import beside, discs_beside
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import NEVER, Starts, TargetState


@dataclass(frozen=True)
class Initiation:
    """When a candidate becomes a track, and when a track ends.

    every         samples between two searches of the whole picture
    ends_after    samples in which a lost track is sought before it ends
    of_largest    pixels that a candidate may have, times those of the largest target; of_smallest: of the smallest
    of_dimmest    contrast that a candidate has at least, times that of the dimmest target
    edge_px       width of the soft edge that belongs to a candidate in the whole picture, and not to a target
    spare, share  places for tracks besides the targets: so many, and this share of the targets more
    """

    every: int = 8
    ends_after: int = 3
    of_largest: float = 4.0
    of_smallest: float = 0.25
    of_dimmest: float = 0.25
    edge_px: float = 2.0
    spare: int = 12
    share: float = 0.25


INITIATION = Initiation()


class Newcomers:
    """Gives spare places, from number n on, to candidates; `track` (places,) numbers who has each, -1: none.

    spare  how many places there are besides the n targets
    """

    def __init__(self, n: int, spare: int, whole: WholePicture, detection: Detection) -> None:
        self.n, self.whole = n, whole
        self.track = np.concatenate([np.arange(n), np.full(spare, -1)])
        self._next = n
        self._detection = detection

    def ended(self, state: TargetState, met: Bools) -> TargetState:
        """With the places of tracks that are lost for good given back; met (places,): they are only hidden."""
        gone = (state.missing > INITIATION.ends_after) & ~met
        gone[: self.n] = False
        return self._given_back(state, np.flatnonzero(gone))

    def yielding(self, state: TargetState, at: Array, lines: int, partner: Ints) -> tuple[TargetState, Ints]:
        """With the tracks ended that follow what targets turned out to be, found at (2, m) px; and their places.

        partner  (places,) the other half of what was one blob; -1: none. The half of a target is another thing than it,
                 and of two halves a target is the nearer one
        """
        place = state.positions[-1, self.n :]
        size = state.sizes(lines, slice(self.n, None)).max(axis=1)
        off = np.hypot(place[:, :1] - at[0], place[:, 1:] - at[1])
        near = off < np.maximum(size / 2, 2.0)[:, None]
        own = partner[self.n :]
        if (halves := np.flatnonzero(own >= self.n)).size:
            near[halves] &= off[halves] < np.where(np.isfinite(rest := off[own[halves] - self.n]), rest, np.inf)
        of_target = (own >= 0) & (own < self.n)
        twice = self.n + np.flatnonzero(near.any(axis=1) & (state.missing[self.n :] >= 0) & ~of_target)
        return self._given_back(state, twice), twice

    def taken(self, place: int) -> None:
        """A free place is taken by what another track turned out to be besides."""
        self.track[place] = self._next
        self._next += 1

    def begun(self, state: TargetState, sample: Sample, occlusions: Occlusions, starts: Starts) -> TargetState:
        """With tracks for candidates of the whole sample, as long as there are places.

        starts  what stands where a target will begin later is that target
        """
        active = state.missing >= 0
        free = np.flatnonzero(~active[self.n :]) + self.n
        if not free.size:
            return state
        place = state.positions[-1]
        if occlusions.met.any():
            who = np.flatnonzero(occlusions.met)
            place = place.copy()
            place[who] = occlusions.at(who, np.array([sample.time]))[0]
        later = ~active & (starts.first < NEVER)
        place = np.where(later[:, None], starts.position, place)
        there = np.flatnonzero((active | later) & np.isfinite(place[:, 0]) & np.isfinite(state.appearance.size[0]))
        contrast = state.appearance.contrast[: self.n]
        faintest = float(np.fmin.reduce(contrast, initial=np.nan))
        found = self.whole.candidates(sample, place[there], state.sizes(sample.lines, there), faintest)
        if not found.Xf.size:
            return state
        likely = np.flatnonzero(self._like_targets(found, state, INITIATION.edge_px))
        likely = likely[np.argsort(-found.mass[likely], kind="stable")][: free.size]
        if not likely.size:
            return state
        over = Blobs._make(column[likely] for column in found)
        blobs = self._measured(over, sample)
        good = self._like_targets(blobs, state)
        good &= ~_inside(blobs, place[there], state.sizes(sample.lines, there))
        order = np.flatnonzero(good)[np.argsort(-blobs.mass[good], kind="stable")][: free.size]
        contrast, beside = contrast_of(blobs), levels_beside(sample, blobs, order, self._detection)[0]
        for i, b, background in zip(free.tolist(), order.tolist(), beside.tolist(), strict=False):
            looks = [blobs.pixels[b], contrast[b], background, blobs.width[b], blobs.height[b]]
            at = np.array([[blobs.Xf[b], blobs.Yf[b]]])
            state = state.begun(i, at, np.array([sample.time]), looks)
            self.taken(i)
        new = free[: order.size]
        place = np.concatenate([place[there], state.positions[-1, new]])
        free, size = free[order.size :], state.sizes(sample.lines, np.concatenate([there, new]))
        return self._beside_clutter(state, sample, over, free, (place, size))

    def _beside_clutter(
        self, state: TargetState, sample: Sample, over: Blobs, free: Ints, others: tuple[Array, Array]
    ) -> TargetState:
        """With tracks for what static clutter hides in part, of blobs over the background.

        others  as `discs_beside` takes them
        """
        static = self.whole.static
        if static is None or not free.size or not (which := np.flatnonzero(beside(static, sample, over))).size:
            return state
        discs = discs_beside(sample, over, which, static, state.appearance.of(slice(self.n)), others, self._detection)
        for i, (at, looks) in zip(free.tolist(), discs, strict=False):
            state = state.begun(i, at, np.array([sample.time]), looks.tolist())
            self.taken(i)
        return state

    def _measured(self, found: Blobs, sample: Sample) -> Blobs:
        """The candidates as the sample itself shows them, half-way up each, whole."""
        beside, top = levels_beside(sample, found, np.arange(found.Xf.size), self._detection)
        room = 6.0
        low = np.stack([found.left - room, found.top - room * sample.lines], axis=1)
        size = np.stack([found.width + 2 * room, (found.height + 2 * room) * sample.lines], axis=1)
        return blobs_near(sample, self._detection, np.hstack([low, size]), (beside + top) / 2)

    def _like_targets(self, blobs: Blobs, state: TargetState, edge_px: float = 0.0) -> Bools:
        """Which blobs (m,) may be a target, by what the targets look like; as long as none is known, all.

        edge_px  width of the soft edge that may be counted in the blobs' pixels
        """
        pixels, contrast = state.appearance.pixels[: self.n], state.appearance.contrast[: self.n]
        good = (blobs.pixels >= self._detection.min_pixels) & ~blobs.edge & np.isfinite(blobs.Xf)
        if not np.isfinite(pixels).any():
            return np.asarray(good)
        good &= blobs.pixels > INITIATION.of_smallest * np.nanmin(pixels)
        good &= np.sqrt(blobs.pixels / np.pi) - edge_px < np.sqrt(INITIATION.of_largest * np.nanmax(pixels) / np.pi)
        return np.asarray(good & (contrast_of(blobs) > INITIATION.of_dimmest * np.nanmin(contrast)))

    def _given_back(self, state: TargetState, who: Ints) -> TargetState:
        if not who.size:
            return state
        self.track[who] = -1
        missing, positions = state.missing.copy(), state.positions.copy()
        missing[who], positions[:, who] = -1, np.nan
        values = state.appearance.values.copy()
        values[:, who] = np.nan
        return replace(state, missing=missing, positions=positions, appearance=replace(state.appearance, values=values))


def _inside(blobs: Blobs, middle: Array, size: Array) -> Bools:
    """Which blobs (m,) have their middle within a target that is followed (n, 2) px."""
    off = np.abs(np.stack([blobs.Xf, blobs.Yf], axis=1)[:, None] - middle)
    return np.asarray(np.all(off < size / 2 + 2, axis=-1).any(axis=1))
