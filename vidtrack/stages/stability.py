"""Stage stability: the calibration before a test compared with one after it: did a camera move, at what cost?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.assessment.accuracy import AXES, errors_by_axis, largest_distance
from vidtrack.calibration.assessment.field_of_view import diagonal_field
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.movement import TURNS, Movement, movement
from vidtrack.calibration.surveys.shared_points import SharedPoints, side_by_side
from vidtrack.findings import Finding, Level, as_records
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import locate_points

SURE = 0.001
"""ASSUME: a movement that a camera at rest would show less often than this is one."""

IN_PLACE = 16.3
"""Chi-squared of 3 degrees of freedom that is exceeded once in a thousand times."""

LENS_CHANGED = 4.0
"""Standard deviations by which f must differ to have changed."""

HARMLESS_PX, HARMLESS_SHARE = 0.5, 0.002
"""px by which a movement shifts the picture, and share of f: beyond them positions are worse than their sigma says."""


def stability(
    before: Sequence[Camera],
    after: Sequence[Camera],
    before_points: Sequence[pd.DataFrame],
    after_points: Sequence[pd.DataFrame],
    *,
    uncertainties: tuple[Sequence[Uncertainty | None], Sequence[Uncertainty | None]] | None = None,
    sigma: float = 0.0,
    units: str = "",
) -> dict[str, Any]:
    """What happened to the cameras between two sets of calibration clips (thesis 6.8 asks for it).

    before, after   m cameras as calibrated on each set, with their names
    ..._points      points.parquet of each camera and set; only used sights count
    uncertainties   of the cameras before and after, for the change of lens
    sigma           units, survey tolerance of points that have none of their own
    For each camera the movement in units and degrees with its standard deviation (see
    `vidtrack.calibration.movement`), how far the picture moved, and the change of f; for all together, the errors by
    axis of the later points, located with the cameras of before (what the movement costs) and of after (what there
    would be without it).
    """
    sets = side_by_side(before_points, sigma=sigma), side_by_side(after_points, sigma=sigma)
    record: dict[str, Any] = {}
    findings: list[Finding] = []
    for i, (old, new) in enumerate(zip(before, after, strict=True)):
        if old.image_size != new.image_size:
            record[old.name], finding = _other_size(old, new)
            findings.append(finding)
            continue
        known = (uncertainties[0][i], uncertainties[1][i]) if uncertainties else (None, None)
        lens = _lens(old, new, known)
        try:
            moved = movement(old, _sights(sets[0], i), _sights(sets[1], i), survey=_survey(sets, i))
        except ValueError as error:
            record[old.name] = {"moved": None, "reason": str(error), "lens": lens}
            text = f"{old.name}: whether it moved between the two calibrations is not known: {error}"
            cure = "Show more points to this camera in the clips before and after the test."
            findings.append(Finding("doubtful", "movement-unknown", text, cure))
            continue
        record[old.name] = {**_movement(moved), "lens": lens}
        findings += _findings(old.name, moved, lens, units)
    sizes_agree = all(old.image_size == new.image_size for old, new in zip(before, after, strict=True))
    located = _located(before, after, sets[1]) if sizes_agree else None
    return {"units": units, "cameras": record, "located": located, "findings": as_records(findings)}


def _other_size(old: Camera, new: Camera) -> tuple[dict[str, Any], Finding]:
    """A camera whose clips after the test have pictures of another size: px of one are not px of the other."""
    sizes = [f"{width} x {height}" for width, height in (old.image_size, new.image_size)]
    reason = f"its clips show {sizes[0]} px before the test and {sizes[1]} after it"
    text = f"{old.name}: whether it moved between the two calibrations is not known: {reason}"
    cure = "Record the clips after the test at the same size and zoom as those before it."
    return {"moved": None, "reason": reason}, Finding("doubtful", "picture-size-differs", text, cure)


def _sights(points: SharedPoints, i: int) -> tuple[np.ndarray, np.ndarray]:
    return points.p[points.used[i]], points.b[i, points.used[i]]


def _survey(sets: Sequence[SharedPoints], i: int) -> tuple[np.ndarray, np.ndarray]:
    return sets[0].sigma[sets[0].used[i]], sets[1].sigma[sets[1].used[i]]


def _movement(moved: Movement) -> dict[str, Any]:
    return {
        "moved": bool(moved.probability < SURE),
        "distance": float(np.linalg.norm(moved.shift)),
        "distance_sd": _sd_along(moved.shift, moved.shift_sd),
        "shift": dict(zip(AXES, moved.shift.tolist(), strict=True)),
        "shift_sd": dict(zip(AXES, moved.shift_sd.tolist(), strict=True)),
        "angle_deg": float(np.linalg.norm(moved.turn)),
        "angle_sd_deg": _sd_along(moved.turn, moved.turn_sd),
        "turn_deg": dict(zip(TURNS, moved.turn.tolist(), strict=True)),
        "turn_sd_deg": dict(zip(TURNS, moved.turn_sd.tolist(), strict=True)),
        "turn_in_place_deg": dict(zip(TURNS, moved.turn_in_place.tolist(), strict=True)),
        "turn_in_place_sd_deg": dict(zip(TURNS, moved.turn_in_place_sd.tolist(), strict=True)),
        "only_turned": bool(moved.probability < SURE and moved.chi2_in_place < IN_PLACE),
        "chi2": moved.chi2,
        "chi2_in_place": moved.chi2_in_place,
        "probability_at_rest": moved.probability,
        "picture_shift_px": {"mean": float(moved.picture_shift.mean()), "max": float(moved.picture_shift.max())},
        "rms_px": {"before": moved.before.rms_px, "after": moved.after.rms_px},
        "n_points": {"before": len(moved.before.residuals), "after": len(moved.after.residuals)},
    }


def _sd_along(vector: Array, sd: Array) -> float:
    """Standard deviation of a vector's length, from those of its components."""
    length = float(np.linalg.norm(vector))
    return float(np.linalg.norm(vector * sd) / length) if length > 0 else float(np.linalg.norm(sd))


def _lens(old: Camera, new: Camera, known: tuple[Uncertainty | None, Uncertainty | None]) -> dict[str, Any]:
    variance = sum(
        float(each.covariance[each.names.index("f"), each.names.index("f")]) if each and "f" in each.names else np.nan
        for each in known
    )
    return {"f_before": old.f, "f_after": new.f, "f_change": new.f - old.f, "f_change_sd": float(np.sqrt(variance))}


def _findings(name: str, moved: Movement, lens: Mapping[str, Any], units: str) -> list[Finding]:
    found = []
    if moved.probability < SURE:
        if moved.chi2_in_place < IN_PLACE:
            how = f"turned by {np.linalg.norm(moved.turn_in_place):.3g} degrees in its place"
        else:
            how = f"moved by {np.linalg.norm(moved.shift):.3g} {units} and {np.linalg.norm(moved.turn):.3g} degrees"
        text = f"{name}: {how} between the two calibrations, {moved.picture_shift.mean():.2g} px in the picture"
        cure = "Use for each run the calibration nearer to it in time, and lock the mount."
        level: Level = "bad" if moved.picture_shift.mean() > HARMLESS_PX else "doubtful"
        found.append(Finding(level, "camera-moved", text, cure))
    if abs(lens["f_change"]) > LENS_CHANGED * lens["f_change_sd"]:
        text = f"{name}: f changed from {lens['f_before']:.6g} to {lens['f_after']:.6g} between the two calibrations"
        level = "bad" if abs(lens["f_change"]) > HARMLESS_SHARE * lens["f_before"] else "doubtful"
        found.append(Finding(level, "lens-changed", text, "Lock zoom and focus."))
    return found


def _located(before: Sequence[Camera], after: Sequence[Camera], points: SharedPoints) -> dict[str, Any] | None:
    """Errors by axis of the later points with either set of cameras; None where no two cameras share a point."""
    if len(before) < 2 or not (points.used.sum(0) > 1).any():
        return None
    lengths = {
        "largest_distance": largest_distance(points.p[points.used.any(0)]),
        "diagonal_field": diagonal_field(after, points.p),
    }
    return {
        name: errors_by_axis(locate_points(cameras, points.b_used, sd=1.0).point - points.p, **lengths)
        for name, cameras in (("with_before", before), ("with_after", after))
    } | lengths
