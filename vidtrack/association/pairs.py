"""Evidence that two tracklets of different cameras show one target: how well their lines of sight meet.

For tangents u_a, u_b of one target e = u_b . E u_a is zero (`geometry.epipolar`), and noise of both pictures gives it
the variance of its gradient by the pixels (Sampson 1982): chi^2 = e^2 / var, one degree of freedom a moment. A pair is
worth, moment by moment, the log-likelihood of one target over that of two that happen to be there:

    value = sum over common moments of  max(GAIN - chi^2 / 2, -LOSS)

GAIN is what false pairs leave: their misses move smoothly, so that they are not predicted by the whole picture but by
the miss just before. A moment may cost LOSS at most: a bad centroid does not part two tracklets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.distinct import distinct_pairs, short
from vidtrack.association.tracklets import Tracklets
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import MEET, about, above_surface, essential, lines

GAIN = 3.0
"""# ASSUME: nats a moment; a false pair's miss is predicted by its last one to some 20 standard deviations."""
LOSS = 5.0
SURE_PX = 0.1
"""Centroids of a larger sd say little of what the calibration leaves: a few of them would hide it."""
CHUNK = 32
"""Moments looked at together."""
PIECE = 16_384
"""Rows written together: what that needs stays in the processor's caches."""


class Rays(NamedTuple):
    """The rows of one camera's tracklets as lines of sight, with what one px of each coordinate changes in them.

    Tangents Xu/f, Yu/f, 1 (k = 2); where some camera looks through interfaces, Pluecker's coordinates (k = 6).
    """

    u: Array  # (N, 3) or (N, 6)
    by_x: Array  # (N, k) change by one px of Xf
    by_y: Array  # (N, k) and of Yf
    above: Rays | None = None  # where a camera looks at the water's surface: the same for what is above it


class Pairs(NamedTuple):
    """Pairs of tracklets of cameras a and b that fit at some moments; all other pairs that overlap contradict."""

    a: Ints  # (P,)
    b: Ints  # (P,)
    n: Ints  # (P,) common moments
    value: Array  # (P,) nats
    square: Array  # (P,) px^2, variance of a picture's coordinates that the misses show, over the moments that fit
    noise: Array  # (P,) px^2, that which the centroids' own standard deviations explain; sure ones weigh most in both


def rays_of(cameras: Sequence[Camera], b: Sequence[Array]) -> list[Rays]:
    """The lines of sight of each camera's frame-buffer positions b (N, 2) px, written in one way for all of them."""
    written = about(cameras)
    rays = [Rays(*lines(camera, own, written)) for camera, own in zip(cameras, b, strict=True)]
    if dry := above_surface(cameras):
        above = [Rays(*lines(camera, own, written)) for camera, own in zip(dry, b, strict=True)]
        rays = [each._replace(above=own) for each, own in zip(rays, above, strict=True)]
    return rays


class Side(NamedTuple):
    """One camera of a pair."""

    camera: Camera
    tracklets: Tracklets
    rays: Rays
    at: AtMoments | None = None  # as `by_moment` makes them, where they are at hand


def pairs_of(a: Side, b: Side, bias_px: float, moments: Ints) -> Pairs:
    """All pairs of two cameras' tracklets that fit, at the given moments.

    bias_px   standard deviation, px, of what the calibration leaves, in each picture
    """
    if a.rays.above and b.rays.above:
        dry = a._replace(rays=a.rays.above, at=None), b._replace(rays=b.rays.above, at=None)
        found = _nearer(_fitting(a, b, bias_px, moments), _fitting(*dry, bias_px, moments))
    else:
        found = _fitting(a, b, bias_px, moments)
    return _summed(a.tracklets, b.tracklets, found, bias_px, moments)


class _Fitting(NamedTuple):
    """Rows of two cameras at one moment that fit, as of `_sampson`."""

    row_a: Ints
    row_b: Ints
    chi2: Array
    slope: Array
    noise: Array

    def rows(self, keep: Ints) -> _Fitting:
        """Some of them."""
        row_a, row_b, chi2, slope, noise = self
        return _Fitting(row_a[keep], row_b[keep], chi2[keep], slope[keep], noise[keep])


def _nearer(one: _Fitting, other: _Fitting) -> _Fitting:
    """Of pairs of rows that fit in two media, the better fit."""
    both = _Fitting(*(np.concatenate(parts) for parts in zip(one, other, strict=True)))
    order = np.lexsort((both.chi2, both.row_b, both.row_a))
    a, b = both.row_a[order], both.row_b[order]
    first = np.ones(a.size, bool)
    first[1:] = (a[1:] != a[:-1]) | (b[1:] != b[:-1])
    return both.rows(order[first])


def _fitting(a: Side, b: Side, bias_px: float, moments: Ints) -> _Fitting:
    E = essential(a.camera, b.camera) if a.rays.u.shape[-1] == 3 else MEET
    E = E / max(float(np.linalg.norm(E)), 1e-300)
    E32 = E.astype(np.float32)
    A, B = (side.at or by_moment(side.tracklets, side.rays, bias_px, moments) for side in (a, b))
    k = a.rays.by_x.shape[-1]
    (each, m_a), m_b = A.at.shape, B.at.shape[1]
    e, bound = np.empty((2, min(CHUNK, each), m_a, m_b), np.float32)
    inside = np.empty(e.shape, bool)
    found = []
    for start in range(0, len(moments), CHUNK):
        part = slice(start, start + CHUNK)
        u_a, u_b = A.u[part], B.u[part]
        n = len(u_a)
        line = u_a @ E32.T  # (n, m, 3) in B's picture
        np.matmul(line, u_b.transpose(0, 2, 1), out=e[:n])
        np.multiply(e[:n], e[:n], out=e[:n])
        one, other = _bound(line, A.spread[part], k), _bound(u_b @ E32, B.spread[part], k)
        np.matmul(one, other[..., ::-1].transpose(0, 2, 1), out=bound[:n])
        hit = np.flatnonzero(np.less(e[:n], bound[:n], out=inside[:n]))  # an empty place: 0 < 0
        of_a, j = np.divmod(hit, max(m_b, 1))
        at_a, at_b = A.at[part].take(of_a), B.at[part].take(of_a // max(m_a, 1) * m_b + j)
        chi2, slope, noise = _sampson(E, A.packed.take(at_a, axis=0), B.packed.take(at_b, axis=0))
        found.append(_Fitting(at_a, at_b, chi2, slope, noise).rows(np.flatnonzero(chi2 < 2 * (GAIN + LOSS))))
    if not found:
        return _Fitting(*(np.zeros(0, np.intp),) * 2, *(np.zeros(0),) * 3)
    at_a, at_b, chi2, slope, noise = (np.concatenate(column) for column in zip(*found, strict=True))
    return _Fitting(A.row.take(at_a), B.row.take(at_b), chi2, slope, noise)


def _summed(one: Tracklets, other: Tracklets, found: _Fitting, bias_px: float, moments: Ints) -> Pairs:
    """The pairs of tracklets to which pairs of rows belong."""
    row_a, row_b, chi2, slope, noise = found
    a, b, pair, n_fit = distinct_pairs(one.owner[row_a], other.owner[row_b])
    common = np.maximum(_common(one, other, a, b, moments), n_fit)
    own = noise / slope - bias_px**2
    sure = 1 / (np.maximum(own, 0) + SURE_PX**2) ** 2
    worth, weight, square, spread = (
        np.bincount(pair, w, len(a)) for w in (GAIN - chi2 / 2, sure, sure * chi2 * noise / slope, sure * own)
    )
    return Pairs(a, b, common, worth - LOSS * (common - n_fit), square / weight, spread / weight)


class AtMoments(NamedTuple):
    """Rows at the moments wanted, up to m at each: arrays (M, m, ..), float32, zeros where there is none."""

    row: Ints  # (K,) of the rows at these moments, by moment
    at: Ints  # (M, m) which of those, -1 for none
    u: Array  # (M, m, 3 or 6)
    spread: Array  # (M, m) tangents^2: variance of the position, along the axis where it is most, at most
    packed: Array  # (K, ..) of those rows side by side, so that it is fetched at once: u, by_x, by_y, variances px^2


def by_moment(tracklets: Tracklets, rays: Rays, bias_px: float, moments: Ints) -> AtMoments:
    """A camera's rows by moment; bias_px, moments as of `pairs_of`."""
    place = _places(tracklets.sample, moments)
    row = np.flatnonzero((place >= 0) & np.isfinite(rays.u[:, 0]))
    place = place[row]
    order = np.argsort(short(place), kind="stable")
    row, place = row[order], place[order]
    counts = np.bincount(place, minlength=len(moments))
    m = int(counts.max(initial=0))
    where = place * m + np.arange(row.size) - np.repeat(np.cumsum(counts) - counts, counts)
    at = np.full(len(moments) * m, -1, np.intp)
    at[where] = np.arange(row.size)
    k = rays.u.shape[1]
    u, spread = np.zeros((at.size, k), np.float32), np.zeros(at.size, np.float32)
    packed = np.empty((row.size, k + 2 * rays.by_x.shape[1] + 2))
    for start in range(0, row.size, PIECE):
        part = slice(start, start + PIECE)
        own, there = row[part], where[part]
        line, by_x, by_y = (of.take(own, axis=0) for of in (rays.u, rays.by_x, rays.by_y))
        variance = tracklets.sd.take(own, axis=0) ** 2 + bias_px**2
        np.concatenate([line, by_x, by_y, variance], axis=1, out=packed[part])
        u[there] = line
        spread[there] = _dot(by_x, by_x) * variance[:, 0] + _dot(by_y, by_y) * variance[:, 1]
    shape = len(moments), m
    whole = row, at.reshape(shape), u.reshape(*shape, k), spread.reshape(shape), packed
    return AtMoments(*whole)  # type: ignore[arg-type]


def _places(samples: Ints, moments: Ints) -> Ints:
    """Where each of the samples (N,) is among the rising moments; -1: nowhere."""
    if not (len(samples) and len(moments)):
        return np.full(len(samples), -1, np.intp)
    first = min(int(samples.min()), int(moments[0]))
    where = np.full(max(int(samples.max()), int(moments[-1])) - first + 1, -1, np.intp)
    where[moments - first] = np.arange(len(moments))
    return where[samples - first]


def _bound(line: Array, spread: Array, k: int) -> Array:
    """(M, m, 2): factors whose products over two views sum to no less than the variance of e, times the gate."""
    gate = np.float32(np.sqrt(2 * (GAIN + LOSS)) * 1.01)  # float32 is not exact
    out = np.empty((*spread.shape, 2), np.float32)
    steep = np.square(line[..., 0])
    for axis in range(1, k):
        steep += np.square(line[..., axis])
    np.multiply(steep, gate, out=out[..., 0])
    np.multiply(spread, gate, out=out[..., 1])
    return out


def _sampson(E: Array, a: Array, b: Array) -> tuple[Array, Array, Array]:
    """chi^2, squared gradient of e by the four pixel coordinates and variance of e, (n,), of rows `packed` (n, ..)."""
    wide = len(E)
    u_a, u_b = a[:, :wide], b[:, :wide]
    line_b, line_a = u_a @ E.T, u_b @ E
    e = _dot(line_b, u_b)
    slope, noise = np.zeros(e.size), np.zeros(e.size)
    k = (a.shape[1] - wide - 2) // 2
    for line, side in ((line_a, a), (line_b, b)):
        for axis in (0, 1):
            g2 = _dot(line[:, :k], side[:, wide + axis * k : wide + (axis + 1) * k]) ** 2
            slope += g2
            noise += g2 * side[:, axis - 2]
    noise = np.maximum(noise, 1e-300)
    return e * e / noise, np.maximum(slope, 1e-300), noise


def _dot(a: Array, b: Array) -> Array:
    """Products of rows (n, k), summed (n,); of few columns quicker column by column."""
    if a.shape[1] > 3:
        return np.asarray(np.einsum("ni,ni->n", a, b))
    total = a[:, 0] * b[:, 0]
    for column in range(a.shape[1] - 1, 0, -1):
        total += a[:, column] * b[:, column]
    return np.asarray(total)


def _common(A: Tracklets, B: Tracklets, a: Ints, b: Ints, moments: Ints) -> Ints:
    """How many of the moments pairs of tracklets share, (P,), at least: gaps of the two may not coincide."""
    low, high = np.maximum(A.first[a], B.first[b]), np.minimum(A.last[a], B.last[b])
    span = np.searchsorted(moments, high, "right") - np.searchsorted(moments, low)
    gaps = [t.last - t.first + 1 - np.diff(t.start) for t in (A, B)]
    return np.asarray(np.maximum(span - gaps[0][a] - gaps[1][b], 0), np.intp)


def bias_of(pairs: Sequence[Pairs], least: float, most: float) -> float:
    """Standard deviation, px, of what the calibration leaves, from pairs that are each other's best and long enough.

    The median over such pairs of what their noise does not explain; widened, as half of them are worse.
    """
    extra: list[Array] = []
    for p in pairs:
        if not p.a.size:
            continue
        best_a, best_b = np.full(p.a.max() + 1, -np.inf), np.full(p.b.max() + 1, -np.inf)
        np.maximum.at(best_a, p.a, p.value)
        np.maximum.at(best_b, p.b, p.value)
        good = (p.value >= best_a[p.a]) & (p.value >= best_b[p.b]) & (p.n >= 8) & (p.value > 0)
        extra.append(p.square[good] - p.noise[good])
    found = np.concatenate(extra) if extra else np.zeros(0)
    if not found.size:
        return most
    return float(np.clip(1.5 * np.sqrt(max(np.percentile(found, 75), 0.0)), least, most))
