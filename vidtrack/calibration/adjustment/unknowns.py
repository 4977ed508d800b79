"""What an adjustment looks for: parameters of cameras, named parameters that all share, and families of blocks.

The K shared unknowns are ordered: the free parameters of each camera in turn (in the order of
`geometry.jacobian.PARAMETERS`), then the named ones (wand lengths, a board's bending, an interface, clock offsets).
Blocks are many and small, and no measurement depends on two of them: points, wands, poses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.normal_equations import Prior
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import PARAMETERS, stepped
from vidtrack.geometry.rotation import rotation_from_vector

Names = Sequence[Sequence[str]]
Known = Mapping[str, tuple[float, float]]
"""Of some parameters by name: (mean, standard deviation)."""


class State(NamedTuple):
    """Present values of all unknowns."""

    cameras: tuple[Camera, ...]
    shared: Mapping[str, float]  # of the named parameters; those that are no unknown keep their value
    blocks: tuple[Any, ...]  # for each family whatever its `moved` understands; points: (n, d)


class Family(NamedTuple):
    """Blocks of one kind.

    size   d, unknowns a block
    known  (n, d) and (n, d): the mean, and one over the variance, of each unknown beforehand (0: nothing, inf: held)
    moved  (values, step (n, d)) -> values; default: the values are (n, d) and steps are added
    minus  (mean, values) -> (n, d), what is known minus the present values; default: the difference
    """

    size: int
    mean: Any
    information: Array
    moved: Callable[[Any, Array], Any] = lambda values, step: values + step
    minus: Callable[[Any, Any], Array] = lambda mean, values: mean - values

    def prior(self, values: Any) -> Prior:
        return Prior(self.information, self.minus(self.mean, values))


def free_blocks(values: Array) -> Family:
    """Blocks (n, d) of which nothing is known beforehand."""
    return Family(values.shape[1], values, np.zeros(values.shape))


def pose_blocks(n: int) -> Family:
    """n poses, each R (3, 3) and T (3,) as an array (n, 3, 4), of which nothing is known beforehand.

    A step is (omega, t): R becomes exp(omega) R and T becomes T + t, so that x = R p + T moves by omega x (R p) + t.
    """
    return Family(6, np.zeros((n, 6)), np.zeros((n, 6)), moved_poses, lambda mean, values: mean)


def moved_poses(values: Array, step: Array) -> Array:
    """Poses (n, 3, 4) after steps (n, 6) of rotation and translation: see `pose_blocks`."""
    turns = np.stack([rotation_from_vector(omega) for omega in step[:, :3]]) if len(step) else np.zeros((0, 3, 3))
    return np.concatenate([turns @ values[..., :3], values[..., 3:] + step[:, 3:, None]], -1)


def points_of_poses(values: Array, p: ArrayLike) -> tuple[Array, Array]:
    """World points (n, q, 3) of a body's points p (q, 3) or (n, q, 3), and their derivatives (n, q, 3, 6) by a step."""
    arm = np.asarray(p, float) @ values[..., :3].swapaxes(-1, -2)
    J = np.zeros((*arm.shape, 6))
    J[..., 0, 1], J[..., 0, 2] = arm[..., 2], -arm[..., 1]
    J[..., 1, 0], J[..., 1, 2] = -arm[..., 2], arm[..., 0]
    J[..., 2, 0], J[..., 2, 1] = arm[..., 1], -arm[..., 0]
    J[..., range(3), range(3, 6)] = 1
    return arm + values[..., None, :, 3], J


class Unknowns:
    """Which parameters are sought, and where each stands among the K shared ones.

    free    for each camera the names of its free parameters
    pivot   (3,)  about which the cameras' omega turn
    shared  names of the shared parameters that are free, those of interfaces (`Interface.parameters`) among them
    Raises ValueError for a name that is no parameter of a camera.
    """

    def __init__(self, free: Names, pivot: ArrayLike, shared: Sequence[str] = ()) -> None:
        self.pivot = np.asarray(pivot, float)
        self.shared = tuple(shared)
        self.free = tuple(tuple(sorted(names, key=_rank)) for names in free)
        self.cameras = columns(self.free)
        start = self.cameras[-1][0].stop if self.cameras else 0
        self.size = start + len(self.shared)
        self._place = {name: start + i for i, name in enumerate(self.shared)}

    def of_camera(self, i: int) -> tuple[NDArray[np.intp], list[int]]:
        """Columns of camera i's free parameters, and which of PARAMETERS they are."""
        place, parameters = self.cameras[i]
        return np.arange(place.start, place.stop), parameters

    def of_shared(self, *names: str) -> NDArray[np.intp]:
        """Columns of those of the named parameters that are free."""
        return np.array([self._place[name] for name in names if name in self._place], int)

    def stepped(self, state: State, families: Sequence[Family], step: Array, blocks: Sequence[Array]) -> State:
        """The state after a step of all unknowns. Raises ValueError for a camera that cannot be (f <= 0)."""
        interfaces = {name: float(step[k]) for name, k in self._place.items() if name not in state.shared}
        cameras = tuple(
            stepped(camera, self.pivot, interfaces | dict(zip(names, step[place].tolist(), strict=True)))
            for camera, names, (place, _) in zip(state.cameras, self.free, self.cameras, strict=True)
        )
        shared = dict(state.shared)
        for name, k in self._place.items():
            if name in shared:  # the others are parameters of the cameras' interfaces
                shared[name] += float(step[k])
        moved = [f.moved(values, s) for f, values, s in zip(families, state.blocks, blocks, strict=True)]
        return State(cameras, shared, tuple(moved))


def _rank(name: str) -> int:
    return PARAMETERS.index(name) if name in PARAMETERS else len(PARAMETERS)


def columns(free: Names) -> list[tuple[slice, list[int]]]:
    """Where each camera's free parameters stand among the K shared ones, and which of PARAMETERS they are.

    Raises ValueError for a name that is no parameter.
    """
    places, start = [], 0
    for names in free:
        unknown = [name for name in names if name not in PARAMETERS]
        if unknown:
            raise ValueError(f"{unknown[0]} is no camera parameter; they are {', '.join(PARAMETERS)}")
        places.append((slice(start, start + len(names)), [PARAMETERS.index(name) for name in names]))
        start += len(names)
    return places
