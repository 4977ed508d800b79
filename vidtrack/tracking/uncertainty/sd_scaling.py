"""What the sd of a centroid must hold besides noise and contrast: clipped rims, half-lit targets, scattering tracks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.tracking.centroiding.order_statistics import median
from vidtrack.tracking.centroiding.surface import Surfaces
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.outlines.lighting import Lighting
from vidtrack.tracking.outlines.rims import Rims
from vidtrack.tracking.state import MASS, PIXELS, SATURATED, SD_X, SD_Y, Rows, X, Y
from vidtrack.tracking.uncertainty.coding_noise import Coded, others_with_level, with_coding_noise
from vidtrack.tracking.uncertainty.empirical_sd import scatter
from vidtrack.tracking.uncertainty.shape_change import ShapeEvidence, shape_evidence_of_others
from vidtrack.tracking.uncertainty.shared_blob import lost_pairs_sd, shared_blob_sd


@dataclass(frozen=True)
class Growth:
    """What makes centroids worse than their noise says.

    clipped  px, what saturation adds to the sd of a target of one pixel's area; to whole pixels it adds nothing
    grid     px, what the grid of pixels adds to the weighted mean of a target of `grid_pixels`, and the power of their
             number with which it falls: of discs of 1.5 to 9 px without noise, edges blurred by 0 to 1 px
    passing  samples before and after in which a target's mass changes where the edge of a shadow, or of light, goes
             over it
    sudden   share of its mass by which it changes then
    """

    clipped: tuple[tuple[str, float], ...] = (("weighted", 0.053), ("ellipse", 0.027), ("binary", 0.0))
    grid: float = 0.0055
    grid_pixels: float = 12.6
    grid_power: float = 0.65
    passing: int = 3
    sudden: float = 0.15


GROWTH = Growth()


def grow_sd(
    rows: Rows,
    time: Array,
    shapes: ShapeEvidence | None = None,
    surfaces: Surfaces | None = None,
    rims: Rims | None = None,
    *,
    lines: int,
    kind: str,
    copied: bool = False,
    lit: Lighting | None = None,
) -> Coded:
    """Grow the sd of all centroids to how the tracks scatter, with what shapes, surfaces and rims say, in place: rows
    of two hours are too large for a second copy. By how much they scatter.

    lit: how targets are lit, where that is from one side: they are moved to the middle of their outline

    time  (samples,) in samples; lines: of the frame buffer to a row; kind: of centroid, as in `measure`
    copied  whether pictures are built on others
    """
    values = rows.values
    sd = values[[SD_X, SD_Y]]
    measured = np.hypot(*sd) if lit else None
    if kind == "weighted":
        sd = np.hypot(sd, _sampled(rows, lines))
    if (rows.flag & SATURATED).any():
        sd = np.hypot(sd, _clipped(rows, lines, kind))
    if (moved := _half_lit(rows, lines)).any():
        sd = np.hypot(sd, moved)
    del moved
    position = values[[X, Y]] if shapes is None else shapes.position
    light = values[MASS], values[PIXELS]
    seen = scatter(position, sd, *light, time, lines=lines)
    sd, grown = with_coding_noise(position, sd, *light, time, seen, lines=lines, copied=copied)
    if shapes is not None:  # what they add is of single samples: it is no scatter of all
        sd = np.hypot(sd, shapes.sd)
        if (shared := shared_blob_sd(rows, time, shapes.exposure)).any():
            sd = np.hypot(sd, shared)
        del shared
    values[[X, Y]] = position
    own = sd
    if surfaces is not None:
        radius = np.sqrt(lines * median(values[PIXELS]) / np.pi)
        sd = np.hypot(own, surfaces.sd(own, radius))
    if rims is not None:
        ways = lit.ways_of_all(position, values[PIXELS], measured, lines) if lit and measured is not None else None
        values[[X, Y]], sd = rims.corrected(position, sd, own, ways)
    values[[SD_X, SD_Y]] = sd
    return grown


def others_with_grown_sd(
    others: Others,
    rows: Rows,
    time: Array,
    grown: Coded,
    shapes: ShapeEvidence,
    *,
    lines: int,
    lit: Lighting | None = None,
) -> Others:
    """The samples of all other tracks, as those of the targets: with the sd grown, and with what their shapes say.

    time  (samples,); rows, grown, shapes, lit: of the targets
    """
    values, shared = others.values.copy(), lost_pairs_sd(others, rows, time, shapes.exposure)
    position, sd = shape_evidence_of_others(values, others.track, others.sample, time, shapes, lines)
    own = others_with_level(values[[SD_X, SD_Y]], values[MASS], values[PIXELS], grown, lines)
    sd = np.hypot(np.hypot(own, sd), shared)
    if lit is not None:
        way, more = lit.ways(-1, position, np.sqrt(lines * values[PIXELS] / np.pi))
        position, sd = position + way, np.hypot(sd, more)
    values[[X, Y]], values[[SD_X, SD_Y]] = position, sd
    return others._replace(values=values)


def _sampled(rows: Rows, lines: int) -> Array:
    """What the grid of pixels adds to the sd of weighted means (2, samples, n), px; 0 where `_clipped` says it."""
    with np.errstate(divide="ignore"):
        share = (lines * rows.values[PIXELS] / GROWTH.grid_pixels) ** -GROWTH.grid_power
    own = np.where(rows.flag & SATURATED, 0.0, GROWTH.grid * share)
    return np.stack([own, lines * own])


def _clipped(rows: Rows, lines: int, kind: str) -> Array:
    """What the rims of saturated targets add to their sd (2, samples, n), px; 0 for the others.

    A pixel on the rim shows its share of the target only up to full scale, and the rim that is left is half as wide
    or less: of the error of counting whole pixels, which goes with 1 / sqrt(radius), a seventh is left to the weighted
    mean, half of that to a fitted disc, where the edge is blurred by half a px and overexposed twice to twenty times.
    """
    with np.errstate(divide="ignore"):
        of_rim = np.where(rows.flag & SATURATED, dict(GROWTH.clipped)[kind] * rows.values[PIXELS] ** -0.25, 0.0)
    return np.stack([of_rim, lines * of_rim])


def _half_lit(rows: Rows, lines: int) -> Array:
    """What an edge of light or shadow that goes over a target adds to its sd (samples, n), px; 0 where none does.

    Some samples before or after, its mass is another. A shadow that takes a share from one half of a disc moves the
    centroid by up to a quarter of the radius times that share.
    """
    mass, moved = rows.values[MASS], np.zeros(rows.flag.shape)
    if not len(mass):
        return moved
    with np.errstate(invalid="ignore"):
        some = np.flatnonzero(1 - np.fmin.reduce(mass) / np.fmax.reduce(mass) > GROWTH.sudden)
    if not some.size:
        return moved
    mass = mass[:, some]
    most, least = mass.copy(), mass.copy()
    for shift in range(1, GROWTH.passing + 1):
        for to, of in ((slice(shift, None), slice(None, -shift)), (slice(None, -shift), slice(shift, None))):
            np.fmax(most[to], mass[of], out=most[to])
            np.fmin(least[to], mass[of], out=least[to])
    change = np.nan_to_num(1 - least / most)
    usual = np.nanmedian(np.where(np.isfinite(mass), change, np.nan), axis=0)
    change[change <= np.maximum(GROWTH.sudden, 5 * usual)] = 0
    moved[:, some] = np.nan_to_num(0.25 * change * np.sqrt(lines * rows.values[PIXELS][:, some] / np.pi))
    return moved
