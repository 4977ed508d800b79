"""Discs of which something dark in front hides a part, measured by the pixels that show them.

What is in front (a rope, a mast) is as dark as the background or darker, and is seen only as dark pixels of the disc.
Where the disc is comes in two steps. Its share of each pixel is laid over the picture at places about the expected one:
the place that takes in most of the light is where the fewest pixels contradict it, whatever the hidden ones show (a
truncated loss, as of Blake and Zisserman 1987). Then the dark pixels in it and those about them are left out of an
ordinary fit of a disc of known size, again until neither moves. Of several discs that touch each other, each is laid
over what the others leave of the light, and all are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.tracking.discs.fit_apart import Piece, each_its_own, explained, without_background
from vidtrack.tracking.discs.joint_fit import JOINT_FIT, Joint, Shapes, fit_together, shapes_of


@dataclass(frozen=True)
class HalfHidden:
    """When a disc of which a part is hidden is measured.

    reach, reach_px  of a half axis, and px besides, about its expected place in which it is looked for
    dark          of the disc's light: a pixel in it that shows less is hidden
    rim_px        about hidden pixels, which the blurred edge of what hides them reaches
    soft_px       blur, from which on such an edge reaches a px farther
    below         of the light, by which what is darker than the background is something in front of that too
    shown         share of the disc's pixels that must be left to the fit
    rounds        of the fit, at most; settled_px: a step that ends them, unsettled_px: one that refuses the last
    misfit        of the light: rms that the fit may leave, besides twice the noise
    known_to      of a half axis, and known_to_px besides: a larger sd is no measurement
    grown         sd as 1500 drawn discs show it, over that of the fit
    usual         sd of log half axes, of the light (share) and of log blur, as the usual looks of a target say them
    other         |log| of the ratio of half axes by which a disc is another one
    fill, aspect  of the box that the usual looks must fill, and |log| of the ratio of its sides, beside a px over the
                  diameter, for those of a whole disc; several: the same of those that touch, of which less is certain
    """

    reach: float = 0.7
    reach_px: float = 2.0
    dark: float = 0.5
    rim_px: int = 2
    soft_px: float = 0.8
    below: float = 0.06
    shown: float = 0.04
    rounds: int = 4
    settled_px: float = 0.02
    unsettled_px: float = 0.3
    misfit: float = 0.04
    known_to: float = 0.06
    known_to_px: float = 0.05
    grown: float = 1.15
    usual: tuple[float, float, float, float] = (0.08, 0.08, 0.12, 0.4)
    other: float = 0.25
    fill: float = 0.68
    aspect: float = 0.3
    several: float = 0.12


HALF_HIDDEN = HalfHidden()
_RIM = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * HALF_HIDDEN.rim_px + 1,) * 2).astype(np.uint8)
_CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)


def usual_disc(usual: Array) -> Shapes | None:
    """The shapes (SHAPE, m) of targets with usual looks (4, m): pixels, contrast, width and height, px; None where one
    is not known, or no disc.
    """
    pixels, contrast, width, height = usual
    if not np.isfinite(usual).all() or not (pixels > HALF_HIDDEN.fill * (width - 1) * (height - 1)).all():
        return None
    most = HALF_HIDDEN.aspect if pixels.size == 1 else HALF_HIDDEN.several
    if (np.abs(np.log(width / height)) > most + 1 / np.maximum(width, height)).any():
        return None
    value = shapes_of(pixels, usual[2:], contrast).value
    return Shapes(value, np.repeat(np.array(HALF_HIDDEN.usual)[:, None], pixels.size, axis=1))


def below_background(light: Array, noise: float) -> float:
    """Grey levels by which a pixel is darker than the background where something is in front of that too.

    light (m,) of the discs beside it, grey levels; noise: grey levels, of a pixel
    """
    return max(4 * noise, HALF_HIDDEN.below * float(light.min()))


def fit_half_hidden(
    grey: NDArray[np.float32],
    hidden: NDArray[np.bool_],
    x: Array,
    y: Array,
    known: Shapes,
    noise: float,
    *,
    beside: bool = False,
) -> tuple[Joint | None, Piece]:
    """The discs of known shapes (SHAPE, m), expected at x, y (m,) px of the piece; None where the fit does not hold.

    grey    (height, width) grey levels; hidden: what something else may light; noise: grey levels, of a pixel
    beside  whether something darker than the background that only touches a disc is left out too; otherwise something
            dark must hide a part of it
    """
    axes, light = np.exp(known.value[:2]), np.exp(known.value[2])
    piece = without_background(grey, hidden, x, y, axes, noise)
    limit = below_background(light, noise)
    front = _about(piece.over < -limit)
    piece = without_background(grey, hidden | front, x, y, axes, noise)
    of_all, noise = noise, max(noise, piece.noise)
    reach = axes + JOINT_FIT.reach_px
    at, fit, step = _all_sought(piece.over, ~hidden, x, y, axes, light), None, np.inf
    soft = False
    for _ in range(HALF_HIDDEN.rounds):
        inside = np.stack([_inside(grey.shape, x0, y0, own) for (x0, y0), own in zip(at, axes.T, strict=True)])
        dark = inside.any(axis=0) & (piece.over < HALF_HIDDEN.dark * light.min())
        if not dark.any() and not (beside and _meets(front, at[:, 0], at[:, 1], reach)):
            return None, piece
        free = ~hidden & ~_about(dark | (piece.over < -limit), soft)
        if ((free & inside).sum(axis=(1, 2)) < HALF_HIDDEN.shown * inside.sum(axis=(1, 2))).any():
            return None, piece
        fit = fit_together(piece.over, free, piece.clipped, at[:, 0], at[:, 1], known, noise)
        now = np.stack([fit.x, fit.y], axis=1)
        at, step, light = now, float(np.hypot(*(now - at).T).max()), np.exp(fit.shape[2])
        if not soft and np.exp(fit.shape[3].max()) > HALF_HIDDEN.soft_px:
            soft, step = True, np.inf
        if step < HALF_HIDDEN.settled_px:
            break
    if fit is None or not fit.good or not explained(fit, of_all) or step > HALF_HIDDEN.unsettled_px:
        return None, piece
    fit = fit._replace(sd_x=HALF_HIDDEN.grown * fit.sd_x, sd_y=HALF_HIDDEN.grown * fit.sd_y)
    away = np.abs([fit.x - x, fit.y - y])
    good = bool((np.abs(fit.shape[:2] - known.value[:2]) < HALF_HIDDEN.other).all())
    good &= fit.left < max(2 * noise, HALF_HIDDEN.misfit * float(light.min()))
    good &= bool((away < HALF_HIDDEN.reach * axes + HALF_HIDDEN.reach_px).all()) and each_its_own(fit, x, y)
    good &= bool((np.stack([fit.sd_x, fit.sd_y]) < HALF_HIDDEN.known_to * axes + HALF_HIDDEN.known_to_px).all())
    return (fit if good else None), piece


def _inside(shape: tuple[int, ...], x: float, y: float, axes: Array) -> Bools:
    """Pixels of a piece that a disc at x, y covers wholly."""
    row, column = np.ogrid[: shape[0], : shape[1]]
    a, c = np.maximum(axes - 0.7, 0.5)
    return np.asarray(((column - x) / a) ** 2 + ((row - y) / c) ** 2 < 1)


def _meets(mask: Bools, x: Array, y: Array, axes: Array) -> bool:
    """Whether any of these pixels is in one of the ellipses at x, y (m,) with half axes (2, m)."""
    return any((mask & _inside(mask.shape, *own)).any() for own in zip(x, y, axes.T, strict=True))


def _about(mask: Bools, soft: bool = False) -> Bools:
    """These pixels and what lies within HALF_HIDDEN.rim_px of them, a px more where edges are soft."""
    wide = cv2.dilate(mask.astype(np.uint8), _RIM)
    return np.asarray((cv2.dilate(wide, _CROSS) if soft else wide) > 0)


def _all_sought(over: NDArray[np.float32], free: Bools, x: Array, y: Array, axes: Array, light: Array) -> Array:
    """Places (m, 2) about x, y at which each disc takes in most of the light that the others leave."""
    at = np.stack([x, y], axis=1).astype(float)
    for _ in range(min(x.size, 2)):
        for i in range(x.size):
            left = free.copy()
            for j in range(x.size):
                if j != i:
                    left &= ~_inside(over.shape, at[j, 0], at[j, 1], axes[:, j] + 1)
            at[i] = _sought(over, left, float(x[i]), float(y[i]), axes[:, i], float(light[i]))
    return at


def _sought(
    over: NDArray[np.float32], free: Bools, x: float, y: float, axes: Array, light: float
) -> tuple[float, float]:
    """The place about x, y, to half a pixel, at which a disc takes in most light."""
    bright = (np.clip(over / light, 0, 1) * free).astype(np.float32)
    rows, columns = bright.shape
    half = np.ceil(axes + 1).astype(int)
    row, column = np.mgrid[-half[1] : half[1] + 1, -half[0] : half[0] + 1]
    room = HALF_HIDDEN.reach * axes + HALF_HIDDEN.reach_px
    best, place = -np.inf, (x, y)
    for dx, dy in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        away = np.hypot((column - dx) / axes[0], (row - dy) / axes[1])
        share = np.clip((1 - away) * axes.mean() + 0.5, 0, 1).astype(np.float32)
        left, right = max(0, int(np.ceil(x - room[0] - dx))), min(columns - 1, int(x + room[0] - dx))
        top, bottom = max(0, int(np.ceil(y - room[1] - dy))), min(rows - 1, int(y + room[1] - dy))
        if left > right or top > bottom:
            continue
        taken = cv2.filter2D(bright, -1, share, borderType=cv2.BORDER_CONSTANT)[top : bottom + 1, left : right + 1]
        i, j = divmod(int(taken.argmax()), taken.shape[1])
        if taken[i, j] > best:
            best, place = float(taken[i, j]), (left + j + dx, top + i + dy)
    return place
