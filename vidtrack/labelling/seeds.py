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
from vidtrack.geometry.camera import project
from vidtrack.geometry.pose import poses
from vidtrack.labelling.label import SD_START, Index, Labels, Picks, View, best_labels, complete, grow

TRIES = 12
"""Poses to grow, of picks as they are and again of picks changed, before giving up."""
SUBSETS, SUBSET = 35, 4
"""Of so many sets of so many picks the pose is asked which other picks it agrees with."""
AGREES = 0.06
"""Of the picture's width: a pick farther from where a pose of others puts it does not agree with them."""


def label_from_picks(
    points: Array, views: Sequence[View], picks: Picks, image_size: tuple[int, int], *, trusted: bool = False
) -> list[Labels]:
    """Labels from at least 4 picks in any views: what explains most first, and every rival that does as well.

    points   (m, 3)  surveyed, world units
    trusted  no pick is left out, moved or exchanged
    An empty list means that no pose explains the picks. Two answers mean that the picks leave a doubt.
    Raises ValueError for fewer than 3 picks. Picks on one line are the caller's to refuse (`on_one_line`).
    """
    if len(picks.point) < 3:
        raise ValueError(f"{len(picks.point)} picks leave the pose open; 4 are needed")
    found: list[Labels] = []
    kinds = [_as_they_are(views, picks, image_size[0])]
    if not trusted:
        kinds += [_in_agreement(points, views, picks, image_size), _changed(views, picks, image_size[0])]
    for kind in kinds:
        tries = 0
        for seeds in kind:
            for pose in poses(points[picks.point[seeds.keep]], seeds.xy, seeds.sd, image_size)[:4]:
                labels = grow(pose, points, views)
                tries += 1
                if labels is not None:
                    found.append(labels)
            if tries >= TRIES or any(complete(labels, picks) for labels in found):
                break
        if any(complete(labels, picks) for labels in found):
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


def _as_they_are(views: Sequence[View], picks: Picks, width: int) -> Iterator[Seeds]:
    """All picks: at the blobs nearest to them, and as picked."""
    everyone = list(range(len(picks.point)))
    first = _snapped(picks, everyone, views, AGREES * width)
    yield first
    yield Seeds(everyone, picks.xy, np.full(len(everyone), 0.012 * width), first.chosen)


def _in_agreement(points: Array, views: Sequence[View], picks: Picks, image_size: tuple[int, int]) -> Iterator[Seeds]:
    """Picks of which a pose explains all, without the others, most picks first.

    A tag that is wrong in the survey, or a pick at the wrong ball, spoils every pose that it takes part in: so poses
    of few picks are asked with which of the rest they agree.
    """
    n, radius = len(picks.point), AGREES * image_size[0]
    if n <= SUBSET:
        return
    sets = list(islice(combinations(range(n), SUBSET), 4 * SUBSETS))
    if len(sets) > SUBSETS:
        rng = np.random.default_rng(0)
        sets = [tuple(sorted(rng.choice(n, SUBSET, replace=False).tolist())) for _ in range(SUBSETS)]
    ranked: dict[tuple[int, ...], float] = {}
    for chosen in sets:
        seeds = _snapped(picks, list(chosen), views, radius)
        if on_one_line(points[picks.point[seeds.keep]]):
            continue
        for pose in poses(points[picks.point[seeds.keep]], seeds.xy, seeds.sd, image_size)[:2]:
            off = np.linalg.norm(project(pose.camera, points[picks.point]) - picks.xy, axis=-1)
            agreed = tuple(np.flatnonzero(off < radius).tolist())
            if SUBSET <= len(agreed) < n:
                ranked[agreed] = min(ranked.get(agreed, np.inf), pose.cost)
    for keep in sorted(ranked, key=lambda keep: (-len(keep), ranked[keep])):
        yield _snapped(picks, list(keep), views, radius)


def _changed(views: Sequence[View], picks: Picks, width: int) -> Iterator[Seeds]:
    """All picks, some of them at other blobs or exchanged."""
    everyone, radius = list(range(len(picks.point))), AGREES * width
    first = _snapped(picks, everyone, views, radius)
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
