"""One run's wave and all that responds to it: which stretch is used, regular or irregular, what makes it doubtful."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.analysis.harmonics import FEW_SAMPLES_A_PERIOD, fit_harmonics, fundamental_frequency
from vidtrack.analysis.responses import Series, Systematic, irregular_waves, regular_waves
from vidtrack.analysis.water_waves import wave_number
from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.lengths import METRES

G_M = 9.80665
REGULAR = 0.9
"""Share of a wave's variance in its fundamental and two harmonics from which on it counts as regular."""
TRANSLATIONS, ROTATIONS = ("surge", "sway", "heave"), ("roll", "pitch", "yaw")
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


def mixing(names: Iterable[str], gradients: ArrayLike, basin: ArrayLike | None) -> Systematic:
    """For each series of targets and bodies, what the calibration's error mixes into it.

    gradients   (n, 3, 3), see `location.budget.calibration_gradients`; basin: rows (3, 3), the world directions of
                surge, sway and heave
    An angle is unsure by a share of itself: by how differently two directions may be scaled.
    """
    G = np.asarray(gradients, float)
    share = np.array([[np.sqrt(2 * np.sum(G**2) / 9)]])
    turned = G if basin is None else np.asarray(basin) @ G @ np.asarray(basin).T
    found: dict[str, tuple[Sequence[str], Array]] = {}
    for name in names:
        group, _, last = name.rpartition(".")
        for kind, own in (("xyz", G), (TRANSLATIONS, turned)):
            if group and last in kind:
                found[name] = [f"{group}.{other}" for other in kind], own[:, list(kind).index(last)]
        if group and last in ROTATIONS:
            found[name] = [name], share
    return found


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
