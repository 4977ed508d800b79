"""What errors that all frames share do to the centroids of calibration balls, read off the balls' own rims.

A coder that copies a picture from frame to frame leaves its errors in all of them: the scatter of frames does not show
them, averaging takes none of them away. They make the rim rough. A rim r(a) = R + sum of c_n cos(n a) + s_n sin(n a)
has its middle moved by (c_1, s_1), which the centroid hides; roughness has all orders n alike, so that c_3 and s_3 show
how large it is. Nothing else has this order: an ellipse, a tilt and pixels that are not square have the second,
shade that grows to one side the first, the grid of pixels the fourth. By the harmonic moments of the light above the
background, with A the area and L = sum of I over A the level,

    c_3 + i s_3 = sum of I z^3 / (pi R L),    z = ((X - x) + i (Y - y)) / R.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array, Picture
from vidtrack.labelling.shot import Shot


@dataclass(frozen=True)
class Roughness:
    """How rims are looked at.

    margin_px   beyond the radius that the pixels above the threshold have, to which light counts
    ring_px     of background about it
    fewest      balls that stand alone; of fewer nothing is known
    median      of the squares of both coefficients of a rim, over the variance of one: half of a chi-squared of two
                degrees of freedom lies below it. What a string or a mark does to fewer than half of them adds nothing
    """

    margin_px: float = 1.5
    ring_px: int = 4
    fewest: int = 4
    median: float = 2 * float(np.log(2))


ROUGHNESS = Roughness()


def with_roughness(shots: Mapping[str, Shot], clips: Sequence[str], at: Array, sd: Array, pixels: Array) -> Array:
    """The sd (n, 2) px of balls, at least that which the roughness of their rims leads to expect.

    clips   of each of n balls the clip, a key of shots; at, sd (n, 2) px; pixels (n,) above the threshold, 0 of what
            was not found, or placed by a person: it stays
    """
    which = np.flatnonzero((pixels > 0) & np.isfinite(at).all(axis=1))
    pictures = {clip: shot.bright() for clip, shot in shots.items()}
    found = [rim(pictures[clips[k]], at[k], float(pixels[k]), _others(shots[clips[k]], at[k])) for k in which.tolist()]
    squares = [float(c @ c) for c in found if c is not None]
    if len(squares) < ROUGHNESS.fewest:
        return sd
    level = np.sqrt(np.median(squares) / ROUGHNESS.median)
    out = sd.copy()
    out[which] = np.maximum(sd[which], level)
    return out


def rim(picture: Picture, at: Array, pixels: float, others: Array) -> Array | None:
    """(c_3, s_3) px of the rim of a bright ball at (2,) px; None at the edge, and near one of others (m, 2)."""
    radius = float(np.sqrt(pixels / np.pi))
    reach = int(np.ceil(radius + ROUGHNESS.margin_px + ROUGHNESS.ring_px))
    (left, top), (rows, columns) = np.rint(at).astype(int) - reach, picture.shape
    if min(left, top) < 0 or left + 2 * reach >= columns or top + 2 * reach >= rows:
        return None
    if (np.abs(others - at).max(axis=1) < reach + radius + 1).any():
        return None
    window = picture[top : top + 2 * reach + 1, left : left + 2 * reach + 1].astype(float)
    z = (np.arange(2 * reach + 1) + left - at[0]) + 1j * (np.arange(2 * reach + 1)[:, None] + top - at[1])
    beyond = np.abs(z) - radius - ROUGHNESS.margin_px
    light = (window - np.median(window[beyond > 0])) * np.clip(0.5 - beyond, 0, 1)
    level = light.sum() / (np.pi * radius**2)
    if not level > 0:
        return None
    moment = (light * (z / radius) ** 3).sum() / (np.pi * radius * level)
    return np.array([moment.real, moment.imag])


def _others(shot: Shot, at: Array) -> Array:
    """Where the other blobs of the clip are, (m, 2) px."""
    apart = np.linalg.norm(shot.at - at, axis=1)
    return np.asarray(shot.at[apart > 1.0])
