"""Pictures that hold part of the picture before: noise reduction over time, a deinterlacer, a slow screen.

What moves is then seen late: of a target of the velocity v px a picture, whose pictures hold the share s of the one
before, the centroid is s v behind. At a steady velocity its shape does not show it. The noise does: that of a camera
is another one in every picture, that of mixed pictures goes on. With the autocovariances r_k of a pixel's noise,

    cov(d_i, d_i+k) = c_k = 2 r_k - r_k-1 - r_k+1,    d: differences of successive pictures, nought of what is still

and r_k = 0 from the fourth on, r_2 = -c_3, r_1 = 2 r_2 - c_2, r_0 = c_0 / 2 + r_1. A mixture of two gives
r_1 / r_0 = s (1 - s) / ((1 - s)^2 + s^2), a little more than s; a recursive filter that keeps the share s has
c_3 / c_2 = s and is late by s / (1 - s). A lossy coder that builds pictures on others copies noise as well: its
pictures are not judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vidtrack.findings import Finding
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Mixture:
    """When the noise of pictures says that they are mixed.

    fewest, most  pictures; tiles: of the picture, in each direction; the quieter half counts, where nothing moves
    rows, pairs   of a tile that are looked at, at most: rows, and pairs of neighbours in each, whose differences no
                  flicker changes
    noise         grey levels^2, r_0 of such a difference from which on rounding does not decide
    like          r_1 / r_0 from which on pictures are mixed, of the middle tile; of_most: of three quarters of them
                  (0 +- 0.02 where they are not)
    falling       r_2 / r_1 at most: more is something that moves slowly
    kept          share that a recursive filter keeps, at most
    slight        pictures of lateness that sigma holds, and no more need be said of
    """

    fewest: int = 7
    most: int = 12
    tiles: int = 6
    rows: int = 24
    pairs: int = 24
    noise: float = 0.3
    like: float = 0.09
    of_most: float = 0.05
    falling: float = 0.6
    kept: float = 0.75
    slight: float = 0.25


MIXTURE = Mixture()
_ROUNDING = 2 / 12  # grey levels^2, of the difference of two pixels


def lateness_of_mixed(samples: Sequence[Sample], scale: float = 1.0, *, copied: bool = False) -> float:
    """Pictures by which what moves is seen late at most, 0: each stands for itself, or nothing can be said.

    samples  successive ones; scale: grey levels 0-255 a stored value. Fields are not judged
    copied   whether pictures copy the noise of others, on which they are built
    """
    pictures = [one.luma for one in samples if not (one.corrupt or one.repeated)][: MIXTURE.most]
    if copied or len(pictures) < MIXTURE.fewest or samples[0].lines != 1:
        return 0.0
    change = np.diff(_pairs(pictures) * np.float32(scale), axis=0)
    c = np.array([(change[k:] * change[: len(change) - k]).mean(axis=(0, 2)) for k in range(4)], float)
    quiet = c[:, c[0] <= np.median(c[0])]
    r2 = -quiet[3]
    r1 = 2 * r2 - quiet[2]
    r0 = quiet[0] / 2 + r1 - _ROUNDING * min(scale, 1.0) ** 2
    if not (r0 > MIXTURE.noise).all():
        return 0.0
    alike = r1 / r0
    like, next_like = float(np.median(alike)), float(np.median(r2 / r0))
    if like < MIXTURE.like or np.quantile(alike, 0.25) < MIXTURE.of_most or next_like > MIXTURE.falling * like:
        return 0.0
    kept = float(np.clip(quiet[3].sum() / quiet[2].sum(), 0, MIXTURE.kept))
    return max(like, kept / (1 - kept))


def _pairs(pictures: Sequence[NDArray[np.generic]]) -> NDArray[np.float32]:
    """Differences of neighbours in a row, (pictures, tiles, places)."""
    rows, columns = pictures[0].shape
    down = np.linspace(0, rows, MIXTURE.tiles + 1).astype(int)
    across = np.linspace(0, columns, MIXTURE.tiles + 1).astype(int)
    high, wide = min(MIXTURE.rows, int(np.diff(down).min())), min(MIXTURE.pairs, int(np.diff(across).min()) // 2)
    row = (down[:-1, None] + np.arange(high)).ravel()
    left = (across[:-1, None] + 2 * np.arange(wide)).ravel()
    out = np.empty((len(pictures), MIXTURE.tiles**2, high * wide), np.float32)
    for one, picture in zip(out, pictures, strict=True):
        part = picture[row].astype(np.float32)
        pairs = (part[:, left + 1] - part[:, left]).reshape(MIXTURE.tiles, high, MIXTURE.tiles, wide)
        one[:] = pairs.transpose(0, 2, 1, 3).reshape(one.shape)
    return out


def mixed_pictures(late: float, drawn: float = 0.0) -> list[Finding]:
    """What to know of pictures in which what moves is seen so late, in pictures; drawn: over how many of them streaks
    go, where that is longer than any exposure.
    """
    if not late:
        return []
    seen = "the noise of each picture goes on in the next, as where pictures are mixed"
    if drawn:
        seen = (
            f"targets are drawn out over their way in {drawn:.1f} pictures, longer than any exposure, as where each "
            "picture is a mean of several"
        )
    text = f"{seen}: what moves may be seen up to {late:.2f} pictures late. Its sd and sigma hold that."
    cure = "Record without noise reduction over time, and track what the camera wrote, no copy at another rate."
    return [Finding("doubtful" if late > MIXTURE.slight else "note", "pictures-mixed", text, cure)]
