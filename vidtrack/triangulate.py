"""Where a point lies in the world, from where two or more cameras see it, and how well that is known.

Every camera gives two rows in the unknown point p (thesis 4.3.8, 4.3.9; u = Xu/f, v = Yu/f):

    (r1 - u r7) x + (r2 - u r8) y + (r3 - u r9) z = u Tz - Tx
    (r4 - v r7) x + (r5 - v r8) y + (r6 - v r9) z = v Tz - Ty

and the least-squares answer is p = (A^T A)^-1 A^T B (4.3.10 - 4.3.14). These rows count a pixel of a far camera
for more than one of a near camera; refinement then minimises the weighted reprojection error in px,
by Gauss-Newton steps on the same 3x3 normal equations. The lens is linearised at the measured pixel, so that a
step needs no inverse distortion; the difference from the exact pixel error is of second order in that error.

Points are worked in blocks that fit the processor's cache, coordinates on the first axis inside a block.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.camera import Array, Camera, distorted_from_frame_buffer, undistorted_from_distorted, undistorted_jacobian
from vidtrack.jacobian import PARAMETERS, derivatives

Mask = NDArray[np.bool_]

BLOCK = 8192
"""Points a block: some 40 arrays of this length stay in the second-level cache."""

SYMMETRIC = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Order in which the six different elements of a symmetric 3x3 matrix are kept."""


class CameraUncertainty(Protocol):
    """How well a camera is known: covariance (k, k) of the parameters `names`, turned about `pivot` (3,)."""

    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def pivot(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...


class Fix(NamedTuple):
    """What `triangulate` returns."""

    point: Array  # (..., 3)
    miss: Array  # (...)
    n_cameras: NDArray[np.intp]  # (...)


class Located(NamedTuple):
    """What `locate_points` returns; world units and px."""

    point: Array  # (..., 3); NaN where there is no fix
    covariance: Array  # (..., 3, 3)
    sigma: Array  # (..., 3) square roots of the covariance's diagonal
    miss: Array  # (...) rms distance from the point to its lines of sight
    n_cameras: NDArray[np.intp]  # (...) cameras that the fix rests on; 0 where there is none
    left_out: Mask  # (n_cameras, ...) saw the target, but disagreed
    disagree: Mask  # (...) cameras disagree and nothing tells which is right: no fix
    error: Array  # (n_cameras, ..., 2) measured minus projected, px, for every camera that saw the target
    sd: float  # px: the centroid noise given (NaN where it varies) or found


def triangulate(origins: ArrayLike, directions: ArrayLike, *, min_angle_deg: float = 2.0) -> Fix:
    """Find the point nearest, in the least-squares sense, to several lines of sight.

    Exact lines would meet; measured ones pass close by. The rms distance that
    remains, the miss, tells how far to trust the fix.

    origins     (..., n_cameras, 3)  perspective centres, world units
    directions  (..., n_cameras, 3)  unit vectors; a row of NaN is a camera that lost the target
    Returns Fix(point (..., 3), miss (...), n_cameras (...)); NaN where fewer than two cameras saw the
    target or their lines are within min_angle_deg of parallel.
    Raises ValueError for shapes that do not match or a direction that is not a unit vector.
    Lines along x through (0, 0, 0) and along y through (0, 0, 2) give (0, 0, 1) with a miss of 1.
    """
    o, d = np.asarray(origins, float), np.asarray(directions, float)
    if d.ndim < 2 or o.ndim < 2 or d.shape[-1] != 3 or o.shape[-2:] != d.shape[-2:]:
        raise ValueError(f"origins and directions must be (..., n_cameras, 3), not {o.shape} and {d.shape}")
    o, d = np.broadcast_arrays(o, d)
    seen = np.isfinite(d).all(-1)
    if not np.allclose(np.sum(d * d, -1)[seen], 1, atol=1e-6):
        raise ValueError("directions must be unit vectors")
    d = np.where(seen[..., None], d, 0.0)
    # I - d d^T takes the part of a vector across the line
    across = (np.eye(3) - d[..., :, None] * d[..., None, :]) * seen[..., None, None]
    N = across.sum(-3)
    n = seen.sum(-1)
    good = (n >= 2) & (_largest_angle([d[..., i, :] for i in range(d.shape[-2])]) >= np.radians(min_angle_deg))
    N = np.where(good[..., None, None], N, np.eye(3))
    middle = o.mean(-2)  # solved about the cameras' middle: nothing is lost far from the world's origin
    arm = o - middle[..., None, :]
    p = np.linalg.solve(N, (across @ arm[..., None]).sum(-3))[..., 0]
    off = (across @ (p[..., None, :] - arm)[..., None])[..., 0]
    miss = np.sqrt(np.sum(off**2, (-1, -2)) / np.maximum(n, 1))
    return Fix(np.where(good[..., None], p + middle, np.nan), np.where(good, miss, np.nan), n)


def _largest_angle(directions: Sequence[Array]) -> Array:
    """The largest angle, rad, between any two of n unit vectors (..., 3) taken as lines; (0, 0, 0) is none."""
    sine2 = np.zeros(directions[0].shape[:-1])
    for a, b in combinations(directions, 2):
        seen = (a != 0).any(-1) & (b != 0).any(-1)
        sine2 = np.maximum(sine2, np.where(seen, 1 - np.sum(a * b, -1) ** 2, 0))
    return np.arcsin(np.sqrt(np.clip(sine2, 0, 1)))


def locate_points(
    cameras: Sequence[Camera],
    b: ArrayLike,
    *,
    sd: ArrayLike | None = None,
    uncertainties: Sequence[CameraUncertainty | None] | None = None,
    refine: bool = True,
    reject: float | None = None,
    min_angle_deg: float = 2.0,
) -> Located:
    """Locate points that several cameras see at the same moments, with the covariance of each.

    cameras        n_cameras of them
    b              (n_cameras, ..., 2)  frame buffer px; NaN where a camera lost the target
    sd             px, standard deviation of the centroids: a number, or its own leading axes as b's, so that
                   (n_cameras,) gives each camera its own. None: found from the reprojection errors of all points
                   together; sigma is NaN where fewer than 10 redundant measurements tell it
    uncertainties  a calibration uncertainty (or None) for each camera; adds to the covariance
    refine         minimise the weighted reprojection error instead of the thesis's algebraic one
    reject         px; where any camera's reprojection error is larger, the camera without which the others agree
                   best is left out. None: nothing is left out
    Returns Located. NaN where fewer than two cameras saw the target, their lines are within min_angle_deg of
    parallel, the point falls behind a camera, or cameras disagree and nothing tells which one errs (`disagree`;
    two cameras never can).
    Raises ValueError for fewer than two cameras or shapes that do not match.
    Equations 4.3.6 - 4.3.14. Two cameras at right angles, 0.25 in/px each and 0.1 px noise: sigma is .025 in across
    one line of sight only and .018 in where both see.
    """
    b = np.asarray(b, float)
    if len(cameras) < 2 or b.ndim < 2 or b.shape[0] != len(cameras) or b.shape[-1] != 2:
        raise ValueError(f"b must be (n_cameras, ..., 2) for at least two cameras, not {b.shape} for {len(cameras)}")
    if uncertainties is not None and len(uncertainties) != len(cameras):
        raise ValueError(f"{len(uncertainties)} uncertainties for {len(cameras)} cameras")
    shape = b.shape[1:-1]
    flat = b.reshape(len(cameras), -1, 2)
    weight = _weights(sd, b.shape).reshape(flat.shape) if sd is not None else np.broadcast_to(1.0, flat.shape)
    work = _Work(cameras, flat, weight, uncertainties, refine, np.sin(np.radians(min_angle_deg)))

    used = np.isfinite(flat).all(-1)
    solved = work.solve(used)
    left_out = np.zeros(used.shape, bool)
    disagree = np.zeros(used.shape[1], bool)
    scale = 1.0 if sd is not None else _noise(solved, used)
    if reject is not None:
        found = np.isfinite(solved.point).all(0)
        suspect = np.flatnonzero(found & (_size(solved.error, used) > reject))
        if suspect.size:
            keep, undecided = work.at(suspect).agreeing(used[:, suspect], reject, scale)
            left_out[:, suspect] = used[:, suspect] & ~keep
            disagree[suspect] = undecided
            again = suspect[left_out[:, suspect].any(0)]
            solved.put(again, work.at(again).solve(used[:, again] & ~left_out[:, again]))
    return _located(solved, used & ~left_out, left_out, disagree, scale, sd, shape)


def _weights(sd: ArrayLike, shape: tuple[int, ...]) -> Array:
    s = np.asarray(sd, float)
    if s.ndim > len(shape) or not (s[np.isfinite(s)] > 0).all():
        raise ValueError("sd must be positive, its leading axes as those of b")
    s = s.reshape(s.shape + (1,) * (len(shape) - s.ndim)) if s.ndim else s
    return np.broadcast_to(1 / s**2, shape)


class _Sight(NamedTuple):
    """One camera's measurements of a block of n points, about an origin amid the cameras."""

    R: Array  # (3, 3)
    t: Array  # (3,)
    u: Array  # (n,) tangents Xu/f, Yu/f; 0 where the target is lost
    v: Array
    px: tuple[tuple[Array, Array], tuple[Array, Array]]  # d(Xf, Yf)/d(u, v), each (n,)
    weight: Array  # (2, n) 1/px^2; 0 where the camera is not used
    seen: Mask  # (n,) whether there is a measurement at all


class _Solution:
    """Located points of a block or of all blocks, coordinates first."""

    def __init__(self, n_cameras: int, n: int) -> None:
        self.point = np.empty((3, n))
        self.noise = np.empty((6, n))  # covariance from centroid noise, SYMMETRIC order
        self.calibration = np.zeros((6, n))  # and from the calibration
        self.miss = np.empty(n)
        self.error = np.empty((n_cameras, 2, n))
        self.chi2 = np.empty(n)

    def put(self, where: slice | NDArray[np.intp], part: _Solution) -> None:
        for name, value in vars(part).items():
            getattr(self, name)[..., where] = value


class _Work(NamedTuple):
    """What is to be located: b and weight are (n_cameras, n, 2)."""

    cameras: Sequence[Camera]
    b: Array
    weight: Array
    uncertainties: Sequence[CameraUncertainty | None] | None
    refine: bool
    min_sine: float

    def at(self, which: NDArray[np.intp]) -> _Work:
        """The same for some of the points."""
        return self._replace(b=self.b[:, which], weight=self.weight[:, which])

    def solve(self, used: Mask) -> _Solution:
        """Locate all points from the cameras used (n_cameras, n), block by block."""
        n = used.shape[1]
        whole = _Solution(len(self.cameras), n)
        for start in range(0, n, BLOCK):
            part = slice(start, min(start + BLOCK, n))
            whole.put(part, self._block(part, used[:, part]))
        return whole

    def agreeing(self, used: Mask, reject: float, sd: float) -> tuple[Mask, Mask]:
        """The cameras (n_cameras, n) that agree within `reject` px, and where (n) nothing tells which ones do."""
        keep = used.copy()
        undecided = np.zeros(used.shape[1], bool)
        open_ = np.arange(used.shape[1])
        free = self._replace(uncertainties=None)
        while open_.size:
            chi2, size = free.at(open_)._leaving_one_out(keep[:, open_])
            order = np.argsort(chi2, axis=0, kind="stable")
            best = np.take_along_axis(chi2, order[:1], 0)[0]
            largest = np.take_along_axis(size, order[:1], 0)[0]
            second = np.take_along_axis(chi2, order[1:2], 0)[0]
            settled = largest <= reject
            # ASSUME: 9 in chi2 (odds of 90 to 1 between two explanations) decides which camera errs
            with np.errstate(invalid="ignore"):
                unclear = ~np.isfinite(best) | (settled & ~(second - best > 9 * sd**2))
            drop = ~unclear
            keep[order[0, drop], open_[drop]] = False
            undecided[open_[unclear]] = True
            open_ = open_[drop & ~settled]
        keep[:, undecided] = used[:, undecided]
        return keep, undecided

    def _leaving_one_out(self, used: Mask) -> tuple[Array, Array]:
        """Weighted sum of squares and largest error, px, of the rest, for each camera left out; inf where no fix."""
        chi2 = np.full(used.shape, np.inf)
        size = np.full(used.shape, np.inf)
        for camera in range(used.shape[0]):
            rest = used.copy()
            rest[camera] = False
            some = np.flatnonzero(used[camera] & (rest.sum(0) >= 2))
            solved = self.at(some).solve(rest[:, some])
            found = np.isfinite(solved.point).all(0)
            chi2[camera, some] = np.where(found, solved.chi2, np.inf)
            size[camera, some] = np.where(found, _size(solved.error, rest[:, some]), np.inf)
        return chi2, size

    def _block(self, part: slice, used: Mask) -> _Solution:
        origin = np.mean([camera.position for camera in self.cameras], 0)
        sights = [
            _sight(camera, self.b[i, part], self.weight[i, part], used[i], origin)
            for i, camera in enumerate(self.cameras)
        ]
        out = _Solution(len(self.cameras), used.shape[1])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            p, inverse = _linear(sights)
            if self.refine:
                p, inverse = _refined(sights, p)
            gains = [] if self.refine and self.uncertainties is None else _gains(sights, p, inverse, self.refine)
            out.noise[:] = inverse if self.refine else _spread(gains, sights)
            behind = np.zeros(used.shape[1], bool)
            for i, sight in enumerate(sights):
                out.error[i], depth = _error(sight, p)
                out.error[i][:, ~sight.seen] = np.nan
                behind |= used[i] & (depth <= 0)
            out.chi2[:] = sum(
                np.sum(s.weight * np.nan_to_num(e) ** 2, 0) for s, e in zip(sights, out.error, strict=True)
            )
            out.miss[:], sine = _miss(sights, p)
            out.point[:] = p + origin[:, None]
            lost = behind | (used.sum(0) < 2) | ~(sine >= self.min_sine)
        out.point[:, lost] = np.nan
        if self.uncertainties is not None:
            for camera, uncertainty, gain in zip(self.cameras, self.uncertainties, gains, strict=True):
                if uncertainty is not None:
                    out.calibration += _calibration(camera, uncertainty, out.point, gain)
        return out


def _sight(camera: Camera, b: Array, weight: Array, used: Mask, origin: Array) -> _Sight:
    d = distorted_from_frame_buffer(camera, b)
    u = undistorted_from_distorted(camera, d)
    seen = np.asarray(np.isfinite(u).all(-1))
    J = undistorted_jacobian(camera, d)
    with np.errstate(divide="ignore", invalid="ignore"):
        per = camera.f / (J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0])
        yu, yv = -J[..., 1, 0] * per / camera.dy, J[..., 0, 0] * per / camera.dy
        skewed = camera.skew * camera.dy / camera.dx
        xu = J[..., 1, 1] * per * (camera.Sx / camera.dx) + skewed * yu
        xv = -J[..., 0, 1] * per * (camera.Sx / camera.dx) + skewed * yv
    px = ((xu, xv), (yu, yv))
    w = weight.T * (used & seen)
    tangents = u.T / camera.f
    if not seen.all():
        for part in (*px[0], *px[1], tangents[0], tangents[1]):
            part[~seen] = 0
        w[:, ~seen] = 0
    return _Sight(camera.R, camera.R @ origin + camera.T, tangents[0], tangents[1], px, w, seen)


def _linear(sights: Sequence[_Sight]) -> tuple[Array, Array]:
    """Equations 4.3.8 - 4.3.13: the point (3, n) and (A^T A)^-1 (6, n)."""
    N = np.zeros((6, sights[0].u.size))
    h = np.zeros((3, sights[0].u.size))
    for R, t, u, v, _, weight, _ in sights:
        on = (weight[0] > 0).astype(float)
        for tangent, row, shift in ((u, R[0], t[0]), (v, R[1], t[1])):
            a = row[:, None] - R[2][:, None] * tangent
            _add_square(N, a * on, a)
            h += a * (on * (tangent * t[2] - shift))
    inverse = _inverse(N)
    return _times(inverse, h), inverse


def _refined(sights: Sequence[_Sight], p: Array) -> tuple[Array, Array]:
    """Gauss-Newton on the weighted reprojection error: the point (3, n) and its covariance (6, n)."""
    for _ in range(10):
        N = np.zeros((6, p.shape[1]))
        h = np.zeros_like(p)
        for sight in sights:
            (gx, gy), (ex, ey) = _rows(sight, p)
            for g, e, w in ((gx, ex, sight.weight[0]), (gy, ey, sight.weight[1])):
                wg = w * g
                _add_square(N, wg, g)
                h += wg * e
        inverse = _inverse(N)
        step = _times(inverse, h)
        p = p + step
        # step in standard deviations, squared; convergence is quadratic, so that 0.03 now is far below 0.001 after
        if not np.nanmax(np.sum(step * h, 0), initial=0.0) > 1e-3:
            break
    return p, inverse


def _rows(sight: _Sight, p: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """By-point derivatives of Xf and Yf, each (3, n) px per unit, and the measured minus projected px (n,)."""
    R = sight.R
    c = R @ p + sight.t[:, None]
    z = 1 / c[2]
    u, v = c[0] * z, c[1] * z
    a = (R[0][:, None] - R[2][:, None] * u) * z
    b = (R[1][:, None] - R[2][:, None] * v) * z
    (xu, xv), (yu, yv) = sight.px
    du, dv = sight.u - u, sight.v - v
    return (xu * a + xv * b, yu * a + yv * b), (xu * du + xv * dv, yu * du + yv * dv)


def _error(sight: _Sight, p: Array) -> tuple[Array, Array]:
    """Measured minus projected px (2, n), and depth (n,)."""
    c = sight.R @ p + sight.t[:, None]
    du, dv = sight.u - c[0] / c[2], sight.v - c[1] / c[2]
    (xu, xv), (yu, yv) = sight.px
    return np.stack([xu * du + xv * dv, yu * du + yv * dv]), c[2]


def _gains(sights: Sequence[_Sight], p: Array, inverse: Array, refined: bool) -> list[Array]:
    """How the point follows each camera's pixel: dp/d(Xf, Yf), (2, 3, n) world units per px, for each camera."""
    gains = []
    for sight in sights:
        (gx, gy), _ = _rows(sight, p)
        if refined:
            gains.append(np.stack([_times(inverse, sight.weight[0] * gx), _times(inverse, sight.weight[1] * gy)]))
            continue
        # 4.3.8 holds f u = depth * tangent: a tangent's error counts as many times as the point is deep
        c = sight.R @ p + sight.t[:, None]
        on = sight.weight[0] > 0
        a = _times(inverse, (sight.R[0][:, None] - sight.R[2][:, None] * sight.u) * (c[2] * on))
        b = _times(inverse, (sight.R[1][:, None] - sight.R[2][:, None] * sight.v) * (c[2] * on))
        (xu, xv), (yu, yv) = sight.px
        det = xu * yv - xv * yu
        gains.append(np.where(on, np.stack([(yv * a - yu * b) / det, (xu * b - xv * a) / det]), 0.0))
    return gains


def _spread(gains: Sequence[Array], sights: Sequence[_Sight]) -> Array:
    """Covariance (6, n) from centroid noise carried through the gains."""
    total = np.zeros((6, gains[0].shape[-1]))
    for gain, sight in zip(gains, sights, strict=True):
        for g, w in zip(gain, sight.weight, strict=True):
            _add_square(total, g * np.where(w > 0, 1 / w, 0.0), g)
    return total


def _calibration(camera: Camera, uncertainty: CameraUncertainty, point: Array, gain: Array) -> Array:
    """Covariance (6, n) that a camera's calibration brings: G J C J^T G^T."""
    columns = [PARAMETERS.index(name) for name in uncertainty.names]
    J = derivatives(camera, point.T, uncertainty.pivot).by_parameter[..., columns]
    pixel = np.einsum("nik,kl,njl->ijn", J, np.asarray(uncertainty.covariance, float), J, optimize=True)
    pixel = np.nan_to_num(pixel)
    total = np.zeros((6, point.shape[1]))
    for i, j in ((0, 0), (1, 1), (0, 1), (1, 0)):
        for k, (r, s) in enumerate(SYMMETRIC):
            total[k] += gain[i, r] * pixel[i, j] * gain[j, s]
    return total


def _miss(sights: Sequence[_Sight], p: Array) -> tuple[Array, Array]:
    """Rms distance (n,) from points to the lines of sight used, and the largest sine (n,) of an angle between two."""
    total = np.zeros(p.shape[1])
    lines = []
    for R, t, u, v, _, weight, _ in sights:
        on = weight[0] > 0
        c = R @ p + t[:, None]
        du, dv = c[0] - u * c[2], c[1] - v * c[2]
        length2 = 1 + u * u + v * v
        # |c x d|^2 / |d|^2 with d = (u, v, 1)
        total += on * (du * du + dv * dv + (v * du - u * dv) ** 2) / length2
        d = R.T @ np.stack([u, v, np.ones_like(u)]) * (on / np.sqrt(length2))
        lines.append(d)
    sine2 = np.zeros(p.shape[1])
    for a, b in combinations(lines, 2):
        # rounding near parallel is 1e-8 rad, far below any angle of use; a camera not used is (0, 0, 0)
        both = (a[2] * a[2] + a[0] * a[0] + a[1] * a[1] > 0) & (b[2] * b[2] + b[0] * b[0] + b[1] * b[1] > 0)
        sine2 = np.maximum(sine2, both * (1 - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) ** 2))
    n = sum((s.weight[0] > 0).astype(float) for s in sights)
    return np.sqrt(total / np.maximum(n, 1)), np.sqrt(np.maximum(sine2, 0))


def _add_square(N: Array, wa: Array, a: Array) -> None:
    """N += wa a^T for every point, kept as SYMMETRIC."""
    for k, (i, j) in enumerate(SYMMETRIC):
        N[k] += wa[i] * a[j]


def _inverse(N: Array) -> Array:
    """Inverse of symmetric 3x3 matrices (6, n) by cofactors; NaN or inf where singular."""
    xx, yy, zz, xy, xz, yz = N
    out = np.empty_like(N)
    np.subtract(yy * zz, yz * yz, out=out[0])
    np.subtract(xx * zz, xz * xz, out=out[1])
    np.subtract(xx * yy, xy * xy, out=out[2])
    np.subtract(xz * yz, xy * zz, out=out[3])
    np.subtract(xy * yz, xz * yy, out=out[4])
    np.subtract(xy * xz, xx * yz, out=out[5])
    out /= xx * out[0] + xy * out[3] + xz * out[4]
    return out


def _times(S: Array, h: Array) -> Array:
    """S h for symmetric 3x3 matrices (6, n) and vectors (3, n)."""
    xx, yy, zz, xy, xz, yz = S
    x, y, z = h
    return np.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z])


def _size(error: Array, used: Mask) -> Array:
    """The largest length, px (n,), of the errors (n_cameras, 2, n) of the cameras used."""
    length2 = np.where(used, error[:, 0] ** 2 + error[:, 1] ** 2, 0)
    size: Array = np.sqrt(length2.max(0))
    return size


def _noise(solved: _Solution, used: Mask) -> float:
    """The centroid noise, px, that the reprojection errors of all points together tell; outliers do not count.

    Each point has 2 n_cameras - 3 redundant measurements. NaN for fewer than 10 of them.
    """
    found = np.isfinite(solved.point).all(0)
    spare = 2.0 * used.sum(0)[found] - 3
    chi2 = solved.chi2[found]
    if spare.sum() < 10:
        return float("nan")
    variance = float(np.median(chi2 / spare)) / 0.6  # start: a little wide of the median of chi2 over its freedom
    for _ in range(20):
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * variance
        new = float(chi2[good].sum() / spare[good].sum())
        if abs(new - variance) <= 1e-9 * new:
            break
        variance = new
    return float(np.sqrt(variance))


def _located(
    solved: _Solution,
    used: Mask,
    left_out: Mask,
    disagree: Mask,
    scale: float,
    sd: ArrayLike | None,
    shape: tuple[int, ...],
) -> Located:
    point = solved.point
    point[:, disagree] = np.nan
    lost = np.isnan(point[0])
    S = np.where(lost, np.nan, solved.noise * scale**2 + solved.calibration)
    covariance = np.empty((point.shape[1], 3, 3))
    for k, (i, j) in enumerate(SYMMETRIC):
        covariance[:, i, j] = covariance[:, j, i] = S[k]
    n = np.where(lost, 0, used.sum(0))
    miss = np.where(lost & ~disagree, np.nan, solved.miss)
    given = float("nan") if sd is None or np.size(sd) != 1 else float(np.asarray(sd, float).item())
    return Located(
        np.ascontiguousarray(point.T).reshape(*shape, 3),
        covariance.reshape(*shape, 3, 3),
        np.sqrt(S[:3].T).reshape(*shape, 3),
        miss.reshape(shape),
        n.reshape(shape),
        left_out.reshape(-1, *shape),
        disagree.reshape(shape),
        np.moveaxis(solved.error, 1, -1).reshape(-1, *shape, 2),
        scale if sd is None else given,
    )
