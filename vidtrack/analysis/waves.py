"""One run's wave and all that responds to it: which stretch is used, regular or irregular, what makes it doubtful."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.analysis.harmonics import FEW_SAMPLES_A_PERIOD, fit_harmonics, fundamental_frequency
from vidtrack.analysis.responses import Series, Systematic, irregular_waves, regular_waves
from vidtrack.analysis.water_waves import wave_number
from vidtrack.findings import Finding
from vidtrack.lengths import METRES

G_M = 9.80665
REGULAR = 0.9
"""Share of a wave's variance in its fundamental and two harmonics from which on it counts as regular."""
FEW_PERIODS = 5
"""Fewer whole periods make a regular wave's numbers doubtful."""


def waves_and_responses(
    name: str,
    own: Series,
    others: Mapping[str, Series],
    how: Mapping[str, Any],
    units: str,
    systematic: Systematic | None = None,
) -> tuple[dict[str, Any], list[Finding]]:
    """What is quoted of the wave `own`, regular or irregular, and of each other series' response to it.

    how          kind, period, resolution, start, end, depth, distance; units: the experiment's unit of length
    systematic   what the calibration leaves open of scale and axes, see `mixing`
    """
    how = dict(how) | _common_time(own, list(others.values()), how)
    own = _cut(own, how)
    period = how.get("period")
    findings: list[Finding] = []
    try:
        f = fundamental_frequency(own.t, own.x, None if period is None else 1 / period)
        wave = fit_harmonics(own.t, own.x, f.value)
    except ValueError as problem:
        cure = "Give the whole record of the wave, on the video's clock (channels.offset_s)."
        return {"elevation": name}, [Finding("bad", "wave-not-found", f"waves: {name}: {problem}", cure)]
    explained = 1 - wave.rms**2 / float(np.nanvar(own.x[np.isfinite(own.x)]))
    kind = how.get("kind") or "auto"
    regular = kind == "regular" or (kind == "auto" and explained > REGULAR)
    record: dict[str, Any] = {"elevation": name, "kind": "regular" if regular else "irregular"}
    motions = {other: _cut(s, how) for other, s in others.items()}
    if regular:
        reference = {"slope": _slope(how, units, f.value), "behind": how.get("distance")}
        record |= regular_waves(own, f, wave, motions, systematic=systematic, **reference)
        each = {name: wave.samples_a_period}
        each |= {other: found["samples_a_period"] for other, found in record["responses"].items()}
        few = min(each, key=lambda other: each[other])
        if each[few] < FEW_SAMPLES_A_PERIOD - 0.5:
            text = f"waves: {each[few]:.0f} samples a period of {few}; {FEW_SAMPLES_A_PERIOD} are asked for"
            findings.append(Finding("note", "few-samples-a-period", text, "Record at a higher rate."))
        if wave.periods < FEW_PERIODS:
            text = f"waves: only {wave.periods} whole periods of {name} could be used"
            findings.append(Finding("doubtful", "few-periods", text, "Record a longer stretch of steady waves."))
    else:
        irregular, found = irregular_waves(own, motions, how, name)
        record |= irregular
        findings += found
    return record, findings


def _common_time(own: Series, others: Sequence[Series], how: Mapping[str, Any]) -> dict[str, Any]:
    """First and last time used, s: those that were given, else those that the wave and the motions have in common."""
    ends: dict[str, Any] = {key: how.get(key) for key in ("start", "end")}
    filmed = [s for s in others if np.isfinite(s.sigma).any()]  # other instruments often record for longer
    seen = [s.t[np.isfinite(s.x)] for s in filmed or others if np.isfinite(s.x).sum() > 1]
    wave = own.t[np.isfinite(own.x)]
    if seen and wave.size:
        first, last = min(float(t[0]) for t in seen), max(float(t[-1]) for t in seen)
        if max(first, wave[0]) < min(last, wave[-1]):
            ends = {"start": first, "end": last} | {key: value for key, value in ends.items() if value is not None}
    return ends


def _slope(how: Mapping[str, Any], units: str, f: float) -> float | None:
    """The wave number, rad per unit of length, where the depth is known."""
    depth = how.get("depth")
    if depth is None or units not in METRES:
        return None
    return wave_number(f, np.inf if depth == "deep" else float(depth), g=G_M / METRES[units])


def _cut(series: Series, how: Mapping[str, Any]) -> Series:
    start, end = how.get("start"), how.get("end")
    use = np.ones(len(series.t), bool)
    if start is not None:
        use &= series.t >= start
    if end is not None:
        use &= series.t <= end
    return Series(series.t[use], series.x[use], series.sigma[use], series.unit, series.offset_sd)
