"""Free decay and the response to waves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.figures.style import PALETTE, REFERENCE_COLOUR, clock_axis, legend, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def free_decay(decay: Mapping[str, Any], title: str) -> Figure:
    """The fit over the data, what is left, and the decrement of half cycles against their amplitude."""
    figure, axes = new_figure(3, 1, height=2.0)
    fit, unit = decay["fit"], decay.get("unit") or ""
    t = np.array(fit["time_s"], float)
    measured, fitted = (np.array(fit[key], float) for key in ("measured", "fitted"))
    axes[0].plot(t, measured, ".", ms=2.5, color=PALETTE[0], label="measured")
    axes[0].plot(t, fitted, lw=0.9, color=PALETTE[1], label="equation of motion")
    axes[0].set_ylabel(f"{decay['series']} ({unit})", fontsize=8)
    legend(axes[0])
    axes[1].plot(t, measured - fitted, ".", ms=2.5, color=PALETTE[0])
    axes[1].set_ylabel(f"measured - fitted ({unit})", fontsize=8)
    for ax in axes[:2]:
        clock_axis(ax)
    cycles = decay["half_cycles"]
    amplitude = np.array([np.nan if v is None else v for v in cycles["amplitude"]], float)
    decrement = np.array([np.nan if v is None else v for v in cycles["decrement"]], float)
    axes[2].plot(np.sqrt(amplitude[:-1] * amplitude[1:]), decrement, "o", ms=4, color=PALETTE[2], label="half cycles")
    zeta, b = decay["zeta"]["value"], decay["quadratic"]["value"]
    line = np.linspace(0, np.nanmax(amplitude), 50)
    expected = np.pi * zeta / np.sqrt(1 - zeta**2) + 4 / 3 * b * line
    axes[2].plot(line, expected, lw=0.9, color=REFERENCE_COLOUR, label="equation of motion")
    axes[2].set_xlabel(f"amplitude ({unit})", fontsize=8)
    axes[2].set_ylabel("ln of successive amplitudes", fontsize=8)
    axes[2].set_ylim(0, 1.3 * np.nanmax([*decrement, *expected]))
    legend(axes[2])
    figure.suptitle(title, fontsize=10)
    return figure


def transfer_functions(waves: Mapping[str, Any], names: list[str], title: str) -> Figure:
    """Amplitude ratio with its 95 % band, phase and coherence of each response, over the frequencies with energy."""
    figure, axes = new_figure(3, 1, height=2.0, sharex=True)
    for i, name in enumerate(names):
        own, colour = waves["responses"][name], PALETTE[i % len(PALETTE)]
        f, ratio, width, phase, coherence = (
            np.array([np.nan if v is None else v for v in own[key]], float)
            for key in ("f_Hz", "rao", "rao_half_width", "phase_deg", "coherence")
        )
        axes[0].plot(f, ratio, ".-", ms=3, lw=0.9, color=colour, label=name)
        axes[0].fill_between(f, ratio - width, ratio + width, color=colour, alpha=0.2, lw=0)
        axes[1].plot(f, phase, ".", ms=3, color=colour)
        axes[2].plot(f, coherence, lw=0.9, color=colour)
    axes[0].set_ylabel("response over wave", fontsize=8)
    legend(axes[0])
    axes[1].set_ylabel("phase lag (deg)", fontsize=8)
    axes[1].set_ylim(-190, 190)
    axes[2].set_ylabel("coherence", fontsize=8)
    axes[2].set_ylim(0, 1.02)
    axes[2].set_xlabel("frequency (Hz)", fontsize=8)
    spectrum = waves["spectrum"]
    S = np.array([np.nan if v is None else v for v in spectrum["S"]], float)
    energetic = np.array(spectrum["f_Hz"], float)[np.nan_to_num(S) > 0.01 * np.nanmax(S)]
    axes[2].set_xlim(0, 1.5 * energetic.max())
    figure.suptitle(title, fontsize=10)
    return figure


def mean_cycle(waves: Mapping[str, Any], names: Sequence[str], title: str) -> Figure:
    """The mean cycle of a regular wave and of motions, one standard deviation over the cycles shaded."""
    each = [(waves["elevation"], waves["cycle"]), *((name, waves["responses"][name]["cycle"]) for name in names)]
    figure, axes = new_figure(len(each), 1, height=1.5, sharex=True, squeeze=False)
    for i, (ax, (name, cycle)) in enumerate(zip(axes[:, 0], each, strict=True)):
        phase, mean, sd = (
            np.array([np.nan if v is None else v for v in cycle[key]], float) for key in ("phase", "mean", "sd")
        )
        seen = np.isfinite(mean)  # samples that keep step with the wave leave bins empty
        phase, mean, sd = phase[seen], mean[seen], sd[seen]
        ax.plot(phase, mean, color=PALETTE[i % len(PALETTE)], lw=1.0)
        ax.fill_between(phase, mean - sd, mean + sd, color=PALETTE[i % len(PALETTE)], alpha=0.25, lw=0)
        ax.set_ylabel(name, fontsize=8)
    axes[-1, 0].set_xlabel("phase (periods)", fontsize=8)
    figure.suptitle(title, fontsize=10)
    return figure
