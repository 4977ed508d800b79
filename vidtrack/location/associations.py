"""The tracklets of all cameras as a table: of which target each is, how surely, and what the next best choice was."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vidtrack.association.associate import NONE, Ties
from vidtrack.location.cameras.views import View
from vidtrack.location.locate_record import odds_of
from vidtrack.location.matching import Match

COLUMNS = {
    "camera": "",
    "tracklet": "",  # its number in the camera's table of tracklets; -1: none, the centroid table alone shows it
    "track": "",  # name of the target that the tracker took it for; empty: none
    "start_s": "s",  # by the camera's own clock
    "end_s": "s",
    "samples": "",
    "target": "",  # that it was found to be of; empty: none
    "reason": "",  # why it belongs to none
    "odds": "",  # times likelier, at its least sure join, than the next best choice; NaN: names decide, or no join
    "joined_with": "",  # camera and number of the tracklet that it was joined with there
    "runner_up": "",  # of that which the next best choice would join with one of the two
}
"""Columns of associations.parquet and their units, one row a tracklet."""


def association_columns(views: Sequence[View], match: Match) -> dict[str, Any]:
    """COLUMNS, by camera and then by start."""
    parts = []
    for i, view in enumerate(views):
        track, sample = np.nonzero(view.piece != NONE)
        piece = view.piece[track, sample]
        n = view.n_pieces
        start, end = np.full(n, np.inf), np.full(n, -np.inf)
        np.minimum.at(start, piece, view.t[sample])
        np.maximum.at(end, piece, view.t[sample])
        of = np.zeros(n, np.intp)
        of[piece] = track
        own = match.trajectory[i]
        parts.append(
            {
                "camera": np.full(n, view.name, object),
                "tracklet": view.number,
                "track": np.array(view.tracks, object)[of],
                "start_s": start,
                "end_s": end,
                "samples": np.bincount(piece, minlength=n),
                "target": np.array([*match.labels, ""], object)[own],
                "reason": match.reason[i],
                **_tied(views, match.ties[i] if match.ties else None, own),
            }
        )
        order = np.argsort(start, kind="stable")
        parts[-1] = {name: np.asarray(values)[order] for name, values in parts[-1].items()}
    return {name: np.concatenate([part[name] for part in parts]) for name in COLUMNS}


def _tied(views: Sequence[View], ties: Ties | None, own: Any) -> dict[str, Any]:
    n = len(own)
    if ties is None:
        return {"odds": np.full(n, np.nan)} | dict.fromkeys(("joined_with", "runner_up"), np.full(n, "", object))
    odds = np.array([odds_of(lead) if lead == lead else np.nan for lead in ties.lead.tolist()], float)
    names = {"joined_with": ties.fellow, "runner_up": ties.rival}
    return {"odds": odds} | {
        word: np.array(
            [f"{views[c].name}:{views[c].number[k]}" if c != NONE else "" for c, k in pairs.tolist()], object
        )
        for word, pairs in names.items()
    }
