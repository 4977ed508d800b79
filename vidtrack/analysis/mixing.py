"""What the calibration's error mixes into each motion of a target or a body, in phase with other motions.

The calibration leaves a field of errors that is the same for all samples of a run
(`location.sight_lines.budget.CalibrationField`):
e(p) = e0 + G d + 1/2 d H d, d = p - about. It does not average out: a target that swings along x is seen to swing a
little along y too; a body that surges through a field that bends is seen to pitch. A body's pose is the rigid motion
nearest to its targets, so its error is that of the field at their places,

    shift = mean of e,   turn = (sum of |b|^2 1 - b b^T)^-1 sum of b x e     (b: targets about their mean)

and what is mixed into a motion is by how much these change as the body moves by one unit of another.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.analysis.responses import Systematic
from vidtrack.arrays import Array
from vidtrack.freedom import DEGREES_OF_FREEDOM
from vidtrack.geometry.rotation import rotation_from_vector

SMALL_TURN = 1e-3
"""rad, the turn by which derivatives are found."""


class ErrorField(NamedTuple):
    """Independent errors of positions, each of variance 1: see `location.sight_lines.budget.CalibrationField`."""

    gradients: Array
    curvatures: Array
    about: Array

    def at(self, points: Array) -> Array:
        """The errors (n, k, 3) at points (k, 3), without the part that is the same everywhere."""
        d = points - self.about
        bent = 0.5 * np.einsum("nijl,kj,kl->nki", self.curvatures, d, d)
        return np.asarray(np.einsum("nij,kj->nki", self.gradients, d) + bent)


class Resting(NamedTuple):
    """A body at rest: its targets (k, 3) and the point (3,) whose motions are wanted, in the world."""

    targets: Array
    point: Array


def mixing(
    names: Iterable[str], field: ErrorField, basin: Array | None, bodies: Mapping[str, Resting] | None = None
) -> Systematic:
    """For each series of targets and bodies, what the calibration's error mixes into it.

    basin    rows (3, 3), the world directions of surge, sway and heave
    bodies   by the name that its series begin with, such as float or float@CoG
    """
    G = field.gradients
    found: dict[str, tuple[Sequence[str], Array]] = {}
    of_bodies = {name: rigid_mixing(field, own, basin) for name, own in (bodies or {}).items() if basin is not None}
    for name in names:
        group, _, last = name.rpartition(".")
        if group and last in tuple("xyz"):
            found[name] = [f"{group}.{other}" for other in "xyz"], G[:, "xyz".index(last)]
        elif group in of_bodies and last in DEGREES_OF_FREEDOM:
            shares = of_bodies[group][:, DEGREES_OF_FREEDOM.index(last)]
            found[name] = [f"{group}.{other}" for other in DEGREES_OF_FREEDOM], shares
    return found


def rigid_mixing(field: ErrorField, body: Resting, basin: Array) -> Array:
    """What each error mixes into a motion for one unit of another: (n, that motion, the other), world units and deg."""
    size = max(float(np.linalg.norm(body.targets - body.targets.mean(0), axis=1).max()), 1e-12)
    columns = []
    for axis in basin:
        ends = [_pose_error(field, body, side * size * axis, np.eye(3)) for side in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * size))
    still = _pose_error(field, body, np.zeros(3), np.eye(3))
    for axis in basin:
        ends = []
        for side in (1, -1):
            moved = _pose_error(field, body, np.zeros(3), rotation_from_vector(side * SMALL_TURN * axis))
            moved[:, 3:] -= side * SMALL_TURN * np.cross(axis, still[:, 3:])  # the turn from rest, not that of the body
            ends.append(moved)
        columns.append((ends[0] - ends[1]) / (2 * SMALL_TURN))
    whole = np.stack(columns, -1)
    turned = np.concatenate([np.einsum("ij,njk->nik", basin, whole[:, part]) for part in (slice(0, 3), slice(3, 6))], 1)
    turned[:, 3:, :3] *= 180 / np.pi
    turned[:, :3, 3:] *= np.pi / 180
    return np.asarray(turned)


def _pose_error(field: ErrorField, body: Resting, shift: Array, R: Array) -> Array:
    """Errors (n, 6) of the point's place and of the attitude, rad, when the body has moved about its point."""
    targets = body.point + shift + (body.targets - body.point) @ R.T
    middle = targets.mean(0)
    b, e = targets - middle, field.at(targets)
    inertia = (b**2).sum() * np.eye(3) - b.T @ b
    turn = np.cross(b, e).sum(1) @ np.linalg.pinv(inertia).T
    place = e.mean(1) + np.cross(turn, body.point + shift - middle)
    return np.concatenate([place, turn], 1)
