"""Whether the tracks contradict the order in which pictures, or their fields, were taken to have been recorded.

A smooth course at even times leaves small second differences. Two samples that were exchanged leave three times the
step, once in each direction, and next to nothing when they are exchanged again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.findings import Finding
from vidtrack.timing.fields import order_from_motion
from vidtrack.timing.resample import interval
from vidtrack.tracking.pictures.repeat_pattern import pattern_findings
from vidtrack.tracking.state import POSITION, SD_X, SD_Y, Rows


@dataclass(frozen=True)
class PictureOrder:
    """When pictures count as exchanged.

    plain    second differences over those that are left when a pair is exchanged again
    noises   standard deviations of second differences that they have at least
    fewest   pairs, and share of the samples: fewer may be an impact
    smooth   of the second differences of the whole track, that are left when all pairs are exchanged: a target that
             shakes at a third of the sampling rate looks exchanged too, and is no smoother then
    repeats  samples and targets, the first ones, by which a pattern of repeats is judged
    at_most  coordinates that the order of fields is judged by: of many targets every so-many-th one
    """

    plain: float = 3.0
    noises: float = 8.0
    fewest: tuple[int, float] = (3, 0.02)
    smooth: float = 0.4
    repeats: tuple[int, int] = (20_000, 16)
    at_most: int = 100_000


PICTURE_ORDER = PictureOrder()


def order_findings(rows: Rows, field: NDArray[np.object_], time: Array) -> list[Finding]:
    """What contradicts the order that was used, or shows that samples repeat others; field (samples,) words; time s."""
    repeats = _repeats(rows, field, time)
    return repeats or _order_of_fields(rows, field) or _order_of_pictures(rows)


def _repeats(rows: Rows, field: NDArray[np.object_], time: Array) -> list[Finding]:
    """A finding where samples come in a pattern of new ones and repeats."""
    if len(time) < 2 or not (step := interval(time)) > 0:
        return []
    some = rows.values[:, : PICTURE_ORDER.repeats[0], : PICTURE_ORDER.repeats[1]]
    where, sd = some[POSITION].transpose(1, 2, 0), some[[SD_X, SD_Y]].transpose(1, 2, 0)
    return pattern_findings(where, sd, 1 / step, set(field) == {"top", "bottom"})


def _order_of_fields(rows: Rows, field: NDArray[np.object_]) -> list[Finding]:
    """A finding where the tracks themselves contradict the order of fields that was used; field (samples,) words."""
    if set(field) != {"top", "bottom"}:
        return []
    some = rows.values[POSITION]
    where = some[:, :, :: 1 + some.size // PICTURE_ORDER.at_most].transpose(1, 2, 0)
    order = str(field[0])
    top, bottom = (where[field == name] for name in ("top", "bottom"))
    motion = order_from_motion(top, bottom)
    if motion.order in ("unknown", order):
        return []
    whole = motion.order == "progressive"
    shown = "both fields of a frame at one time" if whole else f"{motion.order} first"
    text = (
        f"fields: {order} first was used, but the tracks show {shown} (slope {motion.slope:+.2f} +- {motion.sd:.2f})."
    )
    return [Finding("bad", "field-order", text, f"Set detect.fields to {'frame' if whole else motion.order}.")]


def _order_of_pictures(rows: Rows) -> list[Finding]:
    out = exchanged(rows.values[POSITION].transpose(1, 2, 0), rows.values[[SD_X, SD_Y]].transpose(1, 2, 0))
    n, (fewest, share) = int(out.sum()), PICTURE_ORDER.fewest
    if n < max(fewest, share * len(out)):
        return []
    at = ", ".join(str(k) for k in np.flatnonzero(out)[:3])
    text = (
        f"{n} pictures lie before the one that was taken before them (samples {at}{', ...' if n > 3 else ''}): with "
        "the two exchanged the tracks are smooth, as they are they go back and forth. Positions there are those of "
        "another moment."
    )
    cure = "Copy the recording again from the camera: a conversion wrote its pictures in the order of coding."
    return [Finding("bad", "pictures-out-of-order", text, cure)]


def exchanged(where: Array, sd: Array) -> Bools:
    """Samples (n,) that are exchanged with the next one, by the tracks (n, targets, 2) px; none where it is not plain.

    sd  (n, targets, 2) px
    """
    out = np.zeros(len(where), bool)
    if len(where) < 8 or not where.shape[1]:
        return out
    a, b, c, d = where[:-3], where[1:-2], where[2:-1], where[3:]
    bends = np.square(where[:-2] - 2 * where[1:-1] + where[2:])
    as_is = (bends[:-1] + bends[1:]).sum(-1)
    seen = np.isfinite(as_is)
    noise = np.where(seen, 12 * np.square(sd[1:-2]).sum(-1), 0.0).sum(axis=1)  # 1 + 4 + 1 in each of the two
    before, noise = np.where(seen, as_is, 0.0).sum(axis=1), PICTURE_ORDER.noises**2 * noise
    if not (before > noise).any():
        return out
    turned = (np.square(a - 2 * c + b) + np.square(c - 2 * b + d)).sum(-1)
    plain = before > PICTURE_ORDER.plain**2 * np.where(seen, turned, 0.0).sum(axis=1) + noise
    out[1:-2] = plain
    out[1:] &= ~out[:-1]
    if not out.any():
        return out
    order = np.arange(len(where))
    k = np.flatnonzero(out)
    order[k], order[k + 1] = k + 1, k
    rough, smooth = (np.nansum(np.square(np.diff(own, 2, axis=0))) for own in (where, where[order]))
    return out if smooth < PICTURE_ORDER.smooth**2 * rough else np.zeros_like(out)
