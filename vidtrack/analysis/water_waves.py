"""Long-crested waves on water of even depth: the dispersion relation of linear theory."""

from __future__ import annotations

import numpy as np


def wave_number(f: float, depth: float, *, g: float) -> float:
    """k, rad per unit of length, of (2 pi f)^2 = g k tanh(k depth).

    f Hz; depth in that unit, inf: deep water; g in that unit per s^2. Newton's method from Guo's (2002) closed form,
    which is within 0.75 % of it.
    """
    deep = (2 * np.pi * f) ** 2 / g
    if not np.isfinite(depth):
        return float(deep)
    x = (2 * np.pi * f) * np.sqrt(depth / g)
    y = x**2 * (1 - np.exp(-(x**2.4908))) ** (-1 / 2.4908)
    for _ in range(20):
        t = np.tanh(y)
        step = (y * t - x**2) / (t + y * (1 - t**2))
        y -= step
        if abs(step) < 1e-14 * y:
            break
    return float(y / depth)
