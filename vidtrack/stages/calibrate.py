"""Stage calibrate: the named points that one camera sees become that camera, with the uncertainty of every number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.ball_points import ball_offsets, ball_radii, perspective_record
from vidtrack.calibration.camera import gates
from vidtrack.calibration.camera.centre_search import REACH_PX, SearchMap, search_map
from vidtrack.calibration.camera.initial_fit import Nominal, appearing
from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.calibration.camera.one_camera import (
    Answer,
    Inliers,
    NoCamera,
    Points,
    Task,
    better_part,
    calibrated,
    inliers,
    with_unexplained_noise,
)
from vidtrack.calibration.camera.outliers import Mask, Mixup, limit_for, mixups
from vidtrack.calibration.camera.refine import Uncertainty, free_parameters
from vidtrack.calibration.camera.unlikely_units import unlikely_units
from vidtrack.calibration.centroid_noise import centroid_sd
from vidtrack.calibration.doubts import doubts, lens_findings, mirrored_place, outlier_findings
from vidtrack.calibration.task_settings import Fix, Prior, task_from_settings
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera, project

CENTROID_SD_PX = 0.1
"""ASSUME: of a centroid whose own noise is not known; only its ratio to the survey's tolerance matters."""

Rows = NDArray[np.intp]


class Calibration(NamedTuple):
    """One camera, and how it came about."""

    camera: Camera
    uncertainty: Uncertainty
    points: pd.DataFrame  # the sightings, with used, reason, residual_x, residual_y, outline_x, outline_y (px)
    search: pd.DataFrame | None  # the error over Cx, Cy and the sensor's width
    record: dict[str, Any]  # what camera.json holds beside the camera
    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as lines."""
        return tuple(f"{finding.text} {finding.cure}".strip() for finding in self.findings)


def calibrate(
    sightings: pd.DataFrame,
    *,
    image_size: tuple[int, int],
    Cx: float | None = None,
    Cy: float | None = None,
    sensor: tuple[float, float] | None = None,
    model: str = "auto",
    refine: str = "full",
    fix: Fix = (),
    prior: Prior | None = None,
    reject: str = "auto",
    through: Sequence[Mapping[str, Any]] = (),
    sigma: float = 0.0,
    camera: str = "",
    units: str = "in",
    left_out: Mapping[tuple[str, str], str] | None = None,
    search: bool = True,
    seed: int = 0,
    lens: KnownLens | None = None,
) -> Calibration:
    """Calibrate one camera from the points it sees.

    sightings    tag, x, y, z (units), Xf, Yf (px); and where known clip, sigma (units), sd_x, sd_y (px), found, reason
    image_size   px, (width, height)
    Cx, Cy       px, where the optical axis is thought to be; default: the middle of the picture
    sensor       mm, (width, height) of the area that the frame covers; default: dx = dy = 1 px
    model        one of LENS_MODELS, or auto: the plainest that predicts held-out points as well as any
    refine       linear: closed form at Cx, Cy; centre: also searches Cx, Cy; full or bundle: every parameter
    fix          names that are held (Sx at 1, Cx and Cy as given, lens terms at 0), or names with values
    prior        name: (mean, standard deviation)
    reject       auto: outliers are left out; off: every point is used
    through      the interfaces through which it sees, from the camera on, as `interfaces` in config.yaml and their name
    sigma        units, survey tolerance (1 sigma) of points that have none of their own
    left_out     (clip, tag): why it is not used, as all cameras together judged (`stages.survey`)
    search       whether to map the error over Cx, Cy and the sensor's width
    seed         of the random samples by which bad points are found
    lens         where the lens is known: 4 points place the camera
    Balls, whose width or pixels are known, are moved to where a point in their middle is seen, by the camera that a
    first fit gives (`geometry.ball_perspective`), and the camera is fitted again: it is one of points.
    Raises VidtrackError, one line a problem, when no camera can be had; what can be lived with is in `findings`.
    """
    where = f"cameras.{camera}" if camera else "calibrate"
    task = task_from_settings(
        where, image_size, Cx, Cy, sensor, model, refine, fix, prior, reject, through, units, lens
    )
    table = sightings.reset_index(drop=True).assign(tag=sightings["tag"].astype(str).to_numpy())
    _check_tags(where, table)
    table = _without(table, left_out or {})
    rows = _usable(table)
    points = stated = _points(table, rows, sigma)
    _refuse(where, points, task)
    best = better_part(points, seed=seed)
    _refuse_mirror(where, points.take(best), task.nominal)
    found, good, answer = _answered(where, points, task, best)
    radius, perspective = ball_radii(table)[rows], {}
    if (radius > 0).any():  # the camera is known well enough for what its perspective does to balls
        offset = ball_offsets(answer.camera, points.p, points.b, radius)
        points = stated = points._replace(b=points.b - offset)
        table = _moved(table, rows, offset)
        found, good, answer = _answered(where, points, task, best)
        perspective = {"perspective": perspective_record(answer.camera, points.p, points.b, offset, radius)}
    places = project(answer.camera, points.p)
    noise = found.scale if np.isfinite(found.scale) else answer.fit.sigma_px
    mixed = mixups(places, points.b, ~found.keep, max(limit_for(points.n) * noise, 1.0))
    tags = table["tag"].iloc[rows].tolist()
    used = _points_table(table, rows, tags, found, points.b - places, mixed)
    mapped = _searched(good, task, answer) if search else None
    findings = [
        *outlier_findings(tags, points, found, points.b - places, mixed, answer, known_lens=lens is not None),
        *doubts(stated.take(found.keep), good, task, answer, units),
        *(lens_findings(lens, answer, good, tags, units) if lens else ()),
        *unlikely_units(answer.camera, points.p, radius, units),
    ]
    findings = [finding._replace(text=f"{where}: {finding.text}") for finding in findings]
    record = (
        _record(answer, task, good, table, mapped)
        | perspective
        | {
            "units": units,
            "settings": _settings(Cx, Cy, sensor, task, sigma),
            "warnings": [f"{finding.text} {finding.cure}".strip() for finding in findings],
            "findings": as_records(findings),
        }
    )
    named = answer.camera.with_(name=camera)
    return Calibration(named, answer.uncertainty, used, _search_table(mapped, task), record, tuple(findings))


def _answered(where: str, points: Points, task: Task, best: Mask) -> tuple[Inliers, Points, Answer]:
    """Which points are inliers, those with their noise, and the camera that they give."""
    try:
        found = inliers(points, task, best)
        good = with_unexplained_noise(points.take(found.keep), found)
        _refuse(where, good, task, among=points.n)
        answer = calibrated(good, task)
        if task.lens and good.n < gates.LINEAR_NEEDS and mirrored_place(task.lens, good, answer.fit.sigma_px):
            raise NoCamera(gates.mirrored(-1))
    except NoCamera as none:
        raise VidtrackError(f"{where}: {none}") from None
    return found, good, answer


def _moved(table: pd.DataFrame, rows: Rows, offset: Array) -> pd.DataFrame:
    """The sightings with balls where their middles are seen, and by how much their outlines lie off these."""
    every = np.zeros((len(table), 2))
    every[rows] = offset
    off = dict(zip(("outline_x", "outline_y"), every.T, strict=True))
    return table.assign(Xf=table["Xf"] - every[:, 0], Yf=table["Yf"] - every[:, 1], **off)


def _check_tags(where: str, table: pd.DataFrame) -> None:
    """Gate: one tag, one place in the world; and in one clip, one sighting."""
    clips = table["clip"].astype(str).tolist() if "clip" in table else [""] * len(table)
    seen: dict[tuple[str, str], int] = {}
    places: dict[str, tuple[float, ...]] = {}
    problems: dict[str, None] = {}
    for clip, tag, place in zip(clips, table["tag"], table[["x", "y", "z"]].to_numpy(float).tolist(), strict=True):
        seen[clip, tag] = seen.get((clip, tag), 0) + 1
        if seen[clip, tag] == 2:
            inside = f" in clip {clip}" if clip else ""
            problems[f"{where}: tag {tag} is sighted more than once{inside}. Give each point its own tag."] = None
        elif places.setdefault(tag, tuple(place)) != tuple(place):
            problems[f"{where}: tag {tag} has two places in the world. Give each point its own tag."] = None
    if problems:
        raise VidtrackError(*problems)


def _without(table: pd.DataFrame, left_out: Mapping[tuple[str, str], str]) -> pd.DataFrame:
    """The sightings, those that are not to be used with their reason and not `found`."""
    clips = table["clip"].astype(str) if "clip" in table else pd.Series("", table.index)
    why = [left_out.get(key, "") for key in zip(clips, table["tag"], strict=True)]
    if not any(why):
        return table
    old = table["reason"].fillna("").astype(str) if "reason" in table else [""] * len(table)
    out = np.array([bool(each) for each in why])
    return table.assign(judged_out=out, reason=[new or own for new, own in zip(why, old, strict=True)])


def _usable(table: pd.DataFrame) -> Rows:
    usable = np.isfinite(table[["x", "y", "z", "Xf", "Yf"]].to_numpy(float)).all(1)
    if "found" in table:
        usable &= table["found"].fillna(False).to_numpy(bool)
    if "judged_out" in table:
        usable &= ~table["judged_out"].to_numpy(bool)
    return np.flatnonzero(usable)


def _points(table: pd.DataFrame, rows: Rows, sigma: float) -> Points:
    numbers = table[["x", "y", "z", "Xf", "Yf"]].to_numpy(float)[rows]
    own = table["sigma"].to_numpy(float)[rows] if "sigma" in table else np.full(len(rows), np.nan)
    survey = np.where(np.isfinite(own), own, sigma)
    sd = centroid_sd(table, rows)
    if sd is None and survey.any():
        sd = np.full((len(rows), 2), CENTROID_SD_PX)
    clips = table["clip"].astype(str).to_numpy(np.str_)[rows] if "clip" in table else None
    return Points(numbers[:, :3], numbers[:, 3:], sd, survey if survey.any() else None, clips)


def _refuse(where: str, points: Points, task: Task, among: int | None = None) -> None:
    """The checks that no camera may fail; the first that fails is reported."""
    free = free_parameters("tsai" if task.model == "auto" else task.model)
    known = [name for name in free if name in task.fixed or name in task.priors]
    flat_meant = points.n > 2 and points.coplanar and "Sx" in known
    line = (
        gates.too_few(points.n, task.refine, task.model, coplanar=flat_meant, known=len(known))
        or gates.straight(points.p)
        or gates.coplanar(points.p, task.refine, known)
        or gates.disagreeing(points.n, among or points.n)
    )
    if line:
        raise VidtrackError(f"{where}: {line}")


def _refuse_mirror(where: str, best: Points, nominal: Nominal) -> None:
    if best.n < gates.LINEAR_NEEDS:
        return
    sense = gates.handedness(best.p, best.b, nominal.Cx, nominal.Cy, nominal.dx, nominal.dy)
    if line := gates.mirrored(sense):
        raise VidtrackError(f"{where}: {line}")


def _points_table(
    table: pd.DataFrame, rows: Rows, tags: list[str], found: Inliers, errors: Array, mixed: list[Mixup]
) -> pd.DataFrame:
    """The sightings with used, reason and the reprojection error; every point stays."""
    used = np.zeros(len(table), bool)
    used[rows[found.keep]] = True
    reason = table["reason"].fillna("").astype(str).tolist() if "reason" in table else [""] * len(table)
    for row in np.setdiff1d(np.arange(len(table)), rows).tolist():
        reason[row] = reason[row] or "not found"
    place_of = {m.point: m for m in mixed}
    for i in np.flatnonzero(~found.keep).tolist():
        if mixup := place_of.get(i):
            other = tags[mixup.place]
            reason[rows[i]] = f"swapped with tag {other}" if mixup.mutual else f"lies where tag {other} should be"
        else:
            reason[rows[i]] = _off(float(np.hypot(*errors[i])), found.scale)
    residual = np.full((len(table), 2), np.nan)
    residual[rows] = errors
    table = table.drop(columns="judged_out", errors="ignore")
    return table.assign(used=used, reason=reason, residual_x=residual[:, 0], residual_y=residual[:, 1])


def _off(distance: float, scale: float) -> str:
    if not np.isfinite(distance):
        return "behind the camera, or beyond the fold of its lens"
    return f"{distance:.3g} px off, {distance / scale:.0f} times the noise"


def _searched(good: Points, task: Task, answer: Answer) -> SearchMap:
    """The map about the nominal centre, or about the answer where that lies beyond reach; empty for a known lens."""
    if task.lens is not None:
        return SearchMap((), *(np.zeros(0) for _ in range(5)))
    camera, Cx, Cy = answer.camera, task.nominal.Cx, task.nominal.Cy
    if not task.closed and max(abs(camera.Cx - Cx), abs(camera.Cy - Cy)) > REACH_PX:
        Cx, Cy = camera.Cx, camera.Cy
    free = () if task.closed else answer.uncertainty.names
    return search_map(
        camera.with_(through=()),
        appearing(camera, good.p),
        good.b,
        Cx=Cx,
        Cy=Cy,
        free=free,
        held=task.held,
        coplanar=good.coplanar,
    )


def _search_table(mapped: SearchMap | None, task: Task) -> pd.DataFrame | None:
    """The map's columns, and rms_px: the error by the method in use."""
    if mapped is None:
        return None
    return pd.DataFrame(mapped._asdict()).assign(rms_px=mapped.rms_closed_form if task.closed else mapped.rms_refined)


def _search_record(mapped: SearchMap, task: Task) -> dict[str, Any]:
    """Where the least error lies, and how far the centre may move before it rises by a tenth."""
    error = mapped.rms_closed_form if task.closed else mapped.rms_refined
    known = np.isfinite(error) & np.isfinite(mapped.Cx)
    if not known.any():
        return {}
    x, y, e = mapped.Cx[known], mapped.Cy[known], error[known]
    best, flat = int(e.argmin()), e <= 1.1 * e.min()
    within = {"Cx": [x[flat].min(), x[flat].max()], "Cy": [y[flat].min(), y[flat].max()]}
    return {"best_Cx": x[best], "best_Cy": y[best], "rms_px": e[best], "within_a_tenth": within}


def _settings(
    Cx: float | None, Cy: float | None, sensor: tuple[float, float] | None, task: Task, sigma: float
) -> dict[str, Any]:
    priors = {name: list(prior) for name, prior in task.priors.items()}
    given = {"Cx": Cx, "Cy": Cy, "sensor": list(sensor) if sensor else None, "sigma": sigma}
    return given | {"model": task.model, "refine": task.refine, "fix": task.fixed, "prior": priors}


def _lens_record(task: Task) -> dict[str, Any]:
    """Where the lens is from, what was held of it, and what is known of the rest."""
    if task.lens is None:
        return {}
    lens, mean = task.lens, {name: getattr(task.lens.camera, name) for name in task.lens.names}
    known = {"names": list(lens.names), "mean": mean, "covariance": lens.covariance}
    source = {"source": lens.source, "largest_px": lens.largest_px, "rms_px": lens.rms_px}
    return {"lens": {**source, "use": "prior" if lens.names else "fixed", **known}}


def _record(answer: Answer, task: Task, good: Points, table: pd.DataFrame, mapped: SearchMap | None) -> dict[str, Any]:
    record: dict[str, Any] = {
        **_lens_record(task),
        "model": answer.model,
        "refine": task.refine,
        "n_points": good.n,
        "n_sighted": len(table),
        "rms_px": answer.fit.rms_px,
        "max_px": answer.max_px,
        "sigma_px": answer.fit.sigma_px,
        "misfit": answer.fit.misfit if good.sd is not None else None,
        "flatness": gates.flatness(good.p),
        "volume": {"low": good.p.min(0).tolist(), "high": good.p.max(0).tolist()},
    }
    if ladder := answer.ladder:
        record["ladder"] = {
            "held_out_px": {rung.model: rung.held_out_px for rung in ladder.rungs},
            "training_px": {rung.model: rung.training_px for rung in ladder.rungs},
            "reasons": list(ladder.reasons),
        }
    if mapped is not None:
        record["search"] = _search_record(mapped, task)
    return record
