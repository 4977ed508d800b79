"""A glance at all targets, and a look at those that a glance does not tell in the first of the samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.detection import Detection
from vidtrack.glance import glance
from vidtrack.look import Seen, look
from vidtrack.sample import Sample

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

ALIKE_PX = 2.0
"""Targets whose half axes differ by less than this share a mask."""


def watch(samples: Sequence[Sample], predicted: Array, *, looks: Array, threshold: Array, detection: Detection) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields).

    predicted  (k, n, 2) px where each should be; threshold (n,) grey levels on pictures turned bright
    looks      (6, n) pixels, contrast, background, width, height (rows of the sample), soft edge when last seen; where
               the soft edge is not known (NaN) there is a look at once
    What is unclear in a later sample may only be mispredicted: the caller watches again from there.
    """
    pixels, size, soft = looks[0], looks[3:5].T, looks[5]
    kinds = _kinds(size, soft) if detection.centroid == "weighted" else np.full(pixels.size, -1)
    if kinds.min() == kinds.max():
        return _watch_kind(samples, predicted, int(kinds[0]), pixels, size, soft, threshold, detection)
    k, n = predicted.shape[:2]
    seen = Seen(np.empty((11, k, n)), np.empty((k, n), bool), np.empty((k, n), bool))
    for kind in np.unique(kinds):
        some = np.flatnonzero(kinds == kind)
        one, wide, edge, level = pixels[some], size[some], soft[some], threshold[some]
        _fill(seen, some, _watch_kind(samples, predicted[:, some], int(kind), one, wide, edge, level, detection))
    return seen


def _watch_kind(
    samples: Sequence[Sample],
    predicted: Array,
    kind: int,
    pixels: Array,
    size: Array,
    soft: Array,
    threshold: Array,
    detection: Detection,
) -> Seen:
    if kind < 0:
        return look(samples, predicted, size=size, pixels=pixels, threshold=threshold, detection=detection)
    seen = glance(samples, predicted, size=size, soft=soft, pixels=pixels, threshold=threshold, detection=detection)
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
    steps = np.floor((half - np.median(half[known], axis=0)) / ALIKE_PX + 0.5).astype(np.intp)
    return np.where(known, steps[:, 0] * 1000 + steps[:, 1], -1)
