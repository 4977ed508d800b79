"""Calibration errors that cameras have in common, because they were calibrated on the same surveyed points.

A point surveyed wrongly moves the calibration of every camera that saw it, and all the same way: what they locate
together is off by more than independent errors would make it. With a least-squares fit the parameters follow a
surveyed point by

    F = dk/dp = -C J^T W P,     J = d(px)/dk, P = d(px)/dp, W the weight of the sight, C the fit's covariance

so that two cameras' parameters covary by the sum over common points of F_a sigma^2 F_b^T.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple, Protocol

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import pulls_of
from vidtrack.geometry.jacobian import columns, derivatives


class Survey(NamedTuple):
    """The calibration points that one camera's fit used."""

    tags: tuple[str, ...]
    p: Array  # (n, 3) world units
    sigma: Array  # (n,) survey tolerance, world units
    sd: float  # px, centroid noise of a sight


class Table(Protocol):
    """points.parquet: its columns by name."""

    def __getitem__(self, name: str, /) -> Any: ...
    def __contains__(self, name: str, /) -> bool: ...


def surveys_of(cameras: Sequence[Camera], points: Sequence[Table], noise: float) -> list[Survey] | None:
    """The points of each calibration; None where cameras have nothing in common by them: all exact, no interface.

    noise   px, of a sight where the table has none
    """
    surveys = [_survey(table, noise) for table in points]
    return None if all((s.sigma == 0).all() for s in surveys) and not share_an_interface(cameras) else surveys


def _survey(points: Table, noise: float) -> Survey:
    tags = np.asarray(points["tag"]).astype(str)
    used = np.asarray(points["used"], bool) if "used" in points else np.ones(len(tags), bool)
    first = np.zeros(len(tags), bool)
    first[[int(np.flatnonzero(used & (tags == tag))[0]) for tag in dict.fromkeys(tags[used])]] = True
    sigma = np.nan_to_num(np.asarray(points["sigma"], float)[first]) if "sigma" in points else np.zeros(first.sum())
    named = "sd_x" in points and "sd_y" in points
    sds = np.stack([np.asarray(points[n], float)[first] for n in ("sd_x", "sd_y")]) if named else np.zeros((2, 0))
    known = np.isfinite(sds)
    sd = float(np.median(sds[known])) if known.any() else np.nan
    p = np.stack([np.asarray(points[axis], float)[first] for axis in "xyz"], -1)
    return Survey(tuple(tags[first]), p, sigma, sd if np.isfinite(sd) and sd > 0 else noise)


def joint_covariance(
    cameras: Sequence[Camera], uncertainties: Sequence[CameraUncertainty | None], surveys: Sequence[Survey]
) -> Array:
    """Covariance (k, k) of the parameters of all cameras that have an uncertainty, one camera after the other.

    Each camera's own block is its uncertainty's covariance; what lies between is the share of the common survey
    and of interfaces through which two cameras see.
    """
    known = [(c, u, s) for c, u, s in zip(cameras, uncertainties, surveys, strict=True) if u is not None]
    edges = np.cumsum([0, *(len(u.names) for _, u, _ in known)])
    joint = np.zeros((edges[-1], edges[-1]))
    follows = [_by_surveyed_point(*entry) for entry in known]
    for i, (_, u, _) in enumerate(known):
        joint[edges[i] : edges[i + 1], edges[i] : edges[i + 1]] = u.covariance
    own = joint.copy()
    for i, j in combinations(range(len(known)), 2):
        common = sorted(set(known[i][2].tags) & set(known[j][2].tags))
        block = np.zeros((edges[i + 1] - edges[i], edges[j + 1] - edges[j]))
        for tag in common:
            row = known[i][2].tags.index(tag)
            block += known[i][2].sigma[row] ** 2 * follows[i][row] @ follows[j][known[j][2].tags.index(tag)].T
        block += _by_interfaces(known[i][0], known[i][1], known[j][0], known[j][1])
        joint[edges[i] : edges[i + 1], edges[j] : edges[j + 1]] = block
        joint[edges[j] : edges[j + 1], edges[i] : edges[i + 1]] = block.T
    return _possible(own, joint)


def survey_covariance(
    cameras: Sequence[Camera], uncertainties: Sequence[CameraUncertainty | None], surveys: Sequence[Survey]
) -> Array:
    """The part of `joint_covariance` that the survey's tolerance makes; the rest is of the centroids in the clips.

    No camera's part exceeds its own covariance: it is lessened until it does not.
    """
    known = [(c, u, s) for c, u, s in zip(cameras, uncertainties, surveys, strict=True) if u is not None]
    tags = sorted({tag for _, _, s in known for tag in s.tags})
    sigmas = {tag: s.sigma[row] for _, _, s in known for row, tag in enumerate(s.tags)}
    columns = []  # what one standard error of each surveyed point, along each axis, does to all parameters
    for camera, u, s in known:
        row_of = {tag: row for row, tag in enumerate(s.tags)}
        F = _by_surveyed_point(camera, u, s)
        none = np.zeros((len(u.names), 3))
        own = np.concatenate([sigmas[t] * F[row_of[t]] if t in row_of else none for t in tags], axis=1)
        largest = float(np.max(np.diag(own @ own.T) / np.maximum(np.diag(u.covariance), 1e-300), initial=0.0))
        columns.append(own / np.sqrt(max(1.0, largest)))
    effect = np.concatenate(columns)
    return np.asarray(effect @ effect.T)


def share_an_interface(cameras: Sequence[Camera]) -> bool:
    """Whether two cameras look through one and the same interface that is not known exactly."""
    names = [name for camera in cameras for name in {interface.name for interface in camera.through if interface.free}]
    return len(names) > len(set(names))


def _by_interfaces(a: Camera, known_a: CameraUncertainty, b: Camera, known_b: CameraUncertainty) -> Array:
    """What two cameras' parameters have in common by interfaces through which both see, (k_a, k_b).

    Refined together, the interface is one for both: given it, they are independent. Refined apart, they share only
    what is known of it beforehand.
    """
    pulls = pulls_of(a.through)
    common = [n for n in known_a.names if n in known_b.names and n in pulls]
    if not common:
        return np.zeros((len(known_a.names), len(known_b.names)))
    of_a, of_b = ([known.names.index(name) for name in common] for known in (known_a, known_b))
    A, B = (np.asarray(known.covariance, float) for known in (known_a, known_b))
    one = {i.name: i for i in a.through}
    together = all(np.array_equal(one[i.name].point, i.point) for i in b.through if i.name in one)
    if together:
        information = np.linalg.pinv(A[np.ix_(of_a, of_a)], hermitian=True)
    else:
        information = np.diag([1 / pulls[name][1] ** 2 for name in common])
    return np.asarray(A[:, of_a] @ information @ B[of_b])


def joint_of(
    calibrated: Sequence[Any],
    cameras: Sequence[Camera],
    uncertainties: Sequence[CameraUncertainty | None],
    surveys: Sequence[Survey] | None,
) -> Array | None:
    """What the cameras' calibrations have in common: as recorded, else by their surveys, else None."""
    joint = recorded_joint(calibrated, uncertainties)
    return joint_covariance(cameras, uncertainties, surveys) if joint is None and surveys else joint


def recorded_joint(calibrated: Sequence[Any], uncertainties: Sequence[CameraUncertainty | None]) -> Array | None:
    """Covariance (k, k) of the parameters of cameras that one calibration estimated together; None where none does.

    calibrated     cameras with the record of their camera.json, whose `joint` names the cameras, their parameters and
                   the covariance of all of them
    uncertainties  of the same cameras as the run sees them: where they differ, the run's pictures are others
    """
    records = [getattr(own, "record", {}).get("joint") for own in calibrated]
    first = records[0] if records else None
    if first is None or any(r != first for r in records):
        return None
    names = [getattr(own, "record", {}).get("camera") for own in calibrated]
    edges = dict(zip(first["cameras"], np.cumsum([0, *map(len, first["names"])]).tolist(), strict=False))
    if any(name not in edges or u is None for name, u in zip(names, uncertainties, strict=True)):
        return None
    columns: list[int] = []
    for name, u in zip(names, uncertainties, strict=True):
        columns += range(edges[name], edges[name] + len(u.names))  # type: ignore[union-attr]
    whole: Array = np.array(first["covariance"], float)
    joint: Array = whole[np.ix_(columns, columns)]
    start = 0
    for u in uncertainties:
        own = np.asarray(u.covariance, float)  # type: ignore[union-attr]
        if not np.allclose(joint[start : start + len(own), start : start + len(own)], own, rtol=1e-6):
            return None
        start += len(own)
    return joint


def _by_surveyed_point(camera: Camera, uncertainty: CameraUncertainty, survey: Survey) -> Array:
    """F (n, k, 3): how the freed parameters follow each surveyed point."""
    at = derivatives(camera, survey.p, uncertainty.pivot)
    J = np.nan_to_num(at.by_parameter[..., columns(camera, uncertainty.names)])
    P = np.nan_to_num(at.by_point)
    sight = survey.sd**2 * np.eye(2) + P @ np.swapaxes(P, -1, -2) * (survey.sigma**2)[:, None, None]
    JW = np.swapaxes(J, -1, -2) @ np.linalg.inv(sight)
    C = np.asarray(uncertainty.covariance, float)
    # the covariance may have been scaled by the fit's misfit; C H is then that much larger than the identity
    scale = np.trace(C @ (JW @ J).sum(0)) / len(C)
    F: Array = -(C / max(scale, 1e-12)) @ JW @ P
    return F


def _possible(own: Array, joint: Array) -> Array:
    """The joint covariance, what lies between cameras lessened until it is one (no negative variance)."""
    s = np.sqrt(np.maximum(np.diag(own), 1e-300))
    between = joint - own
    for share in (1.0, 0.95, 0.9, 0.8, 0.6, 0.3):
        trial = own + share * between
        if np.linalg.eigvalsh(trial / s[:, None] / s)[0] > -1e-9:
            return trial
    return own
