"""The least-squares adjustment: Levenberg-Marquardt with the blocks eliminated, the noise found from the residuals.

    minimise  sum (measured - computed)^2 / sd^2  +  what is known of the blocks beforehand

A group of measurements may have an sd that is right but for one factor: the factor is found from what the fit leaves
over, by the share of each residual that the fit cannot follow (its redundancy; Foerstner 1979). Each group has its own
(the variance components of geodesy), so that pixels and lengths are weighed as they deserve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.measurements import Measurement
from vidtrack.calibration.adjustment.normal_equations import (
    Covariance,
    Equations,
    Normal,
    Prior,
    covariance,
    solved,
    summed,
)
from vidtrack.calibration.adjustment.unknowns import Family, State, Unknowns

MOST_ROUNDS, SAME_NOISE = 20, 1e-3
"""The noise is found again until it changes by less than this share, for so many rounds."""
LEAST_REDUNDANCY = 0.5
"""A group whose residuals hold less than this of the noise says nothing of it."""


class Problem(NamedTuple):
    """What is sought and what is measured.

    groups  for each group of measurements whose noise is found: the least factor that its sd can have
    """

    unknowns: Unknowns
    families: Sequence[Family]
    measurements: Sequence[Measurement]
    groups: Mapping[str, float] = {}


class Adjusted(NamedTuple):
    """What `adjust` returns. Lists run over the problem's families and measurements."""

    state: State
    covariance: Array  # (K, K) of the shared unknowns, in the order of Unknowns
    blocks: tuple[Array, ...]  # (n, d, d) of every block
    residuals: tuple[Array, ...]  # (n, q) measured minus computed; NaN where missing
    normalised: tuple[Array, ...]  # (n, q) in standard deviations of themselves; NaN where missing or fitted exactly
    redundancy: tuple[float, ...]  # of all measurements of a kind: how many of them are not used up by the fit
    factors: Mapping[str, float]  # of each group, by which its sd were multiplied
    cost: float
    steps: int
    converged: bool


def adjust(
    problem: Problem, start: State, *, max_steps: int = 100, factors: Mapping[str, float] | None = None
) -> Adjusted:
    """Find the most likely state from one that is nearly right, its covariance, and the noise of each group.

    factors  where known, of the noise of the groups, to start from
    Raises ValueError where a measurement cannot be computed from the start, or a parameter is left open.
    `converged` is False where the last step still gained.
    """
    state = _At.of(problem, start)
    if not np.isfinite(state.cost({})):
        raise ValueError("a measured point does not project through the starting cameras")
    found = dict(factors) if factors else {name: state.first_factor(name) for name in problem.groups}
    steps, converged = 0, False
    for _ in range(MOST_ROUNDS):
        used = found
        state, taken, converged = _minimised(state, used, max_steps)
        steps += taken
        known = covariance(state.normal(used), state.weighted(used), state.priors)
        found = {name: state.factor(name, known, used) for name in problem.groups}
        if all(abs(found[name] / used[name] - 1) < SAME_NOISE for name in found):
            break
    return _result(state, known, used, steps, converged)


def minimise(problem: Problem, start: State, *, max_steps: int = 100, tolerance: float = 1e-9) -> State:
    """The state of `adjust` with the noise as stated and without any covariance: for refits that start near the answer.

    tolerance  share of the cost below which a step's gain ends the search
    """
    return _minimised(_At.of(problem, start), {}, max_steps, tolerance)[0].state


class _At(NamedTuple):
    """A state and all measurements linearised there."""

    problem: Problem
    state: State
    equations: tuple[Equations, ...]
    priors: tuple[Prior, ...]

    @classmethod
    def of(cls, problem: Problem, state: State) -> _At:
        equations = tuple(m.equations(state, problem.unknowns) for m in problem.measurements)
        priors = tuple(f.prior(values) for f, values in zip(problem.families, state.blocks, strict=True))
        return cls(problem, state, equations, priors)

    def weighted(self, factors: Mapping[str, float]) -> list[Equations]:
        return [
            each._replace(weight=each.weight / factors.get(m.noise, 1.0) ** 2)
            for m, each in zip(self.problem.measurements, self.equations, strict=True)
        ]

    def cost(self, factors: Mapping[str, float]) -> float:
        """What is minimised, no unit; inf where a measurement cannot be computed."""
        total = 0.0
        for each in self.weighted(factors):
            some = each.weight > 0
            total += float((each.weight[some] * each.residual[some] ** 2).sum())
        for prior in self.priors:
            moves = np.isfinite(prior.information)
            total += float((prior.information[moves] * prior.shift[moves] ** 2).sum())
        return total if np.isfinite(total) else np.inf

    def normal(self, factors: Mapping[str, float]) -> Normal:
        return summed(self.weighted(factors), self.problem.unknowns.size, self.priors)

    def stepped(self, shared: Array, blocks: Sequence[Array]) -> _At | None:
        try:
            moved = self.problem.unknowns.stepped(self.state, self.problem.families, shared, blocks)
        except ValueError:  # so large a step that f or Sx would be negative
            return None
        return _At.of(self.problem, moved)

    def of_group(self, name: str) -> list[int]:
        return [k for k, m in enumerate(self.problem.measurements) if m.noise == name]

    def first_factor(self, name: str) -> float:
        """The factor of a group if all that remains before the first step were noise."""
        squares = [
            self.equations[k].weight[some] * self.equations[k].residual[some] ** 2
            for k in self.of_group(name)
            for some in [self.equations[k].weight > 0]
        ]
        each = np.concatenate(squares) if squares else np.zeros(0)
        return max(float(np.sqrt(each.mean())), self.problem.groups[name]) if each.size else 1.0

    def factor(self, name: str, known: Covariance, factors: Mapping[str, float]) -> float:
        """The factor that makes a group's residuals as large as their redundancy says they should be."""
        squares = redundancy = 0.0
        for k in self.of_group(name):
            each = self.equations[k]
            some = each.weight > 0
            squares += float((each.weight[some] * each.residual[some] ** 2).sum())
            redundancy += float((1 - known.fitted[k] * each.weight / factors[name] ** 2)[some].sum())
        if redundancy < LEAST_REDUNDANCY:
            return factors[name]
        return max(float(np.sqrt(squares / redundancy)), self.problem.groups[name])


def _minimised(at: _At, factors: Mapping[str, float], max_steps: int, tolerance: float = 1e-9) -> tuple[_At, int, bool]:
    """Damp until the cost falls, relax after each success."""
    cost, damping = at.cost(factors), 1e-8
    for taken in range(max_steps):
        normal = at.normal(factors)
        while True:
            shared, blocks = solved(normal, damping)
            gain = float(shared @ normal.g)  # the fall of the cost that the tangent predicts
            gain += sum(float((step * f.h).sum()) for step, f in zip(blocks, normal.families, strict=True))
            if gain <= tolerance * cost + 1e-12:
                return at, taken, True
            trial = at.stepped(shared, blocks)
            reached = trial.cost(factors) if trial else np.inf
            if trial and reached <= cost:
                break
            damping = max(damping, 1e-8) * 100
            if damping > 1e12:
                return at, taken, False
        at, cost, damping = trial, reached, damping / 10
    return at, max_steps, False


def _result(at: _At, known: Covariance, factors: Mapping[str, float], steps: int, converged: bool) -> Adjusted:
    residuals, normalised, redundancy = [], [], []
    for each, fitted in zip(at.weighted(factors), known.fitted, strict=True):
        there = each.weight > 0
        left = np.where(there, each.residual, np.nan)
        spare = np.where(there, 1 - fitted * each.weight, np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            normalised.append(np.where(spare > 1e-6, left * np.sqrt(each.weight / spare), np.nan))
        residuals.append(left)
        redundancy.append(float(np.nansum(spare)))
    return Adjusted(
        at.state,
        known.shared,
        known.blocks,
        tuple(residuals),
        tuple(normalised),
        tuple(redundancy),
        dict(factors),
        at.cost(factors),
        steps,
        converged,
    )
