"""Whether a calibration clip that shows none of its balls is a copy of another camera's, or of another clip's film.

A copy that was coded again, or made smaller, is another file and passes for a recording of its own. Its blobs lie where
the other film has its balls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding


@dataclass(frozen=True)
class CopyRule:
    """When a clip is called a copy.

    fewest  blobs that no tag explains, and balls of the other film, at least
    share   of these blobs that lie at balls of the other film
    near    of the picture's width, that they lie apart at most: coded again and rounded
    """

    fewest: int = 6
    share: float = 0.8
    near: float = 0.003


COPY = CopyRule()


class Shown(NamedTuple):
    """What a camera shows in a clip: its balls (n, 2) and blobs of no tag (m, 2), px, and the picture's width, px."""

    balls: Array
    blobs: Array
    width: float


def copied_findings(shown: Mapping[tuple[str, str], Shown]) -> list[Finding]:
    """Clips that are copies; shown: by camera and clip. One that shows some of its own balls is none."""
    out = []
    for (camera, clip), own in shown.items():
        if len(own.balls) or len(own.blobs) < COPY.fewest:
            continue
        fits = {key: _at_balls(own, other) for key, other in shown.items() if key != (camera, clip)}
        best = max(fits, key=lambda key: fits[key], default=None)
        if best is None or fits[best] < COPY.share * len(own.blobs):
            continue
        whose, other = best
        text = (
            f"calibration/{clip}: {camera}'s recording shows balls where {whose}'s of {other} has them ({fits[best]} "
            f"of {len(own.blobs)}): it is a copy of that film, coded again or scaled"
        )
        cure = f"Put {camera}'s own recording of {clip} there."
        out.append(Finding("doubtful", "clip-copied", text, cure))
    return out


def _at_balls(own: Shown, other: Shown) -> int:
    """How many blobs lie at balls of the other film, as if it were scaled to this picture."""
    if len(other.balls) < COPY.fewest:
        return 0
    apart = np.linalg.norm(own.blobs[:, None] / own.width - other.balls[None] / other.width, axis=-1)
    return int((apart.min(axis=1) < COPY.near).sum())
