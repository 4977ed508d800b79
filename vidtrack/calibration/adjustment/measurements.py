"""What is measured, each with its derivatives: sights of points, lengths, and what is known beforehand.

Any object with `noise` and `equations(state, unknowns)` is a measurement to `adjust`; those of a board or an interface
live with their own modules and are built alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.normal_equations import Equations
from vidtrack.calibration.adjustment.unknowns import Known, State, Unknowns
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import parameters_of, pulls_of
from vidtrack.geometry.jacobian import PARAMETERS, derivatives
from vidtrack.geometry.jacobian import columns as columns_of

POSE = PARAMETERS[:6]


class Measurement(Protocol):
    """Measurements of one kind, of a family of blocks or of shared parameters alone."""

    @property
    def noise(self) -> str:
        """The group whose standard deviations are right but for one factor, found by `adjust`; "": they are right."""
        ...

    def equations(self, state: State, unknowns: Unknowns) -> Equations: ...


class PointsOf(NamedTuple):
    """World points of every block, and what they follow."""

    p: Array  # (n, q, 3)
    by_block: Array  # (n, q, 3, d)
    by_shared: Mapping[str, Array] = {}  # (n, q, 3) of named parameters: a board's scale, its bending


Points = Callable[[State], PointsOf]


@dataclass(frozen=True, eq=False)
class Sights:
    """What camera i sees of q points of every block.

    b       (n, q, 2)  measured, px; NaN where the camera lacks a point
    sd      px, whatever spreads to (n, q, 2)
    family  which family of blocks the points belong to
    points  the points of every block; default: the blocks are (n, 3 q), their coordinates one after the other
    """

    camera: int
    b: Array
    sd: Array | float
    family: int = 0
    points: Points | None = None
    noise: str = "px"
    weight: Array = field(init=False)

    def __post_init__(self) -> None:
        variance = np.broadcast_to(np.asarray(self.sd, float), self.b.shape) ** 2
        seen = np.asarray(np.isfinite(self.b).all(-1))
        weight = np.where(~seen[..., None], 0.0, 1 / variance)
        object.__setattr__(self, "weight", weight.reshape(len(self.b), -1))

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        n, q = self.b.shape[:2]
        of = None if self.points is None else self.points(state)
        p = state.blocks[self.family].reshape(n, q, 3) if of is None else of.p
        at = derivatives(state.cameras[self.camera], p, unknowns.pivot)
        columns, parameters = unknowns.of_camera(self.camera)
        by_shared = [at.by_parameter[..., parameters]]
        camera = state.cameras[self.camera]
        if interfaces := [name for name in parameters_of(camera.through) if name in unknowns.shared]:
            columns = np.concatenate([columns, unknowns.of_shared(*interfaces)])
            by_shared.append(at.by_parameter[..., columns_of(camera, interfaces)])
        if of is None:
            by_block = spread_over_block(at.by_point)
        else:
            names = [name for name in of.by_shared if name in unknowns.shared]
            columns = np.concatenate([columns, unknowns.of_shared(*names)])
            by_shared += [at.by_point @ of.by_shared[name][..., None] for name in names]
            by_block = (at.by_point @ of.by_block).reshape(n, 2 * q, -1)
        left = (self.b - at.projected).reshape(n, -1)
        together = np.concatenate(by_shared, -1).reshape(n, 2 * q, -1)
        return Equations(left, self.weight, columns, together, self.family, by_block)


def spread_over_block(by_point: Array) -> Array:
    """Derivatives (n, r q, 3 q) by blocks of q points, from those (n, q, r, 3) of r numbers of each point."""
    n, q, r, _ = by_point.shape
    if q == 1:
        return by_point[:, 0]
    spread = np.zeros((n, q, r, q, 3))
    for k in range(q):
        spread[:, k, :, k] = by_point[:, k]
    return spread.reshape(n, r * q, 3 * q)


@dataclass(frozen=True, eq=False)
class Lengths:
    """Distances between pairs of the q points of every block, blocks (n, 3 q), world units.

    pairs    (first, second, name): the distance of two points is the shared parameter of that name
    sd       world units, how far a length varies from one block to the next
    """

    pairs: Sequence[tuple[int, int, str]]
    n: int
    sd: float
    family: int = 0
    noise: str = ""

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        p = state.blocks[self.family].reshape(self.n, -1, 3)
        names = tuple(dict.fromkeys(name for *_, name in self.pairs))
        columns = unknowns.of_shared(*names)
        free = [name for name in names if name in unknowns.shared]
        residual = np.empty((self.n, len(self.pairs)))
        by_shared = np.zeros((self.n, len(self.pairs), len(free)))
        by_block = np.zeros((self.n, len(self.pairs), p.shape[1], 3))
        for row, (i, j, name) in enumerate(self.pairs):
            apart = p[:, j] - p[:, i]
            length = np.linalg.norm(apart, axis=-1)
            residual[:, row] = state.shared[name] - length
            along = apart / np.maximum(length, 1e-300)[:, None]
            by_block[:, row, i], by_block[:, row, j] = -along, along
            if name in free:
                by_shared[:, row, free.index(name)] = -1
        weight = np.full(residual.shape, 1 / self.sd**2)
        return Equations(
            residual, weight, columns, by_shared, self.family, by_block.reshape(self.n, -1, p.shape[1] * 3)
        )


@dataclass(frozen=True, eq=False)
class CameraPriors:
    """What is known beforehand of single parameters: for each camera {name: (mean, sd)}, for those that are free.

    Raises ValueError for the attitude, whose zero is arbitrary (see `KnownCameras`).
    """

    priors: Sequence[Known]
    noise: str = ""

    def __post_init__(self) -> None:
        for prior in self.priors:
            for name in prior:
                if name in POSE:
                    raise ValueError(f"a prior on {name} has no meaning: it is a step from where the camera stands")

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        residual, weight, columns = [], [], []
        for i, (camera, prior) in enumerate(zip(state.cameras, self.priors, strict=True)):
            place, _ = unknowns.cameras[i]
            for name, (mean, sd) in prior.items():
                if name in unknowns.free[i]:
                    residual.append(mean - getattr(camera, name))
                    weight.append(1 / sd**2)
                    columns.append(place.start + unknowns.free[i].index(name))
        return _of_shared_alone(residual, weight, columns)


@dataclass(frozen=True, eq=False)
class SharedPriors:
    """What is known beforehand of shared parameters: {name: (mean, sd)}, for those that are free."""

    prior: Known
    noise: str = ""

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        names = [name for name in self.prior if name in unknowns.shared]
        residual = [self.prior[name][0] - state.shared[name] for name in names]
        weight = [1 / self.prior[name][1] ** 2 for name in names]
        return _of_shared_alone(residual, weight, unknowns.of_shared(*names).tolist())


def _of_shared_alone(residual: Sequence[float], weight: Sequence[float], columns: Sequence[int]) -> Equations:
    k = len(columns)
    return Equations(
        np.array(residual, float).reshape(1, k),
        np.array(weight, float).reshape(1, k),
        np.array(columns, int),
        np.eye(k)[None],
    )


@dataclass(frozen=True, eq=False)
class InterfacePriors:
    """What is known beforehand of the interfaces through which the cameras see (`Interface.pull`), each once."""

    noise: str = ""

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        pulls = {name: pull for camera in state.cameras for name, pull in pulls_of(camera.through).items()}
        known = {name: pull for name, pull in pulls.items() if name in unknowns.shared}
        k = len(known)
        return Equations(
            np.array([off for off, _ in known.values()], float).reshape(1, k),
            np.array([1 / sd**2 for _, sd in known.values()], float).reshape(1, k),
            unknowns.of_shared(*known),
            np.eye(k)[None],
        )


@dataclass(frozen=True, eq=False)
class KnownCameras:
    """Cameras known from another calibration, with the covariance of all their parameters together.

    cameras     as that calibration left them, in the order of those of the adjustment
    names       for each camera the parameters that the covariance is of, in the order of PARAMETERS, behind them those
                of its interfaces; one that cameras share may be named with each, each with what it knows of it
    pivot       (3,) about which that calibration's omega turn; (m, 3) where each camera has its own
    covariance  (K', K')
    Parameters that the adjustment does not free are passed over: they stay as they are.
    """

    cameras: Sequence[Camera]
    names: Sequence[Sequence[str]]
    pivot: Array
    covariance: Array
    noise: str = ""

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        residual: list[float] = []
        chosen: list[int] = []
        columns: list[int] = []
        rows: list[Array] = []
        start = 0
        for i, (then, now, names) in enumerate(zip(self.cameras, state.cameras, self.names, strict=True)):
            place, _ = unknowns.cameras[i]
            pivot = np.broadcast_to(self.pivot, (len(self.cameras), 3))[i]
            step = steps_between(then, now, pivot)
            carried = _at_another_pivot(now, unknowns.pivot, pivot)
            own = unknowns.free[i]
            moved = _interfaces_between(then, now)
            for k, name in enumerate(names):
                if name in unknowns.shared:
                    residual.append(-moved[name])
                    chosen.append(start + k)
                    rows.append(np.zeros(unknowns.size))
                    rows[-1][unknowns.of_shared(name)] = 1
                elif name in own:
                    residual.append(-step[name])
                    chosen.append(start + k)
                    row = np.zeros(unknowns.size)
                    for other, change in carried[name].items():
                        if other in own:
                            row[place.start + own.index(other)] = change
                    rows.append(row)
            start += len(names)
            columns += list(range(place.start, place.stop))
        columns += unknowns.of_shared(*dict.fromkeys(name for names in self.names for name in names)).tolist()
        C = np.asarray(self.covariance, float)[np.ix_(chosen, chosen)]
        spread = np.sqrt(np.diag(C))
        whiten = _inverse_root(C / np.outer(spread, spread)) / spread
        used = np.array(columns, int)
        by_shared = whiten @ np.array(rows).reshape(len(rows), -1)[:, used]
        return Equations((whiten @ np.array(residual))[None], np.ones((1, len(rows))), used, by_shared[None])


def _inverse_root(C: Array) -> Array:
    """W with W^T W the inverse of a correlation matrix; where rounding leaves no variance, 1e-12 is taken."""
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(C)))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(C)
        return np.asarray((vectors / np.sqrt(np.maximum(values, 1e-12))).T)


def steps_between(then: Camera, now: Camera, pivot: Array) -> Mapping[str, float]:
    """The step of every parameter (see `jacobian.stepped`) that leads from one camera to another."""
    R = now.R @ then.R.T
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, (np.trace(R) - 1) / 2)
    omega = axis * (angle / sine if sine > 1e-12 else 1.0)
    shift = (now.R @ pivot + now.T) - (then.R @ pivot + then.T)
    values = {name: getattr(now, name) - getattr(then, name) for name in PARAMETERS[6:]}
    return dict(zip(POSE, (*omega, *shift), strict=True)) | values


def _interfaces_between(then: Camera, now: Camera) -> Mapping[str, float]:
    """The step of every parameter of a camera's interfaces that leads from one camera to another."""
    return {
        name: float(off)
        for before, after in zip(then.through, now.through, strict=True)
        for name, off in zip(after.parameters, after.deviation(before), strict=True)
    }


def _at_another_pivot(camera: Camera, pivot: Array, other: Array) -> Mapping[str, Mapping[str, float]]:
    """How each parameter about `other` follows small steps about `pivot`: t' = t + omega x R (other - pivot)."""
    arm = camera.R @ (other - pivot)
    turned = {"x": np.cross([1.0, 0, 0], arm), "y": np.cross([0, 1.0, 0], arm), "z": np.cross([0, 0, 1.0], arm)}
    same: dict[str, dict[str, float]] = {name: {name: 1.0} for name in PARAMETERS}
    for k, a in enumerate("xyz"):
        same[f"t_{a}"] |= {f"omega_{b}": float(turned[b][k]) for b in "xyz"}
    return same
