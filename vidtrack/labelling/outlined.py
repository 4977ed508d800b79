"""Calibration balls that are lit from one side: moved from the middle of their light to that of their outline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Picture
from vidtrack.labelling.rim_roughness import with_roughness
from vidtrack.labelling.shot import Shot
from vidtrack.tracking.outlines.ball_outline import Piece, piece_of
from vidtrack.tracking.outlines.lighting import Lighting, lighting


class Outlined(NamedTuple):
    """Where balls are, (n, 2) px, its sd (n, 2) px, the width (n,) px of their outlines, NaN where none was fitted, and
    how they are lit.
    """

    at: Array
    sd: Array
    width: Array
    lit: Lighting


def with_outlines(
    shots: Mapping[str, Shot], clips: Sequence[str], at: Array, sd: Array, pixels: Array
) -> tuple[Array, Array, Array | None, Lighting | None]:
    """Where a camera's balls are, (n, 2) px, and the sd (n, 2) px of that: as `outlined`, with widths (n,) px and how
    they are lit; where none is lit from one side, as they were, with what their rims show in the sd.
    """
    seen = outlined(shots, clips, at, sd, pixels)
    return (at, with_roughness(shots, clips, at, sd, pixels), None, None) if seen is None else seen


def outlined(shots: Mapping[str, Shot], clips: Sequence[str], at: Array, sd: Array, pixels: Array) -> Outlined | None:
    """The balls of a camera with their outlines; None where none is lit from one side.

    clips   of each of n balls the clip, a key of shots; at, sd (n, 2) px; pixels (n,) above the threshold, 0 of what
            was not found, or placed by a person: it stays
    """
    which = np.flatnonzero((pixels > 0) & np.isfinite(at).all(axis=1))
    pictures = {clip: shot.bright() for clip, shot in shots.items()}
    noise = float(np.median([_noise(shot) for shot in shots.values()])) if shots else 0.0
    pieces = [_piece(pictures[clips[k]], at[k], float(pixels[k])) for k in which.tolist()]
    if not any(pieces) or (lit := lighting(pieces, noise, most=len(pieces))) is None:
        return None
    at, sd, width = at.copy(), sd.copy(), np.full(len(at), np.nan)
    for i, k in enumerate(which.tolist()):
        way, more = lit.ways(i, at[k][:, None], np.sqrt(pixels[k : k + 1] / np.pi))
        at[k] += way[:, 0]
        sd[k] = np.hypot(sd[k], more[0])
        seen, _ = lit.widths(i)
        width[k] = seen[0, 2] if len(seen) else np.nan
    return Outlined(at, sd, width, lit)


def _noise(shot: Shot) -> float:
    """Grey levels, of a pixel of the mean picture."""
    one = float(np.median(shot.still.sd))
    return (one if np.isfinite(one) else 1.0) / float(np.sqrt(shot.still.frames))


def _piece(picture: Picture, at: Array, pixels: float) -> list[Piece]:
    found = piece_of(picture, at.tolist(), pixels)
    return [found] if found is not None else []
