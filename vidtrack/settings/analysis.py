"""`axes`, `analysis`, `channels` and `bodies` of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from vidtrack.settings.sections import Name, Positive, Section, Vector

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


def body(value: Any) -> Any:
    """`points` of a body is a table of named points; whatever else stands there are targets."""
    if isinstance(value, Mapping) and isinstance(value.get("points"), Mapping):
        targets = {name: place for name, place in value.items() if name != "points"}
        return {"targets": targets, "named": value["points"]}
    return {"targets": value, "named": {}} if isinstance(value, Mapping) else value


class Body(Section):
    """A rigid body: its targets, and points of it whose motions are wanted; both in the body's axes, world units."""

    targets: dict[str, Vector] = Field(description="target: [x, y, z] in the body")
    named: dict[Name, Vector] = Field({}, description="point, such as CoG: [x, y, z] in the body")


def analyses(value: Any) -> Any:
    """`decay` alone, or a list of such words, asks for these analyses with their defaults."""
    words = (value,) if isinstance(value, str) else value
    return {word: {} for word in words} if isinstance(words, (list, tuple)) else value
