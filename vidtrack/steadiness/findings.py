"""What the user should know of a camera that moved, or of which nothing is known."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vidtrack.findings import Finding, Level
from vidtrack.steadiness.history import LIMITS, Episode, History, Moved
from vidtrack.steadiness.turn import AGREEMENT

HARMLESS_PX = 0.5
"""rms over the picture: beyond it positions are worse than their sigma says."""

CURE = "Set calibration.follow: true to correct positions by it, or calibrate the camera as it stood."

LEAST_ZOOM, ZOOM_SDS = 0.002, 5.0
"""Share by which a picture must have grown, and standard deviations, to be called zoomed: warmth does the rest."""

ZOOM_CURE = (
    "Switch autofocus, zoom and stabilisation off, and calibrate with the lens as it was in the run; "
    "calibration.follow: true corrects a small change."
)


PART_CURE = (
    "Give `crop: [left, top, width, height]` for the run: the part of the calibration's picture that it shows. Or "
    "calibrate with clips of the run's size."
)
FLIPPED_CURE = (
    "Record run and calibration alike, or turn the pictures of one of them back; players may hide it: a flag in the "
    "file does."
)


class CameraCase(NamedTuple):
    """All that is known of one camera in a run.

    start   displacement at the run's first moment, since the calibration; None where not known
    along   its movement along the run; None where it stood still
    per_px  world units that a px spans at the calibration points; None where not known
    flipped how its pictures are mirrored or turned beside those of its calibration; None where they are not
    part    whether its pictures are of another size: a part of the calibration's picture was given or taken for it
    """

    camera: str
    where: str
    history: History
    start: Moved | None
    along: Episode | None
    per_px: float | None
    units: str
    follow: bool
    flipped: str | None = None
    part: bool = False

    def record(self) -> dict[str, Any]:
        """As it is written to JSON."""
        own = self.history
        since = own.since
        return {
            "patches": own.of,
            "moments": len(own.time),
            "known": int(np.isfinite(own.theta[:, 0]).sum()),
            "since_calibration": None
            if self.start is None
            else {**_moved(self.start), "units": self._in_units(self.start.px)},
            "calibration_unknown": since.why if since is not None and since.why else None,
            "flipped": self.flipped,
            "along_run": None
            if self.along is None
            else {
                "begun_s": self.along.begun,
                "ended_s": self.along.ended,
                "sudden": self.along.sudden,
                "most": {**_moved(self.along.most), "units": self._in_units(self.along.most.px)},
                "last": _moved(self.along.last),
            },
        }

    def _in_units(self, px: float) -> float | None:
        return None if self.per_px is None else px * self.per_px

    def size(self, moved: Moved) -> str:
        """A displacement in words."""
        text = f"{moved.px:.2g} ± {moved.sd:.1g} px"
        length = self._in_units(moved.px)
        return text if length is None else f"{text} ({length:.2g} {self.units} at the calibration points)"


def _moved(moved: Moved) -> dict[str, float]:
    return {"px": moved.px, "sd": moved.sd}


def findings_of(case: CameraCase) -> list[Finding]:
    """The findings of one camera."""
    unknown = _unknown(case)
    if unknown is not None:
        return [unknown]
    return [*_between(case), *_along(case)]


def _unknown(case: CameraCase) -> Finding | None:
    """Whether the camera stood still is not known at all."""
    own, name = case.history, f"{case.where}: {case.camera}"
    level: Level = "doubtful" if case.follow else "note"
    cure = "Put something with a pattern that stays in view: a poster, tape marks, a test card."
    if own.of < AGREEMENT.least:
        text = f"{name}: its background has no texture by which a movement of the camera would show"
        return Finding(level, "no-background-texture", text, cure)
    if not np.isfinite(own.theta).any():
        reason = next((why for why in own.why if why), "no picture was compared")
        text = f"{name}: whether the camera stood still is not known: {reason}"
        return Finding(level, "steadiness-unknown", text, cure)
    return None


def _between(case: CameraCase) -> list[Finding]:
    own, name = case.history, f"{case.where}: {case.camera}"
    if own.since is None:
        return []
    if case.flipped:
        text = f"{name}: its pictures are {case.flipped}, compared with its calibration: so its background is found"
        return [Finding("bad", "pictures-wrong", text, FLIPPED_CURE)]
    if own.since.why:
        unlike = own.resembles < LIMITS.unlike
        level: Level = "doubtful" if unlike or case.follow else "note"
        text = f"{name}: whether it stands as it was calibrated is not known: {own.since.why}"
        cure = "Compare its picture with that of the calibration clips: light, zoom and view should be the same."
        if unlike:
            text = f"{name}: its background resembles that of the calibration clips nowhere: {own.since.why}"
        return [Finding(level, "calibration-view-unknown", text, cure)]
    if case.start is None or not case.start.certain:
        return []
    text = f"{name} moved between its calibration and the run: its background is displaced by {case.size(case.start)}"
    zoom, sd = float(own.since.theta[3]), float(np.sqrt(own.since.covariance[3, 3]))
    found = _finding(case, "camera-moved-between", text, case.start)
    if not abs(zoom) > max(LEAST_ZOOM, ZOOM_SDS * sd):
        return [found]
    size = f"{100 * abs(zoom):.3g} ± {100 * sd:.1g} % {'larger' if zoom > 0 else 'smaller'}"
    if case.part:
        text = f"{text}; its picture is {size} than the part of the calibration's that it is taken for"
        return [_finding(case, "camera-moved-between", text, case.start, PART_CURE)]
    text = f"{text}; its picture is {size}: another zoom or focus, or a stabiliser that crops"
    return [_finding(case, "camera-moved-between", text, case.start, ZOOM_CURE)]


def _along(case: CameraCase) -> list[Finding]:
    along = case.along
    if along is None:
        return []
    first = float(case.history.time[0])
    times = f"{along.begun:.2f} to {along.ended:.2f} s"
    since = f"{along.begun - first:.2f} to {along.ended - first:.2f} s after its first picture"
    text = (
        f"{case.where}: {case.camera} moved during the run, {'suddenly, ' if along.sudden else ''}from {times} "
        f"({since}), by up to {case.size(along.most)}"
    )
    if along.last.px < along.most.px / 2:
        text += f"; at its end by {along.last.px:.2g} px"
    cure = CURE if along.sudden else f"If it was the camera's stabiliser, switch that off. {CURE}"
    return [_finding(case, "camera-moved-along-run", text, along.most, cure)]


def _finding(case: CameraCase, code: str, text: str, moved: Moved, cure: str = CURE) -> Finding:
    if case.follow:
        return Finding("note", code, f"{text}; positions are corrected by it", "")
    return Finding("bad" if moved.px > HARMLESS_PX else "doubtful", code, text, cure)
