"""Stage coded_tags: the coded tags that a camera's recording shows become tables of a tracked recording.

Each corner is a target that names itself: tag7_1 to tag7_4, from the upper left one round as the tag is read.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.association.tracklets import COLUMNS, ends_of_tracks
from vidtrack.findings import Finding
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.quality.tracking_quality import pixel_locking
from vidtrack.tracking.tag_reading.tag_cover import Hull, near
from vidtrack.tracking.tag_reading.tag_reader import CORNERS, FLAGS, TagsSeen

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Limits:
    """From when something is said of a tag.

    chance    samples with a tag that the config does not name, below which it is taken for a false reading
    small     px a module of its code, median: below it tags are missed, and their angles are poor
    share     of a tag's samples in which a fault makes a finding
    """

    chance: int = 3
    small: float = 3.0
    share: float = 0.02


LIMITS = Limits()


class TagTables(NamedTuple):
    """What the stage gives: tables as those of stage track, what belongs in its record, and findings."""

    centroids: DataFrame
    tracklets: DataFrame
    record: dict[str, Any]
    findings: list[Finding]


def coded_tags(
    seen: TagsSeen, clock: TimeBase, *, modules: int, named: Collection[int] = (), where: str = "tags"
) -> TagTables:
    """The tables of the tags that a recording shows.

    clock    of the recording
    modules  along a tag's side
    named    numbers of the tags that the config names; others are left out where they are seen less than 3 times
    """
    from pandas import DataFrame, Series

    counts = (seen.flag == 0).sum(0)
    kept = np.flatnonzero(np.isin(seen.ids, list(named)) | (counts >= LIMITS.chance))
    ids, b, sd, flag = seen.ids[kept], seen.b[:, kept], seen.sd[:, kept], seen.flag[:, kept]
    k, n = flag.shape
    names = [f"tag{number}_{corner}" for number in ids.tolist() for corner in CORNERS]
    row, column = np.repeat(np.arange(k), 4 * n), np.tile(np.arange(4 * n), k)
    time = clock.seconds(seen.stamp, fields=seen.offset)
    nothing = np.full(row.size, np.nan)
    good = (flag == 0)[..., None, None]
    flat = np.where(good, b, np.nan).reshape(-1, 2)
    flat_sd = np.where(good, sd, np.nan).reshape(-1, 2)

    def words(of: Any, which: Any) -> Any:
        return Series(np.array(of, object), dtype="str").array.take(which)

    table = DataFrame(
        {
            "frame": seen.frame[row],
            "field": words(seen.field, row) if k else [],
            "time_s": time[row],
            "timecode": words(clock.labels(seen.stamp).astype(object), row) if k else [],
            "target": words(names, column) if names else [],
            "Xf": flat[:, 0],
            "Yf": flat[:, 1],
            "sd_x": flat_sd[:, 0],
            "sd_y": flat_sd[:, 1],
            **dict.fromkeys(("pixels", "total_pixels", "mass"), nothing),
            "contrast": np.repeat(seen.contrast[:, kept].ravel(), 4),
            "background": nothing,
            **dict.fromkeys(("box_x", "box_y", "box_w", "box_h"), nothing),
            "flag": words(FLAGS, np.repeat(flag.ravel(), 4)) if names else [],
        }
    )
    at, number, began, ended = ends_of_tracks(flat.reshape(k, 4 * n, 2))
    tracklets = table.take(at).reset_index(drop=True).assign(tracklet=number, met="", bound=True, brightness=np.nan)
    tracklets["began"], tracklets["ended"] = words(began, number), words(ended, number)
    tracklets = tracklets[list(COLUMNS)]
    record = _record(seen, kept, modules)
    return TagTables(table, tracklets, record, _findings(record, [int(i) for i in named], where))


def behind_targets(
    own: TagTables, centroids: DataFrame, tracklets: DataFrame, diagnostics: Mapping[str, Any], *, followed: bool
) -> tuple[DataFrame, DataFrame, dict[str, Any]]:
    """Centroids, tracklets and diagnostics of a camera, with the corners of its tags behind the targets.

    centroids, tracklets, diagnostics  of the targets, as stage track gives them
    followed  whether any target was followed: tags count in the frames then in which targets were
    """
    import pandas as pd

    last = int(tracklets["tracklet"].max()) if len(tracklets) else -1
    corners, more = own.centroids, own.tracklets.assign(tracklet=own.tracklets["tracklet"] + 1 + last)
    both = dict(diagnostics) | {key: own.record[key] for key in ("tags", "false_tags")}
    both["targets"] = diagnostics["targets"] | own.record["targets"]
    if followed:
        seen = set(centroids["frame"])
        corners, more = corners[corners["frame"].isin(seen)], more[more["frame"].isin(seen)]
    else:
        shares = [target["measured"] for target in own.record["targets"].values()]
        both |= {"pixel_locking": own.record["pixel_locking"], "measured": float(np.mean(shares)) if shares else 0.0}
    pairs = ((centroids, corners), (tracklets, more))
    tables = [pd.concat([table for table in pair if len(table)] or [pair[0]], ignore_index=True) for pair in pairs]
    return tables[0], tables[1], both


def apart_from_tags(
    centroids: DataFrame, tracklets: DataFrame, patches: Mapping[tuple[int, str], Sequence[Hull]], where: str
) -> tuple[DataFrame, DataFrame, list[Finding]]:
    """The tables of other targets without what lies at a tag that was painted over, and how often each target did.

    patches  px, outlines by frame and field (see `tracking.tag_reading.tag_reader`)
    A centroid there is NaN with the flag `merged`; a row of a tracklet is left out.
    """
    hidden, cut = (_at_tags(table, patches) for table in (centroids, tracklets))
    if not (hidden.any() or cut.any()):
        return centroids, tracklets, []
    centroids = centroids.copy()
    values = ["Xf", "Yf", "sd_x", "sd_y", "pixels", "mass", "contrast", "background"]
    centroids.loc[hidden, values] = np.nan
    centroids.loc[hidden, "flag"] = [
        ";".join([*(flag.split(";") if flag else ()), "merged"]) for flag in centroids.loc[hidden, "flag"]
    ]
    share = hidden.groupby(centroids["target"].astype(str)).mean()
    findings = []
    for target, part in share[share > LIMITS.share].items():
        text = (
            f"{where}: {target} touches the paper of a tag, or is hidden by it, in {100 * part:.2g} % of the pictures"
        )
        cure = "Keep targets and tags apart by a diameter, or cut the paper smaller."
        findings.append(Finding("note", "target-at-tag", f"{text}: it is not measured there", cure))
    return centroids, tracklets[~cut].reset_index(drop=True), findings


def _at_tags(table: DataFrame, patches: Mapping[tuple[int, str], Sequence[Hull]]) -> Any:
    """Which rows lie at a patch of their frame and field."""
    from pandas import Series

    found = np.zeros(len(table), bool)
    b, radius = table[["Xf", "Yf"]].to_numpy(float), np.sqrt(table["pixels"].to_numpy(float) / np.pi)
    rows_of: Mapping[Any, Any] = table.groupby(["frame", "field"], sort=False).indices
    for (number, name), rows in rows_of.items():
        if hulls := patches.get((int(number), str(name))):
            found[rows] = near(b[rows], np.nan_to_num(radius[rows]), hulls)
    return Series(found, index=table.index)


def _record(seen: TagsSeen, kept: Any, modules: int) -> dict[str, Any]:
    tags: dict[str, Any] = {}
    targets: dict[str, Any] = {}
    for i in kept.tolist():
        flag = seen.flag[:, i]
        name = f"tag{int(seen.ids[i])}"
        shares = {word: float((flag == f).mean()) for f, word in enumerate(FLAGS) if word and (flag == f).any()}
        measured = float((flag == 0).mean()) if flag.size else 0.0
        tags[name] = {
            "measured": measured,
            "flags": shares,
            "side_px": _median(seen.side[:, i]),
            "module_px": _median(seen.side[:, i]) / modules,
            "blur_px": _median(seen.blur[:, i]),
            "sd_px": _median(seen.sd[:, i]),
            "gamma": seen.gamma,
        }
        targets |= {f"{name}_{corner}": {"measured": measured, "flags": shares} for corner in CORNERS}
    false = [int(seen.ids[i]) for i in range(len(seen.ids)) if i not in kept]
    measured_at = np.where((seen.flag == 0)[..., None, None], seen.b, np.nan)[:, kept]
    positions = measured_at.reshape(len(seen.frame), 4 * len(kept), 2)
    locking = {axis: pixel_locking(positions[..., i]) for i, axis in enumerate("xy")}
    return {"tags": tags, "targets": targets, "false_tags": false, "pixel_locking": locking}


def _median(x: Any) -> float:
    known = x[np.isfinite(x)]
    return float(np.median(known)) if known.size else float("nan")


def _findings(record: dict[str, Any], named: list[int], where: str) -> list[Finding]:
    found = []
    tags = record["tags"]
    never = [f"tag{i}" for i in named if not tags.get(f"tag{i}", {}).get("measured")]
    if never:
        text = f"{where}: {', '.join(never[:8])}{' ...' * (len(never) > 8)} was seen in no picture"
        cure = "Is it in view, of the family that the config names, wholly visible with a white margin, and sharp?"
        found.append(Finding("doubtful", "tag-unseen", text, cure))
    gamma = next((own["gamma"] for own in tags.values()), np.nan)
    if gamma > 1:
        text = (
            f"{where}: grey levels are light to the power of 1/{gamma:.2g}, by the tags: white looks wider and black "
            "narrower; the tags' corners are corrected for it"
        )
        found.append(Finding("note", "tag-gamma", text, "Switch the camera's gamma off where it can be."))
    for name, own in tags.items():
        twice = own["flags"].get("twice", 0.0)
        if twice > 0:
            text = f"{where}: two tags with the number {name[3:]} are in {100 * twice:.2g} % of the pictures"
            cure = "Cover one of them, or print another number: one number is one tag."
            found.append(Finding("bad" if twice > 0.5 else "doubtful", "tag-twice", text, cure))
        if own["measured"] and own["module_px"] < LIMITS.small:
            text = (
                f"{where}: {name} is small: {own['side_px']:.0f} px a side, {own['module_px']:.2g} px a square of its "
                "code; it is missed in some pictures, and its angles are poor"
            )
            found.append(Finding("doubtful", "tag-small", text, "Print it larger, or film it nearer."))
        if own["flags"].get("blurred", 0.0) > LIMITS.share:
            text = (
                f"{where}: {name} is blurred or cut by the picture's edge in {100 * own['flags']['blurred']:.0f} % of "
                "the pictures: left out there"
            )
            found.append(Finding("doubtful", "tag-blurred", text, "Use a shorter exposure and more light."))
    return found
