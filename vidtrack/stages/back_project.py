"""Stage back_project: the calibration points located by the cameras, and projected back into every picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.tied_cameras import TiedCameras, tied_from_record
from vidtrack.calibration.adjustment.unknowns import Names
from vidtrack.calibration.assessment.accuracy import AXES, by_axis, errors_by_axis, largest_distance
from vidtrack.calibration.assessment.cramer_rao import NORMAL_MEAN_ABS, located_covariance, mean_length
from vidtrack.calibration.assessment.field_of_view import diagonal_field
from vidtrack.calibration.assessment.heldout import (
    HeldOut,
    Refit,
    held_out,
    refit_alone,
    refit_closed_form,
    refit_together,
)
from vidtrack.calibration.assessment.measures import measures
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import POSE, free_parameters
from vidtrack.calibration.normal_equations import Priors, priors_for
from vidtrack.calibration.refraction.refraction_effect import effect_finding, refraction_effect
from vidtrack.calibration.surveys.shared_points import SharedPoints, side_by_side
from vidtrack.calibration.surveys.survey_stretch import stretches
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import (
    Camera,
    camera_from_world,
    frame_buffer_from_distorted,
    project,
    undistorted_from_camera,
)
from vidtrack.geometry.triangulate import Located, locate_points

TOO_GOOD = 0.8
"""Held-out error over what noise and survey allow, below which residuals are no noise: chance stays above 0.9."""

EXPLAINED = 1.5
"""Residuals over the sd of the centroids, up to which these explain them: then a good ratio says that the survey is
better than its tolerance, which is no fault of the lens."""

TOO_RICH = 1.5
"""Held-out error over that of the points used, above which the model fits the noise: 1.1 is usual."""


class BackProjection(NamedTuple):
    """What `back_project` returns."""

    table: pd.DataFrame  # a row for each point and camera
    record: dict[str, Any]


class Noise(NamedTuple):
    """The standard deviation of the centroids, px, and what it is estimated from."""

    sigma_px: float
    source: str


def back_project(
    cameras: Sequence[Camera],
    points: Sequence[pd.DataFrame],
    *,
    refine: str = "full",
    free: Names | None = None,
    prior: Priors | Mapping[str, tuple[float, float]] | None = None,
    sigma: float = 0.0,
    units: str = "",
    ties: Sequence[Mapping[str, Any]] = (),
    boards: Mapping[str, Camera] | None = None,
    bare: Sequence[str] = (),
) -> BackProjection:
    """Locate the calibration points with all cameras and compare with the survey, as the thesis does (6.6, 6.8).

    cameras  m calibrated cameras, with their names
    points   for each its points.parquet: clip, tag, x, y, z, sigma, Xf, Yf, used, reason; one row a point
    refine   how the cameras were calibrated, and so how they are refitted without the held-out points
    free     for each camera the parameters that its calibration freed; default: those of Tsai's model
    sigma    units, survey tolerance of points that have none of their own
    prior    what is known beforehand of any parameter, {name: (mean, sd)}: for all cameras, or a list with one each
    ties     what a board says of some cameras together (boards.json): no fold leaves it out; boards: the cameras that
             they name, in the board's world; bare: cameras that saw the board alone, whose points are the board's
    In mode `full` and `bundle` the refits weigh the survey's sigma against the centroid noise that the sights show.
    Sights that the calibration rejected are projected too, but locate nothing. With one camera there is nothing to
    locate: the positions are NaN, the measures in the picture remain.
    """
    shared = side_by_side(points, sigma=sigma)
    b = shared.b_used
    located = locate_points(cameras, b) if len(cameras) > 1 else None
    names = free or [free_parameters("tsai")] * len(cameras)
    priors = priors_for(prior, names)
    if ties:
        tied = [tied_from_record(tie, boards or {}, [camera.name for camera in cameras]) for tie in ties]
        none = np.array([camera.name in bare for camera in cameras])
        seen = np.where(none[:, None, None], np.nan, b)  # what they saw is in their ties
        noise = _noise(cameras, shared, seen, names, priors, tied)
        sd = noise.sigma_px if noise.sigma_px > 0 else 1.0
        how: dict[str, Any] = {"free": names, "sigma": shared.sigma, "sd": sd, "priors": priors}
        refit = refit_together(cameras, shared.p, seen, tied=tied, **how)
    else:
        noise = _noise(cameras, shared, b, names, priors)
        refit = _refit(refine, cameras, shared, b, names, priors, noise)
    out = held_out(shared.p, b, refit, b_all=shared.b)
    table = _table(cameras, points, shared, located, out)
    record: dict[str, Any] = {"units": units, "cameras": [camera.name for camera in cameras], "refine": refine}
    lens_free = any(set(each) - set(POSE) for each in names)
    effect = refraction_effect(cameras, shared.p, b, names)
    more = [effect_finding(effect, units)] if effect else []
    record |= _record(cameras, shared, located, out, noise, lens_free, _stated_px(points), more)
    if effect:
        record["refraction"] = effect._asdict()
    if not ties:
        found = stretches(cameras, shared.p, b, names, priors, sigma=shared.sigma, sd=noise.sigma_px)
        record["stretches"] = [each._asdict() for each in found]
    return BackProjection(table, record)


def _noise(
    cameras: Sequence[Camera],
    shared: SharedPoints,
    b: Array,
    free: Names,
    priors: Priors,
    tied: Sequence[TiedCameras] = (),
) -> Noise:
    """The centroid noise that the sights show when the survey's errors are taken out."""
    if len(cameras) < 2:
        return Noise(np.nan, "unknown: one camera alone")
    sigma = shared.sigma
    if sigma.any() and len(sigma) <= 300:  # with more points, what the calibration takes up of it is negligible
        try:
            found = bundle(cameras, shared.p, b, sigma=sigma, free=free, priors=priors, tied=tied)
            return Noise(found.sigma_px, "all cameras and the survey refined together")
        except ValueError:  # too few points for that
            pass
    return Noise(locate_points(cameras, b).sd, "reprojection errors of the located points")


def _refit(
    refine: str, cameras: Sequence[Camera], shared: SharedPoints, b: Array, free: Names, priors: Priors, noise: Noise
) -> Refit:
    sigma = shared.sigma
    sd = noise.sigma_px if noise.sigma_px > 0 else None
    if refine in ("linear", "centre"):
        return refit_closed_form(cameras, shared.p, b)
    if refine == "bundle" and sd is not None:
        return refit_together(cameras, shared.p, b, free=free, sigma=sigma, sd=sd, priors=priors)
    survey = sigma if sd is not None and sigma.any() else None
    return refit_alone(cameras, shared.p, b, free=free, survey=survey, sd=sd, priors=priors)


def _table(
    cameras: Sequence[Camera],
    points: Sequence[pd.DataFrame],
    shared: SharedPoints,
    located: Located | None,
    out: HeldOut,
) -> pd.DataFrame:
    n = len(shared.p)
    point = located.point if located else np.full((n, 3), np.nan)
    common: dict[str, Any] = {
        "tag": [key[1] for key in shared.keys],
        "clip": [key[0] for key in shared.keys],
        **dict(zip(AXES, shared.p.T, strict=True)),
        **{f"{axis}_located": point[:, k] for k, axis in enumerate(AXES)},
        **{f"{axis}_held_out": out.located[:, k] for k, axis in enumerate(AXES)},
        **{f"sigma_{axis}": located.sigma[:, k] if located else np.nan for k, axis in enumerate(AXES)},
        "miss": located.miss if located else np.nan,
        "n_cameras": located.n_cameras if located else np.zeros(n, int),
    }
    parts = []
    for i, camera in enumerate(cameras):
        listed = shared.row[i] >= 0
        own = points[i].iloc[shared.row[i, listed]]
        part = pd.DataFrame(common)[listed].reset_index(drop=True)
        part.insert(2, "camera", camera.name)
        for name, b in {
            "": shared.b[i],
            "_projected": project(camera, shared.p),
            "_no_distortion": frame_buffer_from_distorted(camera, _pinhole(camera, shared.p)),
            "_from_located": project(camera, point),
        }.items():
            part[[f"Xf{name}", f"Yf{name}"]] = b[listed]
        part["used"] = shared.used[i, listed]
        part["reason"] = own["reason"].to_numpy() if "reason" in own else ""
        parts.append(part)
    whole: pd.DataFrame = pd.concat(parts, ignore_index=True)
    return whole


def _pinhole(camera: Camera, p: Array) -> Array:
    return undistorted_from_camera(camera, camera_from_world(camera, p))


def _record(
    cameras: Sequence[Camera],
    shared: SharedPoints,
    located: Located | None,
    out: HeldOut,
    noise: Noise,
    lens_free: bool,
    stated_px: float,
    more: Sequence[Finding],
) -> dict[str, Any]:
    seen = shared.p[shared.used.any(0)]
    lengths = {"largest_distance": largest_distance(seen), "diagonal_field": diagonal_field(cameras, seen)}
    error = (located.point if located else np.full(shared.p.shape, np.nan)) - shared.p
    training, held = errors_by_axis(error, **lengths), errors_by_axis(out.error, **lengths)
    floor = _floor(cameras, shared, noise)
    record = {
        "n_points": int(shared.used.any(0).sum()),
        **lengths,
        **training,
        "worst": _worst(error, shared),
        "held_out": {"method": out.method, **held, "rms_px": _rms(out.sight_error), "of_all": _of_all(shared, out)},
        "floor": floor,
        "ratio": _ratio(held["mean_3d"], floor["mean_3d"]),
        "ratio_with_survey": _ratio(held["mean_3d"], floor["mean_3d_with_survey"]),
        "measures": {
            camera.name: {k: v._asdict() for k, v in measures(camera, shared.p, shared.b_used[i])._asdict().items()}
            for i, camera in enumerate(cameras)
        },
    }
    findings = [*_findings(record, lens_free, stated_px), *more]
    warnings = [f"{finding.text}. {finding.cure}" for finding in findings]
    return {**record, "findings": as_records(findings), "warnings": warnings}


PLAIN_CURE = "Give the survey's tolerance (sigma) as it is; where the config names a plain lens model, set model: auto."


def _stated_px(points: Sequence[pd.DataFrame]) -> float:
    """px rms, the sd that the centroids of all cameras have by themselves; NaN where it is not known of all."""
    if not all({"sd_x", "sd_y", "used"} <= set(table) for table in points):
        return np.nan
    sd = np.concatenate([table.loc[table["used"].astype(bool), ["sd_x", "sd_y"]].to_numpy(float) for table in points])
    return float(np.sqrt((sd**2).mean())) if sd.size else np.nan


def _findings(record: Mapping[str, Any], lens_free: bool, stated_px: float) -> list[Finding]:
    """What the errors say of the lens model, and what would help."""
    found = []
    whole = record["held_out"]["of_all"]
    if whole["points_left_out"]:
        text = (
            f"calibration: the held-out error of {record['held_out']['mean_3d']:.3g} is that of the sights that were "
            f"used; with {whole['points_left_out']} points that cameras left out it is {whole['mean_3d']:.3g}, at most "
            f"{whole['max_3d']:.3g}"
        )
        cure = "If those points are good after all, the second number counts: see points.parquet for the reasons."
        found.append(Finding("note", "held-out-without-some", text, cure))
    ratio, held, used = record["ratio_with_survey"], record["held_out"]["mean_3d"], record["mean_3d"]
    if ratio < TOO_GOOD and record["floor"]["sigma_px"] < EXPLAINED * stated_px:
        text = (
            f"calibration: points are located {1 / ratio:.1f} times better than the survey's tolerance lets expect, "
            "and no worse than their centroids allow: the survey is better than stated"
        )
        cure = "State the tolerance (sigma) as it is: the sigma of positions is larger than need be."
        found.append(Finding("note", "survey-better-than-stated", text, cure))
    elif ratio < TOO_GOOD:
        text = (
            f"calibration: points are located {1 / ratio:.1f} times better than their residuals in the pictures allow: "
            "the residuals are not noise, the lens model is too plain or sigma is too large"
        )
        found.append(Finding("doubtful", "lens-model-too-plain", text, PLAIN_CURE))
    if lens_free and held > TOO_RICH * used:
        text = (
            f"calibration: points held out are located {held / used:.1f} times worse than the points that were used: "
            "there are too few points for so rich a lens model"
        )
        cure = "Add points, or set calibration.model to a plainer one."
        found.append(Finding("doubtful", "lens-model-too-rich", text, cure))
    return found


def _of_all(shared: SharedPoints, out: HeldOut) -> dict[str, Any]:
    """The held-out errors by all sights that were found, and how many points have sights that were left out."""
    length = np.linalg.norm(out.error_of_all[np.isfinite(out.error_of_all).all(-1)], axis=-1)
    found = np.isfinite(shared.b).all(-1)
    return {
        "n": len(length),
        "points_left_out": int((found & ~shared.used).any(0).sum()),
        "mean_3d": float(length.mean()) if len(length) else np.nan,
        "max_3d": float(length.max()) if len(length) else np.nan,
    }


def _worst(error: Array, shared: SharedPoints) -> dict[str, Any]:
    """For each axis the tag of the largest error, with its sign: located minus surveyed."""
    found = {}
    for k, axis in enumerate(AXES):
        if np.isfinite(error[:, k]).any():
            worst = int(np.nanargmax(np.abs(error[:, k])))
            clip, tag = shared.keys[worst]
            found[axis] = {"tag": tag, "clip": clip, "error": float(error[worst, k])}
    return found


def _floor(cameras: Sequence[Camera], shared: SharedPoints, noise: Noise) -> dict[str, Any]:
    """What perfectly known cameras would attain with the same centroid noise."""
    found = {"sigma_px": noise.sigma_px, "sigma_px_source": noise.source}
    if not (noise.sigma_px > 0 and (shared.used.sum(0) > 1).any()):
        return {**found, "mean_3d": np.nan, "mean_3d_with_survey": np.nan, "mean_abs": by_axis(np.full(3, np.nan))}
    C = located_covariance(cameras, shared.p, noise.sigma_px, shared.used)
    survey = shared.sigma[:, None, None] ** 2 * np.eye(3)
    variance = np.einsum("naa->na", C)
    return {
        **found,
        "mean_3d": float(np.nanmean(mean_length(C))),
        "mean_3d_with_survey": float(np.nanmean(mean_length(C + survey))),
        "mean_abs": by_axis(NORMAL_MEAN_ABS * np.nanmean(np.sqrt(variance), 0)),
    }


def _ratio(error: float, floor: float) -> float:
    return error / floor if floor > 0 else np.nan


def _rms(errors: Array) -> float:
    e = errors[np.isfinite(errors).all(-1)]
    return float(np.sqrt((e**2).sum(-1).mean())) if len(e) else np.nan
