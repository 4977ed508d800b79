"""Which track of one camera shows the same target as which track of another.

A track is matched as a whole, not frame by frame: two targets may pass through one epipolar line at one moment, but
seldom move along it together. Pairs of tracks that keep within the tolerance of each other's epipolar curves are
joined to candidates over all cameras; the set of candidates is then chosen that explains most samples with least
error, each track at most once (an exact integer programme). Where another set explains them about as well, the
correspondence is ambiguous, and said to be.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.geometry.triangulate import locate_points

Indices = NDArray[np.intp]

NONE = -1
"""No track of this camera; of a track: no target."""

MAX_SAMPLES = 400
"""Moments, evenly spread, that judge a pair of tracks."""

MAX_CANDIDATES = 20_000
CLIP = 3.0
"""Tolerances beyond which an error counts no more: a few bad samples do not part two tracks."""


class Correspondence(NamedTuple):
    """What `match_tracks` returns; the m targets come in the order of the first camera's tracks."""

    target: tuple[Indices, ...]  # for each camera (n_tracks,): the target that a track shows; NONE
    error_px: Array  # (m,) rms distance from the epipolar curves, px
    runner_up_px: Array  # (m,) that of the best other match of any of its tracks that explains as much; inf: none
    ambiguous: NDArray[np.bool_]  # (m,) another match explains the tracks about as well
    n_common: Indices  # (m,) moments at which two cameras or more saw it, of those looked at


class _Pair(NamedTuple):
    state: NDArray[np.int8]  # (n_a + 1, n_b + 1): 1 agree, -1 contradict, 0 have too little in common; last: NONE
    error: Array  # (n_a, n_b) rms px


class _Candidates(NamedTuple):
    tracks: Indices  # (m, n_cameras)
    error: Array  # (m,) px
    n_common: Indices  # (m,)
    explained: Array  # (m,) samples of a second and further camera, over the moments looked at
    value: Array  # (m,) the same, less for a large error


def match_tracks(
    cameras: Sequence[Camera],
    tracks: Sequence[ArrayLike],
    *,
    tolerance_px: float,
    targets: int | None = None,
    min_common: int = 5,
) -> Correspondence:
    """Find which tracks of several cameras show the same targets.

    tracks         for each camera (n_tracks, T, 2)  px at the same T moments; NaN where the target is lost
    tolerance_px   largest rms distance from the epipolar curve of the same target's track in another camera
    targets        how many there are at most; None: not known
    min_common     moments that two tracks must share to be judged, fewer only where T is smaller
    A target needs two cameras. Several tracks of one camera that do not overlap in time may show one target.
    Raises ValueError for shapes that do not match.
    """
    b = [np.asarray(t, float) for t in tracks]
    if len(b) != len(cameras) or any(t.ndim != 3 or t.shape[1:] != b[0].shape[1:] or t.shape[-1] != 2 for t in b):
        raise ValueError(f"tracks must be (n_tracks, T, 2) with one T for {len(cameras)} cameras")
    b = [t[:, _spread(b)] for t in b]
    T = b[0].shape[1]
    min_common = max(1, min(min_common, T))
    pairs = {
        (i, j): _judged(cameras[i], cameras[j], b[i], b[j], tolerance_px, min_common)
        for i, j in combinations(range(len(cameras)), 2)
    }
    candidates = _candidates(cameras, b, pairs, tolerance_px, min_common)
    limit = len(candidates.tracks) if targets is None else targets
    chosen = _chosen(candidates, limit)
    chosen = chosen[np.lexsort(np.where(candidates.tracks[chosen] == NONE, 1 << 30, candidates.tracks[chosen]).T[::-1])]
    runner_up, ambiguous = _rivals(candidates, chosen, limit)
    target = tuple(np.full(len(t), NONE, np.intp) for t in b)
    for k, row in enumerate(candidates.tracks[chosen]):
        for camera, track in enumerate(row):
            if track != NONE:
                target[camera][track] = k
    _add_fragments(target, b, pairs, ambiguous)
    return Correspondence(target, candidates.error[chosen], runner_up, ambiguous, candidates.n_common[chosen])


def by_target(tracks: ArrayLike, target: Indices, m: int) -> Array:
    """Tracks (n_tracks, T, k) of one camera put together by target, (m, T, k); NaN where no track has a sample."""
    b = np.asarray(tracks, float)
    out = np.full((m, *b.shape[1:]), np.nan)
    for k in range(m):
        for track in np.flatnonzero(target == k):
            out[k] = np.where(np.isfinite(out[k]), out[k], b[track])
    return out


def match_errors(cameras: Sequence[Camera], seen: Sequence[ArrayLike]) -> Array:
    """Rms distance (m,), px, of what the cameras see of each target, (m, T, 2) each, from the epipolar curves.

    NaN for a target that no two cameras see at one moment.
    """
    b = [np.asarray(s, float) for s in seen]
    b = [s[:, _spread(b)] for s in b]
    total, n = np.zeros(len(b[0])), np.zeros(len(b[0]))
    for i, j in combinations(range(len(b)), 2):
        d2 = np.maximum(
            epipolar_distance(cameras[i], cameras[j], b[i], b[j]) ** 2,
            epipolar_distance(cameras[j], cameras[i], b[j], b[i]) ** 2,
        )
        total += np.nansum(d2, -1)
        n += np.isfinite(d2).sum(-1)
    return np.sqrt(np.where(n > 0, total, np.nan) / np.maximum(n, 1))


def _spread(b: Sequence[Array]) -> Indices:
    """Up to MAX_SAMPLES of the moments at which two cameras or more see anything, evenly spread."""
    seen = np.sum([np.isfinite(t[..., 0]).any(0) for t in b], 0) >= 2
    moments = np.flatnonzero(seen)
    if not moments.size:
        return np.arange(min(1, b[0].shape[1]))
    return np.asarray(moments[np.linspace(0, moments.size - 1, min(moments.size, MAX_SAMPLES)).round().astype(int)])


def _judged(a: Camera, b: Camera, tracks_a: Array, tracks_b: Array, tolerance: float, min_common: int) -> _Pair:
    """All pairs of tracks of two cameras, by the larger of the distances in the two pictures."""
    A, B = tracks_a[:, None], tracks_b[None]
    d2 = np.maximum(epipolar_distance(a, b, A, B) ** 2, epipolar_distance(b, a, B, A) ** 2)
    common = np.isfinite(d2).sum(-1)
    total = np.nansum(np.minimum(d2, (CLIP * tolerance) ** 2), -1)
    error = np.sqrt(total / np.maximum(common, 1))
    state = np.zeros((len(tracks_a) + 1, len(tracks_b) + 1), np.int8)
    state[:-1, :-1] = np.where(common < min_common, 0, np.where(error <= tolerance, 1, -1))
    return _Pair(state, error)


def _candidates(
    cameras: Sequence[Camera],
    b: Sequence[Array],
    pairs: dict[tuple[int, int], _Pair],
    tolerance: float,
    min_common: int,
) -> _Candidates:
    """Every set of tracks, two or more of different cameras, that could be one target."""
    n = len(cameras)
    sets = np.full((0, n), NONE, np.intp)
    for camera in range(n):
        alone = np.full((len(b[camera]), n), NONE, np.intp)
        alone[:, camera] = np.arange(len(b[camera]))
        agree = np.zeros((len(sets), len(alone)), bool)
        contradict = np.zeros_like(agree)
        for other in range(camera):
            state = pairs[other, camera].state[sets[:, other], :-1]
            agree |= state > 0
            contradict |= state < 0
        old, new = np.nonzero(agree & ~contradict)
        joined = sets[old]
        joined[:, camera] = new
        sets = np.concatenate([sets, joined, alone])[:MAX_CANDIDATES]
    sets = sets[(sets != NONE).sum(1) >= 2]
    return _weighed(cameras, b, sets, tolerance, min_common)


def _weighed(
    cameras: Sequence[Camera], b: Sequence[Array], sets: Indices, tolerance: float, min_common: int
) -> _Candidates:
    T = b[0].shape[1]
    error, n_common, explained = np.full(len(sets), np.inf), np.zeros(len(sets), np.intp), np.zeros(len(sets))
    for start in range(0, len(sets), 512):
        part = slice(start, start + 512)
        lost = np.full((1, T, 2), np.nan)
        seen = np.stack([np.concatenate([t, lost])[sets[part, i]] for i, t in enumerate(b)])
        located = locate_points(cameras, seen, sd=1.0, most_unsure=np.inf)
        found = np.isfinite(located.point[..., 0])
        spare = np.where(found, 2.0 * np.isfinite(seen[..., 0]).sum(0) - 3, 0)
        chi2 = np.nansum(located.error**2, (0, -1))
        chi2 = np.where(found, np.minimum(chi2, (CLIP * tolerance) ** 2 * np.maximum(spare, 1)), 0)
        # a distance from the epipolar curve holds the noise of two pictures: twice the variance of one
        error[part] = np.sqrt(2 * chi2.sum(-1) / np.maximum(spare.sum(-1), 1))
        n_common[part] = found.sum(-1)
        explained[part] = np.where(found, np.isfinite(seen[..., 0]).sum(0) - 1, 0).sum(-1) / T
    value = explained * (1 - 0.5 * (error / tolerance) ** 2)
    good = (n_common >= min_common) & (error <= tolerance)
    return _Candidates(sets[good], error[good], n_common[good], explained[good], value[good])


def _chosen(candidates: _Candidates, limit: int, without: int = NONE) -> Indices:
    """The candidates, each track in at most one and at most `limit` of them, that explain most."""
    m = len(candidates.tracks)
    use = _incidence(candidates.tracks)
    if without == NONE and m <= limit and (use.sum(1) <= 1).all():
        return np.arange(m)
    import scipy.optimize as so

    upper = np.ones(m)
    if without != NONE:
        upper[without] = 0
    rows = np.concatenate([use, np.ones((1, m))])
    most = np.concatenate([np.ones(len(use)), [limit]])
    answer = so.milp(
        -candidates.value,
        constraints=so.LinearConstraint(rows, -np.inf, most),
        integrality=np.ones(m, int),
        bounds=so.Bounds(0, upper),
    )
    return np.flatnonzero(answer.x > 0.5) if answer.x is not None else np.zeros(0, np.intp)


def _incidence(tracks: Indices) -> Array:
    """(n_tracks of all cameras, m): 1 where candidate m holds the track."""
    m, n = tracks.shape
    parts = []
    for camera in range(n):
        part = np.zeros((int(tracks[:, camera].max(initial=NONE)) + 1, m))
        held = np.flatnonzero(tracks[:, camera] != NONE)
        part[tracks[held, camera], held] = 1
        parts.append(part)
    return np.concatenate(parts)


def _rivals(candidates: _Candidates, chosen: Indices, limit: int) -> tuple[Array, NDArray[np.bool_]]:
    """Error, px, of the best rival of each chosen candidate, and whether without it all is explained about as well.

    A rival holds one of its tracks and another one instead of one of the rest, and explains as many samples.
    """
    runner_up = np.full(len(chosen), np.inf)
    ambiguous = np.zeros(len(chosen), bool)
    tracks = candidates.tracks
    for k, own in enumerate(chosen):
        both = (tracks != NONE) & (tracks[own] != NONE)
        rival = (both & (tracks == tracks[own])).any(1) & (both & (tracks != tracks[own])).any(1)
        rival &= candidates.explained >= 0.9 * candidates.explained[own]
        if not rival.any():
            continue
        runner_up[k] = candidates.error[rival].min()
        # ASSUME: an error twice as large decides; with few moments it takes more
        ratio = 2 + 4 / np.sqrt(candidates.n_common[own])
        if runner_up[k] > ratio * max(candidates.error[own], 0.02):
            continue
        other = _chosen(candidates, limit, without=int(own))
        changed, instead = np.setdiff1d(chosen, other), np.setdiff1d(other, chosen)
        if candidates.explained[instead].sum() < 0.98 * candidates.explained[changed].sum():
            continue
        ambiguous[k] = _rms(candidates.error[instead]) <= ratio * max(_rms(candidates.error[changed]), 0.02)
    return runner_up, ambiguous


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _add_fragments(
    target: tuple[Indices, ...],
    b: Sequence[Array],
    pairs: dict[tuple[int, int], _Pair],
    ambiguous: NDArray[np.bool_],
) -> None:
    """Give a track that is left over to the one target that it agrees with at times when its camera had lost it."""
    seen = [np.isfinite(t[..., 0]) for t in b]
    for camera, own in enumerate(target):
        for track in sorted(np.flatnonzero(own == NONE), key=lambda i: -int(seen[camera][i].sum())):
            fitting = []
            for k in range(len(ambiguous)):
                if (seen[camera][own == k] & seen[camera][track]).any():
                    continue
                states = [
                    pairs[min(i, camera), max(i, camera)].state[(j, track) if i < camera else (track, j)]
                    for i in range(len(b))
                    if i != camera
                    for j in np.flatnonzero(target[i] == k)
                ]
                if any(s > 0 for s in states) and not any(s < 0 for s in states):
                    fitting.append(k)
            if len(fitting) == 1:
                own[track] = fitting[0]
