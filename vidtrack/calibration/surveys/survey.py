"""Which surveyed points lie elsewhere than the survey says, judged by all cameras together.

One camera alone cannot distinguish a point that was surveyed wrongly from one that it mistook for another, and where
several points are wrong alike (a wire hung elsewhere) it may keep those and leave out their good neighbours. All
cameras together can: a misplaced point is seen at one and the same other place in space by each of them, a mistaken
one by one camera only. So sets of points that may be misplaced are proposed (by each camera, by the lines on which
points lie, by clips) and compared by the description length of all sights together; the best is then revised point by
point: where the cameras put each point that had no part in their calibration, with its covariance, against the survey.
Sources: Baarda (1968) for the test of one observation that was left out of the fit; Rissanen (1978).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.outliers import SMALLEST_SCALE, Mask
from vidtrack.calibration.surveys.agreement import Agreement
from vidtrack.calibration.surveys.judging_camera import JudgingCamera, View
from vidtrack.geometry.camera import Camera


@dataclass(frozen=True)
class SurveySettings:
    """Constants of the judgement."""

    on_line: float = 0.01
    """Points farther from a line than this share of the target's width are not on it."""

    least_on_line: int = 3
    """Points that make a line: any two do."""

    most_lines: int = 10
    """Lines that are tried as a whole: those of which the cameras leave out most."""

    doubt: float = 2.0
    """Times the expected noise that a camera leaves: from here on lines are tried though no camera left out a point."""

    few: int = 40
    """Points up to which lines are tried at any rate where the noise of the centroids is not known."""

    rounds: int = 8
    """Revisions of the set of misplaced points; as a rule two are enough."""

    joined: int = 3
    """Proposals that are joined at most: so many wires may be wrong at once."""


SETTINGS = SurveySettings()


class Placed(NamedTuple):
    """Where all cameras together put n points.

    misplaced   (n,) they agree on a place that is not the survey's
    unclear     (n,) they agree on no place: more than one sight is wrong
    mistaken    (m, n) sights that disagree with the survey and with the other cameras
    place       (n, 3) world units, from cameras that were calibrated without the point; NaN where fewer than 2 see it
    sd          (n, 3) world units, of the place
    spread      world units, the survey's tolerance that the other points show
    used        (m,) cameras that had a vote: those with 12 points or more that fit a camera
    """

    misplaced: Mask
    unclear: Mask
    mistaken: Mask
    place: Array
    sd: Array
    spread: float
    used: Mask
    cameras: tuple[Camera | None, ...]


def placed(p: Array, sigma: Array, views: Sequence[View], groups: Sequence[Mask] = ()) -> Placed | None:
    """Judge n surveyed points p (n, 3) by m views; None where fewer than two cameras have a vote.

    sigma    (n,) world units, the survey's stated tolerance; only the ratios count, the size is estimated
    groups   sets of points (n,) that may be misplaced together beside the lines that they form: clips
    """
    judges = [JudgingCamera.of(p, view) for view in views]
    used = np.array([w is not None for w in judges])
    if used.sum() < 2:
        return None
    able = [w for w in judges if w is not None]
    out = _best_proposal(p, sigma, able, groups)
    mistaken = np.zeros((len(able), len(p)), bool)
    seen_before: list[bytes] = []
    while True:
        fits = [w.fitted(out, mistaken[i]) for i, w in enumerate(able)]
        agreement = Agreement.of(p, sigma, out, able, fits)
        again, wrong = agreement.decided(p)
        state = again.tobytes() + wrong.tobytes()
        if (again == out).all() and (wrong == mistaken).all():
            break
        if state in seen_before or len(seen_before) >= SETTINGS.rounds:
            out, mistaken = again | out, wrong | mistaken
            fits = [w.fitted(out, mistaken[i]) for i, w in enumerate(able)]
            agreement = Agreement.of(p, sigma, out, able, fits)
            break
        seen_before.append(state)
        out, mistaken = again, wrong
    everywhere = np.zeros((len(views), len(p)), bool)
    everywhere[used] = mistaken
    cameras: list[Camera | None] = [None] * len(views)
    for i, fit in zip(np.flatnonzero(used), fits, strict=True):
        cameras[i] = fit.camera
    unclear = out & ~agreement.agreed
    return Placed(
        out & ~unclear, unclear, everywhere, agreement.place, agreement.sd, agreement.spread, used, tuple(cameras)
    )


def _best_proposal(p: Array, sigma: Array, cameras: Sequence[JudgingCamera], groups: Sequence[Mask]) -> Mask:
    """The set of points (n,) without which all sights together are described best."""
    nothing = np.zeros(len(p), bool)
    left_out = np.stack([w.seen & ~w.keep for w in cameras])
    if not left_out.any() and not any(_doubtful(p, sigma, w) for w in cameras):
        return nothing
    seen = np.maximum(np.stack([w.seen for w in cameras]).sum(0), 1)
    votes = left_out.sum(0) / seen
    lines = sorted(lines_of(p), key=lambda line: -float(votes[line].mean()))
    proposals = [*left_out, votes > 0.5, votes == 1, *lines[: SETTINGS.most_lines], *groups]
    single = [np.arange(len(p)) == j for j in np.argsort(-votes)[: SETTINGS.most_lines] if votes[j] > 0]
    proposals = list({q.tobytes(): q for q in [*proposals, *single] if q.any()}.values())
    best, length = nothing, _length(p, cameras, nothing)
    for _ in range(SETTINGS.joined):
        tried = [best | q for q in proposals if (q & ~best).any()]
        lengths = [_length(p, cameras, q) for q in tried]
        if not tried or min(lengths) >= length:
            break
        k = int(np.argmin(lengths))
        best, length = tried[k], lengths[k]
    return best


def _doubtful(p: Array, sigma: Array, camera: JudgingCamera) -> bool:
    """Whether a camera leaves more than centroids and survey should, or nothing is known of them."""
    if camera.view.sd is None:
        return len(p) <= SETTINGS.few
    fit = camera.fitted(np.zeros(len(p), bool), np.zeros(len(p), bool))
    survey = (fit.by_point**2).sum((1, 2)) / 2 * sigma**2
    expected = np.sqrt(np.nanmedian((camera.view.sd**2).mean(-1) + survey))
    return bool(fit.scale > SETTINGS.doubt * max(expected, SMALLEST_SCALE))


def _length(p: Array, cameras: Sequence[JudgingCamera], out: Mask) -> float:
    """The description length of all sights where the points of `out` (n,) may lie anywhere."""
    if out.mean() > 0.5:
        return np.inf
    nothing = np.zeros(len(p), bool)
    fits = [w.fitted(out, nothing) for w in cameras]
    total = sum(fit.length for fit in fits)
    if not np.isfinite(total) or not out.any():
        return total
    agreement = Agreement.of(p, np.zeros(len(p)), out, cameras, fits)
    for i, (camera, fit) in enumerate(zip(cameras, fits, strict=True)):
        own = out & camera.seen
        area = float(np.log(camera.view.image_size[0] * camera.view.image_size[1]))
        distance = agreement.distance(agreement.error)[i, own]
        as_inlier = 0.5 * np.log((2 * np.pi) ** 2 * np.linalg.det(fit.variance[own])) + 0.5 * distance**2
        located = np.isfinite(agreement.displacement[own]).all(-1)
        total += float(np.where(located, np.minimum(as_inlier, area), area).sum())
    return total + 1.5 * float(np.log(2 * np.maximum(agreement.n_seen[out], 1)).sum())


def lines_of(p: Array) -> list[NDArray[np.bool_]]:
    """The straight lines (n,) on which three or more of n points lie, the longest first: wires, rows, edges.

    A point that is off the line of two others by less than `SurveySettings.on_line` of the target's width is on it.
    """
    n = len(p)
    if n > 150:  # of a target so dense single lines say little
        return []
    width = float(np.ptp(p, axis=0).max())
    i, j = np.triu_indices(n, 1)
    along = p[j] - p[i]
    length = np.linalg.norm(along, axis=-1)
    apart = length > SETTINGS.on_line * width
    i, unit = i[apart], along[apart] / length[apart, None]
    off = p[None] - p[i][:, None]
    beside = np.linalg.norm(off - (off * unit[:, None]).sum(-1, keepdims=True) * unit[:, None], axis=-1)
    on = np.unique(beside <= SETTINGS.on_line * width, axis=0)
    on = on[on.sum(1) >= SETTINGS.least_on_line]
    return list(on[np.argsort(-on.sum(1), kind="stable")])
