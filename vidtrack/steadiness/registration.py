"""How far each patch of one picture lies from its place in another, to a small part of a pixel, whatever the light.

A patch W of the picture, taken where the last estimate u says that it is, is written as the reference's patch T with a
gain a, a shift d and a plane of light: W(x) = a T(x + d) + b + c x + e y, which is linear in a, a d, b, c, e once T is
expanded. The design is the reference's alone, so that its inverse is made once and each step is one product for all
patches (the inverse compositional step of Baker and Matthews, 2004). Where patches are farther away than such a step
reaches, they are sought in a coarser picture by correlation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.steadiness.patches import CHOICE, Choice, smooth


@dataclass(frozen=True)
class Search:
    """How patches are found again.

    steps     iterations; settled: px below which the last one counts as none
    step_px   px by which one iteration moves a patch at most
    explained share of a patch's variation (less a plane of light) that the reference must explain
    coarse    px that are one px of the coarser picture; template, reach: its px from a patch's middle to the edge of
              what is sought, and how far it is sought
    alike     correlation in the coarser picture below which nothing was found
    """

    steps: int = 6
    settled: float = 0.02
    step_px: float = 1.5
    explained: float = 0.6
    coarse: int = 4
    template: int = 7
    reach: int = 26
    alike: float = 0.6


SEARCH = Search()

TABLE = 32
"""OpenCV interpolates at multiples of 1/32 px: patches are taken there, and the step is exact from there. Linear, as
its cubic kernel does not keep the slope of a ramp, which would pull shifts by 0.04 px."""


class Shifts(NamedTuple):
    """Where patches went.

    shift      (n, 2) px, NaN where a patch was not found again
    sd         (n, 2) px, from what the reference leaves unexplained: right between patches, not in itself
    explained  (n,) share of the patch's variation that the reference explains; 0 where not found
    """

    shift: Array
    sd: Array
    explained: Array

    @property
    def found(self) -> Bools:
        """(n,)"""
        return np.isfinite(self.shift[:, 0])


class Reference:
    """Patches of one picture, ready to be found in others of the same size.

    picture  (h, w); middles (n, 2) column and row, of `chosen_patches`
    """

    def __init__(
        self, picture: NDArray[Any], middles: NDArray[np.intp], choice: Choice = CHOICE, search: Search = SEARCH
    ) -> None:
        self.middles, self._choice, self._search = middles, choice, search
        self.size = (picture.shape[1], picture.shape[0])
        image = smooth(picture, choice)
        self._coarse = _coarser(image, search.coarse)
        # the blur leaves nothing between every other pixel
        reach = np.arange(-choice.half, choice.half + 1, 2)
        y, x = (a.ravel() for a in np.meshgrid(reach, reach, indexing="ij"))
        self._x, self._y = x.astype(np.float32), y.astype(np.float32)
        column, row = middles[:, :1] + x, middles[:, 1:] + y
        gx = (image[row, column + 1] - image[row, column - 1]) / 2
        gy = (image[row + 1, column] - image[row - 1, column]) / 2
        plane = np.stack([np.ones_like(self._x), self._x / choice.half, self._y / choice.half])
        plane = np.broadcast_to(plane, (len(middles), *plane.shape))
        design = np.concatenate([np.stack([image[row, column], gx, gy], 1), plane], 1).astype(np.float64)
        design[:, 0] -= design[:, 0].mean(-1, keepdims=True)
        normal = np.linalg.pinv(design @ design.transpose(0, 2, 1))
        self._inverse = (normal @ design).astype(np.float32)  # (n, 6, pixels)
        self._design = design.transpose(0, 2, 1).astype(np.float32)  # (n, pixels, 6)
        self._variance = np.stack([normal[:, 1, 1], normal[:, 2, 2]], -1)
        self._plane = np.stack([np.ones_like(self._x), self._x / choice.half, self._y / choice.half], -1)
        self._flat = np.linalg.pinv(self._plane).T  # (pixels, 3)

    def shifts(self, picture: NDArray[Any], start: Array | None = None) -> Shifts:
        """Where the patches lie in another picture (h, w), beginning at shifts (n, 2) px; 0 where none are given.

        Patches that are not found there are sought from 0, and where most are not found, by correlation.
        """
        if not len(self.middles):
            return Shifts(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
        image = smooth(picture, self._choice)
        zero = np.zeros((len(self.middles), 2))
        best = self._refined(image, zero if start is None else np.where(np.isfinite(start), start, 0.0))
        if start is not None and not best.found.all() and np.abs(np.nan_to_num(start)).max() > 0.5:
            best = _better(best, self._refined(image, zero))
        if best.found.mean() < 0.5:
            best = _better(best, self._refined(image, self._sought(image)))
        return best

    def _refined(self, image: NDArray[np.float32], start: Array) -> Shifts:
        u, way, search = start.copy(), np.full(len(start), np.inf), self._search
        going = np.arange(len(u))
        values = np.empty((len(u), len(self._x)), np.float32)
        for k in range(search.steps):
            u[going] = np.rint(u[going] * TABLE) / TABLE
            values[going] = self._taken(image, u[going], going)
            c = (self._inverse[going] @ values[going, :, None])[..., 0].astype(float)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = np.where(c[:, :1] > 0.1, -c[:, 1:3] / c[:, :1], np.nan)
            step = np.clip(step, -search.step_px, search.step_px)
            u[going] += step
            way[going] = np.abs(step).max(1)
            going = going[(way[going] > search.settled) | (k == 0)]
            if not going.size:
                break
        c = (self._inverse @ values[..., None])[..., 0]
        left = values - (self._design @ c[..., None])[..., 0]
        light = values - (values @ self._flat) @ self._plane.T
        with np.errstate(divide="ignore", invalid="ignore"):
            explained = np.nan_to_num(1 - (left**2).sum(1) / (light**2).sum(1))
            sd = np.sqrt((left**2).mean(1)[:, None] * self._variance) / c[:, :1]
        inside = self._inside(u)
        good = (way <= 5 * search.settled) & (explained > search.explained) & (c[:, 0] > 0.1) & inside
        return Shifts(
            np.where(good[:, None], u, np.nan), np.where(good[:, None], sd, np.nan), np.where(good, explained, 0)
        )

    def _inside(self, u: Array) -> Bools:
        at, edge = self.middles + np.nan_to_num(u, nan=1e6), self._choice.half + 1
        return np.asarray(((at >= edge) & (at <= np.array(self.size) - 1 - edge)).all(1))

    def _taken(self, image: NDArray[np.float32], u: Array, which: NDArray[np.intp]) -> NDArray[np.float32]:
        """The values (k, pixels) of some patches, shifted by u (k, 2)."""
        at = (self.middles[which] + np.nan_to_num(u)).astype(np.float32)
        column, row = at[:, :1] + self._x, at[:, 1:] + self._y
        taken: NDArray[np.float32] = cv2.remap(image, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return taken

    def _sought(self, image: NDArray[np.float32]) -> Array:
        """Shifts (n, 2) px at which patches correlate best in the coarser picture; 0 where none does."""
        search = self._search
        small, t, r = _coarser(image, search.coarse), search.template, search.reach
        h, w = small.shape
        answer = np.zeros((len(self.middles), 2))
        for i, (column, row) in enumerate((self.middles / search.coarse).round().astype(int).tolist()):
            x0, x1, y0, y1 = max(0, column - t), min(w, column + t + 1), max(0, row - t), min(h, row + t + 1)
            left, top = max(0, x0 - r), max(0, y0 - r)
            window = small[top : min(h, y1 + r), left : min(w, x1 + r)]
            match = cv2.matchTemplate(window, self._coarse[y0:y1, x0:x1], cv2.TM_CCOEFF_NORMED)
            _, value, _, at = cv2.minMaxLoc(match)
            if value > search.alike:
                answer[i] = (at[0] + left - x0) * search.coarse, (at[1] + top - y0) * search.coarse
        return answer


def _coarser(image: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    rows, columns = (max(1, n // factor) for n in image.shape)
    part = np.ascontiguousarray(image[: rows * factor, : columns * factor])
    small: NDArray[np.float32] = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
    return small


def _better(a: Shifts, b: Shifts) -> Shifts:
    """For each patch that of two answers in which the reference explains more."""
    take = (b.explained > a.explained)[:, None]
    return Shifts(np.where(take, b.shift, a.shift), np.where(take, b.sd, a.sd), np.maximum(a.explained, b.explained))
