"""A campaign: what all runs together say; which of them repeat each other, and how far repeats scatter.

Of n repeats with standard deviation s the mean has the type A uncertainty s / sqrt(n) with n - 1 degrees of freedom
(GUM 4.2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.analysis.decay import pooled
from vidtrack.analysis.interval import t_factor
from vidtrack.analysis.repeats import CONDITIONS, repeats, stated
from vidtrack.analysis.scaling import Quantity, full_scale

Record = Mapping[str, Any]


def campaign(runs: Sequence[Record], records: Mapping[str, Record]) -> dict[str, Any]:
    """The record of a campaign.

    runs      as for `repeats`, with repeat and notes; records: analysis.json by run, of those that were analysed
    Keys: runs: {run: conditions, measured (H, T_s, Hm0, Tp, fn_Hz, zeta ...), responses: {motion: rao, phase_deg},
    full_scale}; repeats: each group of two runs or more with {quantity: n, mean, sd, u_A, half_width}; pooled: the
    decays of each group.
    """
    each = {str(own["run"]): _one(own, records.get(str(own["run"]))) for own in runs}
    groups = [group for group in repeats(runs) if sum(name in records for name in group) > 1]
    return {
        "runs": each,
        "repeats": [{"runs": group, **_scatter([each[name] for name in group if name in records])} for group in groups],
        "pooled": [found for group in groups if (found := _pooled(group, records))],
    }


def type_a(values: Sequence[float]) -> dict[str, Any]:
    """n repeats: their mean, standard deviation, type A uncertainty of the mean, half width of its 95 % interval."""
    x = np.asarray(values, float)
    x = x[np.isfinite(x)]
    if x.size < 2:
        return {
            "n": int(x.size),
            "mean": float(x.mean()) if x.size else None,
            "sd": None,
            "u_A": None,
            "half_width": None,
        }
    sd = float(x.std(ddof=1))
    u = sd / math.sqrt(x.size)
    return {"n": int(x.size), "mean": float(x.mean()), "sd": sd, "u_A": u, "half_width": t_factor(x.size - 1) * u}


def _one(own: Record, record: Record | None) -> dict[str, Any]:
    scale = stated(own.get("scale"))
    found: dict[str, Any] = {key: stated(own.get(key)) for key in CONDITIONS}
    found |= {key: str(own.get(key) or "") for key in ("repeat", "notes")}
    found |= {"analysed": record is not None, "measured": {}, "responses": {}, "full_scale": {}}
    quantities = _quantities(record) if record else {}
    found["measured"] = {name: value for name, (value, _) in quantities.items()}
    waves: Record = (record or {}).get("waves") or {}
    if waves.get("kind") == "regular":
        found["responses"] = {
            name: {key: response[key] for key in ("unit", "rao", "phase_deg", "rao_slope") if key in response}
            for name, response in waves.get("responses", {}).items()
        }
    if scale is not None:
        found["full_scale"] = _at_full_scale(found, quantities, scale)
    return found


def _at_full_scale(
    found: Record, quantities: Mapping[str, tuple[dict[str, Any], Quantity]], scale: float
) -> dict[str, Any]:
    kinds: dict[str, Quantity] = {"H": "length", "T": "time"}
    whole = {key: full_scale(found[key], kind, scale) for key, kind in kinds.items() if found[key] is not None}
    for name, (value, kind) in quantities.items():
        if value["value"] is not None:
            whole[name] = full_scale(float(value["value"]), kind, scale)
    responses = {
        name: full_scale(float(own["rao"]["value"]), "angle_per_length" if own["unit"] == "deg" else "none", scale)
        for name, own in found["responses"].items()
        if own["rao"]["value"] is not None
    }
    return whole | {"responses": responses}


def _quantities(record: Record) -> dict[str, tuple[dict[str, Any], Quantity]]:
    """What was measured in a run by name: {value, half_width} and how it scales."""
    decay: Record = record.get("decay") or {}
    waves: Record = record.get("waves") or {}
    kinds: dict[str, Quantity] = {"Td_s": "time", "fn_Hz": "frequency", "zeta": "none", "quadratic": "per_length"}
    found: dict[str, tuple[dict[str, Any], Quantity]] = {
        name: (dict(decay[name]), kind) for name, kind in kinds.items() if name in decay
    }
    if waves.get("kind") == "regular":
        found |= {"H_measured": (dict(waves["H"]), "length"), "T_s": (dict(waves["T_s"]), "time")}
    elif waves.get("kind") == "irregular" and waves.get("Hm0") is not None:
        irregular: dict[str, Quantity] = {"Hm0": "length", "Tp": "time", "Tz": "time", "Te": "time"}
        found |= {name: ({"value": waves[name], "half_width": None}, kind) for name, kind in irregular.items()}
    return found


def _scatter(each: Sequence[Record]) -> dict[str, Any]:
    """Type A of each quantity and response over repeats."""
    names = dict.fromkeys(name for own in each for name in own["measured"])
    quantities = {name: type_a([_value(own["measured"].get(name)) for own in each]) for name in names}
    motions = dict.fromkeys(name for own in each for name in own["responses"])
    responses = {
        name: {
            key: type_a(_together([_value(own["responses"].get(name, {}).get(key)) for own in each], key))
            for key in ("rao", "phase_deg")
        }
        for name in motions
    }
    return {"quantities": quantities, "responses": responses}


def _together(values: Sequence[float], key: str) -> list[float]:
    """Phases within half a turn of the first: 179 and -179 degrees are two apart."""
    if key != "phase_deg" or not values:
        return list(values)
    first = next((v for v in values if math.isfinite(v)), 0.0)
    return [first + (v - first + 180) % 360 - 180 for v in values]


def _pooled(group: Sequence[str], records: Mapping[str, Record]) -> dict[str, Any] | None:
    decays = {name: records[name].get("decay") or {} for name in group if name in records}
    good = {name: own for name, own in decays.items() if own.get("fn_Hz")}
    if len(good) < 2 or len({own["series"] for own in good.values()}) > 1:
        return None
    found: dict[str, Any] = {"runs": list(good), "series": next(iter(good.values()))["series"]}
    for name in ("Td_s", "fn_Hz", "zeta", "quadratic"):
        estimates = [(_value(own[name]), _width(own[name])) for own in good.values()]
        found[name] = pooled(estimates)._asdict()
    return found


def _value(estimate: Record | None) -> float:
    value = (estimate or {}).get("value")
    return float("nan") if value is None else float(value)


def _width(estimate: Record) -> float:
    width = estimate.get("half_width")
    return float("nan") if width is None else float(width)
