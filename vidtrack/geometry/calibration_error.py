"""What the cameras' calibration errors do to located points.

On the plane at unit distance an error dk of a camera's parameters moves what it sees by D dk, D = d(u, v)/dk; the
points follow by H = dp/d(u, v). Together the cameras' errors, of covariance C, add to the covariance of a point

    S = sum over pairs of cameras a, b of H_a D_a C_ab D_b^T H_b^T

Turning the camera by omega about a pivot moves c, at the depth z, by omega x arm (`geometry.jacobian` has the whole
derivation); the rest follows from Xu = f u and the lens, taken at the measured pixel. That needs no inverse of the
lens, and differs by a second-order term from the same at the projected one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, straightened
from vidtrack.geometry.lens_terms import TERMS
from vidtrack.geometry.projection import perspective_by_f, perspective_jacobian
from vidtrack.geometry.refracted import POSE, pose_moves, tangent_moves
from vidtrack.geometry.sights import Sight
from vidtrack.geometry.symmetric import ELEMENTS


class CameraUncertainty(Protocol):
    """How well a camera is known: covariance (k, k) of the parameters `names`, turned about `pivot` (3,)."""

    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def pivot(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...


class CalibrationErrors:
    """What is known of the cameras' calibration errors."""

    def __init__(
        self, cameras: Sequence[Camera], uncertainties: Sequence[CameraUncertainty | None], joint: ArrayLike | None
    ) -> None:
        self.known = [(i, cameras[i], u) for i, u in enumerate(uncertainties) if u is not None]
        sizes = [len(u.names) for _, _, u in self.known]
        edges = np.cumsum([0, *sizes])
        C = None if joint is None else np.asarray(joint, float)
        if C is not None and C.shape != (edges[-1], edges[-1]):
            raise ValueError(f"the joint covariance must be ({edges[-1]}, {edges[-1]}), not {C.shape}")
        self.covariance: dict[tuple[int, int], Array] = {}
        for a, (_, _, u) in enumerate(self.known):
            for b in range(a, len(self.known)):
                if C is not None:
                    block = C[edges[a] : edges[a + 1], edges[b] : edges[b + 1]]
                    self.covariance[a, b] = np.ascontiguousarray(block)
                elif a == b:
                    self.covariance[a, b] = np.asarray(u.covariance, float)

    def carried(self, sights: Sequence[Sight], p: Array, gains: Sequence[Array], origin: Array) -> Array:
        """What it adds to the covariance, (6, n), of points p (3, n), relative to origin (3,).

        gains   dp/d(Xf, Yf) of each camera, (2, 3, n), 0 where a camera is not used
        """
        S = np.zeros((6, p.shape[1]))
        if not self.known:
            return S
        D = [by_parameter(camera, sights[i], p, u.pivot - origin, u.names, origin) for i, camera, u in self.known]
        K = self._seen(D)
        H = np.concatenate([_by_tangent(sights[i], gains[i]) for i, _, _ in self.known])
        KH = np.empty_like(H)
        for row, out in zip(K, KH, strict=True):
            np.einsum("an,ain->in", row, H, out=out)
        for k, (i, j) in enumerate(ELEMENTS):
            np.einsum("an,an->n", H[:, i], KH[:, j], out=S[k])
        return S

    def _seen(self, D: Sequence[Array]) -> Array:
        """Covariance (2 m, 2 m, n) of what the m cameras see, tangents."""
        n = D[0].shape[-1]
        K = np.zeros((len(D), 2, len(D), 2, n))
        room = np.empty((max(d.shape[1] for d in D), n))
        for (a, b), C in self.covariance.items():
            for j in (0, 1):
                follows = np.matmul(C, D[b][j], out=room[: len(C)])
                for i in (0, 1) if a != b else range(j + 1):
                    np.einsum("kn,kn->n", D[a][i], follows, out=K[a, i, b, j])
                    K[b, j, a, i] = K[a, i, b, j]
        return K.reshape(2 * len(D), 2 * len(D), n)


def _by_tangent(s: Sight, gain: Array) -> Array:
    """dp/d(u, v), (2, 3, n), from dp/d(Xf, Yf)."""
    (xu, xv), (yu, yv) = s.px
    H = np.empty_like(gain)
    np.add(xu * gain[0], yu * gain[1], out=H[0])
    np.add(xv * gain[0], yv * gain[1], out=H[1])
    return H


def by_parameter(
    camera: Camera, s: Sight, p: Array, pivot: Array, names: Sequence[str], origin: Array | None = None
) -> Array:
    """How the tangents u, v at which a camera sees points p (3, n) follow its parameters: (2, k, n).

    p and pivot (3,) are relative to the origin (3,) of the sight, by default that of the world. Finite, but of no
    meaning, where the sight is not used.
    """
    u, v = s.uv
    X, Y = s.d
    near = s.on / (s.R[2] @ p + s.t[2])
    px, py, pz = s.R @ pivot + s.t
    arm_x, minus_y, arm_z = u - px * near, py * near - v, 1 - pz * near  # over the depth
    (xu, xv), (yu, yv) = s.px
    per = s.on / (xu * yv - xv * yu + (1 - s.on))
    right = yv * per, -yu * per  # d(u, v)/dXf
    r2, X_px, minus_f = X * X + Y * Y, X / camera.dx, -1 / camera.f
    wide = camera.projection == "equidistant"
    beside: Array | tuple[float, float] = (0.0, 0.0)
    if wide:
        e = np.nan_to_num(straightened(camera, s.d.T))
        beside, onwards = perspective_by_f(e, camera.f).T, perspective_jacobian(e, camera.f)
    terms: dict[str, Callable[[], tuple[Array | float, Array | float]]] = {
        "omega_x": lambda: (u * minus_y, v * minus_y - arm_z),
        "omega_y": lambda: (u * arm_x + arm_z, v * arm_x),
        "omega_z": lambda: (minus_y, arm_x),
        "t_x": lambda: (near, 0.0),
        "t_y": lambda: (0.0, near),
        "t_z": lambda: (-u * near, -v * near),
        "f": lambda: ((u - beside[0]) / camera.f, (v - beside[1]) / camera.f),
        "Sx": lambda: (right[0] * X_px, right[1] * X_px),
        "Cx": lambda: right,
        "Cy": lambda: (-xv * per, xu * per),
        "skew": lambda: (right[0] * Y / camera.dx, right[1] * Y / camera.dx),
    }
    if camera.through:
        terms |= _through(camera, s, p, np.array([px, py, pz]), names, np.zeros(3) if origin is None else origin)
    D = np.empty((2, len(names), p.shape[1]))
    for k, name in enumerate(names):
        if name in TERMS:
            D[0, k], D[1, k] = TERMS[name].shift(X, Y, r2)
            if wide:
                D[:, k] = np.einsum("nij,jn->in", onwards, D[:, k])
            D[:, k] *= minus_f
        else:
            D[0, k], D[1, k] = terms[name]()
    return D


def _through(
    camera: Camera, s: Sight, p: Array, pivot: Array, names: Sequence[str], origin: Array
) -> dict[str, Callable[[], tuple[Array, Array]]]:
    """What differs in `by_parameter` through interfaces: pose and interfaces; pivot (3,) in camera coordinates."""
    own = [name for name in names if "." in name]
    by_centre, by_interface = tangent_moves(camera, s.uv, p, origin, own)
    pose = pose_moves(np.moveaxis(s.uv, 0, -1), np.moveaxis(by_centre, -1, 0) @ camera.R.T, pivot)
    moves = {name: np.moveaxis(pose[..., k], -1, 0) for k, name in enumerate(POSE)}
    moves |= {name: by_interface[:, k] for k, name in enumerate(own)}
    return {name: lambda move=move: tuple(np.where(s.seen, move, 0.0)) for name, move in moves.items()}  # type: ignore[misc]
