"""`axes`, `analysis`, `channels` and `bodies` of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from vidtrack.settings.sections import Name, Positive, Section, Vector
from vidtrack.settings.tags import TagPlaces

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

    elevation: str = Field(
        description="the wave: a channel, a series such as buoy.z, or a target that floats: its motion upward"
    )
    kind: Literal["auto", "regular", "irregular"] = Field(
        "auto",
        description="regular: harmonics over whole periods; irregular: spectra and transfer functions; auto: regular "
        "where three harmonics hold nine tenths of the variance",
    )
    period: Positive | None = Field(None, description="s, of a regular wave, where it is known to some 10 %")
    resolution: Positive | None = Field(None, description="Hz between the lines of spectra; default: 16 averages")
    start: float | None = Field(
        None, description="s, the first time used; default: the first that wave and motions have in common"
    )
    end: float | None = Field(None, description="s, the last time used; default: the last that they have in common")
    depth: Positive | Literal["deep"] | None = Field(
        None,
        description="world units, of the still water, or deep: gives the wave's slope, and so the response of angles "
        "in deg/deg; default: no slope is given",
    )
    distance: float = Field(
        0.0,
        description="world units, from the gauge to the point to which phases refer, along the waves; needs depth",
    )

    @model_validator(mode="after")
    def _reaches(self) -> Self:
        if self.distance and self.depth is None:
            raise ValueError("distance needs depth, which says how fast the waves travel")
        return self


class Analysis(Section):
    """What is estimated from a run's motions."""

    decay: Decay | None = Field(None, description="natural period and damping of a free decay")
    waves: WaveAnalysis | None = Field(None, description="waves and the response to them")


def named_alike(value: Any) -> Any:
    """A list of columns means channels of the same names."""
    return {str(name): str(name) for name in value} if isinstance(value, (list, tuple)) else value


class ChannelClock(Section):
    """How the clock of another instrument is joined to the video's; one of lamp and motion."""

    lamp: str | None = Field(
        None, description="column that switches with a lamp, or carries a pulse of light, that a camera sees"
    )
    motion: str | None = Field(None, description="column that measures a motion which the video measures too")
    series: str | None = Field(
        None, description="with motion: the series of that motion, named as in analysis.decay.series, such as t1.x"
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.lamp is None) == (self.motion is None):
            raise ValueError("name either lamp or motion")
        if (self.motion is None) != (self.series is None):
            raise ValueError("motion and series belong together")
        return self


class Channels(Section):
    """Records of other instruments, on the video's clock."""

    file: str = Field(
        description="CSV, Parquet, MAT (level 5) or TDMS (with the package npTDMS), relative to the run's folder"
    )
    time: str | None = Field(
        "time_s", description="column of times, s; null: the file's own (TDMS), or samples at `rate` from 0 on"
    )
    rate: Positive | None = Field(None, description="Hz, samples a second of a file without times")
    columns: Annotated[dict[Name, str], Field(min_length=1), BeforeValidator(named_alike)] = Field(
        description="channel: the column, variable or TDMS channel of the file that holds it; a list: of these names"
    )
    offset_s: float = Field(0.0, description="s, added to the file's times to give the video's, or nearly so")
    clock: ChannelClock | None = Field(
        None, description="what joins its clock to the video's, where offset_s does not; never the wave itself"
    )


def body(value: Any) -> Any:
    """`points` and `tags` of a body are tables; whatever else stands there are targets."""
    if not isinstance(value, Mapping):
        return value
    tables = {"points": "named", "tags": "tags"}
    own = {tables[name]: value[name] for name in tables if isinstance(value.get(name), Mapping)}
    targets = {name: place for name, place in value.items() if tables.get(name) not in own}
    return {"targets": targets, "named": {}, **own}


class Body(Section):
    """A rigid body: its targets, its coded tags, and points whose motions are wanted; in its axes, world units."""

    targets: dict[str, Vector] = Field(description="target: [x, y, z] in the body")
    named: dict[Name, Vector] = Field({}, description="point, such as CoG: [x, y, z] in the body")
    tags: TagPlaces = Field({}, description="number of a coded tag: where it sits in the body; needs `tags` of the run")


def analyses(value: Any) -> Any:
    """`decay` alone, or a list of such words, asks for these analyses with their defaults."""
    words = (value,) if isinstance(value, str) else value
    return {word: {} for word in words} if isinstance(words, (list, tuple)) else value
