"""The pose of a rigid body from where cameras see its points, one camera or several, with its covariance.

    minimise over origin and R   sum |b - project(camera, origin + R a)|^2 / sd^2

for all times at once, by Gauss-Newton with damping. A plane seen by one camera has a second, tipped pose that explains
its picture nearly as well (Schweighofer and Pinz 2006): its normal is mirrored about the line of sight. Both are
refined, and the difference of their misfits says how sure the choice is. The covariance holds the corners' noise and
the calibration's, which is the same for all times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.rotation import rotation_from_vector


@dataclass(frozen=True)
class Fitting:
    """How poses are fitted.

    steps     of Gauss-Newton, at most
    settled   a step below this share of the sd of each parameter ends it
    tips      times that a pose is tipped to find the other one
    alike     rad, and alike_sd standard deviations of the turn: two poses that are nearer than both are one
    odds      nats: the second pose must be less likely than the first by exp(-odds / 2) to be refused
    bent      of a quadratic misfit at two sd: beyond it the covariance no longer describes what the pose may be
    """

    steps: int = 25
    settled: float = 1e-3
    tips: int = 3
    alike: float = 1e-4
    alike_sd: float = 0.2
    odds: float = 15.0
    bent: float = 1.6


FITTING = Fitting()


class Placed(NamedTuple):
    """Further m points of the body that were located otherwise, at T times."""

    body: Array  # (m, 3) world units, in the body's axes
    p: Array  # (T, m, 3) world units; NaN where it was not located
    precision: Array  # (T, m, 3, 3)

    def at(self, which: NDArray[np.intp]) -> Placed:
        return Placed(self.body, self.p[which], self.precision[which])


class Sightings(NamedTuple):
    """What C cameras see of n points of a body at T times: b and sd are (C, T, n, 2) px, NaN where not seen."""

    cameras: Sequence[Camera]
    b: Array
    sd: Array
    body: Array  # (n, 3) world units, in the body's axes
    placed: Placed | None = None

    def at(self, which: NDArray[np.intp]) -> Sightings:
        """The same at some of the times."""
        placed = self.placed.at(which) if self.placed else None
        return self._replace(b=self.b[:, which], sd=self.sd[:, which], placed=placed)


class SightedPose(NamedTuple):
    """Poses at T times; NaN where there are too few sightings.

    covariance  (T, 6, 6) of small turns about the world axes (rad) and of the origin (world units), noise alone
    by_camera   for each camera (T, 6, k): how the pose follows the parameters of its calibration; None without one
    chi2        (T,) sum of squared misfits over sd
    spare       (T,) measurements beyond the six that a pose takes
    rms_px      (T,) of the misfits
    per_px      (T,) world units that a px spans at the body
    unsure      (T,) the second pose explains the pictures nearly as well, or the covariance does not describe it
    """

    origin: Array
    R: Array
    covariance: Array
    by_camera: list[Array | None]
    chi2: Array
    spare: NDArray[np.intp]
    rms_px: Array
    per_px: Array
    unsure: NDArray[np.bool_]


def sighted_pose(
    seen: Sightings, starts: tuple[Array, Array], known: Sequence[CameraUncertainty | None] | None = None
) -> SightedPose:
    """The likeliest pose at every time, and whether the next one is out of the question.

    starts   origin (T, 3) and R (T, 3, 3) of a pose nearby, NaN where there is none (see `motion.planar_start`)
    known    of each camera, how well it is calibrated
    """
    found = _found(seen, _settled(seen, *starts))
    best = _likeliest(found)
    at = _normal(seen, best.origin, best.R)
    good = np.isfinite(best.chi2) & (at.measured >= 6)
    covariance = np.full((len(good), 6, 6), np.nan)
    covariance[good] = _inverse(at.N[good])
    good &= np.isfinite(covariance).all((-1, -2))
    turn_sd = np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2))
    unsure = good & (_rivalled(found, best, turn_sd) | _bent(seen, best, covariance, good))
    corners = np.isfinite(seen.b).sum((0, 2, 3)) / 2
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = np.sqrt(at.square / np.maximum(corners, 1))
    one = np.where(good, 1.0, np.nan)
    return SightedPose(
        best.origin * one[:, None],
        best.R * one[:, None, None],
        covariance * one[:, None, None],
        _by_camera(seen, best, covariance, known),
        best.chi2 * one,
        at.measured - 6,
        rms * one,
        at.per_px * one,
        unsure,
    )


def with_calibration(pose: SightedPose, known: Sequence[CameraUncertainty | None] | None, joint: Array | None) -> Array:
    """Covariances (T, 6, 6) with what the cameras' calibration adds.

    joint   covariance of the parameters of all cameras that have an uncertainty, one after the other; None: of each
            camera by itself
    """
    used = [(S, u) for S, u in zip(pose.by_camera, known or [], strict=False) if S is not None and u is not None]
    if not used:
        return pose.covariance
    if joint is not None and joint.shape[0] == sum(len(u.names) for _, u in used):
        S = np.concatenate([S for S, _ in used], -1)
        return np.asarray(pose.covariance + S @ joint @ np.swapaxes(S, -1, -2))
    total = pose.covariance
    for S, u in used:
        total = total + S @ np.asarray(u.covariance, float) @ np.swapaxes(S, -1, -2)
    return np.asarray(total)


class _Found(NamedTuple):
    origin: Array
    R: Array
    chi2: Array


class _Normal(NamedTuple):
    N: Array  # (T, 6, 6)
    g: Array  # (T, 6)
    chi2: Array  # (T,)
    square: Array  # (T,) px^2
    measured: NDArray[np.intp]  # (T,) coordinates
    per_px: Array  # (T,)


def _points(seen: Sightings, origin: Array, R: Array) -> Array:
    return np.asarray(origin[:, None] + seen.body @ np.swapaxes(R, -1, -2))


def by_pose_of(by_point: Array, arm: Array) -> Array:
    """Derivatives (T, n, k, 6) by a small turn about the world axes and by a shift, of those by the points.

    arm   (T, n, 3) from the body's origin to the points, world axes
    """
    x, y, z = by_point[..., 0], by_point[..., 1], by_point[..., 2]
    a, b, c = arm[..., None, 0], arm[..., None, 1], arm[..., None, 2]
    return np.stack(np.broadcast_arrays(b * z - c * y, c * x - a * z, a * y - b * x, x, y, z), -1)


def _normal(seen: Sightings, origin: Array, R: Array) -> _Normal:
    T = len(origin)
    N, g, chi2, square = np.zeros((T, 6, 6)), np.zeros((T, 6)), np.zeros(T), np.zeros(T)
    count, scale, weight = np.zeros(T, np.intp), np.zeros(T), np.zeros(T)
    p = _points(seen, origin, R)
    arm = p - origin[:, None]
    for camera, b, sd in zip(seen.cameras, seen.b, seen.sd, strict=True):
        at = derivatives(camera, p, np.zeros(3))
        used = np.isfinite(b) & np.isfinite(sd)
        behind = (used & ~np.isfinite(at.projected)).any((-1, -2))
        r = np.where(used, (b - at.projected) / sd, 0.0)
        J = np.where(used[..., None], by_pose_of(at.by_point, arm) / sd[..., None], 0.0)
        N += np.einsum("tnik,tnil->tkl", J, J)
        g += np.einsum("tnik,tni->tk", J, r)
        chi2 += np.where(behind, np.inf, (r * r).sum((-1, -2)))
        square += np.where(used, (b - at.projected) ** 2, 0.0).sum((-1, -2))
        count += used.sum((-1, -2))
        gain = np.linalg.norm(at.by_point, axis=(-1, -2)) / 2**0.5
        scale += np.where(used.all(-1), gain, 0.0).sum(-1)
        weight += used.all(-1).sum(-1)
    if seen.placed is not None:
        turned = seen.placed.body @ np.swapaxes(R, -1, -2)
        miss = seen.placed.p - origin[:, None] - turned
        there: NDArray[np.bool_] = np.asarray(np.isfinite(miss).all(-1))
        W = np.where(there[..., None, None], seen.placed.precision, 0.0)
        miss = np.where(there[..., None], miss, 0.0)
        J = by_pose_of(np.broadcast_to(np.eye(3), (*miss.shape, 3)), turned)
        N += np.einsum("tmik,tmij,tmjl->tkl", J, W, J)
        g += np.einsum("tmik,tmij,tmj->tk", J, W, miss)
        chi2 += np.einsum("tmi,tmij,tmj->t", miss, W, miss)
        count += np.where(count >= 6, 3 * there.sum(-1), 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return _Normal(N, g, chi2, square, count, weight / scale)


def _settled(seen: Sightings, origin: Array, R: Array) -> _Found:
    """Gauss-Newton with damping from a start at every time; chi2 is infinite where there is none."""
    origin, R = origin.copy(), R.copy()
    alive: NDArray[np.bool_] = np.asarray(np.isfinite(origin).all(-1) & np.isfinite(R).all((-1, -2)))
    origin[~alive], R[~alive] = 0.0, np.eye(3)
    at = _normal(seen, origin, R)
    at.chi2[~alive | ~np.isfinite(at.chi2)] = np.inf
    damping = np.full(len(origin), 1e-3)
    todo = np.flatnonzero(np.isfinite(at.chi2) & (at.measured >= 6))
    N, g, chi2 = at.N, at.g, at.chi2
    for _ in range(FITTING.steps):
        if not todo.size:
            break
        D = np.einsum("tkk->tk", N[todo])
        M = N[todo] + (damping[todo, None] * D + 1e-12 * D.max(-1, keepdims=True))[..., None] * np.eye(6)
        step = np.linalg.solve(M, g[todo][..., None])[..., 0]
        step[:, :3] *= np.minimum(1.0, 0.5 / np.maximum(np.linalg.norm(step[:, :3], axis=-1), 1e-12))[:, None]
        new_R = rotation_from_vector(step[:, :3]) @ R[todo]
        new_origin = origin[todo] + step[:, 3:]
        part = seen.at(todo)
        trial = _normal(part, new_origin, new_R)
        better = trial.chi2 <= chi2[todo] * (1 + 1e-12)
        took = todo[better]
        small = (np.abs(step) * np.sqrt(np.maximum(D, 0)) < FITTING.settled).all(-1)
        R[took], origin[took] = new_R[better], new_origin[better]
        N[took], g[took], chi2[took] = trial.N[better], trial.g[better], trial.chi2[better]
        damping[took] = np.maximum(damping[took] / 10, 1e-9)
        damping[todo[~better]] *= 10
        todo = todo[~small & (damping[todo] < 1e8)]
    lost = ~np.isfinite(chi2)
    origin[lost], R[lost] = np.nan, np.nan
    return _Found(origin, R, chi2)


def _tipped(seen: Sightings, origin: Array, R: Array) -> tuple[Array, Array]:
    """The other pose of a plane in one camera: the normal of the body's plane mirrored about the line of sight."""
    middle = seen.body.mean(0)
    normal = R @ np.linalg.svd(seen.body - middle)[2][-1]
    centre = origin + R @ middle
    most = np.array([np.isfinite(b).all(-1).sum(-1) for b in seen.b]).argmax(0)
    eyes = np.array([camera.position for camera in seen.cameras])[most]
    sight = centre - eyes
    sight = sight / np.linalg.norm(sight, axis=-1, keepdims=True)
    normal = normal * np.where((normal * sight).sum(-1, keepdims=True) > 0, -1.0, 1.0)
    sight = -sight
    axis = np.cross(normal, sight)
    sine, cosine = np.linalg.norm(axis, axis=-1), (normal * sight).sum(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axis = np.where(sine[:, None] > 1e-12, axis / sine[:, None], 0.0)
    turn = rotation_from_vector(np.nan_to_num(axis * 2 * np.arctan2(sine, cosine)[:, None]))
    other = turn @ R
    return centre - other @ middle, other


def _found(seen: Sightings, first: _Found) -> list[_Found]:
    """The poses that may be: the first, and what it tips into.

    A tipped pose may settle where it came from: what is found is tipped again.
    """
    found = [first]
    for _ in range(FITTING.tips):
        found.append(_settled(seen, *_tipped(seen, found[-1].origin, found[-1].R)))
    return found


def _likeliest(found: Sequence[_Found]) -> _Found:
    chi2 = np.stack([each.chi2 for each in found])
    rank, times = chi2.argmin(0), np.arange(chi2.shape[1])
    origin, R = np.stack([each.origin for each in found]), np.stack([each.R for each in found])
    return _Found(origin[rank, times], R[rank, times], chi2[rank, times])


def _rivalled(found: Sequence[_Found], best: _Found, turn_sd: Array) -> NDArray[np.bool_]:
    """Whether (T,) another of the poses, farther than its sd from the best, explains the pictures nearly as well."""
    out = np.zeros(len(best.chi2), bool)
    for each in found:
        with np.errstate(invalid="ignore"):
            apart = _angle(best.R, each.R) > np.maximum(FITTING.alike, FITTING.alike_sd * turn_sd)
            out |= apart & (each.chi2 - best.chi2 < FITTING.odds)
    return out


def _angle(a: Array, b: Array) -> Array:
    cosine = (np.einsum("tij,tij->t", a, b) - 1) / 2
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nan_to_num(np.arccos(np.clip(cosine, -1, 1))))


def _inverse(N: Array) -> Array:
    """Inverses of normal matrices, scaled; NaN where one cannot be inverted."""
    d = np.sqrt(np.maximum(np.einsum("tkk->tk", N), 1e-300))
    scaled = N / d[:, :, None] / d[:, None, :]
    good = np.linalg.cond(scaled) < 1e13
    out = np.linalg.inv(np.where(good[:, None, None], scaled, np.eye(6)))
    return np.where(good[:, None, None], out / d[:, :, None] / d[:, None, :], np.nan)


def _bent(seen: Sightings, best: _Found, covariance: Array, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where the misfit two sd away along the least sure turn is not that of a normal distribution."""
    out = np.zeros(len(good), bool)
    which = np.flatnonzero(good)
    if not which.size:
        return out
    C = covariance[which]
    values, vectors = np.linalg.eigh(C[:, :3, :3])
    part = seen.at(which)
    for sign in (-2.0, 2.0):
        turn = sign * np.sqrt(values[:, -1])[:, None] * vectors[:, :, -1]
        shift = (C[:, 3:, :3] @ np.linalg.solve(C[:, :3, :3], turn[..., None]))[..., 0]
        there = _normal(part, best.origin[which] + shift, rotation_from_vector(turn) @ best.R[which])
        rise = there.chi2 - best.chi2[which]
        with np.errstate(invalid="ignore"):
            out[which] |= ~((rise > 4 / FITTING.bent) & (rise < 4 * FITTING.bent))
    return out


def _by_camera(
    seen: Sightings, best: _Found, covariance: Array, known: Sequence[CameraUncertainty | None] | None
) -> list[Array | None]:
    """How the pose follows each camera's parameters: -(J^T W J)^-1 J^T W D."""
    answer: list[Array | None] = []
    p = _points(seen, best.origin, best.R)
    arm = p - best.origin[:, None]
    for i, (camera, b, sd) in enumerate(zip(seen.cameras, seen.b, seen.sd, strict=True)):
        u = known[i] if known else None
        if u is None:
            answer.append(None)
            continue
        at = derivatives(camera, p, u.pivot)
        used = (np.isfinite(b) & np.isfinite(sd))[..., None]
        J = np.where(used, by_pose_of(at.by_point, arm) / sd[..., None], 0.0)
        D = np.where(used, at.by_parameter[..., columns(camera, u.names)] / sd[..., None], 0.0)
        answer.append(-covariance @ np.einsum("tnik,tnil->tkl", J, D))
    return answer
