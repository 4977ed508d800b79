"""`calibration.wand`: cameras calibrated by a waved wand, without a survey."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from vidtrack.settings.detection import DetectChange
from vidtrack.settings.sections import Name, Positive, Section, names


def _tag(value: Any) -> Any:
    return str(value) if isinstance(value, int) else value


Tag = Annotated[str, BeforeValidator(_tag)]
TwoTags = Annotated[tuple[Tag, Tag], BeforeValidator(names)]


class WandAxes(Section):
    """Directions that say where the world's axes lie; the tags are picked in picks.csv of the wand's clip."""

    origin: Tag | None = Field(
        None, description="tag of the point that is the origin; default: the first one that another axis names"
    )
    x: TwoTags | None = Field(None, description="two tags: x runs from the first to the second, as nearly as it can")
    y: TwoTags | None = Field(None, description="two tags: y runs from the first toward the second")
    up: TwoTags | None = Field(
        None, description="two tags on an upright, such as a plumb line: z runs from the first to the second"
    )
    level: Annotated[tuple[Tag, ...] | None, BeforeValidator(names)] = Field(
        None,
        description="three or more tags on a level surface, such as still water: z is its normal, on the cameras' side",
    )
    drop: Name | None = Field(
        None, description="clip of a ball that is dropped: z is against its fall, and gravity checks the wand's length"
    )

    @model_validator(mode="after")
    def _enough(self) -> WandAxes:
        if not (self.up or self.level or self.drop) and not (self.x and self.y):
            raise ValueError("name up, level or drop, or both x and y")
        return self


class Wand(Section):
    """A wand of two or three balls at known distances, waved through the volume before all cameras."""

    lengths: dict[str, Positive] = Field(
        description="world units, distances between the balls' centres, by the names of two balls: {A-B: 20}; of a "
        "straight wand of three balls two of them are enough: {A-B: 10, B-C: 20}"
    )
    clip: Name = Field("wand", description="folder in calibration/ with the recordings of the waved wand")
    sigma: Positive | None = Field(
        None, description="world units, standard deviation of the lengths; default: 1/2000 of the longest"
    )
    axes: WandAxes | Literal["camera"] | None = Field(
        None,
        description="where the world's axes lie: directions between picked points; camera: those of the first camera. "
        "Default: the surveyed points of points.csv that other clips show, else camera",
    )
    detect: DetectChange = Field(
        DetectChange(), description="the detect settings that differ for the clip of the wand and that of the drop"
    )

    @model_validator(mode="before")
    @classmethod
    def _one_length(cls, values: Any) -> Any:
        """`length: 20`, or `lengths: 20`, is a wand of two balls."""
        if isinstance(values, dict) and isinstance(values.get("lengths"), (int, float)):
            return {**values, "lengths": {"A-B": values["lengths"]}}
        if isinstance(values, dict) and "length" in values and "lengths" not in values:
            rest = {key: value for key, value in values.items() if key != "length"}
            return {**rest, "lengths": {"A-B": values["length"]}}
        return values

    @model_validator(mode="after")
    def _two_or_three_balls(self) -> Wand:
        if self.balls not in (2, 3) or any(len(name.split("-")) != 2 for name in self.lengths):
            raise ValueError(f"lengths names {self.balls} balls; a wand has 2 or 3, each distance named as A-B")
        return self

    @property
    def drop(self) -> str | None:
        """The clip of the dropped ball, where there is one."""
        return self.axes.drop if isinstance(self.axes, WandAxes) else None

    @property
    def clips(self) -> tuple[str, ...]:
        """The clips that show no surveyed points but the wand, or the ball that is dropped."""
        return (self.clip, self.drop) if self.drop else (self.clip,)

    @property
    def balls(self) -> int:
        """How many balls the wand has."""
        return len({end.strip() for name in self.lengths for end in name.split("-")})
