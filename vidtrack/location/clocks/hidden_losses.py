"""Pictures that a camera lost and that its time stamps hide: a capture card that drops some and stamps the rest evenly.

Each sample of the camera is then of the moment that its stamp says or later, by more and more pictures. Which way
through the other camera's samples, one step forward at a time or several where pictures are lost, lies nearest to the
epipolar lines is found by dynamic programming (as Viterbi's: G. D. Forney, The Viterbi algorithm, Proc. IEEE 61, 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.findings import Finding
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.location.cameras.views import View
from vidtrack.timing.clock_text import readable
from vidtrack.timing.resample import interval


@dataclass(frozen=True)
class Losses:
    """When pictures count as lost.

    samples   that are looked at, from the first on
    share     of the pictures, lost at most, and how many at most before the last sample that is looked at
    at_once   pictures between two that were kept, at most
    tracks    of a camera, those with the most samples
    clip_px   distances beyond it say no more than that the tracks differ
    price     px squared, by which a loss must lessen the sum of squared distances
    unknown   px squared, where one camera shows nothing
    times     at which pictures were lost, at least, of two cameras: one time is a pause or a jump
    apart_px  rms from the epipolar lines, at least, for losses to be sought
    near_px   from the epipolar lines, rms, with the losses; and times nearer than without them
    fewest    samples that are compared, at least
    """

    samples: int = 2000
    share: float = 0.3
    most: int = 300
    at_once: int = 4
    tracks: int = 3
    clip_px: float = 10.0
    price: float = 0.5
    unknown: float = 1.0
    times: int = 2
    apart_px: float = 0.3
    near_px: float = 1.0
    better: float = 4.0
    fewest: int = 30


LOSSES = Losses()


class Lost(NamedTuple):
    """A camera that lost pictures: how many of those that it took, s between which, px rms with them and without."""

    camera: int
    n: int  # samples
    taken: int
    first_s: float
    last_s: float
    px: float
    before_px: float


def hidden_losses(views: Sequence[View], times: Sequence[Array]) -> Lost | None:
    """The camera whose lost pictures explain why it does not fit the others; None where no camera's do.

    times   (T,) s of each camera's samples, corrected
    """
    n = len(views)
    found: list[Lost] = []
    for k in range(n):
        others = [i for i in range(n) if i != k]
        each: list[Lost] = []
        for i in others:
            one = _lost(views[k], times[k], views[i], times[i], k, 1 if n > 2 else LOSSES.times)
            if one is None:
                break
            each.append(one)
        if others and len(each) == len(others):
            found.append(max(each, key=lambda own: own.px))
    return min(found, key=lambda own: own.px) if found else None


def losses_finding(lost: Lost, views: Sequence[View]) -> Finding:
    """What the user reads of it."""
    name = views[lost.camera].name
    other = "" if len(views) > 2 else ", or the other recording has as many twice"
    when = f"between {readable(lost.first_s)} and {readable(lost.last_s)}"
    when = f"at {readable(lost.first_s)}" if lost.first_s == lost.last_s else when
    text = (
        f"{name}: some {lost.n / lost.taken:.1%} of its pictures seem to be missing, {when}, and its time stamps go on "
        f"as if they were not{other}: with that its tracks lie {lost.px:.2g} px from the others' epipolar lines, "
        f"without it {lost.before_px:.2g} px"
    )
    cure = (
        f"Take the recording as {name} wrote it: a capture card, or a program that copied it, left pictures out and "
        "stamped the rest evenly. Positions that rest on it after the first loss are wrong."
    )
    return Finding("doubtful" if len(views) > 2 else "bad", "losses-hidden", text, cure)


def _lost(own: View, t: Array, other: View, at: Array, k: int, fewest: int) -> Lost | None:
    """The losses of one camera, by its tracks and those of another one that go best together."""
    if min(t.size, at.size) < LOSSES.fewest or abs(interval(t) / interval(at) - 1) > 0.01:
        return None
    t = t[: LOSSES.samples]
    step = interval(at)
    begun = np.round((t - at[0]) / step).astype(int)
    reach = min(int(LOSSES.share * t.size), LOSSES.most)
    where = begun[:, None] + np.arange(reach + 1)
    inside = (where >= 0) & (where < at.size)
    best: Lost | None = None
    for b in _longest(own.b[:, : t.size]):
        for path in _longest(other.b):
            if not _rms(_apart(other, own, path, where[:, 0], inside[:, 0], b)) > LOSSES.apart_px:
                continue  # nothing is to be explained
            far = _apart(other, own, path, where, inside, b[:, None])
            if np.isfinite(far[:, 0]).sum() < LOSSES.fewest:
                continue
            late = cheapest(np.where(np.isfinite(far), far**2, LOSSES.unknown))
            got = _judged(far, late, t, k, fewest)
            if got and (best is None or got.px < best.px):
                best = got
    return best


def _apart(other: View, own: View, path: Array, where: Ints, inside: Bools, b: Array) -> Array:
    """px of samples b (T, ..., 2) from the epipolar lines of another path (U, 2) at its samples `where` (T, ...)."""
    shown = np.where(inside[..., None], path[np.clip(where, 0, len(path) - 1)], np.nan)
    return np.minimum(np.abs(epipolar_distance(other.camera, own.camera, shown, b)), LOSSES.clip_px)


def _judged(far: Array, late: Ints, t: Array, k: int, fewest: int) -> Lost | None:
    rows = np.arange(t.size)
    px, before = _rms(far[rows, late]), _rms(far[:, 0])
    lost = np.flatnonzero(np.diff(late)) + 1
    times = 1 + int((np.diff(lost) > LOSSES.at_once).sum()) if lost.size else 0
    compared = np.isfinite(far[rows, late]).sum()
    if times < fewest or compared < LOSSES.fewest or not px < LOSSES.near_px or not px * LOSSES.better < before:
        return None
    n = int(late[-1])
    return Lost(k, n, t.size + n, float(t[lost[0]]), float(t[lost[-1]]), px, before)


def cheapest(cost: Array) -> Ints:
    """How many pictures were lost before each sample, (T,), never falling: the cheapest way through cost (T, D).

    cost   px squared, of sample k where so many pictures were lost before it; a loss has a price of its own
    """
    T, D = cost.shape
    total, came = cost[0].copy(), np.zeros((T, D), np.int8)
    total[1:] += LOSSES.price * np.arange(1, D)  # before the first sample nothing is lost but at its price
    for k in range(1, T):
        ways = np.full((LOSSES.at_once + 1, D), np.inf)
        for s in range(LOSSES.at_once + 1):
            ways[s, s:] = total[: D - s] + (LOSSES.price if s else 0.0)
        came[k] = ways.argmin(0)
        total = ways.min(0) + cost[k]
    late = np.zeros(T, np.intp)
    late[-1] = total.argmin()
    for k in range(T - 1, 0, -1):
        late[k - 1] = late[k] - came[k, late[k]]
    return late


def _rms(px: Array) -> float:
    known = px[np.isfinite(px)]
    return float(np.sqrt((known**2).mean())) if known.size else float("inf")


def _longest(b: Array) -> Array:
    order = np.argsort(-np.isfinite(b[..., 0]).sum(1), kind="stable")
    return np.asarray(b[order[: LOSSES.tracks]])
