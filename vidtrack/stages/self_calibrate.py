"""Stage self_calibrate: a body that floats, its targets at known distances, refines the cameras that see it.

The cameras keep what their own calibration determines, the world's axes above all; the body adds what its distances
show. Refined cameras are used only where held-out stretches of time show that they are better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.measurements import KnownCameras
from vidtrack.calibration.body.body_fit import BodyFit, fit_body
from vidtrack.calibration.body.body_heldout import Judged, judge_held_out
from vidtrack.calibration.body.body_shape import SETTINGS as SHAPE
from vidtrack.calibration.body.body_shape import ShapeTest, judge_shape
from vidtrack.calibration.body.body_sights import Body, BodySights, SurveySights, shape_seen, usable
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.surveys.shared_points import side_by_side
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface, pulls_of
from vidtrack.geometry.jacobian import columns, derivatives
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.shared_survey import joint_covariance, recorded_joint, surveys_of

MOST_MOMENTS, FEWEST_MOMENTS = 400, 40
"""Moments that are used at most, evenly over the runs; and from which the cameras can be refined."""
SIZE_SHARE = 1 / 2000
"""ASSUME: how well a body's coordinates are known where nothing is said of it, as a share of its size."""
RIGID = 2.5
"""Times their noise that sights may miss a rigid body of any shape: 1 where it is one, 1.5 where clocks are poor."""
ALL_KNOWN = 0.4
"""Share of what a calibration knows that its points must explain: less, and a lens that was known beforehand does."""
SHOWN = 60
"""Moments by which the calibration's part of sigma is shown."""


class SelfCalibrated(NamedTuple):
    """What `self_calibrate` returns for m cameras; those given, unchanged, where `used` is false."""

    cameras: tuple[Camera, ...]
    uncertainties: tuple[Uncertainty, ...]
    joint: dict[str, Any] | None  # what camera.json says of all of them together
    used: bool
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def self_calibrate(
    sights: Mapping[str, pd.DataFrame],
    calibrated: Mapping[str, Any],
    targets: Mapping[str, Sequence[float]],
    *,
    points: Mapping[str, pd.DataFrame] | None = None,
    sigma: float | None = None,
    body: str = "body",
    units: str = "in",
) -> SelfCalibrated:
    """Refine cameras by a rigid body.

    sights      run: time_s, target, camera, Xf, Yf, sd_x, sd_y (px), as `location.cameras.run_sights` has them
    calibrated  camera: as camera.json is read, (camera, uncertainty, record)
    targets     target: its place in the body's axes, world units
    points      camera: points.parquet, for what the calibrations have in common
    sigma       world units, standard deviation of each coordinate in the body; default: 1/2000 of its size
    Raises VidtrackError where the body has fewer than three targets, or the uncertainty of a camera is not known.
    """
    where = "calibration.self"
    names = list(calibrated)
    own = _body(targets, sigma, where, body)
    cameras = [calibrated[name][0] for name in names]
    uncertainties = [calibrated[name][1] for name in names]
    _check(names, uncertainties, where)
    joint = _joint(calibrated, cameras, uncertainties, points or {}, names)
    known = _known(cameras, uncertainties, joint)
    tables = [(points or {}).get(name) for name in names]
    seen = _sights(sights, names, own)
    moments, poses = usable(cameras, seen, own)
    record: dict[str, Any] = {
        "cameras": names,
        "runs": list(sights),
        "body": body,
        "sigma": own.sd,
        "units": units,
        "moments": int(moments.b.shape[1]),
    }
    if moments.b.shape[1] < FEWEST_MOMENTS:
        text = (
            f"{where}: three targets of {body} are located at {moments.b.shape[1]} moments of {', '.join(sights)}, "
            f"{FEWEST_MOMENTS} are needed: the cameras stay as they were"
        )
        cure = "Name runs in which the body moves longer before all cameras."
        return _unchanged(cameras, uncertainties, record, [Finding("doubtful", "self-calibration-short", text, cure)])
    rows = np.linspace(0, moments.b.shape[1] - 1, min(MOST_MOMENTS, moments.b.shape[1])).astype(int)
    moments, poses = moments.at(rows), poses[rows]
    try:
        located = own._replace(p=shape_seen(cameras, moments, own.p))
        survey = _surveyed(cameras, uncertainties, tables)
        free = fit_body(known, moments, located, poses, shape_sd=SHAPE.loose * own.size, survey=survey)
        shape = judge_shape(own, free.shape, free.shape_covariance)
        record |= {"moments_used": len(rows), "moments_alike": free.alike, "noise_factor": free.factor}
        record |= {"shape": _shape_record(shape)}
        if shape.reasons:
            return _unchanged(cameras, uncertainties, record, [_wrong(shape, own, body, units, where)])
        if free.factor > RIGID:
            return _unchanged(cameras, uncertainties, record, [_not_rigid(free, own, body, where)])
        judged = judge_held_out(known, free.sights, own, free.poses, survey)
        done = fit_body(known, moments, own, poses, survey=survey)
    except (ValueError, np.linalg.LinAlgError) as error:
        text = f"{where}: {body} does not refine the cameras ({error}); they stay as they were"
        finding = Finding("doubtful", "self-calibration-failed", text, "Leave calibration.self out.")
        return _unchanged(cameras, uncertainties, record, [finding])
    record |= {"held_out": judged.as_record()} | _gain(cameras, uncertainties, joint, done, free.sights)
    record["sigma_px"] = float(np.nanmedian(done.sights.sd) / np.sqrt(done.alike))
    if not (judged.helps and done.converged):
        return _unchanged(cameras, uncertainties, record, [_no_help(judged, body, units, where)])
    return _refined(done, names, record, _helped(record, judged, body, units, where))


def _body(targets: Mapping[str, Sequence[float]], sigma: float | None, where: str, name: str) -> Body:
    if len(targets) < 3:
        raise VidtrackError(f"{where}: {name} has {len(targets)} targets; three at known distances are needed.")
    p = np.array(list(targets.values()), float)
    spread = np.linalg.svd(p - p.mean(0), compute_uv=False)
    if spread[1] < 0.02 * spread[0]:
        raise VidtrackError(f"{where}: the targets of {name} lie on one line. Add a target beside that line.")
    own = Body(tuple(str(target) for target in targets), p, 0.0)
    return own._replace(sd=own.size * SIZE_SHARE if sigma is None else sigma)


def _check(names: Sequence[str], uncertainties: Sequence[Uncertainty | None], where: str) -> None:
    problems = []
    for name, uncertainty in zip(names, uncertainties, strict=True):
        if uncertainty is None or not np.isfinite(uncertainty.covariance).all():
            problems.append(
                f"{where}: the uncertainty of {name}'s calibration is not known, so that a body cannot be weighed "
                "against it. Calibrate it by points, a board or a wand, or leave calibration.self out."
            )
    if problems:
        raise VidtrackError(*problems)


def _joint(
    calibrated: Mapping[str, Any],
    cameras: Sequence[Camera],
    uncertainties: Sequence[Uncertainty],
    points: Mapping[str, pd.DataFrame],
    names: Sequence[str],
) -> Array:
    """The covariance of all the cameras' parameters, one camera after the other, as their own calibration has it."""
    joint = recorded_joint([calibrated[name] for name in names], uncertainties)
    tables = [points[name] for name in names if name in points and len(points[name])]
    if joint is None and len(tables) == len(names) and (surveys := surveys_of(cameras, tables, 0.1)):
        joint = joint_covariance(cameras, uncertainties, surveys)
    if joint is None:
        joint = np.zeros((sum(len(u.names) for u in uncertainties),) * 2)
        for place, u in zip(_places([u.names for u in uncertainties]), uncertainties, strict=True):
            joint[place, place] = u.covariance
    return joint


def _known(cameras: Sequence[Camera], uncertainties: Sequence[Uncertainty], joint: Array) -> KnownCameras:
    """What the cameras' own calibration determines of all of them together.

    An interface that was refined for several cameras at once is one thing that is known, and stands with the first.
    """
    names, kept = [], []
    said: dict[str, list[Interface]] = {}
    for camera, u, place in zip(cameras, uncertainties, _places([u.names for u in uncertainties]), strict=True):
        again = [own for own in camera.through if any(_same(own, other) for other in said.get(own.name, ()))]
        dropped = {name for own in again for name in own.parameters}
        names.append(tuple(name for name in u.names if name not in dropped))
        kept += [place.start + k for k, name in enumerate(u.names) if name not in dropped]
        for own in camera.through:
            said.setdefault(own.name, []).append(own)
    pivots = np.array([u.pivot for u in uncertainties], float)
    return KnownCameras(tuple(cameras), names, pivots, joint[np.ix_(kept, kept)])


def _surveyed(
    cameras: Sequence[Camera], uncertainties: Sequence[Uncertainty], tables: Sequence[pd.DataFrame | None]
) -> SurveySights | None:
    """The surveyed points behind the calibration of cameras that look through interfaces; None for cameras in air.

    Raises ValueError where they are not all that the calibration knows.
    """
    if not any(camera.through for camera in cameras):
        return None
    own = [table for table in tables if table is not None and len(table)]
    if len(own) < len(cameras):
        raise ValueError("behind an interface it can refine cameras only that surveyed points calibrated")
    shared = side_by_side([{str(name): column for name, column in table.items()} for table in own])
    sd = np.ones(shared.b.shape)
    for i, (camera, u, table) in enumerate(zip(cameras, uncertainties, own, strict=True)):
        sd[i] = float(np.nanmedian(table[["sd_x", "sd_y"]].to_numpy(float)))
        used = shared.used[i]
        at = derivatives(camera, shared.p[used], u.pivot)
        J = at.by_parameter[..., columns(camera, u.names)]
        sight = sd[i][0, 0] ** 2 * np.eye(2) + at.by_point @ at.by_point.swapaxes(-1, -2) * (
            shared.sigma[used, None, None] ** 2
        )
        known = (J.swapaxes(-1, -2) @ np.linalg.solve(sight, J)).sum(0)
        pulls = pulls_of(camera.through)
        known += np.diag([1 / pulls[name][1] ** 2 if name in pulls else 0.0 for name in u.names])
        rest = float(np.trace(np.asarray(u.covariance) @ known)) / len(u.names)
        if rest < ALL_KNOWN:
            raise ValueError("behind an interface it can refine cameras only of which nothing but points is known")
        sd[i] *= np.sqrt(max(rest, 1.0))  # the calibration found its sights that much rougher
    return SurveySights(shared.p, shared.sigma, shared.b_used, sd)


def _same(one: Interface, other: Interface) -> bool:
    return not one.deviation(other).any()


def _places(names: Sequence[Sequence[str]]) -> list[slice]:
    """Where each camera's parameters stand among those of all."""
    edges = np.cumsum([0, *map(len, names)]).tolist()
    return [slice(start, stop) for start, stop in pairwise(edges)]


def _sights(tables: Mapping[str, pd.DataFrame], names: Sequence[str], body: Body) -> BodySights:
    """The tables as arrays, run after run."""
    b, sd, runs = [], [], []
    place = {target: k for k, target in enumerate(body.targets)}
    for number, table in enumerate(tables.values()):
        table = table[table["target"].astype(str).isin(place) & table["camera"].isin(names)]
        times, moment = np.unique(table["time_s"].to_numpy(float).round(6), return_inverse=True)
        at = np.full((len(names), len(times), len(place), 2), np.nan)
        spread = np.full(at.shape, np.nan)
        target = table["target"].astype(str).map(place).to_numpy(int)
        camera = table["camera"].map({name: i for i, name in enumerate(names)}).to_numpy(int)
        at[camera, moment, target] = table[["Xf", "Yf"]].to_numpy(float)
        spread[camera, moment, target] = table[["sd_x", "sd_y"]].to_numpy(float)
        b.append(at)
        sd.append(spread)
        runs.append(np.full(len(times), number))
    sds = np.concatenate(sd, 1)
    usual = float(np.nanmedian(sds)) if np.isfinite(sds).any() else 1.0
    return BodySights(np.concatenate(b, 1), np.where(np.isfinite(sds), sds, usual), np.concatenate(runs))


def _unchanged(
    cameras: Sequence[Camera], uncertainties: Sequence[Uncertainty], record: dict[str, Any], findings: list[Finding]
) -> SelfCalibrated:
    record = record | {"used": False, "findings": as_records(findings)}
    return SelfCalibrated(tuple(cameras), tuple(uncertainties), None, False, record, tuple(findings))


def _refined(done: BodyFit, names: Sequence[str], record: dict[str, Any], finding: Finding) -> SelfCalibrated:
    uncertainties = tuple(
        Uncertainty(own, done.pivot, done.covariance[place, place])
        for own, place in zip(done.names, _places(done.names), strict=True)
    )
    joint = {"cameras": list(names), "names": [list(own) for own in done.names], "covariance": done.covariance}
    record = record | {"used": True, "findings": as_records([finding])}
    return SelfCalibrated(done.cameras, uncertainties, joint, True, record, (finding,))


def _gain(
    cameras: Sequence[Camera], uncertainties: Sequence[Uncertainty], joint: Array, done: BodyFit, sights: BodySights
) -> dict[str, Any]:
    """The calibration's part of sigma where the body was, before and after: rms over its axes, world units."""
    rows = np.linspace(0, sights.b.shape[1] - 1, min(SHOWN, sights.b.shape[1])).astype(int)
    b, sd = sights.b[:, rows], sights.sd[:, rows]
    refined = [
        Uncertainty(own, done.pivot, done.covariance[place, place])
        for own, place in zip(done.names, _places(done.names), strict=True)
    ]
    found = []
    for rig, known, C in ((cameras, uncertainties, joint), (done.cameras, refined, done.covariance)):
        noise = locate_points(rig, b, sd=sd).sigma
        whole = locate_points(rig, b, sd=sd, uncertainties=known, joint=C).sigma
        found.append(float(np.sqrt(np.nanmean(np.clip(whole**2 - noise**2, 0, None)))))
    return {"sigma_of_calibration": {"before": found[0], "after": found[1]}}


def _shape_record(shape: ShapeTest) -> dict[str, Any]:
    return {
        "chi2": shape.chi2,
        "freedom": shape.freedom,
        "distances": {
            pair: {"stated": stated, "seen": seen, "sd": sd} for pair, (stated, seen, sd) in shape.distances.items()
        },
    }


def _wrong(shape: ShapeTest, body: Body, name: str, units: str, where: str) -> Finding:
    """Which number of the body is not what the cameras see."""
    pair, (stated, seen, sd) = max(shape.distances.items(), key=lambda each: abs(each[1][1] - each[1][0]) / each[1][2])
    said = " or ".join(_said(reason.what, reason.off, units) for reason in shape.reasons[:4])
    text = (
        f"{where}: body {name} is not what the cameras see: {pair} is {seen:.5g} +- {sd:.2g} {units}, by its "
        f"coordinates {stated:.5g}. Explained by {said} ({shape.reasons[0].deviate:.0f} standard deviations). "
        "The cameras stay as they were"
    )
    cure = "Measure the targets on the body again, correct bodies in config.yaml, or give calibration.self.sigma."
    return Finding("doubtful", "body-distances-wrong", text, cure)


def _not_rigid(free: BodyFit, body: Body, name: str, where: str) -> Finding:
    """Which target moves most against the others."""
    spread = np.sqrt(np.nanmean(free.residuals**2, (0, 1, 3)))
    k = int(spread.argmax())
    text = (
        f"{where}: body {name} is not rigid: its sights miss any rigid body by {free.factor:.1f} times their noise, "
        f"those of {body.targets[k]} most ({spread[k]:.2g} px). The cameras stay as they were"
    )
    cure = "Attach the targets firmly to the body; check the cameras' clocks, and that no two names are exchanged."
    return Finding("doubtful", "body-not-rigid", text, cure)


def _said(what: str, off: float, units: str) -> str:
    if what == "scale":
        return f"all lengths of it {100 * abs(off):.2g} % too {'small' if off > 0 else 'large'}"
    if what[-2:] in (" x", " y", " z"):
        return f"{what[:-2]}'s {what[-1]}, wrong by {-off:+.3g} {units}"
    return f"the place of {what}, wrong by {off:.3g} {units}"


def _no_help(judged: Judged, body: str, units: str, where: str) -> Finding:
    text = (
        f"{where}: {body} does not make the cameras better: in stretches of time that they have not seen "
        f"{_held_out(judged, units)}. They stay as they were"
    )
    return Finding("note", "self-calibration-no-help", text, "")


def _helped(record: Mapping[str, Any], judged: Judged, body: str, units: str, where: str) -> Finding:
    sigma = record["sigma_of_calibration"]
    text = (
        f"{where}: {body} refined the cameras: in stretches of time that they have not seen "
        f"{_held_out(judged, units)}; the calibration's part of sigma goes from {sigma['before']:.2g} to "
        f"{sigma['after']:.2g} {units}"
    )
    return Finding("note", "self-calibration-used", text, "")


def _held_out(judged: Judged, units: str) -> str:
    return (
        f"residuals go from {judged.px[0]:.4f} to {judged.px[1]:.4f} px and the body's distances are off by (rms) "
        f"{judged.distance[0]:.3g} before and {judged.distance[1]:.3g} {units} after"
    )
