"""A clip of balls that stand still: averaged to one picture, every blob measured, with its scatter."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Picture
from vidtrack.labelling.background_texture import texture_sd
from vidtrack.labelling.still import FrameLike, Still, average, sample
from vidtrack.labelling.swing import rim_movement
from vidtrack.tracking.detection.blobs import Blobs, find_blobs
from vidtrack.tracking.detection.contrast_stretch import LEVELS, stretch
from vidtrack.tracking.detection.threshold import THRESHOLD, background_level, noise_sd
from vidtrack.tracking.outlines.apparent_width import apparent_widths

SCATTER_FRAMES = 24
"""Frames, at most, from whose centroids the scatter of a ball's position is estimated."""
SEVERAL, GRAIN = 1.5, 8
"""Times a ball's pixels, and px besides, beyond which what one frame shows is more than that ball."""
SWING = 0.3
"""px of movement within a clip beyond which a ball is said to swing, if it is also five times the usual."""
SMALLEST_SD = 0.002
"""px; frames that a codec copies do not scatter at all, which does not make them exact."""
SETTINGS = ("polarity", "threshold", "min_pixels", "centroid")
"""What of the detect settings finds blobs."""
MANY, SPARE = 2, 10
"""Blobs for each ball, and further ones, that reflections and dirt explain; more mean a background with a pattern."""


class Shot(NamedTuple):
    """One clip, averaged and searched.

    still    grey levels 0-255, stretched as `stretch` does (gain and offset)
    at       (n, 2) px, where its blobs are; sd (n, 2) px, one standard deviation of that
    scatter  (n, 2) px, standard deviation of a single frame's centroid; NaN with fewer than three frames
    swing    (n,) px rms by which it moves within the clip, where that is by more than SWING: as its centroids scatter,
             but no further than its rim moves; NaN as above
    seen     frames in the clip; damaged: how many of them were damaged, and left out
    """

    still: Still
    blobs: Blobs
    at: Array
    sd: Array
    scatter: Array
    swing: Array
    settings: dict[str, Any]
    seen: int
    damaged: int
    stretch: tuple[float, float] = (1.0, 0.0)

    def widths(self) -> Array:
        """How wide its blobs look, (n,) px; see `apparent_widths`."""
        return apparent_widths(self.bright(), self.at, self.blobs.pixels)

    def bright(self) -> Picture:
        """The mean picture, turned bright where balls are dark."""
        return 255.0 - self.still.mean if self.settings.get("polarity") == "dark" else self.still.mean


def take(
    frames: Iterable[FrameLike], detect: Mapping[str, Any], bits: int | None = None, balls: int | None = None
) -> Shot:
    """Average frames of a static scene and measure every blob on the mean.

    detect  polarity, threshold, min_pixels, centroid, as `find_blobs` takes them; gain, offset as `stretch` does;
            other keys are passed over
    bits    significant bits of 16-bit luma
    balls   how many a clip may show: where far more blobs stand out, an automatic threshold is raised to the level of
            so many of the brightest, for a background with a pattern is full of blobs
    The sd is the scatter over the root of the number of frames; for a lone frame, that by noise and contrast;
    and what a pattern of the background adds.
    Raises ValueError where no frame is good or sizes differ.
    """
    taken = sample(frames)
    lumas, bits = taken.lumas, bits or 8 * taken.lumas.dtype.itemsize
    scale = np.float32(255.0 / (2**bits - 1))
    still = average(lumas)
    still = still._replace(mean=still.mean * scale, sd=still.sd * scale)
    settings = {name: detect[name] for name in SETTINGS if detect.get(name) is not None}
    wish = {name: detect[name] for name in ("gain", "offset") if detect.get(name) is not None}
    table = stretch(list(lumas), bits, dark=settings.get("polarity") == "dark", **wish)
    noise = None
    if table:
        noise = table.gain * noise_sd(lumas[0], scale=float(scale))
        still = still._replace(mean=table.grey(still.mean), sd=still.sd * np.float32(table.gain))
        lumas, bits = np.stack([table.over(luma) for luma in lumas]), LEVELS.bits
    # a lone frame keeps its whole levels, by which its noise is known
    alone = still.frames == 1
    picture, noise_of = (lumas[0], noise) if alone else (still.mean, None)
    blobs = find_blobs(picture, bits=bits, noise=noise_of, **settings)
    if balls and settings.get("threshold", "auto") == "auto" and len(blobs.Xf) > MANY * balls + SPARE:
        raised = {**settings, "threshold": _level_of_brightest(still.mean, blobs, balls, settings)}
        fewer = find_blobs(picture, bits=bits, noise=noise_of, **raised)
        if balls / 2 <= len(fewer.Xf) <= MANY * balls + SPARE:
            blobs, settings = fewer, raised
    at = np.stack([blobs.Xf, blobs.Yf], -1)
    scatter = _scatter(lumas, at, blobs, settings, bits, noise)
    swing = np.hypot(scatter[:, 0], scatter[:, 1])
    if (seen := np.flatnonzero(swing > SWING)).size:
        levels = _spread(lumas) * np.float32(255.0 / (2**bits - 1))
        swing[seen] = np.minimum(swing[seen], rim_movement(levels, still.mean, blobs, seen))
    stated = np.stack([blobs.sd_x, blobs.sd_y], -1)
    sd = np.where(np.isfinite(scatter), scatter / np.sqrt(still.frames), stated)
    sd = np.hypot(sd, texture_sd(still, blobs, noise or noise_sd(lumas[0], scale=float(scale))))
    shot = Shot(still, blobs, at, np.maximum(sd, SMALLEST_SD), scatter, swing, settings, taken.seen, taken.damaged)
    return shot._replace(stretch=(table.gain, table.offset)) if table else shot


def _level_of_brightest(mean: Picture, blobs: Blobs, balls: int, settings: Mapping[str, Any]) -> float:
    """The grey level between the background and the `balls` brightest blobs, by the share of `automatic`."""
    sign = -1.0 if settings.get("polarity") == "dark" else 1.0
    boxes = zip(blobs.left, blobs.top, blobs.width, blobs.height, strict=True)
    peaks = np.array([(sign * mean[top : top + h, left : left + w]).max() for left, top, w, h in boxes])
    base = sign * background_level(mean)
    return float(sign * (base + THRESHOLD.share * (np.median(np.sort(peaks)[-balls:]) - base)))


PLACED_ROOM = 2.0
"""px about a blob within which a point that was placed by hand stands for it."""


def with_placed(shot: Shot, placed: Array) -> Shot:
    """The shot with points that a person placed, (n, 3): Xf, Yf, standard deviation, px; as further blobs.

    They have no pixels; a blob that holds one of them gives way to it.
    """
    n, b = len(placed), shot.blobs
    if not n:
        return shot
    x, y, sd = placed.T
    in_x = (x[:, None] > b.left - PLACED_ROOM) & (x[:, None] < b.left + b.width + PLACED_ROOM - 1)
    in_y = (y[:, None] > b.top - PLACED_ROOM) & (y[:, None] < b.top + b.height + PLACED_ROOM - 1)
    keep = ~(in_x & in_y).any(axis=0)
    none, whole, never = np.zeros(n), np.zeros(n, np.intp), np.zeros(n, bool)
    left, top = np.rint(x).astype(np.intp), np.rint(y).astype(np.intp)
    own = Blobs(x, y, whole, none, sd, sd, left, top, whole, whole, never, never, none, none, none)
    return shot._replace(
        blobs=Blobs._make(np.concatenate([old[keep], new]) for old, new in zip(b, own, strict=True)),
        at=np.concatenate([shot.at[keep], placed[:, :2]]),
        sd=np.concatenate([shot.sd[keep], placed[:, [2, 2]]]),
        scatter=np.concatenate([shot.scatter[keep], np.full((n, 2), np.nan)]),
        swing=np.concatenate([shot.swing[keep], np.full(n, np.nan)]),
    )


def look_again(shot: Shot, xy: Array, reach: float) -> Shot | None:
    """The shot of a small window about xy (2,) px, `reach` px to each side, with an automatic threshold of its own.

    A ball too dim for the threshold of the whole picture may show. None where it does not.
    """
    rows, columns = shot.still.mean.shape
    left, top = (max(0, int(np.floor(c - reach))) for c in xy)
    right, bottom = min(columns, int(np.ceil(xy[0] + reach)) + 1), min(rows, int(np.ceil(xy[1] + reach)) + 1)
    if right - left < 8 or bottom - top < 8:
        return None
    window = np.ascontiguousarray(shot.still.mean[top:bottom, left:right])
    blobs = find_blobs(window, **{**shot.settings, "threshold": "auto"})
    whole = ~blobs.edge
    if not whole.any():
        return None
    blobs = Blobs._make(column[whole] for column in blobs)
    blobs = blobs._replace(Xf=blobs.Xf + left, Yf=blobs.Yf + top, left=blobs.left + left, top=blobs.top + top)
    at, sd = np.stack([blobs.Xf, blobs.Yf], -1), np.stack([blobs.sd_x, blobs.sd_y], -1)
    unknown = np.full(at.shape, np.nan)
    return shot._replace(blobs=blobs, at=at, sd=np.maximum(sd, SMALLEST_SD), scatter=unknown, swing=unknown[:, 0])


def _spread(lumas: Picture) -> Picture:
    """SCATTER_FRAMES of them at most, spread over all."""
    which = np.linspace(0, len(lumas) - 1, min(len(lumas), SCATTER_FRAMES)).round().astype(int)
    return np.asarray(lumas[np.unique(which)])


def _scatter(
    lumas: Picture, at: Array, blobs: Blobs, settings: dict[str, Any], bits: int, noise: float | None
) -> Array:
    """(n, 2) px, scatter of single frames' centroids about those `at` of the mean's blobs; NaN for fewer than three
    frames. Frames in which a ball runs into its neighbour by their noise do not count.
    """
    reach = np.maximum(blobs.width, blobs.height) / 2
    chosen = _spread(lumas)
    places = np.full((len(chosen), len(at), 2), np.nan)
    for k, luma in enumerate(chosen if len(chosen) >= 3 and len(at) else ()):
        found = find_blobs(luma, bits=bits, noise=noise, **settings)
        here = np.stack([found.Xf, found.Yf], -1)
        if len(here):
            d = np.linalg.norm(here[None] - at[:, None], axis=-1)
            nearest = d.argmin(1)
            same = (d[np.arange(len(at)), nearest] < reach) & (found.pixels[nearest] < SEVERAL * blobs.pixels + GRAIN)
            places[k, same] = here[nearest[same]]
    count = np.isfinite(places[..., 0]).sum(0)[:, None]
    middle = np.nansum(places, 0) / np.maximum(count, 1)
    spread = np.sqrt(np.nansum((places - middle) ** 2, 0) / np.maximum(count - 1, 1))
    return np.where(count >= 3, spread, np.nan)


def composite(shots: Iterable[Shot]) -> NDArray[np.uint8]:
    """One picture (rows, columns) with the balls of all shots: at each pixel the shot that stands out most there."""
    best: NDArray[np.float32] | None = None
    out: NDArray[np.float32] | None = None
    for shot in shots:
        mean = shot.still.mean
        stands_out = mean - np.median(mean)
        if shot.settings.get("polarity") == "dark":
            stands_out = -stands_out
        if out is None or best is None:
            out, best = mean.copy(), stands_out
        else:
            more = stands_out > best
            out[more], best[more] = mean[more], stands_out[more]
    if out is None:
        raise ValueError("no shots")
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)
