"""What the parts of a scenario have in common: frozen, closed to unknown keys, and clear about what is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from vidtrack.errors import VidtrackError
from vidtrack.naming import did_you_mean
from vidtrack.timing.timecode import exact_rate

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
MOST_TAGS = 10_000
FASTEST = 1_000_000
NotNegative = Annotated[float, Field(ge=0)]


class Plan(BaseModel):
    """A part of a scenario."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True)


def _rate(value: Any) -> Any:
    try:
        rate = value if isinstance(value, Fraction) else exact_rate(value)
    except (TypeError, ZeroDivisionError, OverflowError):
        rate = Fraction(0)
    if not 0 < rate <= FASTEST:
        raise ValueError(f"a rate is a number of frames a second up to {FASTEST:,}, or a fraction as 30000/1001")
    return rate


def _tags(value: Any) -> Any:
    if value is None or (isinstance(value, tuple) and all(isinstance(v, str) for v in value)):
        return value
    tags: list[str] = []
    for part in value if isinstance(value, list) else str(value).split(","):
        first, dash, last = str(part).strip().partition("-")
        whole = dash and first.isdecimal() and last.isdecimal()
        if whole and int(last) - int(first) > MOST_TAGS:
            raise ValueError(f"more than {MOST_TAGS:,} tags. Correct the range")
        tags += [str(n) for n in range(int(first), int(last) + 1)] if whole else [str(part).strip()]
    return tuple(tags)


Rate = Annotated[Fraction, BeforeValidator(_rate)]
"""Frames a second: 30, 29.97 or 30000/1001 (the last two are one)."""
Tags = Annotated[tuple[str, ...] | None, BeforeValidator(_tags)]
"""1-16, or a list."""

P = TypeVar("P", bound=Plan)


def plan_from(kind: type[P], values: Mapping[str, Any], where: str) -> P:
    """The plan that parsed YAML means; VidtrackError with every problem at once, a line each, after `where`."""
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        lines = [f"{where}: {_line(kind, problem)}" for problem in error.errors()]
        raise VidtrackError(*dict.fromkeys(lines)) from None


def _line(kind: type[Plan], problem: Mapping[str, Any]) -> str:
    place = ".".join(str(part) for part in problem["loc"] if not str(part).startswith("("))  # a form of an entry
    if problem["type"] == "extra_forbidden":
        key = str(problem["loc"][-1])
        near = did_you_mean(key, _all_keys(kind))
        if near == key:
            return f"{place}: no such setting in this section; {key!r} belongs in another one. Move or remove it."
        return f"{place}: no such setting" + (f"; did you mean {near!r}?" if near else ". Remove it.")
    if problem["type"] == "missing":
        return f"{place}: missing. Give it; it has no default."
    context: Mapping[str, Any] = problem.get("ctx", {})
    message = str(context["error"]) if problem["type"] == "value_error" else str(problem["msg"])
    prefix = f"{place}: " if place else ""
    value = problem["input"]
    return f"{prefix}{message}" + ("." if isinstance(value, Mapping) else f", not {str(value)[:60]!r}.")


def _all_keys(kind: type[Plan]) -> Sequence[str]:
    schema = kind.model_json_schema(mode="serialization")
    return sorted({key for part in (schema, *schema.get("$defs", {}).values()) for key in part.get("properties", {})})
