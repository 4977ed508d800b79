"""Which runs repeat each other: those under the same conditions (H, T, heading, scale) with the same analysis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

CONDITIONS = ("H", "T", "heading", "scale")

Record = Mapping[str, Any]


def repeats(runs: Sequence[Record]) -> list[list[str]]:
    """Names of runs by their conditions and analysis, in their order.

    runs   run, H, T, heading, scale (None or NaN where not stated), analysis, what is asked of it, and listed: whether
           its conditions are known at all
    Of runs that are not listed, decays of one motion that is named are repeats, and nothing else: waves may differ.
    """
    groups: dict[tuple[Any, ...], list[str]] = {}
    for own in runs:
        if not own.get("listed", True) and not _one_decay(own.get("analysis")):
            groups["alone", str(own["run"])] = [str(own["run"])]
            continue
        groups.setdefault((*(stated(own.get(key)) for key in CONDITIONS), repr(own.get("analysis"))), []).append(
            str(own["run"])
        )
    return list(groups.values())


def _one_decay(analysis: Any) -> bool:
    if not isinstance(analysis, Mapping) or analysis.get("waves"):
        return False
    decay = analysis.get("decay")
    return isinstance(decay, Mapping) and decay.get("series") is not None


def stated(value: Any) -> float | None:
    return None if value is None or not math.isfinite(float(value)) else float(value)
