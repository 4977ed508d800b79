"""Files of other programs in place of recordings and clips: what they do not say themselves."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from vidtrack.settings.sections import Positive, Section

Size = tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]]


def pair(value: object) -> object:
    """One number for both axes."""
    return (value, value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def word(value: object) -> object:
    """A name or a number as a name."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


CAMERA = (
    "which of the file's cameras this one is, by name or number: cam2, 2; default: the only one, or that of its name"
)
ORIGIN = "the corner from which the file's pixels are counted; upper-left: y down; lower-left: y up"
FIRST = (
    "coordinate of the centre of the pixel in that corner, 0, 0.5 or 1, or [x, y]; default: as the format has "
    "it, where it "
    "has one"
)
SIZE = "px, width and height of the picture; default: as the file states it, where it does"


class Tracks(Section):
    """What a file of tracks in place of a recording does not say."""

    format: Literal["dltdv", "dltdv8", "argus"] | None = Field(
        None,
        description="whose xypts table it is, where its columns do not say; dltdv8: DLTdv 8, from the upper-left "
        "corner; argus: Argus; dltdv: DLTdv, with an origin of its own",
    )
    camera: Annotated[str | None, BeforeValidator(word)] = Field(None, description=CAMERA)
    origin: Literal["upper-left", "lower-left"] | None = Field(None, description=ORIGIN)
    first_pixel: Annotated[tuple[float, float] | None, BeforeValidator(pair)] = Field(None, description=FIRST)
    size: Size | None = Field(None, description=SIZE)
    likelihood: Annotated[float, Field(ge=0, le=1)] | None = Field(
        None, description="DeepLabCut and anipose: points less likely than this count as missing"
    )


class CameraFile(Section):
    """A camera that another program calibrated, in place of clips: calibration/<camera>.<ext>."""

    path: str | None = Field(
        None, description="a file elsewhere, relative to the experiment; default: calibration/<camera>.<ext>"
    )
    format: Literal["dltdv", "dltdv8", "argus"] | None = Field(
        None,
        description="whose DLT coefficients they are; dltdv8: DLTdv 8, from the upper-left corner; dltdv: DLTdv 5 to 7 "
        "and easyWand, from the lower-left one; argus: Argus",
    )
    camera: Annotated[str | None, BeforeValidator(word)] = Field(None, description=CAMERA)
    origin: Literal["upper-left", "lower-left"] | None = Field(None, description=ORIGIN)
    first_pixel: Annotated[tuple[float, float] | None, BeforeValidator(pair)] = Field(None, description=FIRST)
    size: Size | None = Field(None, description=SIZE)
    units: Literal["m", "cm", "mm", "in", "ft"] | None = Field(
        None,
        description="m, cm, mm, in, ft: the unit of the file's lengths, where its format has none; default: as units",
    )
    sigma_px: Positive | None = Field(
        None,
        description="px, one standard deviation of where the camera sees a known point; default: not known, and then "
        "the sigma of positions is not known either",
    )
    lens: str | None = Field(
        None, description="DLT coefficients of pixels without distortion: the Argus camera profile that has it"
    )
