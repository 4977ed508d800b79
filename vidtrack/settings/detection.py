"""`detect`: how targets are distinguished from the background."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from vidtrack.settings.sections import Instant, Level, Positive, Section


class Hue(Section):
    """A colour by its place on the colour wheel."""

    hue: float = Field(ge=0, le=360, description="degrees: 0 red, 60 yellow, 120 green, 180 cyan, 240 blue")
    width: float = Field(
        180.0,
        gt=0,
        le=180,
        description="degrees of hues that stand out, the narrower the less of its neighbours; 180: all that is more of "
        "this hue than of its opposite",
    )


def _level(given: float) -> float:
    if 0 < given < 1:
        raise ValueError(f"a grey level of 255, not a share of it: write {round(255 * given)}")
    return given


GreyLevel = Annotated[float, Field(ge=0, le=255), AfterValidator(_level)]

Colour = Literal["r", "g", "b"] | tuple[float, float, float] | Hue

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
    "max_step": "share of the picture's diagonal that a target moves between two samples at most, where targets are "
    "found without start boxes; less where many are close to each other, more where they are fast",
    "min_motion": "px that a thing moves in the first samples before it is found as a target by its motion; what moves "
    "less is found by its brightness",
    "max_clutter": "share of the picture that things which stand still and are as bright as targets may cover: targets "
    "are not measured while they touch such things; where these cover more they are scenery, and targets before it",
    "max_occlusion": "samples in which targets that hide each other are awaited where they met; then they count as "
    "lost and are sought elsewhere",
    "colour": "grey levels are made of colours, for targets as bright as their background; r, g, b: that channel; "
    "[1, -1, 0]: weights of red, green and blue; {hue: 0, width: 90}: how much of that hue there is, grey being 128; "
    "null: brightness",
    "sd": "px, one standard deviation of positions that another program digitised (tracks and calibration "
    "points in place "
    "of recordings); null: estimated from how each track scatters",
    "offset": "stored level, on the scale 0 to 255 of the file's depth, that becomes black; auto: chosen with gain",
}
"""What each detect key means, for all clips and runs and where one of them differs."""


def _change(key: str) -> Any:
    return Field(None, description=f"{DETECT[key]}. Null: as under detect")


class DetectChange(Section):
    """How targets are distinguished from the background, where a clip or a run differs from the rest."""

    polarity: Literal["bright", "dark"] | None = _change("polarity")
    threshold: Literal["auto"] | GreyLevel | None = _change("threshold")
    centroid: Literal["weighted", "binary", "ellipse"] | None = _change("centroid")
    min_pixels: Annotated[int, Field(ge=1)] | None = _change("min_pixels")
    box: tuple[Positive, Positive] | None = _change("box")
    fields: Literal["auto", "frame", "top", "bottom"] | None = _change("fields")
    start: Instant | None = _change("start")
    end: Instant | None = _change("end")
    gain: Literal["auto"] | Positive | None = _change("gain")
    offset: Literal["auto"] | Level | None = _change("offset")
    colour: Colour | None = _change("colour")
    sd: Positive | None = _change("sd")
    max_step: Annotated[float, Field(gt=0, le=1)] | None = _change("max_step")
    min_motion: Positive | None = _change("min_motion")
    max_clutter: Annotated[float, Field(gt=0, le=1)] | None = _change("max_clutter")
    max_occlusion: Annotated[int, Field(ge=1)] | None = _change("max_occlusion")


class Detect(Section):
    """How targets are distinguished from the background."""

    polarity: Literal["bright", "dark"] = Field("bright", description=DETECT["polarity"])
    threshold: Literal["auto"] | GreyLevel = Field("auto", description=DETECT["threshold"])
    centroid: Literal["weighted", "binary", "ellipse"] = Field("weighted", description=DETECT["centroid"])
    min_pixels: Annotated[int, Field(ge=1)] = Field(4, description=DETECT["min_pixels"])
    box: tuple[Positive, Positive] = Field((50.0, 50.0), description=DETECT["box"])
    fields: Literal["auto", "frame", "top", "bottom"] = Field("auto", description=DETECT["fields"])
    start: Instant | None = Field(None, description=DETECT["start"])
    end: Instant | None = Field(None, description=DETECT["end"])
    gain: Literal["auto"] | Positive = Field("auto", description=DETECT["gain"])
    offset: Literal["auto"] | Level = Field("auto", description=DETECT["offset"])
    colour: Colour | None = Field(None, description=DETECT["colour"])
    sd: Positive | None = Field(None, description=DETECT["sd"])
    max_step: Annotated[float, Field(gt=0, le=1)] = Field(0.15, description=DETECT["max_step"])
    min_motion: Positive = Field(1.5, description=DETECT["min_motion"])
    max_clutter: Annotated[float, Field(gt=0, le=1)] = Field(0.25, description=DETECT["max_clutter"])
    max_occlusion: Annotated[int, Field(ge=1)] = Field(8, description=DETECT["max_occlusion"])
