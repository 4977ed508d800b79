"""What the report says of a run: how it was read and tracked, located and timed, and how it compares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.report.analysis_sections import analysis_tables, warnings
from vidtrack.report.explanations import ABOUT
from vidtrack.report.numbers import interval, measured, number, one_over, pick, share
from vidtrack.report.page import Figure, Section, Table
from vidtrack.report.ways_sections import tags_table
from vidtrack.results import RunResults

Record = Mapping[str, Any]


def run_section(
    name: str, own: RunResults, units: str, figures: Sequence[Figure] = (), stated: Sequence[Table] = ()
) -> Section:
    """Everything that the page says of one run; stated: its uncertainty."""
    comparison, locate = own.record("comparison"), own.record("locate")
    tables = [
        comparison_table(comparison, units),
        truth_table(comparison, units),
        reading_table(own.readings) if own.readings else None,
        run_up_table(own.record("waterline"), units),
        clock_table(locate),
        correspondence_table(locate, units),
        *analysis_tables(own.record("analysis"), units),
        *stated,
        bodies_table(own.record("bodies"), units),
        tags_table(own.record("bodies")),
        smoothing_table(own.record("kinematics"), units),
    ]
    lines = [*_lines(comparison, locate, units), *warnings(own.record("analysis"))]
    if not own.records.keys() & {"locate", "waterline"}:
        lines.append("Nothing was located in this run: see the verdict.")
    return Section(f"run-{name}", name, lines, [t for t in tables if t], figures)


def _lines(comparison: Record, locate: Record, units: str) -> list[str]:
    lines = []
    if comparison.get("lag_s") is not None:
        lag, _ = measured(comparison["lag_s"], comparison.get("lag_sd_s"))
        ends = interval(comparison.get("lag_low_s"), comparison.get("lag_high_s"))
        lines.append(
            f"The video shows the motion {lag} s later than the reference (95 %: {ends} s). "
            f"With the lag removed they differ by {number(pick(comparison, 'after', 'rms'), 3)} {units} rms."
        )
    line = comparison.get("axis") or {}
    if line.get("skew_deg") is not None:
        skew, sd = measured(line["skew_deg"], line.get("skew_sd_deg"))
        lines.append(
            f"The target moves along a line {skew} ± {sd} degrees off the {line.get('nearest')} axis: "
            f"{number(line.get('run_out'), 3)} {units} over {number(line.get('length'), 3)} {units}."
        )
    miss = pick(locate, "samples", "mean_miss")
    if miss is not None:
        lines.append(f"Lines of sight miss the located points by {number(miss, 2)} {units} on average.")
    return lines + clock_lines(locate)


def runs_table(summaries: Sequence[Record], units: str) -> Table:
    """All runs that have trajectories, a line each, from their summaries."""
    rows, keys = [], []
    for own in summaries:
        if own["targets"] is None:
            continue
        part = own["truth_one_over"]
        rows.append(
            [
                str(own["run"]),
                number(own["targets"]),
                number(own["length_s"], 4),
                number(own["samples"]),
                share(own["located"] / own["samples"] if own["samples"] else None, 4),
                number(own["sigma_worst_axis"], 2),
                measured(own["lag_s"], own["lag_sd_s"])[0],
                number(own["rms"], 3),
                one_over(1 / part if part else None),
            ]
        )
        keys.append(f"run-{own['run']}")
    header = ["run", "targets", "length (s)", "samples", "located", f"mean sigma, worst axis ({units})", "lag (s)"]
    header += [f"rms against the sensor ({units})", "against truth, of the field"]
    return Table("The runs", header, rows, ABOUT["all-runs"], keys)


def reading_table(readings: Mapping[str, Record]) -> Table:
    """How each camera's recording was read and timed."""
    rows = []
    stretched = any(pick(own, "stretch", "gain") not in (None, 1) for own in readings.values())
    for camera, own in readings.items():
        targets: Record = own.get("targets") or {}
        flags: dict[str, float] = {}
        for target in targets.values():
            for flag, part in (target.get("flags") or {}).items():
                flags[flag] = flags.get(flag, 0.0) + part / len(targets)
        rows.append(
            [
                camera,
                number(pick(own, "reading", "frames")),
                number(pick(own, "video", "rate"), 5),
                str(pick(own, "time", "source") or "–"),
                number(own.get("samples")),
                share(own.get("measured"), 4),
                ", ".join(f"{flag} {share(part)}" for flag, part in flags.items()) or "none",
                *_pixel_counts([target.get("pixels") or {} for target in targets.values()]),
                *([number(pick(own, "stretch", key), 3) for key in ("gain", "offset")] if stretched else []),
            ]
        )
    header = [
        "camera",
        "frames read",
        "a second",
        "time from",
        "samples",
        "measured",
        "flags",
        "pixels of a target, mean",
        "range",
    ]
    header += ["gain", "offset"] if stretched else []
    return Table("Reading and tracking", header, rows, ABOUT["reading"])


def _pixel_counts(targets: Sequence[Record]) -> tuple[str, str]:
    """Mean of the targets' mean number of pixels, and the least and the most of any."""
    means, least, most = ([t[key] for t in targets if t.get(key) is not None] for key in ("mean", "min", "max"))
    if not means:
        return "–", "–"
    return number(sum(means) / len(means), 3), f"{number(min(least), 3)}–{number(max(most), 3)}"


def clock_table(locate: Record) -> Table | None:
    """The cameras' clocks, where any was given or estimated."""
    cameras: Record = pick(locate, "clocks", "cameras") or {}
    if not any(own.get("offset_s") or own.get("rate_ppm") or own.get("source") != "config" for own in cameras.values()):
        return None
    rows = []
    for camera, own in cameras.items():
        sd = own.get("offset_s_sd")
        offset = measured(1000 * own["offset_s"], 1000 * sd if sd is not None else None, 5)
        rate = measured(own["rate_ppm"], own.get("rate_ppm_sd"))
        rows.append([camera, *offset, *rate, str(own.get("source"))])
    return Table("Clocks", ["camera", "offset (ms)", "± sd", "rate (ppm)", "± sd", "from"], rows, ABOUT["clocks"])


def clock_lines(locate: Record) -> list[str]:
    """For each estimated clock a sentence: the offset, the methods that it comes from, and what each gives alone."""
    cameras: Record = pick(locate, "clocks", "cameras") or {}
    lines = []
    for camera, own in cameras.items():
        methods: Record = own.get("witnesses") or {}
        if not methods:
            continue
        ends = interval(*(1000 * v if v is not None else None for v in own["offset_s_95"]))
        line = (
            f"{number(1000 * own['offset_s'], 4)} ms are added to the time of {camera} (95 %: {ends}), "
            f"estimated from the {' and the '.join(w for w, own in methods.items() if own['used'])}"
        )
        rate, sd = own["rate_ppm"], own["rate_ppm_sd"]
        if sd is not None and abs(rate) > 2 * sd:
            line += f"; it runs {number(abs(rate), 3)} ± {number(sd, 2)} ppm {'slow' if rate > 0 else 'fast'}"
        if len(methods) > 1:
            each = (
                f"{w} {number(1000 * said['offset_s'], 4)} ± {number(1000 * said['offset_s_sd'], 2)} ms"
                for w, said in methods.items()
            )
            line += f". Each alone, with one standard error: {', '.join(each)}"
        lines.append(line + ".")
    return lines


def correspondence_table(locate: Record, units: str) -> Table | None:
    """Which track of which camera is which target, and how far from their epipolar lines they lie."""
    targets: Record = pick(locate, "correspondence", "targets") or {}
    if not targets:
        return None
    cameras = list(next(iter(targets.values()))["tracks"])
    rows = [
        [
            name,
            *(", ".join(map(str, own["tracks"].get(c, ()))) or "–" for c in cameras),
            number(own["error_px"], 3),
            number(own["error"], 3),
            "ambiguous" if own["ambiguous"] else "",
        ]
        for name, own in targets.items()
    ]
    tolerance = f"{number(pick(locate, 'correspondence', 'tolerance_px'))} px"
    world = f"{number(pick(locate, 'correspondence', 'tolerance'), 3)} {units}"
    caption = f"Which track is which target; a match may lie {tolerance} ({world}) from its epipolar line"
    return Table(caption, ["target", *cameras, "error (px)", f"error ({units})", ""], rows, ABOUT["correspondence"])


def comparison_table(comparison: Record, units: str) -> Table | None:
    """The contact sensor's record against the video, before and after the lag is removed."""
    if comparison.get("lag_s") is None:
        return None
    rows = []
    for key, title in (
        ("gain", "gain"),
        ("bias", f"bias ({units})"),
        ("rms", f"rms difference ({units})"),
        ("max_abs", f"largest difference ({units})"),
        ("correlation", "correlation"),
        ("n", "samples"),
    ):
        rows.append([title, *(number(pick(comparison, when, key), 4) for when in ("before", "after"))])
    return Table("Reference against video", ["", "as recorded", "lag removed"], rows, ABOUT["comparison"])


def truth_table(comparison: Record, units: str) -> Table | None:
    """The trajectories against truth.csv."""
    truth: Record = comparison.get("truth") or {}
    if not truth.get("n"):
        return None
    rows = []
    for axis in "xyz":
        cells = [number(pick(truth, key, axis), 3) for key in ("bias", "mean_abs", "rms_by_axis", "max_abs")]
        rows.append([axis, *cells])
    part = truth.get("one_over")
    mean = f"{number(truth.get('mean'), 3)} {units}, {one_over(1 / part if part else None)} of the diagonal field"
    caption = f"Video minus truth.csv, {units}; mean error in space {mean}"
    return Table(caption, ["axis", "bias", "mean error", "rms", "max"], rows, ABOUT["truth"])


def run_up_table(record: Record, units: str) -> Table | None:
    """How high the water's edge came on each transect; record: waterline.json."""
    transects: Record = record.get("transects") or {}
    if not transects:
        return None
    rows = []
    names = (("setup", "set-up"), ("S", "S"), ("Sinc", "Sinc"), ("Sig", "Sig"), ("R2", "R2 %"), ("Rmax", "Rmax"))
    for name, own in transects.items():
        found = share(own["located"] / own["frames"] if own["frames"] else None, 4)
        heights = (number(own.get(key), 4) for key, _ in names)
        ends = (number(own[key], 4) for key in ("lowest_z", "highest_z"))
        rows.append(
            [name, number(own["frames"]), found, *heights, *ends, number(own.get("Tz"), 3), number(own.get("run_ups"))]
        )
    header = [
        "transect",
        "frames",
        "edge found",
        *(label for _, label in names),
        "lowest z",
        "highest z",
        "Tz (s)",
        "run-ups",
    ]
    return Table(f"Run-up: height of the water's edge, {units}", header, rows, ABOUT["run-up"])


def bodies_table(record: Record, units: str) -> Table | None:
    """How each body was located; record: bodies.json."""
    rows = []
    for name, own in (record.get("bodies") or {}).items():
        flags = ", ".join(f"{flag} {share(part)}" for flag, part in own["flags"].items()) or "none"
        part = own["located"] / own["samples"] if own["samples"] else None
        rows.append([name, number(own["samples"]), share(part, 4), number(own["mean_rms"], 2), flags])
    if not rows:
        return None
    header = ["body", "samples", "located", f"targets off the rigid body ({units} rms)", "flags"]
    return Table("Bodies", header, rows, ABOUT["bodies"])


def smoothing_table(record: Record, units: str) -> Table | None:
    """How the smoothing of the kinematics found the tracks; record: kinematics.json."""
    rows = [
        [f"{own['target']}, {own['axis']}", *(number(own.get(k), 2) for k in ("noise_sd", "noise_ratio", "spacing_s"))]
        for own in record.get("smoothing") or ()
    ]
    if not rows:
        return None
    header = ["target, axis", f"scatter ({units})", "over sigma", "knots every (s)"]
    return Table("Smoothing of the positions", header, rows, ABOUT["smoothing"])
