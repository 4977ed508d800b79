"""What the report says of a run's motions, free decay and waves; record: analysis.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.analysis.harmonics import FEW_SAMPLES_A_PERIOD
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import measured, number, share
from vidtrack.report.page import Table

Record = Mapping[str, Any]


def analysis_tables(record: Record, units: str) -> list[Table]:
    """The tables that there is something in."""
    decay, waves = record.get("decay") or {}, record.get("waves") or {}
    regular = waves.get("kind") == "regular" and bool(waves.get("responses"))
    tables = [
        clock_of_channels(record.get("channels") or {}),
        *motions_tables(record.get("motions") or {}, units, str(record.get("about") or "mean")),
        decay_table(decay) if decay.get("fn_Hz") else None,
        energy_table(decay) if decay.get("fn_Hz") else None,
        wave_table(waves, units) if waves.get("kind") else None,
        response_table(waves) if regular else None,
        harmonics_table(waves) if regular else None,
    ]
    return [table for table in tables if table]


def warnings(record: Record) -> list[str]:
    """What a reader of the numbers has to know, though they are right: few samples a period of a regular wave."""
    waves: Record = record.get("waves") or {}
    each = {waves.get("elevation"): waves.get("samples_a_period")}
    each |= {name: own.get("samples_a_period") for name, own in (waves.get("responses") or {}).items()}
    few = {name: n for name, n in each.items() if n is not None and n < FEW_SAMPLES_A_PERIOD - 0.5}
    if not few:
        return []
    least = min(few, key=lambda name: few[name])
    others = f" and {len(few) - 1} more" if len(few) > 1 else ""
    return [
        f"Warning: {number(few[least], 3)} samples a period of {least}{others}; {FEW_SAMPLES_A_PERIOD} are asked for "
        "where such numbers validate others. Record at a higher rate."
    ]


def motions_tables(motions: Record, units: str, about: str = "mean") -> list[Table]:
    """Statistics of the six degrees of freedom of each point of each body."""
    tables = []
    for body, points in motions.items():
        for point, own in points.items():
            rows = []
            for dof in DEGREES_OF_FREEDOM:
                s = own[dof]
                unit = units if dof in DEGREES_OF_FREEDOM[:3] else "deg"
                cells = [_pm(s[key], s.get(f"{key}_half_width")) for key in ("sd", "least", "most")]
                rows.append(
                    [f"{dof} ({unit})", _estimate(s["mean"]), *cells, _estimate(s["drift"]), number(s.get("sigma"), 2)]
                )
            at = "its origin" if point == "origin" else point
            place = {"mean": "its mean place and attitude", "rest": "its place and attitude at rest"}.get(about)
            caption = (
                f"Motions of {body} at {at}, about {place or f'its place and attitude from {about}'}; ± is half a 95 % "
                f"interval. Watch circle: {number(own['watch_circle'], 3)} {units}"
            )
            header = ["motion", "mean", "standard deviation", "min", "max", "drift", "sigma of a sample"]
            tables.append(Table(caption, header, rows, ABOUT["motions"]))
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
    header = ["quantity", "estimate", "± 95 %", "by the decrement of half cycles"]
    return Table(caption, header, rows, ABOUT["decay"])


def energy_table(decay: Record) -> Table | None:
    """What moved besides the degree of freedom that was released."""
    rows = [[name, share(part, 3)] for name, part in (decay.get("energy") or {}).items()]
    if not rows:
        return None
    caption = f"Other motions during the decay, their variance over that of {decay['series']}"
    return Table(caption, ["motion", "share"], rows, ABOUT["energy"])


def clock_of_channels(channels: Record) -> Table | None:
    """How the clock of the other instruments was joined to the video's."""
    clock: Record = channels.get("clock") or {}
    if not clock:
        return None
    offset, sd = measured(clock.get("offset_s"), clock.get("offset_sd_s"))
    rate, rate_sd = measured(clock.get("rate_ppm"), clock.get("rate_sd_ppm"))
    rows = [
        ["joined by", str(clock["method"]), ""],
        ["added to their times (s)", offset, sd],
        *([["rate (ppm)", rate, rate_sd]] if clock.get("rate_ppm") is not None else []),
        *(
            [["switchings that agree", number(clock["n"]), ""]]
            if clock.get("method") == "lamp" and "n" in clock
            else []
        ),
    ]
    names = ", ".join(channels.get("names") or ())
    return Table(f"Clock of the other instruments ({names})", ["quantity", "value", "± sd"], rows, ABOUT["channels"])


def wave_table(waves: Record, units: str) -> Table:
    """What is quoted of the wave itself."""
    if waves["kind"] == "regular":
        height, width = _value(waves["H"])
        rows = [
            ["period T (s)", " ± ".join(_value(waves["T_s"]))],
            [f"height H, of the fundamental ({units})", f"{height} ± {width}"],
            *_crossings(waves.get("H_crossings") or {}, units),
            *(
                [f"amplitude of harmonic {i + 1} ({units})", " ± ".join(_value(h))]
                for i, h in enumerate(waves["harmonics"])
            ),
            ["whole periods used", number(waves["periods"])],
            ["samples a period", _enough(waves["samples_a_period"])],
            *_of_motions(waves),
            ["scatter of the amplitude over the periods", f"{number(100 * waves['steadiness'], 2)} %"],
        ]
    else:
        names = (
            ("Hm0", f"Hm0 = 4 √m0 ({units})"),
            ("Tp", "Tp (s)"),
            ("Tz", "Tz = √(m0/m2) (s)"),
            ("Te", "Te = m-1/m0 (s)"),
        )
        rows = [[label, number(waves.get(key), 4)] for key, label in names]
        singles = (
            ("H13", f"H1/3 ({units})"),
            ("H110", f"H1/10 ({units})"),
            ("Hmax", f"Hmax ({units})"),
            ("Tz_crossings", "Tz by crossings (s)"),
        )
        rows += [[label, number(waves.get(key), 4)] for key, label in singles]
        rows.append(["waves between upward crossings", number(waves.get("n_waves"))])
        rows.append(["degrees of freedom of the spectrum", number(waves.get("degrees_of_freedom"), 3)])
    return Table(f"Waves: {waves['elevation']}, {waves['kind']}", ["quantity", "estimate"], rows, ABOUT["waves"])


def response_table(waves: Record) -> Table:
    """Amplitude ratio and phase of every motion."""
    rows = []
    slope = any("rao_slope" in own for own in waves["responses"].values())
    for name, own in _bodies_first(waves["responses"]):
        rows.append(
            [
                f"{name} ({own['unit'] or 'its unit'})",
                _estimate(own["harmonics"][0]),
                _estimate(own["rao"]),
                *([_estimate(own["rao_slope"]) if "rao_slope" in own else "–"] if slope else []),
                _estimate(own["phase_deg"]),
            ]
        )
    caption = f"Response to the fundamental of {waves['elevation']}; phase: {waves['phase_means']}"
    header = ["motion", "amplitude", "over the wave's amplitude (RAO)", "phase (deg)"]
    if slope:
        header.insert(3, "over the wave's slope (deg/deg)")
    return Table(caption, header, rows, ABOUT["responses"])


def harmonics_table(waves: Record) -> Table | None:
    """The second and third harmonic of every motion."""
    rows = []
    for name, own in _bodies_first(waves["responses"]):
        if len(own.get("phases_deg") or ()) > 2:
            cells = [_estimate(own[key][h]) for h in (1, 2) for key in ("harmonics", "phases_deg")]
            rows.append([f"{name} ({own['unit'] or 'its unit'})", *cells])
    if not rows:
        return None
    header = ["motion", "2nd: amplitude", "phase (deg)", "3rd: amplitude", "phase (deg)"]
    return Table("Higher harmonics of the motions", header, rows, ABOUT["harmonics"])


def _bodies_first(responses: Record) -> list[tuple[str, Record]]:
    return sorted(responses.items(), key=lambda item: item[0].rsplit(".", 1)[-1] not in DEGREES_OF_FREEDOM)


def _enough(samples: float) -> str:
    """Samples a period, with a warning where they are few."""
    few = samples < FEW_SAMPLES_A_PERIOD - 0.5
    return number(samples, 3) + (f" (warning: below {FEW_SAMPLES_A_PERIOD})" if few else "")


def _of_motions(waves: Record) -> list[list[str]]:
    """Samples a period of the motions, where they are recorded at another rate than the wave."""
    each = [own["samples_a_period"] for own in (waves.get("responses") or {}).values() if own.get("samples_a_period")]
    if not each or abs(min(each) / waves["samples_a_period"] - 1) < 0.01:
        return []
    return [["samples a period of the motions, at least", _enough(min(each))]]


def _crossings(own: Record, units: str) -> list[list[str]]:
    if own.get("mean") is None:
        return []
    return [
        [
            f"height H between crossings, mean ± sd of the waves ({units})",
            f"{number(own['mean'], 4)} ± {number(own['sd'], 2)}",
        ]
    ]


def _estimate(estimate: Record) -> str:
    return _pm(estimate.get("value"), estimate.get("half_width"))


def _pm(value: Any, half_width: Any) -> str:
    """A value and half its interval; the value alone, or a dash, where the other is missing."""
    first, second = measured(value, half_width)
    return f"{first} ± {second}" if second != "–" else first


def _value(estimate: Record) -> tuple[str, str]:
    return measured(estimate.get("value"), estimate.get("half_width"))


def _short(estimate: Record | None) -> str:
    return " ± ".join(_value(estimate)) if estimate and estimate.get("value") is not None else "–"
