"""Which tracks of a run are one target, by the names that the user gave them or else along epipolar lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.location.correspondence import NONE, Correspondence, by_target, match_errors, match_tracks
from vidtrack.location.views import Seen, View


def matched(
    views: Sequence[View],
    seen: Sequence[Seen],
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    findings: list[Finding],
) -> tuple[Correspondence, list[str]]:
    """Which tracks are one target, and the targets' names; what is doubtful is added to the findings."""
    cameras, tracks = [v.camera for v in views], [s.b for s in seen]
    same = _by_name(views, tracks, names)
    if same is not None and not (same.error_px > tolerance_px).any():
        return same, [n for n in names or [] if any(n in v.tracks for v in views)]
    match = match_tracks(cameras, tracks, tolerance_px=tolerance_px, targets=limit)
    if same is not None:
        if len(match.error_px) < len(same.error_px) or match.ambiguous.any():
            return _only_choice(same, tolerance_px, findings), list(names or [])
        findings.append(_exchanged(views, same, match, _labels(views, match, names)))
    if not len(match.error_px) and all(len(v.tracks) == 1 for v in views):
        # one target in every camera: there is nothing else that it could be
        target = tuple(np.zeros(1, np.intp) for _ in views)
        error = match_errors(cameras, tracks)
        alone = Correspondence(target, error, np.full(1, np.inf), np.zeros(1, bool), np.zeros(1, np.intp))
        return _only_choice(alone, tolerance_px, findings), _labels(views, alone, names)
    return match, _labels(views, match, names)


def _only_choice(match: Correspondence, tolerance_px: float, findings: list[Finding]) -> Correspondence:
    """A match by name or number that the epipolar lines contradict, for want of another."""
    never = int(np.isnan(match.error_px).sum())
    if never:
        text = f"{never} of {len(match.error_px)} targets: no two cameras saw them at one moment"
        findings.append(Finding("bad", "never-seen-together", text, "See in the tracks when each camera saw them."))
    worst = float(np.nanmax(match.error_px, initial=0.0))
    if worst > tolerance_px:
        text = (
            f"targets are matched by name or number alone: their tracks lie {worst:.3g} px rms off each other's "
            f"epipolar lines (limit {tolerance_px:g} px)"
        )
        cure = "Positions that rest on two cameras are not believed where these disagree; see what would explain it."
        findings.append(Finding("bad", "match-contradicted", text, cure))
    return match


def _exchanged(views: Sequence[View], same: Correspondence, match: Correspondence, labels: Sequence[str]) -> Finding:
    """Which names mean another target than in most cameras."""
    wrong = []
    for view, target in zip(views, match.target, strict=True):
        others = [v for v in views if v is not view]
        for track, k in zip(view.tracks, target, strict=True):
            if k != NONE and labels[k] != track:
                fellows = [
                    f"{v.name}'s {v.tracks[i]}"
                    for v, t in zip(views, match.target, strict=True)
                    if v in others
                    for i in np.flatnonzero(t == k)
                ]
                wrong.append(f"{view.name}'s {track} is {' and '.join(fellows)}")
    text = (
        f"targets.csv: names do not agree between cameras: {'; '.join(wrong[:6])}. As named, tracks lie up to "
        f"{float(np.nanmax(same.error_px, initial=0.0)):.3g} px rms off each other's epipolar lines; so matched, "
        f"{float(np.nanmax(match.error_px, initial=0.0)):.3g} px. The latter is used"
    )
    return Finding("doubtful", "names-exchanged", text, "Correct the names in targets.csv.")


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
        named = [n for n in own if names is not None and n in names]
        wanted = sorted(named, key=lambda n: -named.count(n)) + own  # the name that most cameras give it
        free = [n for n in wanted if n not in labels] or [f"t{i}" for i in range(1, k + 2) if f"t{i}" not in labels]
        labels.append(free[0])
    return labels
