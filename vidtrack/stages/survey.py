"""Stage survey: what all cameras together say of the surveyed points, before any camera is calibrated by them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.assessment.accuracy import AXES
from vidtrack.calibration.camera.outliers import Mask, Mixup, mixups
from vidtrack.calibration.centroid_noise import centroid_sd
from vidtrack.calibration.refraction.interfaces import interfaces_from_settings
from vidtrack.calibration.surveys.judging_camera import View
from vidtrack.calibration.surveys.shared_points import SharedPoints, side_by_side
from vidtrack.calibration.surveys.survey import Placed, placed
from vidtrack.calibration.surveys.survey_mistakes import Survey, survey_findings
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import derivatives

MOST_SAID = 6
"""Findings of single sights of one camera that are shown."""

MOST_OF_CLIP = 0.75
"""Share of a clip's points that must lie elsewhere for the clip to do."""

ALONE_PX, ALONE = 1.0, 8.0
"""px rms by which one camera sees a clip elsewhere, and times farther than any other, for the camera to have moved: a
frame that was surveyed wrongly both cameras see off, but for one that looks along the way it was moved."""

BESIDE_PX, BESIDE_SHARE = 1.5, 0.05
"""px within which a sight is of the right ball, which something touches, hides or lights; and of a camera's sights the
share, or one, that may be: they are left out, and nothing is wrong with the others."""


class JudgedSurvey(NamedTuple):
    """What the stage gives.

    left_out   by camera: {(clip, tag): why}, the sights that no calibration of that camera should use
    record     what survey.json holds
    """

    left_out: dict[str, dict[tuple[str, str], str]]
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def judge_survey(
    sightings: Mapping[str, pd.DataFrame],
    sizes: Mapping[str, tuple[int, int]],
    *,
    sigma: float = 0.0,
    units: str = "",
    reject: str = "auto",
    through: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
) -> JudgedSurvey:
    """Judge the survey by all cameras together (see `calibration.survey`).

    sightings  by camera: tag, x, y, z (units), Xf, Yf (px); where known clip, sigma, sd_x, sd_y, frames, found
    sizes      by camera: px, (width, height) of the picture
    sigma      units, survey tolerance of points that have none of their own
    reject     off: nothing is left out
    through    by camera: the interfaces through which it sees, as for `calibrate`
    Fewer than two cameras with 12 points each, or lists that contradict each other, are not judged: each camera's own
    calibration says what is wrong then.
    """
    tables = {name: _found(table) for name, table in sightings.items()}
    try:
        shared = side_by_side(list(tables.values()), sigma=sigma)
    except ValueError:
        return _nothing()
    known = np.isfinite(shared.p).all(-1)
    if reject == "off" or not known.all() or not len(shared.p):
        return _nothing()
    media = {name: interfaces_from_settings(f"cameras.{name}", own, units) for name, own in (through or {}).items()}
    views = [
        View(shared.b_used[i], sizes[name], _sd(table, shared, i), media.get(name, ()))
        for i, (name, table) in enumerate(tables.items())
    ]
    groups = _clips(shared)
    found = placed(shared.p, shared.sigma, views, [mask for _, mask in groups])
    if found is None:
        return _nothing()
    names, tags = list(tables), [key[1] for key in shared.keys]
    about = _once(found, shared)
    said = np.zeros(found.mistaken.shape, bool)
    moved = _moved_alone(names, shared, found, groups)
    for i, mask, _ in moved:
        about = about._replace(misplaced=about.misplaced & ~mask)
        said[i] |= mask
    findings = [finding for *_, finding in moved]
    findings += [
        finding._replace(text=f"calibration: {finding.text}")
        for finding in survey_findings(Survey(tags, shared.p, about, units), groups)
    ]
    findings += _mistaken(names, tags, shared, found._replace(mistaken=found.mistaken & ~said), units)
    left_out = {name: _reasons(shared, found, i, units) for i, name in enumerate(names)}
    return JudgedSurvey(left_out, _record(names, shared, found, left_out, units, findings), tuple(findings))


def _nothing() -> JudgedSurvey:
    return JudgedSurvey({}, {"judged": False, "left_out": {}, "findings": []}, ())


def _found(table: pd.DataFrame) -> pd.DataFrame:
    used = table["found"].fillna(False).to_numpy(bool) if "found" in table else np.ones(len(table), bool)
    return table.assign(tag=table["tag"].astype(str), used=used).reset_index(drop=True)


def _sd(table: pd.DataFrame, shared: SharedPoints, i: int) -> Array | None:
    own = centroid_sd(table, np.arange(len(table)))
    if own is None:
        return None
    listed = shared.row[i] >= 0
    sd = np.full((len(shared.p), 2), float(np.nanmedian(own)))
    sd[listed] = own[shared.row[i, listed]]
    return sd


def _clips(shared: SharedPoints) -> list[tuple[str, Mask]]:
    """The points of each clip, where there are several and none shows most of the points."""
    clips = np.array([key[0] for key in shared.keys])
    sets = [(f"clip {clip}", clips == clip) for clip in dict.fromkeys(clips.tolist())]
    return [(name, mask) for name, mask in sets if len(sets) > 1 and 3 <= mask.sum() <= len(clips) / 2]


def _once(found: Placed, shared: SharedPoints) -> Placed:
    """Each misplaced tag once, though several clips show it."""
    seen: set[str] = set()
    first = np.zeros(len(shared.keys), bool)
    for j in np.flatnonzero(found.misplaced | found.unclear).tolist():
        first[j] = shared.keys[j][1] not in seen
        seen.add(shared.keys[j][1])
    return found._replace(misplaced=found.misplaced & first, unclear=found.unclear & first)


def _moved_alone(
    names: list[str], shared: SharedPoints, found: Placed, groups: Sequence[tuple[str, Mask]]
) -> list[tuple[int, Mask, Finding]]:
    """Clips that lie elsewhere by one camera alone, and which camera: the others see their points as surveyed.

    Two cameras agree on another place for each point whichever of them was moved; but a point that was surveyed wrongly
    both of them see elsewhere. Names that are shifted by one lie a ball's distance off.
    """
    moved = []
    for name, mask in groups:
        off = {
            i: shared.b_used[i, mask] - project(camera, shared.p[mask])
            for i, camera in enumerate(found.cameras)
            if camera is not None and np.isfinite(shared.b_used[i, mask, 0]).any()
        }
        px = {i: float(np.sqrt(np.nanmean((own**2).sum(-1)))) for i, own in off.items()}
        if len(px) < 2 or not (found.misplaced | found.mistaken.any(0))[mask].mean() >= MOST_OF_CLIP:
            continue
        alone = max(px, key=lambda one: px[one])
        rest = max(value for i, value in px.items() if i != alone)
        apart = _neighbours(shared.b_used[alone, mask])
        if not max(ALONE_PX, ALONE * rest) < px[alone] < apart / 2:
            continue
        camera = names[alone]
        dx, dy = np.nanmedian(off[alone], axis=0)
        text = (
            f"calibration: {camera} alone sees the points of {name} elsewhere, ({dx:+.2g}, {dy:+.2g}) px from where "
            f"the survey and its other clips have them; the other cameras see them there to {rest:.2g} px. "
            "These points were not used."
        )
        cure = (
            f"{camera} was moved or zoomed between its clips, or one of them is of another day: record its clips "
            "again, all as it stands in the run, or leave out the one that differs."
        )
        moved.append((alone, mask, Finding("doubtful", "clip-of-another-view", text, cure)))
    return moved


def _neighbours(b: Array) -> float:
    """The usual distance, px, between neighbours of b (n, 2)."""
    known = b[np.isfinite(b[:, 0])]
    apart = np.linalg.norm(known[:, None] - known[None], axis=-1)
    np.fill_diagonal(apart, np.inf)
    return float(np.median(apart.min(1))) if len(known) > 1 else 0.0


def _mistaken(names: list[str], tags: list[str], shared: SharedPoints, found: Placed, units: str) -> list[Finding]:
    """Sights of single cameras that disagree with the survey and the other cameras."""
    findings = []
    for i, camera in enumerate(found.cameras):
        rows = np.flatnonzero(found.mistaken[i]).tolist()
        if camera is None or not rows:
            continue
        places = project(camera, shared.p)
        mixed = {m.point: m for m in mixups(places, shared.b[i], found.mistaken[i], 5.0)}
        own: list[Finding] = []
        for j in rows:
            if (mix := mixed.get(j)) and mix.mutual and mix.place < j and mix.place in rows:
                continue
            own.append(_mistaken_finding(names[i], tags, j, shared, places, camera, mixed.get(j), units, i))
        off = np.hypot(*(shared.b[i, rows] - places[rows]).T)
        most = max(1.0, BESIDE_SHARE * np.isfinite(shared.b[i, :, 0]).sum())
        beside = len(rows) <= most and off.max() < BESIDE_PX and not mixed
        findings += [_beside(finding) for finding in own] if beside else _few(own, names[i])
    return findings


def _beside(finding: Finding) -> Finding:
    """Of a sight that is hardly off, and of the right ball."""
    cure = "See in the calibration picture what touches, hides or lights it there; the others are not concerned."
    return finding._replace(level="note", cure=cure)


def _few(own: list[Finding], camera: str) -> list[Finding]:
    """One camera's findings; of very many the first, and in one more that the names as a whole may be wrong there."""
    if len(own) <= MOST_SAID:
        return own
    text = (
        f"{camera}: {len(own) - MOST_SAID + 1} more tags lie elsewhere in this camera alone: all of its names may be "
        "shifted by one, of another layout, or those of another camera"
    )
    cure = f"Look at the names in {camera}'s calibration picture, and correct its picks or its clip's tags."
    return [*own[: MOST_SAID - 1], Finding("bad", "sights-mistaken", text, cure)]


def _mistaken_finding(
    name: str,
    tags: list[str],
    j: int,
    shared: SharedPoints,
    places: Array,
    camera: Camera,
    mix: Mixup | None,
    units: str,
    i: int,
) -> Finding:
    off = shared.b[i, j] - places[j]
    B = derivatives(camera, shared.p[j], shared.p[j]).by_point
    across = float(np.linalg.norm(np.linalg.pinv(B) @ off))
    size = f"{np.hypot(*off):.3g} px ({across:.2g} {units} at its distance)"
    if mix and mix.mutual:
        text = (
            f"{name}: tags {tags[mix.point]} and {tags[mix.place]} are swapped in this camera: each lies where the "
            f"other should be, {size} away; the other cameras have them right. Both are left out here."
        )
        return Finding("doubtful", "tags-swapped", text, "Exchange them in this camera's rows of picks.csv.")
    text = (
        f"{name}: tag {tags[j]} lies {size} from where the survey and the other cameras put it, at Xf {off[0]:+.3g}, "
        f"Yf {off[1]:+.3g} px"
    )
    if mix:
        text += f", where tag {tags[mix.place]} should be"
    text += ". It is left out in this camera."
    return Finding("doubtful", "sight-mistaken", text, f"Correct its pick for {name} in picks.csv, or add one.")


def _reasons(shared: SharedPoints, found: Placed, i: int, units: str) -> dict[tuple[str, str], str]:
    reasons = {}
    for j in np.flatnonzero(shared.row[i] >= 0).tolist():
        distance = float(np.linalg.norm(found.place[j] - shared.p[j]))
        if found.misplaced[j]:
            reasons[shared.keys[j]] = f"misplaced in the survey by {distance:.3g} {units}".strip()
        elif found.unclear[j]:
            reasons[shared.keys[j]] = "the cameras agree on no place for it"
        elif found.mistaken[i, j]:
            reasons[shared.keys[j]] = "disagrees with the survey and the other cameras"
    return reasons


def _record(
    names: list[str],
    shared: SharedPoints,
    found: Placed,
    left_out: Mapping[str, Mapping[tuple[str, str], str]],
    units: str,
    findings: list[Finding],
) -> dict[str, Any]:
    points = [
        {
            "clip": shared.keys[j][0],
            "tag": shared.keys[j][1],
            **{axis: float(shared.p[j, k]) for k, axis in enumerate(AXES)},
            **{f"{axis}_by_cameras": float(found.place[j, k]) for k, axis in enumerate(AXES)},
            **{f"sd_{axis}": float(found.sd[j, k]) for k, axis in enumerate(AXES)},
        }
        for j in np.flatnonzero(found.misplaced).tolist()
    ]
    return {
        "judged": True,
        "units": units,
        "cameras": [name for name, voted in zip(names, found.used, strict=True) if voted],
        "survey_sigma": found.spread,
        "misplaced": points,
        "left_out": {
            name: [{"clip": clip, "tag": tag, "reason": why} for (clip, tag), why in own.items()]
            for name, own in left_out.items()
        },
        "findings": as_records(findings),
    }
