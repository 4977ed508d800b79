"""What accuracy a rig would have, before anyone builds it, and what it depends on (thesis 7.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.assessment.accuracy import AXES
from vidtrack.calibration.assessment.cramer_rao import NORMAL_MEAN_ABS, mean_length
from vidtrack.calibration.assessment.field_of_view import (
    Field,
    diagonal_field,
    field_of_view,
    mean_depth,
    pixels_across,
)
from vidtrack.calibration.assessment.prediction import Case, Prediction, in_picture, predicted
from vidtrack.calibration.assessment.target_design import LEAST_PIXELS, least_diameter, pixels_found
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import refine
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.geometry.triangulate import locate_points


class Sensitivity(NamedTuple):
    """What `sensitivity` returns."""

    table: pd.DataFrame  # a row a case
    cameras: pd.DataFrame  # a row a case and camera
    volume: pd.DataFrame  # the rig as planned: a row for each place in the volume


def sensitivity(cases: Iterable[Case], *, trials: int = 0, seed: int = 0) -> Sensitivity:
    """Tables of the accuracy of every case, predicted by covariance and, with trials, checked by simulated ones.

    cases   the first is the rig as planned, whose volume is tabled place by place
    trials  simulated calibrations of each case (Monte Carlo); 0: none
    A case that cannot be calibrated stays in the table with its reason and NaN.
    Lengths are in world units, errors the mean magnitude over the volume.
    """
    rows, cameras, volume = [], [], pd.DataFrame()
    for number, case in enumerate(cases):
        row: dict[str, Any] = {"sweep": case.sweep, "value": str(case.value), "number": _number(case.value)}
        row |= {"n_cameras": len(case.layout.cameras), "n_points": len(case.layout.p)}
        try:
            expected = predicted(case.layout)
            row |= _design(case) | _accuracy(case, expected)
        except ValueError as error:
            rows.append({**row, "reason": str(error)})
            continue
        if trials:
            row |= checked(case, trials, np.random.default_rng([seed, number]))
        rows.append({**row, "reason": ""})
        cameras.append(_cameras(case, expected))
        if number == 0:
            volume = _volume(case, expected)
    every = pd.concat(cameras, ignore_index=True) if cameras else pd.DataFrame()
    return Sensitivity(pd.DataFrame(rows), every, volume)


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else np.nan


def _design(case: Case) -> dict[str, Any]:
    """The relations of the thesis's appendix A: field of view, size of the target in it, least size (mean, worst)."""
    layout = case.layout
    fields = [field_of_view(camera, mean_depth(camera, layout.q)) for camera in layout.cameras]
    across = [_across(camera, case) for camera in layout.cameras]
    smallest = min(float(np.nanmin(each)) for each in across)
    return {
        "diagonal_field": diagonal_field(layout.cameras, layout.q),
        "field_width": float(np.mean([field.width for field in fields])),
        "field_height": float(np.mean([field.height for field in fields])),
        "units_per_px": float(np.mean([_units_per_px(c, f) for c, f in zip(layout.cameras, fields, strict=True)])),
        "target_px": float(np.mean([np.nanmean(each) for each in across])),
        "target_px_least": smallest,
        "target_pixels_least": float(pixels_found(smallest)),
        "least_diameter": max(least_diameter(field.height) for field in fields),
        "large_enough": bool(
            case.diameter >= max(least_diameter(f.height) for f in fields) and pixels_found(smallest) >= LEAST_PIXELS
        ),
        # ASSUME: two targets are distinguished when their images are 2 px from touching
        "least_spacing": case.diameter * float(np.mean([1 + 2 / np.nanmean(each) for each in across])),
        "target_noise_px": float(np.mean(layout.target_sd)),
        "calibration_noise_px": float(np.mean(layout.calibration_sd)),
    }


def _across(camera: Camera, case: Case) -> Array:
    across = pixels_across(camera, case.layout.q, case.diameter)
    if not np.isfinite(across).any():
        raise ValueError(f"{camera.name} looks away from the volume")
    return across


def _units_per_px(camera: Camera, field: Field) -> float:
    return field.width / camera.image_size[0]


def _accuracy(case: Case, expected: Prediction) -> dict[str, Any]:
    sd = np.sqrt(np.einsum("naa->na", expected.covariance))
    length, floor = mean_length(expected.covariance), mean_length(expected.floor)
    located = np.isfinite(length)
    if not located.any():
        raise ValueError("no two cameras see the same place in the volume")
    mean = float(length[located].mean())
    return {
        "share_located": float(located.mean()),
        **{f"mean_abs_{axis}": NORMAL_MEAN_ABS * float(sd[located, k].mean()) for k, axis in enumerate(AXES)},
        **{f"max_sd_{axis}": float(sd[located, k].max()) for k, axis in enumerate(AXES)},
        "mean_3d": mean,
        "worst_mean_3d": float(length[located].max()),
        "floor_3d": float(floor[located].mean()),
        "ratio": mean / float(floor[located].mean()),
        "one_over_share_of_diagonal_field": diagonal_field(case.layout.cameras, case.layout.q) / mean,
    }


def checked(case: Case, trials: int, rng: np.random.Generator) -> dict[str, Any]:
    """The same errors from simulated calibrations: balls hung with the survey's errors, centroids with noise.

    Each trial calibrates afresh and locates every place of the volume once; sd_... is the standard error of a mean.
    """
    layout = case.layout
    visible = in_picture(layout.cameras, layout.q)
    sights = np.where(visible[..., None], [project(camera, layout.q) for camera in layout.cameras], np.nan)
    errors, failed = [], 0
    for _ in range(trials):
        try:
            cameras = _calibrated(case, rng)
        except ValueError:
            failed += 1
            continue
        noise = rng.normal(size=sights.shape) * layout.target_sd[:, None, None]
        errors.append(locate_points(cameras, sights + noise, sd=layout.target_sd).point - layout.q)
    if not errors:
        return {"trials": 0, "trials_failed": failed}
    e = np.abs(errors)
    by_trial = np.column_stack([np.nanmean(e, 1), np.nanmean(np.linalg.norm(e, axis=-1), 1)])
    names = [*(f"mean_abs_{axis}" for axis in AXES), "mean_3d"]
    spread = by_trial.std(0, ddof=1) / np.sqrt(len(e)) if len(e) > 1 else np.full(4, np.nan)
    return {
        "trials": len(e),
        "trials_failed": failed,
        **dict(zip((f"checked_{name}" for name in names), by_trial.mean(0).tolist(), strict=True)),
        "sd_checked_mean_3d": float(spread[3]),
    }


def _calibrated(case: Case, rng: np.random.Generator) -> Sequence[Camera]:
    layout = case.layout
    if case.uniform_survey:
        error = rng.uniform(-1, 1, layout.p.shape) * layout.sigma * np.sqrt(3)
    else:
        error = rng.normal(size=layout.p.shape) * layout.sigma
    b = np.array([project(camera, layout.p + error) for camera in layout.cameras])
    b += rng.normal(size=b.shape) * layout.calibration_sd[:, None, None]
    for camera, seen in zip(layout.cameras, b, strict=True):
        seen[~contains(camera, seen)] = np.nan
    sd = layout.calibration_sd
    if layout.refine == "bundle" and layout.sigma > 0:
        return bundle(
            layout.cameras,
            layout.p,
            b,
            sigma=layout.sigma,
            free=layout.free,
            sd=sd[:, None, None],
            scale_sd=False,
        ).cameras
    cameras = []
    for i, camera in enumerate(layout.cameras):
        use = np.isfinite(b[i]).all(-1)
        survey = layout.sigma if layout.sigma > 0 else None
        fit = refine(camera, layout.p[use], b[i, use], free=layout.free[i], sd=float(sd[i]), survey=survey)
        if not fit.converged:
            raise ValueError(fit.message)
        cameras.append(fit.camera)
    return cameras


def _cameras(case: Case, expected: Prediction) -> pd.DataFrame:
    """How well each camera will be known: standard errors of its parameters, and what its picture covers."""
    rows = []
    for i, (camera, known) in enumerate(zip(case.layout.cameras, expected.parameters, strict=True)):
        field = field_of_view(camera, mean_depth(camera, case.layout.q))
        row: dict[str, Any] = {"sweep": case.sweep, "value": str(case.value), "camera": camera.name}
        row |= {"n_points": int(expected.n_points[i])}
        row |= {f"field_{name}": size for name, size in field._asdict().items()}
        row |= {"target_px": float(np.nanmean(_across(camera, case))), "target_noise_px": case.layout.target_sd[i]}
        row |= {f"sd_{name}": float(s) for name, s in zip(known.names, known.standard_errors, strict=True)}
        rows.append(row)
    return pd.DataFrame(rows)


def _volume(case: Case, expected: Prediction) -> pd.DataFrame:
    sd = np.sqrt(np.einsum("naa->na", expected.covariance))
    columns: dict[str, Any] = dict(zip(AXES, case.layout.q.T, strict=True))
    columns |= {f"sigma_{axis}": sd[:, k] for k, axis in enumerate(AXES)}
    columns |= {"mean_3d": mean_length(expected.covariance), "floor_3d": mean_length(expected.floor)}
    return pd.DataFrame({**columns, "n_cameras": expected.n_cameras})
