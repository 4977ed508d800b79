"""Labels without any pick: the surveyed configuration against all blobs, and whether the answer is the only one.

Seen from afar a picture is an affine image of the points. Once both clouds are given the same moments (whitened), only
a turn remains: three numbers, few enough to try them all. The best turns are refined and then grown into
labels like any other pose (`vidtrack.labelling.label`).

A configuration that a turn or a mirror maps onto itself looks the same under several labellings. Every such map of the
answer is fitted too, and what fits as well is a rival: nothing in the pictures can choose between rivals.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one
from vidtrack.geometry.pose import RICH, adjust, poses
from vidtrack.labelling.label import Index, Labels, Picks, View, best_labels, complete, grow, spacing
from vidtrack.labelling.seeds import label_from_picks, on_one_line

TURNS = 8000
"""Attitudes to try; neighbours are about 13 degrees apart."""
CANDIDATES = 24
"""Turns that are refined."""
STARTS = 8
"""Different affine starts from which labels are grown."""
FLAT = 0.03
"""Third over first spread below which points count as coplanar here: their depth would only be noise."""
SCORED = 200
"""Points and blobs that a turn is scored by."""
OUTLYING = 4.0
"""Times the median distance from the middle beyond which a point or a blob does not count in the moments."""
RIVAL = 3.0
"""How many times the best sum of squares a rival may have: F-tests of 30 and more residuals put 3 beyond 1 in 1000."""


FEWEST = 4
"""Fewer named balls than fix a camera's pose are no labels."""


def label_with(points: Array, views: Sequence[View], picks: Picks, image_size: tuple[int, int]) -> list[Labels]:
    """Labels from any number of picks: 4 or more are seeds; where a doubt is left, they vote on `label_alone`.

    points  (m, 3) surveyed, world units. The best answer first, then rivals that fit balls and
            picks as well.
    """
    seeded: list[Labels] = []
    if len(picks.point) >= 4 and not on_one_line(points[picks.point]):
        seeded = [one for one in label_from_picks(points, views, picks, image_size) if one.matched >= FEWEST]
        if len(seeded) == 1 and complete(seeded[0], picks):
            return seeded
    return best_labels([*seeded, *label_alone(points, views, image_size)], picks)


def label_alone(points: Array, views: Sequence[View], image_size: tuple[int, int]) -> list[Labels]:
    """The labels that explain most blobs, with every rival that fits as well; empty where nothing fits.

    points  (m, 3) surveyed, world units. Two or more answers: the configuration is symmetric, or nearly so.
    At least 60 % of the points that should be seen must be found, and at least 6.
    """
    shown = np.unique(np.concatenate([view.points for view in views]))
    if len(shown) < 6 or min(len(view.blobs) for view in views) == 0:
        return []
    if on_one_line(points[shown]) or on_one_line(np.concatenate([view.blobs for view in views])):
        return []
    found: list[Labels] = []
    enough = np.inf
    compact = _without_outlying(points, views)
    for cost, start in _affine_starts(points, compact):
        if cost > enough:
            break
        point, xy = _paired(points, compact, start)
        if any(_agreement(labels, point, xy) > 0.9 for labels in found):
            continue
        for pose in poses(points[point], xy, 4.0, image_size)[:2]:
            labels = grow(pose, points, views)
            if labels is not None and labels.matched >= max(6, 0.6 * labels.expected):
                found.append(labels)
                if labels.matched >= 0.95 * labels.expected:
                    enough = min(enough, 1.5 * cost)
                    break
    best = best_labels(found)
    return best_labels([*best, *(r for one in best[:1] for r in rivals(one, points, views))]) if best else []


def rivals(labels: Labels, points: Array, views: Sequence[View]) -> list[Labels]:
    """Other labels of the same blobs that fit about as well, from the maps of the configuration onto itself."""
    point, xy = _matched(labels)
    best, camera = _sum_of_squares(labels), labels.pose.camera
    f_starts = [k * camera.f / camera.image_size[0] for k in (0.5, 1.0, 2.0)]
    answer = []
    for image in self_maps(points, [view.points for view in views]):
        for pose in poses(points[image[point]], xy, max(labels.sd, 0.5), camera.image_size, f_starts)[:2]:
            if float((pose.residuals**2).sum()) > 20 * RIVAL * best:
                continue
            better = adjust(pose.camera, points[image[point]], xy, labels.sd, terms=RICH)
            if better is None or float((better.residuals**2).sum()) > RIVAL * best:
                continue
            other = grow(better, points, views)
            if other is not None and other.matched >= labels.matched - 1:
                answer.append(other)
    return answer


def self_maps(points: Array, groups: Sequence[Index]) -> list[Index]:
    """Maps (m,) of the points onto themselves that an affine view cannot distinguish: image[i] is where i goes.

    points  (m, 3); groups: the points of each view, which must map onto themselves.
    Turns and mirrors of the whitened points, so those of the points themselves are among them; a point lands within a
    quarter of the distance to its neighbour. Points in no group map to themselves. The identity is left out.
    """
    shown = np.unique(np.concatenate(list(groups)))
    x, _ = _whitened(points[shown])
    member = np.stack([np.isin(shown, group) for group in groups], -1)
    kind = np.unique(member, axis=0, return_inverse=True)[1].ravel()
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    near = 0.25 * float(np.median(np.where(apart > 1e-9, apart, np.inf).min(1)))
    base = _base(x)
    norm = np.linalg.norm(x, axis=-1)
    options = [np.flatnonzero((kind == kind[b]) & (np.abs(norm - norm[b]) < near)) for b in base]
    inverse = np.linalg.inv(x[base])
    maps = []
    for images in product(*options):
        if (np.abs(apart[np.ix_(images, images)] - apart[np.ix_(base, base)]) > 2 * near).any():
            continue
        moved = x @ (inverse @ x[list(images)])
        d = np.linalg.norm(moved[:, None] - x[None], axis=-1) + np.where(kind[:, None] == kind[None], 0, np.inf)
        image = d.argmin(1)
        lands = d[np.arange(len(x)), image].max() < near and len(np.unique(image)) == len(image)
        if lands and (image != np.arange(len(x))).any():
            whole = np.arange(len(points))
            whole[shown] = shown[image]
            maps.append(whole)
    return [np.array(m) for m in dict.fromkeys(tuple(m) for m in maps)]


def _without_outlying(points: Array, views: Sequence[View]) -> list[View]:
    """The views without points that lie far out, where most do not: one mistyped row would stretch all moments."""
    shown = points[np.unique(np.concatenate([view.points for view in views]))]
    middle = np.median(shown, axis=0)
    far = np.linalg.norm(points - middle, axis=-1)
    near = far < OUTLYING * np.median(np.linalg.norm(shown - middle, axis=-1)) + 1e-9
    return [view._replace(points=view.points[near[view.points]]) for view in views]


def _whitened(p: Array) -> tuple[Array, Array]:
    """Points (n, d) with mean 0 and unit covariance in their own 2 or 3 dimensions, and the spread of each."""
    u, s, _ = np.linalg.svd(p - p.mean(0), full_matrices=False)
    keep = s > FLAT * s[0]
    return u[:, keep] * np.sqrt(len(p)), s


def _base(x: Array) -> list[int]:
    """Points that span the space about the mean, one a dimension: each the farthest from the span of those before."""
    base, rest = [], x.copy()
    for _ in range(x.shape[1]):
        i = int(np.argmax(np.linalg.norm(rest, axis=-1)))
        base.append(i)
        axis = rest[i] / np.linalg.norm(rest[i])
        rest = rest - np.outer(rest @ axis, axis)
    return base


def _turns(dimensions: int) -> Array:
    """Rows of rotations, (n, 2, 3), spread evenly; in a plane turns and mirrored turns, (n, 2, 2)."""
    if dimensions == 2:
        t = np.radians(np.arange(0, 360, 3))
        c, s = np.cos(t), np.sin(t)
        return np.concatenate([np.stack([c, -s, s, c], -1), np.stack([c, s, s, -c], -1)]).reshape(-1, 2, 2)
    # super-Fibonacci spirals (Alexa 2022): an even spread of unit quaternions
    i = np.arange(TURNS) + 0.5
    psi = 1.533751168755204288118041
    r, q = np.sqrt(i / TURNS), np.sqrt(1 - i / TURNS)
    a, b = 2 * np.pi * i / np.sqrt(2), 2 * np.pi * i / psi
    x, y, z, w = r * np.sin(a), r * np.cos(a), q * np.sin(b), q * np.cos(b)
    first = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1)
    second = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1)
    return np.stack([first, second], 1)


def _affine_starts(points: Array, views: Sequence[View]) -> list[tuple[float, Array]]:
    """Cost, and where every point of every view would lie, (sum k, 2) px, for the best turns refined; best first.

    Empty where points or blobs lie on one line.
    """
    from scipy.spatial import cKDTree

    everything = np.concatenate([points[view.points] for view in views])
    x, _ = _whitened(everything)
    blobs = np.concatenate([view.blobs for view in views])
    middle = np.median(blobs, axis=0)
    far = np.linalg.norm(blobs - middle, axis=-1)
    kept = blobs[far < OUTLYING * np.median(far) + 1e-9]
    if x.shape[1] < 2 or on_one_line(kept):
        return []
    spread = np.linalg.cholesky(np.cov(kept.T))
    flat = np.linalg.inv(spread)
    turns = _turns(x.shape[1])
    cost = np.zeros(len(turns))
    start = 0
    for view in views:
        own = np.arange(start, start + len(view.points))[:: max(1, len(x) // SCORED)]
        start += len(view.points)
        tree = cKDTree((view.blobs - kept.mean(0)) @ flat.T)
        at = np.einsum("nij,kj->nki", turns, x[own])
        cost += np.minimum(tree.query(at.reshape(-1, 2))[0], 1.0).reshape(len(turns), -1).sum(1)
    order = np.argsort(cost, kind="stable")
    chosen: list[np.intp] = []
    for i in order[:2000]:
        if all(np.linalg.norm(turns[i] - turns[j]) > 0.35 for j in chosen):
            chosen.append(i)
        if len(chosen) == CANDIDATES:
            break
    refined = [_refined(kept.mean(0) + (x @ turns[i].T) @ spread.T, x, views) for i in chosen]
    return _different(sorted(refined, key=lambda pair: pair[0]), views)[:STARTS]


def _different(ordered: Sequence[tuple[float, Array]], views: Sequence[View]) -> list[tuple[float, Array]]:
    """The starts without those that put the points where a cheaper one does, to a quarter of the blobs' spacing.

    Several turns refine to one start, and a symmetric layout has starts of equal cost but for rounding: copies would
    crowd out the right one by the last bit.
    """
    kept: list[tuple[float, Array]] = []
    near = 0.25 * spacing(views)
    for cost, at in ordered:
        if all(np.median(np.linalg.norm(at - other, axis=-1)) > near for _, other in kept):
            kept.append((cost, at))
    return kept


def _refined(at: Array, x: Array, views: Sequence[View]) -> tuple[float, Array]:
    """Predicted positions after assigning and refitting an affine map a few times, and the cost that is left."""
    design = np.concatenate([x, np.ones((len(x), 1))], -1)
    cost = np.inf
    for _ in range(12):
        row, xy = _assigned(at, views)
        error = np.linalg.norm(xy - at[row], axis=-1)
        good = error <= 3 * np.median(error) + 1e-9
        fit = np.linalg.lstsq(design[row[good]], xy[good], rcond=None)[0]
        at = design @ fit
        now = float(np.minimum(error, 3 * np.median(error)).sum())
        if now >= cost * 0.999:
            break
        cost = now
    return cost, at


def _assigned(at: Array, views: Sequence[View]) -> tuple[Index, Array]:
    """Rows of `at` that get a blob, one to one within each view, and the blobs' px."""
    rows, xy, start = [], [], 0
    for view in views:
        own = at[start : start + len(view.points)]
        column = one_to_one(np.linalg.norm(own[:, None] - view.blobs[None], axis=-1))
        row = np.flatnonzero(column >= 0)
        rows.append(row + start)
        xy.append(view.blobs[column[row]])
        start += len(view.points)
    return np.concatenate(rows), np.concatenate(xy)


def _paired(points: Array, views: Sequence[View], at: Array) -> tuple[Index, Array]:
    """Points and px of the pairs that an affine start makes, without the worst fifth."""
    row, xy = _assigned(at, views)
    error = np.linalg.norm(xy - at[row], axis=-1)
    good = error <= np.quantile(error, 0.8)
    return np.concatenate([view.points for view in views])[row[good]], xy[good]


def _matched(labels: Labels) -> tuple[Index, Array]:
    pairs = [(view.points[b >= 0], view.blobs[b[b >= 0]]) for view, b in zip(labels.views, labels.blob, strict=True)]
    return np.concatenate([p for p, _ in pairs]), np.concatenate([xy for _, xy in pairs])


def _sum_of_squares(labels: Labels) -> float:
    at = np.concatenate([b[blob >= 0] for b, blob in zip(labels.projected, labels.blob, strict=True)])
    return float(((_matched(labels)[1] - at) ** 2).sum())


def _agreement(labels: Labels, point: Index, xy: Array) -> float:
    """Share of pairs (point, px) that the labels have too."""
    theirs, there = _matched(labels)
    pairs = {(int(i), *b) for i, b in zip(theirs, there.tolist(), strict=True)}
    return sum((int(i), *b) in pairs for i, b in zip(point, xy.tolist(), strict=True)) / len(point)
