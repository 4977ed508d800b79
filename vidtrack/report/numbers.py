"""Numbers as text: to the digits that they are worth, a dash for what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def number(value: Any, digits: int = 4) -> str:
    """A number to so many significant digits, without needless zeros; a dash for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if isinstance(value, int):
        return str(value)
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, power = text.split("e")
        return f"{mantissa}·10{_superscript(int(power))}"
    return text


def measured(value: Any, sd: Any, digits: int = 4) -> tuple[str, str]:
    """A number and its standard deviation, rounded to two figures of the latter: 0.00075 and 0.00025.

    Without a standard deviation the number has `digits` significant digits and the other is a dash.
    """
    if value is None or sd is None or not (math.isfinite(value) and math.isfinite(sd) and sd > 0):
        return number(value, digits), number(sd, 2)
    rounded = float(f"{sd:.1e}")  # 0.0996 is 0.10, not 0.100
    decimals = 1 - math.floor(math.log10(rounded))
    if decimals <= 6 or (decimals <= 9 and abs(value) >= 0.01):
        # + 0.0: no minus before zero
        return f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}", f"{round(sd, decimals):.{max(decimals, 0)}f}"
    power = math.floor(math.log10(max(abs(value), sd)))
    scale, places = 10.0**-power, max(decimals + power, 0)
    first, second = (f"{v * scale:.{places}f}·10{_superscript(power)}" for v in (value, sd))
    return first, second


def interval(low: Any, high: Any) -> str:
    """Both ends of an interval, to two figures of its width: 0.2 and 0.2003 are 0.20000 to 0.20030."""
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return "–"
    decimals = max(0, 1 - math.floor(math.log10(high - low))) if high > low else 4
    return f"{low:.{decimals}f} to {high:.{decimals}f}"


def share(value: Any, digits: int = 2) -> str:
    """A part of one as a percentage."""
    return "–" if value is None or not math.isfinite(value) else f"{number(100.0 * value, digits)} %"


def one_over(part: Any) -> str:
    """A small share as 1/N, N to three digits: 0.000335 is 1/2,990; a dash for what is missing."""
    if part is None or not math.isfinite(part) or part <= 0:
        return "–"
    n = 1 / part
    return f"1/{round(n, 2 - math.floor(math.log10(n))):,.0f}"


def plain(values: Any, digits: int = 6) -> list[float | None]:
    """Numbers (n,) for JSON: to so many significant digits, None for what is missing."""
    return [float(text) if text else None for text in _texts(values, digits)]


def plain_json(values: Any, digits: int = 6) -> str:
    """`plain` as JSON: a page holds ten thousands of numbers, and what the format gives is mostly JSON already."""
    texts = _texts(values, digits)
    return f"[{','.join([text if '.' in text and 'e' not in text else _as_json(text) for text in texts])}]"


def _texts(values: Any, digits: int) -> list[str]:
    """Each number to so many significant digits; empty for what is missing. One format for all costs a third."""
    numbers = np.asarray(values, float).tolist()
    texts = (f"%.{digits}g " * len(numbers) % tuple(numbers)).split()
    return [text if text[-1] <= "9" else "" for text in texts]  # inf, nan


def _as_json(text: str) -> str:
    """A number's text as `repr` gives it: where it has a point and no power it is that, the shortest of the number."""
    return repr(float(text)) if text else "null"


def pick(record: Mapping[str, Any], *path: str) -> Any:
    """What lies at a path in a nested record; None where the path ends early."""
    value: Any = record
    for part in path:
        if not isinstance(value, Mapping):
            return None
        value = value.get(part)
    return value


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
