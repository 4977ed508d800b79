"""What a few pictures of a recording show: its light, its time, and the targets in its first moments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.findings import Finding
from vidtrack.timing.frame import VideoInfo
from vidtrack.tracking.detection.threshold import background_level, noise_sd
from vidtrack.video.random_access import Pictures
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import TimeSource, find_time

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Limits:
    """When light and targets give cause for a word.

    contrast    grey levels of a target above its surroundings: less is near what codecs leave
    over_noise  contrast over noise: at 10 the centroid of 50 px is known to some 0.05 px
    saturated   share of samples with clipped levels
    pixels      of a target: fewer give a centroid that depends on where it lies between pixels
    samples     a period: what data for validation are asked to have (DOE: 100)
    cycles      that must be seen to say a period
    """

    contrast: float = 30.0
    over_noise: float = 10.0
    saturated: float = 0.2
    pixels: float = 12.0
    samples: float = 100.0
    cycles: float = 1.5


LIMITS = Limits()


class Light(NamedTuple):
    """Grey levels 0 to 255: noise and background of a picture, its brightest and darkest ten-thousandth."""

    noise: float
    background: float
    bright: float
    dark: float


class Recording(NamedTuple):
    """What a recording is, by a few of its pictures spread over it."""

    path: str
    info: VideoInfo
    time: TimeSource
    frames: int
    seconds: float
    light: list[Light]


def look_at(path: str, how: Mapping[str, Any], *, start_timecode: str | None = None, most: int = 4) -> Recording:
    """Decode `most` pictures from first to last, opened as `how` says; VidtrackError where that cannot be done."""
    pictures = Pictures(path, **how)
    try:
        n = len(pictures)
        chosen = np.unique(np.linspace(0, n - 1, min(n, most)).astype(int)).tolist()
        light = [light_of(pictures.picture(i), pictures.info.bits) for i in chosen]
        seconds = n / float(pictures.info.rate)
    finally:
        pictures.close()
    found = find_time(path, pictures.info, start_timecode=start_timecode)
    return Recording(path, replace(pictures.info, time=found.base), found, n, seconds, light)


def light_of(luma: Any, bits: int) -> Light:
    """The light of one picture."""
    scale = 255.0 / (2**bits - 1)
    dark, bright = np.percentile(luma[::2, ::2], [0.01, 99.99]) * scale
    return Light(noise_sd(luma, scale=scale), background_level(luma, scale=scale), float(bright), float(dark))


class Opening(NamedTuple):
    """What tracking of the first moments gave.

    centroids   as stage track gives them; findings: its own
    seconds     that tracking took for each frame
    """

    centroids: DataFrame
    findings: list[Finding]
    seconds: float


def track_opening(
    path: str, time: TimeSource, order: dict[str, Any], boxes: DataFrame | None, most: int, how: Mapping[str, Any]
) -> Opening:
    """Track the first `most` frames as stage track would."""
    from vidtrack.stages.track import track

    began = monotonic()
    with open_video(path, **how) as video:
        info = replace(video.info, time=time.base)
        frames = islice(video.frames(), _first(order["detect"]["start"]) + most)
        tracked = track(frames, info, targets=order["targets"], start_boxes=boxes, **order["detect"])
        read = max(len(tracked.centroids["frame"].unique()), 1)
    return Opening(tracked.centroids, tracked.findings, (monotonic() - began) / read)


def _first(start: Any) -> int:
    """Frames before the first that is used, where the config counts them; a time code is looked for in ten thousand."""
    return start if isinstance(start, int) else 0 if start is None else 10_000


class Target(NamedTuple):
    """One target in the first moments, medians: px, grey levels; shares of its samples; s, where a period was seen."""

    name: str
    measured: float
    diameter: float
    contrast: float
    sd: float
    saturated: float
    period: float | None


def targets_in(centroids: DataFrame) -> list[Target]:
    """Each target's looks and motion in a table of centroids."""
    return [_target(str(name), rows) for name, rows in centroids.groupby("target", sort=False)]


def _target(name: str, rows: DataFrame) -> Target:
    good = rows[rows["Xf"].notna()]
    saturated = float(rows["flag"].str.contains("saturated").mean())
    if good.empty:
        return Target(name, 0.0, np.nan, np.nan, np.nan, saturated, None)
    middle = good[["pixels", "contrast"]].median()
    sd = float(np.sqrt((good["sd_x"] ** 2 + good["sd_y"] ** 2).median() / 2))
    diameter = float(np.sqrt(4 * middle["pixels"] / np.pi))
    return Target(name, len(good) / len(rows), diameter, float(middle["contrast"]), sd, saturated, _period(good))


def _period(rows: DataFrame) -> float | None:
    """s, from crossings of the mean along the larger motion; None where too few cycles are seen, or no motion."""
    t = rows["time_s"].to_numpy(float)
    best = max(("Xf", "Yf"), key=lambda c: float(rows[c].to_numpy(float).std()))
    v = rows[best].to_numpy(float) - float(rows[best].mean())
    if len(v) < 8 or v.std() < 1.0:
        return None
    level = 0.2 * np.abs(v).max()
    side = np.sign(np.where(np.abs(v) > level, v, 0))
    known = np.flatnonzero(side)
    turns = known[1:][np.diff(side[known]) != 0]
    if len(turns) < 2 * LIMITS.cycles:
        return None
    return float(2 * (t[turns[-1]] - t[turns[0]]) / (len(turns) - 1))
