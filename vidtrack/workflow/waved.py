"""Which clips show a wand and which cameras film it."""

from __future__ import annotations

from vidtrack.files.experiment import Experiment
from vidtrack.settings.config import Settings


def wand_clips(settings: Settings) -> tuple[str, ...]:
    """The clips of a wand, and of a ball that is dropped; they show no surveyed points."""
    return settings.calibration.wand.clips if settings.calibration.wand else ()


def wand_cameras(settings: Settings, experiment: Experiment) -> list[str]:
    """The cameras that film the wand."""
    own = settings.calibration.wand
    return list(experiment.clips[own.clip].videos) if own and own.clip in experiment.clips else []
