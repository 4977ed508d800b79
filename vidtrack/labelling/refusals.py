"""Clips of a camera in which nothing can be named: of other sizes, or without any ball."""

from __future__ import annotations

from collections.abc import Mapping

from vidtrack.errors import VidtrackError
from vidtrack.labelling.shot import Shot
from vidtrack.tracking.detection.blobs import find_blobs


def common_size(shots: Mapping[str, Shot], camera: str) -> tuple[int, int]:
    """px, (width, height) of all shots; VidtrackError, a line a clip, where they differ."""
    sizes = {clip: shot.still.mean.shape[::-1] for clip, shot in shots.items()}
    first, size = next(iter(sizes.items()))
    problems = [
        f"calibration/{clip}: camera {camera} has {own[0]} x {own[1]} px here, but {size[0]} x {size[1]} in {first}. "
        "Use clips of one size."
        for clip, own in sizes.items()
        if own != size
    ]
    if problems:
        raise VidtrackError(*problems)
    return int(size[0]), int(size[1])


def refuse_empty(shots: Mapping[str, Shot], camera: str) -> None:
    """VidtrackError, a line a clip, where no blob was found, with the settings that would find some."""
    problems = []
    for clip, shot in shots.items():
        if len(shot.at):
            continue
        polarity, threshold = shot.settings.get("polarity", "bright"), shot.settings.get("threshold", "auto")
        other = {"bright": "dark", "dark": "bright"}[polarity]
        cure = "Is it the right clip, and was the light on?"
        for change in ({"threshold": "auto"}, {"threshold": "auto", "polarity": other}):
            seen = len(find_blobs(shot.still.mean, **{**shot.settings, **change}).Xf)
            if seen:
                cure = " with ".join(f"{name}: {value}" for name, value in change.items()) + f" finds {seen}."
                break
        problems.append(
            f"calibration/{clip}: no {polarity} ball in the picture of camera {camera} at threshold {threshold}. {cure}"
        )
    if problems:
        raise VidtrackError(*problems)
