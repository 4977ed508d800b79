"""Stage import_points: calibration points that another program digitised become the sightings of a camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array, Picture
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding

SAME = 0.006
"""World units: old files print to 0.01, so that the same place differs by less."""


class Seen(NamedTuple):
    """What a file says of a clip's points: tags, b (n, 2) px, sd (n,) px, pixels (n,), p (n, 3) world; NaN: not
    said."""

    tags: Sequence[str]
    b: Array
    sd: Array
    pixels: Array
    p: Array


def import_points(
    seen: Mapping[str, Seen],
    points: pd.DataFrame,
    *,
    tags: Mapping[str, Sequence[str]],
    sd: Mapping[str, float | None],
    sigma: float = 0.0,
    camera: str = "",
) -> tuple[pd.DataFrame, list[Finding]]:
    """The sightings of a camera, a row a clip and tag, as stage calibration_points has them.

    points  tag, x, y, z (world), sigma where known: the survey; tags: those that each clip shows
    sd      px, by clip: one standard deviation of all its positions, where the file has none; None: not known
    Raises VidtrackError for tags that the survey does not have.
    """
    survey = points.assign(tag=points["tag"].astype(str)).drop_duplicates("tag").set_index("tag")
    parts, findings = [], []
    for clip, own in seen.items():
        place = f"calibration/{clip}/{camera}"
        if missing := [tag for tag in own.tags if tag not in survey.index]:
            raise VidtrackError(f"{place}: tag {missing[0]} is not in points.csv. Add it there, or remove the tag.")
        at = {tag: i for i, tag in enumerate(own.tags)}
        listed = list(dict.fromkeys([*tags[clip], *own.tags]))
        which = np.array([at.get(tag, -1) for tag in listed], np.intp)
        found = (which >= 0) & np.isfinite(own.b[which]).all(-1)
        table = survey.loc[listed, ["x", "y", "z"]].reset_index()
        table.insert(0, "clip", clip)
        given = survey.loc[listed, "sigma"].to_numpy(float) if "sigma" in survey else np.full(len(listed), np.nan)
        table["sigma"] = np.where(np.isfinite(given), given, sigma)
        usual = np.nan if sd[clip] is None else float(sd[clip])  # type: ignore[arg-type]
        error = np.where(np.isfinite(own.sd[which]), own.sd[which], usual)
        for k, name in enumerate(("Xf", "Yf")):
            table[name] = np.where(found, own.b[which, k], np.nan)
        for name in ("sd_x", "sd_y"):
            table[name] = np.where(found, error, np.nan)
        table["pixels"] = np.where(found, np.nan_to_num(own.pixels[which]), np.nan)
        table["frames"] = found.astype(np.int64)
        table["found"] = found
        table["reason"] = np.where(found, "", "not digitised").astype(object)
        off = np.abs(own.p[which] - table[["x", "y", "z"]].to_numpy(float)).max(-1)
        if (far := found & (off > SAME)).any():
            text = (
                f"{place}: {far.sum()} points lie elsewhere in this file than in points.csv, "
                f"{table['tag'][far].iloc[0]} by "
            )
            text += f"{off[far][0]:.3g}"
            findings.append(
                Finding("doubtful", "survey-differs", text, "points.csv is used. Correct the one that is wrong.")
            )
        parts.append(table)
    return pd.concat(parts, ignore_index=True), findings


def drawn(table: pd.DataFrame, size: tuple[int, int]) -> Picture:
    """A picture of size (width, height) px that shows a spot where each point was digitised."""
    width, height = size
    picture = np.full((height, width), 16, np.uint8)
    for X, Y in table.loc[table["found"], ["Xf", "Yf"]].to_numpy(float):
        rows, columns = slice(max(int(Y) - 2, 0), int(Y) + 4), slice(max(int(X) - 2, 0), int(X) + 4)
        y, x = np.mgrid[rows, columns]
        spot = (16 + 200 * np.exp(-((x - X) ** 2 + (y - Y) ** 2) / 2)).astype(np.uint8)
        part = picture[rows, columns]
        np.maximum(part, spot[: part.shape[0], : part.shape[1]], out=part)
    return picture
