"""What one camera saw, from its tables: the targets' tracks, and what else it followed."""

from __future__ import annotations

import numpy as np
import pandas as pd

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.tracklets import lanes, may_change, pieces_of
from vidtrack.geometry.calibration_error import CameraUncertainty
from vidtrack.geometry.camera import Camera
from vidtrack.location.views import View

SHORTEST = 3
"""Samples of a tracklet of no target, at least; with fewer it is taken for noise."""


def view_of(
    name: str,
    centroids: pd.DataFrame,
    tracklets: pd.DataFrame | None,
    camera: Camera,
    uncertainty: CameraUncertainty | None,
) -> View:
    """A camera's view, a track a target of the centroid table.

    tracklets  what else was followed is put into further tracks, named '', and a target's track is cut where one of
               its tracklets begins; None: tracks are cut by their flags alone
    """
    t, column = np.unique(centroids["time_s"].to_numpy(float), return_inverse=True)
    codes, labels = pd.factorize(centroids["target"].astype(str), sort=False)
    n = len(labels)
    others, lane = _others(tracklets, t)
    table = pd.concat([centroids, others]) if len(others) else centroids
    codes = np.concatenate([codes, n + lane]).astype(np.intp)
    column = np.concatenate([column, np.searchsorted(t, others["time_s"])]).astype(np.intp)
    rows = n + int(lane.max(initial=-1)) + 1
    b = np.full((rows, t.size, 2), np.nan)
    b[codes, column] = table[["Xf", "Yf"]].to_numpy(float)
    sd = np.ones(b.shape)
    has_sd = {"sd_x", "sd_y"} <= set(table.columns) and bool(np.isfinite(table["sd_x"]).any())
    if has_sd:
        own = table[["sd_x", "sd_y"]].to_numpy(float)
        usual = np.nanmedian(own, axis=0)
        sd[codes, column] = np.where(np.isfinite(own) & (own > 0), own, usual)
    flag = np.full(b.shape[:2], "", object)
    if "flag" in table:
        flag[codes, column] = table["flag"].fillna("").astype(str)
    timecode = np.full(t.size, "", object)
    if "timecode" in centroids:
        timecode[column[: len(centroids)]] = centroids["timecode"].fillna("").astype(str)
    broken = may_change(flag) | _begins(tracklets, [str(x) for x in labels], t, rows)
    if len(others):
        broken[codes[len(centroids) :], column[len(centroids) :]] |= ~others.duplicated("tracklet").to_numpy()
    piece = pieces_of(b, broken)
    return View(
        name, camera, uncertainty, t, timecode, [*map(str, labels), *[""] * (rows - n)], b, sd, flag, has_sd, piece
    )


def _others(tracklets: pd.DataFrame | None, t: Array) -> tuple[pd.DataFrame, Ints]:
    """Rows of tracklets of no target, and the lane of each."""
    if tracklets is None or not len(tracklets):
        return pd.DataFrame({"time_s": np.zeros(0)}), np.zeros(0, np.intp)
    there = np.isin(tracklets["time_s"], t) & np.isfinite(tracklets["Xf"]) & (tracklets["tracklet"] >= 0)
    own = tracklets[there & (tracklets["target"].fillna("") == "")]
    own = own[own.groupby("tracklet")["tracklet"].transform("size") >= SHORTEST].sort_values("time_s", kind="stable")
    moment = np.searchsorted(t, own["time_s"])
    number, which = np.unique(own["tracklet"], return_inverse=True)
    first, last = np.full(len(number), t.size), np.full(len(number), -1)
    np.minimum.at(first, which, moment)
    np.maximum.at(last, which, moment)
    return own, lanes(first, last)[which]


def _begins(tracklets: pd.DataFrame | None, labels: list[str], t: Array, rows: int) -> Bools:
    """Samples (rows, T) at which a tracklet of a target begins."""
    out = np.zeros((rows, t.size), bool)
    if tracklets is None or not len(tracklets):
        return out
    own = tracklets[tracklets["target"].isin(labels) & (tracklets["tracklet"] >= 0)]
    first = own.sort_values("time_s").drop_duplicates("tracklet")
    first = first[np.isin(first["time_s"], t)]
    which = [labels.index(name) for name in first["target"]]
    out[which, np.searchsorted(t, first["time_s"])] = True
    return out
