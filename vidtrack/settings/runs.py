"""`runs`: what moves, how it is located, what it is compared with."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from vidtrack.settings.analysis import Analysis, Axes, Body, Channels, analyses, body
from vidtrack.settings.detection import DetectChange
from vidtrack.settings.exports import DESCRIPTION, Formats
from vidtrack.settings.imported import Tracks
from vidtrack.settings.sections import RATE, STREAM, Crop, Name, Positive, Section, Stream, Vector, names, paths
from vidtrack.settings.tags import Tags


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


class Truth(Section):
    """How truth.c3d, truth.tsv or truth.mat, points of another instrument, are read."""

    offset_s: float | None = Field(
        None,
        description="s, when its first frame was, as trajectories count time: since midnight of the time code, or "
        "since the first picture without one; default: the file's own time of day",
    )


class Plane(Section):
    """How one camera's pixels become positions in a plane: a scale, or known points."""

    scale: Positive | None = Field(None, description="world units per px")
    aspect: Positive | None = Field(
        None,
        description="X is multiplied by it: the width of a pixel over its height (1.25 in the thesis's frame buffer); "
        "default: by cameras.<camera>.sensor, else as the file states, else 1",
    )
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
    still_water: float | None = Field(
        None, description="world units, z of the still water, from which run-up is counted; default: z = 0"
    )
    transects: dict[Name, Transect] = Field(description="transect: the line up the beach that it follows")


class Run(DetectChange):
    """One run: what moves in it, how it is located, what it is compared with."""

    mode: Literal["space", "plane", "waterline"] = Field(
        "space",
        description="space: positions from two or more cameras, or of coded tags from one; plane: from one camera, "
        "in a plane of known scale or points; waterline: no targets, only the edge of the water",
    )
    targets: Annotated[
        tuple[str, ...] | Annotated[int, Field(ge=1)] | Literal["all"] | None, BeforeValidator(names)
    ] = Field(
        None,
        description="how many, or a list of names; all: as many as move and two cameras see (mode plane: as move), "
        "each from where it is located first to where last; default: the names in targets.csv, else 1",
    )
    reference: Reference | None = Field(
        None, description="how reference.csv is read; default: time in its first column, x in its second"
    )
    truth: Truth | None = Field(None, description="how the points of truth.c3d, truth.tsv or truth.mat (QTM) are read")
    plane: Plane | None = Field(None, description="mode plane: how px become positions in the plane")
    bodies: dict[Name, Annotated[Body, BeforeValidator(body)]] = Field(
        {},
        description="body: {target: [x, y, z] in the body}; the body's origin is the point that is reported. "
        "points: {CoG: [x, y, z], ...} among the targets names further points whose motions are wanted; "
        "tags: {7: {centre: [x, y, z]}, ...} the coded tags on it",
    )
    tags: Tags | None = Field(
        None,
        description="coded tags on what moves: each camera's tables have their corners as targets tag7_1 to tag7_4, "
        "trajectories their centres as tag7, and bodies their six degrees of freedom; one camera is enough",
    )
    axes: Axes | None = Field(
        None,
        description="the basin's directions, needed for surge, sway, heave, roll, pitch, yaw; default: those that "
        "config.yaml says for all runs",
    )
    about: Literal["mean", "rest"] | tuple[float, float] = Field(
        "mean",
        description="what motions are counted from; mean: of the run; rest: where the body is before it moves; two "
        "times, s, between which it rests",
    )
    analysis: Annotated[Analysis | None, BeforeValidator(analyses)] = Field(
        None, description="decay, waves: what is estimated from the motions; `analysis: decay` takes the defaults"
    )
    export: Formats | None = Field(
        None, description=f"as `export` of the whole experiment, in its place; []: none. {DESCRIPTION}"
    )
    channels: Channels | None = Field(None, description="records of other instruments: wave gauges, load cells")
    videos: dict[str, Annotated[str | tuple[str, ...], BeforeValidator(paths)]] = Field(
        {},
        description="camera: path of a recording elsewhere, relative to the experiment: a file, a list of files that "
        "follow each other, a folder, or a pattern such as far/cam1_*.png",
    )
    rate: Positive | dict[str, Positive] | None = Field(
        None, description=f"{RATE}; of all cameras, or camera: rate; default: as under cameras"
    )
    stream: Stream | dict[str, Stream] | None = Field(
        None, description=f"{STREAM}; of all cameras, or camera: stream; default: as under cameras"
    )
    tracks: Tracks | None = Field(
        None,
        description="as cameras.<camera>.tracks, for this run: of all its cameras that have tracks; it counts first",
    )
    start_timecode: str | None = Field(None, description="time code of the first frame, where the video carries none")
    tolerance_px: Positive | None = Field(
        None,
        description="px, how far from its epipolar line a match may lie, and a sample from the located point; default: "
        "3, and for samples 6 standard deviations of the centroids where that is more",
    )
    crop: Crop | dict[str, Crop] | None = Field(
        None, description="as cameras.<camera>.crop, for this run: of all its cameras, or camera: crop"
    )
    flat: bool = Field(
        False,
        description="true: targets are flat marks, which may be seen obliquely: by how much that moves the middles of "
        "their outlines is in the sd; false: they are balls, whose perspective is taken off",
    )
    max_miss: Positive | None = Field(None, description="world units, the lines of sight may miss a point by no more")
    waterline: Waterline | None = Field(None, description="transects along which the edge of the water is followed")
    detect: DetectChange = Field(
        DetectChange(), description="the detect settings that differ for this run; they may also stand beside `mode`"
    )
