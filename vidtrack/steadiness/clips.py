"""Whether a camera stood still from one calibration clip to the next, as a calibration by several clips supposes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.steadiness.history import displaced
from vidtrack.steadiness.patches import CHOICE, chosen_patches
from vidtrack.steadiness.registration import Reference
from vidtrack.steadiness.series import covered
from vidtrack.steadiness.turn import Law, Turn, fitted, law_of_picture, slopes

HARMLESS_PX = 0.5
"""rms over the picture: beyond it points and positions are worse than their sigma says."""


class ClipMovements(NamedTuple):
    """How the picture of each clip is shifted, rolled and scaled beside that of the first one.

    first   the clip that the others are compared with
    turns   by clip: `Turn` of `law_of_picture`; that of the first is 0
    size    px; patches: in the first clip's picture
    """

    first: str
    turns: dict[str, Turn]
    size: tuple[int, int]
    patches: int

    def as_record(self) -> dict[str, Any]:
        """As it is written to JSON."""
        clips = {
            clip: {"theta": turn.theta, "covariance": turn.covariance, "patches": int(turn.agree.sum())}
            | ({"why": turn.why} if turn.why else {})
            for clip, turn in self.turns.items()
        }
        return {"first": self.first, "size": self.size, "patches": self.patches, "clips": clips}

    def mean(self, counts: Mapping[str, int], law: Law, size: tuple[int, int]) -> tuple[Array, Array]:
        """Theta (4,) of a law, and its covariance, from the first clip's picture to the mean of all, by their points.

        counts   points that the calibration has of each clip
        Zero where no clip's movement is known.
        """
        known = [(turn, counts.get(clip, 0)) for clip, turn in self.turns.items() if not turn.why]
        total = sum(n for _, n in known)
        if not total:
            return np.zeros(4), np.zeros((4, 4))
        theta = sum((turn.theta * (n / total) for turn, n in known), np.zeros(4))
        covariance = sum((turn.covariance * (n / total) ** 2 for turn, n in known), np.zeros((4, 4)))
        middle = (np.array(size, float) - 1)[None] / 2
        to = np.eye(4)  # the first two: px at the middle into the law's own unit
        to[:2, :2] = np.linalg.inv(slopes(law, middle, np.zeros(4))[0, :, :2])
        return to @ theta, to @ covariance @ to.T


def covers(b: ArrayLike, pixels: ArrayLike) -> Array:
    """Discs (n, 3) px, Xf, Yf and radius, that balls at b (n, 2) of so many pixels (n,) cover."""
    return np.column_stack([np.asarray(b, float), np.sqrt(np.asarray(pixels, float) / np.pi)])


def clips_from_record(record: Mapping[str, Any]) -> ClipMovements:
    """The inverse of `ClipMovements.as_record`."""
    turns = {}
    for clip, own in record.get("clips", {}).items():
        why = own.get("why", "")
        theta = np.full(4, np.nan) if why else np.array(own["theta"], float)
        covariance = np.full((4, 4), np.nan) if why else np.array(own["covariance"], float)
        turns[clip] = Turn(theta, covariance, np.ones(int(own["patches"]), bool), why)
    width, height = record.get("size", (0, 0))
    return ClipMovements(str(record.get("first", "")), turns, (int(width), int(height)), int(record.get("patches", 0)))


def clip_movements(pictures: Mapping[str, NDArray[Any]], balls: Mapping[str, Array]) -> ClipMovements:
    """Compare the mean pictures of a camera's clips.

    pictures  clip: (h, w) grey levels, all of one size; balls  clip: (n, 3) px: Xf, Yf and radius of each
    """
    first, picture = next(iter(pictures.items()))
    size = (picture.shape[1], picture.shape[0])
    law = law_of_picture(size)
    everywhere = np.concatenate([np.asarray(own, float).reshape(-1, 3) for own in balls.values()])
    shut = covered(size, everywhere[:, :2], everywhere[:, 2] + 2 * CHOICE.blur + 2)
    middles = chosen_patches(picture, shut=shut)
    reference = Reference(picture, middles)
    still = Turn(np.zeros(4), np.zeros((4, 4)), np.ones(len(middles), bool))
    turns = {first: still}
    for clip, other in pictures.items():
        if clip != first:
            shifts = reference.shifts(other)
            turns[clip] = fitted(law, middles.astype(float), shifts.shift, shifts.sd, size)
    return ClipMovements(first, turns, size, len(middles))


def clip_findings(camera: str, own: ClipMovements) -> list[Finding]:
    """A finding for each clip in which the camera is in another attitude than in the first."""
    law, found = law_of_picture(own.size), []
    for clip, turn in own.turns.items():
        if turn.why:
            continue
        moved = displaced(law, turn.theta, turn.covariance, own.size)
        if not moved.certain:
            continue
        text = (
            f"{camera} moved between the calibration clips {own.first} and {clip}: its background is displaced by "
            f"{moved.px:.2g} ± {moved.sd:.1g} px, and one calibration is made of both"
        )
        cure = f"Record the clips again without touching the camera, or leave out {clip}."
        level = "bad" if moved.px > HARMLESS_PX else "doubtful"
        found.append(Finding(level, "camera-moved-between-clips", text, cure))  # type: ignore[arg-type]
    return found
