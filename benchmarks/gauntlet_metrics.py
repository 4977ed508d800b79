"""What trajectories are worth against the truth: share located, IDF1, HOTA, false fixes.

A fix is right where it is within the gate of a target, one to one at each moment (Hungarian method). Moments at which
fewer than two cameras measured a target alone count neither for nor against. IDF1: Ristani 2016; HOTA: Luiten 2021, at
one gate, as a right fix here is nearer by far than any gate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vidtrack.arrays import Array, Bools


class Counts(NamedTuple):
    """What sums over scenes."""

    wanted: int  # samples that two cameras saw
    located: int  # of those, with a fix within the gate
    fixes: int
    false: int  # fixes farther than five sigma, in any coordinate, from every target
    id_true: int  # samples on the identity that fits best
    id_missed: int
    id_false: int
    hota: float  # of one scene; the mean of several

    @property
    def share(self) -> float:
        """Share located."""
        return self.located / max(self.wanted, 1)

    @property
    def idf1(self) -> float:
        """IDF1, 1 where there is nothing to find and nothing was found."""
        whole = 2 * self.id_true + self.id_missed + self.id_false
        return 2 * self.id_true / whole if whole else 1.0


class Matched(NamedTuple):
    """At which moments a fix is which target's: rows of equal length."""

    target: Array
    fix: Array
    moment: Array


def counted(truth: Array, wanted: Bools, present: Bools, fix: Array, sigma: Array, gate: float) -> Counts:
    """Counts of fix and sigma (m, M, 3) against truth (K, M, 3); wanted, present (K, M); gate in the world."""
    found = np.isfinite(fix[..., 0])
    distance = _distances(truth, present, fix)  # (M, K, m)
    right = _right(distance, gate)
    is_wanted = wanted.T[right.moment.astype(int), right.target.astype(int)]
    located = int(is_wanted.sum())
    K, m = len(truth), len(fix)
    pairs = np.zeros((K, m))
    np.add.at(pairs, (right.target[is_wanted].astype(int), right.fix[is_wanted].astype(int)), 1)
    spared = ~is_wanted  # right, where nothing was wanted
    predicted = found.sum(-1) - np.bincount(right.fix[spared].astype(int), minlength=m)
    k, j = linear_sum_assignment(-pairs) if pairs.size else ([], [])
    id_true = int(pairs[k, j].sum())
    total = int(wanted.sum())
    false = _false(truth, present, fix, sigma)
    return Counts(
        total,
        located,
        int(found.sum()),
        false,
        id_true,
        total - id_true,
        int(predicted.sum()) - id_true,
        _hota(pairs, wanted.sum(-1), predicted),
    )


def _distances(truth: Array, present: Bools, fix: Array) -> Array:
    d = np.linalg.norm(truth.transpose(1, 0, 2)[:, :, None] - fix.transpose(1, 0, 2)[:, None], axis=-1)
    d[~present.T] = np.inf
    return np.where(np.isfinite(d), d, np.inf)


def _right(distance: Array, gate: float) -> Matched:
    """Pairs within the gate, one to one at each moment, those nearest first in total."""
    rows: list[tuple[Array, Array, Array]] = []
    for moment, d in enumerate(distance):
        near = d <= gate
        if not near.any():
            continue
        if (near.sum(0) <= 1).all() and (near.sum(1) <= 1).all():
            k, j = np.nonzero(near)
        else:
            k, j = linear_sum_assignment(np.where(near, d - 2 * gate, 0.0))
            k, j = k[near[k, j]], j[near[k, j]]
        rows.append((k, j, np.full(len(k), moment)))
    if not rows:
        return Matched(np.zeros(0), np.zeros(0), np.zeros(0))
    return Matched(*(np.concatenate(column).astype(float) for column in zip(*rows, strict=True)))


def _false(truth: Array, present: Bools, fix: Array, sigma: Array) -> int:
    """Fixes beyond five sigma, in any coordinate, of every target that is there."""
    j, moment = np.nonzero(np.isfinite(fix[..., 0]))
    bad = np.ones(j.size, bool)
    for k in range(len(truth)):
        e = np.abs(fix[j, moment] - truth[k, moment]) / sigma[j, moment]
        bad &= ~((e <= 5).all(-1) & present[k, moment])
    return int(bad.sum())


def _hota(pairs: Array, wanted: Array, predicted: Array) -> float:
    both = pairs.sum()
    if not wanted.sum() + predicted.sum():
        return 1.0
    union = wanted[:, None] + predicted[None] - pairs
    association = float((pairs * pairs / np.maximum(union, 1)).sum())
    return float(np.sqrt(association / (wanted.sum() + predicted.sum() - both)))


def together(counts: list[Counts]) -> Counts:
    """The sum over scenes."""
    columns = list(zip(*counts, strict=True))
    return Counts(*(int(sum(column)) for column in columns[:-1]), float(np.mean(columns[-1])))
