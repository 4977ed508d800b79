"""Whether the names of balls are reliable; where they are not, why, and which further pick would decide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.labelling.label import GATE, Labels, Picks, View, agreeing, complete, crowding_limit
from vidtrack.labelling.seeds import label_from_picks, on_one_line

LEAST_SHARE = 0.6
"""Of the balls that should be in the picture, how many must be found before labels are accepted."""

SCALES = (1.25, 1.5, 4 / 3, 0.8, 2 / 3, 0.75)
"""Of pictures in which people pick, besides a half and two: screens magnify windows, converters make them smaller."""

FLIPS = {"mirrored left to right": (-1, 1), "mirrored top to bottom": (1, -1)}
"""How all clips of a camera may be flipped since they were picked in; upside down its picks say otherwise."""

LEAST_PICKS = 4
"""Picks from which it can be judged whether they belong to the picture at all."""


ON_BALL = 0.01
"""Of the picture's width: a pick so near to a small ball's centre is on it."""


class Case(NamedTuple):
    """One camera's balls, and the names by which messages refer to them.

    clips   names of the views; tags: names of the points
    points  (m, 3) world units
    where   the place in the files of each pick
    """

    camera: str
    clips: Sequence[str]
    tags: Sequence[str]
    points: Array
    views: Sequence[View]
    picks: Picks
    where: Sequence[str]
    image_size: tuple[int, int]


def settled(case: Case, answers: Sequence[Labels]) -> Labels:
    """The one answer that is reliable.

    answers   best first, rivals after it (`configuration.label_with`)
    Raises VidtrackError, one line, where there is none or more than one.
    At most a third of the picks may contradict the answer; `odd_picks` says which.
    """
    if len(answers) != 1 or 3 * (~agreeing(answers[0], case.picks)).sum() > len(case.picks.point):
        _check_frame_of_picks(case, answers)
    if not answers:
        raise VidtrackError(_nothing_fits(case, None))
    if len(answers) > 1:
        raise VidtrackError(_look_alike(case, answers))
    best, agree = answers[0], agreeing(answers[0], case.picks)
    close = best.sd < 0.8 * crowding_limit(case.views)
    if not complete(best, case.picks) and len(agree) >= 4 and _mirrored(case):
        raise VidtrackError(_left_handed(case))
    share = LEAST_SHARE if close else 0.85
    if best.share_found(case.picks) < share or 3 * (~agree).sum() > len(agree):
        raise VidtrackError(_nothing_fits(case, best))
    return best


def _check_frame_of_picks(case: Case, answers: Sequence[Labels]) -> None:
    """Refuse picks whose px were counted from another corner or in a picture of another size, or that fit no answer."""
    picks, (width, height) = case.picks, case.image_size
    if len(picks.point) < LEAST_PICKS:
        return
    last = np.array([width - 1, height - 1], float)
    frames = {
        "Yf is counted from the lower edge": picks.xy * [1, -1] + [0, last[1]],
        "Xf is counted from the right edge": picks.xy * [-1, 1] + [last[0], 0],
        "Xf and Yf are counted from the lower right corner (or its clips are upside down)": last - picks.xy,
        "they are of a picture twice as large": picks.xy / 2,
        "they are of a picture half as large": picks.xy * 2,
        "Xf and Yf are exchanged": picks.xy[:, ::-1],
    } | {f"they are of a picture {scale:.3g} times as large": picks.xy / scale for scale in SCALES}
    for what, xy in frames.items():
        moved = picks._replace(xy=np.ascontiguousarray(xy))
        found = label_from_picks(case.points, case.views, moved, case.image_size, trusted=True)
        if found and complete(found[0], moved) and agreeing(found[0], moved).all():
            raise VidtrackError(
                f"{case.where[0]}: the picks of camera {case.camera} fit the balls only if {what}. Write Xf from the "
                "left, Yf from the top, 0 in the middle of the first pixel, in px of the recording."
            )
    for way, sign in FLIPS.items():
        back = [view._replace(blobs=np.where(np.array(sign) < 0, last - view.blobs, view.blobs)) for view in case.views]
        found = label_from_picks(case.points, back, picks, case.image_size, trusted=True)
        if found and complete(found[0], picks) and agreeing(found[0], picks).all():
            raise VidtrackError(
                f"{case.where[0]}: the picks of camera {case.camera} fit the balls only if its clips are {way}. Flip "
                "their recordings back, and see whether those of its runs are flipped too."
            )
    if answers and all(3 * (~agreeing(labels, picks)).sum() > len(picks.point) for labels in answers):
        if _mirrored(case):
            raise VidtrackError(_left_handed(case))
        clips = " Or have two clips each other's tags (calibration.clips.<clip>.tags)?" if len(case.views) > 1 else ""
        raise VidtrackError(
            f"{case.where[0]}: most picks of camera {case.camera} lie where no ball of their tags can be. Is this clip "
            f"of this camera, or are two cameras' recordings exchanged?{clips} Else correct the picks."
        )


def odd_picks(case: Case, labels: Labels) -> dict[int, str]:
    """What is wrong with each pick that the labels contradict: by the pick's index, a line each."""
    return {i: _odd_pick(case, labels, i) for i in np.flatnonzero(~agreeing(labels, case.picks)).tolist()}


def picked_alone(case: Case, labels: Labels, picks: Iterable[int]) -> dict[int, tuple[int, int, int]]:
    """Of picks that the labels contradict, those at a ball that is no other tag's, of a tag that has no ball.

    By the pick's index: view, row of the view's points, blob. The survey may be wrong there as well as the pick.
    """
    out: dict[int, tuple[int, int, int]] = {}
    for i in picks:
        v, view = int(case.picks.view[i]), labels.views[int(case.picks.view[i])]
        row = int(np.searchsorted(view.points, case.picks.point[i]))
        free = np.setdiff1d(np.arange(len(view.blobs)), [*labels.blob[v], *(b for w, _, b in out.values() if w == v)])
        if labels.blob[v][row] >= 0 or not len(free):
            continue
        d = np.linalg.norm(view.blobs[free] - case.picks.xy[i], axis=-1)
        j = int(free[d.argmin()])
        if d.min() <= max(float(view.reach[j].max()), ON_BALL * case.image_size[0]):
            out[i] = v, row, j
    return out


MANY = 2.0
"""Blobs for each ball of a clip from which on some of them are rather something else."""

FEW = 0.8
"""Of the tags of a clip, up to which its blobs are so few that it may be taken to show more than it does."""
OUTSIDE = "outside the picture"
MERGED = "its picture runs into another ball's"
AT_EDGE = "touches the edge of the picture"
"""Why a ball cannot be measured though it may well be where its survey has it."""


def missing_because(labels: Labels, view: int, row: int) -> str:
    """Why a point of a view has no blob."""
    at, sd = labels.projected[view][row], labels.sd
    width, height = labels.pose.camera.image_size
    if not (np.isfinite(at).all() and (at > -0.5).all() and at[0] < width - 0.5 and at[1] < height - 0.5):
        return OUTSIDE
    if labels.merged[view][row]:
        return MERGED
    there, off = f"({at[0]:.1f}, {at[1]:.1f}), where it should be", labels.nearest[view][row]
    if off < 0.03 * width:
        return f"the nearest blob is {off:.1f} px from {there}; {GATE * sd:.1f} is allowed"
    return f"no blob at {there}: hidden or too dim"


def _odd_pick(case: Case, labels: Labels, i: int) -> str:
    v, point, xy = int(case.picks.view[i]), int(case.picks.point[i]), case.picks.xy[i]
    at = labels.projected[v]
    own = at[np.searchsorted(case.views[v].points, point)]
    text = (
        f"{case.where[i]}: tag {case.tags[point]} of camera {case.camera} is picked at ({xy[0]:g}, {xy[1]:g}), "
        "but the other picks and balls put it "
        f"{f'at ({own[0]:.0f}, {own[1]:.0f})' if np.isfinite(own).all() else 'out of sight'}"
    )
    d = np.nan_to_num(np.linalg.norm(at - xy, axis=-1), nan=np.inf)
    other = int(case.views[v].points[d.argmin()])
    if d.min() > 0.03 * case.image_size[0]:
        return text
    back = np.flatnonzero((case.picks.point == other) & (case.picks.view == v))
    if any(np.linalg.norm(case.picks.xy[j] - own) < 0.03 * case.image_size[0] for j in back):
        return f"{text}; tags {case.tags[point]} and {case.tags[other]} are swapped"
    return f"{text}; the ball there is tag {case.tags[other]}"


def _nothing_fits(case: Case, best: Labels | None) -> str:
    where = f"calibration: camera {case.camera}"
    odd = odd_picks(case, best) if best is not None and best.matched >= LEAST_SHARE * best.expected else {}
    if odd:
        return "; ".join(odd.values()) + ". Correct these picks."
    counts = ", ".join(
        f"{len(view.blobs)} blobs for {len(view.points)} tags in {clip}"
        for clip, view in zip(case.clips, case.views, strict=True)
    )
    share = f"; the best attempt names {best.matched} of {best.expected}" if best is not None else ""
    return f"{where}: no view of points.csv explains the balls ({counts}{share}). {_tags_unsaid(case)}{_cure(case)}"


def _tags_unsaid(case: Case) -> str:
    """What to set where several clips are taken to show every point and each shows a part of them; else empty."""
    n = len(case.tags)
    whole = [clip for clip, view in zip(case.clips, case.views, strict=True) if len(view.points) == n]
    few = [clip for clip, view in zip(case.clips, case.views, strict=True) if len(view.blobs) <= FEW * len(view.points)]
    if len(case.clips) < 2 or whole != list(case.clips) or not few:
        return ""
    return (
        f"Each clip is taken to show all {n} points: where it shows some of them, say which in config.yaml, "
        f"calibration: {{clips: {{{few[0]}: {{tags: 1-{n // len(case.clips)}}}}}}}. "
    )


def _cure(case: Case) -> str:
    n = len(case.picks.point)
    if n == 0:
        return "Name at least 4 balls, not on one line, in a clip's picks.csv."
    if n < 4:
        return f"{n} picks are too few here: name at least 4 balls, not on one line, in a clip's picks.csv."
    if on_one_line(case.points[case.picks.point]):
        return "The picks lie on one line: add a ball off it."
    return "Check the picks, the clips' tags and the threshold, or pick more balls."


def _left_handed(case: Case) -> str:
    return (
        f"calibration/points.csv: the balls that camera {case.camera} sees fit only its mirror image: the axes are "
        "left-handed. Swap two columns, or change the sign of one. Where this camera alone says so, its pictures "
        "are mirrored (by a mirror or a setting): turn them back in its clips and runs."
    )


def _mirrored(case: Case) -> bool:
    found = label_from_picks(case.points * (1.0, 1.0, -1.0), case.views, case.picks, case.image_size, trusted=True)
    return bool(found) and complete(found[0], case.picks)


def _look_alike(case: Case, answers: Sequence[Labels]) -> str:
    """Names the pick that would decide: the ball whose place differs most among the answers."""
    n = len(answers)
    choice: tuple[float, int, int] = (-1.0, 0, 0)
    for v in range(len(case.views)):
        at = np.stack([labels.projected[v] for labels in answers], 1)
        apart = np.linalg.norm(at[:, :, None] - at[:, None], axis=-1) + np.where(np.eye(n, dtype=bool), np.inf, 0)
        least = np.nan_to_num(apart.min((1, 2)), nan=-1.0)
        choice = max(choice, (float(least.max(initial=-1.0)), v, int(least.argmax())), key=lambda c: c[0])
    _, v, row = choice
    tag = case.tags[int(case.views[v].points[row])]
    lines = [f"{case.camera},{tag},{b[0]:.0f},{b[1]:.0f}" for b in (labels.projected[v][row] for labels in answers)]
    listed = " or ".join(lines[:4]) + (" or ..." if n > 4 else "")
    why = "the layout is symmetric"
    cure = f"Add the line that is true: {listed}."
    full = max(range(len(case.views)), key=lambda k: len(case.views[k].blobs) / max(len(case.views[k].points), 1))
    blobs, points = len(case.views[full].blobs), len(case.views[full].points)
    if blobs > MANY * points:
        why += f", or because texture or reflections are taken for balls: clip {case.clips[full]} shows {blobs} blobs"
        why += f" for {points} balls"
        cure = f"Raise detect.threshold, or cover what is bright beside the balls; or: {cure[0].lower()}{cure[1:]}"
    return (
        f"calibration/{case.clips[v]}/picks.csv: the balls that camera {case.camera} sees can be named in {n} ways "
        f"that fit equally well, because {why}. {cure}"
    )
