"""Boards that look alike when they are turned: which corner is the first, the same one for all cameras.

A grid of circles, and a checkerboard whose two sides have both an even or both an odd number of squares, look alike
upside down; square ones may look alike at every quarter turn. One camera's lens does not depend on the choice, the
places of several cameras to each other do: in every view they must mean the same corner. The camera's place in the
others' world, by each view and each turn of the board, agrees over views for the right turns alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.boards.board import Board


@dataclass(frozen=True)
class TurnSettings:
    """Constants of the choice."""

    cap: float = 0.1
    """rad, and share of the distance: a view that is farther off says only that it is an outlier."""
    floor: float = 1e-3
    """rad: scatter of places that is never taken for smaller; views of small pictures are good to this."""
    rough: float = 0.04
    """rad, rms: views that agree no better were not filmed at the same moments, whichever the turns."""
    sure: float = 3.0
    """Times its scatter that the second best choice must be worse, rms over the views."""


SETTINGS = TurnSettings()

Turn = NDArray[np.intp]
"""(q,) row j of the turned board is corner Turn[j]."""


class OneOrientation(NamedTuple):
    """Where every camera sees the corners, first corners alike."""

    b: Array  # (m, n, q, 2) px
    sd: Array  # (m, n, q) px
    unsure: tuple[int, ...]  # cameras whose views agree with the others' as well with the board turned


def turns_of(board: Board) -> list[tuple[Turn, Array]]:
    """The turns of a board that leave it as it was, itself first: corners' rows, and the motion (3, 4) of the board."""
    quarters: tuple[int, ...] = (0,)
    if board.type == "circles":
        quarters = (0, 2) if board.columns != board.rows else (0, 1, 2, 3)
    elif board.type == "checkerboard" and (board.columns + board.rows) % 2 == 0:
        quarters = (0, 1, 2, 3) if board.columns == board.rows and board.columns % 2 else (0, 2)
    p = board.corners
    centre = np.array([board.columns, board.rows, 0]) * board.square / 2
    found = []
    for k in quarters:
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[k]
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        moved = (p - centre) @ R.T + centre
        rows = np.linalg.norm(moved[:, None] - p, axis=-1).argmin(1)
        found.append((rows, np.concatenate([R, (centre - R @ centre)[:, None]], -1)))
    return found


def one_orientation(board: Board, b: Array, sd: Array, poses: Sequence[Mapping[int, Array]]) -> OneOrientation:
    """The corners of every view renamed so that all cameras mean the same first corner.

    b, sd   (m, n, q, 2), (m, n, q) px, of cameras that views connect
    poses   for each camera, by view, the board before that camera (3, 4), by its own lens
    The camera with most views keeps its names; the others follow, those first that share most views.
    """
    turns = turns_of(board)
    b, sd = b.copy(), sd.copy()
    if len(turns) == 1 or len(b) == 1:
        return OneOrientation(b, sd, ())
    first = max(range(len(b)), key=lambda i: len(poses[i]))
    rig = {first: np.eye(3, 4)}
    there = {view: inverse(pose) for view, pose in poses[first].items()}  # the board's inverse, in the first's axes
    unsure: list[int] = []
    while len(rig) < len(b):
        i = max((j for j in range(len(b)) if j not in rig), key=lambda j: len(set(poses[j]) & set(there)))
        shared = sorted(set(poses[i]) & set(there))
        if not shared:
            break
        options = np.array([[after(after(poses[i][k], T), there[k]) for _, T in turns] for k in shared])
        chosen, best, clear = _agreeing(options)
        if not clear:
            unsure.append(i)
        rig[i] = best
        for view, turn in zip(shared, chosen.tolist(), strict=True):
            rows = turns[turn][0]  # the turned board's corner j is seen where corner rows[j] was
            b[i, view], sd[i, view] = b[i, view, rows], sd[i, view, rows]
        for view, pose in poses[i].items():
            there.setdefault(view, after(inverse(pose), best))
    return OneOrientation(b, sd, tuple(unsure))


def _agreeing(options: Array) -> tuple[NDArray[np.intp], Array, bool]:
    """Of places (views, turns, 3, 4) one turn a view, so that all agree; the place; and whether no other does as well.

    Each option of each view is tried as the place; the distance to it is that of attitude and of direction together.
    """
    n, g = options.shape[:2]
    flat = options.reshape(n * g, 3, 4)
    scale = max(float(np.median(np.linalg.norm(_centres(flat), axis=-1))), 1e-12)
    off = _distance(flat[:, None], flat[None], scale).reshape(n * g, n, g)
    capped = np.minimum(off.min(-1), SETTINGS.cap)
    score = np.sqrt((capped**2).mean(-1))
    best = int(score.argmin())
    chosen = off[best].argmin(-1)
    rivals = off[:, best // g, best % g] > SETTINGS.cap  # a turn moves the place by a right angle or more
    limit = SETTINGS.sure * max(float(score[best]), SETTINGS.floor)
    return chosen, flat[best], score[best] > SETTINGS.rough or not (score[rivals] < limit).any()


def _centres(places: Array) -> Array:
    return np.asarray(-np.einsum("...ba,...b->...a", places[..., :3], places[..., 3]))


def _distance(a: Array, b: Array, scale: float) -> Array:
    """Angle between attitudes, rad, and the distance of centres as a share of `scale`, as one number."""
    trace = np.einsum("...ij,...ij->...", a[..., :3], b[..., :3])
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    return np.asarray(np.hypot(angle, np.linalg.norm(_centres(a) - _centres(b), axis=-1) / scale))


def after(second: Array, first: Array) -> Array:
    """One pose after another, (3, 4)."""
    R = second[:, :3] @ first[:, :3]
    return np.concatenate([R, (second[:, :3] @ first[:, 3] + second[:, 3])[:, None]], -1)


def inverse(pose: Array) -> Array:
    return np.concatenate([pose[:, :3].T, -(pose[:, :3].T @ pose[:, 3])[:, None]], -1)
