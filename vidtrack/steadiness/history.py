"""One camera's movement through a run: from its calibration to the run's beginning, and from there on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools
from vidtrack.steadiness.patches import chosen_patches
from vidtrack.steadiness.registration import Reference
from vidtrack.steadiness.series import Course
from vidtrack.steadiness.turn import Law, Turn, fitted, slopes


@dataclass(frozen=True)
class Limits:
    """What counts as a movement.

    chi2        of the four parameters: a camera at rest exceeds it once in 10 million pictures
    least_px    rms over the picture: less is not reported
    plenty      patches in both pictures of which so many should be found: `unlike` share that is
    """

    chi2: float = 38.0
    least_px: float = 0.1
    plenty: int = 12
    unlike: float = 0.15


LIMITS = Limits()


class History(NamedTuple):
    """A camera's movement, as `Turn.theta` has it.

    time       (k,) s, when the moments were
    theta      (k, 4) since the calibration, or since the run's first moment where that is not known
    covariance (k, 4, 4)
    patches    (k,) how many agree
    why        (k,) why it is not known; empty where it is
    since      Turn from the calibration to the run's beginning, None where there is no picture of the calibration
    resembles  share of the calibration's patches that were found in the run; NaN where there were too few
    of         patches in the run's picture
    """

    time: Array
    theta: Array
    covariance: Array
    patches: NDArray[np.intp]
    why: list[str]
    since: Turn | None
    resembles: float
    of: int


def since_calibration(
    calibrated: NDArray[Any], begun: NDArray[Any], law: Law, size: tuple[int, int], block: float, shut: Bools
) -> tuple[Turn, float]:
    """The movement from the calibration's picture to the run's first, and the share of patches that were found.

    calibrated, begun  (h, w) the two pictures, grey levels, averaged over squares of `block` px; size as recorded, px
    shut               (h, w) what no patch may cover: calibration balls, and where the run's targets were
    """
    middles = chosen_patches(calibrated, shut=shut)
    shifts = Reference(calibrated, middles).shifts(begun)
    b = (middles + 0.5) * block - 0.5
    turn = fitted(law, np.asarray(b, float), shifts.shift * block, shifts.sd * block, size)
    return turn, float(shifts.found.mean()) if len(middles) >= LIMITS.plenty else np.nan


def history(
    course: Course,
    time: Array,
    law: Law,
    size: tuple[int, int],
    since: Turn | None = None,
    resembles: float = np.nan,
    known: tuple[Array, Array] | None = None,
) -> History:
    """The movement at every moment of a course.

    time   (k,) s, of the course's frames
    since  from the calibration to the picture in which the course's patches were chosen
    known  theta (4,) and its covariance, from the calibration's picture to the camera as it was calibrated on average
    """
    turns = [
        fitted(law, course.middles, np.asarray(shift, float), np.asarray(sd, float), size)
        for shift, sd in zip(course.shift, course.sd, strict=True)
    ]
    own = np.array([turn.theta for turn in turns]).reshape(-1, 4)
    spread = np.array([turn.covariance for turn in turns]).reshape(-1, 4, 4)
    if since is not None and not since.why:
        own, spread = law.after(own, since.theta), spread + since.covariance
        if known is not None:
            own, spread = law.after(own, -known[0]), spread + known[1]
    elif len(own):
        first = next((k for k, turn in enumerate(turns) if not turn.why), 0)
        own = own - own[first]
    counts = np.array([int(turn.agree.sum()) for turn in turns], np.intp)
    return History(time, own, spread, counts, [turn.why for turn in turns], since, resembles, len(course.middles))


class Moved(NamedTuple):
    """By how much a picture is displaced, px rms over it, with its standard deviation; how sure that is (chi2)."""

    px: float
    sd: float
    chi2: float

    @property
    def certain(self) -> bool:
        return bool(self.chi2 > LIMITS.chi2 and self.px > LIMITS.least_px and self.px > 4 * self.sd)


def displaced(law: Law, theta: Array, covariance: Array, size: tuple[int, int]) -> Moved:
    """What a movement does to the picture (width, height)."""
    if not np.isfinite(theta).all():
        return Moved(np.nan, np.nan, 0.0)
    at = field(size)
    shift = law(at, theta) - at
    px = float(np.sqrt((shift**2).sum(-1).mean()))
    J = slopes(law, at, theta)
    along = (shift[..., None] * J).sum((0, 1)) / (len(at) * px) if px > 0 else np.zeros(4)
    sd = float(np.sqrt(along @ covariance @ along))
    return Moved(px, sd, float(theta @ np.linalg.pinv(covariance) @ theta))


def field(size: tuple[int, int]) -> Array:
    """Nine places (9, 2), px, that stand for a whole picture (width, height)."""
    x, y = (np.array([1 / 6, 1 / 2, 5 / 6]) * n - 0.5 for n in size)
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


class Episode(NamedTuple):
    """A movement along a run.

    begun, ended   s: it began to show after the one, and the camera was at rest again (or the run over) at the other
    most, last     the largest displacement since the run's first moment, and that at its end
    sudden         whether it took no longer than the time between two pictures that were compared
    """

    begun: float
    ended: float
    most: Moved
    last: Moved
    sudden: bool


def episode(own: History, law: Law, size: tuple[int, int]) -> Episode | None:
    """The camera's movement along the run; None where it stood still."""
    seen = np.flatnonzero(np.isfinite(own.theta[:, 0]))
    if len(seen) < 2:
        return None
    theta, spread, time = own.theta[seen], own.covariance[seen].copy(), own.time[seen]
    if own.since is not None and not own.since.why:
        spread -= own.since.covariance  # what all moments have in common
    moved = [displaced(law, theta[k] - theta[0], _positive(spread[k] + spread[0]), size) for k in range(len(seen))]
    certain = np.array([each.certain for each in moved])
    if not certain.any():
        return None
    px = np.array([each.px for each in moved])
    most = int(np.where(certain, px, 0).argmax())
    first = int(certain.argmax())
    # at rest again: all later moments lie where the last one does
    later = [displaced(law, theta[k] - theta[-1], _positive(spread[k] + spread[-1]), size) for k in range(len(seen))]
    stays = [k for k in range(len(seen)) if not any(each.certain for each in later[k:])]
    ended = max(min(stays), first)
    return Episode(float(time[max(first - 1, 0)]), float(time[ended]), moved[most], moved[-1], ended - first <= 1)


def _positive(covariance: Array) -> Array:
    """The nearest covariance: differences of large ones may fall short of zero."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray((vectors * np.maximum(values, 1e-18)) @ vectors.T)
