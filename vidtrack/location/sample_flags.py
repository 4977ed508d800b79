"""The flag of every sample of a trajectory: why it has no fix, and what each camera's tracker said of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Bools
from vidtrack.geometry.triangulate import Located
from vidtrack.location.cameras.views import Labels, Seen, View, flags_by_trajectory, joined, with_word
from vidtrack.location.matching import Match


def sample_flags(
    views: Sequence[View],
    seen: Sequence[Seen],
    match: Match,
    located: Located,
    max_miss: float | None,
    unseen: Sequence[Bools],
) -> Labels:
    """Flags (m, M) of m trajectories at M moments: the fix first, then camera by camera (cam1:edge).

    unseen   (m, M) of each camera: it followed nothing near a place that it should see

    lost: fewer than two cameras saw the target; parallel: lines of sight that are nearly parallel, or meet behind a
    camera; disagree: they do not meet; far: they miss the point by more than max_miss, world units
    """
    flag = np.full(located.miss.shape, "", object)
    lost = np.isnan(located.point[..., 0])
    flag[lost] = "lost"
    flag[lost & (np.isfinite(located.error[..., 0]).sum(0) >= 2)] = "parallel"
    flag[located.disagree] = "disagree"
    if max_miss is not None:
        flag[located.miss > max_miss] = "far"
    views_and_tracks = zip(views, seen, match.trajectory, match.reason, located.left_out, unseen, strict=True)
    for view, s, trajectory, reason, left_out, nothing in views_and_tracks:
        contested = np.append(reason == "contested", False)[s.piece]
        with_contested = np.where(contested, joined(s.flag, np.full(s.flag.shape, "contested", object)), s.flag)
        own = flags_by_trajectory(s._replace(flag=with_contested), trajectory, len(flag))
        own[left_out] = joined(own[left_out], np.full(int(left_out.sum()), "left_out", object))
        own[nothing & (own == "")] = "unseen"
        said = own != ""
        texts = [";".join(f"{view.name}:{part}" for part in dict.fromkeys(x.split(";"))) for x in own[said]]
        flag[said] = joined(flag[said], np.array(texts, object))
    return with_word(flag, match.open, "ambiguous")
