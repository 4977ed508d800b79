"""A wand's measurements for the adjustment: sights of its balls by every camera, at clocks that may be unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.adjustment.adjust import Problem
from vidtrack.calibration.adjustment.measurements import (
    CameraPriors,
    Lengths,
    Measurement,
    SharedPriors,
    Sights,
)
from vidtrack.calibration.adjustment.normal_equations import Equations
from vidtrack.calibration.adjustment.unknowns import Family, Known, Names, State, Unknowns, free_blocks
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera

LENGTH_SHARE, PLAY_SHARE = 1 / 2000, 1e-4
"""ASSUME: how well a wand's length is known where nothing is said of it, and by how much it varies at least."""


class Wand(NamedTuple):
    """Balls at known distances.

    ends     their names
    lengths  (q, q) world units, symmetric
    pairs    (first, second, name) of each distance that is given
    sd       world units, standard deviation of the given lengths, common to all moments
    play     world units, by which a length varies from one moment to the next, at least
    """

    ends: tuple[str, ...]
    lengths: Array
    pairs: tuple[tuple[int, int, str], ...]
    sd: float
    play: float

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for *_, name in self.pairs)

    @property
    def values(self) -> dict[str, float]:
        return {name: float(self.lengths[i, j]) for i, j, name in self.pairs}


def wand_of(lengths: Mapping[str, float], sigma: float | None, where: str = "calibration.wand.lengths") -> Wand:
    """The wand that a config describes: {A-B: 20, B-C: 10}. VidtrackError for one that cannot be."""
    ends = tuple(dict.fromkeys(end.strip() for name in lengths for end in name.split("-")))
    q = len(ends)
    if q not in (2, 3) or any(len(name.split("-")) != 2 for name in lengths):
        raise VidtrackError(f"{where}: names {q} balls; a wand has 2 or 3, each distance named as A-B.")
    table = np.zeros((q, q))
    pairs = []
    for name, value in lengths.items():
        i, j = (ends.index(end.strip()) for end in name.split("-"))
        table[i, j] = table[j, i] = value
        pairs.append((i, j, name))
    if q == 3 and len(pairs) < 3:
        missing = [(i, j) for i, j in ((0, 1), (0, 2), (1, 2)) if not table[i, j]]
        if len(pairs) < 2:
            raise VidtrackError(f"{where}: three balls have three distances; give at least two, of a straight wand.")
        (i, j), k = missing[0], 3 - missing[0][0] - missing[0][1]
        table[i, j] = table[j, i] = table[i, k] + table[k, j]  # on a straight wand
        pairs.append((i, j, f"{ends[i]}-{ends[j]}"))
    if q == 3 and 2 * table.max() > table[np.triu_indices(3, 1)].sum() * (1 + 1e-6):
        raise VidtrackError(f"{where}: no triangle has these sides. Measure the distances again.")
    size = float(table.max())
    return Wand(ends, table, tuple(pairs), size * LENGTH_SHARE if sigma is None else sigma, size * PLAY_SHARE)


class Views(NamedTuple):
    """What m cameras saw of the q balls at n moments, each ball in the place of its end.

    b         (m, n, q, 2)  px; NaN where a camera lacks a ball
    sd        (m, n, q, 2)  px, but for one factor
    velocity  (m, n, q, 2)  px/s, by which b moves when the camera's clock is late
    """

    b: Array
    sd: Array
    velocity: Array

    def at(self, rows: Ints) -> Views:
        return Views(*(part[:, rows] for part in self))


def clock_name(camera: int) -> str:
    """The shared parameter by which the sights of a camera are taken later than now thought, s."""
    return f"clock {camera}"


@dataclass(frozen=True, eq=False)
class LateSights:
    """Sights of a camera whose clock is unknown: to first order they move along their tracks."""

    sights: Sights
    velocity: Array  # (n, q, 2) px/s
    noise: str = "px"

    def equations(self, state: State, unknowns: Unknowns) -> Equations:
        own = self.sights.equations(state, unknowns)
        name = clock_name(self.sights.camera)
        moved = self.velocity.reshape(len(self.velocity), -1)
        residual = own.residual + moved * state.shared[name]
        columns = np.concatenate([own.columns, unknowns.of_shared(name)])
        if len(columns) == len(own.columns):
            return own._replace(residual=residual)
        by_shared = np.concatenate([own.by_shared, -moved[..., None]], -1)
        return own._replace(residual=residual, columns=columns, by_shared=by_shared)


def wand_problem(
    views: Views,
    points: Array,
    wand: Wand,
    free: Names,
    priors: Sequence[Known],
    *,
    late: Sequence[int] = (),
    clock_sd: float = 0.0,
    scaled: bool = True,
    more: tuple[Sequence[Family], Sequence[Measurement]] = ((), ()),
) -> Problem:
    """The adjustment of a waved wand.

    points  (n, q, 3)  where the balls are thought to be
    late    the cameras whose clocks are unknown, to a standard deviation clock_sd, s
    scaled  whether the noise of the sights is found
    more    further families of blocks and measurements, whose family counts from 1
    """
    sights: list[Measurement] = []
    for i in range(len(views.b)):
        own = Sights(i, views.b[i], views.sd[i])
        sights.append(LateSights(own, np.nan_to_num(views.velocity[i])) if i in late else own)
    clocks = {clock_name(i): (0.0, clock_sd) for i in late}
    known = {name: (value, wand.sd) for name, value in wand.values.items()} if wand.sd > 0 else {}
    shared = [*known, *clocks]
    lengths = Lengths(wand.pairs, len(points), wand.play)
    pivot = np.nanmean(points.reshape(-1, 3), 0)
    measured = [*sights, lengths, CameraPriors(priors), SharedPriors({**known, **clocks}), *more[1]]
    families = [free_blocks(points.reshape(len(points), -1)), *more[0]]
    groups = {"px": 1e-3 / float(np.nanmean(views.sd))} if scaled else {}
    return Problem(Unknowns(free, pivot, shared), families, measured, groups)


def wand_state(cameras: Sequence[Camera], points: Array, wand: Wand, late: Sequence[int] = ()) -> State:
    """Where the adjustment starts: clocks as they are now thought to be, lengths as given."""
    shared: Mapping[str, float] = {**wand.values, **{clock_name(i): 0.0 for i in late}}
    return State(tuple(cameras), shared, (points.reshape(len(points), -1),))
