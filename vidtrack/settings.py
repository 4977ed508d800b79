"""What config.yaml may say: every key with its type, its default and its meaning; nothing else is allowed.

The JSON schema in workflow/schemas is made from here (`python -m vidtrack.settings`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from vidtrack.errors import VidtrackError
from vidtrack.naming import did_you_mean

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
Level = Annotated[float, Field(ge=-255, le=255)]
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
    """`1-16`, `1-4, 9, a` or a list of any of these, as single tags."""
    if value is None:
        return None
    parts = value if isinstance(value, (list, tuple)) else str(value).split(",")
    tags: list[str] = []
    for part in (str(p).strip() for p in parts):
        ends = re.fullmatch(r"(\d+)\s*-\s*(\d+)", part)
        if not part:
            raise ValueError("an empty tag; write 1-16 or a list of tags")
        if ends and int(ends[1]) > int(ends[2]):
            raise ValueError(f"{part} counts backwards; write {ends[2]}-{ends[1]}")
        tags += [str(n) for n in range(int(ends[1]), int(ends[2]) + 1)] if ends else [part]
    return tuple(tags)


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


class Camera(Section):
    """One camera: where its optical axis meets the frame buffer, its sensor, its clock."""

    Cx: float | None = Field(None, description="px; default: the middle of the frame buffer")
    Cy: float | None = Field(None, description="px; default: the middle of the frame buffer")
    sensor: tuple[Positive, Positive] | None = Field(
        None, description="mm, width and height of the sensor area that the frame covers; default: dx = dy = 1 px"
    )
    clock: Clock | Literal["auto", "motion", "sound", "flash"] = Field(
        Clock(),
        description="offset and rate; auto: estimated from all that tells it (motion, sound, a flash), or one of these",
    )


class DetectChange(Section):
    """How targets are told from the background, where a clip or a run differs from the rest."""

    polarity: Literal["bright", "dark"] | None = None
    threshold: Literal["auto"] | Annotated[float, Field(ge=0, le=255)] | None = None
    centroid: Literal["weighted", "binary", "ellipse"] | None = None
    min_pixels: Annotated[int, Field(ge=1)] | None = None
    box: tuple[Positive, Positive] | None = None
    fields: Literal["auto", "frame", "top", "bottom"] | None = None
    start: Instant | None = None
    end: Instant | None = None
    gain: Literal["auto"] | Positive | None = None
    offset: Literal["auto"] | Level | None = None


class Detect(Section):
    """How targets are told from the background."""

    polarity: Literal["bright", "dark"] = "bright"
    threshold: Literal["auto"] | Annotated[float, Field(ge=0, le=255)] = Field(
        "auto", description="grey level 0-255, after gain and offset"
    )
    centroid: Literal["weighted", "binary", "ellipse"] = Field(
        "weighted", description="binary is the thesis's equations 4.2.1 and 4.2.2"
    )
    min_pixels: Annotated[int, Field(ge=1)] = 4
    box: tuple[Positive, Positive] = Field((50.0, 50.0), description="px, width and height of the moving box mask")
    fields: Literal["auto", "frame", "top", "bottom"] = Field(
        "auto", description="interlaced video gives two samples a frame; top, bottom: which field comes first"
    )
    start: Instant | None = Field(None, description="time code or frame number of the first sample used")
    end: Instant | None = Field(None, description="time code or frame number of the last sample used")
    gain: Literal["auto"] | Positive = Field(
        "auto", description="grey levels are stretched by this factor; auto: only where too few are in use"
    )
    offset: Literal["auto"] | Level = Field(
        "auto", description="stored level, on the scale 0-255 of the file's depth, that becomes black"
    )


class Clip(DetectChange):
    """One calibration clip: the tags in view, and any detect setting that differs for it."""

    tags: Tags = Field(None, description="1-16, or a list; default: every tag in points.csv")
    detect: DetectChange = DetectChange()


ParameterName = Literal["Cx", "Cy", "Sx", "f", "kappa1", "kappa2", "p1", "p2", "skew"]


class Calibration(Section):
    """How the cameras are calibrated."""

    sigma: Annotated[float, Field(ge=0)] = Field(
        0.0, description="world units, survey tolerance (1 sigma) where points.csv has none"
    )
    model: Literal["tsai", "tsai2", "brown", "affine", "auto"] = "tsai"
    refine: Literal["linear", "centre", "full", "bundle"] = "full"
    clips: dict[Name, Clip] = {}
    after: tuple[Name, ...] = Field((), description="clips filmed after the test: used to check that no camera moved")
    fix: Annotated[dict[ParameterName, float | None], BeforeValidator(_fixed)] = Field(
        {}, description="parameters that are not refined: a list of names, or names with values"
    )
    prior: dict[ParameterName, tuple[float, Positive]] = Field({}, description="parameter: [mean, standard deviation]")


class Reference(Section):
    """How a contact sensor's record, reference.csv, is read."""

    time: str = Field("time_s", description="column of times: seconds, time code or ISO")
    value: str = Field(description="column of values")
    axis: Literal["x", "y", "z", "auto"] = Field("x", description="auto: the direction in which the target moves most")
    target: str | None = Field(None, description="default: the run's only target")


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
    transects: dict[Name, Transect]


class Run(DetectChange):
    """One run: what moves in it, how it is located, what it is compared with."""

    mode: Literal["space", "plane", "waterline"] = Field(
        "space", description="two or more cameras; one and a plane; waterline: no targets, only the water's edge"
    )
    targets: Annotated[tuple[str, ...] | Annotated[int, Field(ge=1)] | None, BeforeValidator(_names)] = Field(
        None, description="how many, or a list of names; default: the names in targets.csv, else 1"
    )
    reference: Reference | None = None
    plane: Plane | None = None
    bodies: dict[Name, dict[str, Vector]] = Field(
        {}, description="body: {target: [x, y, z] in the body}; the body's origin is the point that is reported"
    )
    videos: dict[str, str] = Field({}, description="camera: path of a video elsewhere, relative to the experiment")
    start_timecode: str | None = Field(None, description="time code of the first frame, where the video carries none")
    tolerance_px: Positive = Field(3.0, description="px, how far from its epipolar line a match may lie")
    max_miss: Positive | None = Field(None, description="world units, the lines of sight may miss a point by no more")
    waterline: Waterline | None = None
    detect: DetectChange = DetectChange()


class Settings(Section):
    """The whole of config.yaml."""

    experiment: str = Field(".", description="the folder that holds calibration/ and runs/, and receives results/")
    title: str = Field("", description="what the report is headed with; default: the experiment folder's name")
    units: Literal["m", "cm", "mm", "in", "ft"] = Field(description="the unit of every world length, in and out")
    cameras: Annotated[dict[Name, Camera], Field(min_length=1)]
    detect: Detect = Detect()
    calibration: Calibration = Calibration()
    runs: dict[Name, Run] = {}


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


if __name__ == "__main__":
    import json
    import sys

    sys.stdout.write(json.dumps(Settings.model_json_schema(by_alias=True), indent=1) + "\n")
