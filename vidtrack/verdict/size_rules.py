"""Findings from how large the targets look beside the balls of the calibration, where no background holds the lens.

Cameras that hold by their backgrounds (`steadiness`) need no balls. `locate.json` has the sizes, from
`location.cameras.ball_sizes`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from statistics import median
from typing import Any

from vidtrack.common_zoom import SAME, SeenSize, common_zoom, seen_size
from vidtrack.findings import Finding

Record = Mapping[str, Any]


@dataclass(frozen=True)
class SizeLimits:
    """When a size is no chance. Of 60 cameras of unspoiled random experiments none differs by more than 0.3 %.

    least   logarithm of a ratio: what light that falls otherwise does to the look of a ball; of_all: where all cameras
            see it alike, as they see light that flickers
    sds     standard deviations; of_balls: where the scatter of balls among themselves is the most of it; of_outlines:
            where widths are those of outlines, whose sd holds what lasts
    largest beyond which a difference between cameras stands for something else
    wander  sd of a size along a run, and times: how many times that of the other cameras
    """

    least: float = 0.005
    of_all: float = 0.0075
    sds: float = 5.0
    of_balls: float = 3.5
    of_outlines: float = 3.0
    largest: float = 0.2
    wander: float = 0.004
    times: float = 4.0


LIMITS = SizeLimits()

CURE = (
    "Switch autofocus, zoom and stabilisation off, and calibrate with the lens as it was in the run; a pattern in view "
    "(a poster, tape marks) shows by itself whether it is."
)


def size_findings(locate: Record, steadiness: Record, *, same_balls: bool) -> list[Finding]:
    """Lenses that by the size of the targets are not as they were calibrated.

    same_balls   whether the targets may be balls of the calibration's size; else cameras are compared alone
    """
    sizes = locate.get("sizes") or {}
    cameras = [seen_size(name, own) for name, own in sizes.items()]
    held = {name for name, own in (steadiness.get("cameras") or {}).items() if own.get("since_calibration")}
    if wandering := _wandering([c for c in cameras if c.name not in held], cameras):
        return [wandering]
    if len(cameras) > 1 and (odd := _odd([c for c in cameras if c.name not in held], cameras, same_balls)):
        return [odd]
    return _all(sizes) if same_balls and not held else []


def _wandering(free: Sequence[SeenSize], cameras: Sequence[SeenSize]) -> Finding | None:
    """A camera in which the size of the targets goes up and down, and in no other."""
    for own in sorted(free, key=lambda c: -c.wander):
        others = [c.wander for c in cameras if c is not own]
        if others and own.wander > max(LIMITS.wander, LIMITS.times * max(others)):
            text = (
                f"{own.name}: the size of the targets wanders by {own.wander:.2%} rms along the run, in the other "
                f"cameras by {max(others):.2%} at most: its lens zooms, its focus hunts, or a drop or dirt lies on it"
            )
            return Finding("doubtful", "lens-hunts", text, CURE)
    return None


def _odd(free: Sequence[SeenSize], cameras: Sequence[SeenSize], same_balls: bool) -> Finding | None:
    """A camera that sees the targets larger or smaller than the other cameras do."""
    found = []
    for own in free:
        others = [c for c in cameras if c is not own]
        middle = median(c.larger for c in others)
        apart, sd = own.larger - middle, hypot(own.sd, max(c.sd for c in others))
        alike = all(abs(c.larger - middle) <= max(LIMITS.least, LIMITS.sds * c.sd) for c in others)
        if alike and max(LIMITS.least, LIMITS.sds * sd) < abs(apart) < LIMITS.largest:
            found.append((own, apart, sd, others))
    if not found:
        return None
    if same_balls:
        found = [one for one in found if all(abs(c.larger) < abs(one[0].larger) for c in one[3])] or found
    own, apart, sd, _ = found[0]
    which = " or ".join(one[0].name for one in found)
    way = "larger" if apart > 0 else "smaller"
    text = (
        f"{own.name}: beside the balls of its calibration it sees the targets {abs(apart):.2%} ± {sd:.2%} {way} than "
        f"the other cameras do: a lens of {which} is at another zoom or focus than in the calibration, or other light "
        "falls on the targets from its side"
    )
    return Finding("doubtful", "lens-zoomed", text, CURE)


def _all(sizes: Record) -> list[Finding]:
    """All cameras that see the targets a little larger or smaller than the balls of the calibration, and all alike."""
    zoom = common_zoom(sizes)
    if zoom is None or (zoom.outlines and not zoom.agree):
        return []
    sds = LIMITS.of_outlines if zoom.outlines else LIMITS.of_balls
    if not max(LIMITS.of_all, sds * zoom.sd) < abs(zoom.larger) < SAME:
        return []
    who = "all cameras see" if len(sizes) > 1 else f"{next(iter(sizes))} sees"
    way = "larger" if zoom.larger > 0 else "smaller"
    text = (
        f"{who} the targets {abs(zoom.larger):.2%} ± {zoom.sd:.2%} {way} than the balls of the calibration, and "
        "nothing else in the run shows how the lenses are: where these are the same balls, in pictures that are coded, "
        "sharpened and deinterlaced alike, the lenses are at another zoom or focus than in the calibration"
    )
    cure = f"{CURE} Where the targets are other balls, set calibration.same_balls: false."
    return [Finding("doubtful", "lenses-zoomed", text, cure)]
