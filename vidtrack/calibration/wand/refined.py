"""The adjustment of a waved wand: outliers left out, the lens model chosen by moments left out, clocks along with it.

Every ball at every moment is three unknowns, and every distance on the wand a measurement of them. A moment that the
rest contradicts is left out: a ball mistaken for another, a wand that is touched or bent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.calibration.adjustment.adjust import Adjusted, Problem, adjust, minimise
from vidtrack.calibration.adjustment.measurements import Measurement
from vidtrack.calibration.adjustment.unknowns import Family, Known, State
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.calibration.wand.measured import Views, Wand, clock_name, wand_problem, wand_state
from vidtrack.calibration.wand.rig import located
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.lens_terms import COEFFICIENTS


class RefinedSettings(NamedTuple):
    """How the adjustment decides."""

    outlier: float = 5.0
    """Standard deviations of its residual beyond which a sight, or a length, is left out."""
    first: float = 12.0
    """The same before the lens is known, times the median."""
    rounds: int = 6
    """Of leaving out."""
    folds: int = 4
    """Stretches of time, each left out in turn, by which lens models are compared."""
    worth: float = 0.01
    """Share by which the error of what was left out must fall for a richer lens."""
    clock_sd: float = 10.0
    """s, what is known of an unknown clock beforehand."""
    same_clock: float = 1e-6
    """s, a change of a clock for which sights are not interpolated again."""
    fewest: int = 20
    """Moments at which two cameras see the wand, for an adjustment."""
    moments: int = 800
    """Moments that are used at most, evenly over the recording."""


SETTINGS = RefinedSettings()
LADDER = ("tsai", "tsai2", "brown")
"""Lens models that are tried, the plainest first."""
CENTRE_SD, SX_SD = 0.05, 0.02
"""ASSUME: share of the picture by which the principal point lies off its middle; Sx of cameras with analogue lines."""

NORMAL_MEDIAN = 0.6745
"""Median size of a Gaussian number of unit variance."""

Sampled = Callable[[Array], Views]
"""What the cameras saw at all moments when the clocks of the late cameras are changed by so many s."""


class Rung(NamedTuple):
    """A lens model and what it makes of moments that were left out."""

    model: str
    held_out: float  # mean error of the lengths of what was left out and of its sights, in their noise
    length_rms: float  # world units, of the lengths at moments left out


class Refined(NamedTuple):
    """What the adjustment gives, in the axes of the first camera unless more was measured."""

    cameras: tuple[Camera, ...]
    found: Adjusted
    problem: Problem
    views: Views  # of the moments used, outliers NaN
    rows: Ints  # (n,) which moments
    points: Array  # (n, q, 3)
    clocks: tuple[float, ...]  # s, by which each camera's clock was changed; 0 for those that are known
    clock_sd: tuple[float, ...]
    model: str
    rungs: tuple[Rung, ...]
    left_out: Bools  # (m, n, q) sights that were left out


def refine_wand(
    cameras: Sequence[Camera],
    sampled: Sampled,
    wand: Wand,
    *,
    arrange: Callable[[Views], Views],
    models: Sequence[str] = LADDER,
    priors: Sequence[Known] = (),
    fixed: Sequence[Sequence[str]] = (),
    late: Sequence[int] = (),
) -> Refined:
    """All cameras of a waved wand from rough ones.

    sampled  see `Sampled`; it is asked again when a clock has changed
    arrange  puts the balls of views in the place of their ends
    models   one lens model, or several, of which the one that predicts moments left out is taken
    priors   for each camera what the user knows beforehand; it replaces what is assumed of any camera
    fixed    for each camera the parameters that stay as they are
    late     cameras whose clocks are unknown
    Raises ValueError where too few moments are left.
    """
    m = len(cameras)
    known = [_assumed(c) | dict(own) for c, own in zip(cameras, priors or [{}] * m, strict=True)]
    kept = fixed or [()] * m
    clocks = np.zeros(m)
    views, rows = _used(arrange(sampled(clocks)))
    mask = np.ones(views.b.shape[:-1], bool)
    model = models[0]
    state_cameras: Sequence[Camera] = cameras
    for k in range(SETTINGS.rounds):
        state, found, *_ = _adjusted(state_cameras, _masked(views, mask), wand, _free(model, kept), known, late, k == 0)
        state_cameras = state.cameras
        change = np.array([state.shared.get(clock_name(i), 0.0) for i in range(m)])
        outliers = _outliers(found, views.b.shape) & mask
        moved = bool(np.abs(change).max(initial=0.0) > SETTINGS.same_clock)
        if moved:
            clocks += change
            everything = arrange(sampled(clocks))
            views = everything.at(rows)
        if k > 0 and not outliers.any() and not moved:  # the first round left out what was far off
            break
        mask &= ~outliers
    rungs: list[Rung] = []
    if len(models) > 1:
        model, rungs, state_cameras = _climbed(state_cameras, _masked(views, mask), wand, models, kept, known)
    state, found, problem, now, used = _adjusted(
        state_cameras, _masked(views, mask), wand, _free(model, kept), known, late, False
    )
    rows = rows[used]
    sd = [
        float(np.sqrt(found.covariance[k, k])) if i in late else 0.0
        for i in range(m)
        for k in [int(problem.unknowns.of_shared(clock_name(i))[0]) if i in late else 0]
    ]
    missing = np.asarray(~np.isfinite(now.b).all(-1) & np.isfinite(views.at(used).b).all(-1))
    points = state.blocks[0].reshape(len(rows), -1, 3)
    return Refined(
        state.cameras,
        found,
        problem,
        now,
        rows,
        points,
        tuple(clocks.tolist()),
        tuple(sd),
        model,
        tuple(rungs),
        missing,
    )


def refine_further(
    done: Refined,
    wand: Wand,
    families: Sequence[Family],
    measured: Sequence[Measurement],
    blocks: Sequence[Array],
    free: Sequence[Sequence[str]],
    priors: Sequence[Known],
    cameras: Sequence[Camera],
    points: Array,
) -> tuple[Adjusted, Problem]:
    """The same with further measurements that say where the world lies: every camera's place is free.

    cameras, points  brought near to the world's axes
    """
    problem = wand_problem(done.views, points, wand, free, priors, more=(families, measured))
    state = wand_state(cameras, points, wand)
    return adjust(problem, state._replace(blocks=(*state.blocks, *blocks))), problem


def _assumed(camera: Camera) -> dict[str, tuple[float, float]]:
    width, height = camera.image_size
    centre = {"Cx": ((width - 1) / 2, CENTRE_SD * width), "Cy": ((height - 1) / 2, CENTRE_SD * height)}
    half = width * camera.dx / 2
    lens = {"kappa1": 0.3 / half**2, "kappa2": 0.3 / half**4, "p1": 0.02 / half, "p2": 0.02 / half}
    return centre | {"Sx": (1.0, SX_SD)} | {name: (0.0, sd) for name, sd in lens.items()}


def _free(model: str, fixed: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """The free parameters; the first camera's place is the world's."""
    each = [free_parameters(model, own) for own in fixed]
    return [each[0][6:], *each[1:]]


def _used(views: Views) -> tuple[Views, Ints]:
    """Moments at which two cameras see all balls, not more than are needed."""
    whole = np.isfinite(views.b).all((-1, -2)).sum(0) >= 2
    rows = np.flatnonzero(whole)
    if len(rows) < SETTINGS.fewest:
        raise ValueError(f"two cameras see the whole wand at {len(rows)} moments, {SETTINGS.fewest} are needed")
    rows = rows[np.linspace(0, len(rows) - 1, min(SETTINGS.moments, len(rows))).astype(int)]
    return views.at(rows), rows


def _masked(views: Views, mask: Bools) -> Views:
    return views._replace(b=np.where(mask[..., None], views.b, np.nan))


def _enough(views: Views) -> tuple[Views, Ints]:
    """Moments at which every ball is seen by two cameras."""
    rows = np.flatnonzero((np.isfinite(views.b).all(-1).sum(0) >= 2).all(-1))
    if len(rows) < SETTINGS.fewest:
        raise ValueError(f"two cameras agree on the wand at {len(rows)} moments, {SETTINGS.fewest} are needed")
    return views.at(rows), rows


def _adjusted(
    cameras: Sequence[Camera],
    views: Views,
    wand: Wand,
    free: Sequence[Sequence[str]],
    known: Sequence[Known],
    late: Sequence[int],
    rough: bool,
) -> tuple[State, Adjusted, Problem, Views, Ints]:
    """The adjustment of all moments that two cameras see, and which of the views those are.

    Of the others the normalised residuals are NaN.
    """
    now, rows = _enough(views)
    points = located(cameras, now.b)
    if rough:  # what is far off would drag the rest along
        now, more = _enough(_without_far(cameras, now, points))
        rows, points = rows[more], points[more]
    good = np.isfinite(points).all((-1, -2)) & _seen(cameras, points, now)
    rows, now, points = rows[good], now.at(np.flatnonzero(good)), points[good]
    if len(rows) < SETTINGS.fewest:
        raise ValueError(f"two cameras agree on the wand at {len(rows)} moments, {SETTINGS.fewest} are needed")
    problem = wand_problem(now, points, wand, free, known, late=late, clock_sd=SETTINGS.clock_sd)
    found = adjust(problem, wand_state(cameras, points, wand, late))
    n = views.b.shape[1]
    whole = found._replace(normalised=tuple(_spread(each, rows, n) for each in found.normalised))
    return found.state, whole, problem, now, rows


def _seen(cameras: Sequence[Camera], points: Array, views: Views) -> Bools:
    """(n,) moments whose balls project into every camera that saw them."""
    lost = [
        np.isfinite(b).all(-1) & ~np.isfinite(project(c, points)).all(-1) for c, b in zip(cameras, views.b, strict=True)
    ]
    return np.asarray(~np.any(lost, (0, -1)))


def _without_far(cameras: Sequence[Camera], views: Views, points: Array) -> Views:
    off = np.stack([np.linalg.norm(project(c, points) - b, axis=-1) for c, b in zip(cameras, views.b, strict=True)])
    limit = SETTINGS.first * np.nanmedian(off) + 1e-6
    return views._replace(b=np.where((off < limit)[..., None], views.b, np.nan))


def _spread(values: Array, rows: Ints, n: int) -> Array:
    if len(values) != len(rows):
        return values
    out = np.full((n, *values.shape[1:]), np.nan)
    out[rows] = values
    return out


def _usual(sizes: Array) -> float:
    """Standard deviation of numbers of these sizes, by their median, so that mistakes do not enlarge it."""
    known = sizes[np.isfinite(sizes)]
    return float(np.median(known)) / NORMAL_MEDIAN if known.size else 1.0


def _outliers(found: Adjusted, shape: tuple[int, ...]) -> Bools:
    """(m, n, q) sights beyond the limit; of a moment whose length is, all of them."""
    m, n, q = shape[:3]
    sights = np.abs(np.stack([each.reshape(n, q, 2) for each in found.normalised[:m]]))
    size = np.nan_to_num(sights).max(-1) / _usual(sights)
    # only the worst sight of a ball goes at once: it drags the others along
    bad = (size > SETTINGS.outlier) & (size == size.max(0))
    lengths = np.abs(found.normalised[m])
    bad |= (np.nan_to_num(lengths).max(-1) > SETTINGS.outlier * _usual(lengths))[None, :, None]
    return np.asarray(bad)


def _climbed(
    cameras: Sequence[Camera],
    views: Views,
    wand: Wand,
    models: Sequence[str],
    fixed: Sequence[Sequence[str]],
    known: Sequence[Known],
) -> tuple[str, list[Rung], Sequence[Camera]]:
    """The plainest lens model that predicts moments left out nearly as well as any richer one."""
    now, _ = _enough(views)
    best, rungs = models[0], []
    starts = cameras
    for model in models:
        try:
            rung, fitted = _held_out(cameras, now, wand, model, fixed, known)
        except (ValueError, np.linalg.LinAlgError):
            break
        rungs.append(rung)
        if model == models[0]:
            chosen = rung
        if rung.held_out < (1 - SETTINGS.worth) * chosen.held_out:
            best, chosen, starts = model, rung, fitted
    return best, rungs, starts


def _held_out(
    cameras: Sequence[Camera],
    views: Views,
    wand: Wand,
    model: str,
    fixed: Sequence[Sequence[str]],
    known: Sequence[Known],
) -> tuple[Rung, Sequence[Camera]]:
    n = views.b.shape[1]
    fold = np.arange(n) * SETTINGS.folds // n
    lengths, sights = [], []
    free = _free(model, fixed)
    plain = [_plain(c, model) for c in cameras]
    points = located(plain, views.b)
    state = wand_state(plain, points, wand)
    fitted = minimise(wand_problem(views, points, wand, free, known, scaled=False), state, tolerance=1e-6).cameras
    for k in range(SETTINGS.folds):
        keep, out = np.flatnonzero(fold != k), np.flatnonzero(fold == k)
        some = views.at(keep)
        p = located(fitted, some.b)
        problem = wand_problem(some, p, wand, free, known, scaled=False)
        own = minimise(problem, wand_state(fitted, p, wand), tolerance=1e-6).cameras
        left = located(own, views.b[:, out])
        seen = np.stack([project(c, left) for c in own]) - views.b[:, out]
        sights.append((seen / views.sd[:, out])[np.isfinite(seen)])
        for i, j, _ in wand.pairs:
            lengths.append(np.linalg.norm(left[:, i] - left[:, j], axis=-1) - wand.lengths[i, j])
    apart = np.concatenate(lengths)
    apart = apart[np.isfinite(apart)]
    size = float(wand.lengths.max())
    px = float(np.sqrt(np.mean(np.concatenate(sights) ** 2)))
    rms = float(np.sqrt(np.mean(apart**2)))
    return Rung(model, float(np.sqrt(px * rms / size)), rms), fitted


def _plain(camera: Camera, model: str) -> Camera:
    """The camera without the lens terms that the model lacks."""
    free = free_parameters(model)
    return camera.with_(**{name: 0.0 for name in COEFFICIENTS if name not in free})
