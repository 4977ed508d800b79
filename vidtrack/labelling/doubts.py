"""What is doubtful of the balls of calibration clips: they move, or several clips show them at different places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.labelling.label import Labels
from vidtrack.labelling.naming_doubts import Case, odd_picks, picked_alone
from vidtrack.labelling.shot import SWING
from vidtrack.naming import some_of

if TYPE_CHECKING:
    import pandas as pd

DISAGREE = 0.5
"""px between two clips' views of one tag that is worth a warning, where noise does not explain it."""

ONE_PLACE = 0.05
"""Of the usual distance between neighbours: tags that points.csv has nearer to each other are at one place."""

SWING_OF_ALL = 2 * SWING
"""px rms within a clip that is movement, however the others scatter: noise and tapes that jitter stay below it."""

MOST_SWING = 0.7
"""Share of a clip's balls of which it is the frame that swings, or the camera that shakes."""

EACH = 3
"""Findings of one kind and clip, at most; of more tags they are one."""


def doubt(code: str, text: str, cure: str) -> Finding:
    """A finding by which some positions may be wrong."""
    return Finding("doubtful", code, text, cure)


def with_picked(case: Case, labels: Labels) -> tuple[Labels, list[Finding]]:
    """The labels with the balls that picks name though the survey has them elsewhere, and a doubt a contradicted pick.

    All cameras together judge such a ball later (`survey`): where they agree on its place, points.csv is wrong.
    """
    odd = odd_picks(case, labels)
    alone = picked_alone(case, labels, odd)
    blob = [own.copy() for own in labels.blob]
    findings = []
    for i, line in odd.items():
        if i not in alone:
            findings.append(doubt("pick-not-used", f"{line}. The pick was not used.", ""))
            continue
        v, row, j = alone[i]
        blob[v][row] = j
        tag = case.tags[int(case.picks.point[i])]
        text = f"{line}. The ball there is no other tag's and was taken for tag {tag}."
        findings.append(doubt("pick-contradicted", text, f"Check tag {tag} in points.csv, and this pick."))
    return labels._replace(blob=blob), findings


def clip_moved(case: Case, i: int, offset: Array) -> Finding:
    """All balls of clip i lie elsewhere, by offset (2,) px."""
    return doubt(
        "clip-moved",
        f"calibration/{case.clips[i]}: the balls of camera {case.camera} lie ({offset[0]:+.1f}, {offset[1]:+.1f}) px "
        "from where the other clips put them.",
        "Did the camera move between clips? Record them again without touching it, or leave this clip out.",
    )


def clip_flipped(case: Case, i: int, way: str) -> Finding:
    """The balls of clip i lie where they should once its picture is flipped back; `way`: how it is flipped."""
    return doubt(
        "clip-flipped",
        f"calibration/{case.clips[i]}: the picture of camera {case.camera} is {way} beside its other clips, by where "
        "its balls lie.",
        "Flip its recording back, or leave this clip out: none of its balls is used.",
    )


def coinciding(rows: pd.DataFrame) -> list[Finding]:
    """Tags of one clip that points.csv has at one place, which two balls cannot be."""
    lines = []
    for clip, own in rows.groupby("clip", sort=False):
        if len(own) < 4:
            continue
        p = own[["x", "y", "z"]].to_numpy(float)
        apart = np.linalg.norm(p[:, None] - p[None], axis=-1)
        np.fill_diagonal(apart, np.inf)
        usual = np.median(np.partition(apart, 1, axis=1)[:, 1])  # the second: the first may be at the same place
        pairs = np.argwhere(np.triu(apart < ONE_PLACE * usual))
        tags = own["tag"].astype(str).tolist()
        lines += [
            doubt(
                "points-coincide",
                f"calibration/points.csv: tags {tags[i]} and {tags[j]}, which clip {clip} shows, stand at one place; "
                "two balls cannot.",
                "Correct the one that was mistyped (a sign, a digit), or remove from the clip's tags what it does not "
                "show.",
            )
            for i, j in pairs.tolist()
        ]
    return lines


def swinging(rows: pd.DataFrame, camera: str) -> list[Finding]:
    """Balls that move within their clip, each clip's together; of a frame that swings, or a camera that shakes, all."""
    usual = float(rows["scatter"].median())
    moves = (rows["scatter"] > SWING) & ((rows["scatter"] > 5 * usual) | (rows["scatter"] > SWING_OF_ALL))
    findings = []
    for clip, own in rows[moves].groupby("clip", sort=False):
        tags, px = own["tag"].astype(str).tolist(), float(own["scatter"].max())
        shown = int(rows.loc[rows["clip"] == clip, "found"].sum())
        which = f"tag {tags[0]} moves {px:.2f}" if len(tags) == 1 else f"tags {some_of(tags)} move up to {px:.2f}"
        cure = "Let it come to rest." if len(tags) == 1 else "Let them come to rest."
        if 1 < len(tags) > MOST_SWING * shown:
            cure += " Where it is the camera that shakes, put it on a firm stand. Leave out what moves by detect.start."
        text = f"calibration/{clip}: {which} px rms within the clip of camera {camera}."
        findings.append(doubt("ball-swings", text, cure))
    return findings


def disagreeing(rows: pd.DataFrame, camera: str) -> list[Finding]:
    """Tags that several clips show at different places: the tags of two clips together, where there are many."""
    apart: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for tag, own in rows[rows["found"]].groupby("tag", sort=False):
        first = own.iloc[0]
        for _, other in own.iloc[1:].iterrows():
            dx, dy = other["Xf"] - first["Xf"], other["Yf"] - first["Yf"]
            noise = float(np.linalg.norm([first["sd_x"], first["sd_y"], other["sd_x"], other["sd_y"]]))
            if np.hypot(dx, dy) > max(DISAGREE, 5 * noise):
                apart.setdefault((str(other["clip"]), str(first["clip"])), []).append((str(tag), dx, dy))
    cure = "Did the ball or the camera move? Record the clip again."
    findings = []
    for (clip, where), tags in apart.items():
        texts = [f"tag {tag} of camera {camera} lies ({dx:+.1f}, {dy:+.1f}) px from where" for tag, dx, dy in tags]
        if len(tags) > EACH:
            dx, dy = np.median([own[1:] for own in tags], axis=0)
            named = some_of([own[0] for own in tags])
            texts = [f"tags {named} of camera {camera} lie ({dx:+.1f}, {dy:+.1f}) px (median) from where"]
        findings += [doubt("clips-disagree", f"calibration/{clip}: {text} {where} has it.", cure) for text in texts]
    return findings
