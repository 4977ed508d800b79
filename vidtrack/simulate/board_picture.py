"""Boards as a camera sees them: their drawing carried exactly through the camera and its lens, each pixel averaged.

The drawing is a bitmap with many px a square; each pixel of the picture is the mean of some positions in it, followed
to the board's plane along its line of sight.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, line_of_sight, project

PER_SQUARE = 96
"""px of the drawing a square: eight modules of a tag fall on whole px of three quarters of it."""
MARGIN = 0.5
"""Squares of white about the pattern."""
OVER = 4
"""Positions along each side of a pixel."""


def drawing(
    kind: str, columns: int, rows: int, marker_share: float = 0.75, dictionary: str = "", first: int = 0
) -> NDArray[np.uint8]:
    """The board as a bitmap, `MARGIN` squares of white about it: charuco, checkerboard, circles or apriltag.

    first   number of the first tag of an apriltag board; one column and one row make a tag by itself
    """
    import cv2

    size = (columns * PER_SQUARE, rows * PER_SQUARE)
    side = round(marker_share * PER_SQUARE)
    if kind == "charuco":
        tags = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary or "DICT_5X5_250"))
        board: Any = cv2.aruco.CharucoBoard((columns, rows), 1.0, marker_share, tags).generateImage(size)
    else:
        board = np.full(size[::-1], 255, np.uint8)
        at = [(i, j) for j in range(rows) for i in range(columns)]
        for n, (i, j) in enumerate(at):
            x, y = i * PER_SQUARE, j * PER_SQUARE
            if kind == "checkerboard" and (i + j) % 2 == 0:
                board[y : y + PER_SQUARE, x : x + PER_SQUARE] = 0
            elif kind == "circles":
                centre = (2 * x + PER_SQUARE - 1, 2 * y + PER_SQUARE - 1)  # half px: between the two middle ones
                cv2.circle(board, centre, PER_SQUARE // 2, 0, -1, cv2.LINE_AA, 1)
            elif kind == "apriltag":
                tags = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary or "DICT_APRILTAG_36h11"))
                tag, gap = tags.generateImageMarker(first + n, side), (PER_SQUARE - side) // 2
                board[y + gap : y + gap + side, x + gap : x + gap + side] = tag
    edge = round(MARGIN * PER_SQUARE)
    return np.pad(board, edge, constant_values=255)


def board_picture(
    camera: Camera,
    R: Array,
    T: Array,
    bitmap: NDArray[np.uint8],
    square: float,
    *,
    background: float = 110.0,
    dark: float = 25.0,
    bright: float = 215.0,
    noise: float = 1.0,
    rng: np.random.Generator | None = None,
) -> NDArray[np.uint8]:
    """What a camera sees of a board (rows, columns).

    R, T        the board in the world: x along the columns, y up the rows, z out of its face; origin lower left
    bitmap      from `drawing`
    square      world units
    noise       grey levels
    """
    import cv2

    width, height = camera.image_size
    rows, columns = ((n - 2 * round(MARGIN * PER_SQUARE)) / PER_SQUARE for n in bitmap.shape)
    left, top, right, bottom = _shown(camera, R, T, columns * square, rows * square, MARGIN * square)
    level = np.full((OVER * height, OVER * width), background, np.float32)
    X, Y = np.arange(left - 1, right + 1), np.arange(top - 1, bottom + 1)  # one px more on each side
    if right > left and bottom > top:
        centre, d = line_of_sight(camera, np.stack(np.meshgrid(X, Y), -1).astype(float))
        start, along = R.T @ (centre - T), d @ R
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -start[2] / along[..., 2]
            p = start + t[..., None] * along
        x = (p[..., 0] / square + MARGIN) * PER_SQUARE - 0.5
        y = (rows - p[..., 1] / square + MARGIN) * PER_SQUARE - 0.5
        lost = ~np.isfinite(x) | ~np.isfinite(y) | (t <= 0)
        # between pixels the way to the board is straight to 1e-3 of the drawing's px
        x, y, away = (_between(each) for each in (np.where(lost, 0, x), np.where(lost, 0, y), lost.astype(float)))
        x, y = np.where(away > 0, -1e6, x), np.where(away > 0, -1e6, y)
        level[OVER * top : OVER * bottom, OVER * left : OVER * right] = cv2.remap(
            dark + (bright - dark) * cv2.GaussianBlur(bitmap, (0, 0), 0.8).astype(np.float32) / 255,
            x.astype(np.float32),
            y.astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=background,
        )
    picture = level.reshape(height, OVER, width, OVER).mean((1, 3))
    if rng is not None:
        picture = picture + rng.normal(0, noise, picture.shape)
    return np.asarray(np.clip(np.rint(picture), 0, 255), np.uint8)


def _between(at_pixels: Array) -> Array:
    """Values (OVER rows, OVER columns) at the positions in each pixel, from those at the pixels' middles and one more
    on each side."""
    import cv2

    rows, columns = at_pixels.shape
    fine = cv2.resize(at_pixels, (OVER * columns, OVER * rows), interpolation=cv2.INTER_LINEAR)
    return np.asarray(fine[OVER:-OVER, OVER:-OVER])


def _shown(camera: Camera, R: Array, T: Array, across: float, up: float, margin: float) -> tuple[int, int, int, int]:
    """The part of the picture, px, that holds the board: left, top, right, bottom; the whole where that is not sure."""
    width, height = camera.image_size
    along = np.linspace(0, 1, 21)
    x, y = -margin + (across + 2 * margin) * along, -margin + (up + 2 * margin) * along
    rim = [np.stack(np.broadcast_arrays(a, b, 0.0), -1) for a, b in ((x, y[0]), (x, y[-1]), (x[0], y), (x[-1], y))]
    b = project(camera, np.concatenate(rim) @ R.T + T)
    if not np.isfinite(b).all():
        return 0, 0, width, height
    low, high = np.floor(b.min(0)).astype(int) - 3, np.ceil(b.max(0)).astype(int) + 4
    left, right = np.clip([low[0], high[0]], 0, width).tolist()
    top, bottom = np.clip([low[1], high[1]], 0, height).tolist()
    return left, top, right, bottom
