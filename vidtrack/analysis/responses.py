"""Waves and the response of motions to them, as records of plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vidtrack.analysis.harmonics import Harmonics, fit_harmonics, phase_average, response
from vidtrack.analysis.interval import Estimate
from vidtrack.analysis.spectra import evenly, sea_state, single_waves, spectrum, transfer
from vidtrack.arrays import Array
from vidtrack.findings import Finding

LITTLE_COHERENCE = 0.6
"""A transfer function is quoted where the squared coherence is at least so much."""


class Series(NamedTuple):
    """One measured quantity against time: t (n,) s, x (n,) and its sigma (n,), NaN where missing; its unit."""

    t: Array
    x: Array
    sigma: Array
    unit: str


def regular_waves(own: Series, f: Estimate, wave: Harmonics, motions: Mapping[str, Series]) -> dict[str, Any]:
    """H, T, harmonics and the mean cycle of a regular wave, and each motion's response to its fundamental."""
    phase, mean, sd = phase_average(own.t, own.x, wave.f)
    record: dict[str, Any] = {
        "T_s": fields(Estimate(1 / f.value, f.half_width / f.value**2)),
        "H": fields(Estimate(2 * wave.amplitude[0].value, 2 * wave.amplitude[0].half_width)),
        "harmonics": [fields(a) for a in wave.amplitude],
        "periods": wave.periods,
        "samples_a_period": wave.samples_a_period,
        "steadiness": wave.steadiness,
        "cycle": {"phase": phase, "mean": mean, "sd": sd},
        "phase_means": "degrees by which the response follows the crest at the gauge",
        "responses": {},
    }
    for name, motion in motions.items():
        if not np.nanstd(motion.x) > 0:
            continue
        try:
            found = fit_harmonics(motion.t, motion.x, wave.f)
        except (ValueError, np.linalg.LinAlgError):
            continue
        ratio = response(wave, found)
        record["responses"][name] = {
            "unit": motion.unit,
            "mean": fields(found.mean),
            "harmonics": [fields(a) for a in found.amplitude],
            "rao": fields(ratio.ratio),
            "phase_deg": fields(ratio.phase_deg),
            "steadiness": found.steadiness,
        }
    return record


def irregular_waves(
    own: Series, motions: Mapping[str, Series], how: Mapping[str, Any], name: str
) -> tuple[dict[str, Any], list[Finding]]:
    """The sea state of an irregular wave, and the transfer function of each motion."""
    try:
        step, x = evenly(own.t, own.x)
    except ValueError as problem:
        cure = "Record a longer stretch without gaps."
        return {}, [Finding("bad", "wave-not-found", f"waves: {name}: {problem}", cure)]
    resolution = how.get("resolution")
    of_wave = spectrum(step, x, resolution=resolution)
    single = single_waves(step, x)
    record: dict[str, Any] = {
        **sea_state(of_wave)._asdict(),
        "H13": single.H13,
        "Hmax": single.Hmax,
        "n_waves": len(single.height),
        "spectrum": {"f_Hz": of_wave.f, "S": of_wave.S, "low": of_wave.low, "high": of_wave.high},
        "degrees_of_freedom": of_wave.freedom,
        "responses": {},
    }
    good = np.isfinite(own.t) & np.isfinite(own.x)
    for other, motion in motions.items():
        measured = np.isfinite(motion.x)
        if measured.mean() < 0.98:
            continue
        try:
            own_step, y = evenly(motion.t, motion.x)
        except ValueError:
            continue
        begin = motion.t[measured][0]
        grid = begin + own_step * np.arange(len(y))
        inside = (grid >= own.t[good][0]) & (grid <= own.t[good][-1])
        if inside.sum() < 64:
            continue
        at_motion = np.interp(grid[inside], own.t[good], own.x[good])
        found = transfer(own_step, at_motion, y[inside], resolution=resolution)
        quoted = found.coherence >= LITTLE_COHERENCE
        record["responses"][other] = {
            "unit": motion.unit,
            "f_Hz": found.f,
            "rao": np.where(quoted, np.abs(found.H), np.nan),
            "rao_half_width": np.where(quoted, 1.96 * found.sd_ratio * np.abs(found.H), np.nan),
            "phase_deg": np.where(quoted, -np.degrees(np.angle(found.H)), np.nan),
            "phase_half_width_deg": np.where(quoted, np.degrees(1.96 * found.sd_ratio), np.nan),
            "coherence": found.coherence,
            "averages": found.averages,
        }
    return record, []


def fields(of: NamedTuple) -> dict[str, Any]:
    """A result as it is written: its fields by name, those of Estimates within."""
    return {key: fields(value) if isinstance(value, Estimate) else value for key, value in of._asdict().items()}
