"""Which tracks of a run are one target, by the names that the user gave them or else along epipolar lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.location.correspondence import Correspondence, by_target, match_errors, match_tracks
from vidtrack.location.views import Seen, View


def matched(
    views: Sequence[View],
    seen: Sequence[Seen],
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    warnings: list[str],
) -> tuple[Correspondence, list[str]]:
    """Which tracks are one target, and the targets' names."""
    cameras, tracks = [v.camera for v in views], [s.b for s in seen]
    same = _by_name(views, tracks, names)
    if same is not None and not (same.error_px > tolerance_px).any():
        return same, [n for n in names or [] if any(n in v.tracks for v in views)]
    match = match_tracks(cameras, tracks, tolerance_px=tolerance_px, targets=limit)
    if same is not None:
        if len(match.error_px) < len(same.error_px) or match.ambiguous.any():
            return _only_choice(same, same.error_px, tolerance_px, warnings), list(names or [])
        warnings.append("targets: the names do not agree between cameras; matched along epipolar lines instead.")
    if not len(match.error_px) and all(len(v.tracks) == 1 for v in views):
        # one target in every camera: there is nothing else that it could be
        target = tuple(np.zeros(1, np.intp) for _ in views)
        error = match_errors(cameras, tracks)
        alone = Correspondence(target, error, np.full(1, np.inf), np.zeros(1, bool), np.zeros(1, np.intp))
        return _only_choice(alone, error, tolerance_px, warnings), _labels(views, alone, names)
    return match, _labels(views, match, names)


def _only_choice(match: Correspondence, error: Array, tolerance_px: float, warnings: list[str]) -> Correspondence:
    worst = float(np.nanmax(error, initial=0.0))
    warnings.append(
        f"targets: matched by name or number, but {worst:.3g} px rms off their epipolar lines (tolerance "
        f"{tolerance_px:g} px). Check the calibration and the cameras' clocks."
    )
    return match


def _by_name(views: Sequence[View], tracks: Sequence[Array], names: list[str] | None) -> Correspondence | None:
    """The correspondence that the names tell, where the user gave them and every track bears one."""
    if names is None or not all(set(v.tracks) <= set(names) for v in views):
        return None
    shown = [n for n in names if any(n in v.tracks for v in views)]
    target = tuple(np.array([shown.index(n) for n in v.tracks], np.intp) for v in views)
    seen = [by_target(b, t, len(shown)) for b, t in zip(tracks, target, strict=True)]
    common = (np.sum([np.isfinite(b[..., 0]) for b in seen], 0) >= 2).sum(-1)
    nobody = np.full(len(shown), np.inf)
    errors = match_errors([v.camera for v in views], seen)
    return Correspondence(target, errors, nobody, np.zeros(len(shown), bool), common)


def _labels(views: Sequence[View], match: Correspondence, names: list[str] | None) -> list[str]:
    """Each target's name: the user's where a track bears one, else its track's in the first camera that shows it."""
    labels: list[str] = []
    for k in range(len(match.error_px)):
        own = [v.tracks[i] for v, t in zip(views, match.target, strict=True) for i in np.flatnonzero(t == k)]
        wanted = [n for n in own if names is not None and n in names] + own
        free = [n for n in wanted if n not in labels] or [f"t{i}" for i in range(1, k + 2) if f"t{i}" not in labels]
        labels.append(free[0])
    return labels
