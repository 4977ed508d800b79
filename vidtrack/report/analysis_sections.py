"""What the report says of a run's motions, free decay and waves; record: analysis.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.report.numbers import measured, number
from vidtrack.report.page import Table

Record = Mapping[str, Any]

DEGREES_OF_FREEDOM = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def analysis_tables(record: Record, units: str) -> list[Table]:
    """The tables that there is something in."""
    decay, waves = record.get("decay") or {}, record.get("waves") or {}
    tables = [
        *motions_tables(record.get("motions") or {}, units),
        decay_table(decay) if decay.get("fn_Hz") else None,
        wave_table(waves, units) if waves.get("kind") else None,
        response_table(waves) if waves.get("kind") == "regular" and waves.get("responses") else None,
    ]
    return [table for table in tables if table]


def motions_tables(motions: Record, units: str) -> list[Table]:
    """Statistics of the six degrees of freedom of each point of each body."""
    tables = []
    for body, points in motions.items():
        for point, own in points.items():
            rows = []
            for dof in DEGREES_OF_FREEDOM:
                s = own[dof]
                mean, width = _value(s["mean"])
                drift, drift_width = _value(s["drift"])
                extremes = (number(s[key], 4) for key in ("sd", "least", "most"))
                unit = units if dof in DEGREES_OF_FREEDOM[:3] else "deg"
                rows.append([f"{dof} ({unit})", f"{mean} ± {width}", *extremes, f"{drift} ± {drift_width}"])
            at = "its origin" if point == "origin" else point
            caption = (
                f"Motions of {body} at {at}, about its mean place and attitude; ± is half a 95 % interval. Horizontal "
                f"excursion at most {number(own['watch_circle'], 3)} {units}"
            )
            tables.append(Table(caption, ["motion", "mean", "standard deviation", "min", "max", "drift"], rows))
    return tables


def decay_table(decay: Record) -> Table:
    """Natural period and damping, by the equation of motion and by the decrement of half cycles."""
    unit = decay.get("unit") or "unit"
    by = decay.get("decrement") or {}
    rows = [
        ["damped period Td (s)", *_value(decay["Td_s"]), "–"],
        ["natural frequency fn (Hz)", *_value(decay["fn_Hz"]), "–"],
        ["linear damping, zeta", *_value(decay["zeta"]), _short(by.get("zeta"))],
        [f"quadratic damping, b (1/{unit})", *_value(decay["quadratic"]), _short(by.get("quadratic"))],
    ]
    caption = (
        f"Free decay of {decay['series']}: {number(decay['cycles'], 3)} cycles, "
        f"residual {number(decay['rms'], 2)} {unit} rms; {decay['equation']}"
    )
    return Table(caption, ["quantity", "estimate", "± 95 %", "by the decrement of half cycles"], rows)


def wave_table(waves: Record, units: str) -> Table:
    """What is quoted of the wave itself."""
    if waves["kind"] == "regular":
        height, width = _value(waves["H"])
        rows = [
            ["period T (s)", " ± ".join(_value(waves["T_s"]))],
            ["height H, of the fundamental", f"{height} ± {width}"],
            *([f"amplitude of harmonic {i + 1}", " ± ".join(_value(h))] for i, h in enumerate(waves["harmonics"])),
            ["whole periods used", number(waves["periods"])],
            ["samples a period", number(waves["samples_a_period"], 3)],
            ["scatter of the amplitude over the periods", f"{number(100 * waves['steadiness'], 2)} %"],
        ]
    else:
        names = (("Hm0", "Hm0 = 4 √m0"), ("Tp", "Tp (s)"), ("Tz", "Tz = √(m0/m2) (s)"), ("Te", "Te = m-1/m0 (s)"))
        rows = [[label, number(waves.get(key), 4)] for key, label in names]
        rows += [[key, number(waves.get(key), 4)] for key in ("H13", "Hmax", "n_waves")]
        rows.append(["degrees of freedom of the spectrum", number(waves.get("degrees_of_freedom"), 3)])
    return Table(f"Waves: {waves['elevation']}, {waves['kind']}", ["quantity", "estimate"], rows)


def response_table(waves: Record) -> Table:
    """Amplitude ratio and phase of every motion."""
    rows = []
    for name, own in waves["responses"].items():
        ratio, width = _value(own["rao"])
        phase, phase_width = _value(own["phase_deg"])
        amplitude, amplitude_width = _value(own["harmonics"][0])
        rows.append(
            [
                f"{name} ({own['unit'] or 'its unit'})",
                f"{amplitude} ± {amplitude_width}",
                f"{ratio} ± {width}",
                f"{phase} ± {phase_width}",
            ]
        )
    caption = f"Response to the fundamental of {waves['elevation']}; phase: {waves['phase_means']}"
    return Table(caption, ["motion", "amplitude", "over the wave's amplitude (RAO)", "phase (deg)"], rows)


def _value(estimate: Record) -> tuple[str, str]:
    return measured(estimate.get("value"), estimate.get("half_width"))


def _short(estimate: Record | None) -> str:
    return " ± ".join(_value(estimate)) if estimate and estimate.get("value") is not None else "–"
