"""Which ball is which: tags for the blobs of every clip of one camera, grown from a pose.

A pose (`vidtrack.geometry.pose`) predicts where every tag must lie and how surely; tags that only one blob can be,
and blobs that only one tag can be, join the fit; the better pose predicts further; and so on until nothing changes. In
the end blobs go to tags one to one. A tag whose ball hides and a blob that is no ball stay without a partner.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one_within
from vidtrack.geometry.pose import PLAIN, RICH, Pose, adjust, predicted

Index = NDArray[np.intp]

GATE = 5.0
"""sd, how far a ball may lie from where the fit puts it."""
DISTINCT = 9.0
"""How much worse, in squared sd, the second candidate must be before a match counts as beyond doubt."""
OVERLARGE, OVERLARGE_FROM = 1.5, 8
"""Times the usual size, in a clip of so many blobs, beyond which a blob may be several balls that touch."""
FEWEST_PICKS = 4
"""Picks that, where all of them agree, leave no doubt about the view."""
SD_START, SD_LEAST = 1.5, 0.25
"""px, of one coordinate of a ball about the fitted pose: assumed at first, then measured, never less."""
CROWDING = 1 / 16
"""Share of the distance between neighbours beyond which scatter means a wrong pose: the gate must not reach them."""


class View(NamedTuple):
    """What one clip shows.

    points   (k,) which of the world points may be in it, ascending
    blobs    (n, 2) px, where blobs were found
    reach    (n, 2) px, half the width and height of each blob's box: two points in one box have merged
    """

    points: Index
    blobs: Array
    reach: Array


class Picks(NamedTuple):
    """Where a person picked tagged points: (n,) index of the view, (n,) index of the point, (n, 2) px."""

    view: Index
    point: Index
    xy: Array


class Labels(NamedTuple):
    """The answer, an array a view, in the order of its points.

    blob        (k,) the blob that each point is, -1 for none
    projected   (k, 2) px, where the fit puts each point; NaN where it cannot be seen
    shared      (k,) the blob that holds this point and another, so that neither may have it; -1 for none
    nearest     (k,) px, distance from there to the nearest blob that is no other point's; inf without any
    sd          px, of one coordinate about the fit
    """

    views: Sequence[View]
    pose: Pose
    blob: list[Index]
    projected: list[Array]
    shared: list[Index]
    nearest: list[Array]
    sd: float

    @property
    def merged(self) -> list[NDArray[np.bool_]]:
        """Which points (k,) of each view share their blob with another point."""
        return [shared >= 0 for shared in self.shared]

    @property
    def matched(self) -> int:
        """How many points have their blob."""
        return int(sum((blob >= 0).sum() for blob in self.blob))

    @property
    def expected(self) -> int:
        """How many points the fit puts inside the picture."""
        width, height = self.pose.camera.image_size
        return int(sum(((b > 0) & (b < (width - 1, height - 1))).all(-1).sum() for b in self.projected))

    def share_found(self, picks: Picks) -> float:
        """Share of the points in the picture that have their blob.

        Where FEWEST_PICKS or more are there and all agree, those that run into each other do not count, as long as they
        are no more than half: the picks say that the view is right, and no view separates them.
        """
        hidden = int(sum(merged.sum() for merged in self.merged))
        agree = agreeing(self, picks)
        sure = len(agree) >= FEWEST_PICKS and bool(agree.all()) and 2 * hidden <= self.expected
        return self.matched / max(self.expected - hidden * sure, 1)


def grow(pose: Pose, points: Array, views: Sequence[View], *, rounds: int = 16) -> Labels | None:
    """Labels by prediction and refit from a pose; None where fewer than 4 points find a blob.

    The plain lens serves until nothing changes; where that explains at least half of the balls, the rich one goes on.
    """
    labels = _settle(pose, points, views, PLAIN, rounds)
    if labels is None or labels.matched < max(0.5 * labels.expected, RICH / 2):
        return labels
    return _settle(labels.pose, points, views, RICH, rounds) or labels


def _settle(pose: Pose, points: Array, views: Sequence[View], terms: int, rounds: int) -> Labels | None:
    """Predict, match what is beyond doubt, refit; until nothing changes."""
    most = crowding_limit(views)
    sd, before = min(SD_START, most), b""
    for _ in range(rounds):
        view, row, blob = beyond_doubt(pose, points, views, sd)
        state = np.concatenate([view, row, blob]).tobytes()
        if len(row) < 4:
            return None
        if state == before:
            break
        before = state
        p = np.concatenate([points[v.points[row[view == i]]] for i, v in enumerate(views)])
        b = np.concatenate([v.blobs[blob[view == i]] for i, v in enumerate(views)])
        better = adjust(pose.camera, p, b, sd, terms=terms, iterations=8)
        if better is None:
            return None
        pose, sd = better, min(scatter_of(better), most)
    return _assigned(pose, points, views, sd)


def best_labels(found: Sequence[Labels], picks: Picks | None = None) -> list[Labels]:
    """The labels that explain most, and after them the different ones that explain as much."""
    if not found:
        return []
    score = [labels.matched + (0 if picks is None else 2 * int(agreeing(labels, picks).sum())) for labels in found]
    ranked = sorted(range(len(found)), key=lambda i: (-score[i], found[i].sd))
    best: list[Labels] = []
    for i in ranked:
        rival = not best or (score[i] == score[ranked[0]] and found[i].sd < 2 * best[0].sd)
        if rival and not any(_same(found[i], other) for other in best):
            best.append(found[i])
    return best


def agreeing(labels: Labels, picks: Picks) -> NDArray[np.bool_]:
    """Which picks (n,) lie where their tags do: within 2.5 % of the picture's width, or nearest to no other tag."""
    width = labels.pose.camera.image_size[0]
    good = np.zeros(len(picks.point), bool)
    for i, (view, point) in enumerate(zip(picks.view, picks.point, strict=True)):
        d = np.linalg.norm(labels.projected[view] - picks.xy[i], axis=-1)
        own = d[np.searchsorted(labels.views[view].points, point)]
        good[i] = own < 0.025 * width or (own < 0.06 * width and own <= np.nanmin(d))
    return good


def beyond_doubt(pose: Pose, points: Array, views: Sequence[View], sd: float) -> tuple[Index, Index, Index]:
    """Pairs that no second candidate disputes: (n,) view, (n,) row of the view's points, (n,) blob."""
    out: list[Array] = [np.zeros((0, 3), np.intp)]
    for i, view in enumerate(views):
        cost = _distances(pose, points, view, sd)
        if not cost.size:
            continue
        row = np.arange(len(cost))
        blob = cost.argmin(1)
        best = cost[row, blob]
        rival = cost.copy()
        rival[row, blob] = np.inf
        by_row = rival.min(1, initial=np.inf)
        by_blob = rival.min(0, initial=np.inf)[blob]
        sure = (best < (GATE - 1) ** 2) & (np.minimum(by_row, by_blob) > best + DISTINCT) & ~_overlarge(view)[blob]
        out.append(np.stack([np.full(sure.sum(), i), row[sure], blob[sure]], -1))
    view_of, row_of, blob_of = np.concatenate(out).T
    return view_of, row_of, blob_of


def _overlarge(view: View) -> NDArray[np.bool_]:
    """Which blobs (n,) may be several balls: their middle is not that of any ball, so that no pose uses them."""
    size = view.reach.max(axis=-1)
    if len(size) < OVERLARGE_FROM:
        return np.zeros(len(size), bool)
    return np.asarray(size > OVERLARGE * np.median(size))


def _distances(pose: Pose, points: Array, view: View, sd: float) -> Array:
    """Squared distances (k, n) in sd between predicted points and blobs; inf where a point cannot be seen."""
    at, covariance = predicted(pose, points[view.points])
    known = np.trace(covariance, axis1=-2, axis2=-1) < pose.camera.image_size[0] ** 2
    precision = np.linalg.inv(np.where(known[:, None, None], covariance, 0) + sd * sd * np.eye(2))
    d = view.blobs[None] - at[:, None]
    cost = np.einsum("kni,kij,knj->kn", d, precision, d)
    return np.asarray(np.where(known[:, None] & np.isfinite(cost), cost, np.inf))


def px_apart(at: Array, blobs: Array) -> Array:
    """px (k, n) from points at (k, 2) to blobs (n, 2); inf where a point cannot be seen."""
    d: Array = np.linalg.norm(blobs[None] - at[:, None], axis=-1)
    return np.where(np.isfinite(d), d, np.inf)


def crowding_limit(views: Sequence[View]) -> float:
    """px, the scatter beyond which the gate would reach a ball's neighbour."""
    return max(CROWDING * spacing(views), 2 * SD_LEAST)


def spacing(views: Sequence[View]) -> float:
    """px, how far the usual blob is from its nearest neighbour."""
    gaps = []
    for view in views:
        d = np.linalg.norm(view.blobs[:, None] - view.blobs[None], axis=-1)
        np.fill_diagonal(d, np.inf)
        gaps.append(d.min(1, initial=np.inf))
    joined = np.concatenate(gaps)
    joined = joined[np.isfinite(joined)]
    return float(np.median(joined)) if joined.size else np.inf


def scatter_of(pose: Pose) -> float:
    """px, robust standard deviation of one coordinate about the fit; few points do not make it small."""
    r = pose.residuals
    spare = max(r.size - len(pose.covariance), 0.2 * r.size)
    sd = 1.4826 * float(np.median(np.abs(r))) * np.sqrt(r.size / spare)
    return float(max(sd, SD_START if len(r) < 8 else SD_LEAST))


def _assigned(pose: Pose, points: Array, views: Sequence[View], sd: float) -> Labels:
    """Blobs to points, one to one, within the gate; points that share one blob's box have no blob of their own."""
    blobs, projected, shared, nearest = [], [], [], []
    for view in views:
        at = predicted(pose, points[view.points])[0]
        blob = one_to_one_within(_distances(pose, points, view, sd), GATE**2)
        parts = _shared(at, blob, view)
        blob[parts >= 0] = -1
        blobs.append(blob)
        projected.append(at)
        shared.append(parts)
        nearest.append(_nearest(at, blob, view))
    return Labels(views, pose, blobs, projected, shared, nearest, sd)


def _shared(at: Array, blob: Index, view: View) -> Index:
    """The blob (k,) whose box holds a point and another one, of which one at least has no other blob; else -1.

    Two that touch are one blob half-way between them, which may be within the gate of one of them, or of neither.
    """
    out = np.full(len(at), -1, np.intp)
    for j, (centre, reach) in enumerate(zip(view.blobs, view.reach, strict=True)):
        inside = (np.abs(at - centre) <= reach).all(-1) & ((blob < 0) | (blob == j))
        if inside.sum() > 1:
            out[inside] = j
    return out


def _nearest(at: Array, blob: Index, view: View) -> Array:
    free = np.setdiff1d(np.arange(len(view.blobs)), blob)
    d = np.linalg.norm(at[:, None] - view.blobs[free][None], axis=-1)
    return np.asarray(np.nan_to_num(d, nan=np.inf).min(1, initial=np.inf))


def complete(labels: Labels, picks: Picks) -> bool:
    """Whether labels leave no doubt: nearly all balls are found where they belong, and nearly all picks agree.

    A lattice shifted by a row explains three quarters of the balls at most, and badly; so fewer balls must lie the
    closer, and no pick may then contradict them.
    """
    share, spread = labels.share_found(picks), labels.sd / crowding_limit(labels.views)
    odd = int((~agreeing(labels, picks)).sum())
    if odd:
        return share >= 0.95 and spread < 0.8 and 3 * odd <= len(picks.point)
    return (share >= 0.85 and spread < 0.8) or (share >= 0.7 and spread < 0.4)


def _same(a: Labels, b: Labels) -> bool:
    """Whether two answers name every blob alike where both name it at all."""
    both = [(x >= 0) & (y >= 0) for x, y in zip(a.blob, b.blob, strict=True)]
    return all((x[m] == y[m]).all() for x, y, m in zip(a.blob, b.blob, both, strict=True))
