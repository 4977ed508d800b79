"""Whether a run's pictures are those of the calibration: scaled, of another shape, turned, or with other pixels."""

from __future__ import annotations

from collections.abc import Mapping

from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.picture_part import Picture, window
from vidtrack.settings.config import Settings
from vidtrack.timing.frame import VideoInfo
from vidtrack.workflow.own_settings import crop_of


def picture_of(info: VideoInfo) -> Picture:
    """A recording's picture, as a player turns it."""
    return Picture(info.width, info.height, info.sample_aspect, info.rotation)


def other_pictures(
    settings: Settings, run: str, calibrated: Mapping[str, Picture], recorded: Mapping[str, VideoInfo]
) -> list[Finding]:
    """What the run would say of pictures that are not the calibration's, or refuse (level failed).

    calibrated, recorded   by camera; those that are in one of them alone are passed over
    """
    found: list[Finding] = []
    for camera, info in recorded.items():
        if camera not in calibrated:
            continue
        crop = crop_of(settings, run, camera)
        try:
            found += window(calibrated[camera], picture_of(info), crop, camera=camera, where=f"runs/{run}")[1]
        except VidtrackError as error:
            found += [Finding("failed", "recording-refused", problem) for problem in error.problems]
    return found
