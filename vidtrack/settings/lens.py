"""`lens`: what is known of a camera's lens from elsewhere: a file, or numbers in the config."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from vidtrack.settings.sections import Positive, Section

SdOf = Literal["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"]


class Lens(Section):
    """A known lens: with it 4 surveyed points place a camera."""

    file: str | None = Field(
        None,
        description="the file that holds it, from the experiment's folder: OpenCV's YAML, XML or JSON (camera_matrix, "
        "distortion_coefficients), Metashape's XML, COLMAP's cameras.txt, or a camera.json of vidtrack",
    )
    camera: str | None = Field(None, description="which camera of a file that holds several; default: this camera's")
    use: Literal["fixed", "prior"] | None = Field(
        None,
        description="fixed: the lens is held; prior: it is refined too, its covariance as prior; default: prior where "
        "a covariance is known, else fixed",
    )
    fx: Positive | None = Field(
        None, description="px, focal length, OpenCV's; instead of a file, or in place of what the file says"
    )
    fy: Positive | None = Field(None, description="px; default: fx")
    cx: float | None = Field(None, description="px, principal point; default: the middle of the picture")
    cy: float | None = Field(None, description="px; default: the middle of the picture")
    k1: float | None = Field(None, description="radial, no unit, OpenCV's; default: 0")
    k2: float | None = Field(None, description="radial, no unit, OpenCV's; default: 0")
    k3: float | None = Field(None, description="radial, no unit, OpenCV's; default: 0")
    k4: float | None = Field(None, description="radial of a fisheye lens, no unit, OpenCV's fisheye model; default: 0")
    p1: float | None = Field(None, description="tangential, no unit, OpenCV's order; default: 0")
    p2: float | None = Field(None, description="tangential, no unit, OpenCV's order; default: 0")
    fisheye: bool = Field(False, description="true: OpenCV's fisheye model, k1 to k4")
    image_size: tuple[Positive, Positive] | None = Field(
        None, description="px, width and height of the pictures that the lens was calibrated in; default: the clip's"
    )
    sd: dict[SdOf, Positive] = Field(
        {}, description="number: its standard deviation, where the lens is known with a covariance only: {fx: 1.5}"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Lens:
        if self.file is None and self.fx is None:
            raise ValueError("a lens is known from a file, or from fx and what goes with it: give one of them")
        if self.use == "prior" and self.file is None and not self.sd:
            raise ValueError("a prior needs standard deviations: add sd: {fx: 1.5, cx: 2}, or set use: fixed")
        return self


def named(value: Any) -> Any:
    """A path alone stands for `{file: path}`."""
    return {"file": value} if isinstance(value, str) else value


KnownLens = Annotated[Lens, BeforeValidator(named)]
