"""What the report says of a wand, of a body that refined the cameras, and of coded tags.

Of each: what was measured, how far it misses what was held out, and whether it helped.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import number, one_over, pick, share
from vidtrack.report.page import Section, Table

Record = Mapping[str, Any]

AXES = {
    "camera": "the first camera's",
    "points": "those of the surveyed points",
    "up": "up as measured",
    "level": "the level that was named",
    "drop": "up by the ball that was dropped",
}


def wand_section(record: Record, units: str) -> Section:
    """record: wand.json."""
    lengths = ", ".join(f"{number(value, 6)}" for value in _values(record["lengths"]))
    rms, field = record.get("length_rms"), record.get("diagonal_field")
    lines = [
        f"{record['moments']} moments show the whole wand (lengths {lengths} {units}) to two cameras or more; "
        f"{record['left_out']} sights contradict the others and were left out. Noise of its balls: "
        f"{number(record['sigma_px'], 2)} px.",
        f"Located by the cameras, its lengths vary by {number(rms, 2)} {units} (rms), {_times(record)}; that is "
        f"{one_over(rms / field if rms and field else None)} of the volume's diagonal, {number(field, 4)} {units}.",
        f"The world's axes are {_axes(record)}.",
    ]
    if gravity := pick(record, "axes", "gravity"):
        lines.append(
            f"The dropped ball falls with {number(gravity['value'], 4)} ± {number(gravity['sd'], 2)} {units}/s², by "
            f"{gravity['samples']} samples: a check of the scale."
        )
    rows = [
        [rung["model"], number(rung["held_out"], 4), number(rung["length_rms"], 3), "used" * (rung["model"] == used)]
        for used in [record.get("model")]
        for rung in record.get("held_out") or ()
    ]
    header = ["lens model", "error of moments left out", f"their lengths, rms ({units})", ""]
    tables = [Table("Held out", header, rows, ABOUT["wand-held-out"])] if rows else []
    clocks = [
        [name, number(1e3 * own["offset_s"], 4), number(1e3 * own["sd_s"], 2)]
        for name, own in (record.get("clocks") or {}).items()
    ]
    if clocks:
        tables.append(Table("Clocks by the wand", ["camera", "later by (ms)", "sd (ms)"], clocks, ABOUT["wand-clocks"]))
    return Section("wand", "The wand", lines, tables)


def body_section(record: Record, units: str) -> Section:
    """record: self.json."""
    used = bool(record.get("used"))
    lines = [
        f"Body {record['body']} in {', '.join(record['runs'])}: located at {record['moments']} moments; "
        f"the places of its targets on it are known to {number(record['sigma'], 2)} {units}. "
        + ("It refined the cameras, and all runs are located by them." if used else "The cameras stay as they were.")
    ]
    rows = []
    if held := record.get("held_out"):
        names = {"residual_px": "residuals of stretches left out (px)", "distance": f"its distances there ({units})"}
        rows = [[words, number(held[key]["before"], 3), number(held[key]["after"], 3)] for key, words in names.items()]
    if sigma := record.get("sigma_of_calibration"):
        rows.append([f"calibration's part of sigma ({units})", number(sigma["before"], 2), number(sigma["after"], 2)])
    tables = [Table("Does it help?", ["rms", "before", "after"], rows, ABOUT["body-held-out"])] if rows else []
    distances = [
        [pair, number(own["stated"], 5), number(own["seen"], 5), number(own["sd"], 2)]
        for pair, own in (pick(record, "shape", "distances") or {}).items()
    ]
    if distances:
        header = ["targets", f"as measured on it ({units})", f"by the cameras ({units})", "sd"]
        tables.append(Table("Its distances", header, distances, ABOUT["body-distances"]))
    return Section("body", "The body as its own wand", lines, tables)


def tags_table(record: Record) -> Table | None:
    """How the coded tags of a run's bodies were located; record: bodies.json. None where no body has tags."""
    rows = []
    for name, own in (record.get("bodies") or {}).items():
        if "tags" not in own:
            continue
        size = own.get("size") or {}
        factor = number(size.get("factor"), 5)
        sd = f" ± {number(size['factor_sd'], 1)}" if size.get("factor_sd") is not None else ""
        tags = ", ".join(map(str, own["tags"]))
        located = own["located"] / own["samples"] if own["samples"] else None
        one, rms = share(own["one_camera"]), number(own["rms_px"], 2)
        rows.append([name, tags, share(located, 4), one, rms, number(own["sd_grown"], 3), f"{factor}{sd}"])
    if not rows:
        return None
    header = ["body", "tags", "located", "by one camera", "corners off (px rms)", "sd grown", "size seen over stated"]
    return Table("Coded tags", header, rows, ABOUT["coded-tags"])


def _values(lengths: Any) -> list[float]:
    return list(lengths.values()) if isinstance(lengths, Mapping) else [*lengths]


def _times(record: Record) -> str:
    ratio = record.get("length_ratio")
    return f"{number(ratio, 2)} times what the noise of its sights makes"


def _axes(record: Record) -> str:
    axes = record.get("axes") or {}
    words = AXES.get(str(axes.get("from")), str(axes.get("from")))
    if axes.get("scale") is not None:
        words += f" ({len(axes['points'])} of them); by these the scale is {number(axes['scale'], 6)} ± "
        words += f"{number(axes['scale_sd'], 1)} of the wand's"
    return words + (", x as the first camera looks" if axes.get("heading") else "")
