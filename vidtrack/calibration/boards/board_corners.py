"""The corners of a board in a picture, to a fraction of a pixel, each with an sd from the picture itself.

OpenCV's detectors find and name them (Garrido-Jurado et al. 2014; Duda and Frese 2018 for checkerboards);
`board_saddles` measures them, with the sd of its fit.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_circles import disc_centroids
from vidtrack.calibration.boards.board_saddles import saddle_corners
from vidtrack.tracking.tag_reading.tag_corners import tag_corners

LEAST_CORNERS = 6
"""Corners from which a view says something of the lens: six unknowns are its own pose."""
WINDOW = 5
"""px on each side of a corner whose gradients are counted."""
LEAST_SD = 0.01
"""px, of a corner at best: what a lens, a sharp edge and print leave beside the noise of the levels."""
NOT_FITTED_SD = 0.1
"""px, of a corner that is no crossing of two edges, at least."""


class Seen(NamedTuple):
    """What one picture shows of a board: n corners."""

    ids: NDArray[np.intp]  # (n,) rows of Board.corners
    b: Array  # (n, 2) px
    sd: Array  # (n,) px


def board_seen(board: Board, picture: NDArray[np.uint8]) -> Seen | None:
    """The corners of a board in a picture (rows, columns); None where fewer than 6 are found, or all in one row."""
    if board.type == "apriltag":
        own = _tags(board, picture)
        return None if own is None or len(own[0]) < LEAST_CORNERS else Seen(*own)
    found = {"charuco": _charuco, "checkerboard": _checkerboard, "circles": _circles}[board.type](board, picture)
    if found is None or len(found[0]) < LEAST_CORNERS:
        return None
    ids, b = found
    if not np.ptp(board.corners[ids, :2], axis=0).all():  # one row of corners: no pose
        return None
    if board.type == "circles":
        return Seen(ids, *disc_centroids(picture, b))
    return Seen(ids, *_polished(board, picture, ids, b))


def _dictionary(board: Board) -> Any:
    import cv2

    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.tags))


def _parameters() -> Any:
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return parameters


def _charuco(board: Board, picture: NDArray[np.uint8]) -> tuple[NDArray[np.intp], Array] | None:
    import cv2

    drawn = cv2.aruco.CharucoBoard((board.columns, board.rows), 1.0, board.tag_side / board.square, _dictionary(board))
    detector = cv2.aruco.CharucoDetector(drawn, cv2.aruco.CharucoParameters(), _parameters())
    corners, ids, _, _ = detector.detectBoard(picture)
    if ids is None or corners is None:
        return None
    return np.asarray(ids, np.intp).ravel(), np.asarray(corners, float).reshape(-1, 2)


def _polished(board: Board, picture: NDArray[np.uint8], ids: NDArray[np.intp], b: Array) -> tuple[Array, Array]:
    """Corners (n, 2) where their edges cross, and the sd of each (n,) px.

    A corner that is no crossing of two edges stays where the detector put it, with an sd of a pixel's tenth or more.
    """
    free = (1 - board.tag_side / board.square) / 2 if board.type == "charuco" else 1.0
    across, up = _sides(board.corners[ids, :2], b, board.square)
    found, sd = saddle_corners(picture, b, across, up, free)
    lost = ~np.isfinite(sd)
    rough = np.maximum(corner_sd(picture, b), NOT_FITTED_SD)
    return np.where(lost[:, None], b, found), np.where(lost, rough, np.maximum(sd, LEAST_SD))


def _sides(p: Array, b: Array, square: float) -> tuple[Array, Array]:
    """How a square's sides, along the board's x and y, lie in the picture at each corner: (n, 2) px each.

    By the plane perspective that carries the board's p (n, 2) to the picture's b (n, 2) best.
    """
    import cv2

    H, _ = cv2.findHomography(p, b, 0)

    def at(q: Array) -> Array:
        there = np.column_stack([q, np.ones(len(q))]) @ H.T
        return np.asarray(there[:, :2] / there[:, 2:])

    x, y = np.array([square / 2, 0]), np.array([0, square / 2])
    return at(p + x) - at(p - x), at(p + y) - at(p - y)


def _checkerboard(board: Board, picture: NDArray[np.uint8]) -> tuple[NDArray[np.intp], Array] | None:
    import cv2

    size = (board.columns - 1, board.rows - 1)
    if min(size) < 3:  # OpenCV refuses smaller ones
        return None
    good, corners = cv2.findChessboardCornersSB(
        picture, size, flags=cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if not good:
        return None
    b = np.asarray(corners, float).reshape(-1, 2)
    return np.arange(len(b)), _dark_first(board, picture, _upright(b, size))


def _upright(b: Array, size: tuple[int, int]) -> Array:
    """A board that looks alike upside down: its first corner is taken as the upper left one, and never mirrored."""
    grid = b.reshape(size[1], size[0], 2)
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if across[0] * down[1] - across[1] * down[0] < 0:
        grid = grid[:, ::-1]
    turned = [grid, grid[::-1, ::-1]]
    if size[0] == size[1]:
        turned += [_quarter(grid), _quarter(grid)[::-1, ::-1]]
    first = min(turned, key=lambda each: each[0, 0].sum())
    return np.ascontiguousarray(first.reshape(-1, 2))


def _quarter(grid: Array) -> Array:
    """A square grid (k, k, 2) counted from the next of its four corners, not mirrored."""
    return grid.swapaxes(0, 1)[::-1]


def _dark_first(board: Board, picture: NDArray[np.uint8], b: Array) -> Array:
    """Corners (n, 2) of a checkerboard turned so that its upper left square is dark, as it is drawn.

    Where both sides have an even number of squares, or both an odd one, half a turn changes no colour, and where they
    are not equal nothing else is possible: see `board_turns`.
    """
    k, m = board.columns - 1, board.rows - 1
    if (k + m) % 2 == 0 and not (k == m and k % 2):
        return b
    grid = b.reshape(m, k, 2)
    middles = (grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:] + grid[:-1, :-1]) / 4
    x, y = np.rint(middles).astype(int).reshape(-1, 2).T
    levels = picture[np.clip(y, 0, picture.shape[0] - 1), np.clip(x, 0, picture.shape[1] - 1)].astype(float)
    sign = np.where(np.add.outer(np.arange(m - 1), np.arange(k - 1)).ravel() % 2, 1.0, -1.0)
    if ((levels - levels.mean()) * sign).sum() < 0:
        grid = _quarter(grid) if k == m else grid[::-1, ::-1]
    return np.ascontiguousarray(grid.reshape(-1, 2))


def _circles(board: Board, picture: NDArray[np.uint8]) -> tuple[NDArray[np.intp], Array] | None:
    import cv2

    size = (board.columns, board.rows)
    good, centres = cv2.findCirclesGrid(picture, size, flags=cv2.CALIB_CB_SYMMETRIC_GRID)
    if not good:
        good, centres = cv2.findCirclesGrid(cv2.bitwise_not(picture), size, flags=cv2.CALIB_CB_SYMMETRIC_GRID)
    if not good:
        return None
    return np.arange(board.columns * board.rows), _upright(np.asarray(centres, float).reshape(-1, 2), size)


def _tags(board: Board, picture: NDArray[np.uint8]) -> tuple[NDArray[np.intp], Array, Array] | None:
    """Corners of tags, each where its own edges meet, with its sd: a corner alone is no saddle of the grey levels."""
    import cv2

    dictionary = _dictionary(board)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, _parameters()).detectMarkers(picture)
    if ids is None:
        return None
    tags = np.asarray(ids, np.intp).ravel()
    inside = np.flatnonzero(tags < board.columns * board.rows)
    rough = np.asarray(corners, float).reshape(-1, 4, 2)
    fits = [tag_corners(picture, rough[k], dictionary.markerSize + 2) for k in inside]
    b, sd = np.array([fit.b for fit in fits]).reshape(-1, 2), np.array([fit.sd for fit in fits]).reshape(-1, 2)
    good = np.isfinite(b).all(-1)
    return (tags[inside, None] * 4 + np.arange(4)).ravel()[good], b[good], np.sqrt((sd[good] ** 2).mean(-1))


def corner_sd(picture: NDArray[np.uint8], b: Array) -> Array:
    """Standard deviation (n,) px of corners b (n, 2): the noise of grey levels over the gradients about each.

    As of the least-squares corner (Foerstner and Guelch 1987).
    """
    import cv2

    grey = picture.astype(np.float32)
    noise = max(float(np.median(np.abs(cv2.Laplacian(grey, cv2.CV_32F)))) / 0.6745 / np.sqrt(20.0), 0.3)
    gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(grey, cv2.CV_32F, 0, 1, scale=1 / 8)
    side = (2 * WINDOW + 1, 2 * WINDOW + 1)
    xx, yy, xy = (cv2.boxFilter(g, cv2.CV_32F, side, normalize=False) for g in (gx * gx, gy * gy, gx * gy))
    rows, columns = picture.shape
    x = np.clip(np.rint(b[:, 0]).astype(int), 0, columns - 1)
    y = np.clip(np.rint(b[:, 1]).astype(int), 0, rows - 1)
    trace, det = xx[y, x] + yy[y, x], xx[y, x] * yy[y, x] - xy[y, x] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = noise**2 * trace / det / 2
    return np.asarray(np.clip(np.sqrt(np.where(det > 0, variance, 1.0)), LEAST_SD, 2.0), float)


def why_not(board: Board, picture: NDArray[np.uint8]) -> str:
    """The likeliest reason why a picture shows no such board, for people; "" where none is seen."""
    import cv2

    if board.type in ("charuco", "apriltag"):
        if board_seen(board, np.ascontiguousarray(picture[:, ::-1])) is not None:
            return "it is there mirrored: print it again without mirroring, or flip the pictures back"
        detector = cv2.aruco.ArucoDetector(_dictionary(board), _parameters())
        _, ids, _ = detector.detectMarkers(picture)
        if ids is not None and len(ids):
            return (
                f"tags of its dictionary are there ({len(ids)}, numbers up to {int(np.max(ids))}), but not where a "
                f"board of {board.columns} x {board.rows} has them: other columns or rows, or several boards"
            )
        for other in ("DICT_4X4_250", "DICT_5X5_250", "DICT_6X6_250", "DICT_7X7_250", "DICT_APRILTAG_36h11"):
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, other))
            _, ids, _ = cv2.aruco.ArucoDetector(dictionary, _parameters()).detectMarkers(picture)
            if ids is not None and len(ids) > 3:
                return f"its tags are of {other}, not {board.tags}: set dictionary"
        return ""
    turned = [(board.columns + i, board.rows + j) for i in (0, 1, -1) for j in (0, 1, -1) if (i, j) != (0, 0)]
    for columns, rows in turned:
        if min(columns, rows) < 3:
            continue
        other_board = Board(board.type, columns, rows, board.square)
        if board_seen(other_board, picture) is not None:
            what = "circles" if board.type == "circles" else "squares"
            return f"a board of {columns} x {rows} {what} is there: columns and rows count {what}, not inner corners"
    return ""
