"""The opening of a recording followed backwards: what its samples show of targets before they were plain.

A target that begins behind another one, or is found late, is known once it is plain. From there it is followed back in
time: from its own first sample on, together with the others that begin late (`followed_backwards`); and where targets
are still missing from the opening, all that is followed at its end together. Those which overlap at first are separated
by what they look like.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.centroiding.surface import Surfaces
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.following.occlusion import OCCLUSION, touched
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.following.track_cuts import CERTAINTY
from vidtrack.tracking.outlines.rims import Rims
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import MERGED, NEVER, PIXELS, POSITION, PREDICTED, RECOVERED, Rows, Starts, X, Y, present
from vidtrack.tracking.tracker import Tracker
from vidtrack.tracking.windows import Windows


@dataclass(frozen=True)
class Backwards:
    """When the opening is followed backwards.

    plain   samples in a row in which every target is measured before that
    known   samples in which a track was measured before it is followed back with the targets
    """

    plain: int = 3
    known: int = 3


BACKWARDS = Backwards()


class Back(NamedTuple):
    """What was followed backwards: numbers of tracks (m,), those of the n targets first; rows in order; and what the
    surfaces and rims of targets showed on that way."""

    track: Ints
    n: int
    rows: Rows
    looks: tuple[Surfaces, Rims]


class Earlier:
    """Holds the samples of the opening as long as a target is missing from it, `most` at most, and follows them back.

    samples   that the tracker has been given so far, from the first on
    """

    def __init__(self, tracker: Tracker, samples: Sequence[Sample], most: int) -> None:
        scene = tracker.scene
        self._before = followed_backwards(
            samples, tracker.starts, scene.detection, scene.level, scene.static, tracker.windows
        )
        self._held: list[Sample] = []
        self._most, self._waits = most, True
        self._back: Back | None = None
        self.add(tracker, samples)

    def add(self, tracker: Tracker, samples: Sequence[Sample]) -> None:
        """The tracker has been given further samples."""
        if not self._waits:
            return
        self._held += samples
        done = present(tracker.rows())
        plain = len(done) >= BACKWARDS.plain and bool(done[-BACKWARDS.plain :].all())
        if plain or len(self._held) >= self._most:
            self._follow(tracker)

    def into(self, tracker: Tracker, lines: int) -> Rows:
        """All that a tracker which is finished has measured, with what was followed backwards, whose looks it takes;
        lines: 2 for fields."""
        if self._waits:
            self._follow(tracker)
        before = tracker.rows()
        rows = before
        if self._before is not None:
            rows = with_earlier(before, self._before, tracker.starts.first, lines)
            _looks_taken(tracker, self._before, before, rows)
        if self._back is None:
            return rows
        filled = with_gaps_filled(rows, self._back, lines)
        _looks_taken(tracker, self._back, rows, filled)
        return filled

    def others(self, tracker: Tracker) -> Others:
        """The same of all else that was followed; after `into`."""
        return tracker.others() if self._back is None else with_others_filled(tracker.others(), self._back)

    def _follow(self, tracker: Tracker) -> None:
        """Follow back what is missing, and hold the samples no longer."""
        done = present(tracker.rows())
        if done.any() and not done.all():
            self._back = together_backwards(tracker, self._held[: len(done)])
        self._held, self._waits = [], False


def followed_backwards(
    samples: Sequence[Sample],
    starts: Starts,
    detection: Detection,
    level: float,
    static: StaticClutter | None,
    windows: Windows,
) -> Back | None:
    """What the samples before each target's own first one show, followed backwards in time; None: all begin at once.

    Those that touch in the sample before their first, which is why they begin with it, are followed together.
    windows   takes what is kept of them for a second search
    """
    who = np.flatnonzero((starts.first > 0) & (starts.first < NEVER))
    if not who.size:
        return None
    first = starts.first[who]
    latest = int(first.max())
    before = list(reversed(samples[:latest]))
    begin = np.array([samples[k].time - samples[k - 1].time for k in first.tolist()])[:, None]
    late = Starts._make(column[who] for column in starts)
    late = late._replace(position=late.position - late.velocity * begin, velocity=-late.velocity, first=latest - first)
    back = Tracker(late, detection, level, static=static, far=False)
    last = samples[latest].time
    back.follow([sample._replace(time=last - sample.time) for sample in before])
    back.finish()
    windows.backwards(back.windows, latest)
    return Back(who, who.size, _in_order(back.rows()), back.looks)


def together_backwards(tracker: Tracker, samples: Sequence[Sample]) -> Back | None:
    """All that a tracker measured in its last sample followed back through all of its samples; None: it was nothing."""
    state, n = tracker.state, tracker.record.n
    known = np.isfinite(state.positions[..., 0]).sum(axis=0) >= BACKWARDS.known
    now = (state.missing >= 0) & np.isfinite(state.positions[-1, :, 0])  # those fitted together are sought on
    who = np.flatnonzero(now & known & np.isfinite(state.appearance.pixels) & ~tracker.clumps.shared)
    if not who.size:
        return None
    recent = state.positions[-3:, who]
    step = (state.times[-1] - state.times[-3]) / 2
    velocity = np.where(np.isfinite(recent[0]), recent[2] - recent[0], 2 * (recent[2] - recent[1])) / (2 * step)
    looks = state.appearance
    starts = Starts(
        recent[2],
        -velocity,
        np.full((who.size, 2), np.nan),
        state.box[who],
        np.zeros(who.size, np.intp),
        looks.pixels[who],
        looks.contrast[who],
        looks.background[who],
        looks.size[:, who].T.copy(),
    )
    back = Tracker(starts, tracker.scene.detection, tracker.scene.level, static=tracker.scene.static, far=False)
    _touching_at_first(back, tracker, who, -velocity, samples[-1].lines)
    last = samples[-1].time
    back.follow([sample._replace(time=last - sample.time) for sample in reversed(samples)])
    back.finish()
    number = np.arange(n) if tracker.newcomers is None else tracker.newcomers.track
    return Back(number[who], int((who < n).sum()), _in_order(back.rows()), back.looks)


def _looks_taken(tracker: Tracker, back: Back, before: Rows, after: Rows) -> None:
    """Give a tracker what the way back saw of its targets in the samples whose rows it has filled."""
    last = len(back.rows.flag) - 1
    filled = np.isfinite(after.values[X, : last + 1]) & (after.values[X, : last + 1] != before.values[X, : last + 1])

    def moved(sample: Ints, place: Ints) -> tuple[Ints, Ints, Bools]:
        target = np.asarray(back.track[place], np.intp)
        own = place < back.n
        return last - sample, target, own & filled[last - sample, np.where(own, target, 0)]

    tracker.looks[0].followed_back(back.looks[0], moved)
    tracker.looks[1].followed_back(back.looks[1], moved)


def _touching_at_first(back: Tracker, tracker: Tracker, who: Ints, velocity: Array, lines: int) -> None:
    """Those that touch when the way back begins, at time 0, hide each other, and are of the shapes that are known.

    who  (m,) their places in the tracker; velocity (m, 2) px a sample, on the way back; lines: of samples
    """
    starts, search = back.starts, back.search
    together = np.flatnonzero(touched(starts.position[: who.size], tracker.state.sizes(lines, who)))
    shapes = tracker.search.separation.shapes(who[together])
    search.separation.known(together, shapes, starts.pixels[together])
    times = np.arange(-2.0, 1.0)
    search.occlusions.begin(together, times, starts.position[: who.size] + times[:, None, None] * velocity)


def _in_order(rows: Rows) -> Rows:
    return Rows(rows.values[:, ::-1], rows.corner[::-1], rows.flag[::-1], rows.total_pixels[::-1])


def with_earlier(rows: Rows, back: Back, first: Ints, lines: int = 1) -> Rows:
    """The rows with what was followed backwards before the first sample (n,) of each target; lines: 2 for fields.

    Where a target came to what another one shows, neither is measured; on one way back no two are one.
    """
    values, corner, flag = rows.values.copy(), rows.corner.copy(), rows.flag.copy()
    followed = np.zeros(flag.shape, bool)
    for j, i in enumerate(back.track.tolist()):
        k = slice(int(first[i]))
        followed[k, i] = True
        values[:, k, i] = back.rows.values[:, k, j]
        corner[k, i] = back.rows.corner[k, j]
        flag[k, i] = back.rows.flag[k, j] & ~RECOVERED
    for i in back.track.tolist():
        _neither(values, flag, followed, i, np.arange(first[i]), lines)
    return Rows(values, corner, flag, rows.total_pixels)


def with_gaps_filled(rows: Rows, back: Back, lines: int = 1) -> Rows:
    """The rows of targets with what was followed backwards where they were not measured; lines: 2 for fields.

    A target's own rows count before: as far back as both are of one thing, and only as long as the way back is without
    doubt. What was measured before a gap that is filled from its end alone may be another thing: RECOVERED.
    """
    values, corner, flag = rows.values.copy(), rows.corner.copy(), rows.flag.copy()
    followed = np.zeros(flag.shape, bool)
    taken = [(int(i), _sure(values[POSITION, :, i], back.rows, j)) for j, i in enumerate(back.track[: back.n])]
    for j, (i, fill) in enumerate(taken):
        values[:, fill, i], corner[fill, i] = back.rows.values[:, fill, j], back.rows.corner[fill, j]
        flag[fill, i] = _flags(np.isfinite(rows.values[X, :, i]), back.rows.flag[:, j], fill)
        followed[fill, i] = True
    for i, fill in taken:
        _neither(values, flag, followed, i, fill, lines)
    return Rows(values, corner, flag, rows.total_pixels)


def with_others_filled(others: Others, back: Back) -> Others:
    """The other tracks with what was followed backwards, as `with_gaps_filled`."""
    k = len(back.rows.flag)
    parts = [others]
    for j, track in enumerate(back.track[back.n :], start=back.n):
        own = (others.track == track) & (others.sample < k)
        at = np.full((2, k), np.nan)
        at[:, others.sample[own]] = others.values[POSITION][:, own]
        fill = _sure(at, back.rows, j)
        flag = _flags(np.isfinite(at[X]), back.rows.flag[:, j], fill)
        parts.append(Others(np.full(fill.size, track), fill, back.rows.values[:, fill, j], flag))
        lost = own & np.isin(others.sample, fill)
        parts[0] = Others(parts[0].track, np.where(lost, -1, parts[0].sample), parts[0].values, parts[0].flag)
    track, sample, values, flag = (np.concatenate(column, axis=-1) for column in zip(*parts, strict=True))
    order = np.argsort(sample, kind="stable")
    order = order[sample[order] >= 0]
    return Others(track[order], sample[order], values[:, order], flag[order])


def _flags(measured: Bools, back: NDArray[np.int64], fill: Ints) -> NDArray[np.int64]:
    """The flags of samples `fill` that were filled; measured (samples,): before that; back: those of the way back."""
    flag = back[fill] & ~RECOVERED
    for run in np.split(np.arange(fill.size), np.flatnonzero(np.diff(fill) > 1) + 1) if fill.size else []:
        first = fill[run[0]]
        flag[run[0]] |= RECOVERED * int(first > 0 and measured[:first].any() and not measured[first - 1])
    return flag


def _sure(at: Array, back: Rows, j: int) -> Ints:
    """The samples, in order, that fill the gaps of a target at (2, samples) px from column j of the way back."""
    way = back.values[POSITION, :, j]
    own, other = np.isfinite(at[0, : way.shape[1]]), np.isfinite(way[0])
    near = np.hypot(*(at[:, : way.shape[1]] - way)) < CERTAINTY.twice_px
    fill, sure, missing = [], True, 0
    for s in range(way.shape[1] - 1, -1, -1):
        if own[s] and other[s] and not near[s]:
            break
        missing = 0 if other[s] else missing + 1
        doubt = missing > CERTAINTY.gap or (other[s] and back.flag[s, j] & RECOVERED > 0)
        sure = (sure and not doubt) or bool(own[s] and other[s])
        if sure and other[s] and not own[s]:
            fill.append(s)
    return np.array(fill[::-1], np.intp)


def _neither(values: Array, flag: NDArray[np.int64], followed: Bools, i: int, samples: Ints, lines: int) -> None:
    """Where target i came back to what another one shows in some samples, measure neither, in place.

    followed  (samples, n), where targets were measured on the way back, which takes no two for one
    """
    at = values[[X, Y]][:, samples]
    apart = np.linalg.norm(at - at[..., i : i + 1], axis=0)
    diameter = 2 * np.sqrt(values[PIXELS, samples, i : i + 1] * lines / np.pi)
    same = apart < OCCLUSION.inside * diameter  # NaN is never less
    same &= ~followed[samples]
    same[:, i] = same.any(axis=1)
    row, column = np.nonzero(same)
    values[:, samples[row], column] = np.nan
    flag[samples[row], column] = MERGED | PREDICTED
