"""What the report says of the calibration: errors by axis, the floor, each camera's parameters, points not used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

from vidtrack.files.camera_json import interface_from_record
from vidtrack.geometry.lens_terms import COEFFICIENTS, TERMS
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import measured, number, one_over, pick, share
from vidtrack.report.page import Figure, Section, Table

Record = Mapping[str, Any]
AXES = ("x", "y", "z")

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
POWERS = {"f": "", **{name: f"-{term.power}".translate(_SUPERSCRIPT) for name, term in TERMS.items()}}
"""The powers of the sensor's unit of length, mm, or px where no sensor is given."""


def accuracy_section(back: Record, units: str) -> Section:
    """The calibration points located by the cameras and compared with the survey (thesis 6.8), and held out."""
    held = back.get("held_out") or {}
    lines = [
        f"{back['n_points']} calibration points, located by the cameras and compared with the survey. "
        f"Mean error by axis: {_by_axis(back, 'mean_abs', units)}. The thesis reached 0.11 in, 1/1,350 of its field.",
        f"Points held out of the calibration ({held.get('method')}) lie {number(held.get('mean_3d'), 3)} {units} from "
        f"their survey on average, {one_over(_share(held.get('mean_3d'), back))} of the diagonal field of "
        f"{number(back.get('diagonal_field'), 4)} {units}; the survey's own tolerance is part of that.",
        _floor_line(back, units),
    ]
    tables = [_axis_table(back, held, units), _error_table(back, units), _measures_table(back, units)]
    return Section("accuracy", "How well points are located", lines, tables)


def camera_section(
    camera: Record,
    points: Sequence[Mapping[str, Any]],
    labelling: Record,
    units: str,
    figures: Sequence[Figure] = (),
) -> Section:
    """One camera: its parameters and how well each is known, the points that were not used, its pictures."""
    name = str(camera["camera"])
    lines = [
        f"Model {camera['model']}, refined {camera['refine']}, from {camera['n_points']} of {camera['n_sighted']} "
        f"sighted points; reprojection error {number(camera['rms_px'], 3)} px rms, "
        f"{number(camera['max_px'], 3)} px at most."
    ]
    lines += [str(line) for line in pick(camera, "ladder", "reasons") or ()]
    lines += [str(line) for line in labelling.get("notes") or ()]
    lines += _board_lines(camera, units)
    if within := pick(camera, "search", "within_a_tenth"):
        lines.append(
            "The error rises by less than a tenth of its least value for Cx from "
            f"{number(within['Cx'][0])} to {number(within['Cx'][1])} and Cy from {number(within['Cy'][0])} to "
            f"{number(within['Cy'][1])} px: so flat is the minimum on the map."
        )
    tables = [_parameter_table(camera, units)]
    if camera.get("through"):
        tables.append(_interface_table(camera, units))
    if rejected := [p for p in points if not p["used"]]:
        rows = [[str(p["tag"]), number(p["Xf"], 5), number(p["Yf"], 5), str(p["reason"])] for p in rejected]
        tables.append(
            Table("Points that were not used", ["tag", "Xf (px)", "Yf (px)", "reason"], rows, ABOUT["points-not-used"])
        )
    return Section(f"camera-{name}", name, lines, tables, figures)


def _board_lines(camera: Record, units: str) -> list[str]:
    """What a board gave: the lens and how well it predicts views left out, and the cameras' places to each other."""
    lines = []
    if board := camera.get("board"):
        held = ", ".join(f"{model} {number(px, 2)}" for model, px in board["held_out_px"].items())
        lines.append(
            f"The lens is from {board['views']} of {board['views_offered']} views of a board; views left out are "
            f"predicted to (px rms): {held or 'not tried'}."
        )
    if tied := pick(camera, "bundle", "board"):
        groups = "; ".join(", ".join(names) for names in tied["cameras"])
        before = tied.get("alone_sigma")
        gain = f", {number(before, 2)} {units} without the board" if before is not None else ""
        lines.append(
            f"The board ties {groups} to each other: with the survey a point in its middle is located to "
            f"{number(tied['sigma'], 2)} {units} (sigma, mean of the axes){gain}."
        )
    return lines


def _measures_table(back: Record, units: str) -> Table:
    """Willson's four measures of every camera."""
    titles = {
        "distorted": "distorted image plane (px)",
        "undistorted": "undistorted image plane (px)",
        "object_space": f"object space ({units})",
        "normalised": "normalised calibration error",
    }
    measures: Record = back.get("measures") or {}
    rows = []
    for camera, own in measures.items():
        for key, measure in own.items():
            cells = [number(measure.get(k), 3) for k in ("mean", "sd", "max", "sse")]
            rows.append([camera, titles.get(key, key.replace("_", " ")), *cells])
    return Table(
        "Each camera's error by Willson's four measures",
        ["camera", "measure", "mean", "sd", "max", "sum of squares"],
        rows,
        ABOUT["measures"],
    )


def stability_section(record: Record, units: str) -> Section:
    """Whether a camera moved between the calibrations before and after the test."""
    rows = []
    for name, own in (record.get("cameras") or {}).items():
        moved = {True: "yes", False: "no"}.get(own.get("moved"), "not known")
        cells = [number(own.get(key), 3) for key in ("distance", "distance_sd", "angle_deg", "angle_sd_deg")]
        shift = number(pick(own, "picture_shift_px", "mean"), 3)
        rows.append([name, moved, *cells, shift])
    header = ["camera", "moved", f"by ({units})", "± sd", "turned (deg)", "± sd", "in the picture (px)"]
    table = Table("Movement of each camera", header, rows, ABOUT["movement"])
    return Section("stability", "Before and after the test", tables=[table])


def _axis_table(back: Record, held: Record, units: str) -> Table:
    floor: Record = pick(back, "floor", "mean_abs") or {}
    rows = []
    for axis in AXES:
        rows.append(
            [
                axis,
                number(pick(back, "mean_abs", axis), 3),
                number(pick(back, "max_abs", axis), 3),
                number(pick(held, "mean_abs", axis), 3),
                number(pick(held, "max_abs", axis), 3),
                number(floor.get(axis), 3),
            ]
        )
    mean3d = [number(r.get(k), 3) for r in (back, held) for k in ("mean_3d", "max_3d")]
    rows.append(["in space", *mean3d, number(pick(back, "floor", "mean_3d"), 3)])
    header = ["axis", "mean", "max", "held out: mean", "max", "floor by noise"]
    return Table(f"Located minus surveyed, {units}", header, rows, ABOUT["axis"])


def _error_table(back: Record, units: str) -> Table:
    rows = []
    for axis in AXES:
        mean = pick(back, "mean_abs", axis)
        rows.append(
            [
                axis,
                share(mean / back["largest_distance"] if mean is not None else None, 2),
                share(mean / back["diagonal_field"] if mean is not None and back["diagonal_field"] else None, 2),
                str(pick(back, "worst", axis, "tag") or "–"),
                number(pick(back, "worst", axis, "error"), 3),
            ]
        )
    caption = "Mean error as a share of the largest distance and of the diagonal field; the worst point"
    header = ["axis", "of the distance", "of the field", "worst tag", f"its error ({units})"]
    return Table(caption, header, rows, ABOUT["share"])


def _parameter_table(camera: Record, units: str) -> Table:
    errors: Record = camera.get("standard_errors") or {}
    length = "px" if camera["dx"] == camera["dy"] == 1 else "mm"
    unit = {
        **{name: length + power for name, power in POWERS.items()},
        **dict.fromkeys(("Cx", "Cy"), "px"),
        **{f"t_{a}": units for a in AXES},
        **{f"omega_{a}": "rad" for a in AXES},
    }
    rows = [
        [name, *measured(camera.get(name), errors.get(name), 6), unit.get(name, "")]
        for name in ("Cx", "Cy", "f", "Sx", *COEFFICIENTS)
        if name in camera
    ]
    known = camera.get("position_sd") or [None] * 3
    rows += [
        [f"position {axis}", *measured(value, sd, 6), units]
        for axis, value, sd in zip(AXES, camera["position"], known, strict=True)
    ]
    rest = {name: value for name, value in errors.items() if name not in camera and "." not in name}
    rows += [[name, "–", number(value, 2), unit.get(name, "")] for name, value in rest.items()]
    header = ["parameter", "value", "± 1 sd", "unit"]
    return Table("Parameters and standard deviations", header, rows, ABOUT["parameters"])


def _interface_table(camera: Record, units: str) -> Table:
    """The interfaces through which the camera sees: where the points put them, and by how much that is elsewhere."""
    errors: Record = camera.get("standard_errors") or {}
    rows = []
    for record in camera["through"]:
        own = interface_from_record(record)
        known = own.known or own
        moved = dict(zip(own.parameters, own.deviation(known).tolist(), strict=True))
        for name, beforehand in zip(own.parameters, own.sigma or [0.0] * len(own.parameters), strict=True):
            kind = name.removeprefix(f"{own.name}.")
            turn = kind.startswith("tilt")
            by = degrees(1) if turn else 1.0
            sd = errors.get(name)
            cells = measured(by * moved[name], None if sd is None else by * sd, 3)
            length = "" if kind.startswith("index") else units
            prior = number(by * beforehand, 2) if beforehand else "held"
            rows.append([own.name, kind.replace("_", " "), *cells, prior, "deg" if turn else length])
    header = ["interface", "parameter", "moved by", "± 1 sd", "± 1 sd beforehand", "unit"]
    return Table("Interfaces through which it sees", header, rows, ABOUT["interfaces"])


def _floor_line(back: Record, units: str) -> str:
    sigma = pick(back, "floor", "sigma_px")
    if sigma is None:
        return "The centroid noise cannot be estimated, so no floor is given."
    return (
        f"Perfectly known cameras would reach {number(pick(back, 'floor', 'mean_3d'), 3)} {units} with the centroid "
        f"noise of {number(sigma, 2)} px ({pick(back, 'floor', 'sigma_px_source')}); with the survey's own errors "
        f"among what is compared, {number(pick(back, 'floor', 'mean_3d_with_survey'), 3)} {units}."
    )


def _by_axis(record: Record, key: str, units: str) -> str:
    return ", ".join(f"{axis} {number(pick(record, key, axis), 2)}" for axis in AXES) + f" {units}"


def _share(value: float | None, back: Record) -> float | None:
    field = back.get("diagonal_field")
    return value / field if value is not None and field else None
