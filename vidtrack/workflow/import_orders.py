"""The settings that each rule uses which reads files of other programs, as `orders` has them for all others."""

from __future__ import annotations

import os

from vidtrack.files.experiment import Experiment, point_tags, tags_of, within
from vidtrack.settings.config import Settings, detect_for
from vidtrack.settings.imported import Tracks
from vidtrack.settings.runs import Run
from vidtrack.workflow.orders import clips_of
from vidtrack.workflow.own_settings import Order, detect_of_clip, recording_of


def import_tracks(settings: Settings, experiment: Experiment, run: str, camera: str) -> Order:
    """What is said of a file of tracks that stands in place of a recording."""
    own, here = settings.runs.get(run, Run()), experiment.runs[run]
    named = own.targets if isinstance(own.targets, tuple) else None
    return {
        "run": run,
        "camera": camera,
        "names": list(named) if named else None,
        "sd": detect_for(settings, own, own.detect)["sd"],
        "tracks": _said_of_tracks(settings, camera, own.tracks),
        "rate": recording_of(settings, here, camera).get("rate"),
        "start_timecode": own.start_timecode,
    }


def import_camera(settings: Settings, camera: str) -> Order:
    """What is said of a camera that another program calibrated."""
    own = settings.cameras[camera]
    file = own.camera_file.model_dump(exclude={"path"}) if own.camera_file else {}
    file = {{"camera": "camera_in_file", "units": "unit_of_file"}.get(key, key): value for key, value in file.items()}
    if file.get("lens"):
        file["lens"] = within(settings.experiment, file["lens"])
    given = {"Cx": own.Cx, "Cy": own.Cy, "sensor": own.sensor}
    return {"camera": camera, "units": settings.units, **file, **given}


def files_of_camera(settings: Settings, experiment: Experiment, camera: str) -> list[str]:
    """What is read of a camera that another program calibrated: its file, OpenPTV's lens beside it, an Argus
    profile."""
    path = experiment.given[camera]
    own = settings.cameras[camera].camera_file
    beside = path[: -len(".ori")] + ".addpar" if path.endswith(".ori") else ""
    lens = within(settings.experiment, own.lens) if own and own.lens else ""
    return [path, *(each for each in (beside, lens) if each and os.path.isfile(each))]


def import_points(settings: Settings, experiment: Experiment, camera: str, after: bool = False) -> Order:
    """What is said of calibration points that another program digitised."""
    clips = clips_of(settings, experiment, camera, after)
    tags = point_tags(experiment)
    sds = {clip: detect_of_clip(settings, clip)["sd"] for clip in clips}
    return {
        "units": settings.units,
        "camera": camera,
        "sigma": settings.calibration.sigma,
        "tracks": _said_of_tracks(settings, camera, None),
        "clips": {clip: {"tags": tags_of(settings, clip, tags), "sd": sds[clip]} for clip in clips},
    }


def _said_of_tracks(settings: Settings, camera: str, of_run: Tracks | None) -> Order:
    """What the config says of a camera's files of tracks; what it says for the run counts first."""
    parts = [part.model_dump() for part in (settings.cameras[camera].tracks, of_run) if part]
    return {key: value for part in parts for key, value in part.items() if value is not None}
