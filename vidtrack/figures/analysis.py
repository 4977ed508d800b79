"""Free decay and the response to waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.figures.drawing import INK, Drawing, new_drawing
from vidtrack.figures.style import PALETTE


def free_decay(decay: Mapping[str, Any], title: str) -> Drawing:
    """The fit over the data, what is left, and the decrement of half cycles against their amplitude."""
    drawing = new_drawing(3, 1, height=2.0, title=title)
    over, left, decrements = drawing.axes
    fit, unit = decay["fit"], decay.get("unit") or ""
    t, measured, fitted = (_values(fit[key]) for key in ("time_s", "measured", "fitted"))
    over.dots(t, measured, PALETTE[0], size=3.5, label="measured")
    over.plot(t, fitted, PALETTE[1], label="equation of motion")
    over.ylabel, over.legend = f"{decay['series']} ({unit})", True
    left.dots(t, measured - fitted, PALETTE[0], size=3.5)
    left.ylabel = f"measured - fitted ({unit})"
    for ax in (over, left):
        ax.clock()
    cycles = decay["half_cycles"]
    amplitude, decrement = _values(cycles["amplitude"]), _values(cycles["decrement"])
    at = np.sqrt(amplitude[:-1] * amplitude[1:])
    decrements.dots(at, decrement, PALETTE[2], mark="o", size=6.0, label="half cycles")
    zeta, b = decay["zeta"]["value"], decay["quadratic"]["value"]
    line = np.linspace(0, np.nanmax(amplitude), 50)
    expected = np.pi * zeta / np.sqrt(1 - zeta**2) + 4 / 3 * b * line
    decrements.plot(line, expected, INK, label="equation of motion")
    decrements.xlabel, decrements.ylabel = f"amplitude ({unit})", "logarithmic decrement"
    decrements.ylim, decrements.legend = (0.0, 1.3 * float(np.nanmax([*decrement, *expected]))), True
    return drawing


def transfer_functions(waves: Mapping[str, Any], names: list[str], units: str, title: str) -> Drawing:
    """Amplitude ratio with its 95 % band, phase and coherence of each response, over the frequencies with energy."""
    drawing = new_drawing(3, 1, height=2.0, shared=True, title=title)
    ratios, phases, coherences = drawing.axes
    for i, name in enumerate(names):
        own, colour = waves["responses"][name], PALETTE[i % len(PALETTE)]
        f, ratio, width, phase, coherence = (
            _values(own[key]) for key in ("f_Hz", "rao", "rao_half_width", "phase_deg", "coherence")
        )
        ratios.around(f, ratio, width, colour)
        ratios.plot(f, ratio, colour, mark=".", size=4.0, label=f"{name} ({own.get('unit') or 'its unit'}/{units})")
        phases.dots(f, phase, colour, size=4.0)
        coherences.plot(f, coherence, colour)
    spectrum = waves["spectrum"]
    S = _values(spectrum["S"])
    energetic = np.array(spectrum["f_Hz"], float)[np.nan_to_num(S) > 0.01 * np.nanmax(S)]
    for ax in drawing.axes:
        ax.xlim = (0.0, 1.5 * float(energetic.max()))
    ratios.ylabel, ratios.legend = "response over wave", True
    phases.ylabel, phases.ylim = "phase lag (deg)", (-190.0, 190.0)
    coherences.ylabel, coherences.ylim, coherences.xlabel = "coherence", (0.0, 1.02), "frequency (Hz)"
    return drawing


def mean_cycle(waves: Mapping[str, Any], names: Sequence[str], units: str, title: str) -> Drawing:
    """The mean cycle of a regular wave and of motions, one standard deviation over the cycles shaded."""
    each = [(f"{waves['elevation']} ({units})", waves["cycle"])]
    for name in names:
        own = waves["responses"][name]
        each.append((f"{name} ({own['unit']})" if own.get("unit") else name, own["cycle"]))
    drawing = new_drawing(len(each), 1, height=1.4, shared=True, title=title)
    for i, (ax, (name, cycle)) in enumerate(zip(drawing.axes, each, strict=True)):
        phase, mean, sd = (_values(cycle[key]) for key in ("phase", "mean", "sd"))
        seen = np.isfinite(mean)  # samples that keep step with the wave leave bins empty
        phase, mean, sd = phase[seen], mean[seen], sd[seen]
        colour = PALETTE[i % len(PALETTE)]
        ax.around(phase, mean, sd, colour)
        ax.plot(phase, mean, colour)
        ax.ylabel = name
    drawing.axes[-1].xlabel = "phase (periods)"
    return drawing


def _values(each: Sequence[float | None]) -> Array:
    return np.array([np.nan if v is None else v for v in each], float)
