"""How far light and dark on a target move its centroid: a highlight that wanders, a mark that turns with it, a shadow.

The middle of a target's light is the middle of its outline as long as its surface is alike. The same moments of levels
that are cut off at the threshold do not see what is bright on it, and less of what is dark: how far the two middles
are apart shows by how much the surface moves the centroid. What stays as it is, as the shade of a lamp at the side,
moves all samples alike and is no error of one from another.

    s = (x - x_cut) mass_cut / mass

which noise alone makes less than the sd of x, whatever the threshold. Looked at once in several samples.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Ints, Picture
from vidtrack.tracking.centroiding.background import Plane, Sums
from vidtrack.tracking.centroiding.order_statistics import median, median_of


@dataclass(frozen=True)
class SurfaceShift:
    """When a surface moves a centroid.

    fewest    looks at a target, from which on its surface is judged
    plainly   times the sd of a centroid that s scatters by at least; 0.3 to 0.5 of plain balls, 1 to 20 of glossy ones
    grid_px   that the grid of pixels adds to that sd, at least and at most: edges that are cut off half-way up are
              sampled by fewer of them; and grid_of, between, over the root of the radius in px: of razor-sharp discs of
    grid_of   1.5 to 15 px s scatters by 0.033 to 0.01 px
    for_once  the same of a single look, where most show nothing
    many      share of the looks that scatter at least as a normal distribution's do, and how far, in standard
    of_many   deviations, that share of it reaches: a bright spot that goes round is in the middle now and then
    between   share of that scatter that counts between any two looks
    whole     px that a centroid moves for a px of s: the cut is half-way up, so that s is half of what the two middles
              differ by, which is 0.65 to 1 of what the centroid is off
    """

    fewest: int = 4
    plainly: float = 1.0
    grid_px: tuple[float, float] = (0.015, 0.03)
    grid_of: float = 0.05
    for_once: float = 2.0
    many: float = 0.75
    of_many: float = 1.15
    between: float = 0.5
    whole: float = 3.0


SURFACE = SurfaceShift()


def surface_shift(
    grey: Picture, region: NDArray[np.uint8], plane: Plane, sums: Sums, threshold: Array, middle: Array, mass: Array
) -> Array:
    """s (2, m) px of the first m windows of grey levels (height, n, width), those of `threshold` (m,) grey levels.

    region  1 on each target with its soft edge; plane under it; middle (2, n) px from the window's and mass (n,)
            of all its light
    """
    m = threshold.size
    weight = region[:, :m].astype(np.float32)
    bare = sums.moments(weight)
    cut = sums.moments(weight * np.minimum(grey[:, :m], threshold.astype(np.float32)[:, None]))
    a, b, c = plane.slope[:, :m]
    light = cut[0, 0] - a * bare[0, 0] - b * bare[0, 1] - c * bare[1, 0]
    along = cut[0, 1] - a * bare[0, 1] - b * bare[0, 2] - c * bare[1, 1]
    down = cut[1, 0] - a * bare[1, 0] - b * bare[1, 1] - c * bare[2, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = middle[:, :m] - np.stack([along, down]) / np.where(light > 0, light, np.nan)
        return np.asarray(apart * light / mass[:m])


class Surfaces:
    """What was seen of the surfaces of so many targets."""

    def __init__(self, n: int) -> None:
        self._samples, self._places = array("q"), array("q")
        self._x, self._y = array("d"), array("d")  # numbers alone: a look in arrays of its own takes ten times as much
        self._n = n

    def seen(self, sample: int, who: Ints, shift: Array, clear: Bools) -> None:
        """s (2, m) px of places `who` in a sample, where they are clear."""
        good = clear & np.isfinite(shift).all(axis=0) & (who < self._n)
        if good.any():
            self._places.extend(who[good].tolist())
            self._samples.extend([sample] * (len(self._places) - len(self._samples)))
            self._x.extend(shift[0, good].tolist())
            self._y.extend(shift[1, good].tolist())

    def followed_back(self, back: Surfaces, moved: Callable[[Ints, Ints], tuple[Ints, Ints, Bools]]) -> None:
        """Take what was seen on the way back in time; moved: gives samples and places there their numbers here, and
        says which of them count."""
        sample, place, good = moved(np.array(back._samples, np.intp), np.array(back._places, np.intp))
        self._samples.extend(sample[good].tolist())
        self._places.extend(place[good].tolist())
        for own, of in ((self._x, back._x), (self._y, back._y)):
            own.extend(np.array(of)[good].tolist())

    def sd(self, sd: Array, radius: Array | float = np.inf) -> Array:
        """px (2, k, n), what surfaces add to the sd (2, k, n) of centroids; 0 where nothing of it is seen.

        radius  (n,) px
        """
        out = np.zeros(sd.shape)
        if not self._places:
            return out
        sample, place = np.array(self._samples), np.array(self._places)
        shift = np.array([self._x, self._y])
        with np.errstate(divide="ignore"):
            grid = np.fmin(np.fmax(SURFACE.grid_of / np.sqrt(radius), SURFACE.grid_px[0]), SURFACE.grid_px[1])
        usual = np.hypot(np.fmax(*median(sd)), grid)
        order, every = np.lexsort((sample, place)), np.arange(sd.shape[1])
        cuts = np.flatnonzero(np.diff(place[order], prepend=-1))
        reach = [extreme.reduceat(shift[:, order], cuts, axis=1) for extreme in (np.maximum, np.minimum)]
        half = (reach[0] - reach[1]).max(axis=0) / 2
        for k in np.flatnonzero(half > SURFACE.plainly * usual[place[order[cuts]]]).tolist():
            own = order[cuts[k] : cuts[k + 1] if k + 1 < cuts.size else None]
            i, at, s = place[own[0]], sample[own], shift[:, own]
            if at.size < SURFACE.fewest:
                continue
            off = np.abs(s - np.array([[median_of(along)] for along in s]))
            scatter = max(1.4826 * median_of(off), float(np.quantile(off, SURFACE.many)) / SURFACE.of_many)
            if scatter > SURFACE.plainly * usual[i]:  # between two looks it may be as large as elsewhere
                off = np.maximum(off, SURFACE.between * scatter)
            else:
                off[off < SURFACE.for_once * usual[i]] = 0
            after = np.minimum(np.searchsorted(at, every), at.size - 1)
            before = np.maximum(np.searchsorted(at, every, side="right") - 1, 0)
            out[:, :, i] = SURFACE.whole * np.maximum(off[:, before], off[:, after])
        return out
