"""Which camera errs where lines of sight miss each other for a moment, and where in its picture.

Each camera in turn is left out of such a sample. If the others agree without one, and with no other, it is that one
whose centroid something moved: it is left out, and the position is right. If more than one may be it, the truth lies at
one of the positions without them, and sigma spans these: a least-squares point between them is off in one direction,
which the size of the residuals does not show. What lies on a lens or a window (a drop, dirt) belongs to a place in one
camera's picture: targets that pass it at different times err there alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.findings import Finding
from vidtrack.geometry.triangulate import Located
from vidtrack.location.sight_lines.sudden_misses import SUDDEN, unlikely_chi2

Again = Callable[[Bools, Array], Located]
"""Samples (m, M) of which k are looked at, and their sd (n_cameras, k, 2) px, infinite for a camera that is left out:
their positions."""


@dataclass(frozen=True)
class Erring:
    """How one camera is found to err.

    odds     in chi squared, 90 to 1, by which one camera must explain the misses better than any other
    place    of a picture's width, within which samples show the same place of it
    apart    samples, after which a target has come back to that place, or another one has come to it
    returns  samples at a place that something came back to, at least, for it to be named
    most     places of a camera that are named
    """

    odds: float = 9.0
    place: float = 0.04
    apart: int = 5
    returns: int = 3
    most: int = 3


ERRING = Erring()


class ByOneCamera(NamedTuple):
    """What `without_erring` returns: positions, and the camera (m, M) that errs in a sample, -1 where none is named."""

    located: Located
    camera: Array


def without_erring(located: Located, grown: Bools, usual: Array, sd: Array, again: Again) -> ByOneCamera:
    """Positions without the camera that errs, or with a sigma that spans those without each that may.

    grown   (m, M) samples that miss by more than chance, and usual (m, M) chi squared over its expectation
    sd      (n_cameras, m, M, 2) px, of the centroids
    Samples of two cameras stay as they are: both explain all of a miss.
    """
    who = np.full(grown.shape, -1)
    used = np.isfinite(located.error[..., 0]) & ~located.left_out
    looked = grown & (used.sum(0) >= 3)
    if not looked.any():
        return ByOneCamera(located, who)
    own, own_sd, scale = used[:, looked], sd[:, looked], usual[looked]
    without: list[Located] = []
    q: Array = np.full(own.shape, np.inf)
    for i in range(len(own)):
        rest = np.where((np.arange(len(own)) == i)[:, None, None], np.inf, own_sd)
        without.append(one := again(looked, np.where(own[..., None], rest, np.inf)))
        known = np.isfinite(one.point[:, 0]) & own[i]
        z2 = np.where(np.isfinite(rest) & own[..., None], np.square(one.error / own_sd), 0.0).sum((0, -1))
        q[i, known] = z2[known] / scale[known]
    best, column = np.argmin(q, 0), np.arange(q.shape[1])
    least, freedom = q[best, column], 2 * own.sum(0) - 5
    fits = np.isfinite(least) & (least <= unlikely_chi2(freedom, SUDDEN.chance))
    may = fits & (q - np.where(np.isfinite(least), least, 0.0) < ERRING.odds)
    sure = fits & (may.sum(0) == 1)
    where = np.argwhere(looked)
    new = located._replace(
        **{name: getattr(located, name).copy() for name in ("point", "covariance", "sigma", "miss", "n_cameras")},
        left_out=located.left_out.copy(),
        error=located.error.copy(),
    )
    for k, (i, j) in enumerate(where.tolist()):
        if sure[k]:
            one = without[best[k]]
            for name in ("point", "covariance", "sigma", "miss", "n_cameras"):
                getattr(new, name)[i, j] = getattr(one, name)[k]
            new.error[:, i, j], new.left_out[best[k], i, j], who[i, j] = one.error[:, k], True, best[k]
        elif may[:, k].any():
            each = [_about(located.point[i, j], without[c], k) for c in np.flatnonzero(may[:, k]).tolist()]
            span = np.asarray(sum(each) / len(each))
            if np.trace(span) > np.trace(new.covariance[i, j]):
                new.covariance[i, j], new.sigma[i, j] = span, np.sqrt(np.diag(span))
    return ByOneCamera(new, who)


def _about(point: Array, one: Located, k: int) -> Array:
    """The covariance (3, 3) of the truth about a point, where it lies at another one."""
    off = one.point[k] - point
    return np.asarray(one.covariance[k] + np.outer(off, off))


def places_of_errors(who: Array, b: Array, widths: Mapping[str, float]) -> dict[str, Any]:
    """Of each camera that errs: in how many samples n, and at which places (x, y) px again and again, widest first.

    who     (m, M) camera that errs in a sample, -1: none; b (n_cameras, m, M, 2) px
    widths  camera: of its picture, px
    A place is one to which a target comes back, or another one comes later: what goes along with one target (a rope, a
    shadow), or two that touch each other, has none.
    """
    out = {}
    for c, (name, width) in enumerate(widths.items()):
        target, moment = np.nonzero(who == c)
        if not target.size:
            continue
        at = b[c, target, moment]
        near = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1)) < ERRING.place * width
        other = np.abs(moment[:, None] - moment[None]) > ERRING.apart
        places, free = [], (near & other).any(1)
        while free.any():
            first = int(np.argmax((near & free).sum(1) * free))
            own = near[first] & free
            if own.sum() >= ERRING.returns:
                places.append([*np.median(at[own], axis=0).round().astype(int).tolist(), int(own.sum())])
            free &= ~own
        out[name] = {"n": int(target.size), "places": places}
    return out


def lens_findings(errors: Mapping[str, Any]) -> list[Finding]:
    """What lies on a camera's lens or window, by `places_of_errors`."""
    out = []
    for camera, own in errors.items():
        if not own["places"]:
            continue
        most = sorted(own["places"], key=lambda place: -place[2])[: ERRING.most]
        where = ", ".join(f"({x}, {y})" for x, y, _ in most)
        text = (
            f"{camera}: what passes the same places of its picture is misplaced there each time, in {own['n']} samples "
            f"that the other cameras contradict, about {where} px: as by a drop or dirt on its lens or its window"
        )
        cure = (
            f"Look at {camera}'s picture there: clean its lens and the window, or take away what stands in the way. "
            "Positions there rest on the other cameras; smaller errors there may pass."
        )
        out.append(Finding("doubtful", "something-on-lens", text, cure))
    return out
