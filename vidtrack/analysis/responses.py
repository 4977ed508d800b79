"""Waves and the response of motions to them, as records of plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from vidtrack.analysis.harmonics import Harmonics, beyond_zero, fit_harmonics, phase_average, response
from vidtrack.analysis.interval import Estimate, t_factor
from vidtrack.analysis.spectra import evenly, sea_state, single_waves, spectrum, transfer
from vidtrack.arrays import Array
from vidtrack.findings import Finding

Systematic = Mapping[str, tuple[Sequence[str], Array]]
"""By series: the series of the same point whose motions mix into it by the calibration, and shares (n, that many) of
each of n independent errors of the calibration."""

LITTLE_COHERENCE = 0.6
"""A transfer function is quoted where the squared coherence is at least so much."""


class Series(NamedTuple):
    """One measured quantity against time: t (n,) s, x (n,) and its sigma (n,), NaN where missing; its unit.

    offset_sd   s, standard error of its clock against the video's
    """

    t: Array
    x: Array
    sigma: Array
    unit: str
    offset_sd: float = 0.0


def regular_waves(
    own: Series,
    f: Estimate,
    wave: Harmonics,
    motions: Mapping[str, Series],
    *,
    slope: float | None = None,
    behind: float | None = None,
    systematic: Systematic | None = None,
) -> dict[str, Any]:
    """H, T, harmonics and the mean cycle of a regular wave, and each motion's response to its fundamental.

    slope    the wave number, rad per unit of length: angles are then also given over the wave's slope
    behind   by how much the point to which phases refer lies behind the gauge, along the waves
    systematic   what the calibration leaves open of scale and axes, where it is known
    """
    turn = 360 / (2 * np.pi) * (slope or 0.0) * (behind or 0.0)  # degrees of phase from the gauge to that point
    place = f"{behind:g} behind the gauge along the waves" if behind else "at the gauge"
    record: dict[str, Any] = {
        "T_s": fields(Estimate(1 / f.value, f.half_width / f.value**2)),
        "H": fields(Estimate(2 * wave.amplitude[0].value, 2 * wave.amplitude[0].half_width)),
        "H_crossings": _crossing_height(own),
        "wave_number": slope,
        "harmonics": [fields(a) for a in wave.amplitude],
        "periods": wave.periods,
        "samples_a_period": wave.samples_a_period,
        "steadiness": wave.steadiness,
        "cycle": _cycle(own, wave.f),
        "phase_means": f"degrees by which the response follows the crest {place}",
        "responses": {},
    }
    fits: dict[str, Harmonics] = {}
    for name, motion in motions.items():
        if np.nanstd(motion.x) > 0:
            with suppress(ValueError, np.linalg.LinAlgError):
                fits[name] = fit_harmonics(motion.t, motion.x, wave.f)
    for name, found in fits.items():
        motion = motions[name]
        # clocks of one instrument err together
        clock_sd = 0.0 if own.offset_sd == motion.offset_sd else float(np.hypot(own.offset_sd, motion.offset_sd))
        each = [response(wave, found, harmonic=h + 1) for h in range(len(found.amplitude))]
        unsure = [_unsure(name, fits, systematic, h) for h in range(len(each))]
        phases = [
            _phase(one.phase_deg, turn * (h + 1), float(np.hypot(360 * wave.f * (h + 1) * clock_sd, unsure[h][1])))
            for h, one in enumerate(each)
        ]
        ratio = _widened(each[0].ratio, unsure[0][0] / max(abs(wave.coefficients[0]), 1e-300))
        ratio = beyond_zero(ratio, phases[0])[0]
        amplitudes = [_widened(a, unsure[h][0]) for h, a in enumerate(found.amplitude)]
        settled = [beyond_zero(*own) for own in zip(amplitudes, phases, strict=True)]
        amplitudes, phases = [own[0] for own in settled], [own[1] for own in settled]
        record["responses"][name] = {
            "unit": motion.unit,
            "mean": fields(found.mean),
            "harmonics": [fields(own) for own in amplitudes],
            "rao": fields(ratio),
            "phase_deg": fields(phases[0]),
            "phases_deg": [fields(phase) for phase in phases],
            "samples_a_period": found.samples_a_period,
            "steadiness": found.steadiness,
            "cycle": _cycle(motion, wave.f),
        }
        if slope is not None and motion.unit == "deg":
            by = np.degrees(slope)
            record["responses"][name]["rao_slope"] = fields(Estimate(ratio.value / by, ratio.half_width / by))
    return record


def _widened(estimate: Estimate, sd: float) -> Estimate:
    return Estimate(estimate.value, float(np.hypot(estimate.half_width, 1.96 * sd)))


def _unsure(name: str, fits: Mapping[str, Harmonics], systematic: Systematic | None, h: int) -> tuple[float, float]:
    """Standard errors of a harmonic's amplitude, as given, and phase, degrees, that the calibration's gradient makes.

    What another direction of the same point adds in phase changes the amplitude, what it adds out of phase the phase.
    """
    if systematic is None or name not in systematic:
        return 0.0, 0.0
    names, shares = systematic[name]
    own = fits[name].coefficients[h]
    size = abs(own)
    if not size > 0:
        return 0.0, 180.0
    # each motion as seen from this one: its part in phase is real
    turned = np.array([fits[other].coefficients[h] / own * size if other in fits else 0.0 for other in names])
    mixed = np.asarray(shares) @ turned
    along, across = (float(np.sqrt(np.sum(part**2))) for part in (mixed.real, mixed.imag))
    return along, float(min(180.0, np.degrees(across / size)))


def _phase(phase: Estimate, turn: float, clock_sd_deg: float) -> Estimate:
    """A phase seen from a point `turn` degrees behind, less sure by its clock; NaN where the clock is not known."""
    seen = (phase.value - turn + 180) % 360 - 180
    if not np.isfinite(clock_sd_deg):
        return Estimate(float("nan"), float("nan"))
    return Estimate(float(seen), min(180.0, float(np.hypot(phase.half_width, 1.96 * clock_sd_deg))))


def _cycle(series: Series, f: float) -> dict[str, Any]:
    phase, mean, sd = phase_average(series.t, series.x, f)
    return {"phase": phase, "mean": mean, "sd": sd}


def _crossing_height(own: Series) -> dict[str, Any]:
    """The mean height between crossings of the mean, upward and downward, and its standard deviation over the waves."""
    try:
        step, x = evenly(own.t, own.x)
    except ValueError:
        return {"mean": None, "sd": None, "n": 0}
    heights = np.concatenate([single_waves(step, x).height, single_waves(step, -x).height])
    if heights.size < 2:
        return {"mean": None, "sd": None, "n": int(heights.size)}
    return {"mean": float(heights.mean()), "sd": float(heights.std(ddof=1)), "n": int(heights.size)}


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
        "H110": single.H110,
        "Hmax": single.Hmax,
        "Tz_crossings": single.Tz,
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
        clock_sd = 0.0 if own.offset_sd == motion.offset_sd else float(np.hypot(own.offset_sd, motion.offset_sd))
        quoted, factor = found.coherence >= LITTLE_COHERENCE, t_factor(found.freedom)
        record["responses"][other] = {
            "unit": motion.unit,
            "f_Hz": found.f,
            "rao": np.where(quoted, np.abs(found.H), np.nan),
            "rao_half_width": np.where(quoted, factor * found.sd_ratio * np.abs(found.H), np.nan),
            "phase_deg": np.where(quoted & np.isfinite(clock_sd), -np.degrees(np.angle(found.H)), np.nan),
            "phase_half_width_deg": np.where(
                quoted, np.hypot(factor * np.degrees(found.sd_ratio), 1.96 * 360 * found.f * clock_sd), np.nan
            ),
            "coherence": found.coherence,
            "averages": found.averages,
        }
    return record, []


def fields(of: NamedTuple) -> dict[str, Any]:
    """A result as it is written: its fields by name, those of Estimates within."""
    return {key: fields(value) if isinstance(value, Estimate) else value for key, value in of._asdict().items()}
