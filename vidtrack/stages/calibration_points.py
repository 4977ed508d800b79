"""Stage calibration_points: one camera's clips of surveyed points become a table of where it saw each tag."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.calibration.camera import gates
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.labelling.configuration import label_with
from vidtrack.labelling.doubts import clip_flipped, clip_moved, coinciding, disagreeing, swinging, with_picked
from vidtrack.labelling.exchanged_clips import settled_or_exchanged
from vidtrack.labelling.flipped import flipped
from vidtrack.labelling.knock import moved, shifted
from vidtrack.labelling.label import GATE, Index, Labels, Picks, View, complete
from vidtrack.labelling.mixed_units import check_units
from vidtrack.labelling.naming_doubts import AT_EDGE, Case, missing_because
from vidtrack.labelling.outlined import with_outlines
from vidtrack.labelling.refusals import common_size, refuse_empty
from vidtrack.labelling.shot import Shot, composite, look_again, take, with_placed
from vidtrack.labelling.still import FrameLike
from vidtrack.labelling.touching import separated
from vidtrack.steadiness.clips import clip_findings, clip_movements, covers
from vidtrack.tracking.outlines.lighting import Lighting, lit_findings

PLACED = ["Xf", "Yf", "sd"]
NO_PICKS = pd.DataFrame({"clip": [], "tag": [], "Xf": [], "Yf": [], "sd": []})


class Sightings(NamedTuple):
    """What the stage gives.

    table    a row a clip and tag: clip, tag, x, y, z, sigma, Xf, Yf, pixels, width, frames, sd_x, sd_y, found,
             reason
    picture  (rows, columns) the balls of all clips in one picture
    means    clip: (rows, columns) its mean picture, grey levels
    record   how the names were found, clip by clip
    """

    table: pd.DataFrame
    picture: NDArray[np.uint8]
    means: dict[str, NDArray[np.float32]]
    record: dict[str, Any]
    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as lines."""
        return tuple(f"{finding.text} {finding.cure}".strip() for finding in self.findings)


def calibration_points(
    clips: Mapping[str, Iterable[FrameLike]],
    points: pd.DataFrame,
    picks: pd.DataFrame | None = None,
    *,
    camera: str = "",
    tags: Mapping[str, Sequence[str]] | None = None,
    detect: Mapping[str, Mapping[str, Any]] | None = None,
    bits: Mapping[str, int] | None = None,
    sigma: float = 0.0,
) -> Sightings:
    """Find every ball in every clip of one camera, and name it.

    clips    clip: its frames (anything with luma (rows, columns) and corrupt); all of one size
    points   tag, x, y, z (world units) and where known sigma
    picks    clip, tag, Xf, Yf (px): roughly where some tags are; None: the layout alone must suffice. Those with an
             sd (px) are no balls: a person placed them
    tags     clip: the tags it shows; default: all of them
    detect   clip: polarity, threshold, min_pixels, centroid, as `find_blobs` takes them, gain and offset
    bits     clip: significant bits of 16-bit luma
    sigma    world units, survey tolerance where points has none
    A position is the centroid on the mean of up to 64 frames, sd its standard deviation: the scatter of single
    frames' centroids over the root of their number, what their rims show at least; for a lone frame by its noise.
    A tag that a clip should show and does not keeps its row: Xf, Yf NaN, found False, and a reason.
    Raises VidtrackError, a line a problem: picks that cannot be right, clips without balls, names in doubt."""
    shown = _shown_tags(points, clips, tags)
    shots = {
        clip: _shot(clip, frames, (detect or {}).get(clip, {}), (bits or {}).get(clip), len(shown[clip]))
        for clip, frames in clips.items()
    }
    size = common_size(shots, camera)
    seeds = NO_PICKS if picks is None else picks.assign(sd=picks.get("sd", np.nan))
    placed = seeds[seeds["sd"].notna()]
    shots = {c: with_placed(s, placed.loc[placed["clip"] == c, PLACED].to_numpy(float)) for c, s in shots.items()}
    _check_picks(seeds, size, points, shown, camera)
    refuse_empty(shots, camera)
    _check_layout(points, shown, shots, camera)
    case = _case(camera, points, shown, shots, seeds, size)
    answers = label_with(case.points, case.views, case.picks, size)
    if not any(complete(answer, case.picks) for answer in answers):
        check_units(case)
    labels = settled_or_exchanged(case, answers)
    labels, findings = with_picked(case, labels)
    findings += [clip_moved(case, i, offset) for i, offset in moved(labels, case.points).items()]
    parts = []
    for i, (clip, shot) in enumerate(shots.items()):
        blob = _blobs_of(case, labels, i, findings)
        parts.append(_rows(clip, shot, points.iloc[case.views[i].points], blob, labels, i, sigma))
    rows, lit = _outlined(pd.concat(parts, ignore_index=True), shots)
    findings += lit_findings(lit) + coinciding(rows) + swinging(rows, camera) + disagreeing(rows, camera)
    record = _record(case, labels, shots, rows, findings) | ({"lighting": lit.as_record()} if lit else {})
    rows, means = rows.drop(columns="scatter"), {clip: shot.still.mean for clip, shot in shots.items()}
    return Sightings(rows, composite(shots.values()), means, record, tuple(findings))


def compared(found: Sightings, camera: str) -> dict[str, Any]:
    """Whether the camera stood still from clip to clip, and all findings, as the record has them."""
    seen = found.table[found.table["found"]]
    own = {clip: seen[seen["clip"] == clip] for clip in found.means}
    balls = {clip: covers(rows[["Xf", "Yf"]], rows["pixels"]) for clip, rows in own.items()}
    moved = clip_movements(found.means, balls)
    return {"steadiness": moved.as_record(), "findings": as_records([*found.findings, *clip_findings(camera, moved)])}


def picks_from_before(before: pd.DataFrame, tags: Mapping[str, Sequence[str]], file: str) -> pd.DataFrame | None:
    """Picks for clips from after the test: each tag where it was before it, in the first clip that shows it now.

    before   the sightings of the clips from before; tags  clip: those it shows; file  what messages name
    """
    was = before[before["found"]].drop_duplicates("tag")[["tag", "Xf", "Yf"]]
    parts = []
    for clip, shown in tags.items():
        here = was[was["tag"].isin(shown)]
        was = was.drop(here.index)
        if len(here):
            parts.append(here.assign(clip=clip, file=file))
    return pd.concat(parts, ignore_index=True) if parts else None


def no_sightings() -> pd.DataFrame:
    """The table of a camera of which nothing could be labelled: no rows."""
    kinds = {"clip": str, "tag": str, "pixels": int, "frames": int, "found": bool, "reason": str}
    names = ["clip", "tag", "x", "y", "z", "sigma", "Xf", "Yf", "pixels", "width", "frames", "sd_x", "sd_y"]
    names += ["found", "reason"]
    return pd.DataFrame({name: pd.Series(dtype=kinds.get(name, float)) for name in names})


def _shown_tags(
    points: pd.DataFrame, clips: Mapping[str, Any], tags: Mapping[str, Sequence[str]] | None
) -> dict[str, list[str]]:
    known = points["tag"].astype(str).tolist()
    shown = {clip: [str(t) for t in (tags or {}).get(clip) or known] for clip in clips}
    strange = [(clip, tag) for clip, wanted in shown.items() for tag in wanted if tag not in set(known)]
    if strange:
        raise VidtrackError(
            *(
                f"config.yaml: calibration.clips.{clip}.tags: no point {tag} in points.csv. Correct the tags, or "
                "survey the point."
                for clip, tag in strange
            )
        )
    return shown


def _shot(clip: str, frames: Iterable[FrameLike], detect: Mapping[str, Any], bits: int | None, balls: int) -> Shot:
    try:
        return take(frames, detect, bits, balls)
    except ValueError as error:
        raise VidtrackError(f"calibration/{clip}: {error}. Record the clip again or leave it out.") from None


FEW_BLOBS = 4  # in all clips together, from which a camera's view can be found at all


def _check_layout(points: pd.DataFrame, shown: Mapping[str, list[str]], shots: Mapping[str, Shot], camera: str) -> None:
    """Refuse points or blobs from which no view can be found, whatever the picks say."""
    listed = sorted({tag for tags in shown.values() for tag in tags})
    p = points.loc[points["tag"].astype(str).isin(listed), ["x", "y", "z"]].to_numpy(float)
    if len(p) >= FEW_BLOBS and (line := gates.straight(p)):
        raise VidtrackError(f"calibration/points.csv: {line}")
    counts = {clip: len(shot.at) for clip, shot in shots.items()}
    if sum(counts.values()) >= FEW_BLOBS or len(listed) < FEW_BLOBS:
        return
    seen = ", ".join(f"{n} blob{'s' * (n != 1)} for {len(shown[clip])} tags in {clip}" for clip, n in counts.items())
    raise VidtrackError(
        f"calibration: camera {camera} shows only {seen}: too few to find its view. Is the picture too dark or out of "
        "focus, or the threshold too high? Lower detect.threshold or light the balls; for a clip of single balls, list "
        "its tags under calibration.clips and add clips that show the others."
    )


def _check_picks(
    picks: pd.DataFrame,
    size: tuple[int, int],
    points: pd.DataFrame,
    shown: Mapping[str, list[str]],
    camera: str,
) -> None:
    """Refuse picks that cannot be right whatever the pictures show."""
    known = set(points["tag"].astype(str))
    problems = []
    for _, pick in picks.iterrows():
        clip, tag, where = pick["clip"], str(pick["tag"]), _place(pick)
        if clip not in shown:
            problems.append(f"{where}: camera {camera} has no clip {clip}. Add the clip or delete the pick.")
        elif tag not in known:
            problems.append(f"{where}: no tag {tag} in points.csv. Correct the tag or survey the point.")
        elif tag not in shown[clip]:
            problems.append(
                f"{where}: clip {clip} does not show tag {tag}. Correct the tag, or calibration.clips.{clip}.tags."
            )
        elif not (0 <= pick["Xf"] < size[0] and 0 <= pick["Yf"] < size[1]):
            problems.append(
                f"{where}: tag {tag} of camera {camera} at ({pick['Xf']:g}, {pick['Yf']:g}) is outside the picture of "
                f"{size[0]} x {size[1]} px. Correct Xf and Yf."
            )
    if problems:
        raise VidtrackError(*problems)


def _place(pick: pd.Series) -> str:
    file = pick["file"] if "file" in pick else f"calibration/{pick['clip']}/picks.csv"
    return f"{file}, line {int(pick['line'])}" if "line" in pick else str(file)


def _case(
    camera: str,
    points: pd.DataFrame,
    shown: Mapping[str, list[str]],
    shots: Mapping[str, Shot],
    picks: pd.DataFrame,
    size: tuple[int, int],
) -> Case:
    tags, clips = points["tag"].astype(str).tolist(), list(shots)
    row_of = {tag: i for i, tag in enumerate(tags)}
    views = [
        View(
            np.array(sorted({row_of[tag] for tag in shown[clip]}), np.intp),
            shot.at,
            np.stack([shot.blobs.width, shot.blobs.height], -1) / 2,
        )
        for clip, shot in shots.items()
    ]
    seeds = Picks(
        np.array([clips.index(clip) for clip in picks["clip"]], np.intp),
        np.array([row_of[str(tag)] for tag in picks["tag"]], np.intp),
        picks[["Xf", "Yf"]].to_numpy(float).reshape(-1, 2),
    )
    where = [_place(pick) for _, pick in picks.iterrows()]
    return Case(camera, clips, tags, points[["x", "y", "z"]].to_numpy(float), views, seeds, where, size)


def _blobs_of(case: Case, labels: Labels, i: int, findings: list[Finding]) -> Index:
    """The blob of each tag of clip i; warns where the clip lies elsewhere as a whole, or its picture is flipped."""
    shift = shifted(labels, i)
    if shift is None:
        if way := flipped(labels, i, case.image_size):
            findings.append(clip_flipped(case, i, way))
        return labels.blob[i]
    findings.append(clip_moved(case, i, shift.offset))
    return shift.blob


def _rows(clip: str, shot: Shot, own: pd.DataFrame, blob: Index, labels: Labels, i: int, sigma: float) -> pd.DataFrame:
    """The table of one clip."""
    has = (blob >= 0) & ~shot.blobs.edge[blob]
    table = own[["tag", "x", "y", "z"]].astype({"tag": str}).reset_index(drop=True)
    table.insert(0, "clip", clip)
    known = own["sigma"] if "sigma" in own else pd.Series(np.nan, own.index)
    table["sigma"] = known.fillna(sigma).to_numpy(float)
    for name, column in (("Xf", shot.at[:, 0]), ("Yf", shot.at[:, 1])):
        table[name] = np.where(has, column[blob], np.nan)
    table["pixels"] = np.where(has, shot.blobs.pixels[blob], 0)
    table["width"] = np.where(has, shot.widths()[blob], np.nan)
    table["frames"] = shot.still.frames
    for name, column in (("sd_x", shot.sd[:, 0]), ("sd_y", shot.sd[:, 1]), ("scatter", shot.swing)):
        table[name] = np.where(has, column[blob], np.nan)
    apart = separated(shot, labels, i)
    table.loc[apart.row, ["Xf", "Yf"]] = apart.at
    table.loc[apart.row, ["sd_x", "sd_y"]] = apart.sd
    table.loc[apart.row, "pixels"] = apart.pixels
    table.loc[apart.row, "width"] = np.nan
    has[apart.row] = True
    table["found"] = has
    table["reason"] = ""
    for k in np.flatnonzero(~has):
        if blob[k] >= 0:
            table.loc[k, "reason"] = AT_EDGE
        elif not _found_after_all(table, int(k), shot, labels, i):
            table.loc[k, "reason"] = missing_because(labels, i, int(k))
    return table


def _outlined(rows: pd.DataFrame, shots: Mapping[str, Shot]) -> tuple[pd.DataFrame, Lighting | None]:
    """The rows, with balls that are lit from one side where their outlines are; and how, if they are."""
    at, sd, pixels = (rows[names].to_numpy(float) for names in (["Xf", "Yf"], ["sd_x", "sd_y"], "pixels"))
    at, sd, width, lit = with_outlines(shots, rows["clip"].tolist(), at, sd, pixels)
    (x, y), (sd_x, sd_y) = at.T, sd.T
    return rows.assign(Xf=x, Yf=y, sd_x=sd_x, sd_y=sd_y, width=rows["width"] if width is None else width), lit


def _found_after_all(table: pd.DataFrame, k: int, shot: Shot, labels: Labels, i: int) -> bool:
    """Look where it must be for a ball too dim for the whole picture's threshold; fills row k if it is there."""
    at = labels.projected[i]
    if labels.merged[i][k] or not np.isfinite(at[k]).all():
        return False
    others = np.linalg.norm(np.delete(at, k, 0) - at[k], axis=-1)
    again = look_again(shot, at[k], float(np.clip(0.5 * np.nanmin(others, initial=60.0), 6, 30)))
    if again is None:
        return False
    d = np.linalg.norm(again.at - at[k], axis=-1)
    j = int(d.argmin())
    taken = np.linalg.norm(shot.at - again.at[j], axis=-1).min(initial=np.inf)
    if d[j] > GATE * labels.sd or taken < 2:
        return False
    table.loc[k, ["Xf", "Yf", "sd_x", "sd_y"]] = [*again.at[j], *again.sd[j]]
    table.loc[k, "pixels"] = int(again.blobs.pixels[j])
    table.loc[k, "found"] = True
    return True


def _record(
    case: Case, labels: Labels, shots: Mapping[str, Shot], rows: pd.DataFrame, findings: list[Finding]
) -> dict[str, Any]:
    clips = {}
    for i, (clip, shot) in enumerate(shots.items()):
        own = rows[rows["clip"] == clip]
        spare = np.setdiff1d(np.arange(len(shot.at)), labels.blob[i])
        lost = own[~own["found"]]
        clips[clip] = {
            "frames_seen": shot.seen,
            "frames_averaged": shot.still.frames,
            "frames_damaged": shot.damaged,
            "share_left_out": shot.still.left_out,
            "noise_grey_levels": float(np.median(shot.still.sd)),
            "detect": shot.settings,
            "stretch": dict(zip(("gain", "offset"), shot.stretch, strict=True)),
            "tags": len(own),
            "found": int(own["found"].sum()),
            "blobs": len(shot.at),
            "blobs_of_no_tag": np.round(shot.at[spare], 1).tolist(),
            "missing": dict(zip(lost["tag"], lost["reason"], strict=True)),
        }
    return {
        "camera": case.camera,
        "picks": len(case.picks.point),
        "points": len(rows),
        "found": int(rows["found"].sum()),
        "scatter_px": labels.sd,
        "clips": clips,
        "findings": as_records(findings),
    }
