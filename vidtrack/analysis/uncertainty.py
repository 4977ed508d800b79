"""The uncertainty statement of a run: parts, combined, expanded, what dominates and what would halve it.

Guide to the Expression of Uncertainty in Measurement (JCGM 100:2008) and ITTC 7.5-02-07-02.1: standard uncertainties of
type B from the covariance that each fix carries, type A from repeats; combined as the root of the sum of their squares;
expanded with the coverage factor 2. Values are those of one sample, not of a mean over the run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.analysis.campaign import type_a
from vidtrack.freedom import DEGREES_OF_FREEDOM

PARTS = ("survey", "calibration", "centroid", "clock", "lever arm", "repeat")

COVERAGE = 2.0
"""The coverage factor k: some 95 % where errors are normal."""


CURES = {
    "survey": "a survey whose tolerance is {share} of what it is",
    "calibration": "calibration clips with {times} as many pictures, or points over more of the pictures",
    "centroid": "targets, or lenses, that make the targets {root} as large in the pictures",
    "clock": "one generator of time code for all cameras, or a lamp in their view",
    "lever arm": "targets farther apart on the body, or nearer to the point",
    "repeat": "{times} as many repeats",
}

Record = Mapping[str, Any]


def uncertainty_statement(
    budget: Record | None, motions: Record, axes: Record, repeated: Sequence[Record] = ()
) -> dict[str, Any]:
    """The statement of one run.

    budget     `axes` of locate.json's uncertainty: for x, y, z the parts that positions have; None: there are none
    motions    `motions` of analysis.json; axes: its axes, waves and up
    repeated   `motions` of all repeats of the run, its own among them
    Keys: k; positions: {x, y, z: parts, combined, expanded, dominant, cure}; motions: {body: {point: {surge ...: the
    same}}}. World units, degrees of angles.
    """
    budget = budget or {}
    positions = {axis: statement({part: own[part] for part in PARTS if part in own}) for axis, own in budget.items()}
    found = {
        body: {
            point: {
                dof: statement(
                    _of_motion(dof, own[dof], points["origin"][dof], budget, axes, _sds(repeated, body, point, dof))
                )
                for dof in DEGREES_OF_FREEDOM
                if own[dof].get("sigma") is not None
            }
            for point, own in points.items()
        }
        for body, points in motions.items()
    }
    return {"k": COVERAGE, "positions": positions, "motions": found}


def statement(parts: Mapping[str, float]) -> dict[str, Any]:
    """Parts, combined, expanded, the part that dominates, and what would halve the whole."""
    combined = math.sqrt(sum(u * u for u in parts.values()))
    out: dict[str, Any] = {"parts": dict(parts), "combined": combined, "expanded": COVERAGE * combined}
    if combined == 0:
        return out | {"dominant": None, "dominant_share": None, "cure": None}
    dominant = max(parts, key=lambda part: parts[part])
    share = (parts[dominant] / combined) ** 2
    return out | {"dominant": dominant, "dominant_share": share, "cure": _cure(dict(parts), combined)}


def _of_motion(
    dof: str, own: Record, origin: Record, budget: Record, axes: Record, repeated: Sequence[float]
) -> dict[str, float]:
    """The parts of one degree of freedom: what the origin has, in the shares of positions; the arm to the point."""
    sigma, of_origin = float(own["sigma"]), float(origin.get("sigma") or own["sigma"])
    shares = _shares(dof, budget, axes)
    rotation = dof in DEGREES_OF_FREEDOM[3:]
    base = sigma if rotation else min(sigma, of_origin)
    parts = {part: base * math.sqrt(share) for part, share in shares.items()} if shares else {"centroid": base}
    parts["lever arm"] = 0.0 if rotation else math.sqrt(max(0.0, sigma**2 - base**2))
    if len(repeated) > 1:
        parts["repeat"] = float(type_a(repeated)["u_A"] or 0.0)
    return parts


def _shares(dof: str, budget: Record, axes: Record) -> dict[str, float]:
    """The share of each part in the variance of positions along the direction of a motion; of angles: over all axes."""
    if not budget:
        return {}
    names = list(budget)
    if dof in DEGREES_OF_FREEDOM[:3] and axes:
        along, up = axes["waves"][1], axes["up"][1]
        across = next(axis for axis in "xyz" if axis not in (along, up))
        names = [{"surge": along, "sway": across, "heave": up}[dof]]
    variance = {part: sum(float(budget[n].get(part) or 0.0) ** 2 for n in names) for part in PARTS[:4]}
    whole = sum(variance.values())
    return {part: v / whole for part, v in variance.items()} if whole > 0 else {}


def _sds(repeated: Sequence[Record], body: str, point: str, dof: str) -> list[float]:
    """The standard deviation of a motion in each repeat: how large it was."""
    found = [own.get(body, {}).get(point, {}).get(dof, {}).get("sd") for own in repeated]
    return [float(v) for v in found if v is not None]


def _cure(parts: Mapping[str, float], combined: float) -> str:
    """What would halve the combined uncertainty: the largest part made smaller, or several where one is not enough."""
    by_size = sorted(parts, key=lambda part: -parts[part])
    for count in range(1, len(by_size) + 1):
        named = by_size[:count]
        others = math.sqrt(sum(parts[part] ** 2 for part in by_size[count:]))
        if others < combined / 2:
            own = math.sqrt(sum(parts[part] ** 2 for part in named))
            left = math.sqrt(combined**2 / 4 - others**2) / own
            if count > 1:
                return f"{', '.join(named[:-1])} and {named[-1]} together at {left:.2g} of what they are"
            words = {"share": f"{left:.2g}", "times": f"{1 / left**2:.2g} times", "root": f"{1 / left:.2g} times"}
            return CURES[named[0]].format(**words)
    return "nothing that is named here"
