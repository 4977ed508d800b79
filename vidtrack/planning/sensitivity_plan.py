"""A sensitivity scenario, written as YAML: a rig on paper and what to vary in it. data/sensitivity/thesis.yaml is one.

Cameras and calibration points are written as in the simulator's scenarios, so that one rig can be both predicted and
rendered. `sweeps` names entries by their path, one at a time, each with the values that it takes:

    sweeps:
      cameras.*.distance: [120, 160, 200]       # * stands for every camera
      camera_count: [2, 3, 4]                   # the first so many of the cameras
      calibration.points.spacing: [[9, 2, 3], [18, 4, 6]]
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from vidtrack.arrays import Array
from vidtrack.calibration.assessment.field_of_view import pixels_across
from vidtrack.calibration.assessment.prediction import Case, Layout
from vidtrack.calibration.assessment.target_design import SYSTEMATIC_PX, centroid_noise
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import COEFFICIENTS
from vidtrack.simulate.control_points import ControlPoints, tags_and_places
from vidtrack.simulate.plan import NotNegative, Plan, Positive, Vector, plan_from
from vidtrack.simulate.scenario import CameraPlan, Survey, camera_from_plan

Count = Annotated[int, Field(ge=1)]


class Light(Plan):
    """How well targets stand out, and how their centroids are found."""

    contrast: Positive = Field(200.0, description="grey levels of a target above the background")
    noise: NotNegative = Field(3.0, description="grey levels, standard deviation of a pixel")
    centroid: Literal["weighted", "binary"] = "weighted"
    systematic_px: NotNegative = Field(SYSTEMATIC_PX, description="px, error of a centroid that no averaging removes")
    centroid_px: Positive | None = Field(None, description="px, centroid noise, if it is known; overrides all above")


class Points(Plan):
    """The calibration points, and how the cameras are calibrated with them."""

    points: ControlPoints = Field(description="wires, or tag: [x, y, z]")
    diameter: Positive = 2.0
    frames: Count = Field(20, description="frames averaged for each calibration point")
    survey: Survey = Survey()
    model: Literal["tsai", "tsai2", "tsai3", "brown", "affine", "prism"] = "tsai"
    refine: Literal["full", "bundle"] = "full"
    fix: tuple[str, ...] = ()


class Volume(Plan):
    """Where the targets will be: a box, by default that of the calibration points."""

    low: Vector | None = None
    high: Vector | None = None
    samples: Annotated[int, Field(ge=1, le=100)] = Field(7, description="places along each axis")


class RigPlan(Plan):
    """A rig on paper."""

    units: Literal["m", "cm", "mm", "in", "ft"] = "in"
    cameras: Annotated[dict[str, CameraPlan], Field(min_length=2)]
    camera_count: Count | None = Field(None, description="only the first so many of the cameras; default: all")
    calibration: Points
    volume: Volume = Volume()
    diameter: Positive = Field(2.0, description="world units, of the moving targets")
    light: Light = Light()
    trials: Annotated[int, Field(ge=0)] = Field(0, description="simulated calibrations of each case that check it")
    seed: Annotated[int, Field(ge=0)] = 1
    sweeps: dict[str, list[Any]] = Field({}, description="path of an entry: the values that it takes")


def read_sensitivity(path: str) -> tuple[RigPlan, list[Case]]:
    """The plan at `path` and its cases, the rig as planned first; VidtrackError with every problem."""
    return sensitivity_cases(read_config(path), path)


def sensitivity_cases(values: Mapping[str, Any], where: str = "scenario") -> tuple[RigPlan, list[Case]]:
    """The plan that parsed YAML means and its cases: as planned, then each sweep's values."""
    plan = plan_from(RigPlan, values, where)
    cases = [case_from_plan(plan, "", "as planned", where)]
    for path, options in plan.sweeps.items():
        for option in options:
            varied = changed(values, path, option, where)
            place = f"{where}: sweeps.{path}: {option}"
            cases.append(case_from_plan(plan_from(RigPlan, varied, place), path, option, place))
    return plan, cases


def changed(values: Mapping[str, Any], path: str, option: Any, where: str) -> dict[str, Any]:
    """The plan's values with the entry at a dotted path set; `*` stands for every key at its place.

    An entry that the plan leaves at its default may be set too; a part on the way to it that is missing is made.
    Raises VidtrackError for a path that leads through something that has no parts.
    """
    varied: dict[str, Any] = copy.deepcopy({key: entry for key, entry in values.items() if key != "sweeps"})
    *way, last = path.split(".")
    places: list[dict[str, Any]] = [varied]
    for depth, part in enumerate(way):
        below = [place.setdefault(key, {}) for place in places for key in (list(place) if part == "*" else [part])]
        if way[0] == "cameras" and depth == 1 and not all(below):
            cameras = ", ".join(key for key, entry in places[0].items() if entry)
            raise VidtrackError(f"{where}: sweeps.{path}: no camera {part!r}. There are {cameras}, or * for all.")
        if not all(isinstance(place, dict) for place in below):
            raise VidtrackError(f"{where}: sweeps.{path}: {part} has no parts. Name an entry of the plan.")
        places = below
    for place in places:
        for key in list(place) if last == "*" else [last]:
            place[key] = copy.deepcopy(option)
    return varied


def case_from_plan(plan: RigPlan, sweep: str, value: Any, where: str) -> Case:
    """The rig that a plan describes, as the sensitivity stage takes it."""
    chosen = list(plan.cameras.items())[: plan.camera_count]
    if len(chosen) < 2 or len(chosen) < (plan.camera_count or 0):
        raise VidtrackError(
            f"{where}: camera_count is {plan.camera_count}; the plan has {len(plan.cameras)}. Take 2 or more."
        )
    try:
        cameras = [camera_from_plan(camera, name) for name, camera in chosen]
    except ValueError as error:
        raise VidtrackError(f"{where}: cameras: {error}. Move the camera or its target.") from None
    how = plan.calibration
    p = tags_and_places(how.points)[1]
    if not len(p):
        raise VidtrackError(f"{where}: calibration.points: there is none. Give wires, or tag: [x, y, z].")
    q = _volume(plan.volume, p, where)
    unknown = set(how.fix) - {"f", "Sx", "Cx", "Cy", *COEFFICIENTS}
    if unknown:
        raise VidtrackError(
            f"{where}: calibration.fix: no parameter {min(unknown)!r}. There are f, Sx, Cx, Cy, kappa1."
        )
    layout = Layout(
        cameras=cameras,
        p=p,
        q=q,
        sigma=how.survey.error / (np.sqrt(3) if how.survey.distribution == "uniform" else 1),
        calibration_sd=_noise(plan, cameras, p, how.diameter, how.frames),
        target_sd=_noise(plan, cameras, q, plan.diameter, 1),
        free=[free_parameters(how.model, how.fix)] * len(cameras),
        refine=how.refine,
    )
    return Case(sweep, value, layout, plan.diameter, how.survey.distribution == "uniform")


def _volume(volume: Volume, p: Array, where: str) -> Array:
    """Places (samples^3, 3) on a grid, at the middles of equal cells: no place on the very edge."""
    low = np.array(volume.low if volume.low is not None else p.min(0), float)
    high = np.array(volume.high if volume.high is not None else p.max(0), float)
    if not (high >= low).all():
        raise VidtrackError(f"{where}: volume: low {low.tolist()} is above high {high.tolist()}. Swap them.")
    steps = (np.arange(volume.samples) + 0.5) / volume.samples
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    return np.unique(low + grid * (high - low), axis=0)


def _noise(plan: RigPlan, cameras: list[Camera], p: Array, diameter: float, frames: int) -> Array:
    """Centroid noise (m,), px, at the mean size that targets at p have in each picture."""
    light = plan.light
    if light.centroid_px is not None:
        return np.full(len(cameras), light.centroid_px)
    each = [pixels_across(camera, p, diameter) for camera in cameras]
    # a camera that sees no target has no noise; the prediction shows that it sees none
    across = np.array([np.nanmean(a) if np.isfinite(a).any() else np.nan for a in each])
    return centroid_noise(
        across,
        contrast=light.contrast,
        noise=light.noise,
        frames=frames,
        centroid=light.centroid,
        systematic_px=light.systematic_px,
    )
