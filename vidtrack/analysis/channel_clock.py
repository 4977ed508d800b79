"""The clock of another instrument: by a lamp that it recorded and cameras saw, or by a motion that both measured.

The wave itself is never used: by how much a motion follows the wave is what is to be measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.motion.lag import find_lag
from vidtrack.timing.clock import Clock
from vidtrack.timing.pulses import timing_from_lamp
from vidtrack.timing.resample import exposures_begun

CONTRADICT = 3.3
"""Standard errors of their difference from which on two cameras contradict each other: one chance in a thousand."""


class Joined(NamedTuple):
    """What brings an instrument's times to the video's.

    times      (n,) s on the video's clock; as given where nothing was found
    offset_sd  s, standard error of the offset; 0 where it was given, NaN where nothing was found
    record     method, offset_s, offset_sd_s, rate_ppm, rate_sd_ppm, n
    """

    times: Array
    offset_sd: float
    record: dict[str, Any]
    findings: list[Finding]


def begun_on_run(middle: ArrayLike, located: Mapping[str, Any], camera: str) -> Array:
    """When a camera's exposures began, s on the run's clock, from their middles (n,), s by its own.

    located   locate.json: what was added to the camera's time, and the clock that was found for it
    """
    shift = (located.get("time", {}).get("shift_s") or {}).get(camera) or 0.0
    own = (located.get("clocks", {}).get("cameras") or {}).get(camera) or {}
    clock = Clock(own.get("offset_s") or 0.0, own.get("rate_ppm") or 0.0)
    return clock.corrected(exposures_begun(middle) + shift)


def by_offset(t: Array, offset_s: float) -> Joined:
    """The offset that was given."""
    return Joined(t + offset_s, 0.0, {"method": "offset", "offset_s": offset_s, "offset_sd_s": 0.0}, [])


def by_lamp(t: Array, signal: Array, light: Mapping[str, tuple[Array, Array]], name: str) -> Joined:
    """The clock by a lamp.

    t, signal   (n,) s and the recorded signal that switches with the lamp
    light       camera: when its exposures began, s on the run's clock, and how bright its pictures were
    name        of the signal, for findings
    """
    each = {camera: timing_from_lamp(times, level, t, signal) for camera, (times, level) in light.items()}
    known = {camera: own for camera, own in each.items() if own.timing.is_known}
    if not known:
        text = f"channels: no switching of {name} was seen by a camera as well: their clock is as the file has it"
        cure = "Put the lamp in view of a camera and switch it several times, or give channels.offset_s."
        return Joined(
            t, float("nan"), {"method": "lamp", "offset_s": None}, [Finding("bad", "lamp-not-seen", text, cure)]
        )
    best = min(known, key=lambda camera: known[camera].timing.sd.offset_s)
    found = known[best].timing
    clock, sd = found.clock, found.sd
    record = {"method": "lamp", "camera": best, "offset_s": clock.offset_s, "offset_sd_s": sd.offset_s}
    record |= {"rate_ppm": clock.rate_ppm, "rate_sd_ppm": sd.rate_ppm, "n": found.n, "of": found.of}
    record["cameras"] = {
        camera: {"offset_s": own.timing.clock.offset_s, "offset_sd_s": own.timing.sd.offset_s, "n": own.timing.n}
        for camera, own in known.items()
    }
    findings = _of_lamp(known[best].rivals, clock, name)
    for camera, own in known.items():
        apart = abs(own.timing.clock.offset_s - clock.offset_s)
        if apart > CONTRADICT * float(np.hypot(own.timing.sd.offset_s, sd.offset_s)):
            text = f"channels: by {camera} the lamp {name} is {apart:.4f} s from where it is by {best}"
            findings.append(Finding("doubtful", "lamp-contradicted", text, "See whether the cameras' clocks agree."))
    return Joined(clock.corrected(t), sd.offset_s, record, findings)


def _of_lamp(rivals: Sequence[float], clock: Clock, name: str) -> list[Finding]:
    if not rivals:
        return []
    others = ", ".join(f"{at:.3f}" for at in rivals[:5])
    text = f"channels: the lamp {name} fits the pictures at {clock.offset_s:.3f} s, and as well at {others} s"
    cure = "Switch the lamp at uneven intervals; or give channels.offset_s for a neighbourhood."
    return [Finding("doubtful", "lamp-ambiguous", text, cure)]


def by_motion(t: Array, x: Array, video_t: Array, video_x: Array, name: str, series: str) -> Joined:
    """The clock by a motion that the instrument (t, x) and the video (a series) both measured, scale and bias free."""
    nothing = Joined(t, float("nan"), {"method": "motion", "offset_s": None, "series": series}, [])
    own, seen = np.isfinite(t) & np.isfinite(x), np.isfinite(video_t) & np.isfinite(video_x)
    cure = "Name a series that the channel measures too (channels.clock.series), or give channels.offset_s."
    if own.sum() < 8 or seen.sum() < 8:
        text = f"channels: {name} and {series} share too few samples to be laid over each other"
        return nothing._replace(findings=[Finding("bad", "channels-not-joined", text, cure)])
    apart = not max(t[own][0], video_t[seen][0]) < min(t[own][-1], video_t[seen][-1])
    start = float(video_t[seen][0] - t[own][0]) if apart else 0.0
    lag = find_lag(t[own] + start, x[own], video_t[seen], video_x[seen])
    if not np.isfinite(lag.lag_s) or abs(lag.correlation) < 0.8:
        text = f"channels: {name} and {series} do not show one motion (correlation {lag.correlation:.2f})"
        return nothing._replace(findings=[Finding("bad", "channels-not-joined", text, cure)])
    offset = start + lag.lag_s
    record = {"method": "motion", "series": series, "offset_s": offset, "offset_sd_s": lag.sd}
    record |= {"correlation": lag.correlation, "n": lag.n}
    findings = []
    if lag.others:
        others = ", ".join(f"{start + at:.3f}" for at in lag.others[:5])
        text = f"channels: {name} lies over {series} at {offset:.3f} s, and as well at {others} s"
        findings.append(Finding("doubtful", "channels-ambiguous", text, "Give channels.offset_s for a neighbourhood."))
    return Joined(t + offset, lag.sd, record, findings)
