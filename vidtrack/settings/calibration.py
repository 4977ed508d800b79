"""`calibration`: the clips, the lens model, how parameters are refined."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from vidtrack.settings.board import Board
from vidtrack.settings.cameras import LENS, Fix, LensModel, Prior
from vidtrack.settings.detection import DetectChange
from vidtrack.settings.lens import KnownLens
from vidtrack.settings.sections import RATE, STREAM, Name, Positive, Section, Stream, Tags
from vidtrack.settings.self_calibration import SelfCalibration, named_body
from vidtrack.settings.wand import Wand


class Clip(DetectChange):
    """One calibration clip: the tags in view, and any detect setting that differs for it."""

    tags: Tags = Field(None, description="tags of points.csv: a list, or ranges such as 1-16; default: every tag there")
    rate: Positive | None = Field(None, description=f"{RATE}; default: as under cameras")
    stream: Stream | None = Field(None, description=f"{STREAM}; default: as under cameras")
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
    wand: Wand | None = Field(
        None, description="a wand of two or three balls, waved before the cameras, calibrates those that film it"
    )
    self_calibration: Annotated[SelfCalibration | None, BeforeValidator(named_body)] = Field(
        None,
        alias="self",
        description="a rigid body as its own wand: while it floats the known distances of its targets refine the "
        "cameras, and all runs are located by these, where stretches of time that they have not seen show that they "
        "are better",
    )
    follow: bool = Field(
        False,
        description="true: where a camera's background shows that it turned since its calibration, positions are "
        "corrected by it, and sigma has its uncertainty; false: it is only reported",
    )
    same_balls: bool = Field(
        True,
        description="true: targets that look as large as the calibration's balls within 3 % are taken for the same "
        "balls, and a difference of more than half a percent for lenses that were zoomed or focused since; false: "
        "targets are other balls",
    )
    flat: bool = Field(
        False,
        description="true: the points are flat marks, such as dots on a plate; false: they are balls, the middles of "
        "whose outlines lie further out than they themselves are seen",
    )
    after: tuple[Name, ...] = Field((), description="clips filmed after the test: used to check that no camera moved")
    fix: Fix = Field({}, description="parameters that are not refined: a list of names, or names with values")
    prior: Prior = Field({}, description="parameter: [mean, standard deviation]")
    board: Board | None = Field(
        None,
        description="the board that clips show, where their folders have no board.yaml with the same keys: it gives "
        "the lens of each camera, and the cameras' places to each other",
    )
    lens: KnownLens | None = Field(
        None, description="the known lens of every camera that has none of its own: a file, or its numbers"
    )
