"""What config.yaml may say: every key with its type, its default and its meaning; nothing else is allowed.

The JSON schema in workflow/schemas is made from here (`python -m vidtrack.settings`).
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from vidtrack.errors import VidtrackError
from vidtrack.naming import did_you_mean

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
Level = Annotated[float, Field(ge=-255, le=255)]
Crop = tuple[float, float, Positive, Positive]
Instant = str | int
"""A time code or a frame number."""


class Section(BaseModel):
    """A part of the config: frozen, and closed to unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _simple_name(name: str) -> str:
    if not re.fullmatch(r"[^\W_][\w.-]*", name):
        raise ValueError("a name is made of letters, digits, _ . - and begins with a letter or digit")
    return name


def _tag_list(value: Any) -> Any:
    """`1-16`, `1-4, 9, a` or a list of any of these, each part as it stands: see `naming.tags_meant`."""
    if value is None:
        return None
    parts = value if isinstance(value, (list, tuple)) else str(value).split(",")
    parts = tuple(str(p).strip() for p in parts)
    if "" in parts:
        raise ValueError("an empty tag; write 1-16 or a list of tags")
    return parts


def _names(value: Any) -> Any:
    return tuple(str(v) for v in value) if isinstance(value, (list, tuple)) else value


def _fixed(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return dict.fromkeys((str(v) for v in value), None)
    return value


Name = Annotated[str, AfterValidator(_simple_name)]
Tags = Annotated[tuple[str, ...] | None, BeforeValidator(_tag_list)]


class Clock(Section):
    """What is added to a camera's time."""

    offset_s: float = Field(0.0, description="s, added to the camera's time")
    rate_ppm: float = Field(0.0, description="parts per million by which the camera's time runs slow")


LENS = (
    "the lens; tsai: f, Sx, Cx, Cy and one radial term, kappa1; tsai2: a second one, kappa2; tsai3: a "
    "third one, kappa3 (lenses beyond 90 degrees); brown: kappa1, kappa2 and the tangential terms p1, p2; affine: "
    "skewed pixel axes (skew) too; prism: all of these and a thin prism, s1, s2; auto: the plainest of them that "
    "predicts points held out of the fit as well as a richer one"
)
"""What the words of `model` mean."""

LensModel = Literal["tsai", "tsai2", "tsai3", "brown", "affine", "prism", "auto"]
ParameterName = Literal["Cx", "Cy", "Sx", "f", "kappa1", "kappa2", "p1", "p2", "skew", "kappa3", "s1", "s2"]
Fix = Annotated[dict[ParameterName, float | None], BeforeValidator(_fixed)]
Prior = dict[ParameterName, tuple[float, Positive]]


class CameraCalibration(Section):
    """What is known of one camera; it is added to what `calibration` says of all cameras, and counts before it."""

    model: LensModel | None = Field(None, description=f"{LENS}. Null: as under calibration")
    fix: Fix = Field({}, description="parameters of this camera that are not refined, as calibration.fix")
    prior: Prior = Field({}, description="what is known of this camera's parameters, as calibration.prior")


class Camera(Section):
    """One camera: where its optical axis meets the frame buffer, its sensor, its clock."""

    Cx: float | None = Field(None, description="px; default: the middle of the frame buffer")
    Cy: float | None = Field(None, description="px; default: the middle of the frame buffer")
    sensor: tuple[Positive, Positive] | None = Field(
        None, description="mm, width and height of the sensor area that the frame covers; default: dx = dy = 1 px"
    )
    crop: Crop | None = Field(
        None,
        description="[left, top, width, height]: the part of the calibration's picture that the runs' pictures show, "
        "px of the calibration's picture from its top left corner; default: the whole of it, where the shapes agree",
    )
    calibration: CameraCalibration = Field(
        CameraCalibration(), description="model, fix and prior of this camera, beside those of all cameras"
    )
    clock: Clock | Literal["auto", "motion", "sound", "flash"] | None = Field(
        None,
        description="{offset_s, rate_ppm}, or how they are estimated; motion: from targets that all cameras see; "
        "sound: from the sound tracks, by one clap; flash: from a lamp that is switched; auto: all three, weighed; "
        "default: the time code, or motion where no camera of the run has one",
    )


DETECT = {
    "polarity": "bright: targets are brighter than what surrounds them; dark: darker",
    "threshold": "grey level 0 to 255, after gain and offset, above which a pixel (dark: below which) belongs to a "
    "target; auto: half-way between each target's surroundings and its brightest part",
    "centroid": "weighted: pixels count by their grey level above the threshold; binary: all pixels above it "
    "count the same (equations 4.2.1 and 4.2.2 of the thesis); ellipse: an ellipse fitted to the target's outline, "
    "for large or saturated targets",
    "min_pixels": "pixels above the threshold that a target has at least; fewer are noise (flag small)",
    "box": "px, width and height of the moving box in which a target is looked for; more than its motion between two "
    "samples, less than the distance to its neighbours",
    "fields": "what one sample is; auto: as the file's flags and the motion say; frame: whole frames (progressive "
    "video); top, bottom: two fields a frame, that one first (interlaced video: two samples a frame)",
    "start": "time code (10:00:55:12) or frame number of the first sample used; null: the first frame",
    "end": "time code or frame number of the last sample used; null: the last frame",
    "gain": "grey levels are multiplied by it, after offset; auto: chosen for each clip, and 1 but for clips that use "
    "few grey levels",
    "offset": "stored level, on the scale 0 to 255 of the file's depth, that becomes black; auto: chosen with gain",
}
"""What each detect key means, for all clips and runs and where one of them differs."""


def _change(key: str) -> Any:
    return Field(None, description=f"{DETECT[key]}. Null: as under detect")


class DetectChange(Section):
    """How targets are distinguished from the background, where a clip or a run differs from the rest."""

    polarity: Literal["bright", "dark"] | None = _change("polarity")
    threshold: Literal["auto"] | Annotated[float, Field(ge=0, le=255)] | None = _change("threshold")
    centroid: Literal["weighted", "binary", "ellipse"] | None = _change("centroid")
    min_pixels: Annotated[int, Field(ge=1)] | None = _change("min_pixels")
    box: tuple[Positive, Positive] | None = _change("box")
    fields: Literal["auto", "frame", "top", "bottom"] | None = _change("fields")
    start: Instant | None = _change("start")
    end: Instant | None = _change("end")
    gain: Literal["auto"] | Positive | None = _change("gain")
    offset: Literal["auto"] | Level | None = _change("offset")


class Detect(Section):
    """How targets are distinguished from the background."""

    polarity: Literal["bright", "dark"] = Field("bright", description=DETECT["polarity"])
    threshold: Literal["auto"] | Annotated[float, Field(ge=0, le=255)] = Field("auto", description=DETECT["threshold"])
    centroid: Literal["weighted", "binary", "ellipse"] = Field("weighted", description=DETECT["centroid"])
    min_pixels: Annotated[int, Field(ge=1)] = Field(4, description=DETECT["min_pixels"])
    box: tuple[Positive, Positive] = Field((50.0, 50.0), description=DETECT["box"])
    fields: Literal["auto", "frame", "top", "bottom"] = Field("auto", description=DETECT["fields"])
    start: Instant | None = Field(None, description=DETECT["start"])
    end: Instant | None = Field(None, description=DETECT["end"])
    gain: Literal["auto"] | Positive = Field("auto", description=DETECT["gain"])
    offset: Literal["auto"] | Level = Field("auto", description=DETECT["offset"])


class Clip(DetectChange):
    """One calibration clip: the tags in view, and any detect setting that differs for it."""

    tags: Tags = Field(None, description="tags of points.csv: a list, or ranges such as 1-16; default: every tag there")
    detect: DetectChange = Field(
        DetectChange(), description="the detect settings that differ for this clip; they may also stand beside `tags`"
    )


class Calibration(Section):
    """How the cameras are calibrated."""

    sigma: Annotated[float, Field(ge=0)] = Field(
        0.0, description="world units, survey tolerance (1 sigma) where points.csv has none"
    )
    model: LensModel = Field(
        "auto",
        description=LENS,
    )
    refine: Literal["linear", "centre", "full", "bundle"] = Field(
        "full",
        description="how parameters are estimated; linear: the thesis's closed form, with Cx, Cy and sensor as given; "
        "centre: the same, and Cx, Cy searched for the least error; full: every parameter of one camera by non-linear "
        "least squares; bundle: all cameras and the surveyed points together, the survey tolerance as prior",
    )
    reject: Literal["auto", "off"] = Field(
        "auto", description="auto: points that agree with no camera are left out and named; off: every point is used"
    )
    clips: dict[Name, Clip] = Field(
        {}, description="clip: what it shows; every folder in calibration/ is a clip, whether or not it is named here"
    )
    after: tuple[Name, ...] = Field((), description="clips filmed after the test: used to check that no camera moved")
    fix: Fix = Field({}, description="parameters that are not refined: a list of names, or names with values")
    prior: Prior = Field({}, description="parameter: [mean, standard deviation]")


class Reference(Section):
    """How a contact sensor's record, reference.csv, is read."""

    time: str = Field("time_s", description="column of times: seconds, time code or ISO")
    value: str = Field(description="column of values")
    axis: Literal["x", "y", "z", "auto"] = Field(
        "x",
        description="what it measures; x, y, z: that axis of the world; auto: the direction of the target's motion",
    )
    target: str | None = Field(None, description="default: the run's only target")
    offset_s: float | Literal["auto"] | None = Field(
        None, description="s, added to its times; auto: where its motion correlates best with the video's"
    )


class Plane(Section):
    """How one camera's pixels become positions in a plane: a scale, or known points."""

    scale: Positive | None = Field(None, description="world units per px")
    aspect: Positive = Field(1.0, description="X is multiplied by it; the thesis's frame buffer has 1.25")
    points: str | None = Field(None, description="known points in the plane: calibration/points.csv")
    clip: Name | None = Field(None, description="the clip that shows them")


class Transect(Section):
    """A line up the beach along which the water's edge is followed."""

    start: Vector = Field(alias="from", description="world, the seaward end")
    end: Vector = Field(alias="to", description="world, the landward end")
    step: Positive | None = Field(None, description="world units between samples; default: about one px")
    profile: str | None = Field(None, description="CSV of x,y,z along the transect, where the beach is no plane")


class Waterline(Section):
    """Run-up: the moving water's edge along transects."""

    camera: str | None = Field(None, description="default: the run's first camera")
    transects: dict[Name, Transect] = Field(description="transect: the line up the beach that it follows")


Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


class Axes(Section):
    """The basin's directions in the world of points.csv."""

    waves: Direction = Field(
        description="where waves travel to, and surge counts along: +x, -x, +y, -y, +z or -z of the world"
    )
    up: Direction = Field(description="which way is up, and heave counts along: +x, -x, +y, -y, +z or -z of the world")


class Decay(Section):
    """A free decay: the body was displaced and let go."""

    series: str | None = Field(
        None,
        description="what swings: <body>.<surge ... yaw>, <body>@<point>.<surge ... yaw> or <target>.<x, y or z>; "
        "default: what moves most against its sigma",
    )
    drop_half_cycles: Annotated[int, Field(ge=0)] = Field(
        2, description="half cycles after the release that are left out, because letting go disturbs them"
    )
    quadratic: bool = Field(True, description="whether quadratic damping is estimated beside linear damping")
    end: float | None = Field(None, description="s, the last time used; default: where 2 % of the motion are left")


class WaveAnalysis(Section):
    """Waves and the response of every motion to them."""

    elevation: str = Field(description="the wave: a channel, or a series such as buoy.z")
    kind: Literal["auto", "regular", "irregular"] = Field(
        "auto",
        description="regular: harmonics over whole periods; irregular: spectra and transfer functions; auto: regular "
        "where three harmonics hold nine tenths of the variance",
    )
    period: Positive | None = Field(None, description="s, of a regular wave, where it is known to some 10 %")
    resolution: Positive | None = Field(None, description="Hz between the lines of spectra; default: 16 averages")
    start: float | None = Field(None, description="s, the first time used")
    end: float | None = Field(None, description="s, the last time used")


class Analysis(Section):
    """What is estimated from a run's motions."""

    decay: Decay | None = Field(None, description="natural period and damping of a free decay")
    waves: WaveAnalysis | None = Field(None, description="waves and the response to them")


class Channels(Section):
    """Records of other instruments, on the video's clock."""

    file: str = Field(description="CSV, relative to the run's folder")
    time: str = Field("time_s", description="column of times, s")
    columns: Annotated[dict[Name, str], Field(min_length=1)] = Field(
        description="channel: the column of the file that holds it"
    )
    offset_s: float = Field(0.0, description="s, added to the file's times to give the video's")


def _body(value: Any) -> Any:
    """`points` of a body is a table of named points; whatever else stands there are targets."""
    if isinstance(value, Mapping) and isinstance(value.get("points"), Mapping):
        targets = {name: place for name, place in value.items() if name != "points"}
        return {"targets": targets, "named": value["points"]}
    return {"targets": value, "named": {}} if isinstance(value, Mapping) else value


class Body(Section):
    """A rigid body: its targets, and points of it whose motions are wanted; both in the body's axes, world units."""

    targets: dict[str, Vector] = Field(description="target: [x, y, z] in the body")
    named: dict[Name, Vector] = Field({}, description="point, such as CoG: [x, y, z] in the body")


def _analyses(value: Any) -> Any:
    """`decay` alone, or a list of such words, asks for these analyses with their defaults."""
    words = (value,) if isinstance(value, str) else value
    return {word: {} for word in words} if isinstance(words, (list, tuple)) else value


class Run(DetectChange):
    """One run: what moves in it, how it is located, what it is compared with."""

    mode: Literal["space", "plane", "waterline"] = Field(
        "space",
        description="space: positions from two or more cameras; plane: from one camera, in a plane of known scale or "
        "points; waterline: no targets, only the edge of the water",
    )
    targets: Annotated[tuple[str, ...] | Annotated[int, Field(ge=1)] | None, BeforeValidator(_names)] = Field(
        None, description="how many, or a list of names; default: the names in targets.csv, else 1"
    )
    reference: Reference | None = Field(
        None, description="how reference.csv is read; default: time in its first column, x in its second"
    )
    plane: Plane | None = Field(None, description="mode plane: how px become positions in the plane")
    bodies: dict[Name, Annotated[Body, BeforeValidator(_body)]] = Field(
        {},
        description="body: {target: [x, y, z] in the body}; the body's origin is the point that is reported. "
        "points: {CoG: [x, y, z], ...} among the targets names further points whose motions are wanted",
    )
    axes: Axes | None = Field(
        None, description="the basin's directions; needed for surge, sway, heave, roll, pitch, yaw"
    )
    analysis: Annotated[Analysis | None, BeforeValidator(_analyses)] = Field(
        None, description="decay, waves: what is estimated from the motions; `analysis: decay` takes the defaults"
    )
    channels: Channels | None = Field(None, description="records of other instruments: wave gauges, load cells")
    videos: dict[str, str] = Field({}, description="camera: path of a video elsewhere, relative to the experiment")
    start_timecode: str | None = Field(None, description="time code of the first frame, where the video carries none")
    tolerance_px: Positive | None = Field(
        None,
        description="px, how far from its epipolar line a match may lie, and a sample from the located point; default: "
        "3, and for samples 6 standard deviations of the centroids where that is more",
    )
    crop: Crop | dict[str, Crop] | None = Field(
        None, description="as cameras.<camera>.crop, for this run: of all its cameras, or camera: crop"
    )
    max_miss: Positive | None = Field(None, description="world units, the lines of sight may miss a point by no more")
    waterline: Waterline | None = Field(None, description="transects along which the edge of the water is followed")
    detect: DetectChange = Field(
        DetectChange(), description="the detect settings that differ for this run; they may also stand beside `mode`"
    )


class Settings(Section):
    """The whole of config.yaml."""

    experiment: str = Field(".", description="the folder that holds calibration/ and runs/, and receives results/")
    title: str = Field("", description="what the report is headed with; default: Experiment")
    units: Literal["m", "cm", "mm", "in", "ft"] = Field(description="the unit of every world length, in and out")
    cameras: Annotated[dict[Name, Camera], Field(min_length=1)] = Field(
        description="camera: its nominal values; named as its video files are"
    )
    detect: Detect = Field(
        Detect(), description="how targets are distinguished from the background in all clips and runs"
    )
    calibration: Calibration = Field(Calibration(), description="how the cameras are calibrated")
    runs: dict[Name, Run] = Field(
        {}, description="run: what differs from the defaults; every folder in runs/ is processed, named here or not"
    )


def settings_from_config(config: Mapping[str, Any], where: str = "config.yaml") -> Settings:
    """The settings that a parsed config means; VidtrackError with every problem at once, a line each.

    A key without a value (`cam1:`) stands for its defaults.
    """
    try:
        return Settings.model_validate(_filled(config), by_alias=True, by_name=True)
    except ValidationError as error:
        raise VidtrackError(*_lines(where, error.errors())) from None


def detect_for(settings: Settings, *changes: DetectChange) -> dict[str, Any]:
    """The detect settings in force after a clip's or a run's own changes, as plain values."""
    merged = settings.detect.model_dump()
    for change in changes:
        own = {name: getattr(change, name) for name in DetectChange.model_fields}
        merged.update({name: value for name, value in own.items() if value is not None})
    return merged


def _filled(config: Mapping[str, Any]) -> dict[str, Any]:
    filled = {key: value for key, value in config.items() if value is not None}
    for section in ("cameras", "runs"):
        if isinstance(filled.get(section), Mapping):
            filled[section] = {str(k): {} if v is None else v for k, v in filled[section].items()}
    calibration = filled.get("calibration")
    if isinstance(calibration, Mapping) and isinstance(calibration.get("clips"), Mapping):
        clips = {str(k): {} if v is None else v for k, v in calibration["clips"].items()}
        filled["calibration"] = {**calibration, "clips": clips}
    return filled


_BRANCHES = re.compile(r"^(function-|tuple\[|constrained-|literal\[|float$|int$|str$|Clock$|\[key\]|nullable)")
"""What pydantic adds to a place to say which of several allowed forms it tried."""


def _lines(where: str, problems: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for each place that is wrong, whatever the number of forms that were tried there."""
    told: dict[str, list[str]] = {}
    for problem in problems:
        path = [str(part) for part in problem["loc"] if not _BRANCHES.match(str(part))]
        if problem["type"] == "literal_error" and isinstance(problem["input"], Mapping):
            continue  # the other form of this place has told what is wrong inside
        told.setdefault(".".join(path), []).append(_message(path, problem))
    return [
        f"{where}: {place + ': ' if place else ''}{' Or: '.join(dict.fromkeys(texts))}" for place, texts in told.items()
    ]


def _message(path: list[str], problem: Mapping[str, Any]) -> str:
    kind, context, value = problem["type"], problem.get("ctx", {}), _short(problem["input"])
    if kind == "extra_forbidden":
        here = _known_keys(path[:-1])
        near = did_you_mean(path[-1], here) or did_you_mean(path[-1], _all_keys())
        return "no such setting; " + (f"did you mean {near!r}?" if near else f"known here: {', '.join(here)}.")
    if kind == "missing":
        return "missing. Give it; it has no default."
    if kind == "literal_error":
        near = did_you_mean(str(problem["input"]), re.findall(r"'([^']*)'", context["expected"]))
        return f"{value} is not {context['expected']}" + (f"; did you mean {near!r}?" if near else ".")
    message = str(context["error"]) if kind == "value_error" else str(problem["msg"])
    return f"{message[0].lower()}{message[1:]}, not {value}."


def _all_keys() -> list[str]:
    schema = Settings.model_json_schema(by_alias=True)
    parts = [schema, *schema.get("$defs", {}).values()]
    return sorted({key for part in parts for key in part.get("properties", {})})


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _known_keys(path: list[str]) -> list[str]:
    """The keys that are allowed at a place of the config."""
    schema: Any = Settings.model_json_schema(by_alias=True)
    definitions = schema.get("$defs", {})

    def resolved(node: Any) -> Any:
        while "$ref" in node:
            node = definitions[node["$ref"].rsplit("/", 1)[1]]
        for choice in node.get("anyOf", ()):
            inner = resolved(choice)
            if "properties" in inner or "additionalProperties" in inner:
                return inner
        return node

    node = resolved(schema)
    for part in path:
        properties = node.get("properties", {})
        node = properties.get(part, node.get("additionalProperties") or {})
        node = resolved(node) if isinstance(node, dict) else {}
    return list(node.get("properties", {}))


def schema_text() -> str:
    """The JSON schema of config.yaml."""
    return json.dumps(Settings.model_json_schema(by_alias=True), indent=1) + "\n"


if __name__ == "__main__":
    import sys

    sys.stdout.write(schema_text())
