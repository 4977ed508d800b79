"""How far lines of sight miss the points located from them, beside what noise and calibration lead to expect; and why.

A point p located from the pixels of several cameras leaves, in units of the centroids' standard deviation,

    e = H (noise + D k),     H = 1 - P (P' P)^-1 P'

P = d(px)/dp, D = d(px)/d(parameters), k the calibration's error, of covariance C. Beside k, each cause is fitted alone:
one camera turned after its calibration, one lens or all at another zoom or focus, or one clock late. What a cause takes
away of the squared residuals is the evidence for it; what it moves the positions by, over their sigma, is what it
matters, however few px that is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.triangulate import Located, locate_points

MOST = 400
"""Samples, evenly spread over all targets, that are looked at."""

FEWEST = 10
"""Samples below which nothing is said."""

BIAS_PX = 0.015
"""ASSUME: what does not average away over a run: pixel locking, uneven light on a target, a plain lens model."""

LIKELY_TURN = 0.05
"""ASSUME: rad, a camera that was moved by accident turned by about as much. It keeps directions that the targets do not
show from being taken for large turns."""

LIKELY_ZOOM = 0.05
"""ASSUME: share of its focal length by which a lens differs that was zoomed or focused again after its calibration."""

LIKELY_LATE_S, LIKELY_READOUT_S = 0.5, 0.05
"""ASSUME: s, how late a clock and how long a read-out is before anything is known of it."""

LARGEST_TURN = 15.0
"""deg; a camera that turned by more does not show the targets where they were: the turn stands for something else."""

LARGEST_ZOOM = 0.2
"""Of its focal length; where a few px are missed, a lens that was zoomed by more stands for something else."""

LIKELY = {"turned": LIKELY_TURN, "late": np.inf, "zoomed": LIKELY_ZOOM, "all zoomed": LIKELY_ZOOM}

AS_GOOD = 0.95
"""Causes that explain this share of what the best one explains are as likely."""


class Cause(NamedTuple):
    """One camera turned, by so many degrees, zoomed, by such a share, or its clock late, by so many s, and its worth.

    kind     turned | late | zoomed | all zoomed
    cameras  the camera; and those that explain as much; all where they are meant together
    share    of the excess of squared misses that it explains
    evidence chi squared that it takes away, of samples whose errors are not independent
    moved    rms of what it moves the positions by, over sigma
    """

    kind: str
    cameras: tuple[int, ...]
    amount: float
    sd: float
    share: float
    evidence: float
    moved: float


class Misses(NamedTuple):
    """What `sight_misses` returns.

    n            samples looked at
    px           (n_cameras,) rms residual of each camera, px
    expected_px  (n_cameras,) the same as noise and calibration lead to expect
    beyond       rms of the position errors that the residuals stand for, over sigma
    cause        the likeliest
    readout      of a rolling shutter, beside turns and late clocks
    """

    n: int
    px: Array
    expected_px: Array
    beyond: float
    cause: Cause
    readout: Array  # (n_cameras, 2) s and its standard error: what is left of each camera's read-out; see `_readouts`


class _Motion(NamedTuple):
    """The n samples that are looked at, by camera."""

    b: Array  # (c, n, 2) px
    velocity: Array  # (c, n, 2) px/s
    acceleration: Array  # (c, n, 2) px/s^2
    share: Array  # (c, n) of the read-out
    sd: Array  # (c, n, 2) px


class _System(NamedTuple):
    """n samples of c cameras; pixels in units of their standard deviation, 0 where a camera is not used."""

    e: Array  # (n, 2 c)
    H: Array  # (n, 2 c, 2 c)
    G: Array  # (n, 3, 2 c) dp / d(px)
    sd: Array  # (n, 2 c) px
    sigma2: Array  # (n,) squared sigma of the point, world units


def sight_misses(
    cameras: Sequence[Camera],
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    located: Located,
    b: Array,
    sd: Array,
    at: Array,
    shares: Array | None = None,
) -> Misses | None:
    """How the residuals of a run go with what is known of noise and calibration; None for fewer than ten samples.

    joint   (k, k) covariance of the parameters of all cameras with an uncertainty; None: cameras are independent
    b, sd   (n_cameras, m, T, 2)  px, at (T,) s
    shares  (n_cameras, m, T) of each camera's read-out after which a sample was seen; None: no read-out is estimated
    """
    used = np.isfinite(located.error[..., 0]) & ~located.left_out & np.isfinite(located.sigma[..., 0])
    where = np.argwhere(used.sum(0) >= 2)
    if len(where) < FEWEST:
        return None
    target, moment = where[np.linspace(0, len(where) - 1, min(len(where), MOST)).round().astype(int)].T
    on = used[:, target, moment]
    p = located.point[target, moment]
    system = _system(cameras, p, located, target, moment, on, sd)
    A, C = _calibration(cameras, uncertainties, joint, p, system)
    px = _by_camera(system.e**2 * system.sd**2, on)
    variance = np.einsum("njj->nj", system.H) + np.einsum("njk,kl,njl->nj", A, C, A)
    expected = _by_camera(variance * system.sd**2, on)
    spare = 2 * on.sum(0) / (2 * on.sum(0) - 3)
    implied = np.einsum("nij,nj->n", system.G**2, system.e**2) * spare
    beyond = float(np.sqrt(implied.mean() / system.sigma2.mean()))
    velocity = np.gradient(b, at, axis=2)[:, target, moment] if at.size > 1 else np.zeros((*on.shape, 2))
    cause = _likeliest(_causes(cameras, system, p, velocity, A, C))
    readout = np.full((len(cameras), 2), np.nan)
    if shares is not None:
        acceleration = np.gradient(np.gradient(b, at, axis=2), at, axis=2)[:, target, moment]
        own = _Motion(b[:, target, moment], velocity, acceleration, shares[:, target, moment], sd[:, target, moment])
        readout = _readouts(cameras, own, p, on, (A, C))
    return Misses(len(p), px, expected, beyond, cause, readout)


def _system(
    cameras: Sequence[Camera],
    p: Array,
    located: Located,
    target: NDArray[np.intp],
    moment: NDArray[np.intp],
    on: NDArray[np.bool_],
    sd: Array,
) -> _System:
    weight = np.where(on[..., None], 1 / np.nan_to_num(sd[:, target, moment], nan=1.0), 0.0)
    P = np.stack([derivatives(camera, p, camera.position, ()).by_point for camera in cameras])
    P = _rows(np.nan_to_num(P) * weight[..., None])
    e = _rows(np.nan_to_num(located.error[:, target, moment]) * weight)
    G = np.asarray(np.linalg.pinv(P), float)
    H = np.eye(P.shape[1]) - P @ G
    counts = _rows(np.sign(weight))
    H = H * counts[:, None] * counts[:, :, None]
    px = _ratio(np.ones_like(weight), weight)
    sigma2 = (located.sigma[target, moment] ** 2).sum(-1)
    return _System(np.einsum("nij,nj->ni", H, e), H, G, _rows(px), sigma2)


def _ratio(a: Array, b: Array) -> Array:
    """a over b; 0 where b is 0."""
    return np.asarray(np.where(b > 0, a / np.where(b > 0, b, 1.0), 0.0))


def _rows(by_camera: Array) -> Array:
    """(c, n, 2, ...) as (n, 2 c, ...)."""
    moved = np.moveaxis(by_camera, 0, 1)
    return np.asarray(moved.reshape(moved.shape[0], -1, *moved.shape[3:]))


def _by_camera(squares: Array, on: NDArray[np.bool_]) -> Array:
    """Root of the mean over the samples that each camera has part in, of squares (n, 2 c)."""
    total = squares.reshape(len(squares), -1, 2).sum((0, 2))
    return np.asarray(np.sqrt(total / np.maximum(2 * on.sum(1), 1)))


def _through(system: _System, camera: int, columns: Array) -> Array:
    """What px (n, 2, k) of one camera leave in the residuals (n, 2 c, k)."""
    rows = slice(2 * camera, 2 * camera + 2)
    sd = system.sd[:, rows, None]
    return system.H[:, :, rows] @ _ratio(columns, sd)


def _calibration(
    cameras: Sequence[Camera],
    uncertainties: Sequence[CameraUncertainty | None],
    joint: Array | None,
    p: Array,
    system: _System,
) -> tuple[Array, Array]:
    """How residuals follow the parameters (n, 2 c, k), and the parameters' covariance (k, k)."""
    parts, blocks = [np.zeros((*system.e.shape, 0))], [np.zeros((0, 0))]
    for i, (camera, known) in enumerate(zip(cameras, uncertainties, strict=True)):
        if known is not None:
            which = columns(camera, known.names)
            moved = np.nan_to_num(derivatives(camera, p, known.pivot).by_parameter[..., which])
            parts.append(_through(system, i, moved))
            blocks.append(np.asarray(known.covariance, float))
    A = np.concatenate(parts, -1)
    if joint is not None:
        return A, np.nan_to_num(joint)
    C, edge = np.zeros((A.shape[-1],) * 2), 0
    for block in blocks:
        C[edge : edge + len(block), edge : edge + len(block)] = np.nan_to_num(block)
        edge += len(block)
    return A, C


def _root(C: Array) -> Array:
    """L with L L' = C, also where C is singular."""
    values, vectors = np.linalg.eigh(C / np.sqrt(_scales(C)) / np.sqrt(_scales(C))[:, None])
    root: Array = np.sqrt(_scales(C))[:, None] * vectors * np.sqrt(np.maximum(values, 0))
    return root


def _scales(C: Array) -> Array:
    return np.maximum(np.diag(C), 1e-300)


def _causes(cameras: Sequence[Camera], system: _System, p: Array, velocity: Array, A: Array, C: Array) -> list[Cause]:
    """Every camera turned or zoomed, every clock late, each fitted alone beside the calibration's error; best first."""
    AL = A.reshape(system.e.size, len(C)) @ _root(C)
    N = AL.T @ AL + np.eye(len(C))  # the calibration's error in units of its own covariance
    e = system.e.ravel()
    expected = float(np.einsum("njj->", system.H))
    before = float(e @ e - AL.T @ e @ np.linalg.solve(N, AL.T @ e))
    evidence = 1 / (1 + len(p) * BIAS_PX**2 / float(np.median(system.sd[system.sd > 0])) ** 2)
    found = []
    for kind, follows in _hypotheses(cameras, p, velocity):
        X = sum(_through(system, i, px) for i, px in follows.items()).reshape(e.size, -1)  # type: ignore[union-attr]
        S = X.T @ X - X.T @ AL @ np.linalg.solve(N, AL.T @ X) + np.eye(X.shape[1]) / LIKELY[kind] ** 2
        g = X.T @ e - X.T @ AL @ np.linalg.solve(N, AL.T @ e)
        inverse = np.linalg.pinv(S, rcond=1e-10, hermitian=True)
        x, gain = inverse @ g, float(g @ inverse @ g)
        size = float(np.linalg.norm(x)) or 1e-300
        spread = float(np.sqrt(np.maximum(x @ inverse @ x, 0.0))) / size * max((before - gain) / expected, 1.0) ** 0.5
        px = sum(_whitened(system, i, own @ x) for i, own in follows.items())
        moved = np.einsum("nij,nj->ni", system.G, px)
        ratio = float(np.sqrt((moved**2).sum(-1).mean() / system.sigma2.mean()))
        amount, unit = (size, 180 / np.pi) if kind == "turned" else (float(x[0]), 1.0)
        share = min(gain / max(before - expected, gain, 1e-300), 1.0)
        found.append(Cause(kind, tuple(follows), amount * unit, spread * unit, share, gain * evidence, ratio))
    # a turn has three numbers to explain with, the others have one
    return sorted(found, key=lambda cause: -cause.evidence * (AS_GOOD if cause.kind == "turned" else 1.0))


def _hypotheses(cameras: Sequence[Camera], p: Array, velocity: Array) -> Iterator[tuple[str, dict[int, Array]]]:
    """Each cause and, by camera, what px (n, 2, k) follow from it."""
    zooms = {}
    for i, camera in enumerate(cameras):
        by = np.nan_to_num(derivatives(camera, p, camera.position, ()).by_parameter)
        zooms[i] = by[..., columns(camera, ["f"])] * camera.f
        yield "turned", {i: by[..., :3]}
        yield "late", {i: np.nan_to_num(velocity[i])[..., None]}
        yield "zoomed", {i: zooms[i]}
    yield "all zoomed", zooms


def _readouts(
    cameras: Sequence[Camera], motion: _Motion, p: Array, on: NDArray[np.bool_], known: tuple[Array, Array]
) -> Array:
    """Each camera's read-out and its standard error (n_cameras, 2), s, fitted beside all turns and late clocks.

    A target that stays in the same rows shows no more than a late clock, and cameras that all see it in the same rows
    show only how their read-outs differ: the standard error shows that. Linear in small delays, and so
    repeated with what was found taken out.
    """
    velocity, acceleration = np.nan_to_num(motion.velocity), np.nan_to_num(motion.acceleration)
    share, (A, C) = np.nan_to_num(motion.share, nan=0.5), known
    every, sample = np.zeros(len(p), np.intp), np.arange(len(p))
    AL = A.reshape(A.shape[0] * A.shape[1], len(C)) @ _root(C)
    total, sd = np.zeros(len(cameras)), np.zeros(len(cameras))
    for _ in range(4):
        d = (total[:, None] * share)[..., None]
        moved = np.where(on[..., None], motion.b - velocity * d + acceleration * d**2 / 2, np.nan)[:, None]
        located = locate_points(list(cameras), moved, sd=motion.sd[:, None])
        good = np.isfinite(located.point[0]).all(-1)
        if good.sum() < FEWEST:
            return np.full((len(cameras), 2), np.nan)
        p = np.where(good[:, None], located.point[0], p)
        system = _system(cameras, p, located, every, sample, on & good, motion.sd[:, None])
        step, sd = _readout_step(cameras, system, p, velocity - acceleration * d, share, AL)
        total = total + step
    return np.stack([total, sd], -1)


def _readout_step(
    cameras: Sequence[Camera], system: _System, p: Array, velocity: Array, share: Array, AL: Array
) -> tuple[Array, Array]:
    """How much longer each read-out is than supposed, (n_cameras,) s, and its standard error.

    AL   (2 c n, k)  how residuals follow the calibration's error in units of its own covariance
    """
    N = AL.T @ AL + np.eye(AL.shape[1])
    e = system.e.ravel()
    columns, prior = [], []
    for i, camera in enumerate(cameras):
        v = velocity[i][..., None]
        turn = np.nan_to_num(derivatives(camera, p, camera.position, ()).by_parameter[..., :3])
        columns.append(_through(system, i, np.concatenate([turn, v, v * share[i][:, None, None]], -1)))
        prior += [1 / LIKELY_TURN**2] * 3 + [1 / LIKELY_LATE_S**2, 1 / LIKELY_READOUT_S**2]
    X = np.concatenate(columns, -1).reshape(e.size, -1)
    S = X.T @ X - X.T @ AL @ np.linalg.solve(N, AL.T @ X) + np.diag(prior)
    g = X.T @ e - X.T @ AL @ np.linalg.solve(N, AL.T @ e)
    x = np.linalg.solve(S, g)
    before = float(e @ e - AL.T @ e @ np.linalg.solve(N, AL.T @ e))
    left = max((before - float(g @ x)) / float(np.einsum("njj->", system.H)), 1.0)
    fast = max(float(np.sqrt((velocity**2).sum(-1).mean())), 1e-9)
    sd = np.sqrt(np.diag(np.linalg.inv(S)) * left + (BIAS_PX / fast) ** 2)
    return np.asarray(x[4::5], float), np.asarray(sd[4::5], float)


def _whitened(system: _System, camera: int, px: Array) -> Array:
    """Px (n, 2) of one camera as rows (n, 2 c) in units of its standard deviation."""
    out = np.zeros_like(system.e)
    rows = slice(2 * camera, 2 * camera + 2)
    sd = system.sd[:, rows]
    out[:, rows] = _ratio(px, sd)
    return out


def _likeliest(causes: Sequence[Cause]) -> Cause:
    """The best cause, with every camera of which the same explains as much."""
    largest = {"turned": LARGEST_TURN, "zoomed": LARGEST_ZOOM, "all zoomed": LARGEST_ZOOM}
    causes = [c for c in causes if abs(c.amount) < largest.get(c.kind, np.inf)] or list(causes)
    best = causes[0]
    if best.kind == "all zoomed":
        return best
    alike = [c.cameras[0] for c in causes if c.kind == best.kind and c.evidence >= AS_GOOD * best.evidence]
    return best._replace(cameras=tuple(alike))
