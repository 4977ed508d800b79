"""`calibration.self`: cameras refined by a body that floats, its targets at known distances."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from vidtrack.settings.sections import Name, Positive, Section, one_or_more


class SelfCalibration(Section):
    """A rigid body as its own wand: the known distances of its targets refine the cameras."""

    body: Name = Field(description="the body, as bodies of the runs name it, of three targets or more")
    runs: Annotated[tuple[Name, ...], BeforeValidator(one_or_more)] = Field(
        (), description="runs in which it floats, each with this body under bodies; default: every run that has it"
    )
    sigma: Positive | None = Field(
        None,
        description="world units, standard deviation of each coordinate of a target in the body; default: 1/2000 of "
        "the largest distance between its targets",
    )


def named_body(value: Any) -> Any:
    """A name alone stands for `{body: name}`; `run: pluck` for `runs: [pluck]`."""
    if isinstance(value, str):
        return {"body": value}
    if isinstance(value, dict) and "run" in value and "runs" not in value:
        return {**{key: own for key, own in value.items() if key != "run"}, "runs": value["run"]}
    return value
