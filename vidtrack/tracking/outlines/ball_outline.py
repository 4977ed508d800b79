"""Pieces of pictures about a ball, laid over each other by its centroids, and the outline that is fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools, Picture
from vidtrack.tracking.outlines.shaded_ball import BALL_FIT, FittedBall, fit_ball, is_cut


@dataclass(frozen=True)
class Lit:
    """When a ball is lit from one side.

    least_px, largest_px  radius of the smallest and the largest ball that is looked at
    full         grey level from which on a pixel may be saturated, also in the mean of several
    drawn_px     radius to which larger ones are reduced before they are fitted
    room, room_px  of the radius, and px: what a piece shows about a ball; ring_px: where its background begins
    level        grey levels, of a ball over its background, at least
    core         of the radius: where the light's slope is looked at
    low          of the level, up to which light shows where a ball lies, dark side and all
    least        of the radius: how far apart middles of light are that count; plainly: times the sd of that; grid_px:
                 what the grid of pixels makes of it in one picture
    agreed       outlines or balls from which on it counts that they agree, and times what chance makes of their mean;
    alone        of the radius, that the middles of fewer are apart
    turning      balls from which on it counts that their ways change evenly with the place, and F of that: 18 to 56 of
                 clips that a lamp lights, 4 at most of 24 that none does
    suspected    times what chance makes of the mean of all balls, from which on stacks of them are fitted
    stacks, beyond  of all balls, and times the chance of their ways' mean: of balls with light from all sides that is
                 0.01 px or less, 0.03 to 0.5 of lit ones; as_sure: of that, its sd besides chance
    unseen       times the middles of light of balls that are not plainly lit from one side, and their chance: how far
                 aside they may be; of those that a lamp behind them lights it is 2.0 and 2.1
    uneven, of_ring  of the level, by which no more than this share of the background may differ: else something is
                 beside the ball
    at_once      pieces that are laid over each other
    fits         of all balls of a recording together; of_each: of a ball; first: of that many balls or a few more,
                 where there are twice as many: where the ways of these may be chance (`suspected`), none is lit
    misfit       of the level, that a fit may leave
    heights      outlines by which it is known how square pixels are, at least; unlike: times its sd that `most` heights
                 are from the median at most, where all are of balls; height_sd: of one, besides what its fit has
    off          of the radius: how far off a centroid is for a slope of one; unknown: of what is uneven, how far a
                 centroid may be off where no fit holds
    least_way    px that ways are at least: less is none
    changes      of a way: how far it usually changes over the places of a ball; steady: by how much `most` ways of one
                 ball may scatter, more is a shadow, a mark or a rope, which come and go
    cut          share of a ball's outlines that are rather cut off by a line, at most: else water or a board hides part
    about        samples over which a radius is averaged
    rounds, outlying  of a field's fit, in which ways weigh less that are off by more than so many times the median
    other        sd of all ways about their field, from which on a ball is lit otherwise, or its light was measured at
                 another threshold, however little its own fit claims to know; it counts alone at `outlying` sd as well
    other_pixels, other_sd, per_other  how far the logarithm of a ball's pixels is from its median, and that of its
                 centroid's sd above it, up to which its way is known; and the share of the way that it is unsure by for
                 each unit more
    """

    least_px: float = 2.3
    largest_px: float = 48.0
    full: float = 250.0
    drawn_px: float = 9.0
    room: float = 1.5
    room_px: float = 4.0
    ring_px: float = 2.5
    level: float = 12.0
    core: float = 0.55
    low: float = 0.3
    least: float = 0.01
    grid_px: float = 0.12
    agreed: tuple[int, float] = (3, 4.0)
    alone: float = 0.05
    turning: tuple[int, float] = (12, 12.0)
    suspected: float = 1.6
    stacks: int = 4
    beyond: float = 2.5
    as_sure: float = 0.2
    unseen: float = 2.0
    plainly: float = 6.0
    uneven: float = 0.2
    of_ring: float = 0.1
    at_once: int = 8
    fits: int = 32
    of_each: int = 8
    first: int = 32
    misfit: float = 0.08
    heights: int = 4
    unlike: float = 3.0
    height_sd: float = 0.01
    off: float = 0.25
    unknown: float = 2.0
    least_way: float = 0.02
    changes: float = 0.15
    steady: float = 0.35
    most: float = 0.75
    cut: float = 0.25
    about: int = 15
    rounds: int = 5
    outlying: float = 3.0
    other: float = 5.0
    other_pixels: float = 0.25
    other_sd: float = 0.5
    per_other: float = 1.0


LIT = Lit()


class Piece(NamedTuple):
    """A ball and what is about it.

    grey    (rows, columns) grey levels 0-255 turned bright, reduced by `shrunk`; at (2,) px, column and row in it of
            the ball's centroid; where (2,) px, that centroid in the picture
    radius  px of the piece, of what is above the threshold; sample: its number; full (rows, columns): where it is
            saturated, None: nowhere
    """

    grey: NDArray[np.float32]
    at: tuple[float, float]
    where: tuple[float, float]
    radius: float
    shrunk: int
    sample: int = 0
    full: Bools | None = None


class Outline(NamedTuple):
    """Of a ball at one place (2,) px: radius, px, of what is above the threshold; the way (2,) to the middle of its
    outline and the sd of that, in such radii. held: a fit holds, or it is lit alike on all sides; else the way is
    nought, and sd as large as it may be. width: of the outline, px, NaN where none was fitted; sample: when it is so;
    height: of it, as that of `FittedBall`; cut: it is rather cut off by a straight line; fit: what it is by
    """

    where: Array
    radius: float
    way: Array
    sd: float
    held: bool
    width: float
    sample: int
    height: tuple[float, float] = (np.nan, np.nan)
    cut: bool = False
    fit: FittedBall | None = None


def piece_of(
    picture: Picture,
    at: Sequence[float],
    pixels: float,
    *,
    lines: int = 1,
    scale: float = 1.0,
    shown: tuple[float | None, int] = (None, 0),
) -> Piece | None:
    """The piece about a ball at column and row `at` of so many pixels; None where it is small, large or at the edge.

    picture  turned bright; scale: grey levels 0-255 a unit; lines: 2 for a field; shown: px of the picture where the
             row is that of a field, and the sample's number
    """
    radius = float(np.sqrt(pixels * lines / np.pi))
    if not (LIT.least_px * lines <= radius <= LIT.largest_px) or not np.isfinite(at).all():
        return None
    shrunk = max(1, int(radius / LIT.drawn_px)) if lines == 1 else 1
    reach = LIT.room * radius + LIT.room_px * shrunk
    wide, high = int(np.ceil(reach)), int(np.ceil(reach / lines))
    column, row = round(float(at[0])), round(float(at[1]))
    left, top, size = column - wide, row - high, 2 * wide + 1
    rows, columns = picture.shape
    spare = -(size) % shrunk
    right, bottom = column + wide + 1 + spare, row + high + 1 + (spare if lines == 1 else 0)
    if left < 0 or top < 0 or right > columns or bottom > rows:
        return None
    grey = picture[top:bottom, left:right].astype(np.float32) * np.float32(scale)
    inside = (float(at[0]) - left, float(at[1]) - top)
    full: Bools | None = grey >= LIT.full if grey.max() >= LIT.full else None
    if shrunk > 1:
        if full is not None:
            full = np.asarray(full.reshape(full.shape[0] // shrunk, shrunk, -1, shrunk).any(axis=(1, 3)))
        grey = grey.reshape(grey.shape[0] // shrunk, shrunk, -1, shrunk).mean(axis=(1, 3))
        inside = ((inside[0] + 0.5) / shrunk - 0.5, (inside[1] + 0.5) / shrunk - 0.5)
    return Piece(
        grey,
        inside,
        (float(at[0]), float(at[1] if shown[0] is None else shown[0])),
        radius / shrunk,
        shrunk,
        shown[1],
        full,
    )


class Laid(NamedTuple):
    """Pieces laid over each other by their centroids, and how many.

    grey    (rows, columns), between pixels, so that the centroid lies in the middle: shows how light falls
    pixels  (rows, columns), by whole pixels, which keep a rim as sharp as it is; at: column and row in it of the
            centroid, within half a pixel of the middle; full: where any piece is saturated, so that the ball is at
            least as bright
    """

    grey: Array
    pixels: Array
    at: tuple[float, float]
    full: Bools
    where: Array
    radius: float
    shrunk: int
    number: int
    sample: int


def by_place(pieces: Sequence[Piece], most: int) -> list[list[Piece]]:
    """Pieces of one ball in groups of such as are near each other, all of them reduced alike."""
    if not pieces:
        return []
    shrunk = int(np.median([one.shrunk for one in pieces]))
    alike = [one for one in pieces if one.shrunk == shrunk]
    if not alike:
        return []
    where = np.array([one.where for one in alike])
    off = where - where.mean(axis=0)
    _, axes = np.linalg.eigh(off.T @ off)
    ordered = [alike[k] for k in np.argsort(off @ axes[:, 1], kind="stable")]
    groups = max(1, min(most, len(ordered) // (LIT.at_once // 2)))
    parts = np.array_split(np.arange(len(ordered)), groups)
    even = [part[np.unique(np.linspace(0, part.size - 1, min(part.size, LIT.at_once)).astype(int))] for part in parts]
    return [[ordered[k] for k in part] for part in even]


def laid_over(pieces: Sequence[Piece], lines: int) -> Laid:
    """Pieces of a ball, all reduced alike, laid over each other.

    A rim is sharper than what lies between pixels can be made of its neighbours: outlines of that were 0.03 px off. By
    whole pixels each place keeps up to half a pixel, which widens the blur that is fitted and moves nothing.
    """
    radius = float(np.median([one.radius for one in pieces]))
    wide = int(min(min(one.at[0], one.grey.shape[1] - 1 - one.at[0]) for one in pieces))
    high = int(min(min(one.at[1], one.grey.shape[0] - 1 - one.at[1]) for one in pieces))
    across, down = np.arange(-wide, wide + 1.0), np.arange(-high, high + 1.0)
    total, whole = np.zeros((2, down.size, across.size))
    full, rest = np.zeros(total.shape, bool), np.zeros(2)
    for one in pieces:
        x, y = np.meshgrid((one.at[0] + across).astype(np.float32), (one.at[1] + down).astype(np.float32))
        total += cv2.remap(one.grey, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        column, row = _nearest(one.at[0], wide, one.grey.shape[1]), _nearest(one.at[1], high, one.grey.shape[0])
        about = slice(row - high, row + high + 1), slice(column - wide, column + wide + 1)
        whole += one.grey[about]
        rest += one.at[0] - column, one.at[1] - row
        if one.full is not None:
            full |= one.full[about]
    at = rest / len(pieces) + (wide, high)
    places = np.array([one.where for one in pieces])
    where = places.mean(axis=0)
    nearest = int(np.hypot(*(places - where).T).argmin())  # a ball that swings is at a place at many times
    sample = pieces[nearest].sample
    n, middle = len(pieces), (float(at[0]), float(at[1]))
    return Laid(total / n, whole / n, middle, full, where, radius, pieces[0].shrunk, n, sample)


def _nearest(at: float, reach: int, size: int) -> int:
    """The pixel nearest to `at` about which so many lie on both sides."""
    return int(np.clip(round(at), reach, size - 1 - reach))


class Light(NamedTuple):
    """How a laid ball looks: its level over the ground, grey levels; aside (2,): the way from the middle of its light
    to that of its light up to `LIT.low` of the level, with what its slope makes of it, radii; plainly: it is no noise.
    """

    laid: Laid
    level: float
    aside: Array
    plainly: bool


def light_of(laid: Laid, noise: float, lines: int) -> Light | None:
    """None where the ball is too dim, or not alone. noise: grey levels, of a pixel of what is laid over each other."""
    rows, columns = laid.grey.shape
    x, y = np.arange(columns) - columns // 2, lines * (np.arange(rows) - rows // 2)[:, None]
    r = np.sqrt(x * x + y * y)
    ring, core = r > laid.radius + LIT.ring_px, r < max(LIT.core * laid.radius, 1.1 * lines)
    if not ring.any():
        return None
    ground = float(np.median(laid.grey[ring]))
    over = laid.grey - ground
    level = float(over[core].mean())
    if level < LIT.level or np.mean(np.abs(over[ring]) > LIT.uneven * level) > LIT.of_ring:
        return None
    slope = np.array([float((over * core * one).sum() / (core * one * one).sum()) for one in (x, y)])
    low = np.clip(over, 0, LIT.low * level) * (r < LIT.room * laid.radius)
    aside = np.array([float((low * one).sum() / low.sum()) for one in (x, y)]) / laid.radius
    aside -= LIT.off * slope * laid.radius / level
    noisy = noise * np.sqrt((x * x * (low > 0)).sum()) / low.sum() / laid.radius
    grid = LIT.grid_px / laid.radius / np.sqrt(laid.number)
    return Light(laid, level, aside, bool(np.hypot(*aside) > max(LIT.least + grid, LIT.plainly * noisy)))


def outline_of(
    seen: Light, noise: float, lines: int, height: float | None = None, before: Outline | None = None
) -> Outline:
    """Fit the outline of a ball; noise and lines as those of `light_of`, height as that of `fit_ball`; before: what was
    found without it, where it is known only now.
    """
    laid = seen.laid
    own = laid.radius * laid.shrunk
    begun = before.fit if before else None
    fit = fit_ball(
        laid.pixels,
        laid.at,
        laid.radius,
        noise,
        lines=lines,
        height=height,
        begun=begun,
        full=laid.full,
        aside=seen.plainly,
    )
    held = fit is not None and fit.misfit <= LIT.misfit and fit.radius >= BALL_FIT.smallest * laid.radius
    cut = before.cut if before else seen.plainly
    if cut and not before:
        cut = is_cut(laid.pixels, laid.at, laid.radius, noise, fit, lines=lines, held=held, full=laid.full)
    if fit is None or not held:
        sd = LIT.unknown * min(float(np.hypot(*seen.aside)), 0.5)
        return Outline(laid.where, own, np.zeros(2), sd, not seen.plainly, np.nan, laid.sample, cut=cut, fit=fit)
    width, way, sd = 2 * fit.radius * laid.shrunk, fit.way / laid.radius, fit.sd / laid.radius
    return Outline(laid.where, own, way, sd, True, width, laid.sample, fit.height, cut, fit)
