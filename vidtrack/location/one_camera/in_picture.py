"""One camera's targets, by the motion of its tracklets in the picture: what mode plane locates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.association.associate import associate_in_picture
from vidtrack.findings import Finding
from vidtrack.location.accepted import rows_kept
from vidtrack.location.cameras.views import (
    Labels,
    View,
    brought,
    by_trajectory,
    flags_by_trajectory,
    tracklets_seen,
    with_word,
)
from vidtrack.location.matching import Match, labels_of

LASTING = 30
"""Samples of something followed besides the targets, at least, to be reported."""


class InPicture(NamedTuple):
    """m targets at T moments."""

    labels: list[str]
    b: Array  # (m, T, 2) px; NaN where a target was not measured
    sd: Array  # (m, T, 2) px; NaN where it is not known
    flag: Labels  # (m, T)
    kept: Bools  # (m, T) moments for which a target has a row
    match: Match


def followed_in_picture(view: View, names: list[str] | None, limit: int | None, *, whole: bool) -> InPicture:
    """The targets of a view; names, limit as for `matched`.

    whole   a target has rows at all moments; else from the first at which it is measured to the last
    """
    seen = brought(view, view.t, view.t)
    tracklets, number = tracklets_seen(seen)
    given = np.array(view.given, object)[number].tolist()
    found = associate_in_picture(tracklets, targets=limit, names=given)
    labels = labels_of([view], [seen], found.trajectory, found.part_of, names)
    m = len(labels)
    match = Match(
        labels,
        found.trajectory,
        found.reason,
        np.full(m, np.nan),
        found.lead,
        np.bincount(found.trajectory[0][found.trajectory[0] >= 0], minlength=m),
        float("nan"),
        found.part_of,
        found.left,
        found.ties,
    )
    b = by_trajectory(seen.b, seen.piece, found.trajectory[0], m)
    sd = by_trajectory(seen.sd, seen.piece, found.trajectory[0], m) if view.has_sd else np.full(b.shape, np.nan)
    flag = flags_by_trajectory(seen, found.trajectory[0], m)
    flag[np.isnan(b[..., 0]) & (flag == "")] = "lost"
    flag = with_word(flag, match.open, "ambiguous")
    return InPicture(labels, b, sd, flag, rows_kept(b, match.open | (not whole)), match)


def findings_of_picture(view: View, found: InPicture, limit: int | None) -> list[Finding]:
    """Whose tracks were put together from several, and what is open."""
    out = []
    for k, several in enumerate(found.match.part_of):
        if several:
            moments = view.t[np.isfinite(found.b[k, :, 0])]
            names = " or ".join(found.labels[j] for j in several)
            text = f"from {moments[0]:.3f} to {moments[-1]:.3f} s nothing shows whether {found.labels[k]} is {names}"
            out.append(
                Finding("doubtful", "identity-open", text, "Place start boxes where it begins, or add a camera.")
            )
    more = [own for own in found.match.left if own.n >= LASTING]
    if limit is not None and more:
        places = "; ".join(
            f"{view.t[own.first]:.2f} to {view.t[own.last]:.2f} s about ({own.place[0]:.0f}, {own.place[1]:.0f}) px"
            for own in more[:5]
        )
        text = f"{limit + len(more)} things are followed where {limit} were asked for; besides these: {places}"
        cure = "Set targets to all to have every one of them, or place start boxes on those that are meant."
        out.append(Finding("note", "more-targets-located", text, cure))
    return out
