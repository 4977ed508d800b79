"""Measure each target with the linear template; where the template is not valid, segment its window instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.centroiding.template import Known, apply_template
from vidtrack.tracking.centroiding.window import Seen, segment_windows
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import HEIGHT, VALUES, WIDTH, Appearance


@dataclass(frozen=True)
class Sharing:
    """Which targets share a template.

    alike_px  half axes that differ by less share a mask
    """

    alike_px: float = 2.0


SHARING = Sharing()


def measure_targets(
    samples: Sequence[Sample],
    predicted: Array,
    *,
    appearance: Appearance,
    threshold: Array,
    detection: Detection,
    careful: bool = True,
) -> Seen:
    """Measure n targets in k samples of one kind (frames or fields).

    predicted   (k, n, 2) px where each should be; threshold (n,) grey levels on pictures turned bright
    appearance  of the targets when last seen; where the soft edge is not known (NaN) windows are segmented
    careful     whether a template measures the unrest of the background, or takes it as it was
    What is unclear in a later sample may only be mispredicted: the caller measures again from there.
    """
    size, soft = appearance.size.T, appearance.soft
    kinds = _kinds(size, soft) if detection.centroid == "weighted" else np.full(soft.size, -1)
    if kinds.min() == kinds.max():
        return _measure_kind(samples, predicted, int(kinds[0]), appearance, threshold, detection, careful)
    parts = []
    for kind in np.unique(kinds):
        some = np.flatnonzero(kinds == kind)
        of, level = appearance.of(some), threshold[some]
        parts.append((some, _measure_kind(samples, predicted[:, some], int(kind), of, level, detection, careful)))
    k, n = predicted.shape[:2]
    return _joined(Seen(np.empty((VALUES, k, n)), np.empty((k, n), bool), np.empty((k, n), bool)), parts)


def with_shapes(
    seen: Seen, which: Ints, samples: Sequence[Sample], predicted: Array, known: Appearance, level: Array, d: Detection
) -> Array:
    """Values (VALUES, k, n) of what was seen, those of `which` with width and height as segmented; NaN where unclear.

    A template measures no shape. known, level, d  as appearance, threshold and detection of `measure_targets`
    """
    of = known.of(which)
    where, size = predicted[:, which], of.size.T
    part = segment_windows(samples, where, size=size, pixels=of.pixels, threshold=level[which], detection=d)
    values = seen.values.copy()
    values[WIDTH : HEIGHT + 1, :, which] = np.where(part.clear, part.values[WIDTH : HEIGHT + 1], np.nan)
    return values


def _measure_kind(
    samples: Sequence[Sample],
    predicted: Array,
    kind: int,
    appearance: Appearance,
    threshold: Array,
    detection: Detection,
    careful: bool,
) -> Seen:
    size, pixels = appearance.size.T, appearance.pixels
    if kind < 0:
        return segment_windows(samples, predicted, size=size, pixels=pixels, threshold=threshold, detection=detection)
    known = Known(size, appearance.soft, appearance.unrest, pixels, threshold)
    seen = apply_template(samples, predicted, known, detection, careful)
    unclear = np.flatnonzero(~seen.clear[0])
    if not unclear.size:
        return seen
    settings = {"size": size[unclear], "pixels": pixels[unclear], "threshold": threshold[unclear]}
    segmented = segment_windows(samples, predicted[:, unclear], **settings, detection=detection)
    return _joined(seen, [(unclear, segmented)])


def _joined(whole: Seen, parts: Sequence[tuple[Ints, Seen]]) -> Seen:
    """The whole with some of its targets replaced by parts."""
    new = Seen._make(values.copy() for values in whole)
    for some, part in parts:
        for values, piece in zip(new, part, strict=True):
            values[..., some] = piece
    return new


def _kinds(size: Array, soft: Array) -> Ints:
    """Targets of one kind share a mask, numbers from 0; -1 where the soft edge is not known yet."""
    known = np.isfinite(soft)
    if not known.any():
        return np.full(soft.size, -1)
    half = np.where(known[:, None], size / 2 + soft[:, None], 0.0)
    if known.all() and (half.max(axis=0) - half.min(axis=0) < SHARING.alike_px).all():
        return np.zeros(soft.size, np.intp)
    steps = np.floor((half - np.median(half[known], axis=0)) / SHARING.alike_px + 0.5)
    _, kinds = np.unique(steps, axis=0, return_inverse=True)
    return np.where(known, kinds.ravel(), -1)
