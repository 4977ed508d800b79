"""All cameras and the surveyed points refined together, from the cameras as each was calibrated alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.measurements import KnownCameras
from vidtrack.calibration.adjustment.tied_cameras import tied_from_record
from vidtrack.calibration.adjustment.unknowns import Names
from vidtrack.calibration.assessment.accuracy import AXES
from vidtrack.calibration.bundle import Bundle, bundle
from vidtrack.calibration.camera.refine import Uncertainty, free_parameters
from vidtrack.calibration.normal_equations import Priors, priors_for
from vidtrack.calibration.surveys.shared_points import SharedPoints, side_by_side
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points

BY_CHANCE = 0.001
"""ASSUME: a point that is farther off its survey than any of a bundle's points would be so often is not there."""

SURVEY_ROUGHER = 2.0
"""Times the stated sigma that the survey's errors show: beyond it the points are weighed wrongly."""


class Bundled(NamedTuple):
    """What `refine_together` returns for m cameras."""

    cameras: list[Camera]
    uncertainties: list[Uncertainty]
    records: list[dict[str, Any]]  # what each camera.json says anew of its calibration
    points: pd.DataFrame  # where the points are thought to be: clip, tag, x, y, z, shift_x ..., normalised_x ...


def refine_together(
    cameras: Sequence[Camera],
    points: Sequence[pd.DataFrame],
    *,
    free: Names | None = None,
    sigma: float = 0.0,
    prior: Priors | Mapping[str, tuple[float, float]] | None = None,
    lenses: Sequence[Mapping[str, Any] | None] | None = None,
    ties: Sequence[Mapping[str, Any]] = (),
    boards: Mapping[str, Camera] | None = None,
    alone: Sequence[Uncertainty | None] = (),
) -> Bundled:
    """Refine m cameras and their calibration points together (see `vidtrack.calibration.bundle`).

    cameras  as calibrated alone, with their names
    points   for each its points.parquet: clip, tag, x, y, z, sigma, Xf, Yf, used; only used sights count
    free     for each camera the names of its free parameters; default: those of Tsai's model
    sigma    units, survey tolerance of points that have none of their own
    prior    what is known beforehand of any parameter, {name: (mean, sd)}: for all cameras, or a list with one each
    lenses   for each camera what camera.json says of its lens: names, mean and covariance where it is a prior; None
    ties     what a board says of some cameras together: cameras, names, pivot, covariance, scale_sd (boards.json)
    boards   by name the cameras that `ties` names, in the board's world
    alone    for each camera what was known of it before, where the survey placed it: only to say what the board gains
    Raises VidtrackError where no sigma is known, for then there is nothing to gain, or where the sights do not
    settle the parameters.
    """
    shared = side_by_side(points, sigma=sigma)
    names = free or [free_parameters("tsai")] * len(cameras)
    priors = priors_for(prior, names)
    tied = [tied_from_record(tie, boards or {}, [camera.name for camera in cameras]) for tie in ties]
    if not tied and not (shared.sigma[shared.used.any(0)] > 0).any():
        raise VidtrackError(
            "calibration.sigma: 0, so the survey is taken for exact and a bundle has nothing to share. "
            "Give the survey's tolerance, here or as a column sigma in points.csv, or set calibration.refine: full."
        )
    try:
        by_tie = {name for tie in ties for name in tie["cameras"]}  # their lenses are known with their places
        own = [None if camera.name in by_tie else lens for camera, lens in zip(cameras, lenses or [], strict=False)]
        known = _known_lenses(cameras, own or [None] * len(cameras))
        how: dict[str, Any] = {"sigma": shared.sigma, "free": names, "priors": priors}
        found = bundle(cameras, shared.p, shared.b_used, lenses=known, tied=tied, **how)
    except ValueError as error:
        raise VidtrackError(f"calibration.refine: bundle: {error}. Or set calibration.refine: full.") from None
    findings = _findings(found, shared)
    records = [_record(found, shared, i, findings) for i in range(len(cameras))]
    if tied:
        joint = {"cameras": [c.name for c in cameras], "names": [list(n) for n in found.free]}
        joint["covariance"] = found.covariance.tolist()
        by_board = {"cameras": [list(tie["cameras"]) for tie in ties]} | _gain(cameras, alone, found, shared)
        for record in records:
            record["bundle"]["board"] = by_board
            record["joint"] = joint
    return Bundled(
        list(found.cameras), [found.uncertainty(i) for i in range(len(cameras))], records, _points(found, shared)
    )


def ties_among(ties: Sequence[Mapping[str, Any]], cameras: Sequence[str]) -> list[Mapping[str, Any]]:
    """Those of a board's ties that connect at least two of these cameras."""
    return [tie for tie in ties if len(set(tie["cameras"]) & set(cameras)) > 1]


def _known_lenses(cameras: Sequence[Camera], lenses: Sequence[Mapping[str, Any] | None]) -> KnownCameras | None:
    """What is known beforehand of all lenses together; None where no lens has a covariance."""
    known = [lens if lens and lens["names"] else {"names": [], "mean": {}, "covariance": []} for lens in lenses]
    names = [tuple(lens["names"]) for lens in known]
    if not any(names):
        return None
    covariance = np.zeros((sum(map(len, names)),) * 2)
    start = 0
    for lens in known:
        k = len(lens["names"])
        covariance[start : start + k, start : start + k] = np.reshape(np.array(lens["covariance"], float), (k, k))
        start += k
    means = [camera.with_(**lens["mean"]) for camera, lens in zip(cameras, known, strict=True)]
    return KnownCameras(means, names, np.zeros(3), covariance)


def _gain(
    cameras: Sequence[Camera], alone: Sequence[Uncertainty | None], found: Bundle, shared: SharedPoints
) -> dict[str, float]:
    """How well a point in the middle of the survey is located: sigma, the root mean square of the axes, world units.

    `alone_sigma` is of the cameras as each was placed by its own points; absent where one saw none.
    """
    middle = shared.p[shared.used.any(0)].mean(0)
    each: dict[str, tuple[Sequence[Camera], Sequence[Uncertainty], Array | None]] = {
        "sigma": (found.cameras, [found.uncertainty(i) for i in range(len(cameras))], found.covariance)
    }
    if sum(known is not None for known in alone) == len(cameras):
        each["alone_sigma"] = cameras, [known for known in alone if known], None
    out = {}
    for name, (rig, known, joint) in each.items():
        b = np.array([project(camera, middle[None]) for camera in rig])
        sigma = locate_points(rig, b, sd=found.sigma_px, uncertainties=known, joint=joint).sigma[0]
        out[name] = float(np.sqrt((sigma**2).mean()))
    return out


def _record(found: Bundle, shared: SharedPoints, i: int, findings: Sequence[Finding]) -> dict[str, Any]:
    left = np.linalg.norm(found.residuals[i, shared.used[i]], axis=-1)
    return {
        "refine": "bundle",
        "n_points": int(shared.used[i].sum()),
        "rms_px": float(np.sqrt((left**2).mean())) if left.size else np.nan,
        "max_px": float(left.max()) if left.size else np.nan,
        "sigma_px": found.sigma_px,
        "bundle": {
            "cameras": [camera.name for camera in found.cameras],
            "names": [list(names) for names in found.free],
            "joint_covariance": found.covariance,
            "survey_factor": found.survey_factor,
            "survey_shift_rms": _rms((found.points - shared.p)[shared.used.any(0)]),
            "steps": found.steps,
            "converged": found.converged,
            "findings": as_records(findings),
        },
    }


def _rms(shift: Array) -> float:
    return float(np.sqrt((shift**2).sum(-1).mean()))


def _findings(found: Bundle, shared: SharedPoints) -> list[Finding]:
    where = f"calibration of {', '.join(camera.name for camera in found.cameras)}"
    findings = []
    if not found.converged:
        text = f"{where}: the bundle did not converge in {found.steps} steps."
        cure = "Look for wrong points in points.parquet, or set calibration.refine: full."
        findings.append(Finding("doubtful", "bundle-not-converged", text, cure))
    if found.survey_factor > SURVEY_ROUGHER:
        text = f"{where}: the survey's errors are {found.survey_factor:.1f} times what sigma says."
        findings.append(Finding("doubtful", "survey-sigma-small", text, "Give a larger calibration.sigma."))
    far = np.nanmax(np.where(np.isfinite(found.survey_shift), np.abs(found.survey_shift), 0), -1)
    limit = NormalDist().inv_cdf(1 - BY_CHANCE / (2 * 3 * max(len(far), 1)))  # 4.6 standard deviations for 64 points
    for j in np.flatnonzero(far > limit):
        shift = found.points[j] - shared.p[j]
        size = ", ".join(f"{axis} {value:+.3g}" for axis, value in zip(AXES, shift, strict=True))
        text = (
            f"{where}: tag {shared.keys[j][1]} lies {np.linalg.norm(shift):.3g} from its surveyed place ({size}), "
            f"{far[j]:.1f} standard deviations."
        )
        findings.append(
            Finding("doubtful", "point-off-survey", text, "Measure the point again, or remove it from points.csv.")
        )
    return findings


def _points(found: Bundle, shared: SharedPoints) -> pd.DataFrame:
    columns: dict[str, Any] = {"clip": [key[0] for key in shared.keys], "tag": [key[1] for key in shared.keys]}
    deviation = np.sqrt(np.einsum("naa->na", found.point_covariance))
    for k, axis in enumerate(AXES):
        columns[axis] = found.points[:, k]
        columns[f"sigma_{axis}"] = deviation[:, k]
        columns[f"shift_{axis}"] = (found.points - shared.p)[:, k]
        columns[f"normalised_{axis}"] = found.survey_shift[:, k]
    return pd.DataFrame(columns)
