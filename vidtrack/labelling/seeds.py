"""Names from picks: the places of a few tags, as a person picked them, give the pose by which the rest is named.

A pick may be some pixels off, at the wrong ball or swapped. So picks are tried at the blobs near them, as they are,
with some left out, at other blobs and exchanged; what explains most balls and picks wins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one_within
from vidtrack.geometry.pose import poses
from vidtrack.labelling.label import SD_START, Index, Labels, Picks, View, best_labels, complete, grow

TRIES = 12
"""Poses to grow before giving up."""


def label_from_picks(points: Array, views: Sequence[View], picks: Picks, image_size: tuple[int, int]) -> list[Labels]:
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


def on_one_line(p: Array) -> bool:
    """Whether points (n, 2 or 3) lie on or near one line, which leaves a pose free to turn about it; 2 always do.

    What is not finite does not count.
    """
    p = p[np.isfinite(p).all(-1)]
    if len(p) < 3:
        return True
    spread = np.linalg.svd(p - p.mean(0), compute_uv=False)
    return bool(spread[1] <= 0.02 * spread[0])


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
    excluded: frozenset[tuple[int, int]] = frozenset(),
) -> Seeds:
    """Picks moved to the blobs nearest to them, one to one; a pick without a blob in reach stays, with a larger sd.

    excluded pairs (pick, blob) that must not be chosen
    """
    xy, sd = picks.xy.copy(), np.full(len(picks.point), 4 * SD_START)
    chosen = np.full(len(picks.point), -1)
    for v in np.unique(picks.view[keep]):
        rows = [i for i in keep if picks.view[i] == v]
        d = np.linalg.norm(picks.xy[rows][:, None] - views[v].blobs[None], axis=-1)
        for at, i in enumerate(rows):
            d[at, [j for k, j in excluded if k == i]] = np.inf
        for i, j in zip(rows, one_to_one_within(d**2, radius**2).tolist(), strict=True):
            if j >= 0:
                xy[i], sd[i], chosen[i] = views[v].blobs[j], SD_START, j
    return Seeds(keep, xy[keep], sd[keep], chosen)
