"""Plane interfaces between a camera and what it sees: a window, the water's surface, the wall of a tank.

An interface is one plane, or several parallel ones with layers of known thickness between them. Light meets its planes
in the order in which it comes from the camera, so its indices begin with the medium on the camera's side: air, glass,
water. Which way its normal points does not matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array


@dataclass(frozen=True, eq=False)
class Interface:
    """One or more parallel planes at which light is refracted.

    name       of the interface; its parameters are `<name>.position` and so on
    point      (3,) world units, on the plane that is nearest to the camera
    normal     (3,) of any length and either sign; kept at length 1
    indices    refractive indices of the media from the camera on: one more than there are planes
    thickness  world units, of each layer between two planes
    sigma      standard deviation of each of `parameters` as it is known beforehand; 0: held; empty: all are held
    known      the interface as it is known beforehand, where this one was refined; None: this one
    Raises ValueError for a normal of length 0, indices that no medium has, a thickness below 0, or numbers that do
    not match.
    """

    name: str
    point: Array
    normal: Array
    indices: tuple[float, ...]
    thickness: tuple[float, ...] = ()
    sigma: tuple[float, ...] = ()
    known: Interface | None = None

    def __post_init__(self) -> None:
        point, normal = np.array(self.point, float), np.array(self.normal, float)
        length = float(np.linalg.norm(normal))
        if point.shape != (3,) or normal.shape != (3,) or not (np.isfinite(point).all() and 0 < length < np.inf):
            raise ValueError(f"interface {self.name}: point and normal must be three numbers, the normal not 0")
        if len(self.indices) != len(self.thickness) + 2:
            raise ValueError(
                f"interface {self.name}: {len(self.indices)} indices and {len(self.thickness)} layers between planes; "
                "there are two indices more than layers"
            )
        if not all(0.5 < n < 5 for n in self.indices) or not all(t >= 0 for t in self.thickness):
            raise ValueError(f"interface {self.name}: indices must lie between 0.5 and 5, a thickness at 0 or above")
        if self.sigma and (len(self.sigma) != len(self.parameters) or not all(s >= 0 for s in self.sigma)):
            raise ValueError(f"interface {self.name}: sigma needs {len(self.parameters)} numbers of 0 or more")
        for name, value in (("point", point), ("normal", normal / length)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "indices", tuple(float(n) for n in self.indices))
        object.__setattr__(self, "thickness", tuple(float(t) for t in self.thickness))

    @cached_property
    def axes(self) -> Array:
        """Two unit vectors in the plane, (2, 3), towards which `tilt_1` and `tilt_2` turn the normal."""
        first = np.cross(np.eye(3)[int(np.argmin(np.abs(self.normal)))], self.normal)
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(self.normal, first)])

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """What may be refined. position: world units along the normal; tilt: rad; thickness: world units; index."""
        own = ["position", "tilt_1", "tilt_2"]
        own += [f"thickness_{k + 1}" for k in range(len(self.thickness))]
        own += [f"index_{k + 1}" for k in range(len(self.indices) - 1)]
        return tuple(f"{self.name}.{each}" for each in own)

    @property
    def free(self) -> tuple[str, ...]:
        """The parameters that are refined: those that are not known exactly."""
        return tuple(name for name, s in zip(self.parameters, self.sigma, strict=False) if s > 0)

    @property
    def held(self) -> Interface:
        """The same interface, taken for exact: a fit does not move it."""
        return replace(self, sigma=())

    @property
    def pull(self) -> dict[str, tuple[float, float]]:
        """Of each free parameter, how far what is known lies from here, and its standard deviation."""
        off = -self.deviation(self.known or self)
        each = zip(self.parameters, off.tolist(), self.sigma, strict=False)
        return {name: (shift, s) for name, shift, s in each if s > 0}

    def stepped(self, step: Mapping[str, float]) -> Interface:
        """The interface after small changes of its parameters; other names are passed over."""
        change = np.array([step.get(name, 0.0) for name in self.parameters])
        if not change.any():
            return self
        layers = 3 + len(self.thickness)
        return replace(
            self,
            point=self.point + change[0] * self.normal,
            normal=self.normal + change[1:3] @ self.axes,
            thickness=tuple((np.array(self.thickness) + change[3:layers]).tolist()),
            indices=(self.indices[0], *(np.array(self.indices[1:]) + change[layers:]).tolist()),
            known=self.known or self,
        )

    def deviation(self, other: Interface) -> Array:
        """How far each parameter lies from that of another interface, in the order of `parameters`.

        The planes are compared where the other's point lies.
        """
        turned = self.normal if self.normal @ other.normal > 0 else -self.normal
        position = (self.point - other.point) @ self.normal
        tilt = self.axes @ ((turned - other.normal) * np.sign(self.normal @ turned))
        thickness = np.array(self.thickness) - np.array(other.thickness)
        indices = np.array(self.indices[1:]) - np.array(other.indices[1:])
        return np.concatenate([[position], tilt, thickness, indices])


class Plane(NamedTuple):
    """One plane as light from a camera meets it, and how it follows its interface's parameters.

    normal   points away from the camera
    ratio    index of the medium before it over that behind it
    moves    parameter: (change of point (3,), of normal (3,), of ratio) per unit
    """

    point: Array
    normal: Array
    ratio: float
    moves: dict[str, tuple[Array, Array, float]]


def planes_of(through: Sequence[Interface], centre: ArrayLike) -> list[Plane]:
    """The planes that light meets on its way to a camera at centre (3,), from the camera on."""
    planes: list[Plane] = []
    zero = np.zeros(3)
    for interface in through:
        side = 1.0 if (interface.point - np.asarray(centre, float)) @ interface.normal >= 0 else -1.0
        normal, depth = side * interface.normal, 0.0
        names = interface.parameters
        for k, (before, behind) in enumerate(zip(interface.indices[:-1], interface.indices[1:], strict=True)):
            ratio = before / behind
            moves = {names[0]: (interface.normal, zero, 0.0)}
            for name, axis in zip(names[1:3], interface.axes, strict=True):
                moves[name] = (side * axis * depth, side * axis, 0.0)
            for layer in range(k):
                moves[names[3 + layer]] = (normal, zero, 0.0)
            first_index = 3 + len(interface.thickness)
            if k:
                moves[names[first_index + k - 1]] = (zero, zero, 1 / behind)
            moves[names[first_index + k]] = (zero, zero, -ratio / behind)
            planes.append(Plane(interface.point + normal * depth, normal, ratio, moves))
            depth += interface.thickness[k] if k < len(interface.thickness) else 0.0
    return planes


def free_of(through: Sequence[Interface]) -> tuple[str, ...]:
    """The parameters of several interfaces that are refined."""
    return tuple(name for interface in through for name in interface.free)


def pulls_of(through: Sequence[Interface]) -> dict[str, tuple[float, float]]:
    """What is known beforehand of them: see `Interface.pull`."""
    return {name: pull for interface in through for name, pull in interface.pull.items()}


def parameters_of(through: Sequence[Interface]) -> tuple[str, ...]:
    """The parameters of several interfaces, one interface after the other."""
    return tuple(name for interface in through for name in interface.parameters)
