"""Two cameras without any common reference: their relative place, from balls that both see.

The fundamental matrix needs no focal length: u_b^T F u_a = 0 (Luong and Faugeras 1996), by normalised least squares
over random samples (RANSAC; Fischler and Bolles 1981), for either way in which the balls can correspond. With a pair
of focal lengths it gives the pose (Longuet-Higgins 1981), and the wand's length, that must be the same at every
moment, says which focal lengths are right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.calibration.wand.ends import chosen, complete


class PairSettings(NamedTuple):
    """How a pair of cameras is sought."""

    samples: int = 150
    """Random samples of corresponding balls."""
    points: int = 16
    """Balls in each."""
    agree: float = 0.01
    """Share of the picture's width within which balls lie on their epipolar line: lens distortion is not yet known."""
    fewest: int = 12
    """Moments that both cameras must share."""
    f: tuple[float, ...] = (0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.5)
    """Focal lengths to try, in picture widths."""


SETTINGS = PairSettings()


class Pair(NamedTuple):
    """Two cameras' relation."""

    F: Array  # (3, 3) for px
    order: Ints  # (n,) which order of the second camera's balls corresponds, of those tried
    inlier: Bools  # (n,) moments at which all balls lie on their epipolar lines
    error: float  # px, median distance of the inliers from the lines


class Start(NamedTuple):
    """A guess of a pair's relative place: the first at the origin, the second c = R p + t, in units of the wand."""

    f: tuple[float, float]  # px
    R: Array
    t: Array
    points: Array  # (n, q, 3) in axes of the first camera; NaN where not both see the wand
    spread: float  # of the wand's length over the moments, as a share of it


def find_pair(
    a: Array, b: Array, stretch: Ints, orders: list[tuple[int, ...]], width: int, rng: np.random.Generator
) -> Pair | None:
    """The fundamental matrix of two cameras that see q balls at n moments, a and b (n, q, 2) px; None where it fails.

    stretch  (n,) within which the order of the balls is one
    orders   of b's balls, that may correspond to a's
    """
    both = complete(a) & complete(b)
    if both.sum() < SETTINGS.fewest:
        return None
    tolerance = SETTINGS.agree * width
    counts = np.bincount(stretch[both], minlength=stretch.max() + 1)
    best: tuple[float, Array] | None = None
    for _ in range(SETTINGS.samples):
        where = int(rng.choice(len(counts), p=counts / counts.sum()))
        rows = np.flatnonzero(both & (stretch == where))
        picked = [(rows, orders[int(rng.integers(len(orders)))])]
        if len(rows) * a.shape[1] < SETTINGS.points:
            other = int(rng.choice(len(counts), p=counts / counts.sum()))
            picked.append((np.flatnonzero(both & (stretch == other)), orders[int(rng.integers(len(orders)))]))
        pa = np.concatenate([a[r].reshape(-1, 2) for r, _ in picked])
        pb = np.concatenate([b[r][:, list(order)].reshape(-1, 2) for r, order in picked])
        if len(pa) < 8:
            continue
        some = rng.choice(len(pa), min(SETTINGS.points, len(pa)), replace=False)
        F = fundamental(pa[some], pb[some])
        cost = np.where(both, _costs(F, a, b, orders), np.nan)
        _, each = chosen(cost, stretch, tolerance**2)
        total = float(np.minimum(each[both], tolerance**2).sum())
        if best is None or total < best[0]:
            best = total, F
    assert best is not None
    return _polished(best[1], a, b, stretch, orders, both, tolerance)


def _polished(
    F: Array, a: Array, b: Array, stretch: Ints, orders: list[tuple[int, ...]], both: Bools, tolerance: float
) -> Pair | None:
    for _ in range(4):
        order, each = chosen(np.where(both, _costs(F, a, b, orders), np.nan), stretch, tolerance**2)
        inlier = both & (np.nan_to_num(each, nan=np.inf) < tolerance**2)
        if inlier.sum() < SETTINGS.fewest:
            return None
        arranged = np.take_along_axis(b, np.array(orders)[order][..., None], 1)
        F = fundamental(a[inlier].reshape(-1, 2), arranged[inlier].reshape(-1, 2))
    return Pair(F, order, inlier, float(np.sqrt(np.median(each[inlier]))))


def _costs(F: Array, a: Array, b: Array, orders: list[tuple[int, ...]]) -> Array:
    """(n_orders, n) mean squared distance of the balls from their epipolar lines, px^2."""
    return np.stack([(sampson(F, a, b[:, list(order)]) ** 2).mean(-1) for order in orders])


def fundamental(a: Array, b: Array) -> Array:
    """F (3, 3) of corresponding px (n, 2), n >= 8, by the normalised eight-point method (Hartley 1997)."""
    Ta, Tb = _normaliser(a), _normaliser(b)
    x, y = _homogeneous(a) @ Ta.T, _homogeneous(b) @ Tb.T
    A = (y[:, :, None] * x[:, None, :]).reshape(len(a), 9)
    _, vectors = np.linalg.eigh(A.T @ A)
    U, s, Vt = np.linalg.svd(vectors[:, 0].reshape(3, 3))
    return np.asarray(Tb.T @ (U * (s[0], s[1], 0.0)) @ Vt @ Ta)


def algebraic_misfit(a: Array, b: Array) -> float:
    """How badly corresponding px (n, 2) fit any fundamental matrix, over how badly they fit a second one.

    Root mean squares of the linear equations' least two solutions, normalised units: 0 is a perfect fit; 1 says
    nothing, as balls that move along one line do.
    """
    x, y = _homogeneous(a) @ _normaliser(a).T, _homogeneous(b) @ _normaliser(b).T
    A = (y[:, :, None] * x[:, None, :]).reshape(len(a), 9)
    least, second = np.linalg.eigvalsh(A.T @ A / len(a))[:2]
    return float(np.sqrt(max(least, 0.0) / max(second, 1e-12)))


def _normaliser(p: Array) -> Array:
    centre = p.mean(0)
    scale = np.sqrt(2) / max(float(np.linalg.norm(p - centre, axis=-1).mean()), 1e-12)
    return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])


def _homogeneous(p: Array) -> Array:
    return np.concatenate([p, np.ones((*p.shape[:-1], 1))], -1)


def sampson(F: Array, a: Array, b: Array) -> Array:
    """Distance (...) of corresponding px (..., 2) from the epipolar lines of each other, to first order."""
    x, y = _homogeneous(a), _homogeneous(b)
    line_b, line_a = x @ F.T, y @ F
    with np.errstate(divide="ignore", invalid="ignore"):
        steep = np.sqrt((line_b[..., :2] ** 2).sum(-1) + (line_a[..., :2] ** 2).sum(-1))
        return np.asarray(np.abs((y * line_b).sum(-1)) / steep)


def starts(
    pair: Pair,
    a: Array,
    b: Array,
    lengths: Array,
    centres: tuple[Array, Array],
    f: tuple[tuple[float, ...], tuple[float, ...]],
    most: int = 120,
) -> list[Start]:
    """Guesses of focal lengths and pose, best first, from the balls a, b (n, q, 2) px of a pair, in the same order.

    lengths  (q, q) world units
    centres  px, (2,) each, where the optical axes are taken to be
    f        px, of each camera the focal lengths to try
    """
    rows = np.flatnonzero(pair.inlier)
    rows = rows[np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int)]
    wanted = np.triu_indices(len(lengths), 1)
    found = []
    for fa in f[0]:
        ua = _tangents(a[rows], fa, centres[0])
        for fb in f[1]:
            ub = _tangents(b[rows], fb, centres[1])
            E = _calibration(fb, centres[1]).T @ pair.F @ _calibration(fa, centres[0])
            for R, t in poses_of(E):
                p = meeting(ua, ub, R, t)
                front = (p[..., 2] > 0) & ((p @ R.T + t)[..., 2] > 0)
                if front.mean() < 0.9:
                    continue
                good = front.all(-1)
                ratio = _distances(p[good])[:, wanted[0], wanted[1]] / lengths[wanted]
                scale = float(np.median(ratio))
                spread = float(np.median(np.abs(ratio / scale - 1)))
                found.append((spread, fa, fb, R, t / scale))
    found.sort(key=lambda each: each[0])
    out = []
    for spread, fa, fb, R, t in found:
        whole = meeting(_tangents(a, fa, centres[0]), _tangents(b, fb, centres[1]), R, t)
        out.append(Start((fa, fb), R, t, whole, spread))
    return out


def _calibration(f: float, centre: Array) -> Array:
    return np.array([[f, 0, centre[0]], [0, f, centre[1]], [0, 0, 1.0]])


def _tangents(b: Array, f: float, centre: Array) -> Array:
    return _homogeneous((b - centre) / f)


def poses_of(E: Array) -> list[tuple[Array, Array]]:
    """The four poses (R, t), |t| = 1, of an essential matrix."""
    U, _, Vt = np.linalg.svd(E)
    U, Vt = U * np.sign(np.linalg.det(U)), Vt * np.sign(np.linalg.det(Vt))
    W = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return [(U @ turn @ Vt, sign * U[:, 2]) for turn in (W, W.T) for sign in (1.0, -1.0)]


def meeting(ua: Array, ub: Array, R: Array, t: Array) -> Array:
    """Where two lines of sight (..., 3) come nearest, in axes of the first camera; the second is c = R p + t."""
    d = ub @ R  # the second camera's sights in the first one's axes
    origin = -R.T @ t
    aa, bb, ab = (ua * ua).sum(-1), (d * d).sum(-1), (ua * d).sum(-1)
    ao, bo = ua @ origin, d @ origin
    with np.errstate(divide="ignore", invalid="ignore"):
        det = aa * bb - ab * ab
        along_a, along_b = (bb * ao - ab * bo) / det, (ab * ao - aa * bo) / det
    return np.asarray((along_a[..., None] * ua + origin + along_b[..., None] * d) / 2)


def _distances(p: Array) -> Array:
    return np.asarray(np.linalg.norm(p[:, :, None] - p[:, None], axis=-1))
