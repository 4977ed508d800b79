"""Findings that follow from a calibration's own numbers, beside those of its stages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from vidtrack.findings import Finding, Level
from vidtrack.naming import some_of


@dataclass(frozen=True)
class Limits:
    """Where a number becomes a doubt, and where it becomes bad: each a pair (doubtful, bad)."""

    misfit: tuple[float, float] = (1.5, 4.0)
    """Residuals over what centroid noise and survey tolerance allow (root of the reduced chi-squared), at least; of few
    points chance alone makes more, see `by_chance`."""

    chance: float = 3.7
    """Standard deviations of the normal distribution that chance exceeds once in ten thousand times."""

    whole_clip: int = 4
    """Points of a clip: where so many and all of them are found by no camera, the clip is at fault, not each point."""

    rms_px: tuple[float, float] = (1.0, 3.0)
    """px, reprojection error where the survey states no tolerance, so that there is no expectation: centroids of balls
    are good to a tenth of a px at worst, so the rest is the survey, the lens model or wrong points."""

    left_out: tuple[float, float] = (0.1, 1 / 3)
    """Share of the points found that do not fit. A few wrong names are usual, a tenth of all is not; beyond a third the
    majority itself may be wrong."""

    not_found: tuple[float, float] = (0.25, 0.6)
    """Share of the listed tags that were not found in the picture: the calibrated volume is smaller than planned."""

    worse_than_expected: tuple[float, float] = (2.0, 5.0)
    """Held-out error over what centroid noise and survey tolerance allow."""

    of_field: tuple[float, float] = (1 / 200, 1 / 50)
    """Held-out error as a share of the diagonal field. The thesis, with cameras of 1995, reached 1/1,350."""

    square: tuple[float, float] = (0.015, 8.0)
    """Departure of Sx from 1, and in standard errors, that square pixels do not have; frame grabbers stay below it."""

    stretched: tuple[float, float] = (0.003, 5.0)
    """Share by which an axis of the survey is stretched, and in standard errors: less than 0.3 % is what tapes have."""

    shape: float = 0.03
    """Departure from the shape of a pixel that is known, below which it is that shape."""

    alike: float = 9.0
    """Chi squared by which another deformation may explain less and still be named."""


LIMITS = Limits()

PIXEL_ASPECTS = (10 / 11, 12 / 11, 40 / 33, 16 / 11, 8 / 9, 16 / 15, 32 / 27, 64 / 45, 4 / 3, 80 / 99, 118 / 81)
"""Widths of pixels over their heights that video has (ITU-R BT.601, DV, HDV): then `sensor` is what is not right."""


class Fit(NamedTuple):
    """How many points were found and used; their residuals over the expected ones (root of the reduced chi-squared),
    NaN where that is unknown, with its degrees of freedom."""

    found: int
    used: int
    misfit: float
    freedom: int = 100


def _richer(record: Mapping[str, Any]) -> str:
    """The beginning of a cure: a richer lens first, where the models were not all tried already."""
    return "C" if (record.get("settings") or {}).get("model") == "auto" else "Try calibration.model: auto; c"


def camera_findings(name: str, record: Mapping[str, Any], fit: Fit, labelling: Mapping[str, Any]) -> list[Finding]:
    """One camera's calibration. record: camera.json; labelling: labelling.json."""
    out: list[Finding] = []
    doubtful, bad = LIMITS.misfit
    if level := graded(fit.misfit, (max(doubtful, by_chance(fit.freedom)), bad)):
        text = (
            f"{name}: the calibration points miss their projections by {fit.misfit:.2g} times what centroid noise and "
            f"survey tolerance explain ({record['rms_px']:.2g} px rms)"
        )
        cure = (
            f"{_sensor_hint(name, record)}{_richer(record)}heck the sigma in points.csv (in the unit of the "
            "coordinates) and the points with the largest residuals."
        )
        out.append(Finding(level, "residuals-unexplained", text, cure))
    elif fit.misfit != fit.misfit and (level := graded(record.get("rms_px"), LIMITS.rms_px)):
        text = f"{name}: the calibration points miss their projections by {record['rms_px']:.2g} px rms"
        cure = f"{_richer(record)}heck the survey, and give its tolerance as calibration.sigma."
        out.append(Finding(level, "residuals-large", text, cure))
    lost = fit.found - fit.used
    if fit.found and (level := graded(lost / fit.found, LIMITS.left_out)):
        text = f"{name}: {lost} of the {fit.found} calibration points found do not fit and were left out"
        edge = (
            "If they lie at the edge of the picture, try calibration.model: auto; if"
            if _richer(record) != "C"
            else "If"
        )
        cure = f"Look at the list of points not used. {edge} they are neighbours, check their tags."
        out.append(Finding(level, "points-left-out", text, cure))
    listed, seen = labelling.get("points"), labelling.get("found")
    if listed and seen is not None and (level := graded(1 - seen / listed, LIMITS.not_found)):
        text = f"{name}: only {seen} of the {listed} listed calibration points were found in the picture"
        text += "".join(_of_clip(clip, own) for clip, own in (labelling.get("clips") or {}).items())
        cure = "Correct calibration.clips.<clip>.tags to what each clip shows, or light the points."
        out.append(Finding(level, "points-not-found", text, cure))
    return out


def _sensor_hint(name: str, record: Mapping[str, Any]) -> str:
    """What to look at first where `sensor` makes pixels of a shape that no video has and Sx was held."""
    shape = record.get("dx", 1.0) / record.get("dy", 1.0)
    held = "Sx" not in (record.get("standard_errors") or {})
    if not held or min(abs(shape / a - 1) for b in (1.0, *PIXEL_ASPECTS) for a in (b, 1 / b)) < LIMITS.shape:
        return ""
    return (
        f"cameras.{name}.sensor makes pixels that are {shape:.3g} times as wide as high: are its width and height "
        "exchanged? "
    )


def _of_clip(clip: str, own: Mapping[str, Any]) -> str:
    """What a clip lacks, where that is most of it."""
    listed, seen, others = own.get("tags") or 0, own.get("found") or 0, len(own.get("blobs_of_no_tag") or [])
    if not listed or seen >= listed / 2:
        return ""
    return f"; in clip {clip} {seen} of {listed}, where {others} blobs lie elsewhere"


def whole_findings(back: Mapping[str, Any]) -> list[Finding]:
    """All cameras together. back: backprojection.json."""
    out: list[Finding] = []
    held, floor = back.get("held_out") or {}, back.get("floor") or {}
    error, units = held.get("mean_3d"), back.get("units", "")
    if error is None:
        return out
    surveyed = (floor.get("mean_3d_with_survey") or 0) > (floor.get("mean_3d") or 0)
    ratio = back.get("ratio_with_survey") if surveyed else None
    if level := graded(ratio, LIMITS.worse_than_expected):
        text = (
            f"calibration: points held out are located {error:.2g} {units} from their survey, {ratio:.2g} times what "
            "centroid noise and survey tolerance explain"
        )
        cure = "Check the survey and the points with the largest errors, or try calibration.model: auto."
        out.append(Finding(level, "held-out-error-unexplained", text, cure))
    field = back.get("diagonal_field")
    if field and (level := graded(error / field, LIMITS.of_field)):
        text = (
            f"calibration: points held out are located {error:.2g} {units} from their survey, "
            f"1/{field / error:,.0f} of the diagonal field"
        )
        cure = "Check units, tags and survey; use more points, spread in depth."
        out.append(Finding(level, "held-out-error-large", text, cure))
    return out


def square_findings(cameras: Mapping[str, Mapping[str, Any]]) -> list[Finding]:
    """Whether square pixels came out as not square. cameras: camera.json of each.

    A survey with one axis scaled (a tape read in other units, a stretched drawing) fits well: Sx and the centre take it
    up. What does not fit is a digital camera with a scale factor that is none of video's.
    """
    least, errors = LIMITS.square
    off, shapes = {}, []
    for name, record in cameras.items():
        shapes += _shape_findings(name, record)
        Sx, sd = record.get("Sx"), (record.get("standard_errors") or {}).get("Sx")
        if Sx is None or not sd or abs(record["dx"] / record["dy"] - 1) > 1e-3:
            continue
        if abs(Sx - 1) > max(least, errors * sd):
            off[name] = Sx, sd
    if not off:
        return shapes
    known = all(min(min(abs(Sx - a), abs(Sx * a - 1)) for a in PIXEL_ASPECTS) < 0.005 for Sx, _ in off.values())
    text = (
        f"calibration: Sx is {', '.join(f'{Sx:.3f} ± {sd:.1g} for {name}' for name, (Sx, sd) in off.items())}, where "
        "square pixels have 1"
    )
    if known:
        return [*shapes, Finding("note", "pixels-not-square", text, "Give cameras.<name>.sensor as the pixels are.")]
    cure = (
        "Check points.csv for an axis that is scaled, and cameras.<name>.sensor; with square pixels set "
        "calibration.fix: {Sx: 1}."
    )
    return [*shapes, Finding("doubtful", "pixels-not-square", text, cure)]


def _shape_findings(name: str, record: Mapping[str, Any]) -> list[Finding]:
    """Whether `sensor` makes pixels that are not square, and Sx makes them square again."""
    Sx, shape = record.get("Sx"), record.get("dx", 1.0) / record.get("dy", 1.0)
    if Sx is None or "Sx" not in (record.get("standard_errors") or {}):
        return []
    if abs(shape - 1) < LIMITS.shape or abs(Sx / shape - 1) > LIMITS.shape:
        return []
    columns, rows = record["image_size"]
    width, height = record["dx"] * columns, record["dy"] * rows
    exchanged = abs((height / columns) / (width / rows) - 1) < LIMITS.shape
    text = (
        f"calibration: {name}: its points show square pixels, where cameras.{name}.sensor [{width:.3g}, {height:.3g}] "
        f"makes them {shape:.3g} times as wide as high"
        f"{': its width and height seem to be exchanged' if exchanged else ''}. Positions do not suffer; f and Sx do"
    )
    cure = f"Give sensor as width and height of what the frame covers{', [' if exchanged else ''}"
    cure += f"{height:.3g}, {width:.3g}]." if exchanged else "."
    return [Finding("note", "sensor-not-as-pixels", text, cure)]


def stretch_findings(back: Mapping[str, Any]) -> list[Finding]:
    """Whether the cameras see the survey stretched along one axis, or sheared. back: backprojection.json."""
    found = back.get("stretches") or []
    least, errors = LIMITS.stretched
    best = found[0] if found else None
    if best is None or not abs(best["share"]) > max(least, errors * best["sd"]):
        return []
    alike = [own for own in found if own["gain"] > best["gain"] - LIMITS.alike and abs(own["share"]) > least]
    ways = " or ".join(_deformation(own) for own in alike[:3])
    text = f"calibration: the survey is deformed, as the cameras see it: {ways}"
    cure = (
        "Measure the longest distance along it once more and correct that column of points.csv; a stretched tape, a "
        "copied drawing or a scale of another axis does this. A camera whose pixels are not square, though its sensor "
        "says so, does it too. That all axes are too long by the same share no picture shows."
    )
    return [Finding("doubtful", "survey-stretched", text, cure)]


def _deformation(own: Mapping[str, Any]) -> str:
    kind, share, sd = own["kind"], own["share"], own["sd"]
    if len(kind) == 1:
        way = "long" if share > 0 else "short"
        return f"{kind} is {abs(share):.2%} ± {sd:.2%} too {way}"
    return f"the angle between {kind[0]} and {kind[1]} is off by {math.degrees(abs(share)):.2g} deg"


def unfound_findings(
    seen: Mapping[str, Mapping[str, bool]], clips: Mapping[str, set[str]] | None = None
) -> list[Finding]:
    """Points that no camera found. seen: camera: {tag: found}, of the tags that its clips list; clips: {clip: tags}.

    One camera's view of a point may be hidden; where each of two or more cameras that should see it has nothing at its
    place, its place is wrong, and what is measured there carries another name or none.
    """
    listed: dict[str, list[bool]] = {}
    for tags in seen.values():
        for tag, found in tags.items():
            listed.setdefault(tag, []).append(found)
    lost = [tag for tag, found in listed.items() if len(found) > 1 and not any(found)]
    if not lost:
        return []
    theirs = {clip: tags & set(listed) for clip, tags in (clips or {}).items()}
    whole = [clip for clip, tags in theirs.items() if len(tags) >= LIMITS.whole_clip and tags <= set(lost)]
    if whole and len(lost) < len(listed):
        text = f"calibration: no camera found any point of clip {some_of(whole)} where points.csv has them"
        cure = (
            "Are the recordings of two cameras exchanged there, its tags (calibration.clips.<clip>.tags) another "
            "clip's, or did the points or all cameras move? Its points were not used."
        )
        return [Finding("doubtful", "points-found-by-no-camera", text, cure)]
    some = ", ".join(lost[:10]) + (f" and {len(lost) - 10} more" if len(lost) > 10 else "")
    one = len(lost) == 1
    text = (
        f"calibration: no camera found {'point' if one else 'points'} {some} where points.csv has "
        f"{'it' if one else 'them'}; {'its' if one else 'their'} survey is probably wrong"
    )
    if len(lost) == len(listed):
        return []
    cure = "Measure these points again, or take them out of points.csv; they were not used."
    return [Finding("doubtful", "points-found-by-no-camera", text, cure)]


def by_chance(freedom: int) -> float:
    """The root of a reduced chi-squared that chance exceeds once in ten thousand times (Wilson and Hilferty's cube)."""
    spread = 2 / (9 * freedom)
    return float((1 - spread + LIMITS.chance * spread**0.5) ** 1.5)


def graded(value: float | None, limits: tuple[float, float]) -> Level | None:
    """doubtful above the first limit, bad above the second; None below both, and where the value is not known."""
    if value is None or not value > limits[0]:
        return None
    return "bad" if value > limits[1] else "doubtful"
