"""What is darker than the background beside a target: a rope, a mast, the edge of a board.

Its pixels lie in the soft edge over which a target's light is summed, where each takes as much off as it is darker than
the plane of the background: the centroid moves away from it. Where it is in front it hides a part of the rim as well.
It is looked for in means of 3 x 3 px, since what is only a little darker moves a centroid too.

The plane begins at the level about which most of the surroundings lie closest together, whatever else is in them: a
plane that is fitted to both sides of an edge follows neither.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.tracking.centroiding.background import SURROUNDINGS, Plane, Sums, on_grid, plane_under
from vidtrack.tracking.centroiding.components import CUTTING

Bytes = NDArray[np.uint8]
Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class DarkNeighbours:
    """When something dark is there.

    stands_off  standard deviations of a mean of 3 x 3 px below the background; few: pixels of them that must be free
    deep        share of the target's contrast below the background: what a coder leaves about a ball is 1 to 4 % of it,
                and moves a centroid by less than such a fit
    restless    of the noise, what a plane leaves from which on the window is looked at
    together    share of the surroundings that lie closest together; their width of a normal distribution, in sd
    within      standard deviations of a mean off the plane up to which pixels count for it; rounds: of its fit; cut: of
                the scatter of those, by which that of all of a normal distribution is larger
    goes_on     standard deviations of a pixel, by which those that go on from it up to the target are darker; far: px
    edge        share of what is darkest within 2 px, from which on a pixel is dark itself
    """

    stands_off: float = 5.0
    few: int = 4
    deep: float = 0.06
    restless: float = 1.5
    together: float = 0.4
    width: float = 1.05
    within: float = 3.0
    rounds: int = 6
    cut: float = 1.02
    goes_on: float = 2.0
    far: int = 6
    edge: float = 0.5


DARK_NEIGHBOURS = DarkNeighbours()
_SQUARE3 = np.ones((3, 3), np.uint8)
_SQUARE5 = np.ones((5, 5), np.uint8)
_ROUND5 = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)).astype(np.uint8)


class Dark(NamedTuple):
    """Windows (m,) in which something dark is beside the target, and 1 on all of it up to the target, (height, m,
    width).
    """

    who: Ints
    cover: Bytes

    def of(self, who: Ints) -> Dark:
        """Of these windows (k,), the places of its own among them, all k of which it has."""
        shape = len(self.cover), who.size, self.cover.shape[2]
        at, own = np.searchsorted(who, self.who), np.isin(self.who, who)
        cover = np.zeros(shape, np.uint8)
        cover[:, at[own]] = self.cover[:, own]
        return Dark(at[own], cover)


def dark_beside(grey: Float32, mask: Bytes, plane: Plane, sums: Sums, noise: float, contrast: Array) -> Dark:
    """What is dark beyond all that is bright in windows (height, n, width) of grey levels.

    mask   1 above the threshold; plane: of each window, as `background_plane` fits it
    noise  grey levels, of a pixel; contrast (n,): grey levels, of each target
    """
    free = _free(mask)
    least = max(noise, SURROUNDINGS.quantisation_sd)
    odd = np.abs(_off(_means(grey, free), plane, sums)) > np.float32(DARK_NEIGHBOURS.stands_off * least)
    who = np.flatnonzero((plane.unrest > DARK_NEIGHBOURS.restless * least) | odd.any(axis=(0, 2)))
    if not who.size:
        return Dark(who, free[:, who])
    grey, free = grey[:, who], free[:, who]
    plane, scatter, means = plane_of_most(grey, free, sums, noise)
    off = _off(means, plane, sums)
    lowest = cv2.erode(off.reshape(len(off), -1), _SQUARE5).reshape(off.shape)
    level = (DARK_NEIGHBOURS.stands_off * scatter).astype(np.float32)[:, None]
    deep = (DARK_NEIGHBOURS.deep * contrast[who]).astype(np.float32)[:, None] * means.root
    dark = (off < np.minimum(-np.maximum(level, deep), DARK_NEIGHBOURS.edge * lowest)).view(np.uint8)
    some = np.flatnonzero(dark.any(axis=(0, 2)))
    if not some.size:
        return Dark(who[some], dark[:, some])
    darker = grey[:, some] - on_grid(plane.slope[:, some], sums) < np.float32(-DARK_NEIGHBOURS.goes_on * least)
    return Dark(who[some], _going_on(dark[:, some], darker & (mask[:, who[some]] == 0)))


def plane_of_most(grey: Float32, free: Bytes, sums: Sums, noise: float) -> tuple[Plane, Array, Means]:
    """A plane under the marked pixels that follows most of them, and how far means of 3 x 3 of them scatter about it:
    (n,) grey levels, times the square root of their number; and those means.

    grey, free  (height, n, width), free 1 where a pixel may show the background
    """
    n, least = grey.shape[1], max(noise, SURROUNDINGS.quantisation_sd)
    means = _means(grey, free)
    base, most = np.zeros(n), np.full(n, least)
    for i in range(n):
        values = np.sort(means.value[:, i][means.known[:, i]])
        if not values.size:
            continue
        step = int(DARK_NEIGHBOURS.together * values.size)
        wide = values[step:] - values[: values.size - step]
        at = int(np.argmin(wide))
        base[i] = values[at : at + step + 1].mean()
        most[i] = max(least, 3 * float(wide[at]) / DARK_NEIGHBOURS.width)
    scatter = np.full(n, least)
    flat = np.zeros((3, n))
    flat[0] = base
    plane = Plane(flat, flat[:2], base, base, flat)
    for _ in range(DARK_NEIGHBOURS.rounds):
        off = np.abs(_off(means, plane, sums))
        near = means.known & (off < (DARK_NEIGHBOURS.within * scatter).astype(np.float32)[:, None])
        plane = plane_under(grey[SURROUNDINGS.rows], near[SURROUNDINGS.rows].astype(np.float32), sums)
        rms = np.sqrt((np.square(off) * near).sum(axis=(0, 2)) / np.maximum(near.sum(axis=(0, 2)), 1))
        scatter = np.clip(DARK_NEIGHBOURS.cut * rms, least, most)
    return plane, scatter, means


def one_sided(marked: Bytes, target: Bytes) -> Bytes:
    """What is marked (height, n, width) and has nothing like it on the other side of the target, 1 on whose pixels.

    What reaches as far on both sides, the ends of a streak, does not move the middle.
    """
    out = marked.copy()
    height, _, width = marked.shape
    for i in np.flatnonzero(marked.any(axis=(0, 2))):
        row, column = np.nonzero(marked[:, i])
        y, x = np.nonzero(target[:, i])
        if not x.size:
            continue
        opposite = cv2.dilate(marked[:, i], _SQUARE3)
        y, x = np.rint(2 * y.mean() - row).astype(int), np.rint(2 * x.mean() - column).astype(int)
        inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
        both = np.flatnonzero(inside)[opposite[y[inside], x[inside]] > 0]
        out[row[both], i, column[both]] = 0
    return out


class Means(NamedTuple):
    """Means of 3 x 3 free pixels, grey levels; the square root of their number; and where there are enough of them."""

    value: Float32
    root: Float32
    known: NDArray[np.bool_]


def _going_on(dark: Bytes, darker: NDArray[np.bool_]) -> Bytes:
    """What is dark with all that is darker than the background and touches it."""
    darker[..., -CUTTING.separator :] = False
    flat = (len(dark), -1)
    for _ in range(DARK_NEIGHBOURS.far):
        dark = (cv2.dilate(dark.reshape(flat), _SQUARE3).reshape(dark.shape) & darker) | dark
    return np.asarray(dark, np.uint8)


def _free(mask: Bytes) -> Bytes:
    """1 where no pixel above the threshold is within two."""
    free = (cv2.dilate(mask.reshape(len(mask), -1), _ROUND5).reshape(mask.shape) == 0).view(np.uint8)
    free[..., -CUTTING.separator :] = 0
    return np.asarray(free, np.uint8)


def _means(grey: Float32, free: Bytes) -> Means:
    flat, shape = (grey.shape[0], -1), grey.shape
    lit, each = (grey * free).reshape(flat), free.reshape(flat)
    total, count = (
        cv2.boxFilter(of, cv2.CV_32F, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT).reshape(shape)
        for of in (lit, each)
    )
    some = np.maximum(count, 1)
    return Means(total / some, np.sqrt(some), (count >= DARK_NEIGHBOURS.few) & (free > 0))


def _off(means: Means, plane: Plane, sums: Sums) -> Float32:
    """Means off the plane, times the square roots of their pixels; 0 where too few are known."""
    off = (means.value - on_grid(plane.slope, sums)) * means.root * means.known
    return np.asarray(off, np.float32)
