"""Where the water's edge was on a transect, frame by frame, from the timestack: a picture of time against distance.

Below the edge the ground is wet, above it dry. Which is brighter is not known: what wet and dry look like is learnt
from the seaward and the landward end, then from all that was found wet and dry, in turn. Dry ground keeps to each
place's own steady grey level; water has any grey level, dark or foam, as it is counted (a histogram), and changes from
frame to frame. So each sample has a log-likelihood ratio for being wet. The edge of a frame maximises the sum of
those below it; a path through all frames that does not leap is found by dynamic programming (Viterbi). Last, the edge
is placed between samples, by the two ground levels beside it: a step by its moments.

Ground that stays dark after the water has left it is distinguished from water only by its steadiness.
Sources: timestacks Aagaard & Holm (1989); the step by moments Tabatabai & Mitchell (1984).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array

ENDS = 0.08
"""ASSUME: share of the transect that is under water throughout at its seaward end, and dry throughout at the other."""
BINS = 48
STRONGEST = 3.0
"""Log-likelihood ratio beyond which one sample may not count for or against water: foam and footprints exist."""
FLOOR = 0.05
"""Share of samples that may look like anything."""
LEAP = 1.0
"""Cost of moving the edge by a sample between frames."""
ROUNDS = 5
HALF_WINDOW = 4
"""Samples to either side over which the step is integrated."""
FAINT = 2.0
"""A step lower than so many standard deviations of its own two sides is faint."""


class Edge(NamedTuple):
    """The water's edge in samples of the transect, for T frames; NaN where a frame is missing.

    position (T,)  position, a fraction of a sample counted from the seaward end
    sd       (T,)  its standard deviation, samples
    faint    (T,)  wet and dry look alike beside the edge
    at_end   (T,)  the edge lies at an end of the transect: the water reaches farther
    """

    position: Array
    sd: Array
    faint: NDArray[np.bool_]
    at_end: NDArray[np.bool_]


def water_edge(stack: ArrayLike) -> Edge:
    """The edge in every row of a timestack.

    stack   (T, n)  grey levels, seaward end first; a row of NaN is a missing frame
    Raises ValueError for fewer than 5 frames or 20 samples, or ends that look alike.
    """
    grey: Array = np.asarray(stack, np.float64)
    T, n = grey.shape
    known: NDArray[np.bool_] = np.asarray(np.isfinite(grey).all(1))
    if known.sum() < 5 or n < 20:
        raise ValueError(f"a timestack of {int(known.sum())} frames and {n} samples; 5 and 20 are needed")
    rows = grey[known]
    k = _first_guess(rows)
    for _ in range(ROUNDS):
        ratio = _log_ratio(rows, k)
        moved = _path(ratio)
        settled = np.array_equal(moved, k)
        k = moved
        if settled:
            break
    index, sd, faint = _placed(rows, k)
    at_end = (k <= 1) | (k >= n - 1)
    answer = np.full((2, T), np.nan)
    answer[0, known], answer[1, known] = index, sd
    flags = np.zeros((2, T), bool)
    flags[0, known], flags[1, known] = faint, at_end
    return Edge(answer[0], answer[1], flags[0], flags[1])


def _first_guess(grey: Array) -> NDArray[np.intp]:
    """The edge by what the two ends look like."""
    n = grey.shape[1]
    m = max(3, int(ENDS * n))
    wet = np.broadcast_to(np.arange(n) < m, grey.shape)
    dry = np.broadcast_to(np.arange(n) >= n - m, grey.shape)
    excess = grey - np.median(grey[dry])
    ratio = _ratio(excess, wet, dry, steady=True) + _ratio(_change(grey), wet, dry)
    if not ratio[wet].mean() - ratio[dry].mean() > 1:
        raise ValueError("its seaward and landward ends look alike: let it begin in the water and end on dry ground")
    return _path(ratio)


def _change(grey: Array) -> Array:
    """How much each sample changed since the frame before, a logarithm."""
    change: Array = np.log(1 + np.abs(np.diff(grey, axis=0, prepend=grey[1:2])))
    return change


def _log_ratio(grey: Array, k: NDArray[np.intp]) -> Array:
    """(T, n) how much each sample supports water, given the edge found so far."""
    place = np.arange(grey.shape[1])
    wet, dry = place < k[:, None] - 2, place >= k[:, None] + 2
    return _ratio(grey - _ground(grey, dry), wet, dry, steady=True) + _ratio(_change(grey), wet, dry)


def _ground(grey: Array, dry: NDArray[np.bool_]) -> Array:
    """The steady grey level of each place when dry; places that never were take their landward neighbour's."""
    n = grey.shape[1]
    often = dry.sum(0) >= 3
    masked = np.where(dry, grey, np.nan)
    ground = np.full(n, np.median(grey[dry]) if dry.any() else np.median(grey))
    if often.any():
        ground[often] = np.nanmedian(masked[:, often], axis=0)
        ground = np.interp(np.arange(n), np.flatnonzero(often), ground[often])
    return ground


def _ratio(feature: Array, wet: NDArray[np.bool_], dry: NDArray[np.bool_], *, steady: bool = False) -> Array:
    """log p(feature | wet) / p(feature | dry), (T, n), no stronger than STRONGEST; by smoothed histograms.

    steady   dry samples lie about one value, so that what lies far from it is water, even where it was taken for dry
    """
    if wet.sum() < 20 or dry.sum() < 20:
        return np.zeros(feature.shape)
    low, high = np.quantile(feature, [0.001, 0.999])
    width = max(float(high - low), 1e-9) / BINS
    bins = np.clip(((feature - low) / width).astype(np.intp), 0, BINS - 1)

    def density(where: NDArray[np.bool_]) -> Array:
        counts = np.bincount(bins[where], minlength=BINS)
        smooth = np.convolve(np.pad(counts, 2, mode="edge"), [0.06, 0.24, 0.4, 0.24, 0.06], mode="valid")
        return np.asarray(smooth / smooth.sum() * (1 - FLOOR) + FLOOR / BINS)

    dry_density = density(dry)
    if steady:
        values = feature[dry]
        middle = float(np.median(values))
        sd = max(1.4826 * float(np.median(np.abs(values - middle))), 0.5 * width)
        centres = low + (np.arange(BINS) + 0.5) * width
        bell = np.exp(-0.5 * ((centres - middle) / sd) ** 2)
        dry_density = bell / bell.sum() * (1 - FLOOR) + FLOOR / BINS
    ratio: Array = np.clip(np.log(density(wet) / dry_density), -STRONGEST, STRONGEST)
    return np.asarray(ratio[bins])


def _path(ratio: Array) -> NDArray[np.intp]:
    """The edge k (T,), 0 to n, that maximises the sum of the ratio below it, less the cost of moving.

    max over j of a_j - cost |i - j| is two running maxima, so a frame costs a time proportional to n.
    """
    T, n = ratio.shape
    score = np.concatenate([np.zeros((T, 1)), np.cumsum(ratio, axis=1)], axis=1)
    slope = LEAP * np.arange(n + 1)
    best = score[0]
    back = np.empty((T, n + 1), np.intp)
    for t in range(1, T):
        up, up_at = _running_max(best + slope)
        down, down_at = _running_max((best - slope)[::-1])
        up, down = up - slope, down[::-1] + slope
        from_below = up >= down
        back[t] = np.where(from_below, up_at, n - down_at[::-1])
        best = score[t] + np.where(from_below, up, down)
    k = np.empty(T, np.intp)
    k[-1] = int(np.argmax(best))
    for t in range(T - 1, 0, -1):
        k[t - 1] = back[t, k[t]]
    return k


def _running_max(a: Array) -> tuple[Array, NDArray[np.intp]]:
    top = np.maximum.accumulate(a)
    at = np.maximum.accumulate(np.where(a == top, np.arange(len(a)), 0))
    return top, at


def _placed(grey: Array, k: NDArray[np.intp]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The edge between samples: where a clean step of the same two levels would hold as much grey.

    Twice, the second time about the first answer. An edge beside mottled water stays where the path had it.
    """
    T, n = grey.shape
    ground = _ground(grey, np.arange(n) >= k[:, None] + 2)
    pad = 2 * REACH + HALF_WINDOW
    excess = np.pad(grey - ground, ((0, 0), (pad, pad)), mode="edge")
    row = np.arange(T)[:, None]
    edge = k
    for _ in range(2):
        middle = edge[:, None] + pad
        sea = excess[row, middle + np.arange(-2 - REACH, -2)]
        land = excess[row, middle + np.arange(2, 2 + 2 * REACH)]
        window = excess[row, middle + np.arange(-HALF_WINDOW, HALF_WINDOW)]
        wet_level, dry_level = np.median(sea, axis=1), np.median(land, axis=1)
        wet_sd = np.std(sea, axis=1)
        dry_sd = 1.4826 * np.median(np.abs(land - dry_level[:, None]), axis=1)
        height = wet_level - dry_level
        unclear = ~(np.abs(height) > FAINT * np.hypot(wet_sd, dry_sd))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip((window - dry_level[:, None]) / height[:, None], 0, 1)
            # Neighbouring samples share light and are alike, so each side counts as half as many.
            sd = np.sqrt(2 * HALF_WINDOW * (wet_sd**2 + dry_sd**2)) / np.abs(height) / 2
        shift = np.where(unclear, 0.0, np.nan_to_num(share.sum(1) - HALF_WINDOW))
        place = edge + shift
        edge = np.clip(np.round(place), 0, n).astype(np.intp)
    alike = np.median(np.abs(sea - dry_level[:, None]), axis=1) < FAINT * dry_sd
    faint: NDArray[np.bool_] = np.asarray(unclear & alike)
    sd = np.where(unclear, np.where(faint, FAINT_SD, UNCLEAR_SD), np.hypot(np.nan_to_num(sd), LEAST_SD))
    return np.asarray(place - 0.5, float), np.asarray(sd, float), faint


REACH = 3
"""Samples beside the edge that show the water's level; twice as many show the ground's."""
FAINT_SD, UNCLEAR_SD, LEAST_SD = 2.0, 0.9, 0.3
"""Samples: of an edge between grounds that look alike, one beside mottled foam, and the clearest; from renderings."""
