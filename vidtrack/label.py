"""Which ball is which: tags for the blobs of every clip of one camera, grown from a few that are known.

Seeds give a pose (`vidtrack.pose`); the pose predicts where every other tag must lie and how surely; tags that
only one blob can be, and blobs that only one tag can be, join the fit; the better pose predicts further; and so on
until nothing changes. In the end blobs go to tags one to one. A tag whose ball hides and a blob that is no
ball stay without a partner.

A pick (where a person said that a tag is) may be some pixels off, at the wrong ball or swapped: picks are tried at
the blobs near them, then with some left out, and what explains most balls wins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.camera import Array
from vidtrack.pose import PLAIN, RICH, Pose, adjust, poses, predicted

Index = NDArray[np.intp]

GATE = 5.0
"""sd, how far a ball may lie from where the fit puts it."""
DISTINCT = 9.0
"""How much worse, in squared sd, the second candidate must be before a match counts as beyond doubt."""
SD_START, SD_LEAST = 1.5, 0.25
"""px, of one coordinate of a ball about the fitted pose: assumed at first, then measured, never less."""
CROWDING = 1 / 16
"""Share of the distance between neighbours beyond which scatter means a wrong pose: the gate must not reach them."""
TRIES = 24
"""Poses to grow before giving up."""


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
    """Where a person saw tagged points: (n,) index of the view, (n,) index of the point, (n, 2) px."""

    view: Index
    point: Index
    xy: Array


class Labels(NamedTuple):
    """The answer, an array a view, in the order of its points.

    blob        (k,) the blob that each point is, -1 for none
    projected   (k, 2) px, where the fit puts each point; NaN where it cannot be seen
    merged      (k,) whether one blob holds this point and another, so that neither may have it
    nearest     (k,) px, distance from there to the nearest blob that is no other point's; inf without any
    sd          px, of one coordinate about the fit
    """

    views: Sequence[View]
    pose: Pose
    blob: list[Index]
    projected: list[Array]
    merged: list[NDArray[np.bool_]]
    nearest: list[Array]
    sd: float

    @property
    def matched(self) -> int:
        """How many points have their blob."""
        return int(sum((blob >= 0).sum() for blob in self.blob))

    @property
    def expected(self) -> int:
        """How many points the fit puts inside the picture."""
        width, height = self.pose.camera.image_size
        return int(sum(((b > 0) & (b < (width - 1, height - 1))).all(-1).sum() for b in self.projected))


def label(points: Array, views: Sequence[View], picks: Picks, image_size: tuple[int, int]) -> list[Labels]:
    """Labels from at least 4 picks in any views: what explains most first, and every rival that does as well.

    points   (m, 3)  surveyed, world units
    An empty list means that no pose explains the picks. Two answers mean that the picks leave a doubt.
    Raises ValueError for fewer than 3 picks. Picks on one line are the caller's to refuse (`on_one_line`).
    """
    if len(picks.point) < 3:
        raise ValueError(f"{len(picks.point)} picks leave the pose open; 4 are needed")
    found: list[Labels] = []
    tries = 0
    for seeds in _hypotheses(views, picks, image_size[0]):
        for pose in poses(points[picks.point[seeds.keep]], seeds.xy, seeds.sd, image_size)[:4]:
            labels = grow(pose, points, views)
            tries += 1
            if labels is not None:
                found.append(labels)
        if tries >= TRIES or any(complete(labels, picks) for labels in found):
            break
    return best_labels(found, picks)


def grow(pose: Pose, points: Array, views: Sequence[View], *, rounds: int = 15) -> Labels | None:
    """Labels by prediction and refit from a pose; None where fewer than 4 points find a blob."""
    most = _most(views)
    sd, terms, before = min(SD_START, most), PLAIN, b""
    for turn in range(rounds):
        view, row, blob = _beyond_doubt(pose, points, views, sd)
        state = np.concatenate([view, row, blob]).tobytes()
        if len(row) < 4:
            return None
        if state == before and terms == RICH:
            break
        if state == before or turn == rounds // 2:
            terms = RICH
        before = state
        p = np.concatenate([points[v.points[row[view == i]]] for i, v in enumerate(views)])
        b = np.concatenate([v.blobs[blob[view == i]] for i, v in enumerate(views)])
        better = adjust(pose.camera, p, b, sd, terms=terms, iterations=8)
        if better is None:
            return None
        pose, sd = better, min(_scatter(better), most)
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


def on_one_line(p: Array) -> bool:
    """Whether points (n, 3) lie on or near one line, which leaves a pose free to turn about it."""
    spread = np.linalg.svd(p - p.mean(0), compute_uv=False)
    return bool(spread[1] < 0.02 * spread[0])


class Seeds(NamedTuple):
    """Picks to start from: which, (k, 2) px and (k,) sd px, and the blob that each of all picks took (-1: none)."""

    keep: list[int]
    xy: Array
    sd: Array
    chosen: Index


def _hypotheses(views: Sequence[View], picks: Picks, width: int) -> Iterator[Seeds]:
    """Seeds to try, the likeliest first: at the nearest blobs, as picked, some left out, at other blobs, swapped."""
    n, radius = len(picks.point), 0.06 * width
    everyone = list(range(n))
    first = _snapped(picks, everyone, views, radius)
    yield first
    yield Seeds(everyone, picks.xy, np.full(n, 0.012 * width), first.chosen)
    for left_out in (1, 2):
        if n - left_out >= 4:
            for keep in islice(combinations(everyone, n - left_out), 30):
                yield _snapped(picks, list(keep), views, radius)
    moved = [(i, int(j)) for i, j in enumerate(first.chosen) if j >= 0]
    for bars in (*combinations(moved, 1), *islice(combinations(moved, 2), 20)):
        yield _snapped(picks, everyone, views, radius, frozenset(bars))
    for a, b in combinations(everyone, 2):
        if picks.view[a] == picks.view[b]:
            xy = first.xy.copy()
            xy[[a, b]] = xy[[b, a]]
            yield Seeds(everyone, xy, first.sd, first.chosen)


def _snapped(
    picks: Picks,
    keep: list[int],
    views: Sequence[View],
    radius: float,
    barred: frozenset[tuple[int, int]] = frozenset(),
) -> Seeds:
    """Picks moved to the blobs nearest to them, one to one; a pick without a blob in reach stays, less trusted.

    barred   pairs (pick, blob) that may not be
    """
    from scipy.optimize import linear_sum_assignment

    xy, sd = picks.xy.copy(), np.full(len(picks.point), 4 * SD_START)
    chosen = np.full(len(picks.point), -1)
    for v in np.unique(picks.view[keep]):
        rows = [i for i in keep if picks.view[i] == v]
        d = np.linalg.norm(picks.xy[rows][:, None] - views[v].blobs[None], axis=-1)
        for at, i in enumerate(rows):
            d[at, [j for k, j in barred if k == i]] = np.inf
        cost = np.minimum(d, radius) ** 2
        row, column = linear_sum_assignment(cost)
        for at, j in zip(row.tolist(), column.tolist(), strict=True):
            if d[at, j] < radius:
                i = rows[at]
                xy[i], sd[i], chosen[i] = views[v].blobs[j], SD_START, j
    return Seeds(keep, xy[keep], sd[keep], chosen)


def _beyond_doubt(pose: Pose, points: Array, views: Sequence[View], sd: float) -> tuple[Index, Index, Index]:
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
        sure = (best < (GATE - 1) ** 2) & (np.minimum(by_row, by_blob) > best + DISTINCT)
        out.append(np.stack([np.full(sure.sum(), i), row[sure], blob[sure]], -1))
    view_of, row_of, blob_of = np.concatenate(out).T
    return view_of, row_of, blob_of


def _distances(pose: Pose, points: Array, view: View, sd: float) -> Array:
    """Squared distances (k, n) in sd between predicted points and blobs; inf where a point cannot be seen."""
    at, covariance = predicted(pose, points[view.points])
    known = np.trace(covariance, axis1=-2, axis2=-1) < pose.camera.image_size[0] ** 2
    precision = np.linalg.inv(np.where(known[:, None, None], covariance, 0) + sd * sd * np.eye(2))
    d = view.blobs[None] - at[:, None]
    cost = np.einsum("kni,kij,knj->kn", d, precision, d)
    return np.asarray(np.where(known[:, None] & np.isfinite(cost), cost, np.inf))


def _most(views: Sequence[View]) -> float:
    """px, the scatter beyond which the gate would reach a ball's neighbour."""
    return max(CROWDING * _spacing(views), 2 * SD_LEAST)


def _spacing(views: Sequence[View]) -> float:
    """px, how far the usual blob is from its nearest neighbour."""
    gaps = []
    for view in views:
        d = np.linalg.norm(view.blobs[:, None] - view.blobs[None], axis=-1)
        np.fill_diagonal(d, np.inf)
        gaps.append(d.min(1, initial=np.inf))
    joined = np.concatenate(gaps)
    joined = joined[np.isfinite(joined)]
    return float(np.median(joined)) if joined.size else np.inf


def _scatter(pose: Pose) -> float:
    """px, robust standard deviation of one coordinate about the fit; few points cannot claim a small one."""
    r = pose.residuals
    spare = max(r.size - len(pose.covariance), 0.2 * r.size)
    sd = 1.4826 * float(np.median(np.abs(r))) * np.sqrt(r.size / spare)
    return float(max(sd, SD_START if len(r) < 8 else SD_LEAST))


def _assigned(pose: Pose, points: Array, views: Sequence[View], sd: float) -> Labels:
    """Blobs to points, one to one, within the gate; points that share one blob's box have no blob of their own."""
    blobs, projected, merged, nearest = [], [], [], []
    for view in views:
        at = predicted(pose, points[view.points])[0]
        blob = _one_to_one(_distances(pose, points, view, sd), GATE**2)
        shared = _merged(at, blob, view)
        blob[shared] = -1
        blobs.append(blob)
        projected.append(at)
        merged.append(shared)
        nearest.append(_nearest(at, blob, view))
    return Labels(views, pose, blobs, projected, merged, nearest, sd)


def _one_to_one(cost: Array, most: float) -> Index:
    """The blob (k,) of each point for the least total cost (k, n), -1 where it would cost more than `most`."""
    from scipy.optimize import linear_sum_assignment

    row, column = linear_sum_assignment(np.minimum(cost, 2 * most))
    blob = np.full(len(cost), -1, np.intp)
    good = cost[row, column] < most
    blob[row[good]] = column[good]
    return blob


def _merged(at: Array, blob: Index, view: View) -> NDArray[np.bool_]:
    """Which points (k,) share a blob's box, while one of them has no other blob."""
    if not len(view.blobs):
        return np.zeros(len(at), bool)
    centre, reach = view.blobs[blob], view.reach[blob]
    inside = (np.abs(at[None] - centre[:, None]) <= reach[:, None]).all(-1)  # (k owners, k others)
    shares = inside & (blob >= 0)[:, None] & (blob < 0)[None]
    return np.asarray(shares.any(1) | shares.any(0))


class Shift(NamedTuple):
    """Labels of a view that lies elsewhere as a whole: blob (k,), offset (2,) px."""

    blob: Index
    offset: Array


def shifted(labels: Labels, i: int) -> Shift | None:
    """Labels of view i after moving it as a whole, where that finds most of its points and the fit as it is does not.

    A camera that was knocked between clips does this. Moves up to 0.45 of the balls' spacing can be told.
    """
    view, at = labels.views[i], labels.projected[i]
    seen = np.isfinite(at).all(-1).sum()
    if seen < 4 or (labels.blob[i] >= 0).sum() > 0.5 * seen or not len(view.blobs):
        return None
    rough = _one_to_one(_gaps(at, view.blobs), 0.45 * _spacing([view]))
    has = rough >= 0
    if has.sum() < 4:
        return None
    offset = np.median((view.blobs[rough] - at)[has], axis=0)
    blob = _one_to_one(_gaps(at + offset, view.blobs), 2 * GATE * labels.sd)
    return Shift(blob, offset) if (blob >= 0).sum() > 0.7 * seen else None


def _gaps(at: Array, blobs: Array) -> Array:
    """px (k, n) from points to blobs; inf where a point cannot be seen."""
    d: Array = np.linalg.norm(blobs[None] - at[:, None], axis=-1)
    return np.where(np.isfinite(d), d, np.inf)


def _nearest(at: Array, blob: Index, view: View) -> Array:
    free = np.setdiff1d(np.arange(len(view.blobs)), blob)
    d = np.linalg.norm(at[:, None] - view.blobs[free][None], axis=-1)
    return np.asarray(np.nan_to_num(d, nan=np.inf).min(1, initial=np.inf))


def complete(labels: Labels, picks: Picks) -> bool:
    """Whether labels leave nothing to wish for: all picks agree, nearly all balls are found where they belong."""
    good = labels.matched >= 0.85 * labels.expected and labels.sd < 0.8 * _most(labels.views)
    return bool(good and agreeing(labels, picks).all())


def _same(a: Labels, b: Labels) -> bool:
    """Whether two answers name every blob alike where both name it at all."""
    both = [(x >= 0) & (y >= 0) for x, y in zip(a.blob, b.blob, strict=True)]
    return all((x[m] == y[m]).all() for x, y, m in zip(a.blob, b.blob, both, strict=True))
