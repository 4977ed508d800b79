"""Cameras whose lenses and places to each other are known, but not where in the world they stand together.

A board that several cameras saw at once gives all of this but six numbers, the motion of the whole; of its scale it
knows what its maker does. The known covariance is whitened, and the directions in which the whole moves are taken out
of the whitened equations: what is left says nothing of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.measurements import POSE, KnownCameras
from vidtrack.calibration.adjustment.normal_equations import Equations
from vidtrack.calibration.adjustment.unknowns import State, Unknowns
from vidtrack.geometry.camera import Camera


@dataclass(frozen=True, eq=False)
class TiedCameras:
    """What is known of cameras' lenses and of their places to each other.

    cameras     in the order of those of the adjustment, in any world of the same scale
    names       for each camera the parameters that are known, all six of its pose among them; empty: it is not tied
    pivot       (3,) about which omega turn, in that world
    covariance  (K', K')
    scale_sd    share, how well the scale of that world is known
    """

    cameras: Sequence[Camera]
    names: Sequence[Sequence[str]]
    pivot: Array
    covariance: Array
    scale_sd: float = 0.0
    noise: str = ""

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        first = next(i for i, names in enumerate(self.names) if names)
        R, t = world_motion(self.cameras[first], state.cameras[first])
        moved = [moved_camera(camera, R, t) for camera in self.cameras]
        pivot = R @ self.pivot + t
        C = np.asarray(self.covariance, float)
        if self.scale_sd:
            scaled = np.concatenate(
                [
                    [by[name] if name in POSE else 0.0 for name in names]
                    for camera, names in zip(moved, self.names, strict=True)
                    if names
                    for by in [_steps(camera, pivot)[6]]
                ]
            )
            C = C + self.scale_sd**2 * np.outer(scaled, scaled)
        known = KnownCameras(moved, self.names, pivot, C).equations(state, unknowns)
        directions = np.zeros((unknowns.size, 6))
        for i, (camera, names) in enumerate(zip(state.cameras, self.names, strict=True)):
            if names:
                own, place = unknowns.free[i], unknowns.cameras[i][0].start
                for k, step in enumerate(_steps(camera, unknowns.pivot)[:6]):
                    for name in POSE:
                        directions[place + own.index(name), k] = step[name]
        whole, _ = np.linalg.qr(known.by_shared[0] @ directions[known.columns])
        residual = known.residual[0] - whole @ (whole.T @ known.residual[0])
        by_shared = known.by_shared[0] - whole @ (whole.T @ known.by_shared[0])
        return known._replace(residual=residual[None], by_shared=by_shared[None])


def tied_from_record(tie: Mapping[str, Any], boards: Mapping[str, Camera], names: Sequence[str]) -> TiedCameras:
    """What a board says of those of the cameras that it ties, in the order of `names`.

    tie     of boards.json: cameras, names, pivot, covariance, scale_sd
    boards  by name the cameras that it names, in the board's world
    """
    edges = np.cumsum([0, *map(len, tie["names"])])
    order = [(name, tie["cameras"].index(name)) for name in names if name in tie["cameras"]]
    columns = [k for _, i in order for k in range(edges[i], edges[i + 1])]
    own = {name: tuple(tie["names"][i]) for name, i in order}
    return TiedCameras(
        [boards[name] if name in own else next(iter(boards.values())) for name in names],
        [own.get(name, ()) for name in names],
        np.array(tie["pivot"], float),
        np.array(tie["covariance"], float)[np.ix_(columns, columns)],
        float(tie["scale_sd"]),
    )


def world_motion(then: Camera, now: Camera) -> tuple[Array, Array]:
    """R (3, 3) and t (3,) that carry points of one world to another in which the camera stands otherwise."""
    return now.R.T @ then.R, now.R.T @ (then.T - now.T)


def moved_camera(camera: Camera, R: Array, t: Array) -> Camera:
    """The camera in a world to which points go as R p + t."""
    turned = camera.R @ R.T
    return camera.with_(R=turned, T=camera.T - turned @ t)


def _steps(camera: Camera, pivot: Array) -> list[dict[str, float]]:
    """The steps of a camera's pose (see `jacobian.stepped`) where the world turns about each axis through the pivot,
    shifts along it, and grows about the pivot.

    x -> x + w x (x - pivot) + v: the attitude turns by R w, the pivot moves by R v; grown, the camera is R pivot + T
    times as far from it.
    """
    steps = [(camera.R[:, k], np.zeros(3)) for k in range(3)] + [(np.zeros(3), camera.R[:, k]) for k in range(3)]
    steps.append((np.zeros(3), camera.R @ pivot + camera.T))
    return [dict(zip(POSE, (*turn.tolist(), *shift.tolist()), strict=True)) for turn, shift in steps]
