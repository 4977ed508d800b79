"""Choose the lens model by points that the camera has not seen: plain Tsai unless a richer one foretells them better.

Every further term lowers the error of the points that were fitted, whether the lens has that term or not. So the
points are parted into folds; each fold is foretold by cameras fitted to the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.initial_fit import distances, with_lens_of
from vidtrack.calibration.refine import Fit, free_parameters, refine
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import LENS_MODELS

FOLDS = 5

SURE = 2.0
"""Standard errors by which a richer model must foretell better before it is taken."""

WORTH = 0.01
"""And the share by which the error must fall: less is not worth four more numbers."""


class Rung(NamedTuple):
    """One lens model and what it foretells."""

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
) -> Ladder:
    """Climb tsai, tsai2, brown, affine; a rung counts when it foretells held-out points surely better than the last.

    p, b, sd, survey   as for `refine`; only points that belong
    start              a camera near the answer
    Surely: by `SURE` standard errors of the paired differences, and by `WORTH` of the error. A rung that fails does not
    end the climb (decentring may need p1, p2 without needing kappa2), it is only not stood on.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    taken: Rung | None = None
    rungs, reasons = [], []
    for model in LENS_MODELS:
        if any(term in (fixed or {}) for term in LENS_MODELS[model]) and model != "tsai":
            reasons.append(f"{model}: not tried, as calibration.fix holds one of its terms")
            continue
        if (needed := points_needed(model)) > len(p) * (folds - 1) // folds and taken is not None:
            reasons.append(f"{model}: not tried, as {len(p)} points are too few to hold some out ({needed} are needed)")
            continue
        near = taken.fit.camera if taken else start
        rung = held_out(model, p, b, near, fixed=fixed, priors=priors, sd=sd, survey=survey, folds=folds)
        rungs.append(rung)
        better, reason = _compared(taken, rung)
        reasons.append(reason)
        if better:
            taken = rung
    assert taken is not None
    return Ladder(taken.model, taken.fit, tuple(rungs), tuple(reasons))


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
    folds: int = FOLDS,
) -> Rung:
    """A lens model fitted to all points, and the error of each from a camera fitted without its fold.

    The folds are the same for every model and every run: point i of a fixed shuffle goes to fold i mod folds.
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
    fold = np.random.default_rng(0).permutation(len(p)) % folds
    squared = np.empty(len(p))
    for k in range(folds):
        out = fold == k
        squared[out] = distances(fitted(whole.camera, ~out).camera, p[out], b[out]) ** 2
    return Rung(model, whole, squared, float(np.sqrt(squared.mean())))


def _taken(value: ArrayLike | None, take: Array | slice) -> ArrayLike | None:
    return value if value is None or np.ndim(value) == 0 else np.asarray(value)[take]


def _compared(taken: Rung | None, rung: Rung) -> tuple[bool, str]:
    told = f"{rung.model}: {_px(rung.held_out_px)} px held out ({_px(rung.training_px)} px in training)"
    if taken is None:
        return True, f"{told}, the plainest model"
    if not rung.fit.converged or not np.isfinite(rung.held_out_px):
        return False, f"{rung.model}: not taken, as its fit does not settle"
    gain = taken.squared - rung.squared
    mean, error = gain.mean(), gain.std(ddof=1) / np.sqrt(len(gain))
    lower = 1 - rung.held_out_px / taken.held_out_px
    if mean > SURE * error and lower > WORTH:
        return True, f"{told}, {100 * lower:.0f} % less than {taken.model}: taken"
    if lower > 0:
        return False, f"{told}, no sure gain on {taken.model} ({_px(taken.held_out_px)} px): not taken"
    return False, f"{told}, worse than {taken.model} ({_px(taken.held_out_px)} px): not taken"


def _px(value: float) -> str:
    return f"{value:.3g}"
