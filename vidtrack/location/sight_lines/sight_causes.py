"""Why lines of sight miss: one camera turned, one lens or all zoomed, one clock late, fast or jumping.

Each cause is fitted alone beside the calibration's error. What it takes away of the squared residuals says which one it
is. The evidence for it is what remains of that beside errors that do not average away: for turns and zooms, which a
plain lens model may look like, of BIAS_PX; for clocks, whose misses change sign with the velocity, of SLOW_PX beside
fields of FIELD_PX that vary linearly over the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.location.sight_lines.sight_system import SightSystem, left_by, one_over, root_of, whitened

BIAS_PX = 0.015
"""ASSUME: what does not average away over a run: pixel locking, uneven light on a target, a plain lens model."""

FIELD_PX, SLOW_PX = 0.05, 0.005
"""ASSUME: the same for what goes with the velocity: fields that vary linearly over the scene, and what is left of them.
Clocks are estimated from the motion with the same two (`motion_clock`)."""

LIKELY_TURN = 0.05
"""ASSUME: rad, a camera that was moved by accident turned by about as much. It keeps directions that the targets do not
show from being taken for large turns."""

LIKELY_ZOOM = 0.05
"""ASSUME: share of its focal length by which a lens differs that was zoomed or focused again after its calibration."""

LARGEST_TURN = 15.0
"""deg; a camera that turned by more does not show the targets where they were: the turn stands for something else."""

LARGEST_ZOOM = 0.2
"""Of its focal length; where a few px are missed, a lens that was zoomed by more stands for something else."""

LARGEST_RATE = 0.1
"""A clock that runs faster by a larger share stands for something else."""

LIKELY = {"turned": LIKELY_TURN, "zoomed": LIKELY_ZOOM, "all zoomed": LIKELY_ZOOM}
LARGEST = {"turned": LARGEST_TURN, "zoomed": LARGEST_ZOOM, "all zoomed": LARGEST_ZOOM, "fast": 1e6 * LARGEST_RATE}

UNITS = {"turned": 180 / np.pi, "fast": 1e6}
"""deg and ppm."""

CLOCK = ("late", "fast", "jumped")

AS_GOOD = 0.95
"""Causes that explain this share of what the best one explains are as likely."""

WORTH = {"turned": AS_GOOD, "jumped": 0.8}
"""A turn has three numbers to explain with and a jump its moment; the others have one."""

EVIDENT, NEARLY = 9.0, 0.8
"""Evidence beyond doubt; the share of what the best cause explains with which one of such evidence is preferred."""

JUMPS = 8
"""Parts of the run between which a clock may jump."""

KNOWN_SDS, SURELY = 3.0, 2.0
"""Standard deviations of a cause's amount, below which it may be mostly what residuals do not show, as a turn by 1 ±
0.5 degrees about the line to the targets: what counts is the least that amounts within SURELY move positions by."""


class Cause(NamedTuple):
    """One camera turned, by so many degrees, zoomed, by such a share, or its clock wrong, and its worth.

    kind     turned | zoomed | all zoomed | late | fast | jumped
    cameras  the camera; and those that explain as much; all where they are meant together
    amount   deg, share of f; s to be added to the camera's time, ppm by which it is to be stretched, s from a moment on
    share    of the excess of squared misses that it explains
    evidence chi squared that it takes away, of samples whose errors are not independent
    moved    rms of what it moves the positions by, each over its sigma; of an amount below KNOWN_SDS the least of that
             for any amount, and way to turn, within SURELY
    """

    kind: str
    cameras: tuple[int, ...]
    amount: float
    sd: float
    share: float
    evidence: float
    moved: float
    from_s: float | None = None  # where the clock jumped


def causes(
    cameras: Sequence[Camera], system: SightSystem, p: Array, velocity: Array, at: Array, A: Array, C: Array
) -> list[Cause]:
    """Every cause fitted alone beside the calibration's error; best first.

    p (n, 3); velocity (n_cameras, n, 2) px/s and at (n,) s of the samples; A (n, 2 c, k) and C as of `calibration_of`
    """
    AL = A.reshape(system.e.size, len(C)) @ root_of(C)
    alone = _Beside(AL, system.e.ravel())
    fields = _Beside(np.concatenate([AL, _fields(cameras, system, p)], -1), system.e.ravel())
    expected = float(np.einsum("njj->", system.H))
    before = alone.left()
    noise2 = float(np.median(system.sd[system.sd > 0])) ** 2
    found = []
    for kind, follows, from_s in _hypotheses(cameras, p, velocity, at):
        X = sum(left_by(system, i, px) for i, px in follows.items()).reshape(system.e.size, -1)  # type: ignore[union-attr]
        x, inverse, gain = alone.fitted(X, LIKELY.get(kind, np.inf))
        clock = kind in CLOCK
        worth = fields.fitted(X, np.inf)[2] if clock else gain
        worth /= 1 + len(p) * (SLOW_PX if clock else BIAS_PX) ** 2 / noise2
        size = float(np.linalg.norm(x)) or 1e-300
        covariance = inverse * max((before - gain) / expected, 1.0)
        spread = float(np.sqrt(np.maximum(x @ covariance @ x, 0.0))) / size
        M = moved2(system, follows)
        moved = float(np.sqrt(x @ M @ x)) if size > KNOWN_SDS * spread else least_moved(x, covariance, M)
        amount, unit = size if kind == "turned" else float(x[0]), UNITS.get(kind, 1.0)
        share = min(gain / max(before - expected, gain, 1e-300), 1.0)
        cause = Cause(kind, tuple(follows), amount * unit, spread * unit, share, worth, moved, from_s)
        found.append((gain * WORTH.get(kind, 1.0), cause))
    return [cause for _, cause in sorted(found, key=lambda one: -one[0])]


def moved2(system: SightSystem, follows: Mapping[int, Array]) -> Array:
    """M (k, k): x' M x is the mean square of what amounts x (k,) move the positions by, each over its own sigma.

    follows  by camera px (n, 2, k) that follow from the amounts
    """
    by = system.G @ sum(whitened(system, i, px) for i, px in follows.items())
    return np.asarray(np.einsum("nij,nik,n->jk", by, by, one_over(system.sigma2)) / len(by), float)


def least_moved(x: Array, covariance: Array, M: Array) -> float:
    """The least sqrt(y' M y) of amounts y within SURELY standard deviations of x (k,), of covariance (k, k).

    Along the axes of M in units of deviations, of lengths a, the least lies at y = x m / (a + m): m follows from its
    distance to x (Lagrange).
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 1e-300))
    a, axes = np.linalg.eigh(root.T @ M @ root)
    z2 = (axes.T @ np.linalg.solve(root, x)) ** 2
    known = a > 1e-12 * a.max()
    if not known.any() or z2[known].sum() <= SURELY**2:
        return 0.0
    a, z2 = a[known], z2[known]
    low, high = 1e-15 * a.max(), 1e15 * a.max()
    for _ in range(100):
        m = float(np.sqrt(low * high))
        low, high = (m, high) if (z2 * (a / (a + m)) ** 2).sum() > SURELY**2 else (low, m)
    return float(np.sqrt((z2 * a * (high / (a + high)) ** 2).sum()))


class _Beside(NamedTuple):
    """Residuals e (N,) beside errors whose columns L (N, k) are in units of their own deviations."""

    L: Array
    e: Array

    def left(self) -> float:
        """Squared residuals that those errors leave."""
        return float(self.e @ self._without(self.e))

    def fitted(self, X: Array, likely: float) -> tuple[Array, Array, float]:
        """What multiplies the columns of X (N, j), of deviation `likely`: its values, covariance, and chi squared."""
        W = self._without(X)
        S = X.T @ W + np.eye(X.shape[1]) / likely**2
        inverse = np.asarray(np.linalg.pinv(S, rcond=1e-10, hermitian=True), float)
        g = W.T @ self.e
        return inverse @ g, inverse, float(g @ inverse @ g)

    def _without(self, X: Array) -> Array:
        N = self.L.T @ self.L + np.eye(self.L.shape[1])
        return np.asarray(X - self.L @ np.linalg.solve(N, self.L.T @ X))


def _fields(cameras: Sequence[Camera], system: SightSystem, p: Array) -> Array:
    """What pixels that err by FIELD_PX, evenly or linearly over the scene, leave in the residuals (N, 8 c)."""
    about = p - p.mean(0)
    linear = FIELD_PX * np.concatenate([np.ones((len(p), 1)), about / np.maximum(np.abs(about).max(0), 1e-12)], -1)
    px = np.einsum("nk,ij->nikj", linear, np.eye(2)).reshape(len(p), 2, -1)
    return np.concatenate([left_by(system, i, px) for i in range(len(cameras))], -1).reshape(system.e.size, -1)


def _hypotheses(
    cameras: Sequence[Camera], p: Array, velocity: Array, at: Array
) -> Iterator[tuple[str, dict[int, Array], float | None]]:
    """Each cause and, by camera, what px (n, 2, k) follow from it; the moment from which they do."""
    zooms = {}
    since = at - at.min()
    jumps = np.linspace(at.min(), at.max(), JUMPS + 1)[1:-1].tolist()
    for i, camera in enumerate(cameras):
        by = np.nan_to_num(derivatives(camera, p, camera.position, ()).by_parameter)
        zooms[i] = by[..., columns(camera, ["f"])] * camera.f
        v = np.nan_to_num(velocity[i])[..., None]
        yield "turned", {i: by[..., :3]}, None
        yield "late", {i: v}, None
        yield "fast", {i: v * since[:, None, None]}, None
        for moment in jumps:
            yield "jumped", {i: v * (at > moment)[:, None, None]}, moment
        yield "zoomed", {i: zooms[i]}, None
    yield "all zoomed", zooms, None


def likeliest(found: Sequence[Cause]) -> Cause:
    """The best of causes in their order, with every camera of which the same explains as much."""
    some = [c for c in found if abs(c.amount) < LARGEST.get(c.kind, np.inf)] or list(found)
    best = some[0]
    if best.evidence < EVIDENT:
        best = next((c for c in some if c.evidence >= EVIDENT and c.share >= NEARLY * best.share), best)
    if best.kind == "all zoomed":
        return best
    same = [c for c in some if c.kind == best.kind and c.from_s == best.from_s]
    alike = [c.cameras[0] for c in same if c.evidence >= AS_GOOD * best.evidence and c.share >= AS_GOOD * best.share]
    return best._replace(cameras=tuple(alike))
