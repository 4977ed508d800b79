"""One film in the places of two cameras: copied, coded again, perhaps made smaller.

Its bytes are others then, and its tracks are the same but for the noise of coding: at each picture the same pixel, or
the same place in pictures of another size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.location.cameras.views import View


@dataclass(frozen=True)
class SameFilm:
    """When two cameras show one film.

    fewest    pictures in which both measured the track
    moved_px  that it moves, rms: what rests in both pictures at one place may do so by chance
    apart_px  rms, and so many sd of both: how far the tracks may lie from each other
    shift     pictures by which one may begin later
    """

    fewest: int = 20
    moved_px: float = 3.0
    apart_px: float = 0.2
    apart_sds: float = 3.0
    shift: int = 5


SAME_FILM = SameFilm()


def same_film(views: Sequence[View], others_suffice: bool) -> list[Finding]:
    """What to say of cameras that do not fit together and show the same, pixel by pixel.

    others_suffice   whether two cameras besides them give the positions
    """
    out = []
    for a, b in combinations(views, 2):
        if (px := _apart(a, b)) is not None:
            wide, other = a.camera.image_size[0], b.camera.image_size[0]
            size = "" if wide == other else f", {other} px wide where the other is {wide}"
            text = (
                f"{a.name} and {b.name} show one film, coded again{size}: what moves lies at the same place of both "
                f"pictures, within {max(px, 0.01):.2g} px rms"
            )
            cure = (
                f"One of both is a copy of the other: put {a.name}'s and {b.name}'s own recordings into their places."
            )
            out.append(Finding("doubtful" if others_suffice else "bad", "same-film", text, cure))
    return out


def _apart(a: View, b: View) -> float | None:
    """How far the tracks of two cameras that show one film lie from each other, px of the first; None for others."""
    scale = np.array(a.camera.image_size, float) / np.array(b.camera.image_size, float)
    moved = (b.b + 0.5) * scale - 0.5
    sds = np.nanmedian(a.sd) if a.has_sd else 0.0, np.nanmedian(b.sd) * scale.max() if b.has_sd else 0.0
    limit = SAME_FILM.apart_px + SAME_FILM.apart_sds * float(np.hypot(*sds))
    found = [
        px
        for own in a.b
        for other in moved
        for late in range(-SAME_FILM.shift, SAME_FILM.shift + 1)
        if (px := _rms(own[max(late, 0) :], other[max(-late, 0) :])) is not None and px < limit
    ]
    return min(found, default=None)


def _rms(own: Array, other: Array) -> float | None:
    """px rms between two tracks (T, 2), (U, 2) picture by picture; None where they hardly move or too few are known."""
    n = min(len(own), len(other))
    apart = own[:n] - other[:n]
    known = np.isfinite(apart).all(-1)
    if known.sum() < SAME_FILM.fewest:
        return None
    where = own[:n][known]
    if not np.sqrt(((where - where.mean(0)) ** 2).sum(-1).mean()) > SAME_FILM.moved_px:
        return None
    return float(np.sqrt((apart[known] ** 2).sum(-1).mean()))
