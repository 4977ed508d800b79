"""Exactly the settings that the rules of a wand use: see `orders`."""

from __future__ import annotations

from vidtrack.files.experiment import Experiment
from vidtrack.settings.config import Settings, detect_for
from vidtrack.workflow.orders import clips_of, fix_of, prior_of
from vidtrack.workflow.own_settings import Order, clock_of, recording_of, without_colour
from vidtrack.workflow.waved import wand_cameras


def track_wand(settings: Settings, experiment: Experiment, clip: str, camera: str) -> Order:
    """How the balls of the wand, or the one that is dropped, are followed in one camera."""
    own = settings.calibration.wand
    assert own is not None, "the rule exists only where the config has a wand"
    here = settings.calibration.clips.get(clip)
    changes = [own.detect, here, here.detect] if here else [own.detect]
    return {
        "run": clip,
        "camera": camera,
        "detect": without_colour(detect_for(settings, *changes)),
        "targets": own.balls if clip == own.clip else 1,
        "start_timecode": None,
        "recording": recording_of(settings, experiment.clips[clip], camera),
    }


def model_of(settings: Settings, cameras: list[str]) -> str:
    """The lens model of all cameras of a wand: their own, where they name one (the same: see `experiment_checks`)."""
    return next((own for c in cameras if (own := settings.cameras[c].calibration.model)), settings.calibration.model)


def wand(settings: Settings, experiment: Experiment) -> Order:
    """How the cameras that film a wand are calibrated by it."""
    own = settings.calibration.wand
    assert own is not None, "the rule exists only where the config has a wand"
    cameras = wand_cameras(settings, experiment)
    pointed = [c for c in cameras if clips_of(settings, experiment, c) and experiment.points]
    axes = own.axes if own.axes is None or isinstance(own.axes, str) else own.axes.model_dump(exclude={"drop"})
    rolling = {c: ms for c in cameras if (ms := settings.cameras[c].readout_ms) is not None}
    return {
        "units": settings.units,
        "clip": own.clip,
        "cameras": {
            c: {
                "Cx": settings.cameras[c].Cx,
                "Cy": settings.cameras[c].Cy,
                "sensor": settings.cameras[c].sensor,
                "fix": fix_of(settings, c),
                "prior": prior_of(settings, c),
                "clock": clock_of(settings, c),
            }
            for c in cameras
        },
        "model": model_of(settings, cameras),
        "lengths": own.lengths,
        "sigma": own.sigma,
        "axes": axes,
        "surveyed": pointed,
        "bare": [c for c in cameras if not clips_of(settings, experiment, c)],
        "drop_cameras": [c for c in cameras if own.drop and c in experiment.clips[own.drop].videos],
        **({"readout_ms": rolling} if rolling else {}),
    }
