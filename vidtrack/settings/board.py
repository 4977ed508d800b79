"""`board`: a printed board that was moved before the cameras."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from vidtrack.errors import VidtrackError
from vidtrack.settings.mistakes import mistakes
from vidtrack.settings.sections import Name, Positive, Section

Count = Annotated[int, Field(ge=3, le=60)]


class Board(Section):
    """A board of known corners, filmed by one camera or by several at once; `vidtrack plan board` prints one."""

    type: Literal["charuco", "checkerboard", "circles", "apriltag"] = Field(
        "charuco",
        description="charuco: a checkerboard with tags in its white squares; checkerboard: without; circles: a grid of "
        "equal circles; apriltag: a grid of tags. With several cameras charuco or apriltag: each corner has its name",
    )
    columns: Count = Field(description="squares, circles or tags in a row (squares, not the corners between them)")
    rows: Count = Field(description="squares, circles or tags in a column")
    square: Positive = Field(
        description="`units`, side of a square, or from centre to centre of circles and tags: measure it on the print",
    )
    marker: Positive | None = Field(
        None,
        description="`units`, side of a tag, or diameter of a circle; default: three quarters, or half, of a square",
    )
    dictionary: str = Field(
        "",
        pattern=r"^(DICT_\w+)?$",
        description="of the tags, OpenCV's name; default: DICT_5X5_250, and DICT_APRILTAG_36h11 for apriltag",
    )
    clips: tuple[Name, ...] | None = Field(
        None,
        description="the clips that show it; default: those named board...; all where there is no points.csv",
    )
    world: str | None = Field(
        None,
        pattern=r"^[^/]+/\d+$",
        description="clip/frame whose board is the world, where no points are surveyed: x along its columns, y up its "
        "rows, z out of its face; default: the view that most cameras see best",
    )

    @model_validator(mode="after")
    def _fits(self) -> Board:
        if self.marker is not None and self.marker >= self.square:
            raise ValueError(f"a marker of {self.marker:g} does not fit in a square of {self.square:g}")
        return self


def board_from_values(values: Mapping[str, Any], where: str) -> Board:
    """The board that a parsed board.yaml means. VidtrackError, one line a problem.

    where   the file
    """
    try:
        return Board.model_validate(values)
    except ValidationError as error:
        raise VidtrackError(*mistakes(where, error.errors(), Board)) from None
