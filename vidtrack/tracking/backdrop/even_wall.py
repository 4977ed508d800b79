"""A still wall with a pattern made even about a target: the share of it that shows through a soft rim is taken off.

A soft rim mixes a target with what is behind it: behind its outer half the wall shows through,

    I = cover * T + (1 - cover) * B(x, y)

so that the moments of a window take the pattern in. Where the wall B is known, from pictures in which the target was
elsewhere, it is made even before anything is measured:

    I' = I - (1 - cover) * (B - b),    cover = (I - B) / (T - B),    b one level, the median of B about the target

T is the level of the target itself just within its rim. Nothing is changed where the pattern is not what the window
shows beside the target: light, shadow, a camera that moved.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Bools

Grey = NDArray[np.float32]


@dataclass(frozen=True)
class EvenWall:
    """When a wall is made even about a target, and how.

    room_px       beside the target: for its soft edge and background, and it may be off by some
    soft_px       about the pixels half-way up in which a target hides some of the wall
    gain          of the wall in the window, against the wall as known, within; left: share of the variance beside the
                  target that may be left
    noise         times its variance that two pictures leave of each other; what is left besides is not known
    plain         times the noise below which there is no pattern to be taken off
    fewest        pixels beside a target that decide
    half          share of its contrast above the light of the wall, beyond which a pixel is of a target
    covers        share of it by which it is brighter than the wall behind it, at least
    bright        share of it by which a wall is too bright for its cover to be seen
    mostly        share of the rim where the wall is not known, above which nothing is changed
    core_px       within the pixels half-way up, from where on a target hides all; core: pixels of it that decide
    own_level_px  over which its level is taken; tiny: times its contrast, the level of one without a core
    """

    room_px: float = 13.0
    soft_px: int = 4
    gain: tuple[float, float] = (0.6, 1.5)
    left: float = 0.5
    noise: float = 2.0
    plain: float = 1.5
    fewest: int = 60
    half: float = 0.5
    covers: float = 0.35
    bright: float = 0.6
    mostly: float = 0.5
    core_px: int = 1
    core: int = 5
    own_level_px: int = 5
    tiny: float = 1.2


EVEN_WALL = EvenWall()
SOFT = np.ones((2 * EVEN_WALL.soft_px + 1,) * 2, np.uint8)
_CORE = np.ones((2 * EVEN_WALL.core_px + 1,) * 2, np.uint8)


def even_wall(grey: Grey, wall: Grey, hidden: Bools, contrast: float, noise: float) -> tuple[Grey | None, float]:
    """A window of grey levels with a bright target in it, before an even wall; None: it stays as it is. And the share
    of the wall behind its rim that is not known, or is another one by now.

    wall, hidden  (rows, columns) its levels, and where they are not known; contrast: grey levels, of the target
    noise         grey levels, of a pixel from picture to picture
    """
    s = EVEN_WALL
    base = float(np.median(wall if hidden.all() else wall[~hidden]))
    lit = (grey > base + s.half * contrast).view(np.uint8)
    beside = (cv2.dilate(lit, SOFT) == 0) & ~hidden
    if np.count_nonzero(beside) < s.fewest:
        return None, 1.0
    behind, shown = wall[beside], grey[beside]
    shift = float(shown.mean()) - float(behind.mean())
    behind, shown = behind - behind.mean(), shown - shown.mean()
    pattern = float((behind * behind).mean())
    if pattern < (s.plain * noise) ** 2:
        return None, 0.0
    gain = float((behind * shown).mean()) / pattern
    left = float(((shown - behind) ** 2).mean())
    if not s.gain[0] < gain < s.gain[1] or left > s.left * float((shown * shown).mean()):
        return None, 1.0
    wall, base = wall + np.float32(shift), base + shift
    hidden = hidden | (wall - base > s.bright * contrast)
    target = (grey > base + s.half * contrast) & ((grey - wall > s.covers * contrast) | hidden)
    lit = target.view(np.uint8)
    core = cv2.erode(lit, _CORE)
    rim = (cv2.dilate(lit, SOFT) > 0) & (core == 0)
    unknown = float(np.mean(hidden[rim])) if rim.any() else 0.0
    if unknown > s.mostly:
        return None, unknown
    over = _own_level(grey, core, base + s.tiny * contrast) - wall
    cover = np.clip((grey - wall) / np.maximum(over, np.float32(1)), 0, 1)
    off = (1 - cover) * (wall - np.float32(base))
    off[hidden | (core > 0)] = 0
    other = max(0.0, left - s.noise * noise**2) / pattern
    return grey - off, min(unknown + other, 1.0)


def _own_level(grey: Grey, core: NDArray[np.uint8], tiny: float) -> Grey:
    """The target's level at each pixel: that of its core nearby; `tiny` where it has none."""
    if np.count_nonzero(core) < EVEN_WALL.core:
        return np.full(grey.shape, tiny, np.float32)
    window = (EVEN_WALL.own_level_px,) * 2
    light = cv2.blur(grey * core, window, borderType=cv2.BORDER_CONSTANT)
    weight = cv2.blur(core.astype(np.float32), window, borderType=cv2.BORDER_CONSTANT)
    near = light / np.maximum(weight, np.float32(1e-3))
    return np.asarray(np.where(weight > 1e-3, near, grey[core > 0].mean()), np.float32)
