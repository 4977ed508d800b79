"""What the parts of the config are made of: closed sections, names, lists of tags, lengths and vectors."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from vidtrack.naming import in_one_form

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
Stream = Annotated[int, Field(ge=1)]
Level = Annotated[float, Field(ge=-255, le=255)]
Crop = tuple[float, float, Positive, Positive]
Instant = str | int
"""A time code or a frame number."""


class Section(BaseModel):
    """A part of the config: frozen, and closed to unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _simple_name(name: str) -> str:
    if not re.fullmatch(r"[^\W_][\w.-]*", name):
        raise ValueError("a name is made of letters, digits, _ . - and begins with a letter or digit")
    return name


def _tag_list(value: Any) -> Any:
    """`1-16`, `1-4, 9, a` or a list of any of these, each part as it stands: see `naming.tags_meant`."""
    if value is None:
        return None
    parts = value if isinstance(value, (list, tuple)) else str(value).split(",")
    parts = tuple(in_one_form(str(p)) for p in parts)
    if "" in parts:
        raise ValueError("an empty tag; write 1-16 or a list of tags")
    return parts


def names(value: Any) -> Any:
    """A list of names, each once; a number is passed on, and true is none."""
    if isinstance(value, bool):
        raise ValueError("neither a number nor names (put a name such as no, on or true in quotes)")
    if not isinstance(value, (list, tuple)):
        return value
    out = tuple(in_one_form(str(v)) for v in value)
    if twice := [name for name in dict.fromkeys(out) if out.count(name) > 1]:
        raise ValueError(f"{' and '.join(twice)} stands there twice")
    return out


def paths(value: Any) -> Any:
    """A path, or a list of paths."""
    return tuple(str(v) for v in value) if isinstance(value, (list, tuple)) else value


def fixed(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return dict.fromkeys((str(v) for v in value), None)
    return value


def one_or_more(value: Any) -> Any:
    """A name, or a list of names."""
    return (value,) if isinstance(value, str) else names(value) if value is not None else ()


RATE = (
    "pictures a second that the camera took, where the file states none (numbered pictures, raw streams) or another "
    "one (slow motion that is stored at 30)"
)
STREAM = "which stream of pictures is read where a file has several, 1 for the first"
"""What `rate` and `stream` mean, for a camera, a clip or a run."""

Name = Annotated[str, AfterValidator(_simple_name)]
Tags = Annotated[tuple[str, ...] | None, BeforeValidator(_tag_list)]
