"""The outline of a ball that is lit from one side: where its middle lies, beside the middle of its light.

A matt ball that a lamp lights from the side is brighter there, so that its centroid lies towards the lamp by up to half
of its radius. Its outline does not. The picture of a ball is fitted:

    I = G * (C s(u, v) + (1 - C) (a + b x + c y)),  u = (x - x0) / R,  v = (y - y0) / (e R),  w^2 = 1 - u^2 - v^2

C is 1 on the ball, whose height e depends on how square pixels are, G a Gaussian with the width of the lens's blur,
taken over each pixel; behind the ball lies a plane. Its surface s is that of Lambert's law, one lamp in direction l and
light from everywhere, s = d + max(0, l (u, v, w)), or a polynomial of the second degree, for other lights. What is
linear is solved for in each step (variable projection, Golub and Pereyra 1973). A saturated pixel is missed only by a
model that is darker there: the lit side of a ball that is clipped looked flat, and drew the outline by 0.6 px.

Water that covers the lower part of a ball makes its light one-sided, too. A fit of the same kind finds such a ball
out: a disc of one level, cut by a straight line, beyond which all is of another level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Picture
from vidtrack.tracking.outlines.drawn_ball import BallView, drawn


@dataclass(frozen=True)
class BallFit:
    """How a ball is fitted.

    begin_px    blur to begin with; least_px: at least
    lamps       angles of the lamp from the direction of the camera to begin with, radians; others, wider: where those
                leave more than `noisy` times the noise, more of them, with so many times the radius;
                aside: and from other sides, with so many times the radius; first: steps of each, of which the
                `best` go on
    smallest    of the radius of what is above the threshold, which a ball's own is at least
    steps, enough  at most; share by which the sum of squares falls at least, as long as steps go on
    same        times what a fit left without the height, that it leaves with it at most: else others may be better now
    damping     at least, and ridge, of the largest unknown's, which each other's is: with less the last bits of a
    ridge       processor choose the way that the direction of a lamp in front goes
    furthest    of the radius that the fit starts with, which its middle is from the light's, and its own radius from it
    longest     step of x, y (of the radius), log radius, log blur, log height and the two angles
    flattest    height over width, or the other way round, at most
    matt        times what a polynomial leaves that Lambert's law may: else it is not taken for it, as balls are matt;
                polynomials are up to 3 % too small where a lamp stands behind the camera
    alike       times the least misfit, up to which another surface is as good
    misfit      of the surface's level: error of the middle, of the radius, by what the fit leaves of it
    cuts        where a line cuts a ball to begin with, in radii: how far its middle is from it, how far its middle is
                from that of its light, and its radius over that of what is left; ways: directions that are tried
    best        of those, and of fits from other sides, how many are gone on with
    well        of the level, that a fit leaves at most which need not be compared with that of a ball that is cut;
    plain       of the level, that the latter leaves at most: 0.004 to 0.007 of drawn balls that are cut, 0.03 to 0.04
                where they are shaded and the water mirrors them; and where the former does not hold: crescents
    better      share of what the former leaves that it leaves at most: 0.1 to 0.6 of balls that are cut, 0.63 to 20
                of 152 lit ones, 0.8 and more of all but two of them
    """

    begin_px: float = 0.6
    least_px: float = 0.15
    lamps: tuple[float, ...] = (0.6, 1.3)
    others: tuple[float, ...] = (0.9, 1.7)
    wider: float = 1.5
    aside: float = 1.2
    smallest: float = 0.85
    first: int = 5
    noisy: float = 1.2
    steps: int = 30
    enough: float = 1e-4
    same: float = 1.02
    damping: float = 1e-4
    ridge: float = 1e-3
    furthest: tuple[float, float] = (1.5, 2.5)
    longest: tuple[float, ...] = (0.3, 0.3, 0.3, 0.5, 0.2, 0.4, 0.5)
    flattest: float = 1.6
    matt: float = 1.1
    alike: float = 1.3
    misfit: float = 1.0
    cuts: tuple[tuple[float, float, float], ...] = (
        (-0.2, 0.55, 1.6),
        (0.1, 0.37, 1.35),
        (0.4, 0.2, 1.16),
        (0.7, 0.06, 1.05),
    )
    ways: int = 12
    best: int = 3
    well: float = 0.015
    plain: tuple[float, float] = (0.045, 0.015)
    better: float = 0.7


BALL_FIT = BallFit()


class FittedBall(NamedTuple):
    """A ball in a piece of a picture, px of the piece.

    way     (2,) from where its light is to the middle of its outline; sd of it, one coordinate
    radius  of its outline; height: logarithm of its height over its width, and the sd of that
    misfit  rms of what the fit leaves beyond the noise, of the level of its surface; rms: of all that it leaves, grey
            levels
    spread  px between this and other fits that are about as good; unknowns: as `_descend` has them
    """

    way: Array
    sd: float
    radius: float
    height: tuple[float, float]
    misfit: float
    rms: float
    spread: float
    unknowns: Array


def fit_ball(
    piece: Picture,
    at: Sequence[float],
    radius: float,
    noise: float,
    *,
    lines: int = 1,
    height: float | None = None,
    begun: FittedBall | None = None,
    full: Bools | None = None,
    aside: bool = True,
) -> FittedBall | None:
    """The outline of a bright ball; None where no fit holds.

    piece   (rows, columns) grey levels, with background on all sides; at: column and row of the middle of its light
    radius  px, roughly; noise: grey levels, of a pixel; lines: 2 for a field, whose rows lie 2 px apart
    height  logarithm of a ball's height over its width, None: not known, and fitted; begun: the fit without it, from
            which this one goes on
    full    (rows, columns) pixels that are saturated: the ball is at least as bright there; None: there are none
    aside   whether it is begun from other sides where no fit leaves as little as noise does
    """
    view = _view(piece, at, lines, full)._replace(height_known=height is not None)
    begin = np.array([0.0, 0.0, np.log(radius), np.log(BALL_FIT.begin_px), height or 0.0])
    if begun is not None and height is not None:
        known = begun.unknowns.copy()
        known[4] = height
        same = _descend(view, known, radius)
        if same is not None and same.rms < BALL_FIT.same * begun.rms:
            return _fitted(same, noise, begun.spread)
    first = _descend(view, begin, radius)
    fits = [first] if first is not None else []
    start = begin if first is None else first.unknowns
    toward = np.arctan2(-start[1], -start[0])
    starts = [np.append(start, [lamp, toward]) for lamp in BALL_FIT.lamps]
    fits += [one for begun in starts if (one := _descend(view, begun, radius)) is not None]
    if min((one.rms for one in fits), default=np.inf) > BALL_FIT.noisy * noise:
        wider = begin.copy()
        wider[2] += np.log(BALL_FIT.wider)
        starts = [np.append(wider, [lamp, toward]) for lamp in BALL_FIT.others]
        fits += [one for begun in starts if (one := _descend(view, begun, radius)) is not None]
    least = min(fits, key=lambda one: one.rms, default=None)
    if aside and (least is None or (_misfit(least, noise) > BALL_FIT.well and least.rms > BALL_FIT.noisy * noise)):
        fits += _from_aside(view, begin, radius, float(toward))
    if not fits:
        return None
    best = min(fits, key=lambda one: one.rms * (1 if one.unknowns.size > begin.size else BALL_FIT.matt))
    good = [one for one in fits if one.rms <= BALL_FIT.alike * best.rms]
    return _fitted(best, noise, max(float(np.hypot(*(one.unknowns[:2] - best.unknowns[:2]))) for one in good))


def _from_aside(view: BallView, begin: Array, radius: float, toward: float) -> list[_Fit]:
    """Fits that begin with a larger ball, its dark side away from the light; the best few are finished.

    toward  the direction of the lamp as a polynomial has it, which may be the opposite one of crescents
    """
    begun: list[_Fit] = []
    for turn in (np.pi, np.pi / 2, -np.pi / 2, 0.0):
        for lamp in BALL_FIT.lamps:
            way = toward + turn
            start = np.append(begin, [lamp, way])
            start[:2] = (1 - BALL_FIT.aside) * radius * np.array([np.cos(way), np.sin(way)])
            start[2] += np.log(BALL_FIT.aside)
            if (one := _descend(view, start, radius, BALL_FIT.first)) is not None:
                begun.append(one)
    begun.sort(key=lambda one: one.rms)
    fits = [_descend(view, one.unknowns, radius) for one in begun[: BALL_FIT.best]]
    return [one for one in fits if one is not None and one.unknowns[2] >= begin[2] + np.log(BALL_FIT.smallest)]


def _misfit(fit: _Fit, noise: float) -> float:
    return float(np.sqrt(max(fit.rms**2 - noise**2, 0.0))) / max(fit.level, 1e-6)


def _fitted(best: _Fit, noise: float, spread: float) -> FittedBall:
    misfit, own = _misfit(best, noise), float(np.exp(best.unknowns[2]))
    sd = float(np.sqrt(best.variance + spread**2 / 2 + (BALL_FIT.misfit * misfit * own) ** 2))
    height = float(best.unknowns[4]), best.height_sd
    return FittedBall(best.unknowns[:2].copy(), sd, own, height, misfit, best.rms, spread, best.unknowns)


def is_cut(
    piece: Picture,
    at: Sequence[float],
    radius: float,
    noise: float,
    fit: FittedBall | None,
    *,
    lines: int = 1,
    held: bool = True,
    full: Bools | None = None,
) -> bool:
    """Whether a ball is rather cut off by a straight line, as by water, than lit from one side, as `fit` has it.

    fit   without the ball's height, or None; held: whether it counts; others as those of `fit_ball`
    """
    if fit is not None and fit.misfit < BALL_FIT.well:
        return False
    view = _view(piece, at, lines, full)._replace(height_known=True, cut=True)
    data, starts = view.grey.ravel(), []
    for off, way, wide in BALL_FIT.cuts:
        for angle in 2 * np.pi / BALL_FIT.ways * np.arange(BALL_FIT.ways):
            x, y = way * radius * np.cos(angle), way * radius * np.sin(angle)
            start = np.array([x, y, np.log(wide * radius), np.log(BALL_FIT.begin_px), 0.0, off, angle])
            left, _ = _left(view, start, data)
            starts.append((float(left @ left), start))
    starts.sort(key=lambda start: start[0])
    fits = [one for _, begun in starts[: BALL_FIT.best] if (one := _descend(view, begun, radius)) is not None]
    if not fits:
        return False
    best = min(fits, key=lambda one: one.rms)
    free = _descend(view._replace(height_known=False), best.unknowns, radius)
    best = free if free is not None and free.rms < best.rms else best
    plain = BALL_FIT.plain[0 if held else 1]
    return bool(_misfit(best, noise) < plain and (fit is None or best.rms < BALL_FIT.better * fit.rms))


class _Fit(NamedTuple):
    """unknowns as `_descend` has them; rms and level, grey levels; variance of the middle, one coordinate, px^2;
    height_sd: sd of the logarithm of the height
    """

    unknowns: Array
    rms: float
    level: float
    variance: float
    height_sd: float


def _view(piece: Picture, at: Sequence[float], lines: int, full: Bools | None) -> BallView:
    clipped = full.ravel() if full is not None and full.any() else None
    return BallView(np.asarray(piece, float), float(at[0]), float(at[1]) * lines, lines, full=clipped)


def _descend(view: BallView, begin: Array, radius: float, steps: int = BALL_FIT.steps) -> _Fit | None:
    """Damped Gauss-Newton (Levenberg, Marquardt) on x, y from the light, log radius, log blur, log height over width,
    and of a lamp its angle from the direction of the camera and its direction in the picture; or of a line how far it
    is from the middle, in radii, and in which direction.
    """
    data = view.grey.ravel()
    n = begin.size
    scale = np.where(np.arange(n) < 2, radius, 1.0)
    longest = np.array(BALL_FIT.longest[:n]) * scale
    now, damping = begin, 1e-3
    left, level = _left(view, now, data)
    cost = float(left @ left)
    normal = np.eye(n)
    for _ in range(steps):
        slopes = (
            np.stack([(_left(view, now + d, data)[0] - left) / 1e-4 for d in np.diag(1e-4 * scale)]) / scale[:, None]
        )
        slopes[4] *= not view.height_known
        normal, gradient = slopes @ slopes.T, slopes @ left
        ridge = np.diag(np.maximum(np.diag(normal), BALL_FIT.ridge * np.diag(normal).max()))
        for _ in range(6):
            step = -np.linalg.solve(normal + damping * ridge, gradient)
            trial = now + np.clip(step, -longest, longest)
            trial[3] = max(trial[3], np.log(BALL_FIT.least_px))
            new, new_level = _left(view, trial, data)
            better = float(new @ new) < cost
            damping = np.clip(damping / 5 if better else damping * 8, BALL_FIT.damping, 1e9)
            if better:
                break
        if not better:
            break
        gain = 1 - float(new @ new) / cost
        now, left, cost, level = trial, new, float(new @ new), new_level
        if gain < BALL_FIT.enough:
            break
    spare = max(data.size - (0 if view.full is None else int(view.full.sum())) - n - 9, 1)
    normal = normal + 1e-9 * np.trace(normal) * np.eye(n)
    variances = np.diag(np.linalg.inv(normal)) * cost / spare
    variance, height_sd = float(variances[:2].mean()), float(np.sqrt(max(variances[4], 0.0)))
    own = np.exp(now[2])
    low, high = BALL_FIT.furthest[0], BALL_FIT.furthest[1]
    outside = np.hypot(*now[:2]) > low * radius or not radius / high < own < radius * high
    if outside or level <= 0 or abs(now[4]) > np.log(BALL_FIT.flattest):
        return None
    return _Fit(now, float(np.sqrt(cost / spare)), level, variance, height_sd)


def _left(view: BallView, unknowns: Array, data: Array) -> tuple[Array, float]:
    """What the best surface and background leave of the data, and the surface's mean level over the background."""
    cover, parts = drawn(view, unknowns)
    columns = np.stack([one.ravel() for one in parts], axis=1)
    shown, values = (columns, data) if view.full is None else (columns[~view.full], data[~view.full])
    products = shown.T @ shown
    products[np.diag_indices_from(products)] += 1e-10 * np.trace(products)
    found = np.linalg.solve(products, shown.T @ values)
    surface = parts[: 1 if view.cut else -3]
    light = sum(k * float(one.sum()) for k, one in zip(found, surface, strict=False))
    behind = (float((found[-3] * cover).sum())) if cover.any() else 0.0
    left = columns @ found - data
    if view.full is not None:
        left[view.full] = np.minimum(left[view.full], 0)
    return left, (light - behind) / max(float(cover.sum()), 1e-9)
