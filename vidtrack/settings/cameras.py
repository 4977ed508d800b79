"""`cameras`: nominal values, clocks, and what of the calibration is a camera's own."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from vidtrack.settings.imported import CameraFile, Tracks
from vidtrack.settings.lens import KnownLens
from vidtrack.settings.sections import RATE, STREAM, Crop, Positive, Section, Stream, fixed, one_or_more

LEAST_READOUT_MS = 0.1
"""No shutter rolls faster: such a figure is in seconds."""


def _in_ms(value: float) -> float:
    if 0 < abs(value) < LEAST_READOUT_MS:
        raise ValueError(f"no shutter rolls that fast: give ms ({1000 * value:g} where this is in s)")
    return value


Readout = Annotated[float, Field(ge=-1000, le=1000), AfterValidator(_in_ms)]


class Clock(Section):
    """What is added to a camera's time."""

    offset_s: float = Field(0.0, description="s, added to the camera's time")
    rate_ppm: float = Field(0.0, ge=-2e5, le=2e5, description="parts per million by which the camera's time runs slow")


LENS = (
    "the lens; tsai: f, Sx, Cx, Cy and one radial term, kappa1; tsai2: a second one, kappa2; tsai3: a "
    "third one, kappa3 (lenses beyond 90 degrees); equidistant: a wide lens whose picture grows with the angle, not "
    "with its tangent, and kappa1; fisheye: the same with kappa1, kappa2, kappa3 (lenses from 100 to 170 degrees); "
    "brown: kappa1, kappa2 and the tangential terms p1, p2; affine: skewed pixel axes (skew) too; prism: all of these "
    "and a thin prism, s1, s2; quadratic: prism and q1, q2, so that it has all terms of second order (a pane of glass "
    "seen obliquely); auto: the plainest of them that predicts points held out of the fit as well as a richer one"
)
"""What the words of `model` mean."""

LensModel = Literal["tsai", "equidistant", "tsai2", "tsai3", "fisheye", "brown", "affine", "prism", "quadratic", "auto"]
ParameterName = Literal["Cx", "Cy", "Sx", "f", "kappa1", "kappa2", "p1", "p2", "skew", "kappa3", "s1", "s2", "q1", "q2"]
Fix = Annotated[dict[ParameterName, float | None], BeforeValidator(fixed)]
Prior = dict[ParameterName, tuple[float, Positive]]


Through = Annotated[tuple[str, ...], BeforeValidator(one_or_more)]


class CameraCalibration(Section):
    """What is known of one camera; it is added to what `calibration` says of all cameras, and counts before it."""

    model: LensModel | None = Field(None, description=f"{LENS}. Null: as under calibration")
    fix: Fix = Field({}, description="parameters of this camera that are not refined, as calibration.fix")
    prior: Prior = Field({}, description="what is known of this camera's parameters, as calibration.prior")
    lens: KnownLens | None = Field(
        None,
        description="the known lens of this camera: a file, or its numbers; 4 surveyed points then place it. Null: as "
        "under calibration",
    )


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
    rate: Positive | None = Field(None, description=f"{RATE}; default: as the file states")
    stream: Stream | None = Field(None, description=f"{STREAM}; default: the one that the file names its default")
    through: Through = Field(
        (),
        description="the interface through which it sees, or a list of them in the order from the camera on, by their "
        "names under `interfaces`; points on the camera's side of a plane are seen directly; default: air alone",
    )
    calibration: CameraCalibration = Field(
        CameraCalibration(), description="model, fix and prior of this camera, beside those of all cameras"
    )
    tracks: Tracks | None = Field(
        None, description="of tracks that another program made: what their files do not say; in all runs and clips"
    )
    camera_file: CameraFile | None = Field(
        None, description="of a camera that another program calibrated: what its file does not say"
    )
    readout_ms: Readout | Literal["motion"] | None = Field(
        None,
        description="ms from the exposure of the picture's first row to that of its last, of a rolling shutter; below "
        "0 where it begins at the bottom; 0 for a global shutter; motion: found from targets that all cameras see; "
        "default: as the file's maker states (GoPro), else 0, reported where motion shows another",
    )
    clock: Clock | Literal["auto", "motion", "sound", "flash"] | None = Field(
        None,
        description="{offset_s, rate_ppm}, or how they are estimated; motion: from targets that all cameras see; "
        "sound: from the sound tracks, by one clap; flash: from a lamp that is switched; auto: all three, weighed; "
        "default: the time code, or motion where the recording has none",
    )
