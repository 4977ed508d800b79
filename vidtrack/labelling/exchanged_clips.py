"""Clips that have each other's tags: recordings in each other's folders, or tags written to the wrong clip.

Where the balls of a camera are not named beyond doubt, two clips of as many tags are exchanged. If they are named then,
and the picks agree, that is the cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.labelling.configuration import label_with
from vidtrack.labelling.label import Labels, View, complete
from vidtrack.labelling.naming_doubts import LEAST_PICKS, Case, settled
from vidtrack.labelling.seeds import label_from_picks, on_one_line

POOR = 0.5
"""Share of a clip's balls that are found, below which it may show another's, where the others name the balls."""

SHARE = 0.9
"""Of the balls that should be seen, those that must be found with the clips exchanged: nothing else is wrong then."""


def settled_or_exchanged(case: Case, answers: Sequence[Labels]) -> Labels:
    """The one answer that is reliable; see `settled`.

    Raises VidtrackError, one line: which clips are exchanged, where that alone makes the names sure, else why not.
    """
    try:
        labels = settled(case, answers)
    except VidtrackError:
        if line := exchanged(case):
            raise VidtrackError(line) from None
        raise
    poor = [
        i for i, blob in enumerate(labels.blob) if (blob >= 0).sum() < POOR * min(len(blob), len(labels.views[i].blobs))
    ]
    if len(poor) > 1 and not complete(labels, case.picks) and (line := exchanged(case)):
        raise VidtrackError(line)
    return labels


def exchanged(case: Case) -> str:
    """Which clips have each other's tags; empty where exchanging them does not make the names sure."""
    for order in _orders(case.views):
        views = [view._replace(points=case.views[k].points) for view, k in zip(case.views, order, strict=True)]
        other = case._replace(views=views, picks=case.picks._replace(view=_view_of(case, views)))
        answers = _named(other)
        if len(answers) == 1 and complete(answers[0], other.picks) and answers[0].share_found(other.picks) > SHARE:
            return _line(case, order, answers[0])
    return ""


def _line(case: Case, order: Sequence[int], labels: Labels) -> str:
    moved = [i for i, k in enumerate(order) if i != k]
    has = ", ".join(f"clip {case.clips[i]} shows the tags of clip {case.clips[order[i]]}" for i in moved)
    return (
        f"calibration: camera {case.camera}: {has}: so taken, {labels.matched} of {labels.expected} balls lie where "
        "they should. Exchange their recordings, or calibration.clips.<clip>.tags where every camera says so."
    )


def _orders(views: Sequence[View]) -> Iterator[tuple[int, ...]]:
    """Ways to give two clips each other's tags, where they have as many."""
    for i, j in combinations(range(len(views)), 2):
        if len(views[i].points) == len(views[j].points):
            order = [*range(len(views))]
            order[i], order[j] = j, i
            yield tuple(order)


def _named(case: Case) -> list[Labels]:
    """From picks alone where they are enough: to do without them takes a hundred times as long."""
    if len(case.picks.point) >= LEAST_PICKS and not on_one_line(case.points[case.picks.point]):
        return label_from_picks(case.points, case.views, case.picks, case.image_size)
    return label_with(case.points, case.views, case.picks, case.image_size)


def _view_of(case: Case, views: Sequence[View]) -> np.ndarray:
    """The view that shows the point of each pick, where the recordings were exchanged and the picks went with them."""
    own = case.picks.view.copy()
    for i, point in enumerate(case.picks.point):
        if point not in views[own[i]].points:
            own[i] = next((v for v, view in enumerate(views) if point in view.points), own[i])
    return own
