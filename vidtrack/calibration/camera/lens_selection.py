"""Choose the lens model by points that the camera has not seen: plain Tsai unless a richer one predicts them better.

Every further term lowers the error of the points that were fitted, whether the lens has that term or not. So the
points are divided into folds; each fold is predicted by cameras fitted to the others. Survey errors that neighbours
share (a wire, a flight, a clip) would leak from one fold into another, so that neighbours stay in one fold.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.initial_fit import distances, with_lens_of
from vidtrack.calibration.camera.refine import Fit, free_parameters, refine
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import LENS_MODELS

Folds = NDArray[np.intp]

FOLDS = 5

BLOCKS_PER_FOLD = 4
"""Blocks of neighbouring points in a fold: enough of them that none is an edge that all others extrapolate to."""

BLOCK = 8
"""Points in a block where there are many: a larger hole in a dense target is not what targets in between will meet."""

CLIPS_NEEDED = 4
"""Clips from which whole clips are held out: with fewer, what is left may be one plane."""

SURE = 3.0
"""Standard errors by which a richer model must predict better before it is taken."""

WORTH = 0.01
"""And the share by which the error must fall: less is not worth four more numbers."""


PLAIN_TO_SEE = 0.25
"""A fall of the error by so much is taken from one standard error on: where a lens misfits the rim alone, all is gained
at few points."""


class Rung(NamedTuple):
    """One lens model and what it predicts."""

    model: str
    fit: Fit
    squared: Array  # (n,) px^2, of each point from a camera that has not seen it
    held_out_px: float  # root mean of these

    @property
    def training_px(self) -> float:
        return self.fit.rms_px


class Ladder(NamedTuple):
    """Where the climb ended, and why."""

    model: str
    fit: Fit
    rungs: tuple[Rung, ...]
    reasons: tuple[str, ...]  # one line for each step


def climb(
    p: ArrayLike,
    b: ArrayLike,
    start: Camera,
    *,
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    sd: ArrayLike | None = None,
    survey: ArrayLike | None = None,
    folds: int = FOLDS,
    clips: ArrayLike | None = None,
) -> Ladder:
    """Climb the lens models; a rung counts when it predicts held-out points surely better than the last.

    p, b, sd, survey   as for `refine`; only inliers
    start              a camera near the answer
    clips              (n,) which clip shows each point, where known
    Surely: by `SURE` standard errors of the paired differences, and by `WORTH` of the error. A rung that fails does not
    end the climb (decentring may need p1, p2 without needing kappa2), it is only not stood on.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    fold = folds_of(p, folds, clips)
    taken: Rung | None = None
    rungs, reasons = [], []
    for model in LENS_MODELS:
        if any(term in (fixed or {}) for term in LENS_MODELS[model]) and model != "tsai":
            reasons.append(f"{model}: not tried, as calibration.fix holds one of its terms")
            continue
        if (needed := 2 * points_needed(model)) > len(p) and taken is not None:
            reasons.append(f"{model}: not tried, as {len(p)} points are too few to hold some out ({needed} are needed)")
            continue
        near = taken.fit.camera if taken else start
        rung = held_out(model, p, b, near, fixed=fixed, priors=priors, sd=sd, survey=survey, fold=fold)
        rungs.append(rung)
        better, reason = _compared(taken, rung)
        reasons.append(reason)
        if better:
            taken = rung
    assert taken is not None
    return Ladder(taken.model, taken.fit, tuple(rungs), tuple(reasons))


def folds_of(p: Array, folds: int = FOLDS, clips: ArrayLike | None = None) -> Folds:
    """The fold (n,) of each point (n, 3): whole clips where there are enough of them, else blocks of neighbours.

    Blocks are cut by halving the points across their longest side; they are dealt into the folds in shuffled order.
    """
    block = np.zeros(len(p), np.intp)
    if clips is not None:
        block = np.unique(np.asarray(clips, str), return_inverse=True)[1].reshape(-1)
    if block.max(initial=0) + 1 >= CLIPS_NEEDED:
        folds = min(folds, int(block.max()) + 1)
    else:
        block = _blocks(p, max(folds * BLOCKS_PER_FOLD, len(p) // BLOCK))
    order = np.random.default_rng(0).permutation(int(block.max(initial=0)) + 1)
    return np.asarray(order[block] % folds)


def _blocks(p: Array, most: int) -> Folds:
    """The block (n,) of each point: the largest block is halved across its longest side until there are so many."""
    blocks = [np.arange(len(p))]
    while len(blocks) < min(most, len(p)):
        largest = blocks.pop(int(np.argmax([len(block) for block in blocks])))
        side = int(np.argmax(np.ptp(p[largest], axis=0)))
        ordered = largest[np.argsort(p[largest, side], kind="stable")]
        blocks += [ordered[: len(ordered) // 2], ordered[len(ordered) // 2 :]]
    out = np.empty(len(p), np.intp)
    for i, block in enumerate(blocks):
        out[block] = i
    return out


def points_needed(model: str) -> int:
    """Points that a full fit of a lens model needs: 11 for tsai, and a point for each term beyond."""
    return 10 + len(LENS_MODELS[model])


def held_out(
    model: str,
    p: Array,
    b: Array,
    near: Camera,
    *,
    fixed: Mapping[str, float] | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    sd: ArrayLike | None = None,
    survey: ArrayLike | None = None,
    fold: Folds | None = None,
) -> Rung:
    """A lens model fitted to all points, and the error of each from a camera fitted without its fold (n,).

    The folds are the same for every model and every run (`folds_of`).
    """
    free = free_parameters(model, tuple(fixed or {}))
    known = {name: prior for name, prior in (priors or {}).items() if name in free}

    def fitted(camera: Camera, take: Array | slice) -> Fit:
        return refine(
            camera,
            p[take],
            b[take],
            free=free,
            priors=known,
            sd=_taken(sd, take),
            survey=_taken(survey, take),
            tolerance=1e-3 if isinstance(take, np.ndarray) else 1e-8,
        )

    whole = fitted(with_lens_of(near, model).with_(**(fixed or {})), slice(None))
    fold = folds_of(p) if fold is None else fold
    squared = np.empty(len(p))
    for k in np.unique(fold):
        out = fold == k
        squared[out] = distances(fitted(whole.camera, ~out).camera, p[out], b[out]) ** 2
    return Rung(model, whole, squared, float(np.sqrt(squared.mean())))


def _taken(value: ArrayLike | None, take: Array | slice) -> ArrayLike | None:
    return value if value is None or np.ndim(value) == 0 else np.asarray(value)[take]


def _compared(taken: Rung | None, rung: Rung) -> tuple[bool, str]:
    figures = f"{rung.model}: {_px(rung.held_out_px)} px held out ({_px(rung.training_px)} px in training)"
    if taken is None:
        return True, f"{figures}, the plainest model"
    if not rung.fit.converged or not np.isfinite(rung.held_out_px):
        return False, f"{rung.model}: not taken, as its fit does not settle"
    gain = taken.squared - rung.squared
    mean, error = gain.mean(), gain.std(ddof=1) / np.sqrt(len(gain))
    lower = 1 - rung.held_out_px / taken.held_out_px
    if (mean > SURE * error and lower > WORTH) or (mean > error and lower > PLAIN_TO_SEE):
        return True, f"{figures}, {100 * lower:.0f} % less than {taken.model}: taken"
    if lower > 0:
        return False, f"{figures}, no sure gain on {taken.model} ({_px(taken.held_out_px)} px): not taken"
    return False, f"{figures}, worse than {taken.model} ({_px(taken.held_out_px)} px): not taken"


def _px(value: float) -> str:
    return f"{value:.3g}"
