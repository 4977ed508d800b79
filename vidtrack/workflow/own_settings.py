"""What the config says of one run, clip or camera, with the camera's own settings where it says nothing of these."""

from __future__ import annotations

from typing import Any

from vidtrack.files.experiment import Clip, Run, target_names
from vidtrack.settings.cameras import Clock
from vidtrack.settings.config import Settings, detect_for
from vidtrack.settings.runs import Run as RunSettings

Order = dict[str, Any]
_NOTHING_SAID = RunSettings()


def own_of(settings: Settings, run: str) -> RunSettings:
    """What the config says of a run; nothing, where it does not name it."""
    return settings.runs.get(run, _NOTHING_SAID)


def targets_of(settings: Settings, run: Run) -> list[str] | int | str:
    """The targets of a run beside coded tags: their names, how many, or all."""
    own, tags = own_of(settings, run.name).targets, own_of(settings, run.name).tags
    if own is None and (run.tracks or (tags and not run.targets)):
        return "all" if run.tracks else 0  # as many as the files have; coded tags alone
    if isinstance(own, int) or own == "all":
        return own
    return target_names(settings, run) if own or run.targets else 1


def recording_of(settings: Settings, part: Clip | Run, camera: str) -> Order:
    """How a camera's recording is opened, as `video.reader.open_video` takes it: what differs from its defaults."""
    runs, clips = settings.runs, settings.calibration.clips
    own = runs.get(part.name) if isinstance(part, Run) else clips.get(part.name)
    how: Order = {}
    for key in ("rate", "stream"):
        here = getattr(own, key, None)
        here = here.get(camera) if isinstance(here, dict) else here
        how[key] = getattr(settings.cameras[camera], key) if here is None else here
    if several := part.recordings.get(camera):
        how |= {"parts": several.parts, "numbered": several.numbered}
    how["colour"] = detect_for(settings, *([own, own.detect] if own else []))["colour"]
    return {key: value for key, value in how.items() if value}


def without_colour(detect: Order) -> Order:
    """What stages take: levels are made of colours where recordings are opened, and sd is of digitised positions."""
    return {key: value for key, value in detect.items() if key not in ("colour", "sd")}


def detect_of_clip(settings: Settings, clip: str) -> Order:
    """The detect settings of a clip."""
    own = settings.calibration.clips.get(clip)
    return detect_for(settings, own, own.detect) if own else detect_for(settings)


def crop_of(settings: Settings, run: str, camera: str) -> tuple[float, float, float, float] | None:
    """The part of the calibration's picture that a run's picture shows, where the config says it."""
    own = own_of(settings, run).crop
    here = own.get(camera) if isinstance(own, dict) else own
    return here or settings.cameras[camera].crop


def clock_of(settings: Settings, camera: str) -> Order | str | None:
    clock = settings.cameras[camera].clock
    return clock.model_dump() if isinstance(clock, Clock) else clock
