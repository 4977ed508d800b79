"""Which projection a wand's cameras have: perspective, or equidistant for wide lenses; by moments left out."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vidtrack.calibration.wand.refined import LADDER, Refined
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import EQUIDISTANT
from vidtrack.geometry.projection import Projection


class ProjectionSettings(NamedTuple):
    """When a second projection is tried."""

    wide_deg: float = 70.0
    """Width of the picture of a perspective lens from which the other projection is tried too."""
    misfit: float = 1.5
    """Residuals of the sights over their noise, from which the other projection is tried too."""


SETTINGS = ProjectionSettings()

Solved = Callable[[Projection, tuple[str, ...]], Refined]


def by_projection(solved: Solved, model: str) -> Refined:
    """The wand's cameras, by a model of the config, or by the projection that predicts moments left out best.

    solved  the cameras of one projection, whose lens is the best of some models
    Raises ValueError, the first projection's, where none gives cameras.
    """
    if model in EQUIDISTANT:
        return solved("equidistant", (model,))
    if model != "auto":
        return solved("perspective", (model,))
    plain: Refined | None = None
    problem: ValueError | None = None
    try:
        plain = solved("perspective", LADDER)
    except ValueError as error:
        problem = error
    if plain is not None and not _doubtful(plain):
        return plain
    try:
        wide = solved("equidistant", EQUIDISTANT)
    except ValueError:
        wide = None
    if plain is None and wide is None:
        assert problem is not None
        raise problem
    return min((each for each in (plain, wide) if each is not None), key=_held_out)


def _doubtful(done: Refined) -> bool:
    loose = done.found.factors.get("px", 1.0) > SETTINGS.misfit
    return loose or any(_width_deg(camera) > SETTINGS.wide_deg for camera in done.cameras)


def _width_deg(camera: Camera) -> float:
    return float(2 * np.degrees(np.arctan(camera.image_size[0] * camera.dx / 2 / camera.f)))


def _held_out(done: Refined) -> float:
    return next((rung.held_out for rung in done.rungs if rung.model == done.model), np.inf)
