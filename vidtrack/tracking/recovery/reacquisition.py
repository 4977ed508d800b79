"""Lost targets sought again: in their boxes first, then in the whole picture; and why one was not measured.

Candidates are assigned to targets one to one, by where each should be and how alike it is to what it looked like.
Outside of its box a target is accepted only where two searches running find it. What cannot be distinguished stays
missing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.assignment import one_to_one
from vidtrack.tracking.centroiding.window import WINDOW
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.candidates import (
    blobs_near,
    blobs_of,
    contrast_of,
    levels_beside,
    levels_in_boxes,
    unlikeness,
    within,
)
from vidtrack.tracking.detection.half_way_up import with_half_way_up
from vidtrack.tracking.detection.target_threshold import target_levels
from vidtrack.tracking.following.occlusion import OCCLUSION, Occlusions, distinct, groups
from vidtrack.tracking.following.own_size import OWN_SIZES, OwnSize
from vidtrack.tracking.recovery.first_sight import FirstSights, by_light
from vidtrack.tracking.recovery.separation import Scene, Separation
from vidtrack.tracking.recovery.unmeasured import covering, reasons, two_in_one
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import EDGE, LOST, MERGED, PREDICTED, RECOVERED, SATURATED, Found, Searched, X, Y


@dataclass(frozen=True)
class Search:
    """How lost targets are sought.

    boxes_at_most      more targets than this are sought in the whole picture at once rather than box by box
    light_changes_after  samples after which the threshold is estimated again
    unsteady_px        a sample, by which a lost target may turn out faster than it was
    turned_within      samples for which a lost target is sought about where it was last too: it may have bounced
    confirmed_within   samples, the longest gap between the two detections that confirm a re-acquired target
    whole              |log| of the ratio of pixel counts up to which a blob is one whole target after an occlusion,
                       neither two nor a part
    above_edges        of a target's half contrast: a level above all that two soft edges which nearly touch add up to
    several            of a target's pixels: a blob of more is several targets
    """

    boxes_at_most: int = 4
    light_changes_after: int = 10
    unsteady_px: float = 5.0
    turned_within: int = 2
    confirmed_within: float = 8.0
    whole: float = 0.35
    above_edges: float = 1.5
    several: float = 1.4


SEARCH = Search()


class Reacquisition:
    """Seeks what the tracker does not plainly see: n targets, and other tracks in the rest of the places.

    occlusions  which targets hide each other; far: whether targets are sought in the whole picture
    What another track follows may turn out to be a target, but not the other way round.
    """

    def __init__(self, scene: Scene, n: int, places: int, own_size: OwnSize, *, far: bool) -> None:
        self.scene, self.far, self._n, self.own_size = scene, far, n, own_size
        self.occlusions, self.separation = Occlusions(places), Separation(places, own_size)
        self._fitted_before, self.first = self.separation.fitted, FirstSights(places)
        self._pending = np.full((n, 3), np.nan)  # x, y, time of a first sighting far away

    def forget(self, who: Ints) -> None:
        """Whatever is in these places is another thing now."""
        self.separation.forget(who)
        self.own_size.forget(who)

    def seek(self, now: Searched, sample: Sample, who: Ints, predicted: Array) -> Searched:
        """Seek the targets `who` in a sample; predicted (n, 2) px for all targets."""
        scene, detection = self.scene, self.scene.detection
        self._fitted_before = self.separation.fitted.copy()
        self._held_before = self._fitted_before | np.isfinite(self.separation.course[:, 0])
        self.separation.fitted[who] = False
        if (met := self.occlusions.met[who]).any():
            now = self._seek_occluded(now, sample, who[met], predicted[who[met]])
            who = who[~met]
        if not who.size:
            return now
        predicted = predicted[who]
        grown = now.state.box[who] * (1 + 0.5 * np.minimum(now.state.missing[who] - 1, 4))[:, None]
        boxes = np.concatenate([predicted - grown / 2, grown], axis=1)
        levels, new = self._levels(now, who), np.isnan(now.state.appearance.pixels[who])
        if who.size > SEARCH.boxes_at_most:
            near = blobs_of(sample, detection, float(np.median(levels)))
        else:
            near = blobs_near(sample, detection, boxes, levels)
        near = with_half_way_up(near, sample, boxes[new], levels[new], detection)
        now, chosen = self._seek_near(now, sample, who, predicted, grown, near)
        if (left := np.flatnonzero(chosen < 0)).size:
            why = reasons(now, sample, who[left], predicted[left], near, scene)
            self.own_size.cover(who[left], covering(now, sample.lines, who[left], predicted[left], near))
            now = now.missed(who[left], why | PREDICTED)
            now, chosen[left] = self.separation.beside_static(now, sample, who[left], predicted[left], scene)
            left = np.flatnonzero(chosen < 0)
            recent = (now.flag[who] == LOST | PREDICTED) & (now.state.missing[who] <= SEARCH.turned_within)
            recent &= np.isfinite(self._since_lost(now, who)[1]) & np.isfinite(now.state.appearance.pixels[who])
            if 0 < (turned := left[recent[left]]).size <= SEARCH.boxes_at_most:
                now, chosen[turned] = self._seek_turned(now, sample, who[turned], levels[turned])
                left = np.flatnonzero(chosen < 0)
        if detection.level is None and 0 < left.size <= SEARCH.boxes_at_most:  # the light may have changed
            seen = np.isfinite(now.state.appearance.pixels[who[left]])
            alone = left[(now.flag[who[left]] & (MERGED | EDGE) == 0) & seen]
            if alone.size:
                pixels = now.state.appearance.pixels[who[alone]]
                near = blobs_near(
                    sample, detection, boxes[alone], levels_in_boxes(sample, boxes[alone], pixels, detection)
                )
                now, chosen[alone] = self._seek_near(now, sample, who[alone], predicted[alone], grown[alone], near)
                left = np.flatnonzero(chosen < 0)
        if (left := left[who[left] < self._n]).size and self.far:
            now = self._seek_far(now, sample, who[left], predicted[left])
        return now

    def _levels(self, now: Searched, who: Ints) -> Array:
        return target_levels(now.state.appearance.of(who), self.scene.detection, self.scene.level)

    def _seek_near(
        self, now: Searched, sample: Sample, who: Ints, predicted: Array, grown: Array, near: Blobs
    ) -> tuple[Searched, Ints]:
        """Which blobs are the targets, within their grown boxes (n, 2) px; -1: none."""
        off = np.stack([near.Xf, near.Yf], axis=-1) - predicted[:, None]
        inside = (np.abs(off) <= grown[:, None] / 2).all(axis=-1)
        off = np.hypot(off[..., 0], off[..., 1]) / np.hypot(*(grown / 2).T)[:, None]
        claimed = within(near, predicted, sample.lines, slack=0.0).sum(axis=0) > 1  # one blob where two should be
        off, unseen = np.where(inside, off, np.inf), np.isnan(now.state.appearance.pixels[who])
        cost = self.first.without_outdone(self._cost(now, sample, who, near), off, near, who, unseen) + off
        chosen = one_to_one(np.where(claimed, np.inf, cost))
        return self._found(now, sample, who, near, chosen)

    def _seek_turned(self, now: Searched, sample: Sample, who: Ints, levels: Array) -> tuple[Searched, Ints]:
        """Seek targets that may have bounced: as far from where they were last as they can have gone by now."""
        last, reach = self._since_lost(now, who)
        boxes = np.concatenate([last - reach[:, None], np.repeat(2 * reach[:, None], 2, axis=1)], axis=1)
        near = blobs_near(sample, self.scene.detection, boxes, levels)
        return self._seek_near(now, sample, who, last, boxes[:, 2:], near)

    def _since_lost(self, now: Searched, who: Ints) -> tuple[Array, Array]:
        """Where targets were last (n, 2), and how far, px, they may be from there by now; inf: not known."""
        last, speed = now.state.last_seen(who)
        known = np.isfinite(speed)
        fast = np.where(known, speed, 0.0) + SEARCH.unsteady_px
        reach = np.hypot(*now.state.box[who].T) / 2 + fast * now.state.missing[who]
        return last, np.where(known, reach, np.inf)

    def _seek_occluded(self, now: Searched, sample: Sample, who: Ints, predicted: Array) -> Searched:
        """Seek targets that hide each other, predicted (n, 2) px by their courses: all of a group, or none of it."""
        scene, appearance = self.scene, now.state.appearance
        size, astray = now.state.sizes(sample.lines, who), self.occlusions.astray(who, sample.time)
        for group in groups(predicted, size + astray[:, None], OCCLUSION.parting_px):
            some, middle = who[group], predicted[group]
            # how far from its course a target may have got: as far as it is large, and more with time
            reach = size[group].max(axis=1) / 2 + 2 + 0.5 * now.state.missing[some] + astray[group]
            half = now.state.box[some] / 2 + reach[:, None]
            low, high = (middle - half).min(axis=0), (middle + half).max(axis=0)
            box = np.concatenate([low, high - low])[None]
            level = np.array([np.median(self._levels(now, some))])
            whole = blobs_near(sample, scene.detection, box, level)
            if (separated := self._separated(now, sample, some, middle, reach, whole)) is not None:
                now = separated
                continue
            if scene.detection.level is None:  # soft edges that meet are one blob at the usual level
                level = level + (SEARCH.above_edges - 1) * (level - np.median(appearance.background[some]))
                tops = blobs_near(sample, scene.detection, box, level)
                if (separated := self._separated(now, sample, some, middle, reach, tops)) is not None:
                    # what is above this level is less than the targets: they keep their appearance
                    now = replace(separated, state=replace(separated.state, appearance=now.state.appearance))
                    continue
            before = self._held_before[some]  # those of the last sample may well be all that is there
            now = now.missed(some, MERGED | PREDICTED)
            for part in (before, before | True) if before.any() and not before.all() else (before | True,):
                own = some[part]
                apart = self.separation.measured(now, sample, own, middle[part], scene)
                course = self.separation.course[own].copy()
                if apart is None and np.isnan(course).any():
                    apart = self.separation.behind_dark(now, sample, own, middle[part], scene)
                if apart is not None:
                    self.occlusions.seen(own, sample.time, apart.values[[X, Y]][:, own].T)
                    now = replace(apart, state=apart.state.still_sought(own))
                elif np.isfinite(course).all():
                    self.occlusions.seen(own, sample.time, course)
                else:
                    continue
                break
            else:
                if (again := self._two_again(now, sample, some, middle, whole)) is None:
                    self._still_occluded(now, sample, some, middle, whole)
                now = again or now
        return now

    def _two_again(self, now: Searched, sample: Sample, who: Ints, predicted: Array, near: Blobs) -> Searched | None:
        """With two targets that one blob shows as two discs, although these are not where their courses go."""
        over = within(near, predicted, sample.lines, slack=0.0).any(axis=0)
        if who.size != 2 or not np.isfinite(predicted).all() or np.count_nonzero(over) != 1 or near.edge[over][0]:
            return None
        blob = np.array([column[over][0] for column in (near.Xf, near.Yf, near.width, near.height)], float)
        place = self.separation.pair_in(now, sample, who, blob * (1, 1, 1, sample.lines), self.scene)
        if place is None:
            return None
        cost = np.square(predicted[:, None] - place).sum(axis=-1)
        chosen = one_to_one(cost)
        if (chosen < 0).any() or not distinct(cost, chosen):
            return None
        if (apart := self.separation.measured(now, sample, who, place[chosen], self.scene)) is None:
            return None
        self.occlusions.seen(who, sample.time, apart.values[[X, Y]][:, who].T)
        return replace(apart, state=apart.state.still_sought(who))

    def _separated(
        self, now: Searched, sample: Sample, who: Ints, predicted: Array, reach: Array, near: Blobs
    ) -> Searched | None:
        """With every one of the targets, where there is a blob for each within `reach` (n,) px; else None."""
        cost = self._cost(now, sample, who, near)
        pixels = now.state.appearance.pixels[who, None]
        off = np.hypot(near.Xf - predicted[:, :1], near.Yf - predicted[:, 1:])
        alike = np.abs(np.log(near.pixels / pixels)) < SEARCH.whole + WINDOW.grain / pixels
        cost = np.where(np.isfinite(cost) & alike & (off < reach[:, None]), off**2, np.inf)
        chosen = one_to_one(cost)
        if (chosen < 0).any() or not distinct(cost, chosen):
            return None
        velocity = self.occlusions.velocity(who, sample.time)
        now, chosen = self._found(now, sample, who, near, chosen)
        if (chosen < 0).any():
            return None
        self.occlusions.end(who)
        return replace(now, state=now.state.going(who, velocity, 3))

    def _still_occluded(self, now: Searched, sample: Sample, who: Ints, predicted: Array, near: Blobs) -> None:
        """Targets that cannot be distinguished yet; where nothing shows that they are there, some day they are not."""
        pixels = now.state.appearance.pixels[who]
        over = within(near, predicted, sample.lines, slack=0.0)
        large = near.pixels > SEARCH.several * pixels.max()
        self.own_size.cover(who, covering(now, sample.lines, who, predicted, near))
        if not (over & large).any():
            longest = self.scene.detection.max_occlusion if who.size > 1 else int(SEARCH.confirmed_within)
            self.occlusions.wait(who, longest)
            return
        self.occlusions.waited[who] = 0
        one = np.flatnonzero((over & large & ~near.edge).all(axis=0))
        if who.size > 1 and one.size == 1:  # the blob of all of them: its middle is theirs
            weight = pixels / pixels.sum()
            self.occlusions.shift(who, np.array([near.Xf[one[0]], near.Yf[one[0]]]) - weight @ predicted)

    def _cost(self, now: Searched, sample: Sample, who: Ints, blobs: Blobs) -> Array:
        """Unlikeness of blobs to targets, inf for what cannot be: cut by the edge, taken by another, touching static
        clutter.
        """
        scene, appearance = self.scene, now.state.appearance.of(who)
        cost = unlikeness(blobs, appearance.pixels, appearance.contrast)
        unseen = ~np.isfinite(appearance.pixels)
        cost[unseen] = by_light(blobs.mass)
        bad = blobs.edge | (blobs.pixels < scene.detection.min_pixels) | ~np.isfinite(blobs.Xf)
        taken = now.measured(self._n if who[0] < self._n else len(now.flag))
        for x, y in (taken, scene.clutter):
            if x.size:
                bad = bad | (np.hypot(blobs.Xf[:, None] - x, blobs.Yf[:, None] - y) < 2).any(axis=1)
        if scene.static is not None and blobs.Xf.size:
            x, y = blobs.left + (blobs.width - 1) / 2, blobs.top + (blobs.height - 1) / 2 * sample.lines
            bad = bad | scene.static.touched([sample], x[None], y[None], blobs.width, blobs.height)[0]
        cost[:, bad] = np.inf
        self.own_size.outdate(who[now.state.missing[who] > OWN_SIZES.remembered], sample.lines)
        odd = self.own_size.odd(blobs.pixels[:, None].astype(float), contrast_of(blobs)[:, None], who).T
        return np.where(odd, np.inf, cost)

    def _found(self, now: Searched, sample: Sample, who: Ints, blobs: Blobs, chosen: Ints) -> tuple[Searched, Ints]:
        """With the blobs that were assigned to targets (-1: none), and which of them are: what is several is none."""
        got, b = who[chosen >= 0], chosen[chosen >= 0]
        if not got.size:
            return now, chosen
        first = ~np.isfinite(now.state.appearance.pixels[got])
        again = (now.state.missing[got] > 1) & ~first & ~self._fitted_before[got]
        contrast = contrast_of(blobs)[b]
        background, top = levels_beside(sample, blobs, b, self.scene.detection)
        columns = (blobs.Xf, blobs.Yf, blobs.sd_x, blobs.sd_y, blobs.pixels, blobs.mass)
        shape = (blobs.xx[b], blobs.yy[b], blobs.xy[b])
        values = np.stack([*(column[b] for column in columns), contrast, background, *shape])
        flag = again * RECOVERED + blobs.saturated[b] * SATURATED
        size = np.stack([blobs.width[b], blobs.height[b]]).astype(float)
        found = Found(got, values, size, top - background, flag)
        several = self.own_size.several(found, now.state.missing[got])
        several |= two_in_one(now, sample, found, self.separation, self.scene) & ~first
        if several.any():
            chosen = chosen.copy()
            chosen[np.flatnonzero(chosen >= 0)[several]] = -1
            one = ~several
            found = Found(got[one], values[:, one], size[:, one], (top - background)[one], flag[one])
        self._pending[found.who[found.who < self._n]] = np.nan
        self.first.seen(np.setdiff1d(got[first], got[several]), sample.time)
        return (now.found(found) if found.who.size else now), chosen

    def _within_reach(self, now: Searched, who: Ints, predicted: Array, blobs: Blobs) -> Bools:
        """Which blobs (n, m) targets may have come to since they were lost; anywhere after
        SEARCH.light_changes_after samples, and while it is not known yet how fast they are.
        """
        last, reach = self._since_lost(now, who)
        reach = np.where(now.state.missing[who] > SEARCH.light_changes_after, np.inf, reach)
        off = [np.hypot(blobs.Xf - at[:, :1], blobs.Yf - at[:, 1:]) for at in (predicted, last)]
        return np.asarray(np.fmin(*off) < reach[:, None])

    def _seek_far(self, now: Searched, sample: Sample, who: Ints, predicted: Array) -> Searched:
        """Seek targets in the whole picture."""
        state, detection = now.state, self.scene.detection
        sought = (state.missing[who] > 1) & np.isfinite(state.appearance.pixels[who])
        sought &= (now.flag[who] & MERGED == 0) & self.first.confirmed(who, state.missing[who], sample.time)
        who, predicted = who[sought], predicted[sought]
        if not who.size:
            return now
        level = detection.level
        if level is None and (state.missing[who] <= SEARCH.light_changes_after).any():
            level = float(np.median(self._levels(now, who)))
        blobs = blobs_of(sample, detection, level, known=now.measured(self._n))
        reachable = self._within_reach(now, who, predicted, blobs)
        cost = np.where(reachable, self._cost(now, sample, who, blobs), np.inf)
        before = self._pending[who].copy()
        waited = sample.time - before[:, 2]
        reach = (np.hypot(*state.box[who].T) * np.clip(waited, 1, SEARCH.confirmed_within))[:, None]
        off = np.hypot(blobs.Xf - before[:, :1], blobs.Yf - before[:, 1:2])
        sure = np.isfinite(waited)[:, None] & (off < reach)
        now, chosen = self._found(now, sample, who, blobs, one_to_one(np.where(sure, cost + off / reach, np.inf)))
        now = _going_on(now, who[chosen >= 0], before[chosen >= 0], sample.time)
        rest = np.flatnonzero(chosen < 0)
        cost[:, chosen[chosen >= 0]] = np.inf
        maybe = one_to_one(cost[rest])
        b = maybe[maybe >= 0]
        self._pending[who[rest]] = np.nan
        self._pending[who[rest[maybe >= 0]]] = np.stack(
            [blobs.Xf[b], blobs.Yf[b], np.full(b.size, sample.time)], axis=1
        )
        return now


def _going_on(now: Searched, who: Ints, before: Array, time: float) -> Searched:
    """With targets that go on from two detections, the earlier (n, 3): x, y, time."""
    velocity = (now.state.positions[-1, who] - before[:, :2]) / np.maximum(time - before[:, 2:], 1e-6)
    return replace(now, state=now.state.going(who, velocity, 2))
