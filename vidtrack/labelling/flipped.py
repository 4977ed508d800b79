"""A clip whose pictures are mirrored or upside down while those of the other clips are not."""

from __future__ import annotations

import numpy as np

from vidtrack.assignment import one_to_one_within
from vidtrack.labelling.label import GATE, Labels, px_apart

WAYS = {
    "mirrored left to right": (-1, 1),
    "mirrored top to bottom": (1, -1),
    "turned upside down": (-1, -1),
}

FEWEST, MOST_AS_IT_IS, LEAST_FLIPPED = 4, 0.5, 0.7
"""Balls that a clip should show, and the shares of them that are found as it is, at most, and flipped, at least."""


def flipped(labels: Labels, i: int, size: tuple[int, int]) -> str | None:
    """How view i of a picture of that size (columns, rows) is flipped, one of WAYS; None where it is not.

    Flipped back, most of the balls lie where the other views put them, and as it is few do.
    """
    view, at = labels.views[i], labels.projected[i]
    seen = np.isfinite(at).all(-1).sum()
    if seen < FEWEST or (labels.blob[i] >= 0).sum() > MOST_AS_IT_IS * seen or not len(view.blobs):
        return None
    last = np.array(size) - 1.0
    for name, sign in WAYS.items():
        back = np.where(np.array(sign) < 0, last - view.blobs, view.blobs)
        if (one_to_one_within(px_apart(at, back), 2 * GATE * labels.sd) >= 0).sum() > LEAST_FLIPPED * seen:
            return name
    return None
