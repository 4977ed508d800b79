"""Targets followed from sample to sample by moving box masks.

Most samples are read several at a time: where each target should be in the next few is predicted, all windows are
measured at once (`measure_targets`), and the samples are accepted up to the first in which some target is not clear.
That one is measured again from the latest positions; what is still not clear gets a wider search (`Reacquisition`).
What is not found stays missing: a prediction moves the box, and never becomes a position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.backdrop.still_wall import Wall
from vidtrack.tracking.centroiding.dispatch import measure_targets, with_shapes
from vidtrack.tracking.centroiding.surface import Surfaces
from vidtrack.tracking.centroiding.window import Seen
from vidtrack.tracking.crops import Crop, keep_piece
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.from_below import from_below
from vidtrack.tracking.detection.pixel_counter import PixelCounter
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.detection.target_threshold import target_levels
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.following.occlusion import cleared, touched
from vidtrack.tracking.following.own_size import OwnSize
from vidtrack.tracking.following.prediction import predict
from vidtrack.tracking.following.record import Others, Record, blank_rows
from vidtrack.tracking.outlines.ball_widths import BallWidths
from vidtrack.tracking.outlines.rims import Rims
from vidtrack.tracking.pace import PACE, Pacer, sought_now
from vidtrack.tracking.quality.besides_targets import SpreadPictures
from vidtrack.tracking.recovery.declumping import Clumps, looks_of
from vidtrack.tracking.recovery.newcomers import INITIATION, Newcomers
from vidtrack.tracking.recovery.reacquisition import Reacquisition
from vidtrack.tracking.recovery.separation import Scene
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import (
    CORRUPT,
    LOST,
    MEASURED,
    NEVER,
    POSITION,
    PREDICTED,
    RECOVERED,
    REPEATED,
    SATURATED,
    SHIFT_X,
    Rows,
    Searched,
    Starts,
    TargetState,
    X,
    Y,
)
from vidtrack.tracking.windows import Windows


class Tracker:
    """Follows n targets through the samples given to `follow`, in order; `rows` is what it measured.

    level    grey level (of pictures turned bright) above which total_pixels counts
    clutter  blobs that stand still and are no target (a metre stick, a lamp): they never become one
    static   all static clutter: no target is measured while it touches that
    far      whether lost targets are sought in the whole picture
    whole    where else than at the targets to look; None: nothing but the targets is followed
    wall     what is behind the targets, where it has a pattern
    """

    def __init__(
        self,
        starts: Starts,
        detection: Detection,
        level: float,
        *,
        clutter: Blobs | None = None,
        static: StaticClutter | None = None,
        far: bool = True,
        whole: WholePicture | None = None,
        wall: Wall | None = None,
    ) -> None:
        n = len(starts.first)
        spare = 0 if whole is None else INITIATION.spare + int(INITIATION.share * n)
        self.starts = starts.with_spare(spare)
        self.state = TargetState.before(self.starts)
        places = np.zeros((2, 0)) if clutter is None else np.stack([clutter.Xf, clutter.Yf])
        self.scene = Scene(detection, level, places, static)
        self.own_size, self.clumps, self.crops = OwnSize(n + spare), Clumps(n + spare), list[Crop]()
        self.search = Reacquisition(self.scene, n, n + spare, self.own_size, far=far)
        self.newcomers = None if whole is None else Newcomers(n, spare, whole, detection)
        self.record, self.windows, self.widths = Record(n), Windows(n + spare), BallWidths(n, detection)
        self.looks, self.spread = (Surfaces(n), Rims(n, detection)), SpreadPictures(detection)
        self._pacer, self._lines, self._wall = Pacer(), 1, wall
        self._waiting: list[Sample] = []
        self._totals: list[int] = []  # pixels of those samples on the targets' side of the threshold
        self._counter = PixelCounter(detection, level)

    def follow(self, samples: Sequence[Sample]) -> None:
        """Go on through these samples; the last few may wait for more to come, or for `finish`."""
        if not len(self.record) and not self._waiting and samples:
            self.state = replace(self.state, times=self.state.times + samples[0].time)
        self._waiting += samples
        self._totals += [self._counter.count(sample.luma) for sample in samples]
        while len(self._waiting) >= PACE.samples_at_once:
            del self._waiting[: self._step(self._waiting[: PACE.samples_at_once])]

    def finish(self) -> None:
        """Go through the samples that still wait."""
        while self._waiting:
            del self._waiting[: self._step(self._waiting[: PACE.samples_at_once])]
        if self.newcomers is not None:
            self.clumps.unmeasured(self.record, self.newcomers.track, every=1)

    def rows(self) -> Rows:
        """Everything measured of the targets so far."""
        return self.record.rows()

    def others(self) -> Others:
        """What else was followed."""
        return self.record.others()

    def begin(self, target: int, positions: Array, times: Array, appearance: Sequence[float]) -> None:
        """Begin a target that had not been seen before, as `TargetState.begun`."""
        self.state = self.state.begun(target, positions, times, appearance)
        self._yield(positions[-1:].T, self._lines)

    def levels(self, who: Ints) -> Array:
        """Thresholds, grey levels of pictures turned bright: half-way up each target, or the user's."""
        return target_levels(self.state.appearance.of(who), self.scene.detection, self.scene.level)

    def _step(self, samples: Sequence[Sample]) -> int:
        """Take in one or more of the samples; returns how many."""
        self._lines = samples[0].lines
        self._start(samples[0].time)
        met, first = self.search.occlusions.met, self.starts.first
        k = min(self._pacer.samples(self.state.missing, met, first - self.record.samples), len(samples))
        if not (k := next((j for j, sample in enumerate(samples[:k]) if sample.corrupt or sample.repeated), k)):
            self._pass_over(samples[0])
            return 1
        times = np.array([sample.time for sample in samples[:k]])
        predicted = self._predicted(times)
        raw = samples
        if self._wall is not None:
            samples = self._wall.evened(samples[:k], self.record.samples, predicted, self.state.appearance)
        clear_in_last = np.flatnonzero(self.state.missing == 0)
        clear, taken = np.zeros((k, 0), bool), k
        block = blank_rows(predicted, self.state)
        if clear_in_last.size:
            seen, clear = self._measured(samples[:k], predicted, clear_in_last)
            whole = clear.all(axis=1)
            taken = k if whole.all() else max(1, int(np.argmin(whole)))
            block = self._accept(block, clear_in_last, seen, clear, taken)
            self.looks[0].seen(self.record.samples, clear_in_last, seen.values[SHIFT_X:, 0], clear[0])
            self.looks[1].passed(samples[:taken], self.record.samples, block.values)
            self.windows.odd(self.scene, samples[:taken], self.record.samples, block.values, self.state)
            appearance = self.state.appearance.of(clear_in_last)
            self._pacer.windows(appearance, templates=self.scene.detection.centroid == "weighted")
        fresh = block.values[POSITION, :taken].transpose(1, 2, 0)
        lost_now = clear_in_last[~clear[taken - 1]]
        self.state = self.state.remembering(times[:taken], fresh, self.starts.position).missed(lost_now, taken)
        expected = predicted[taken - 1]
        if lost_now.size and (self.state.missing >= 0).sum() > 1:
            expected = self._with_occlusions(lost_now, expected, samples[taken - 1])
        self.windows.passed(samples[:taken], self.record.samples)
        if (due := sought_now(self.state.missing, self.search.occlusions.met)).size:
            self._seek(block, samples[taken - 1], due, expected, taken - 1)
        self._pacer.went(taken, well=taken == k and not lost_now.size)
        block.total_pixels[:taken] = self._totals[:taken]
        del self._totals[:taken]
        self.spread.passed(samples[:taken], self.record.samples)
        self.widths.passed(samples[:taken], self.record.samples, block.values)
        self._keep(Rows._make([block.values[:, :taken], *(column[:taken] for column in block[1:])]), times[:taken])
        if self.newcomers is not None:
            self._declump(block, samples[taken - 1], taken - 1)
            self._initiate(raw[taken - 1], taken)
        return taken

    def _keep(self, block: Rows, times: Array) -> None:
        """Record a block of samples."""
        track = self.newcomers.track if self.newcomers is not None else np.arange(len(self.state.missing))
        self.record.append(block, times, track)

    def _initiate(self, sample: Sample, taken: int) -> None:
        """End tracks that are lost, and begin others where the whole picture shows them, every so many samples."""
        assert self.newcomers is not None
        self.state = self.newcomers.ended(self.state, self.search.occlusions.met)
        done = self.record.samples
        if done // INITIATION.every == (done - taken) // INITIATION.every:
            return
        before = self.newcomers.track.copy()
        self.state = self.newcomers.begun(self.state, sample, self.search.occlusions, self.starts)
        new = np.flatnonzero(self.newcomers.track != before)
        self.search.forget(new)
        self.clumps.forget(new)
        self.windows.begun(self.scene, new, self.state)
        if self.newcomers.whole.static is not self.scene.static:
            self.scene = self.search.scene = replace(self.scene, static=self.newcomers.whole.static)

    def _declump(self, block: Rows, sample: Sample, j: int) -> None:
        """Follow as two what turns out to be two, in a sample that is row j of the block and in the record."""
        assert self.newcomers is not None
        n, number = self.record.n, self.record.samples - 1
        self.clumps.forget(np.flatnonzero((self.clumps.partner >= 0) & (self.state.missing < 0)))
        self.clumps.unmeasured(self.record, self.newcomers.track)
        for i in self.clumps.due(block.values[:, j], self.state, number, sample.lines).tolist():
            now = Searched(self.state, block.values[:, j], block.flag[j])
            seen, one = self.search.separation.several(now, sample, i, self.scene)
            if not self.clumps.looked(i, number, seen, one=one) or seen is None:
                continue
            alone = self.clumps.taken_back(i, self.record, int(self.newcomers.track[i]), seen)
            unseen = np.flatnonzero((self.state.missing[:n] < 0) & (self.starts.first[:n] == NEVER))
            free = unseen if i < n and unseen.size else n + np.flatnonzero(self.state.missing[n:] < 0)
            # what was seen alone stays what it was: a spark may touch it
            if isinstance(seen, float) or alone or not free.size:
                continue
            if (other := int(free[0])) >= n:
                self.newcomers.taken(other)
            both = np.array([i, other])
            looks = looks_of(seen)
            self.state = self.state.split(i, other, np.stack([seen.x, seen.y], axis=1), np.stack(looks).T)
            self.search.forget(both)
            self.search.separation.known(both, seen.shape, looks.pixels)
            self.search.occlusions.end(both)
            self.search.occlusions.begin(both, self.state.times, self.state.positions)
            self.clumps.joined(i, other)
            self.windows.begun(self.scene, both, self.state)

    def _yield(self, at: Array, lines: int) -> Ints:
        """End other tracks of what targets turned out to be, at (2, m) px; returns their places."""
        if self.newcomers is None or not at.size:
            return np.zeros(0, np.intp)
        self.state, twice = self.newcomers.yielding(self.state, at, lines, self.clumps.partner)
        self.search.occlusions.end(twice)
        return twice

    def _start(self, time: float) -> None:
        """Begin the targets whose first sample this is."""
        if (who := np.flatnonzero((self.state.missing < 0) & (self.starts.first <= self.record.samples))).size:
            self.state = self.state.started(who, self.starts, time)
            self._yield(self.starts.position[who].T, self._lines)

    def _predicted(self, times: Array) -> Array:
        active = self.state.missing >= 0
        where = np.full((len(times), active.size, 2), np.nan)
        where[:, active] = predict(self.state.times, self.state.positions[:, active], times)
        where = np.where(np.isfinite(where), where, self.starts.position)
        if (who := np.flatnonzero(self.search.occlusions.met)).size:
            where[:, who] = self.search.occlusions.at(who, times)
        return where

    def _measured(self, samples: Sequence[Sample], predicted: Array, who: Ints) -> tuple[Seen, Bools]:
        """What targets show where they are predicted (k, n, 2), and where they are clear (k, m): whole and alone."""
        where, detection = predicted[:, who], self.scene.detection
        known = self.state.appearance.of(who), self.levels(who)
        appearance, levels = from_below(samples[0], where[0], *known, detection)
        seen = measure_targets(
            samples,
            where,
            appearance=appearance,
            threshold=levels,
            detection=detection,
            careful=len(self.record) % PACE.careful_every == 0,
        )
        shaped, clear, at = seen.values, seen.clear, seen.values[[X, Y]]
        if (changed := self.own_size.changed(shaped, who)).size:
            shaped = with_shapes(seen, changed, samples, where, appearance, levels, detection)
            clear = clear & ~self.own_size.unlike(shaped, who)
        if self.scene.clutter.size:
            near = np.abs(at[..., None] - self.scene.clutter[:, None, None]) < 1.5
            clear = clear & ~near.all(axis=0).any(axis=-1)
        if self.scene.static is not None:
            clear = clear & ~self.scene.static.touched(samples, *at, *appearance.size)
        met = np.flatnonzero(self.search.occlusions.met)
        if who.size + met.size > 1:
            every = np.concatenate([who, met])
            clear = np.concatenate([clear, np.zeros((len(clear), met.size), bool)], axis=1)
            where = predicted[:, every]
            where[:, : who.size] = np.where(clear[:, : who.size, None], at.transpose(1, 2, 0), where[:, : who.size])
            clear = cleared(clear, where, self.state.sizes(samples[0].lines, every))[:, : who.size]
        self.own_size.follow(shaped, clear, who)
        return seen._replace(values=self.own_size.doubted(seen.values, who, shaped)), clear

    def _with_occlusions(self, lost_now: Ints, predicted: Array, sample: Sample) -> Array:
        """Predictions (n, 2), those of targets lost just now that met another lost one by their courses."""
        missing, occlusions = self.state.missing, self.search.occlusions
        lost = np.flatnonzero((missing > 0) & ((missing <= PACE.sought_each) | occlusions.met))
        together = lost[touched(predicted[lost], self.state.sizes(sample.lines, lost))]
        if not np.isin(lost_now, together).any():
            return predicted
        occlusions.begin(together, *self.record.recent(), (self.state.times, self.state.positions))
        met = together[occlusions.met[together]]
        where = predicted.copy()
        where[met] = occlusions.at(met, np.array([sample.time]))[0]
        return where

    def _seek(self, block: Rows, sample: Sample, who: Ints, predicted: Array, j: int) -> None:
        """Seek targets, then other tracks, in a sample that is row j of the block, which takes what is found."""
        n = self.record.n
        size, first = self.state.sizes(sample.lines, who), (who < n) | (self.clumps.partner[who] >= 0)
        first |= self.search.occlusions.with_targets(who, n, sample.time, predicted[who], size)
        for some in (who[first], who[~first]):
            some = some[self.state.missing[some] >= 0]  # a target may just have turned out to be this track
            if not some.size:
                continue
            before = self.state.missing
            now = self.search.seek(Searched(self.state, block.values[:, j], block.flag[j]), sample, some, predicted)
            self.state = now.state
            found = some[np.isfinite(now.values[X, some])]
            block.values[:, j], block.flag[j] = now.values, now.flag
            block.corner[j, found] = now.values[[X, Y]][:, found].T - self.state.box[found] / 2
            recovered = (now.flag[some] & RECOVERED > 0) | (~np.isfinite(now.values[X, some]) & (before[some] == 1))
            for i in some[recovered & (some < n)].tolist():
                moment = self.record.samples + j, i, int(block.flag[j, i])
                keep_piece(
                    self.crops, sample, block.corner[j, i], self.state.box[i], moment, self.scene.detection.scale
                )
            block.values[:, j, self._yield(now.values[[X, Y]][:, found[found < n]], sample.lines)] = np.nan
        self.windows.sought(self.scene, sample, self.record.samples + j, who, predicted, block.values[:, j], self.state)

    def _accept(self, block: Rows, who: Ints, seen: Seen, clear: Bools, taken: int) -> Rows:
        """The block with what was clear in the first `taken` samples; the appearance follows light and distance."""
        good, every = clear[:taken], slice(None) if who.size == len(self.state.missing) else who
        about = seen.values[POSITION, :taken].transpose(1, 2, 0) - self.state.box[every] / 2
        if good.all():
            block.values[:, :taken, every] = seen.values[:MEASURED, :taken]
            block.flag[:taken, every] = seen.saturated[:taken] * SATURATED
            block.corner[:taken, every] = about
        else:
            block.values[:, :taken, every] = np.where(good, seen.values[:MEASURED, :taken], np.nan)
            block.flag[:taken, every] = np.where(good, seen.saturated[:taken] * SATURATED, LOST | PREDICTED)
            block.corner[:taken, every] = np.where(good[..., None], about, block.corner[:taken, every])
        appearance = self.state.appearance.following(seen.values[:, :taken], good, every)
        self.state = replace(self.state, appearance=appearance)
        return block

    def _pass_over(self, sample: Sample) -> None:
        """A damaged picture, or the one before once more: whatever it shows is no measurement of this moment."""
        times = np.array([sample.time])
        block = blank_rows(self._predicted(times), self.state)
        block.flag[:] = (CORRUPT if sample.corrupt else REPEATED) | PREDICTED
        self.state = self.state.remembering(times, block.values[POSITION].transpose(1, 2, 0), self.starts.position)
        block.total_pixels[0] = self._totals.pop(0)
        self._keep(block, times)
