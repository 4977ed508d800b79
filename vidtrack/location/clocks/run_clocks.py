"""The clocks of a run's cameras: from the motion of its targets, and from sound and light.

Motion gives the best estimate where targets move across the epipolar lines, and none where they rest; periodic motion
fits a period later as well. Sound and light then limit the search. Estimates are weighted by their covariances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Ints
from vidtrack.association.associate import NONE
from vidtrack.association.offsets import shift_worths
from vidtrack.association.tracklets import Tracklets, tracklets_of
from vidtrack.findings import Finding
from vidtrack.lengths import METRES
from vidtrack.location.cameras.views import View, brought, by_trajectory
from vidtrack.location.clocks.motion_clock import Clocks, estimate_clocks
from vidtrack.location.clocks.rough_clock import rough_offset
from vidtrack.location.matching import matched
from vidtrack.timing.agreement import Agreement, Timing, agreed
from vidtrack.timing.clock import Clock
from vidtrack.timing.resample import common_times, interval

BIAS_PX = 0.05
"""ASSUME: what the calibration leaves in an epipolar distance, held apart from a delay when clocks are sought."""

SOUND_M_S = 343.0
"""Speed of sound, m/s, in air of 20 degrees."""

KNOWN = 0.1
"""Of a sampling interval: a clock with a larger standard error is not known well enough."""

TAKES_PART, ALONE = 0.2, 0.5
"""Of a sampling interval: with a larger standard error the estimate by motion is not used beside other methods, and not
at all. It may then be mere noise, and be off by more than its standard error (targets at rest leave 0.4 and more)."""

REACH_S = 1.0
"""How far from the clocks that the cameras came with motion alone is searched."""

CLEARLY = 1.2
"""Times what a shift of no more than a sample is worth, that another one must be worth to be begun from."""

STILL_PX = 0.5
"""Px within a second below which targets rest: clocks then matter little."""

FITS = 2.0
"""Times the least epipolar error that still explains the tracks, as for an ambiguous clock."""


class RunClocks(NamedTuple):
    """What `run_clocks` returns."""

    clocks: tuple[Clock, ...]  # to be used, one a camera
    covariance: Array  # (n_cameras, 2, 2) of offset and rate, s and ppm; 0 where given, NaN where not known
    estimates: tuple[Mapping[str, Timing], ...]  # by each method that gives one, at the first sample
    used: tuple[tuple[str, ...], ...]  # those that the clock rests on
    motion: Clocks | None
    error_before_px: float  # rms distance from the epipolar curves with the clocks that the cameras came with

    def sd_at(self, camera: int, t: ArrayLike) -> Array:
        """Standard deviation, s, of a camera's right times, at times t (n,) after its first sample, s."""
        by = np.stack([np.ones_like(np.asarray(t, float)), np.asarray(t, float) * 1e-6])
        return np.asarray(np.sqrt(np.maximum(np.einsum("in,ij,jn->n", by, self.covariance[camera], by), 0.0)))

    def slips(self, b: Array, at: Array) -> Array | None:
        """By how many px (n_cameras, m, M, 2) the standard error of its clock moves what each camera sees at `at` (M,).

        b   (n_cameras, m, M, 2) px, where targets were seen; None where no clock is estimated
        """
        if not any(self.used) or at.size < 2:
            return None
        late = np.stack([self.sd_at(i, at - at[0]) for i in range(len(b))])
        velocity = np.gradient(b, at, axis=2)
        return np.asarray(np.nan_to_num(velocity * np.nan_to_num(late)[:, None, :, None]))


def run_clocks(
    views: Sequence[View],
    given: Sequence[Clock | str],
    methods: Sequence[Sequence[str]],
    heard: Mapping[str, Mapping[str, Mapping[str, Any]]],
    *,
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    units: str,
    findings: list[Finding],
) -> RunClocks:
    """The clocks of the cameras for which a method is named, against those of the others.

    given    each camera's clock, or the word of the config for its method
    methods  for each camera: motion, sound, flash; none where its clock is given
    heard    camera: method: the answer of stage clocks
    names, limit, tolerance_px   of the targets, as for `matched`; a match may lie a sample's delay further off
    findings  what a person should know is added to them
    """
    start = [own if isinstance(own, Clock) else Clock() for own in given]
    length = max((float(np.ptp(v.t)) for v in views if v.t.size), default=0.0)
    step = min((interval(v.t) for v in views if v.t.size > 1), default=np.nan)
    estimates = [_others(views, i, start, methods[i], heard, units) for i in range(len(views))]
    apart = [agreed(own, length) for own in estimates]
    films = all(v.t.size > 3 for v in views)  # stills do not move
    moving = [i for i, who in enumerate(methods) if "motion" in who and films]
    for i, who in enumerate(methods):
        if apart[i].timing.is_known and "motion" not in who:
            start[i] = apart[i].timing.clock
    motion, before = None, np.nan
    if moving:
        search = _Search(views, names, limit, tolerance_px, moving)
        _roughly(views, moving, apart, start, length, findings)
        alone = search.found(_begun(search, start, apart), [REACH_S] * len(views))
        motion, before = _settled(search, alone, apart, start, length, step), alone.error_before_px
        for i in moving:
            by_motion = Timing(motion.clocks[i], motion.covariance[i])
            if by_motion.sd.offset_s < (TAKES_PART if estimates[i] else ALONE) * step:
                estimates[i] = {"motion": by_motion, **estimates[i]}
    answers = [agreed(own, length) for own in estimates]
    for i, (who, answer) in enumerate(zip(methods, answers, strict=True)):
        if who:
            start[i] = answer.timing.clock if answer.timing.is_known else start[i]
            ambiguous = motion is not None and "motion" in answer.used and motion.ambiguous[i]
            found = _findings(views[i].name, who, estimates[i], answer, length, step, ambiguous)
            still = _moved_px(views[i]) < STILL_PX
            findings += [f._replace(level="note") if still and f.code == "clock-not-found" else f for f in found]
    covariance = [a.timing.covariance if who else np.zeros((2, 2)) for a, who in zip(answers, methods, strict=True)]
    used = tuple(a.used for a in answers)
    return RunClocks(tuple(start), np.stack(covariance), tuple(estimates), used, motion, before)


def _moved_px(view: View) -> float:
    """How far, px, the targets of a camera move within a second; the largest of ten."""
    n = max(round(1 / interval(view.t)), 1) if view.t.size > 1 else 1
    moved = np.linalg.norm(view.b[:, n:] - view.b[:, :-n], axis=-1)
    moved = moved[np.isfinite(moved)]
    return float(np.percentile(moved, 90)) if moved.size else 0.0


def _roughly(
    views: Sequence[View],
    moving: Sequence[int],
    apart: Sequence[Agreement],
    start: list[Clock],
    length: float,
    findings: list[Finding],
) -> None:
    """Clocks to begin with, into `start`: of cameras started by hand, and of those whose code shares no moment.

    Where no camera has a code, each counts from its own first picture; one that has none among others that have, or is
    set hours off, is first brought to the beginning of the reference.
    """
    coded = any((view.timecode != "").any() for view in views)
    reference = next(i for i in range(len(views)) if i not in moving)
    own = views[reference]
    for i in moving:
        other = views[i]
        if apart[i].timing.is_known or start[i] != Clock() or not (own.t.size and other.t.size):
            continue
        shifted = start[reference].corrected(own.t)
        if coded and other.t[0] <= shifted[-1] and shifted[0] <= other.t[-1]:
            continue
        begin = float(shifted[0] - other.t[0]) if coded else 0.0
        rough = rough_offset(own.camera, shifted, own.b, other.camera, other.t + begin, other.b, length)
        if begin + rough.offset_s:
            start[i] = Clock(begin + rough.offset_s)
        if rough.twins:
            twins = ", ".join(f"{begin + s:.6g}" for s in sorted(rough.twins, key=abs)[:4])
            text = (
                f"cameras.{other.name}.clock: no time code relates it to the others, and besides "
                f"{begin + rough.offset_s:.6g} s offsets of {twins} s fit the motion about as well"
            )
            findings.append(Finding("doubtful", "clock-ambiguous", text, "Give offset_s to within a period."))


class _Search(NamedTuple):
    """Clocks from the motion, about any clocks to begin with."""

    views: Sequence[View]
    names: list[str] | None
    limit: int | None
    tolerance_px: float
    free: list[int]

    def found(self, start: Sequence[Clock], reach_s: Sequence[float]) -> Clocks:
        views = self.views
        times = [clock.corrected(view.t) for view, clock in zip(views, start, strict=True)]
        at, _ = common_times(times)
        seen = [brought(view, t, at) for view, t in zip(views, times, strict=True)]
        match = matched(views, seen, self.names, self.limit, self.tolerance_px + _slip_px(views), [])
        return estimate_clocks(
            [v.camera for v in views],
            [v.t for v in views],
            [by_trajectory(v.b, v.piece, t, len(match.labels)) for v, t in zip(views, match.trajectory, strict=True)],
            free=self.free,
            clocks=start,
            max_offset_s=reach_s,
            bias_px=BIAS_PX,
        )


def _begun(search: _Search, start: Sequence[Clock], apart: Sequence[Agreement]) -> list[Clock]:
    """Clocks to begin with: those for which there is no other estimate, shifted to where the tracklets fit best.

    With many targets identities are not known a few samples off; then no refinement can find the offset.
    """
    views, out = search.views, list(start)
    step = min(interval(v.t) for v in views)
    first = min(float(v.t[0]) for v in views)
    pieces = [
        _tracklets(v, np.rint((c.corrected(v.t) - first) / step).astype(np.intp))
        for v, c in zip(views, start, strict=True)
    ]
    bias = (search.tolerance_px + _slip_px(views) / 2) / 3
    reach = int(REACH_S / step)
    shifts = np.arange(-reach, reach + 1)
    known = [i for i in range(len(views)) if i not in search.free]
    for i in search.free:
        if not apart[i].timing.is_known:
            worth = np.sum(
                [shift_worths((views[k].camera, views[i].camera), (pieces[k], pieces[i]), shifts, bias) for k in known],
                axis=0,
            )
            best = int(np.argmax(worth))
            if worth[best] > CLEARLY * worth[reach - 1 : reach + 2].max():
                out[i] = Clock(out[i].offset_s + float(shifts[best]) * step, out[i].rate_ppm)
    return out


def _tracklets(view: View, moment: Ints) -> Tracklets:
    """A camera's tracklets at moments (T,) of its samples."""
    track, sample = np.nonzero(view.piece != NONE)
    return tracklets_of(view.piece[track, sample], moment[sample], view.b[track, sample], view.sd[track, sample])


def _settled(
    search: _Search, alone: Clocks, apart: Sequence[Agreement], start: Sequence[Clock], length: float, step: float
) -> Clocks:
    """Motion searched again near what sound and light say, where it gives no estimate by itself or another one.

    The second answer is taken if it fits about as well; else they contradict each other.
    """
    doubtful = []
    for i in search.free:
        if not apart[i].timing.is_known:
            continue
        both = agreed({"motion": Timing(alone.clocks[i], alone.covariance[i]), "others": apart[i].timing}, length)
        if alone.ambiguous[i] or not alone.sd[i].offset_s < TAKES_PART * step or both.contradicting:
            doubtful.append(i)
    if not doubtful:
        return alone
    begin, reach = list(start), [REACH_S] * len(start)
    for i in search.free:
        begin[i], reach[i] = alone.clocks[i], step
    for i in doubtful:
        begin[i] = apart[i].timing.clock
        reach[i] = max(4 * apart[i].timing.moved(length / 2).sd.offset_s, step)
    near = search.found(begin, reach)
    return near if near.error_px <= FITS * alone.error_px or not np.isfinite(alone.error_px) else alone


def _others(
    views: Sequence[View],
    i: int,
    clocks: Sequence[Clock],
    methods: Sequence[str],
    heard: Mapping[str, Mapping[str, Mapping[str, Any]]],
    units: str,
) -> dict[str, Timing]:
    """The estimates by sound and light of a camera's clock at its first sample, with the reference's time corrected."""
    out: dict[str, Timing] = {}
    index = {v.name: k for k, v in enumerate(views)}
    for method, own in heard.get(views[i].name, {}).items():
        k = index.get(own.get("reference", ""))
        if method not in methods or k is None or not views[i].t.size or not views[k].t.size:
            continue
        timing = Timing(
            Clock(own["offset_s"], own["rate_ppm"]), np.array(own["covariance"], float), own["n"], own["of"]
        )
        later = float(views[i].t[0]) - own["at_s"]
        timing = timing.moved(later - 86400.0 * round(later / 86400.0))
        if method == "sound":
            timing = timing.doubted(_travel_sd(views[i], views[k], units))
        reference = clocks[k]
        since = float(views[i].t[0]) + timing.clock.offset_s - float(views[k].t[0])
        clock = Clock(
            timing.clock.offset_s + reference.offset_s + 1e-6 * reference.rate_ppm * since,
            timing.clock.rate_ppm + reference.rate_ppm,
        )
        out[method] = timing._replace(clock=clock)
    return out


def _travel_sd(a: View, b: View, units: str) -> float:
    """Standard deviation, s, of how much earlier sound may reach one of two cameras.

    ASSUME: microphones sit on the cameras, D apart, and the sound comes from any direction: D cos(angle), the
    cosine uniform, D / sqrt 3.
    """
    apart = float(np.linalg.norm(a.camera.position - b.camera.position)) * METRES[units]
    return float(apart / np.sqrt(3.0) / SOUND_M_S)


def _slip_px(views: Sequence[View]) -> float:
    """How far, px, a fast target moves from sample to sample: what one interval's delay may do."""
    steps = [np.linalg.norm(np.diff(v.b, axis=1), axis=-1).ravel() for v in views]
    moved = np.concatenate([s[np.isfinite(s)] for s in steps])
    return float(np.percentile(moved, 90)) if moved.size else 0.0


def _findings(
    name: str,
    methods: Sequence[str],
    estimates: Mapping[str, Timing],
    answer: Agreement,
    length: float,
    step: float,
    ambiguous: bool,
) -> list[Finding]:
    """A clock that is not known, or on which the methods contradict each other."""
    place = f"cameras.{name}.clock"
    out: list[Finding] = []
    for better, other in answer.contradicting:
        said = " and ".join(f"{_spoken(w, estimates[w].moved(length / 2))}" for w in (better, other))
        text = f"{place}: {said} contradict each other, at the middle of the run; the {better} is used"
        cure = f"Find out why the {other} is wrong, or choose the method yourself (clock: {other})."
        out.append(Finding("doubtful", "clocks-contradict", text, cure))
    sd = answer.timing.sd.offset_s
    cross = "Move a target across the epipolar lines"
    if not estimates:
        who = " and the ".join(methods)
        verb = "does" if len(methods) == 1 else "do"
        text = f"{place}: the {who} {verb} not estimate it, and it is left as it is: moving targets are misplaced"
        cure = f"{cross}, clap, switch a lamp on before all cameras, or give offset_s."
        out.append(Finding("bad", "clock-not-found", text, cure))
    elif not sd < KNOWN * step:
        text = f"{place}: known to {1e3 * sd:.3g} ms only (standard error; from the {' and the '.join(answer.used)})"
        out.append(Finding("doubtful", "clock-uncertain", text, f"{cross}, or give offset_s."))
    elif ambiguous:
        text = f"{place}: another offset fits about as well as {answer.timing.clock.offset_s:.4g} s (a periodic motion)"
        out.append(Finding("doubtful", "clock-ambiguous", text, "Give offset_s to within a period."))
    return out


def _spoken(method: str, timing: Timing) -> str:
    return f"the {method} ({1e3 * timing.clock.offset_s:.4g} ± {1e3 * timing.sd.offset_s:.2g} ms)"
