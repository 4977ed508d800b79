"""Where a picture is the one before, moved as a whole: a camera that shakes, and a lamp that flickers meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from vidtrack.arrays import Bools
from vidtrack.timing.frame import Luma


@dataclass(frozen=True)
class Limits:
    """How it is looked.

    width       px, about, of the reduced pictures in which the shift is searched
    far         px of those by which the picture may have moved, each way; of near ones more of it can be compared
    shows       grey levels of 255 by which a block changes, or would if it were shifted, where anything is to be seen
    better      share of these changes, at most, that the shift leaves of them
    off, share  grey levels of 255, and share of what a block changed by, that may be left of its change
    noise       grey levels that both may differ by everywhere, at most
    alike       least correlation of both
    gain        least and greatest change of light
    """

    width: int = 160
    far: tuple[int, ...] = (4, 16)
    shows: float = 4.0
    better: float = 0.5
    off: float = 2.0
    share: float = 0.4
    noise: float = 5.0
    alike: float = 0.5
    gain: tuple[float, float] = (0.3, 3.0)


LIMITS = Limits()


def explained(before: Luma, after: Luma, block: int, shape: tuple[int, int]) -> Bools:
    """Which blocks of a picture are what the one before shows, if that is shifted as a whole.

    before, after  (h, w) uint8; block: px of its width and height; shape: how many blocks there are
    What came into the picture from outside counts as explained. All are False where nothing was shifted.
    """
    each = [_explained_by(_shift(before, after, far), before, after, block, shape) for far in LIMITS.far]
    return max(each, key=np.count_nonzero)


def _explained_by(shift: tuple[int, int], before: Luma, after: Luma, block: int, shape: tuple[int, int]) -> Bools:
    across, down = shift
    size = shape[1], shape[0]
    height, width = (min(n * block, full) for n, full in zip(shape, before.shape, strict=True))
    a, b = before[:height, :width], after[:height, :width]
    turned = cv2.warpAffine(
        a, np.array([[1.0, 0, across], [0, 1, down]]), (width, height), borderMode=cv2.BORDER_REPLICATE
    )
    inside = np.zeros(shape, bool)
    top, left = (-(-abs(by) // block) for by in (down, across))
    inside[top : shape[0] - top, left : shape[1] - left] = True
    few = np.s_[top * block : height - top * block : 4, left * block : width - left * block : 4]
    x, y = (p[few].astype(np.float32).ravel() for p in (turned, b))
    if x.size < 2:
        return np.zeros(shape, bool)
    both = float(np.cov(x, y)[0, 1])
    if both < LIMITS.alike * max(float(x.std() * y.std()), 1e-3):
        return np.zeros(shape, bool)
    gain = float(np.clip(both / max(float(x.var()), 1e-3), *LIMITS.gain))
    lit = cv2.convertScaleAbs(turned, alpha=gain, beta=float(np.median(y - gain * x)))
    off, was, moved = (
        cv2.resize(cv2.absdiff(p, q), size, interpolation=cv2.INTER_AREA).astype(np.float32)
        for p, q in ((lit, b), (a, b), (turned, a))
    )
    shows = inside & (np.maximum(was, moved) > LIMITS.shows)  # where it would be seen, whether it is or not
    noise = min(float(np.median(np.minimum(off, was)[inside])), LIMITS.noise)
    off, was, moved = (np.maximum(each - noise, 0) for each in (off, was, moved))
    most = np.maximum(was, moved)
    if not (across or down) or off[shows].sum() >= LIMITS.better * most[shows].sum():
        return np.zeros(shape, bool)
    return np.asarray((off <= np.maximum(LIMITS.off, LIMITS.share * was)) | ~inside)


def _shift(before: Luma, after: Luma, far: int) -> tuple[int, int]:
    """px to the right and down by which a picture moved: where both are most alike, in whatever light."""
    reduced = max(1, before.shape[1] // LIMITS.width)
    a, b = (cv2.resize(p, None, fx=1 / reduced, fy=1 / reduced, interpolation=cv2.INTER_AREA) for p in (before, after))
    far = min(far, (min(a.shape) - 8) // 2)
    if far < 1:
        return 0, 0
    across, down = _best(a, b, (0, 0), far)
    if reduced == 1:
        return across, down
    return _best(before, after, (across * reduced, down * reduced), reduced)


def _best(before: Luma, after: Luma, about: tuple[int, int], far: int) -> tuple[int, int]:
    """px to the right and down, up to `far` from `about`."""
    across, down = about
    height, width = before.shape
    top, left = abs(down) + far, abs(across) + far
    if min(height - 2 * top, width - 2 * left) < 8:
        return about
    piece = before[top : height - top, left : width - left]
    where = after[top + down - far : height - top + down + far, left + across - far : width - left + across + far]
    alike = cv2.matchTemplate(np.ascontiguousarray(where), np.ascontiguousarray(piece), cv2.TM_CCOEFF_NORMED)
    row, column = np.unravel_index(int(np.argmax(alike)), alike.shape)
    return across + int(column) - far, down + int(row) - far
