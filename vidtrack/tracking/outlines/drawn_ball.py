"""The picture of a ball whose light is linear in its parts: what is fitted to pixels by `shaded_ball`."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools

FINE = 3
"""Parts of a pixel, each way, in which the ball is drawn before it is blurred."""


class BallView(NamedTuple):
    """A piece of a picture; x, y: where its light is, px from the middle of the first pixel, both ways; cut: a line
    cuts the ball; full (rows * columns,): pixels at full scale, which are at least as bright, None: there are none.
    """

    grey: Array
    x: float
    y: float
    lines: int
    height_known: bool = False
    cut: bool = False
    full: Bools | None = None


def drawn(view: BallView, unknowns: Array) -> tuple[Array, list[Array]]:
    """The share (rows, columns) of each pixel that the ball covers, and all that adds up to its picture.

    unknowns  x, y of its middle from the light, log radius, log blur, log height over width, px; of a lamp its angle
              from the direction of the camera and its direction in the picture, radians, without which the surface is a
              polynomial of the second degree; or of a line that cuts it how far it is from the middle, in radii, and in
              which direction
    """
    rows, columns = view.grey.shape
    s = FINE
    radius, blur = np.exp(unknowns[2]), np.exp(unknowns[3])
    x0, y0 = view.x + unknowns[0], view.y + unknowns[1]
    across = ((np.arange(columns * s) + 0.5) / s - 0.5 - x0) / radius
    down = ((np.arange(rows * view.lines * s) + 0.5) / s - 0.5 * view.lines - y0) / (radius * np.exp(unknowns[4]))
    r = np.sqrt(across**2 + down[:, None] ** 2)
    ball = np.clip((1 - r) * radius * s + 0.5, 0, 1)
    inward = 1 / np.maximum(r, 1.0)
    u, v = across * inward, down[:, None] * inward
    if view.cut:
        flat = across * np.cos(unknowns[6]) + down[:, None] * np.sin(unknowns[6])
        above = np.clip((unknowns[5] - flat) * radius * s + 0.5, 0, 1)
        surface = [ball * above, 1 - above]
    elif unknowns.size > 5:
        w = np.sqrt(np.maximum(1 - u * u - v * v, 0))
        along, aside = np.cos(unknowns[5]), np.sin(unknowns[5])
        lit = np.maximum(w * along + (u * np.cos(unknowns[6]) + v * np.sin(unknowns[6])) * aside, 0)
        surface = [ball, ball * lit]
    else:
        surface = [ball, ball * u, ball * v, ball * u * u, ball * u * v, ball * v * v]
    blur_y, blur_x = _blur(rows, view.lines, s, blur), _blur(columns, 1, s, blur)
    parts = [blur_y @ one @ blur_x.T for one in surface]
    free = 1 - parts[0] - (parts[1] if view.cut else 0)
    x, y = np.linspace(-1, 1, columns), np.linspace(-1, 1, rows)[:, None]
    return parts[0], [*parts, free, free * x, free * y]


@lru_cache(maxsize=64)  # most slopes change something else
def _blur(pixels: int, pitch: int, fine: int, blur: float) -> Array:
    """How much each fine part gives to each pixel, (pixels, fine parts), through a Gaussian of `blur` px."""
    from scipy.special import ndtr  # only balls that are lit from one side need it

    edges = _edges(pixels, pitch, fine)
    return np.asarray(np.diff(ndtr(edges / blur), axis=0) / (fine * pitch))


@lru_cache(maxsize=64)
def _edges(pixels: int, pitch: int, fine: int) -> NDArray[np.float64]:
    """From the middles of the fine parts to the edges of the pixels, px, (pixels + 1, fine parts)."""
    parts = (np.arange(pixels * pitch * fine) + 0.5) / fine - 0.5 * pitch
    return (pitch * (np.arange(pixels + 1) - 0.5))[:, None] - parts
