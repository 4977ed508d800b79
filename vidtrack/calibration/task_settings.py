"""From what the config says of a calibration to the task that `one_camera` does; contradictions are refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.calibration.camera.initial_fit import Nominal
from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.calibration.camera.one_camera import Task
from vidtrack.calibration.camera.refine import POSE, free_parameters
from vidtrack.calibration.refraction.interfaces import interfaces_from_settings
from vidtrack.errors import VidtrackError
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.lens_terms import COEFFICIENTS, LENS_MODELS, RICHEST

Prior = Mapping[str, tuple[float, float]]
Fix = Mapping[str, float | None] | Sequence[str]


def task_from_settings(
    where: str,
    image_size: tuple[int, int],
    Cx: float | None,
    Cy: float | None,
    sensor: tuple[float, float] | None,
    model: str,
    refine: str,
    fix: Fix,
    prior: Prior | None,
    reject: str = "auto",
    through: Sequence[Mapping[str, Any]] = (),
    units: str = "mm",
    lens: KnownLens | None = None,
) -> Task:
    """The task that the settings describe. VidtrackError, a line a problem, where they contradict each other."""
    if lens is not None:
        return _with_lens(
            where, lens, refine, fix, prior or {}, reject, interfaces_from_settings(where, through, units)
        )
    nominal = Nominal.of(image_size, Cx, Cy, sensor, interfaces_from_settings(where, through, units))
    priors = {name: (float(mean), float(sd)) for name, (mean, sd) in (prior or {}).items()}
    task = Task(nominal, model, refine, _fixed(where, fix, nominal), priors, reject != "off")
    if problems := _unfit_settings(task):
        raise VidtrackError(*(f"{where}: {problem}" for problem in problems))
    return task


def _with_lens(
    where: str, lens: KnownLens, refine: str, fix: Fix, prior: Prior, reject: str, through: tuple[Interface, ...]
) -> Task:
    """The task of placing a camera whose lens is known; what calibration.fix gives a value has that instead."""
    problems = []
    if refine in ("linear", "centre"):
        problems.append(
            f"{where}: calibration.lens: the closed form takes no known lens. Set calibration.refine: full."
        )
    if prior:
        problems.append(f"{where}: a prior beside a known lens. Remove calibration.prior or calibration.lens.")
    if problems:
        raise VidtrackError(*problems)
    given = dict(fix) if isinstance(fix, Mapping) else dict.fromkeys(fix)
    camera = lens.camera.with_(**{name: float(value) for name, value in given.items() if value is not None})
    camera = camera.with_(through=through)
    keep = [i for i, name in enumerate(lens.names) if name not in given]
    covariance = None if lens.covariance is None or not keep else lens.covariance[np.ix_(keep, keep)]
    lens = lens._replace(camera=camera, names=tuple(lens.names[i] for i in keep), covariance=covariance)
    nominal = Nominal(camera.Cx, camera.Cy, camera.dx, camera.dy, camera.image_size, through)
    inner = [name for name in free_parameters(lens.model) if name not in POSE]
    fixed = {name: float(getattr(camera, name)) for name in inner}
    return Task(nominal, lens.model, refine, fixed, {}, reject != "off", lens)


def _fixed(where: str, fix: Fix, nominal: Nominal) -> dict[str, float]:
    given = dict(fix) if isinstance(fix, Mapping) else dict.fromkeys(fix)
    default = {"Sx": 1.0, "Cx": nominal.Cx, "Cy": nominal.Cy, **dict.fromkeys(COEFFICIENTS, 0.0)}
    values: dict[str, float] = {}
    for name, value in given.items():
        if value is None and name not in default:
            cure = "Give it one: fix: {f: 12.5}." if name == "f" else f"Known are {', '.join([*default, 'f'])}."
            raise VidtrackError(f"{where}: calibration.fix: {name} has no value to be held at. {cure}")
        values[name] = default[name] if value is None else float(value)
    return values


def _unfit_settings(task: Task) -> list[str]:
    """Settings that contradict each other, a line each."""
    if task.model not in (*LENS_MODELS, "auto"):
        return [f"calibration.model: {task.model!r} is not {', '.join(LENS_MODELS)} or auto."]
    if task.refine not in ("linear", "centre", "full", "bundle"):
        return [f"calibration.refine: {task.refine!r} is not linear, centre, full or bundle."]
    problems = []
    if task.closed:
        if task.model not in ("tsai", "auto"):
            problems.append(f"model {task.model} has no closed form. Set calibration.refine: full, or model: tsai.")
        if others := sorted(set(task.fixed) - {"Sx", "Cx", "Cy", "kappa1"}):
            problems.append(f"the closed form cannot hold {', '.join(others)}. Set calibration.refine: full.")
        if task.priors:
            problems.append("the closed form takes no prior. Set calibration.refine: full, or drop calibration.prior.")
        return problems
    free = free_parameters(RICHEST if task.model == "auto" else task.model, tuple(task.fixed))
    for name in task.priors:
        if name not in free:
            why = "is held by calibration.fix" if name in task.fixed else f"is no parameter of model {task.model}"
            problems.append(f"calibration.prior: {name} {why}. Remove the prior, or free the parameter.")
    return problems
