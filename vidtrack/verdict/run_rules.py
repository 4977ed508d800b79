"""Findings that follow from a run's own numbers, beside those of its stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any, NamedTuple

from vidtrack.findings import Finding
from vidtrack.timing.clock_text import readable
from vidtrack.verdict.calibration_rules import graded

Record = Mapping[str, Any]


@dataclass(frozen=True)
class Limits:
    """Where a number becomes a doubt, and where it becomes bad: pairs are (doubtful, bad)."""

    not_located: tuple[float, float] = (0.05, 0.5)
    """Share of a target's samples without a position. Below, spectra and extremes hardly change; above a half the run
    is not a measurement of that target."""

    gap_s: float = 1.0
    """s, longest stretch without a position: beyond the period of most laboratory motions peaks are lost."""

    sigma: tuple[float, float] = (6.0, 60.0)
    """Mean sigma over what calibration and centroid noise lead to expect in the calibrated volume."""

    scatter: tuple[float, float] = (3.0, 10.0)
    """Scatter about the smoothed path over sigma. Real motion of high frequency makes up to 1.3."""

    correlation: tuple[float, float] = (0.1, 0.5)
    """1 minus the correlation of reference and video after the lag is removed: they record the same motion or not."""

    truth: tuple[float, float] = (25.0, 100.0)
    """Mean squared error against truth.csv over sigma squared, worst axis: 5 and 10 sigma."""

    late: tuple[float, float] = (3.0, 1.0)
    """A clock that the config gives counts where the motion shows a delay below so many standard errors, and one
    standard error moves a target by no more than so many sigma of its position."""

    pictures_lost: tuple[float, float] = (0.05, 0.5)
    """Share of a recording's pictures that are missing or damaged."""


LIMITS = Limits()


class Track(NamedTuple):
    """How one target was located: n samples, so many of them located, the longest gap (s) and when it begins (s)."""

    n: int
    located: int
    gap_s: float
    gap_from_s: float


def target_findings(tracks: Mapping[str, Track], asked: int | Sequence[str] | None) -> list[Finding]:
    """Which of the targets that the config asks for were located, and how much of each.

    asked   how many or their names; all: any number. A track a|b is a part of target a or of b, and no target more
    """
    out: list[Finding] = []
    located = [name for name, track in tracks.items() if track.located and "|" not in name]
    if asked == "all":
        asked = None
        if not located:
            text = "nothing that moves was located in the run"
            out.append(Finding("bad", "targets-missing", text, "See in the tracks what each camera followed."))
    if asked is not None:
        names = None if isinstance(asked, int) else list(asked)
        wanted = asked if isinstance(asked, int) else len(asked)
        missing = wanted - len(located) if names is None else len([n for n in names if n not in located])
        if missing > 0:
            which = "" if names is None else f" ({', '.join(n for n in names if n not in located)} never)"
            text = f"{wanted - missing} of {wanted} targets were located{which}"
            cure = "See in the tracks which camera lost them; give their start boxes in targets.csv, or ask for fewer."
            out.append(Finding("bad", "targets-missing", text, cure))
    for name in located:
        track = tracks[name]
        share = (track.n - track.located) / track.n
        where = f"the longest gap lasts {track.gap_s:.2g} s, from {readable(track.gap_from_s)}"
        cure = (
            "See in the tracks which camera lost it there; a third camera helps where views are blocked. Where all "
            "cameras lose it at one moment, was a part cut out of the recordings?"
        )
        if level := graded(share, LIMITS.not_located):
            text = f"target {name}: {track.located} of {track.n} samples were located; {where}"
            out.append(Finding(level, "samples-missing", text, cure))
        elif track.gap_s > LIMITS.gap_s:
            out.append(Finding("doubtful", "gap-long", f"target {name} was lost: {where}", cure))
    return out


def picture_findings(camera: str, reading: Record) -> list[Finding]:
    """One camera's recording: pictures lost. reading: centroids/<camera>.json."""
    out: list[Finding] = []
    account = reading.get("reading") or {}
    frames, lost, corrupt = (account.get(key) or 0 for key in ("frames", "lost", "corrupt"))
    if frames and (level := graded((lost + corrupt) / (frames + lost), LIMITS.pictures_lost)):
        text = (
            f"{camera}: {lost + corrupt} pictures of the recording are missing or damaged, of {frames} that were read"
        )
        cure = "Copy the recording again from the camera or tape."
        if lost > corrupt:
            cure += (
                " Where they are missing in the camera's own file too, it never recorded them, as a phone that slows "
                "down in dim light, or a card that is too slow: set a constant rate, give more light. The others "
                "have their own times."
            )
        out.append(Finding(level, "pictures-lost", text, cure))
    return out


def time_findings(readings: Mapping[str, Record], locate: Record) -> list[Finding]:
    """Whether the cameras of a run share one time at all; what estimates of a clock say, stage locate finds."""
    out: list[Finding] = []
    bare = [camera for camera, own in readings.items() if (own.get("time") or {}).get("source") == "none"]
    clocks = (locate.get("clocks") or {}).get("cameras") or {}
    unset = [c for c in bare if (clocks.get(c) or {}).get("source", "config") == "config" and not _given(clocks.get(c))]
    if bare and len(bare) < len(readings) and unset:
        text = f"{', '.join(unset)} carries no time code and the other cameras do: they do not share one time"
        out.append(Finding("bad", "time-codes-mixed", text, f"Set cameras.{unset[0]}.clock: auto."))
    elif len(readings) > 1 and len(unset) == len(readings):
        text = "no camera carries a time code: it is taken that all recordings began at the same moment"
        cure = "Set cameras.<name>.clock: auto for all cameras but one."
        if (within := _agreed_s(locate)) is None:
            out.append(Finding("doubtful", "clock-unknown", text, cure))
        else:
            text += f", as the config says; the motion shows no delay, within {1000 * within:.2g} ms"
            out.append(Finding("note", "clock-by-config", text, ""))
    return out


def _agreed_s(locate: Record) -> float | None:
    """Within how many s (95 %) the motion shows the clocks to agree; None where it does not, or does not show it."""
    lines, sigma = locate.get("sight_lines") or {}, (locate.get("samples") or {}).get("mean_sigma") or [None]
    late, sd, speed = lines.get("late_s") or {}, lines.get("late_sd_s") or {}, lines.get("speed_px_s")
    scale = (locate.get("correspondence") or {}).get("world_per_px")
    if not sd or not speed or not scale or None in sigma:
        return None
    longest = max(sd.values())
    agree = all(abs(late[camera]) <= LIMITS.late[0] * sd[camera] for camera in sd)
    return 2 * longest if agree and longest * speed * scale <= LIMITS.late[1] * hypot(*sigma) else None


def _given(clock: Record | None) -> bool:
    return bool(clock and (clock.get("offset_s") or clock.get("rate_ppm")))


def location_findings(locate: Record, held_out: float | None) -> list[Finding]:
    """How sure the positions are. held_out: world units, the calibration's error."""
    out: list[Finding] = []
    noise, samples, units = locate.get("noise") or {}, locate.get("samples"), locate.get("units", "")
    if not isinstance(samples, Mapping):
        return out
    sds = noise.get("sd_px") or {}
    sigma, scale = samples.get("mean_sigma"), (locate.get("correspondence") or {}).get("world_per_px")
    known = [sd for sd in sds.values() if sd]
    if sigma and held_out and scale and known and all(s is not None for s in sigma):
        expected = hypot(held_out, 3 * max(known) * scale)
        if level := graded(hypot(*sigma) / expected, LIMITS.sigma):
            text = (
                f"positions have a mean sigma of {hypot(*sigma):.2g} {units}, {hypot(*sigma) / expected:.2g} times "
                "the value expected from the calibration"
            )
            cure = (
                "The lines of sight are nearly parallel, or the targets are outside the calibrated volume. Move a "
                "camera, or calibrate a larger volume."
            )
            out.append(Finding(level, "sigma-large", text, cure))
    return out


def motion_findings(kinematics: Record) -> list[Finding]:
    """Whether tracks scatter as their sigma says. kinematics: kinematics.json."""
    out = []
    worst: dict[str, Record] = {}
    for own in kinematics.get("smoothing") or ():
        ratio, before = own.get("noise_ratio"), worst.get(own["target"])
        if ratio is not None and (before is None or ratio > before["noise_ratio"]):
            worst[own["target"]] = own
    for target, own in worst.items():
        if level := graded(own["noise_ratio"], LIMITS.scatter):
            text = (
                f"target {target}: positions scatter along {own['axis']} by {own['noise_ratio']:.2g} times their sigma"
            )
            cure = (
                "Look at the track of this target: short jumps come from another target or a reflection. Give the "
                "target a start box in targets.csv, or set detect.threshold."
            )
            out.append(Finding(level, "scatter-unexplained", text, cure))
    return out


def comparison_findings(comparison: Record) -> list[Finding]:
    """How the run compares with its contact sensor and with truth.csv. comparison: comparison.json."""
    out = []
    after = comparison.get("after") or {}
    correlation = after.get("correlation")
    if correlation is not None and (level := graded(1 - correlation, LIMITS.correlation)):
        text = f"reference and video correlate to {correlation:.2f} only after the lag is removed"
        cure = "Check runs.<run>.reference: column, axis and target, and whether the reference is of this run."
        if correlation < LIMITS.correlation[0] - 1:
            text = (
                f"the reference counts against the video: they correlate to {correlation:.3f} after the lag is removed"
            )
            cure = "Change the sign of the reference's column, or see why the sensor counts the other way."
        out.append(
            Finding("doubtful" if level == "bad" and correlation > 0 else level, "reference-differs", text, cure)
        )
    truth = comparison.get("truth") or {}
    variances = {a: v for a, v in (truth.get("normalised_variance") or {}).items() if v is not None}
    if variances:
        axis = max(variances, key=lambda a: variances[a])
        if level := graded(variances[axis], LIMITS.truth):
            text = f"positions are off truth.csv by {variances[axis] ** 0.5:.2g} sigma rms along {axis}"
            cure = "Check that truth.csv is of these targets, axes and clock; else check the calibration."
            out.append(Finding(level, "truth-differs", text, cure))
    return out
