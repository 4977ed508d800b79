"""The whole of config.yaml, and its mistakes as clear lines.

The JSON schema in workflow/schemas is made from here (`python -m vidtrack.settings`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from vidtrack.errors import LINES, VidtrackError
from vidtrack.naming import hint_of
from vidtrack.settings.analysis import Axes
from vidtrack.settings.calibration import Calibration
from vidtrack.settings.cameras import Camera
from vidtrack.settings.detection import Detect, DetectChange
from vidtrack.settings.exports import DESCRIPTION, Formats
from vidtrack.settings.interfaces import Interface
from vidtrack.settings.mistakes import mistakes
from vidtrack.settings.report import Report
from vidtrack.settings.runs import Run
from vidtrack.settings.sections import Name, Positive, Section


class Settings(Section):
    """The whole of config.yaml."""

    experiment: str = Field(".", description="the folder that holds calibration/ and runs/, and receives results/")
    title: str = Field("", description="what the report is headed with; default: Experiment")
    units: Literal["m", "cm", "mm", "in", "ft"] = Field(description="the unit of every world length, in and out")
    cameras: Annotated[dict[Name, Camera], Field(min_length=1)] = Field(
        description="camera: its nominal values; named as its video files are"
    )
    interfaces: dict[Name, Interface] = Field(
        {},
        description="interface: a window, the water's surface or the wall of a tank through which cameras see (through "
        "under cameras); one that several cameras name is one and the same for all of them",
    )
    detect: Detect = Field(
        Detect(), description="how targets are distinguished from the background in all clips and runs"
    )
    export: Formats = Field(
        (),
        description="formats of other programs in which the results of each run are wanted too (docs/formats.md); a "
        f"run that a format cannot hold is left out. {DESCRIPTION}",
    )
    calibration: Calibration = Field(Calibration(), description="how the cameras are calibrated")
    axes: Axes | None = Field(
        None, description="the basin's directions for all runs: which way waves travel, and which way is up"
    )
    scale: Positive | None = Field(
        None,
        description="of the model: 50 for 1 : 50; gives Froude-scaled columns beside what was measured, for runs for "
        "which runs.csv says none",
    )
    report: Report = Field(Report(), description="what the report holds beyond its pages")
    runs: dict[Name, Run] = Field(
        {}, description="run: what differs from the defaults; every folder in runs/ is processed, named here or not"
    )


def settings_from_config(config: Mapping[str, Any], where: str = "config.yaml") -> Settings:
    """The settings that a parsed config means; VidtrackError with every problem at once, a line each.

    A key without a value (`cam1:`) stands for its defaults.
    """
    try:
        settings = Settings.model_validate(_filled(config), by_alias=True, by_name=True)
    except ValidationError as error:
        errors = error.errors()
        more = [f"{where}: and {len(errors) - LINES + 1} more problems."] if len(errors) > LINES else []
        raise VidtrackError(*mistakes(where, errors[: LINES - 1] if more else errors, Settings), *more) from None
    if unknown := _unknown_interfaces(settings):
        raise VidtrackError(*(f"{where}: {line}" for line in unknown))
    return settings


def _unknown_interfaces(settings: Settings) -> list[str]:
    """A line for each interface that a camera names and that is not described, or names twice."""
    lines = []
    known = list(settings.interfaces)
    for camera, own in settings.cameras.items():
        for name in own.through:
            if name not in known:
                cure = hint_of(name, known, "describe it under interfaces.")
                lines.append(f"cameras.{camera}.through: no interface {name!r}; {cure}")
        if len(set(own.through)) < len(own.through):
            lines.append(f"cameras.{camera}.through: an interface stands there twice. Name each once.")
    return lines


def detect_for(settings: Settings, *changes: DetectChange) -> dict[str, Any]:
    """The detect settings in force after a clip's or a run's own changes, as plain values."""
    merged = settings.detect.model_dump()
    for change in changes:
        own = change.model_dump(include=set(DetectChange.model_fields))
        merged.update({name: value for name, value in own.items() if value is not None})
    return merged


def _filled(config: Mapping[str, Any]) -> dict[str, Any]:
    filled = {key: value for key, value in config.items() if value is not None}
    for section in ("cameras", "runs"):
        if isinstance(filled.get(section), Mapping):
            filled[section] = {str(k): {} if v is None else v for k, v in filled[section].items()}
    calibration = filled.get("calibration")
    if isinstance(calibration, Mapping) and isinstance(calibration.get("clips"), Mapping):
        clips = {str(k): {} if v is None else v for k, v in calibration["clips"].items()}
        filled["calibration"] = {**calibration, "clips": clips}
    return filled


def schema_text() -> str:
    """The JSON schema of config.yaml."""
    return json.dumps(Settings.model_json_schema(by_alias=True), indent=1) + "\n"
