"""Where a target is at any time: rest, oscillations that decay, steady travel, a path, an arm on a body that turns."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from vidtrack.arrays import Array
from vidtrack.simulate.plan import Plan, Vector


class Oscillation(Plan):
    """along * amplitude * exp(-decay t) * cos(2 pi hz t + phase), t counted from the release.

    Before the release the target stays where the release will find it: a pluck holds at the full amplitude with
    phase_deg 0, and a vibration that the release sets off has phase_deg -90.
    """

    along: Vector = Field((1.0, 0.0, 0.0), description="direction in the world; made a unit vector")
    amplitude: float = Field(description="world units")
    hz: Annotated[float, Field(ge=0)] = Field(description="cycles a second")
    decay: Annotated[float, Field(ge=0)] = Field(0.0, description="1/s; the amplitude falls to 1/e in 1/decay s")
    phase_deg: float = 0.0
    release_s: float = Field(0.0, description="s after the run's start")


class Turn(Plan):
    """A rotation to and fro about an axis: amplitude_deg * exp(-decay t) * cos(2 pi hz t + phase), t as above."""

    about: Vector = Field((0.0, 0.0, 1.0), description="axis in the world, right-handed")
    amplitude_deg: float
    hz: Annotated[float, Field(ge=0)]
    decay: Annotated[float, Field(ge=0)] = 0.0
    phase_deg: float = 0.0
    release_s: float = 0.0


class Motion(Plan):
    """A place, and what moves it: the sum of steady travel, oscillations and a path; and an arm that turns about it."""

    at: Vector = Field((0.0, 0.0, 0.0), description="world, the place at rest")
    velocity: Vector = Field((0.0, 0.0, 0.0), description="world units/s, from the run's start")
    oscillations: tuple[Oscillation, ...] = ()
    path: tuple[tuple[float, float, float, float], ...] = Field(
        (), description="rows t, x, y, z: joined by straight lines, still before the first and after the last"
    )
    arm: Vector = Field((0.0, 0.0, 0.0), description="from that place to the target, in axes that turn with the body")
    turns: tuple[Turn, ...] = Field((), description="the first acts first")


def position(motion: Motion, t: ArrayLike) -> Array:
    """Positions (..., 3), world units, at times t (...), s after the run's start."""
    t = np.asarray(t, float)
    p: Array = np.asarray(motion.at) + t[..., None] * np.asarray(motion.velocity)
    for term in motion.oscillations:
        p = p + swing(term, t)[..., None] * _unit(term.along)
    if motion.path:
        rows = np.asarray(motion.path, float)
        p = p + np.stack([np.interp(t, rows[:, 0], rows[:, axis]) for axis in (1, 2, 3)], -1)
    return p + _dot(attitude(motion.turns, t), np.asarray(motion.arm, float))


def attitude(turns: tuple[Turn, ...], t: ArrayLike) -> Array:
    """Rotations (..., 3, 3), from a body's axes to the world's, at times t (...), s (Rodrigues' formula)."""
    t = np.asarray(t, float)
    R = np.broadcast_to(np.eye(3), (*t.shape, 3, 3))
    for turn in turns:
        angle = np.radians(_swing(turn, turn.amplitude_deg, t))[..., None, None]
        x, y, z = _unit(turn.about)
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        R = (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)) @ R
    return np.asarray(R)


def swing(term: Oscillation, t: ArrayLike) -> Array:
    """How far an oscillation has moved its target along its direction, (...), world units, at times t (...), s."""
    return _swing(term, term.amplitude, np.asarray(t, float))


def _swing(term: Oscillation | Turn, amplitude: float, t: Array) -> Array:
    since = np.maximum(t - term.release_s, 0.0)
    phase = 2 * np.pi * term.hz * since + np.radians(term.phase_deg)
    return np.asarray(amplitude * np.exp(-term.decay * since) * np.cos(phase))


def _dot(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _unit(along: Vector) -> Array:
    v = np.asarray(along, float)
    length = float(np.linalg.norm(v))
    if not length > 0:
        raise ValueError("the direction of an oscillation or the axis of a turn has no length")
    return v / length
