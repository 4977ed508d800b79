"""Stage locate, mode plane: centroids of one camera become positions by a scale factor or by known points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.camera.plane_camera import PlaneCamera, plane_camera
from vidtrack.calibration.refraction.interfaces import interfaces_from_settings
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.location.associations import COLUMNS as COLUMNS_OF_ASSOCIATIONS
from vidtrack.location.associations import association_columns
from vidtrack.location.cameras.followed import ROWS, rows_of, view_of
from vidtrack.location.cameras.run_pictures import Pictures, columns_in_calibration, record_of, windows
from vidtrack.location.one_camera.in_picture import findings_of_picture, followed_in_picture
from vidtrack.location.one_camera.plane import (
    Plane,
    PlaneFit,
    fit_plane,
    jacobian_by_position,
    on_one_line,
    scaled_plane,
    world_covariance,
    world_from_frame_buffer,
)
from vidtrack.location.one_camera.plane_zoom import Places, with_zoom_in_plane
from vidtrack.location.one_camera.tilt import tilt
from vidtrack.memory import columns_of
from vidtrack.timing.clock import Clock

COLUMNS = {
    "time_s": "s",
    "timecode": "",
    "target": "",
    **dict.fromkeys(("x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "miss"), "world"),
    "n_cameras": "",
    "flag": "",
}

TILT_LIMIT_DEG = 3.0
"""Beyond it a picture must be rectified before a scale factor holds (thesis 4.2, after Wolf 1974)."""

CENTROID_SD_PX = 0.1
"""ASSUME: of a centroid whose own standard deviation is not known."""


class PlaneLocations(NamedTuple):
    """Trajectories as in mode space, with z and miss NaN; and findings about the plane."""

    trajectories: pd.DataFrame
    record: dict[str, Any]
    associations: pd.DataFrame  # a row a tracklet, as of `locate`


def locate_plane(
    centroids: pd.DataFrame,
    *,
    scale: float | None = None,
    aspect: float = 1.0,
    points: pd.DataFrame | None = None,
    units: str = "",
    sightings: pd.DataFrame | None = None,
    centre: tuple[float, float] | None = None,
    pictures: Mapping[str, Pictures] | None = None,
    image_size: tuple[int, int] | None = None,
    model: str = "auto",
    clock: Mapping[str, float] | None = None,
    targets: int | Sequence[str] | Literal["all"] | None = None,
    tracklets: pd.DataFrame | None = None,
    camera: str = "",
    through: Sequence[Mapping[str, Any]] = (),
    zoom: float = 0.0,
    where: str = "mode plane",
) -> PlaneLocations:
    """Locate every centroid in the plane in which the targets move.

    With `scale`: x = scale aspect Xf, y = scale Yf, world units per px; y runs down, as in the picture.
    With `points`: the plane of known points, in their own axes, by the models of `location.one_camera.plane.fit_plane`.

    centroids   time_s, target, Xf, Yf (px); timecode, flag, sd_x, sd_y (px) where there are any
    points      tag, x, y[, z, sigma], and Xf, Yf (px)[, sd_x, sd_y] unless `sightings` has those, by tag;
                a point without Xf is left out
    centre      px, of the lens; default: the middle of image_size, or of the points
    image_size  px, of the picture that shows the points; without it, a picture just large enough for them
    pictures    the camera: the sizes of its pictures; None: the run's is that of the points' clip
    clock       offset_s and rate_ppm, added to the camera's time
    targets     their names, or how many there are; all: as many as the motion in the picture shows, each with rows from
                its first sample to its last; None: those of the centroids
    through     the interfaces through which it sees the plane, as `interfaces` in config.yaml and their name: light is
                bent there, where that predicts points left out better than the maps do; the plane is that of z
    zoom        a logarithm, by which the targets' sizes hint that the lens was zoomed; held in sigma
    tracklets   all that the camera followed, `association.tracklets.COLUMNS`; None: the centroids are the targets
    A centroid of NaN gives a row of NaN with its flag. Raises VidtrackError when the plane cannot be determined.
    """
    if (scale is None) == (points is None):
        raise VidtrackError(f"{where}: plane needs either scale or points, and not both. Give one of them.")
    centroids = centroids[np.isfinite(centroids["time_s"].to_numpy(float))]
    centroids, associations, open_ = _associated(centroids, tracklets, targets, camera)
    places: Places
    if scale is not None:
        plane, record = scaled_plane(scale, aspect), _scale_record(scale, aspect, units)
        places = partial(_by_map, plane)
    else:
        shown, findings = windows(pictures or {}, where)
        part = next(iter(shown.values()), None)
        centroids = centroids.assign(**columns_in_calibration(centroids, part))
        if centre is None and image_size is not None:
            centre = ((image_size[0] - 1) / 2, (image_size[1] - 1) / 2)
        known = _known_points(points, sightings, where)
        fit = _fitted(known, aspect, centre, model, where)
        plane, record = fit.plane, _points_record(fit, known, aspect, units, image_size)
        places = partial(_by_map, plane)
        if through and (bent := _bent(known, through, aspect, centre, image_size, units, where)):
            record["held_out_by_model"] = {**record["held_out_by_model"], "refracted": bent.held_out}
            if not record["held_out_rms"] <= bent.held_out:  # also where it is not known
                record |= {"model": "refracted", "held_out_rms": bent.held_out, "rms_px": bent.fit.rms_px}
                places = bent.located
        places = with_zoom_in_plane(places, zoom, centre or tuple(known[["Xf", "Yf"]].mean()))
        record |= {"pictures": record_of(shown), "findings": as_records(findings)}
    if clock is not None:
        centroids = centroids.assign(time_s=Clock(**clock).corrected(centroids["time_s"].to_numpy(float)))
    table = located(places, centroids)
    record["samples"], record["located"] = len(table), int(table["x"].notna().sum())
    measured = np.isfinite(centroids["Xf"].to_numpy(float))
    unknown = float(np.isnan(_measured_sd(centroids)[measured]).any(1).sum() / max(measured.sum(), 1))
    if unknown > 0:
        text = (
            f"{where}: the noise of {100 * unknown:.3g} % of the centroids is not known: sigma rests there on "
            f"{CENTROID_SD_PX:g} px, which is assumed"
        )
        open_ = [*open_, Finding("doubtful", "noise-assumed", text, "Give sd_x, sd_y with the centroids.")]
    record["findings"] = [*record.get("findings", []), *as_records(open_)]
    return PlaneLocations(table, record, associations)


def _associated(
    centroids: pd.DataFrame,
    tracklets: pd.DataFrame | None,
    targets: int | Sequence[str] | Literal["all"] | None,
    camera: str,
) -> tuple[pd.DataFrame, pd.DataFrame, list[Finding]]:
    """The centroids by target as the motion shows them, the table of tracklets, and what is open.

    One target is what the tracker says it is: there is nothing else that it could be.
    """
    everything = targets == "all"
    names = None if targets is None or everything or isinstance(targets, int) else list(targets)
    limit = targets if isinstance(targets, int) else None if names is None else len(names)
    if targets is None or tracklets is None or (limit == 1 and not everything) or centroids.empty:
        return centroids, pd.DataFrame({name: [] for name in COLUMNS_OF_ASSOCIATIONS}), []
    view = view_of(camera, rows_of(columns_of(centroids, ROWS)), rows_of(columns_of(tracklets, ROWS)), None, None)
    found = followed_in_picture(view, names, limit, whole=not everything)
    m, T = found.b.shape[:2]
    table = pd.DataFrame(
        {
            "time_s": np.tile(view.t, m),
            "timecode": np.tile(view.timecode, m),
            "target": np.repeat(np.array(found.labels, object), T),
            "Xf": found.b[..., 0].ravel(),
            "Yf": found.b[..., 1].ravel(),
            "sd_x": found.sd[..., 0].ravel(),
            "sd_y": found.sd[..., 1].ravel(),
            "flag": found.flag.ravel(),
        }
    )
    tied = pd.DataFrame(association_columns([view], found.match))
    return table[found.kept.ravel()].reset_index(drop=True), tied, findings_of_picture(view, found, limit)


def _by_map(plane: Plane, b: Array, sd: Array) -> tuple[Array, Array]:
    return world_from_frame_buffer(plane, b), world_covariance(plane, b, sd)


def _bent(
    known: pd.DataFrame,
    through: Sequence[Mapping[str, Any]],
    aspect: float,
    centre: tuple[float, float] | None,
    image_size: tuple[int, int] | None,
    units: str,
    where: str,
) -> PlaneCamera | None:
    """The camera that sees the known points through its interfaces; None where they do not give one."""
    b = known[["Xf", "Yf"]].to_numpy(float)
    if "z" not in known or not np.isfinite(known["z"]).all():
        raise VidtrackError(f"{where}: known points need z, for light is bent at {through[0]['name']}. Survey their z.")
    size = image_size or (int(np.ceil(b[:, 0].max())) + 1, int(np.ceil(b[:, 1].max())) + 1)
    sd, sigma = _noise_of(known)
    return plane_camera(
        known[["x", "y", "z"]].to_numpy(float),
        b,
        interfaces_from_settings(where, through, units),
        centre=centre or ((size[0] - 1) / 2, (size[1] - 1) / 2),
        image_size=size,
        aspect=aspect,
        sd=sd,
        sigma=sigma,
    )


def located(places: Places, centroids: pd.DataFrame) -> pd.DataFrame:
    """Trajectories of centroids in a known plane; see `locate_plane`. places: positions and covariances of px."""
    p, covariance = places(centroids[["Xf", "Yf"]].to_numpy(float), _centroid_sd(centroids))
    sigma = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    n = len(centroids)
    table = pd.DataFrame(
        {
            "time_s": centroids["time_s"].to_numpy(float),
            "timecode": centroids["timecode"].array if "timecode" in centroids else np.full(n, "", object),
            "target": centroids["target"].astype(str).array,
            "x": p[:, 0],
            "y": p[:, 1],
            "z": np.full(n, np.nan),
            "sigma_x": sigma[:, 0],
            "sigma_y": sigma[:, 1],
            "sigma_z": np.full(n, np.nan),
            "miss": np.full(n, np.nan),
            "n_cameras": np.isfinite(p).all(-1).astype(np.int64),
            "flag": centroids["flag"].fillna("").astype(str).array if "flag" in centroids else np.full(n, ""),
        }
    )
    return table.sort_values(["target", "time_s"], kind="stable", ignore_index=True)


def _centroid_sd(centroids: pd.DataFrame) -> np.ndarray[Any, np.dtype[np.float64]]:
    sd = _measured_sd(centroids)
    return np.where(np.isfinite(sd), sd, CENTROID_SD_PX)


def _measured_sd(centroids: pd.DataFrame) -> Array:
    """Standard deviations (n, 2), px, of centroids as they were measured; NaN where they are not known."""
    sd: Array = centroids.reindex(columns=["sd_x", "sd_y"]).to_numpy(float)
    return sd


def _known_points(points: pd.DataFrame | None, sightings: pd.DataFrame | None, where: str) -> pd.DataFrame:
    assert points is not None
    known: pd.DataFrame = points.assign(tag=points["tag"].astype(str)) if "tag" in points else points.assign(tag="")
    if sightings is not None:
        seen = sightings.assign(tag=sightings["tag"].astype(str))
        columns = [c for c in ("tag", "Xf", "Yf", "sd_x", "sd_y") if c in seen]
        known = known.drop(columns=[c for c in columns if c != "tag" and c in known]).merge(seen[columns], on="tag")
    usable = np.isfinite(known[["Xf", "Yf", "x", "y"]].to_numpy(float)).all(1)
    known = known.loc[usable].reset_index(drop=True)
    if len(known) < 2:
        raise VidtrackError(
            f"{where}: {len(known)} known points are in view; a scale needs two. Show more points, or give plane.scale."
        )
    return known


def _fitted(known: pd.DataFrame, aspect: float, centre: tuple[float, float] | None, model: str, where: str) -> PlaneFit:
    p = known[["x", "y"]].to_numpy(float)
    if "z" in known and np.isfinite(known["z"]).all():
        rise, extent = float(np.ptp(known["z"])), float(np.ptp(p, axis=0).max())
        if rise > 0.01 * extent:
            raise VidtrackError(
                f"{where}: the known points' z spans {rise:g} over {extent:g} in x and y: no plane of one z. "
                "Survey points in the plane of motion, with x and y in it, or use two cameras and mode space."
            )
    sd, sigma = _noise_of(known)
    try:
        return fit_plane(
            known[["Xf", "Yf"]].to_numpy(float), p, sd=sd, sigma=sigma, aspect=aspect, centre=centre, model=model
        )
    except ValueError as problem:
        raise VidtrackError(f"{where}: known points: {problem}. Show more points, spread over the picture.") from None


def _noise_of(known: pd.DataFrame) -> tuple[Array, Array]:
    """Of sights (n, 2), px, and of the survey (n,), world units."""
    sd = known.reindex(columns=["sd_x", "sd_y"]).to_numpy(float)
    sd = np.where(np.isfinite(sd) & (sd > 0), sd, CENTROID_SD_PX)
    return sd, known["sigma"].fillna(0.0).to_numpy(float) if "sigma" in known else np.zeros(len(known))


def _scale_record(scale: float, aspect: float, units: str) -> dict[str, Any]:
    return {
        "mode": "plane",
        "model": "scale",
        "units": units,
        "scale": scale,
        "aspect": aspect,
        "axes": "x right, y down, from the middle of the top-left pixel",
        "tilt_deg": None,
        "warnings": [],
    }


def _points_record(
    fit: PlaneFit, known: pd.DataFrame, aspect: float, units: str, image_size: tuple[int, int] | None
) -> dict[str, Any]:
    b, p = known[["Xf", "Yf"]].to_numpy(float), known[["x", "y"]].to_numpy(float)
    scales = np.sqrt(np.abs(np.linalg.det(jacobian_by_position(fit.plane, b))) / aspect)
    miss = np.linalg.norm(fit.residuals, axis=-1)
    leaning = tilt(b, p, aspect=aspect, image_size=image_size)
    held_out = fit.held_out.get(fit.plane.model, np.nan)
    record = {
        "mode": "plane",
        "model": fit.plane.model,
        "units": units,
        "scale": float(np.median(scales)),
        "scale_lowest": float(scales.min()),
        "scale_highest": float(scales.max()),
        "aspect": aspect,
        "axes": "those of the known points; z " + ("away from" if fit.plane.side > 0 else "towards") + " the camera",
        "n_points": len(known),
        "rms": float(np.sqrt((miss**2).mean())),
        "max": float(miss.max()),
        "max_tag": str(known["tag"].iloc[int(miss.argmax())]),
        "held_out_rms": held_out,
        "held_out_by_model": fit.held_out,
        "chi2": fit.chi2,
        "on_one_line": on_one_line(b),
        "tilt_deg": leaning.angle,
        "tilt_sd_deg": leaning.sd,
    }
    return {**record, "warnings": _warnings(record)}


def _warnings(record: dict[str, Any]) -> list[str]:
    warnings = []
    if record["tilt_deg"] > TILT_LIMIT_DEG and record["model"] in ("scale", "affine"):  # others rectify it
        warnings.append(
            f"the plane leans {record['tilt_deg']:.1f} +- {record['tilt_sd_deg']:.1f} degrees out of the picture's own "
            f"(limit {TILT_LIMIT_DEG:g}): a scale factor does not hold"
        )
    if record["chi2"] > 4:
        warnings.append(
            f"the known points miss the plane by {record['rms']:.4g} rms, {np.sqrt(record['chi2']):.1f} times what "
            f"their noise explains; worst is tag {record['max_tag']}"
        )
    if record["on_one_line"]:
        warnings.append(
            "the known points lie on one line: nothing shows how the plane leans across it; add points there"
        )
    if np.isnan(record["held_out_rms"]):
        warnings.append(f"{record['n_points']} known points leave none to check the {record['model']} with")
    return warnings
