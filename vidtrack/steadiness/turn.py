"""How a camera turned, by the shifts of its background: tilt, pan, roll and a small change of its focal length.

A camera that turns in its place moves every background, near or far, by one law: the ray of a pixel is turned and meets
the frame buffer again, through the same lens. A camera that is carried away moves near things more than far ones: what
that leaves unexplained widens the standard deviations. Where no camera is known, shift, roll and scale of the picture
stand for it, which is the same law for a long lens.

The law is fitted to the patches that agree with each other, which must be the most of those that were found, and not
all in one place: water, people and targets have other shifts, or none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    distorted_from_undistorted,
    frame_buffer_from_distorted,
    undistorted_from_camera,
    undistorted_from_distorted,
)
from vidtrack.steadiness.patches import spread_over


@dataclass(frozen=True)
class Agreement:
    """When patches agree.

    trials     pairs of patches of which each proposes a movement
    near_px    px from a proposal that is agreement, and by_shift its growth with the shift, for the curved part of
               the law
    sigmas     standard deviations from the fit that are agreement; floor_px: the least standard deviation of a patch
    least      patches that must agree; share: of those found; spread: see `spread_over`
    common_px  sd of what all patches share: compression keeps a still background where it was by so much
    """

    trials: int = 80
    near_px: float = 0.25
    by_shift: float = 0.02
    sigmas: float = 4.0
    floor_px: float = 0.01
    least: int = 6
    share: float = 0.5
    spread: float = 0.1
    common_px: float = 0.01


AGREEMENT = Agreement()
NO_ONE = "no one movement of the camera takes the patches to where they are found"


class Law(NamedTuple):
    """How a movement theta (4,) or (..., 4) displaces a background.

    place    positions (..., 2) px and theta: where that background lies after the movement, (..., 2) px
    rotates  whether the first three of theta are a rotation vector
    """

    place: Callable[[Array, Array], Array]
    rotates: bool

    def __call__(self, b: Array, theta: Array) -> Array:
        return self.place(b, theta)

    def after(self, second: Array, first: Array) -> Array:
        """One movement after another as one, (..., 4), to the second order in small turns."""
        both = second + first
        if self.rotates:
            both[..., :3] += np.cross(second[..., :3], first[..., :3]) / 2
        else:  # the roll of the second carries the shift of the first
            both[..., 0] -= second[..., 2] * first[..., 1]
            both[..., 1] += second[..., 2] * first[..., 0]
        return np.asarray(both)


class Turn(NamedTuple):
    """How the picture moved.

    theta       (4,) of a camera: rad about its axes x, y and z (points turn by it), and the share by which f grew; of a
                picture: px right, px down, rad clockwise, share by which it grew. NaN where not known
    covariance  (4, 4)
    agree       (n,) which patches agree
    why         why it is not known; empty where it is
    """

    theta: Array
    covariance: Array
    agree: Bools
    why: str = ""


def law_of_camera(camera: Camera) -> Law:
    """Where a background lies once its camera has turned."""
    return Law(partial(_turned, camera), rotates=True)


def law_of_picture(size: tuple[int, int]) -> Law:
    """Where a background lies once the picture (width, height) has shifted, rolled about its middle and grown."""
    middle = (np.array(size, float) - 1) / 2

    def moved(b: Array, theta: Array) -> Array:
        cos, sin = np.cos(theta[..., 2]), np.sin(theta[..., 2])
        off = (b - middle) * (1 + theta[..., 3:])
        x, y = off[..., 0], off[..., 1]
        return np.asarray(np.stack([cos * x - sin * y, sin * x + cos * y], -1) + middle + theta[..., :2])

    return Law(moved, rotates=False)


def _turned(camera: Camera, b: Array, theta: Array) -> Array:
    u = undistorted_from_distorted(camera, distorted_from_frame_buffer(camera, b))
    ray = np.concatenate([u / camera.f, np.ones((*u.shape[:-1], 1))], -1)
    zoomed = undistorted_from_camera(camera, _rotated(ray, theta[..., :3])) * (1 + theta[..., 3:])
    return frame_buffer_from_distorted(camera, distorted_from_undistorted(camera, zoomed))


def _rotated(ray: Array, omega: Array) -> Array:
    """Vectors (..., 3) turned by rotation vectors (..., 3), rad (Rodrigues' formula)."""
    angle = np.linalg.norm(omega, axis=-1, keepdims=True)
    sine, versine = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2  # over the angle, and its square
    once = np.cross(omega, ray)
    return np.asarray(ray + sine * once + versine * np.cross(omega, once))


def slopes(law: Law, b: Array, theta: Array) -> Array:
    """Derivatives (..., 2, 4) of the moved positions by theta, px per its unit."""
    step = 1e-5
    sides = [(law(b, theta + step * e) - law(b, theta - step * e)) / (2 * step) for e in np.eye(4)]
    return np.stack(sides, -1)


def fitted(
    law: Law, b: Array, shift: Array, sd: Array, size: tuple[int, int], agreement: Agreement = AGREEMENT
) -> Turn:
    """The movement that most patches agree upon.

    b      (n, 2) px, patches in the reference; shift (n, 2) px, NaN where not found again; sd (n, 2) px, right between
           patches: how large they are is estimated from the patches' own disagreement
    size   px, width and height of the picture
    """
    found = np.asarray(np.isfinite(shift).all(1))
    n = int(found.sum())
    unknown = Turn(np.full(4, np.nan), np.full((4, 4), np.nan), np.zeros(len(b), bool))
    if n < agreement.least:
        return unknown._replace(why=f"{n} of {len(b)} patches were found again")
    b, shift, sd = b[found], shift[found], np.maximum(sd[found], agreement.floor_px)
    near = agreement.near_px + agreement.by_shift * np.linalg.norm(shift, axis=1)
    theta, agree = _proposed(law, b, shift, near, agreement)
    scale = 1.0
    for _ in range(12):
        before = agree
        for _ in range(3):
            J, left = slopes(law, b[agree], theta), b[agree] + shift[agree] - law(b[agree], theta)
            weight = 1 / sd[agree] ** 2
            normal = np.einsum("nki,nk,nkj->ij", J, weight, J)
            if not (np.isfinite(normal).all() and np.isfinite(left).all()):
                return unknown._replace(why=NO_ONE)
            theta = theta + np.linalg.pinv(normal) @ np.einsum("nki,nk,nk->i", J, weight, left)
        off = (b + shift - law(b, theta)) / sd
        own = off[agree]
        freedom = max(2 * int(agree.sum()) - 4, 1)
        # the median is not moved by the few that do not belong; the mean square is the better one once they are out
        scale = max(float(np.sqrt((own**2).sum() / freedom)), float(np.median(np.abs(own))) / 0.6745)
        wide = min(agreement.sigmas * scale, float(np.median(near / sd.mean(1))) * 2)
        agree = np.max(np.abs(off), axis=1) < wide
        if agree.sum() < agreement.least or (agree == before).all():
            break
    if not np.isfinite(theta).all():
        return unknown._replace(why=NO_ONE)
    count = int(agree.sum())
    everything = found.copy()
    everything[found] = agree
    if count < max(agreement.least, agreement.share * n):
        return unknown._replace(why=f"{count} of {n} patches agree upon a movement")
    if spread_over(b[agree], size) < agreement.spread:
        return unknown._replace(why=f"the {count} patches that agree lie all in one place")
    J = slopes(law, b[agree], theta)
    normal = np.einsum("nki,nk,nkj->ij", J, 1 / sd[agree] ** 2, J)
    middle = slopes(law, (np.array(size, float) - 1)[None] / 2, theta)[0, :, :2]  # px by the first two
    common = np.zeros((4, 4))
    common[:2, :2] = agreement.common_px**2 * np.linalg.inv(middle.T @ middle)
    return Turn(theta, scale**2 * np.linalg.pinv(normal) + common, everything)


def _proposed(law: Law, b: Array, shift: Array, near: Array, agreement: Agreement) -> tuple[Array, Bools]:
    """The movement, of those that pairs of patches propose, with which most patches agree (Fischler, Bolles 1981)."""
    J = slopes(law, b, np.zeros(4))
    rng = np.random.default_rng(len(b))
    pairs = np.array([rng.choice(len(b), 2, replace=False) for _ in range(agreement.trials)])
    A, y = J[pairs].reshape(-1, 4, 4), shift[pairs].reshape(-1, 4)
    apart = np.linalg.norm(b[pairs[:, 0]] - b[pairs[:, 1]], axis=1)
    proposals = (np.linalg.pinv(A) @ y[..., None])[..., 0]
    proposals = np.vstack([proposals, (np.linalg.pinv(J.reshape(-1, 4)) @ np.tile(np.median(shift, 0), len(b)))[None]])
    left = shift - np.einsum("nki,ti->tnk", J, proposals)
    agree = (np.linalg.norm(left, axis=-1) < near).sum(1) + np.append(apart > np.median(apart), True) * 0.5
    best = int(agree.argmax())
    return proposals[best], np.asarray(np.linalg.norm(left[best], axis=-1) < near)
