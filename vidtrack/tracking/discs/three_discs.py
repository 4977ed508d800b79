"""A blob that three discs explain and one does not: three balls side by side, or in a row, none of them seen alone.

Three alike discs about a middle are as round as one by their second moments; what differs is how far the moments reach,
2 pi (xx + yy) / area, which is 1 for a disc and 1.03 to 1.16 for three, and that the outline has three lobes: these
lie along the angle of sum (u + iv)^3, a third of it. From there the discs are fitted together, as in `two_discs`.
A ball drawn out by its motion looks like three in a row: what a streak explains is none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.centroiding.streak import streak_left
from vidtrack.tracking.discs.clump import Clump, allowed, elongation
from vidtrack.tracking.discs.joint_fit import JOINT_FIT
from vidtrack.tracking.discs.two_discs import TWO_DISCS


@dataclass(frozen=True)
class ThreeDiscs:
    """When a blob may be three discs, and where the fit of them begins.

    reach       of its second moments, 2 pi (xx + yy) / area, from which it is looked at; rough: below so many pixels
                the grid alone makes more, and it is looked at from `rough_reach`
    fewest      pixels of a blob in which three discs show their lobes: those of 3.6 px radius, a radius apart, have 90
    lobes       |sum z^3| / sum |z|^3 of its pixels, from which it has three: discs of 3.6 px and more have 0.18 at
                most, three of them 0.22 and more where their middles are a radius apart
    spacings    of the radius, between neighbours, with the area of all three over that of one
    """

    reach: float = 1.012
    rough: int = 150
    fewest: int = 90
    rough_reach: float = 1.03
    lobes: float = 0.18
    spacings: tuple[tuple[float, float], ...] = ((1.0, 2.05), (1.5, 2.59), (1.9, 2.96))


THREE_DISCS = ThreeDiscs()


def reach(pixels: Array, xx: Array, yy: Array) -> Array:
    """How far blobs of so many pixels reach by their second moments, px^2: 1 for a disc."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(2 * np.pi * (xx + yy) / pixels)


def reaching(pixels: Array, xx: Array, yy: Array) -> Bools:
    """Which blobs reach farther than a disc of so many pixels, by their second moments, px^2."""
    least = np.where(pixels < THREE_DISCS.rough, THREE_DISCS.rough_reach, THREE_DISCS.reach)
    return np.asarray((reach(pixels, xx, yy) > least) & (pixels >= THREE_DISCS.fewest))


def three_discs(clump: Clump) -> float | None:
    """Pixels of one of the three discs that a blob is; None where it is not plainly three."""
    lines = clump.lines
    off = clump.pixels - clump.middle
    starts = list(_starts(off[:, 0] + 1j * off[:, 1] * lines, len(off) * lines))
    if not starts or not clump.one_leaves or _is_streak(clump):
        return None
    for way, radius in starts:
        at = clump.middle[:, None] + np.stack([way.real, way.imag / lines])
        axes = np.log(np.array([[radius], [radius / lines]])) * np.ones(3)
        piece = clump.about(at[0], at[1], np.exp(axes))
        if clump.light(piece) <= 0:
            continue
        fit = clump.fitted(piece, at[0], at[1], axes)
        if not np.isfinite(fit.shape).all():
            continue
        little = allowed(max(clump.noise, piece.noise), float(np.exp(fit.shape[2]).min()))
        squashed = np.abs(fit.shape[0] - fit.shape[1] - np.log(lines)).max()
        spread = [float(np.ptp(own)) for own in (fit.shape[:2].mean(axis=0), fit.shape[2])]
        apart = np.abs(np.subtract.outer(own := fit.x + 1j * fit.y * lines, own)[np.triu_indices(3, 1)])
        alike = squashed < TWO_DISCS.round and spread[0] < TWO_DISCS.alike and spread[1] < TWO_DISCS.light
        plain = fit.left < min(little, TWO_DISCS.of_one * clump.one_leaves)
        if alike and plain and apart.min() > TWO_DISCS.apart * float(np.exp(fit.shape[0].mean())):
            return float(np.pi * np.exp(fit.shape[:2].sum(axis=0)).max())
    return None


def _is_streak(clump: Clump) -> bool:
    """Whether a single disc that moved while the shutter was open explains a blob."""
    border = np.sqrt(4 * np.array(clump.moments[:2])) / (1, clump.lines)
    piece = clump.about(clump.middle[:1], clump.middle[1:], border[:, None])
    row, column = np.ogrid[: clump.blob.shape[0], : clump.blob.shape[1]]
    reaches = border + JOINT_FIT.reach_px
    used = (np.abs(column - clump.middle[0]) < reaches[0]) & (np.abs(row - clump.middle[1]) < reaches[1])
    used &= ~clump.hidden & ~piece.clipped
    left = streak_left(piece.over, used, clump.blob, clump.lines)
    return left < allowed(max(clump.noise, piece.noise), clump.light(piece))


def _starts(z: NDArray[np.complex128], area: float) -> Iterator[tuple[NDArray[np.complex128], float]]:
    """Where three discs may lie about their middle (3,), px, and their radius; a blob of pixels z (n,), px."""
    square = (z**2).mean()
    long = float(elongation(*(np.array(v) for v in ((z.real**2).mean(), (z.imag**2).mean(), (z.real * z.imag).mean()))))
    three = abs((z**3).sum()) > THREE_DISCS.lobes * (np.abs(z) ** 3).sum()
    lobes = np.exp(1j * (np.angle((z**3).sum()) / 3 + 2 * np.pi * np.arange(3) / 3))
    along = np.exp(0.5j * np.angle(square)) * np.array([-1.0, 0.0, 1.0])
    for spacing, ratio in THREE_DISCS.spacings:
        radius = float(np.sqrt(area / np.pi / ratio))
        if three:
            yield lobes * radius * spacing / np.sqrt(3), radius
        if long > 2 * TWO_DISCS.elongated:
            yield along * radius * spacing, radius
