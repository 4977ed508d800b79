"""Where moving targets will be next: a parabola through their last positions, leaning on what targets usually do.

A least-squares fit with priors: with one known position the target stays, with two it goes on, with three or more
it accelerates; noise and gaps are borne by the same formula. Where all the last positions are known and a cubic would
have predicted the latest of them far better than a parabola, the cubic is used: smooth motion is then known for longer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vidtrack.arrays import Array


@dataclass(frozen=True)
class Motion:
    """What motion is usual, and how far a prediction reaches.

    noise_px         # ASSUME: how well a position fits a parabola: its own noise and what the motion does besides
    speed_px         # ASSUME: px a sample, usual speeds; only where a single position is known does it matter
    acceleration_px  # ASSUME: px a sample^2, usual accelerations
    jerk_px          # ASSUME: px a sample^3, usual jerks of smooth motion
    fading           weight of a position for each sample of its age: what no parabola describes harms less where
                     positions are fresh
    longest          samples: further ahead than this a parabola says nothing, and the target is expected to stand still
    tried            latest positions that a cubic must predict from those before
    better           a cubic is used where its squares of errors sum to less than this share of the parabola's
    """

    noise_px: float = 0.3
    speed_px: float = 30.0
    acceleration_px: float = 10.0
    jerk_px: float = 1.0
    fading: float = 0.6
    longest: float = 8.0
    tried: int = 2
    better: float = 0.25


MOTION = Motion()
_RIDGE = np.array(
    [
        1e-9,
        (MOTION.noise_px / MOTION.speed_px) ** 2,
        (2 * MOTION.noise_px / MOTION.acceleration_px) ** 2,
        (6 * MOTION.noise_px / MOTION.jerk_px) ** 2,
    ]
)


def predict(times: Array, positions: Array, to: Array) -> Array:
    """Predicted positions (k, n, 2), px.

    times      (m,) when the known positions were, in samples; positions (m, n, 2) px, NaN where the target was lost
    to         (k,) times wanted
    NaN for targets that have no known position.
    """
    known = np.isfinite(positions[..., 0])
    if known.all():
        return _smooth(times, positions, to) if len(times) > 2 * MOTION.tried else _parabola(times, positions, to)
    predicted = np.full((len(to), *positions.shape[1:]), np.nan)
    patterns, which = np.unique(known, axis=1, return_inverse=True)
    for i, there in enumerate(patterns.T):  # few: targets are lost and begun together or seldom
        some = which.ravel() == i
        if there.any():
            predicted[:, some] = _parabola(times[there], positions[there][:, some], to)
    return predicted


def _parabola(times: Array, positions: Array, to: Array) -> Array:
    """Predictions (k, n, 2) from positions (m, n, 2) that are all known."""
    back, ahead = _steps(times, to)
    weights = _weights(back, ahead, 2)
    predicted: Array = (weights @ positions.reshape(len(times), -1)).reshape(len(to), *positions.shape[1:])
    return predicted


def _smooth(times: Array, positions: Array, to: Array) -> Array:
    """As `_parabola`, each target by the curve that would have predicted where it is."""
    k, (m, n, _) = len(to), positions.shape
    curves = (_operator(*_steps(times, to)) @ positions.reshape(m, -1)).reshape(2, k + MOTION.tried, n, 2)
    squares = np.square(curves[:, k:]).sum(axis=(1, 3))
    cubic = squares[1] < MOTION.better * squares[0]
    if not cubic.any():
        return curves[0, :k]
    return np.where(cubic[:, None], curves[1, :k], curves[0, :k])


def _steps(times: Array, to: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Samples from the last time to the others, and to those wanted; rounded, so that they come again."""
    back, ahead = times - times[-1], np.minimum(to - times[-1], MOTION.longest)
    return tuple(np.round(back, 4).tolist()), tuple(np.round(ahead, 4).tolist())


@lru_cache(maxsize=256)
def _operator(back: tuple[float, ...], ahead: tuple[float, ...]) -> Array:
    """Times known positions (m, ..): for a parabola and a cubic the predictions, and how far those of the latest
    MOTION.tried positions from the others would have been off; (2 (k + MOTION.tried), m).
    """
    m, last = len(back), back[-MOTION.tried - 1]
    before, latest = (tuple(step - last for step in steps) for steps in (back[: -MOTION.tried], back[-MOTION.tried :]))
    rows = []
    for degree in (2, 3):
        off = np.hstack([_weights(before, latest, degree), -np.eye(MOTION.tried)])
        rows += [_weights(back, ahead, degree).reshape(-1, m), off]
    return np.vstack(rows)


@lru_cache(maxsize=256)
def _weights(back: tuple[float, ...], ahead: tuple[float, ...], degree: int) -> Array:
    """Of each known position in each prediction, (k, m)."""
    power = np.arange(degree + 1)[:, None]
    powers = np.array(back) ** power
    fresh = powers * MOTION.fading ** -np.array(back)
    forward = (np.array(ahead) ** power).T
    return np.asarray(forward @ np.linalg.solve(fresh @ powers.T + np.diag(_RIDGE[: degree + 1]), fresh))
