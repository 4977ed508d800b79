"""Stage verdict: whether each calibration and each run can be used, with reasons, worst first, and what to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.findings import Finding
from vidtrack.labelling.naming_doubts import AT_EDGE, MERGED, OUTSIDE
from vidtrack.naming import some_of
from vidtrack.results import CameraResults, Results, RunResults
from vidtrack.verdict.calibration_rules import (
    Fit,
    camera_findings,
    square_findings,
    stretch_findings,
    unfound_findings,
    whole_findings,
)
from vidtrack.verdict.collected import collected, placed
from vidtrack.verdict.copied_clips import Shown, copied_findings
from vidtrack.verdict.judgement import Judgement, added, inherited, judged, worst_word
from vidtrack.verdict.picture_rules import with_background
from vidtrack.verdict.run_rules import (
    Track,
    comparison_findings,
    location_findings,
    motion_findings,
    picture_findings,
    target_findings,
    time_findings,
)
from vidtrack.verdict.size_rules import size_findings

Record = Mapping[str, Any]

CALIBRATING = (
    "calibration_points",
    "survey",
    "calibrate",
    "bundle",
    "bundle_after",
    "back_project",
    "overlay",
    "stability",
    "track_wand",
    "wand",
    "self_calibrate",
    "board_corners",
    "boards",
    "board_sightings",
    "import_points",
    "import_camera",
)
"""Rules whose failure is the calibration's; that of any other is a run's."""

OF_A_CAMERA = {"board_corners", "board_sightings", "import_camera"}
"""Those whose only part is a camera."""

LENS_DOUBTS = {"lens-model-too-plain", "misfit-large"}
"""Findings of a calibration by which nothing is known of single points."""


class CalibrationVerdict(NamedTuple):
    """Of the calibration, the same for all runs that use it: a judgement of each camera, findings of all together."""

    cameras: Mapping[str, Judgement]
    whole: Sequence[Finding]


def calibration_verdict(results: Results) -> CalibrationVerdict:
    """What is to be said of the calibration; nothing of a run is looked at."""
    cameras = {
        name: judged([*_of_camera(name, own), *_failures(results, name)]) for name, own in results.cameras.items()
    }
    cameras |= {name: judged(_failures(results, name)) for name in sorted(_failed_cameras(results) - set(cameras))}
    return CalibrationVerdict(cameras, _of_whole(results))


def verdict(
    results: Results,
    runs: Mapping[str, Mapping[str, Any]],
    awaited: Sequence[str] = (),
    of_calibration: CalibrationVerdict | None = None,
) -> dict[str, Any]:
    """The record verdict.json.

    runs     what the config asks for, by run: {mode, cameras, targets: how many or their names[, without: why cameras
             have no part, by camera][, same_balls: whether targets may be balls of the calibration's size]}
    awaited  runs that the config names and that are not recorded
    of_calibration   `calibration_verdict` of the same results, where it is known
    Keys: verdict (the worst of all), calibration ({verdict, reasons, notes, cameras: {camera: the same}}, None where
    nothing was calibrated), runs ({run: {verdict, reasons, notes}}), and awaited where there are such runs, outdated
    (places under results/) where failed jobs left results of an earlier call. A reason is a finding: level, code, text,
    cure. A run inherits the doubts about the calibration that it uses.
    """
    cameras, whole = of_calibration or calibration_verdict(results)
    judgements = {name: judged(_of_run(name, results, asked, cameras, whole)) for name, asked in runs.items()}
    calibration = None
    if cameras or whole:
        together = judged([*whole, *(f for own in cameras.values() for f in (*own.reasons, *own.notes))])
        calibration = together.as_record() | {"cameras": {name: own.as_record() for name, own in cameras.items()}}
    words = [own.verdict for own in judgements.values()] + ([calibration["verdict"]] if calibration else [])
    record: dict[str, Any] = {
        "verdict": worst_word(words),
        "calibration": calibration,
        "runs": {name: own.as_record() for name, own in judgements.items()},
    }
    record |= {"awaited": list(awaited)} if awaited else {}
    return record | ({"outdated": places} if (places := _outdated(results)) else {})


def _outdated(results: Results, run: str | None = None) -> list[str]:
    """The results, by their places under results/, that are of an earlier call; those of a run where one is named."""
    places = [str(place) for failure in results.failures for place in failure.get("outdated", ())]
    return [place for place in places if run is None or place.startswith(f"runs/{run}/")]


def _of_camera(name: str, own: CameraResults) -> list[Finding]:
    found = collected(own.labelling, name) + collected(own.record, name)
    if own.record is None or "rms_px" not in own.record:
        return found
    return added(found, camera_findings(name, own.record, _fit(own.points, own.record), own.labelling or {}))


def _of_whole(results: Results) -> list[Finding]:
    """What was found of all cameras together, and of the calibration after the test."""
    found = (
        copied_findings(_shown(results))
        + collected(results.survey)
        + collected(results.wand)
        + collected(results.by_body)
        + added(collected(results.back, "calibration"), whole_findings(results.back or {}))
    )
    doubts = {finding.code for name, own in results.cameras.items() for finding in collected(own.record, name)}
    if not doubts & LENS_DOUBTS:  # else the lens, not the survey, puts points elsewhere
        found += square_findings({name: own.record or {} for name, own in results.cameras.items()})
        found += stretch_findings(results.back or {})
        seen = {name: _seen(own.points) for name, own in results.cameras.items()}
        found += unfound_findings(seen, _of_clips(results))
    found += [placed(finding, "after the test") for finding in collected(results.survey_after)]
    for name, own in results.after.items():
        found += [
            placed(finding, "after the test")
            for finding in collected(own.labelling, name) + collected(own.record, name)
        ]
    return found + collected(results.stability) + _failures(results, None)


def _seen(points: pd.DataFrame | None) -> dict[str, bool]:
    """Whether each listed tag was found in any clip of a camera; without those that it cannot see or separate."""
    if points is None or "found" not in points:
        return {}
    able = points if "reason" not in points else points[~points["reason"].isin((OUTSIDE, MERGED, AT_EDGE))]
    return {str(tag): bool(found) for tag, found in able.groupby("tag", sort=False)["found"].any().items()}


def _shown(results: Results) -> dict[tuple[str, str], Shown]:
    """What each camera shows in each clip."""
    out = {}
    for name, own in results.cameras.items():
        if own.points is None or not {"clip", "found", "Xf", "Yf"} <= set(own.points):
            continue
        for clip, said in ((own.labelling or {}).get("clips") or {}).items():
            there = own.points[(own.points["clip"] == clip) & own.points["found"]]
            picture = ((own.labelling or {}).get("pictures") or {}).get(clip) or {}
            blobs = np.asarray(said.get("blobs_of_no_tag") or np.zeros((0, 2)), float)
            if width := picture.get("width"):
                out[name, clip] = Shown(there[["Xf", "Yf"]].to_numpy(float), blobs, float(width))
    return out


def _of_clips(results: Results) -> dict[str, set[str]]:
    """The tags of each clip, as the cameras' tables have them."""
    clips: dict[str, set[str]] = {}
    for own in results.cameras.values():
        if own.points is not None and {"clip", "tag"} <= set(own.points):
            for clip, tags in own.points.groupby("clip", sort=False)["tag"]:
                clips.setdefault(str(clip), set()).update(map(str, tags))
    return clips


def _failures(results: Results, camera: str | None) -> list[Finding]:
    """Why jobs of a camera's calibration failed; of all cameras together where `camera` is None."""
    return [
        finding
        for failure in results.failures
        if failure["rule"] in CALIBRATING and _camera_of(failure) == camera
        for finding in collected(failure, camera or "")
    ]


def _failed_cameras(results: Results) -> set[str]:
    here = {_camera_of(failure) for failure in results.failures if failure["rule"] in CALIBRATING}
    return {camera for camera in here if camera is not None}


def _camera_of(failure: Mapping[str, Any]) -> str | None:
    """The camera whose calibration a job was of; None for a job of all of them."""
    parts = failure["parts"]
    return str(parts[-1]) if len(parts) > 1 or failure["rule"] in OF_A_CAMERA else None


def _of_run(
    name: str, results: Results, asked: Mapping[str, Any], cameras: Mapping[str, Judgement], whole: Sequence[Finding]
) -> list[Finding]:
    own = results.runs.get(name, RunResults())
    found = [finding for camera, reading in own.readings.items() for finding in collected(reading, camera)]
    for record in own.records.values():
        found += collected(record)
    found = with_background(found, own.record("steadiness"), f"runs.{name}")
    for failure in results.failures:
        if failure["rule"] not in CALIBRATING and failure["parts"][:1] == [name]:
            found += [_weighed(finding, failure, asked) for finding in collected(failure)]
    found += [_left_out(name, camera, why) for camera, why in asked.get("without", {}).items()]
    if places := _outdated(results, name):
        found.append(_of_earlier_call(name, places))
    locate = own.record("locate")
    ruled = [finding for camera, reading in own.readings.items() for finding in picture_findings(camera, reading)]
    if ("waterline" if asked["mode"] == "waterline" else "trajectories") not in own.tables | own.records:
        failed = any(finding.level == "failed" for finding in found)
        return found if failed else [*found, _not_made(asked["cameras"], cameras)]
    if asked["mode"] != "waterline":
        ruled += target_findings(_tracks(own.tables.get("trajectories")), asked.get("targets"))
    held_out = ((results.back or {}).get("held_out") or {}).get("mean_3d")
    ruled += time_findings(own.readings, locate) + location_findings(locate, held_out)
    ruled += size_findings(locate, own.record("steadiness"), same_balls=asked.get("same_balls", True))
    ruled += motion_findings(own.record("kinematics")) + comparison_findings(own.record("comparison"))
    found = added(found, ruled)
    if asked["mode"] != "plane":
        used = [cameras[c] for c in asked["cameras"] if c in cameras]
        found += inherited("the calibration", judged([*whole, *(f for camera in used for f in camera.reasons)]))
    return found


def _weighed(finding: Finding, failure: Mapping[str, Any], asked: Mapping[str, Any]) -> Finding:
    """Why a job of a run failed: what other programs read, and a recording that is left out, cost less than the run."""
    if failure["rule"].split("_")[0] == "export":
        return finding._replace(level="note")
    return finding._replace(level="doubtful") if set(failure["parts"][1:]) & set(asked.get("without", ())) else finding


def _left_out(run: str, camera: str, why: str) -> Finding:
    text = f"the positions are without {camera}: {why}"
    cure = f"Look under {camera} or in the log. Correct the cause and run again, or remove {camera} from {run}."
    return Finding("doubtful", "camera-left-out", text, cure)


def _of_earlier_call(run: str, places: Sequence[str]) -> Finding:
    own = [place.removeprefix(f"runs/{run}/") for place in places]
    tables = [place for place in own if place.startswith("trajectories")]
    text = f"{some_of([*tables, *(p for p in own if p not in tables)], 5)} in results/runs/{run} are of an earlier call"
    return Finding("bad", "results-outdated", text, "Do not use them: correct what failed, and run again.")


def _not_made(used: Sequence[str], cameras: Mapping[str, Judgement]) -> Finding:
    """Why a run has no results although none of its own jobs failed."""
    failed = [name for name in used if name in cameras and cameras[name].verdict == "failed"]
    if failed:
        text = f"nothing was located, because the calibration of {' and '.join(failed)} failed"
        return Finding("failed", "calibration-failed", text, cameras[failed[0]].reasons[0].cure)
    return Finding("failed", "not-made", "nothing was located", "See what failed before it, and run again.")


def _fit(points: pd.DataFrame | None, record: Record) -> Fit:
    """How the points fit, and the residuals over what centroid noise and survey tolerance allow."""
    if points is None or "used" not in points:
        return Fit(0, 0, np.nan)
    found = points[points["Xf"].notna()]
    used = found[found["used"].astype(bool)]
    fit = Fit(len(found), len(used), np.nan)
    needed = {"residual_x", "residual_y", "sigma", "x", "y", "z"}
    if not needed <= set(points) or len(used) < 8:
        return fit
    tolerance = used["sigma"].fillna((record.get("settings") or {}).get("sigma") or 0.0).to_numpy(float)
    if not (tolerance > 0).all():
        return fit
    p = used[["x", "y", "z"]].to_numpy(float)
    depth = p @ np.asarray(record["R"], float)[2] + record["T"][2]
    per_unit = record["f"] / record["dy"] / depth  # px that a unit of length spans, square on
    sd = used[["sd_x", "sd_y"]].fillna(0).to_numpy(float) if {"sd_x", "sd_y"} <= set(used) else np.zeros((len(used), 2))
    expected = sd**2 + (tolerance * per_unit)[:, None] ** 2
    residual = used[["residual_x", "residual_y"]].to_numpy(float)
    freedom = max(residual.size - len((record.get("uncertainty") or {}).get("names") or ()), 1)
    return fit._replace(misfit=float(np.sqrt((residual**2 / expected).sum() / freedom)), freedom=freedom)


def _tracks(trajectories: pd.DataFrame | None) -> dict[str, Track]:
    if trajectories is None or not len(trajectories):
        return {}
    tracks = {str(name): rows for name, rows in trajectories.groupby("target", sort=False)}
    # the corners of a coded tag are seen with it: what is said of the tag is said once
    return {name: _track(rows) for name, rows in tracks.items() if name.rpartition("_")[0] not in tracks}


def _track(rows: pd.DataFrame) -> Track:
    """How many samples, how many of them located, and the longest time (s) without a position, with its start."""
    rows = rows.sort_values("time_s")
    t, known = rows["time_s"].to_numpy(float), rows["x"].notna().to_numpy()
    if not known.any():
        return Track(len(t), 0, float(t[-1] - t[0]), float(t[0]))
    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    stops = np.concatenate([[t[0] - step], t[known], [t[-1] + step]])
    gaps = np.diff(stops) - step
    longest = int(gaps.argmax())
    gap = float(gaps[longest])
    return Track(len(t), int(known.sum()), gap if gap > step / 2 else 0.0, float(stops[longest] + step))
