"""A glance at all targets, and a look at those that a glance does not tell in the first of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.measurement.template import Known, glance
from vidtrack.tracking.measurement.window import VALUES, Seen, look
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.settings import Detection

ALIKE_PX = 2.0
"""Targets whose half axes differ by less than this share a mask."""


def watch(
    samples: Sequence[Sample],
    predicted: Array,
    *,
    looks: Array,
    threshold: Array,
    detection: Detection,
    careful: bool = True,
) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields).

    predicted  (k, n, 2) px where each should be; threshold (n,) grey levels on pictures turned bright
    looks      (8, n) pixels, contrast, background, width, height (rows of the sample), soft edge, unrest and plateau
               when last seen; where the soft edge is not known (NaN) there is a look at once
    careful    whether a glance measures the unrest of the background, or takes it as it was
    What is unclear in a later sample may only be mispredicted: the caller watches again from there.
    """
    size, soft = looks[3:5].T, looks[5]
    kinds = _kinds(size, soft) if detection.centroid == "weighted" else np.full(soft.size, -1)
    if kinds.min() == kinds.max():
        return _watch_kind(samples, predicted, int(kinds[0]), looks, threshold, detection, careful)
    k, n = predicted.shape[:2]
    seen = Seen(np.empty((VALUES, k, n)), np.empty((k, n), bool), np.empty((k, n), bool))
    for kind in np.unique(kinds):
        some = np.flatnonzero(kinds == kind)
        part = _watch_kind(samples, predicted[:, some], int(kind), looks[:, some], threshold[some], detection, careful)
        _fill(seen, some, part)
    return seen


def _watch_kind(
    samples: Sequence[Sample],
    predicted: Array,
    kind: int,
    looks: Array,
    threshold: Array,
    detection: Detection,
    careful: bool,
) -> Seen:
    pixels, size, soft, unrest = looks[0], looks[3:5].T, looks[5], looks[6]
    if kind < 0:
        return look(samples, predicted, size=size, pixels=pixels, threshold=threshold, detection=detection)
    seen = glance(samples, predicted, Known(size, soft, unrest, pixels, threshold), detection, careful)
    unclear = np.flatnonzero(~seen.clear[0])
    if unclear.size:
        settings = {"size": size[unclear], "pixels": pixels[unclear], "threshold": threshold[unclear]}
        _fill(seen, unclear, look(samples, predicted[:, unclear], **settings, detection=detection))
    return seen


def _fill(seen: Seen, some: Ints, part: Seen) -> None:
    """Put some of the targets in."""
    whole: Any
    for whole, piece in zip(seen, part, strict=True):
        whole[..., some] = piece


def _kinds(size: Array, soft: Array) -> Ints:
    """Targets of one kind share a mask, 0 most of them; -1 where the soft edge is not known yet."""
    known = np.isfinite(soft)
    if not known.any():
        return np.full(soft.size, -1)
    half = np.where(known[:, None], size / 2 + soft[:, None], 0.0)
    if known.all() and (half.max(axis=0) - half.min(axis=0) < ALIKE_PX).all():
        return np.zeros(soft.size, np.intp)
    steps = np.floor((half - np.median(half[known], axis=0)) / ALIKE_PX + 0.5).astype(np.intp)
    return np.where(known, steps[:, 0] * 1000 + steps[:, 1], -1)
