"""Interlaced video: the two fields of a frame are two pictures, half a frame apart in time.

A frame of tape video weaves them: the top field has rows 0, 2, 4, ..., the bottom field rows 1, 3, 5, ...
Row r of the field of parity p (top 0, bottom 1) lies at Yf = 2 r + p of the frame buffer, so that both fields
have the frame's coordinates. Which of them came first is a convention of the equipment, often flagged wrongly or
not at all; a wrong order moves every sample by half the distance that the target goes in a frame. The motion
itself knows: a target that moves by v px a frame stands v/2 px further in the field that came later.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.timing.frame import Luma

PARITY = {"top": 0, "bottom": 1}

CERTAIN = 1 - 3.2e-5
"""How sure pictures must be of an order: 4 sd, and by Student's distribution more where few pictures moved."""

MOVED = 5
"""Positions that moved by three times their scatter, at least: the noise of smaller velocities draws the slope to 0."""

_OFFSET = 0.3
"""px, 1 sd: how far apart the two fields may show a target at rest (light on the lines, jitter of a tape)."""


class Field(NamedTuple):
    """One field of a frame.

    name    "top" or "bottom"
    parity  0 or 1: its row r lies at Yf = 2 r + parity
    offset  frames by which it is later than its frame: 0 or 0.5
    luma    (about height/2, width), a view of the frame's
    """

    name: str
    parity: int
    offset: float
    luma: Luma


class Order(NamedTuple):
    """What the motion says of the order of the fields.

    order    "top", "bottom", "progressive" (both at one time), or "unknown" when the motion does not decide
    slope    what was measured: +0.5 top first, -0.5 bottom first, 0 progressive; NaN without motion
    sd       its standard error; NaN without motion
    n        how many samples moved
    combing  how far a frame's own fields differ where it moves, against those of its neighbours: 0 to 0.25 progressive,
             0.4 to 1 interlaced, even where the order cannot be found; NaN where whole pictures were not examined
    """

    order: str
    slope: float
    sd: float
    n: int
    combing: float = np.nan


def split(luma: Luma, order: str) -> tuple[Field, Field]:
    """The two fields of a frame, in order of time, as views.

    luma   (height, width)
    order  "top" or "bottom": the field that came first. Raises ValueError for anything else.
    """
    if order not in PARITY:
        raise ValueError(f"the order of fields is 'top' or 'bottom', not {order!r}")
    second = "bottom" if order == "top" else "top"
    return (
        Field(order, PARITY[order], 0.0, luma[PARITY[order] :: 2]),
        Field(second, PARITY[second], 0.5, luma[PARITY[second] :: 2]),
    )


def offsets(names: ArrayLike, order: str) -> Array:
    """Frames after the frame's own time at which samples were taken, in the shape of `names`.

    names  array of "frame", "top" or "bottom"
    order  "top", "bottom", or "progressive" (or "unknown"): then every sample is at its frame's time
    """
    names = np.asarray(names)
    if order not in PARITY:
        return np.zeros(names.shape)
    return np.where((names == "frame") | (names == order), 0.0, 0.5)


def order_from_motion(top: ArrayLike, bottom: ArrayLike) -> Order:
    """The order of the fields from where targets were found in each: the slope of bottom minus top on velocity.

    top, bottom  (n_frames, ..., 2) px, frame-buffer positions of the same targets in the top and the bottom field of
                 consecutive frames; NaN where one was not found
    Each target and axis may have an offset of its own between the fields (uneven light on the lines, jitter of a
    tape); outliers beyond 4 robust sd are left out. `order` is "unknown" unless the slope is known to 0.1 or better
    and lies within 0.2 of +0.5, -0.5 or 0, and MOVED positions or more moved.

        bottom - top = offset + slope * velocity,   velocity = (mean(t + 1) - mean(t - 1)) / 2
    """
    top, bottom = np.asarray(top, float), np.asarray(bottom, float)
    if top.shape != bottom.shape or top.shape[-1] != 2:
        raise ValueError(f"top and bottom must be (n_frames, ..., 2) alike, not {top.shape} and {bottom.shape}")
    n = len(top)
    mean = ((top + bottom) / 2).reshape(n, -1)
    later = (bottom - top).reshape(n, -1)[1:-1]
    velocity = (mean[2:] - mean[:-2]) / 2
    good = np.isfinite(later) & np.isfinite(velocity)
    slope, sd, moved = _common_slope(later, velocity, good)
    order = _decided(slope, sd) if moved >= MOVED else "unknown"
    return Order(order, slope, sd, moved)


def _common_slope(y: Array, x: Array, good: NDArray[np.bool_]) -> tuple[float, float, int]:
    """The slope that columns of y on x share, each with its own small offset, its standard error and how many moved.

    A first slope that outliers cannot pull (the median of the ratios, weighted by how fast), then least squares
    over what lies near it. An offset is allowed for by taking off most, not all, of a column's mean (the random
    effect's share): a target that moves evenly would give no answer otherwise.
    """
    slope, sigma = _weighted_median(y[good] / np.where(x[good] == 0, np.nan, x[good]), np.abs(x[good])), 0.0
    for _ in range(6):
        error = y - slope * x
        middle = _column_median(np.where(good, error, np.nan))
        sigma = 1.4826 * float(np.median(np.abs((error - middle)[good]))) + 1e-6 if good.any() else np.nan
        near = good & (np.abs(error - middle) <= 4 * sigma)
        count = near.sum(0)
        share = 1 - np.sqrt(sigma**2 / (sigma**2 + count * _OFFSET**2))
        yc, xc = (np.where(near, z - share * np.where(near, z, 0).sum(0) / np.maximum(count, 1), 0) for z in (y, x))
        spread, dof = float((xc * xc).sum()), int(near.sum() - (count > 0).sum()) - 1
        if dof < 5 or not spread > 0:
            return np.nan, np.nan, 0
        slope = float((xc * yc).sum()) / spread
    sd = float(np.sqrt(((yc - slope * xc) ** 2).sum() / dof / spread))
    return slope, sd, int((np.abs(x[near]) > 3 * sigma).sum())


def _weighted_median(values: Array, weights: Array) -> float:
    known = np.isfinite(values)
    values, weights = values[known], weights[known]
    if not weights.sum() > 0:
        return 0.0
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def _column_median(values: Array) -> Array:
    """Medians of the columns, NaN left out; 0 where there is nothing else."""
    values = np.sort(values, axis=0)
    count = np.isfinite(values).sum(axis=0)
    column = np.arange(values.shape[1])
    low, high = (values[np.maximum(place, 0), column] for place in ((count - 1) // 2, count // 2))
    return np.where(count, (low + high) / 2, 0.0)


def _decided(slope: float, sd: float) -> str:
    if not sd <= 0.1:
        return "unknown"
    for name, value in (("top", 0.5), ("bottom", -0.5), ("progressive", 0.0)):
        if abs(slope - value) <= 0.2:
            return name
    return "unknown"


def order_from_pictures(pictures: Iterable[Luma], *, contrast: float = 0.08) -> Order:
    """The order of the fields from whole pictures, before anything is tracked; 20 to 60 frames with motion are enough.

    pictures  consecutive (height, width) frames; may be views that last until the next (one copy is kept)
    contrast  share of the picture's range by which a pixel must change between frames to count as moving

    Where something moves, fields that are nearer in time are more alike. Let t, b be the fields of a frame and t0, b0
    those of the frame before; take the distance in time for the measure of unlikeness. Then |b - t0| - |b0 - t| over
    the sum of both and |b - t| is (1.5 - 0.5)/2.5 = +0.4 for top first, -0.4 for bottom first and 0 when both were
    taken at once; and |b - t|, the combing, is small against the others only in the last case. `slope` is the
    measure times 1.25, so that it compares with `order_from_motion`; it shrinks when a target jumps by its own size.
    """
    before: Luma | None = None
    scores = []
    for picture in pictures:
        now = picture[: picture.shape[0] // 2 * 2].astype(np.float32)
        if before is not None:
            scores.append(_unlikeness(before, now, contrast))
        before = now
    found = np.array([score for score in scores if np.isfinite(score[0])]).reshape(-1, 2)
    n = len(found)
    if n < 3:
        return Order("unknown", np.nan, np.nan, n)
    slope, combing = float(found[:, 0].mean()), float(found[:, 1].mean())
    sd = float(found[:, 0].std(ddof=1) / np.sqrt(n))
    if combing > 0.25 and abs(slope) > 0.03 and _student_within(abs(slope), sd, n - 1) > 2 * CERTAIN - 1:
        return Order("top" if slope > 0 else "bottom", slope, sd, n, combing)
    return Order("progressive" if combing < 0.25 else "unknown", slope, sd, n, combing)


def _student_within(deviation: float, sd: float, freedom: int) -> float:
    """How often a deviate of Student's distribution, of so many degrees of freedom, is smaller than deviation / sd.

    The finite series of Abramowitz and Stegun, 26.7.3 and 26.7.4; scipy's takes 0.3 s to import, a tenth of what it
    takes to track a minute of tape.
    """
    angle = float(np.arctan2(deviation, sd * np.sqrt(freedom)))
    sine, square = np.sin(angle), np.cos(angle) ** 2
    odd = freedom % 2
    term, total = (np.cos(angle) if odd else 1.0), 0.0
    for k in range(freedom // 2):
        total += term
        term *= square * (2 * k + 1 + odd) / (2 * k + 2 + odd)
    return float(2 / np.pi * (angle + sine * total) if odd else sine * total)


def _unlikeness(before: Luma, now: Luma, contrast: float) -> tuple[float, float]:
    """The signed measure, times 1.25, and the combing of one pair of frames; NaN where nothing moves."""

    def between(picture: Luma) -> Luma:  # top rows, interpolated to where the bottom rows lie
        top = picture[0::2]
        return (top[:-1] + top[1:]) / 2

    b, b_before = now[1:-1:2], before[1:-1:2]
    t, t_before = between(now), between(before)
    moving = np.abs(b - b_before) + np.abs(t - t_before) > 2 * contrast * (np.ptp(now) + 1)
    if moving.sum() < 8:
        return np.nan, np.nan
    same, far, near = (float(np.abs(p - q)[moving].sum()) for p, q in ((b, t), (b, t_before), (b_before, t)))
    return 1.25 * (far - near) / (same + far + near), 2 * same / (far + near)


def chosen_order(flagged: str, motion: Order) -> tuple[str, str]:
    """The order to use and one line that says why: the motion wins over the flags; without motion the flags hold.

    flagged  VideoInfo.field_order
    Returns an order of "top", "bottom", "progressive" or, when neither knows, "unknown".
    """
    measured = f"the motion says {motion.order} first (slope {motion.slope:+.2f} +- {motion.sd:.2f})"
    if motion.order == "progressive":
        measured = f"the motion says progressive (slope {motion.slope:+.2f} +- {motion.sd:.2f})"
    if motion.order == "unknown":
        return flagged, f"fields: {flagged}, from the flags; the motion does not decide"
    if flagged == motion.order:
        return flagged, f"fields: {flagged}, from the flags, and {measured}"
    if flagged == "unknown":
        return motion.order, f"fields: no flags; {measured}"
    return motion.order, f"fields: the flags say {flagged}, but {measured}; the motion is used"
