"""Whether a calibration by a wand can be trusted: what its residuals, its covariance and independent scales say.

Cameras that know only each other fit a wand of any length, so a wrong length shows only against surveyed points or
gravity. A wand that bends, a camera that moved, a volume too small to settle a lens show in the numbers themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.adjust import Adjusted
from vidtrack.calibration.wand.axes import Fall, Motion
from vidtrack.calibration.wand.measured import Wand
from vidtrack.calibration.wand.refined import Refined
from vidtrack.findings import Finding, Level
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.lengths import METRES

GRAVITY_M, GRAVITY_SHARE = 9.81, 0.003
"""m/s^2, and the share by which it differs from place to place."""


class Limits(NamedTuple):
    """Beyond which a number is a finding, with the reason."""

    moments: int = 100
    """The wand at fewer moments samples the volume thinly: lens terms rest on a handful of pictures near the rim."""
    f_doubtful: float = 0.02
    """Relative standard error of a focal length: 2 % of it is 2 % of depth and of scale beside the volume."""
    f_bad: float = 0.1
    left_out: float = 0.1
    """Share of sights that the rest contradicts: single mistakes are a few in a hundred."""
    loose: float = 1.5
    """Times by which lengths vary more than sights allow: 1.1 is chance at 100 moments, a bent wand has 2."""
    moved: float = 6.0
    """Standard errors of a camera's mean residual in an eighth of the recording: 64 such numbers reach 4 by chance."""
    moved_px: float = 0.2
    """px, below which a movement does no harm."""
    scale: float = 4.0
    """Standard deviations by which two scales may differ."""
    scale_share: float = 0.002
    """And the share below which it does not matter."""
    point: float = 5.0
    """Standard deviations of a surveyed point's sights, beyond which the point is not where the survey has it."""
    clock_s: float = 0.002
    """s, standard error of a clock: at 1 m/s it is 2 mm."""
    spread: float = 0.25
    """Share of each picture's width over which the wand must have been seen."""


LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class Axes:
    """Where the world's axes came from.

    kind      camera, points, up, level, drop, or x, y
    explicit  whether the user asked for them
    fall      what a dropped ball says, where one was filmed
    heading   whether x points as the first camera's, because only up is known
    motion    from the rig to the surveyed points, by the wand's scale
    tags, off  of surveyed points, the largest normalised residual of each
    """

    kind: str
    explicit: bool
    fall: Fall | None = None
    heading: bool = False
    motion: Motion | None = None
    tags: tuple[str, ...] = ()
    off: Array = field(default_factory=lambda: np.zeros(0))

    def as_record(self) -> dict[str, Any]:
        record: dict[str, Any] = {"from": self.kind}
        if self.heading:
            record["heading"] = "first camera"
        if self.motion is not None:
            record |= {"points": list(self.tags), "scale": self.motion.scale, "scale_sd": self.motion.scale_sd}
            record["rms"] = self.motion.rms
        if self.fall is not None:
            record["gravity"] = {
                "value": float(np.linalg.norm(self.fall.acceleration)),
                "sd": self.fall.sd,
                "samples": self.fall.used,
            }
        return record


class Judged(NamedTuple):
    """What `judge` returns."""

    findings: list[Finding]  # of all cameras together
    by_camera: Mapping[str, list[Finding]]
    numbers: Mapping[str, Any]


def judge(
    done: Refined,
    cameras: Sequence[Camera],
    adjusted: Adjusted,
    points: Array,
    wand: Wand,
    names: Sequence[str],
    axes: Axes,
    units: str,
    unsure: Sequence[str],
) -> Judged:
    """Findings about a finished calibration, of all cameras together and of each."""
    findings: list[Finding] = []
    each: dict[str, list[Finding]] = {name: [] for name in names}
    n = points.shape[0]
    if not adjusted.converged:
        text = "the adjustment of the wand did not converge"
        findings.append(Finding("doubtful", "wand-not-converged", text, "Wave the wand through more of the volume."))
    if n < LIMITS.moments:
        text = f"only {n} moments show the whole wand to two cameras"
        findings.append(Finding("doubtful", "wand-moments-few", text, f"Wave it longer: {LIMITS.moments} or more."))
    lost = done.left_out.sum() / max(np.isfinite(done.views.b).all(-1).sum() + done.left_out.sum(), 1)
    if lost > LIMITS.left_out:
        text = f"{100 * lost:.0f} % of the wand's sights contradict the others and were left out"
        cure = "See that detect finds the wand's balls and nothing else, and that they do not hide each other."
        findings.append(Finding("doubtful", "wand-sights-left-out", text, cure))
    length, loose = _length(cameras, done, adjusted, wand)
    if loose > LIMITS.loose:
        text = f"the wand's length varies by {length:.3g} {units}, {loose:.1f} times what the sights allow"
        cure = "Use a wand that neither bends nor lets its balls slip, and hold it by its handle."
        findings.append(Finding("doubtful", "wand-loose", text, cure))
    for i, name in enumerate(names):
        each[name] += _of_camera(i, name, cameras[i], done, adjusted, points)
    findings += _scales(axes, wand, units)
    findings += _of_axes(axes, names)
    for name in unsure:
        text = f"{name}: its clock, estimated by the wand, could be another one as well"
        cure = "Turn and wave the wand faster in changing directions, or give the clock."
        findings.append(Finding("doubtful", "wand-clock-unsure", text, cure))
    return Judged(findings, each, {"length_rms": length, "length_ratio": loose})


def _length(cameras: Sequence[Camera], done: Refined, adjusted: Adjusted, wand: Wand) -> tuple[float, float]:
    """By how much (rms, world units) located lengths vary about their mean, and over what their sights allow."""
    sd = done.views.sd * adjusted.factors.get("px", 1.0)
    located = locate_points(cameras, done.views.b, sd=sd)
    left, expected = [], []
    for i, j, _ in wand.pairs:
        apart = located.point[:, j] - located.point[:, i]
        length = np.linalg.norm(apart, axis=-1)
        along = apart / length[:, None]
        both = located.covariance[:, i] + located.covariance[:, j]
        left.append(length - np.nanmedian(length))
        expected.append(np.einsum("na,nab,nb->n", along, both, along))
    off, variance = np.concatenate(left), np.concatenate(expected)
    good = np.isfinite(off) & (variance > 0)
    rms = float(np.sqrt(np.mean(off[good] ** 2)))
    return rms, float(np.sqrt(np.mean(off[good] ** 2 / variance[good])))


def _of_camera(i: int, name: str, camera: Camera, done: Refined, adjusted: Adjusted, points: Array) -> list[Finding]:
    findings = []
    place, _ = done.problem.unknowns.cameras[i]
    free = done.problem.unknowns.free[i]
    if "f" in free:
        sd = float(np.sqrt(done.found.covariance[place.start + free.index("f"), place.start + free.index("f")]))
        share = sd / camera.f
        if share > LIMITS.f_doubtful:
            level: Level = "bad" if share > LIMITS.f_bad else "doubtful"
            text = f"{name}: the wand leaves its focal length uncertain by {100 * share:.1f} %"
            cure = "Wave the wand nearer and farther, turn it toward the camera, and fill the picture."
            findings.append(Finding(level, "wand-volume-small", text, cure))
    b = done.views.b[i]
    spread = np.nanmax(b, (0, 1)) - np.nanmin(b, (0, 1))
    share = float((spread / np.array(camera.image_size)).max())
    if share < LIMITS.spread:
        text = f"{name}: the wand crossed only {100 * share:.0f} % of its picture"
        cure = "Wave it through all of the volume in which targets will move."
        findings.append(Finding("doubtful", "wand-picture-part", text, cure))
    left = (b - project(camera, points)).reshape(len(b), -1, 2)
    noise = done.views.sd[i].reshape(left.shape) * adjusted.factors.get("px", 1.0)
    worst, px = 0.0, 0.0
    for part in np.array_split(np.arange(len(left)), 8):
        if len(part) == 0:
            continue
        own, sd_of = left[part].reshape(-1, 2), noise[part].reshape(-1, 2)
        good = np.isfinite(own).all(-1)
        if good.sum() < 6:
            continue
        mean = own[good].mean(0)
        # neighbours share what their tracks err: the scatter of the whole recording is the yardstick
        error = np.maximum(np.nanstd(left.reshape(-1, 2), axis=0), sd_of[good].mean(0)) / np.sqrt(good.sum())
        k = int(np.abs(mean / error).argmax())
        if abs(mean[k] / error[k]) > worst:
            worst, px = float(abs(mean[k] / error[k])), float(np.linalg.norm(mean))
    if worst > LIMITS.moved and px > LIMITS.moved_px:
        text = f"{name}: for a part of the recording its sights are off by {px:.2g} px: it moved, or its clock did"
        findings.append(Finding("bad", "wand-camera-moved", text, "Attach the camera firmly, and film the wand again."))
    return findings


def _scales(axes: Axes, wand: Wand, units: str) -> list[Finding]:
    """What surveyed points and gravity say of the wand's length."""
    findings = []
    own = wand.sd / float(wand.lengths.max())
    size = float(wand.lengths[wand.pairs[0][0], wand.pairs[0][1]])
    if axes.motion is not None:
        sd = float(np.hypot(axes.motion.scale_sd, own))
        off = axes.motion.scale - 1
        if abs(off) > max(LIMITS.scale * sd, LIMITS.scale_share):
            text = (
                f"by the surveyed points the wand's {wand.pairs[0][2]} is {size * axes.motion.scale:.5g} {units}, not "
                f"{size:g}: one of them is wrong by {100 * abs(off):.2g} %. The points set the scale"
            )
            cure = "Measure the wand between the balls' centres again, and the points."
            findings.append(Finding("bad", "wand-length-wrong", text, cure))
    if axes.fall is not None and axes.motion is None and units in METRES:
        value = float(np.linalg.norm(axes.fall.acceleration)) * METRES[units]
        sd = float(np.hypot(axes.fall.sd * METRES[units] / value, np.hypot(own, GRAVITY_SHARE)))
        off = GRAVITY_M / value - 1
        if abs(off) > max(LIMITS.scale * sd, 0.01):
            text = (
                f"the dropped ball falls with {value:.2f} m/s^2: by gravity the wand's {wand.pairs[0][2]} would be "
                f"{size * (1 + off):.4g} {units}, not {size:g}"
            )
            cure = "Measure the wand between the balls' centres again; check units and the recordings' rate."
            findings.append(Finding("bad", "wand-length-wrong", text, cure))
    return findings


def _of_axes(axes: Axes, names: Sequence[str]) -> list[Finding]:
    if axes.kind == "camera":
        text = f"the world's axes are those of {names[0]}: x right, y down, z forward, origin in its perspective centre"
        cure = (
            "" if axes.explicit else "Add surveyed points, or calibration.wand.axes (an upright, a level, an L-frame)."
        )
        return [Finding("note" if axes.explicit else "doubtful", "wand-axes-of-camera", text, cure)]
    findings = []
    if axes.heading:
        text = f"the world's x points to the right of {names[0]}, as nearly as possible: the axes name nothing but up"
        cure = "Name x or y under calibration.wand.axes where directions on the level matter."
        findings.append(Finding("note", "wand-heading-of-camera", text, cure))
    for tag, off in zip(axes.tags, axes.off, strict=True):
        if off > LIMITS.point:
            text = f"surveyed point {tag} is not where the wand's cameras see it: {off:.0f} standard deviations off"
            cure = "Measure the point again, or give sigma in points.csv."
            findings.append(Finding("doubtful", "wand-point-off", text, cure))
    return findings
