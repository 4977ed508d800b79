"""Whether the targets of a body lie where the config says: from a shape that the cameras find by themselves.

A body's axes are free, so only what no rigid motion changes is compared. A single wrong number, a target that sits
elsewhere, and a body that is larger or smaller throughout are each tried as the reason (data snooping; Baarda 1968).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.body.body_sights import Body, poses_of


class ShapeSettings(NamedTuple):
    """When a shape is another one."""

    wrong: float = 5.0
    """Standard deviations that one number, target or the scale must be off: of a few dozen tries none is by chance."""
    loose: float = 0.05
    """Standard deviation of a coordinate that is to be found, as a share of the body's size."""
    alike: float = 4.0
    """Chi squared by which the best reason must be better than another one for that to be ruled out."""


SETTINGS = ShapeSettings()


class Reason(NamedTuple):
    """What, if it alone were wrong, would explain a shape.

    what     the words that name it: "bow x", "bow", "scale"
    off      by how much it is wrong: world units; of the scale, a share
    deviate  the same in standard deviations
    left     chi squared that it leaves
    """

    what: str
    off: float
    deviate: float
    left: float


class ShapeTest(NamedTuple):
    """What the cameras say of the body's shape."""

    chi2: float
    freedom: int
    reasons: tuple[Reason, ...]  # that explain it, the best first; none where nothing is wrong
    distances: dict[str, tuple[float, float, float]]  # of each pair: stated, seen, standard deviation of the difference


def judge_shape(body: Body, seen: Array, covariance: Array) -> ShapeTest:
    """Compare the stated places with those seen (q, 3), of covariance (3 q, 3 q), which `body_fit.fit_body` finds.

    covariance  with the body's axes as good as free
    """
    q = len(seen)
    pose = poses_of(seen, body.p[None], np.ones((1, q), bool))[0]
    if np.isnan(pose).any():
        return ShapeTest(0.0, 0, (), {})
    turn = np.kron(np.eye(q), pose[:, :3])
    off = (seen @ pose[:, :3].T + pose[:, 3] - body.p).ravel()
    V = turn @ covariance @ turn.T + body.sd**2 * np.eye(3 * q)
    N = _shapes(body.p)
    y, W = N.T @ off, np.asarray(np.linalg.inv(N.T @ V @ N))
    chi2 = float(y @ W @ y)
    tried = [_tried(name, A, N, W, y) for name, A in _hypotheses(body)]
    worst = min(tried, key=lambda each: each.left)
    found = [each for each in tried if each.left < worst.left + SETTINGS.alike]
    wrong = worst.deviate > SETTINGS.wrong
    return ShapeTest(
        chi2, len(y), tuple(sorted(found, key=lambda r: r.left)) if wrong else (), _distances(body, seen, V)
    )


def _shapes(p: Array) -> Array:
    """(3 q, 3 q - 6): the changes of the places p (q, 3) that no rigid motion makes."""
    q = len(p)
    turns = [np.cross(axis, p - p.mean(0)).ravel() for axis in np.eye(3)]
    rigid = np.stack([*(np.tile(axis, q) for axis in np.eye(3)), *turns], -1)
    U, _, _ = np.linalg.svd(rigid)
    return np.asarray(U[:, 6:])


def _hypotheses(body: Body) -> list[tuple[str, Array]]:
    """What may be wrong: its name, and how the places (3 q, k) follow it."""
    q = len(body.targets)
    each: list[tuple[str, Array]] = [("scale", (body.p - body.p.mean(0)).reshape(-1, 1))]
    unit = np.eye(3 * q)
    for j, target in enumerate(body.targets):
        each += [(f"{target} {axis}", unit[:, 3 * j + k, None]) for k, axis in enumerate("xyz")]
        if q > 3:  # of three targets two distances follow one of them, and a third alone remains
            each.append((target, unit[:, 3 * j : 3 * j + 3]))
    return each


def _tried(name: str, A: Array, N: Array, W: Array, y: Array) -> Reason:
    B = N.T @ A
    M = B.T @ W @ B
    size = max(float(np.trace(B.T @ B)), 1e-300)
    if np.linalg.eigvalsh(B.T @ B)[0] < 1e-6 * size or size < 1e-12 * float((A**2).sum()):
        return Reason(name, 0.0, 0.0, float(y @ W @ y))  # no shape follows it
    k = np.linalg.solve(M, B.T @ W @ y)
    gain = float(k @ M @ k)
    # a target has three numbers to explain with: it must gain more for that
    spare = len(k) - 1
    left = float(y @ W @ y) - gain + SETTINGS.alike * spare
    sign = -1.0 if len(k) == 1 and k[0] < 0 else 1.0
    return Reason(name, sign * float(np.linalg.norm(k)), float(np.sqrt(max(gain - 2 * spare, 0.0))), left)


def _distances(body: Body, seen: Array, V: Array) -> dict[str, tuple[float, float, float]]:
    found = {}
    for i in range(len(seen)):
        for j in range(i):
            along = body.p[i] - body.p[j]
            stated = float(np.linalg.norm(along))
            if stated == 0:
                continue
            row = np.zeros(V.shape[0])
            row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = along / stated, -along / stated
            sd = float(np.sqrt(row @ V @ row))
            found[f"{body.targets[j]}-{body.targets[i]}"] = stated, float(np.linalg.norm(seen[i] - seen[j])), sd
    return found
