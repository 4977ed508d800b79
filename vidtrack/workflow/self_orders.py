"""Which runs and cameras take part in self-calibration, and exactly the settings that its rules use: see `orders`."""

from __future__ import annotations

from vidtrack.files.experiment import Experiment
from vidtrack.settings.config import Settings
from vidtrack.workflow import orders
from vidtrack.workflow.orders import Order


def self_runs(settings: Settings, experiment: Experiment) -> list[str]:
    """The runs in which the body floats that refines the cameras; none where the config asks for no such thing."""
    own = settings.calibration.self_calibration
    if own is None:
        return []
    named = own.runs or tuple(name for name, run in settings.runs.items() if own.body in run.bodies)
    return [name for name in named if name in experiment.runs]


def self_cameras(settings: Settings, experiment: Experiment) -> list[str]:
    """The cameras of these runs, in the order of the config."""
    there = {c for run in self_runs(settings, experiment) for c in experiment.runs[run].videos}
    return [camera for camera in settings.cameras if camera in there]


def body_sights(settings: Settings, experiment: Experiment, run: str) -> Order:
    """How the targets of a run are located by the cameras as they are before a body refines them."""
    return orders.locate(settings, experiment, run)


def self_calibrate(settings: Settings, experiment: Experiment) -> Order:
    """How a body refines the cameras."""
    own = settings.calibration.self_calibration
    assert own is not None, "the rule exists only where the config names a body"
    runs = self_runs(settings, experiment)
    targets: Order = {}
    for run in runs:
        targets |= settings.runs[run].bodies[own.body].targets
    return {
        "units": settings.units,
        "body": own.body,
        "sigma": own.sigma,
        "runs": runs,
        "cameras": self_cameras(settings, experiment),
        "targets": targets,
    }
