"""Which views of a board are used, and what the cameras see in them as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.boards.board_corners import Seen
from vidtrack.errors import VidtrackError

MOST_VIEWS = 40
"""Views of a camera that are used: more add little but time."""
LEAST_CORNERS = 6
"""Corners of a view below which it says nothing but where the board is."""
BLURRED = 3.0
"""Times the camera's median sd of a view's corners beyond which it is too blurred to help."""

View = tuple[str, int]
"""Clip and frame."""
Views = Mapping[View, Seen]
"""What one camera saw of the board, by view."""


def chosen_views(
    corners: Mapping[str, Views], sizes: Mapping[str, tuple[int, int]]
) -> tuple[list[View], dict[str, dict[str, int]]]:
    """The views that are used: for each camera sharp ones, spread farthest; and how many were not, and why.

    corners  by camera: its views
    sizes    by camera: px, (width, height)
    """
    chosen: dict[View, None] = {}
    left_out = {}
    seen_by: dict[View, int] = {}
    for seen in corners.values():
        for view in seen:
            seen_by[view] = seen_by.get(view, 0) + 1
    for name, seen in corners.items():
        width, height = sizes[name]
        views = []
        for view, own in seen.items():
            b = own.b
            if len(b) < LEAST_CORNERS:
                continue
            C = np.cov(b.T)
            size = np.sqrt(max(np.linalg.det(C), 1e-9)) / (width * height) * 20
            shape = [C[0, 0] - C[1, 1], 2 * C[0, 1]] / max(np.trace(C), 1e-9)
            features = np.array([*(b.mean(0) / (width, height)), np.log(size) / 3, *shape])
            views.append((view, float(np.median(own.sd)), len(b), features))
        if not views:
            left_out[name] = {"blurred": 0, "like_others": 0}
            continue
        limit = BLURRED * float(np.median([sd for _, sd, _, _ in views]))
        sharp = [each for each in views if each[1] <= limit]
        picked = _spread([v[3] for v in sharp], [v[2] * seen_by[v[0]] for v in sharp], MOST_VIEWS)
        chosen |= dict.fromkeys(sharp[i][0] for i in picked)
        left_out[name] = {"blurred": len(views) - len(sharp), "like_others": len(sharp) - len(picked)}
    return sorted(chosen), left_out


def _spread(features: Sequence[Array], weight: Sequence[int], most: int) -> list[int]:
    """Indices of at most so many, each the farthest from those before it; the first has most corners and cameras."""
    if not features:
        return []
    F, w = np.array(features), np.sqrt(np.array(weight, float) / max(weight))
    picked = [int(np.argmax(weight))]
    distance = np.linalg.norm(F - F[picked[0]], axis=-1)
    while len(picked) < min(most, len(F)):
        best = int(np.argmax(distance * w))
        if distance[best] <= 1e-3:
            break
        picked.append(best)
        distance = np.minimum(distance, np.linalg.norm(F - F[best], axis=-1))
    return picked


def corner_arrays(
    corners: Mapping[str, Views], names: Sequence[str], views: Sequence[View], q: int
) -> tuple[Array, Array]:
    """Where each camera sees each of q corners in each view (m, n, q, 2) px, NaN where it does not, and its sd."""
    place = {view: k for k, view in enumerate(views)}
    b, sd = np.full((len(names), len(views), q, 2), np.nan), np.full((len(names), len(views), q), 1.0)
    for i, name in enumerate(names):
        for view, own in corners[name].items():
            if view in place:
                good = own.ids < q
                b[i, place[view], own.ids[good]] = own.b[good]
                sd[i, place[view], own.ids[good]] = own.sd[good]
    return b, sd


def world_view(b: Array, views: Sequence[View], world: str | None) -> int:
    """The view that is the world."""
    counts = np.isfinite(b).all(-1).sum(-1)  # (m, n)
    if world is None:
        return int(np.argmax((counts >= LEAST_CORNERS).sum(0) * 1e6 + counts.sum(0)))
    clip, _, frame = world.rpartition("/")
    if (clip, int(frame)) in views:
        return views.index((clip, int(frame)))
    near = [f"{c}/{f}" for c, f in views if c == clip]
    raise VidtrackError(
        f"calibration.board.world: no camera sees the board in {world}, or that view is blurred. Views that are used: "
        f"{', '.join(near[:8]) or ', '.join(f'{c}/{f}' for c, f in views[:8])}."
    )


def connected(b: Array) -> list[list[int]]:
    """Groups of cameras that views of the board connect: in one view two of them see six corners or more.

    b  (m, n, q, 2) px, NaN where a corner is not seen
    """
    seen = np.isfinite(b).all(-1).sum(-1) >= LEAST_CORNERS
    groups: list[list[int]] = []
    for i in range(len(b)):
        joined = [group for group in groups if any((seen[i] & seen[j]).any() for j in group)]
        groups = [group for group in groups if group not in joined]
        groups.append(sorted([i, *(j for group in joined for j in group)]))
    return sorted(groups)
