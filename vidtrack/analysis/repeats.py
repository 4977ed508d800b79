"""Which runs repeat each other: those under the same conditions (H, T, heading, scale) with the same analysis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

CONDITIONS = ("H", "T", "heading", "scale")

Record = Mapping[str, Any]


def repeats(runs: Sequence[Record]) -> list[list[str]]:
    """Names of runs by their conditions and analysis, in their order.

    runs   run, H, T, heading, scale (None or NaN where not stated), and analysis, what is asked of it
    """
    groups: dict[tuple[Any, ...], list[str]] = {}
    for own in runs:
        groups.setdefault((*(stated(own.get(key)) for key in CONDITIONS), repr(own.get("analysis"))), []).append(
            str(own["run"])
        )
    return list(groups.values())


def stated(value: Any) -> float | None:
    return None if value is None or not math.isfinite(float(value)) else float(value)
