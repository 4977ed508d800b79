"""The likely cause of outliers and of a large misfit of one camera, from the pattern of the residuals.

Outliers at the rim of the picture are a lens that the model does not describe; most points of one clip, a camera or a
target that moved; points on one line of the target, a wire surveyed wrongly; scattered ones, single names or places.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.tsai import centred
from vidtrack.findings import Finding

Mask = NDArray[np.bool_]

ENOUGH_FOR_A_PATTERN = 4
"""Outliers from which a pattern is sought among them."""

LISTED = 12
"""Tags that a message lists."""


def left_out(
    tags: Sequence[str],
    clips: Sequence[str],
    p: Array,
    b: Array,
    out: Mask,
    centre: tuple[float, float],
    farthest_px: float,
    model: str,
) -> Finding | None:
    """Why points were left out: n tags and clips, p (n, 3) world units, b (n, 2) px, out (n,); centre px."""
    if not out.any():
        return None
    n, names = len(tags), listed([tag for tag, off in zip(tags, out, strict=True) if off])
    text = f"{int(out.sum())} of {n} points left out, up to {farthest_px:.3g} px off: tags {names}."
    radius = np.hypot(b[:, 0] - centre[0], b[:, 1] - centre[1])
    if clip := _one_clip(clips, out):
        return Finding(
            "doubtful",
            "clip-off",
            f"{text} They are most of what clip {clip} shows: the camera or the target moved between clips.",
            f"Record {clip} again, or leave the clip out.",
        )
    if out.sum() >= ENOUGH_FOR_A_PATTERN and at_rim(radius, out):
        return Finding(
            "doubtful",
            "lens-at-rim",
            f"{text} They lie at the rim, beyond {radius[out].min():.0f} px from the principal point: the lens model "
            f"{model} does not describe the lens there.",
            "Set calibration.model: auto, or place no point and no target beyond that radius.",
        )
    if out.sum() >= ENOUGH_FOR_A_PATTERN - 1 and _on_one_line(p, out):
        return Finding(
            "doubtful",
            "wire-off",
            f"{text} They lie on one line of the target.",
            "Survey that wire or row again, and check that its tags are in order.",
        )
    return Finding(
        "doubtful",
        "points-left-out",
        text,
        "Check their names in picks.csv and their places in points.csv; points.parquet has the reason for each.",
    )


def listed(tags: Sequence[str]) -> str:
    """Tags for a message."""
    return ", ".join(tags[:LISTED]) + (", ..." if len(tags) > LISTED else "")


def at_rim(radius: Array, out: Mask) -> bool:
    """Whether nearly all points left out (n,) lie farther out than nearly all others: radius (n,) px."""
    order = np.argsort(np.argsort(radius, kind="stable"), kind="stable")
    n_out, n_in = int(out.sum()), int((~out).sum())
    if not n_in:
        return False
    area = (order[out].sum() - n_out * (n_out - 1) / 2) / (n_out * n_in)  # of the receiver operating curve
    return bool(area > 0.93)


def _one_clip(clips: Sequence[str], out: Mask) -> str:
    """The clip that holds the points left out and loses most of its points to them; empty where there is none."""
    names = np.asarray(clips, str)
    if len(set(clips)) < 2 or out.sum() < ENOUGH_FOR_A_PATTERN - 1 or len(set(names[out])) > 1:
        return ""
    clip = str(names[out][0])
    return clip if out.sum() > 0.5 * (names == clip).sum() else ""


def _on_one_line(p: Array, out: Mask) -> bool:
    """Whether the points left out lie on one line, and no more than twice as many others with them."""
    _, q, _ = centred(p[out])
    _, s, Vt = np.linalg.svd(q, full_matrices=False)
    if s[1] > 0.05 * s[0]:
        return False
    off = p - p[out].mean(0)
    beside = np.linalg.norm(off - np.outer(off @ Vt[0], Vt[0]), axis=1)
    near = beside <= max(float(beside[out].max()), 0.02 * float(np.ptp(p, axis=0).max()))
    return bool(out.sum() > near.sum() / 3)


def misfit(
    noise_px: float, expected_px: float, survey_px: float, units_per_px: float, sigma: float, units: str
) -> Finding | None:
    """A camera that leaves far more or far less than the noise that was stated.

    noise_px      one coordinate's noise by the residuals; expected_px by the centroids' sd and the stated survey
    survey_px     the share of the latter that the survey's sigma (world units, 0 for none) makes
    units_per_px  world units that a pixel covers at the points
    """
    if not (np.isfinite(noise_px) and np.isfinite(expected_px)):
        return None
    excess = np.sqrt(max(noise_px**2 - max(expected_px**2 - survey_px**2, 0.0), 0.0)) * units_per_px
    if noise_px > 2 * expected_px and noise_px > LOUD_PX:
        stated = f"the stated sigma of {sigma:g} {units}" if sigma else "no survey error at all"
        level = "bad" if noise_px > 10 * expected_px and noise_px > VERY_LOUD_PX else "doubtful"
        return Finding(
            level,  # type: ignore[arg-type]
            "misfit-large",
            f"the residuals show {noise_px:.2g} px where centroids and survey should leave {expected_px:.2g} px: as "
            f"much as survey errors of {excess:.2g} {units} would make, where points.csv and config have {stated}.",
            f"If the survey is that rough, set calibration.sigma: {excess:.2g}; else look for a window or water "
            "between camera and points, coordinates in another unit, points or a camera that moved, or a lens that no "
            "model here describes.",
        )
    if sigma and noise_px < 0.5 * expected_px and survey_px > 0.7 * expected_px:
        return Finding(
            "note",
            "survey-sigma-large",
            f"the residuals show {noise_px:.2g} px where the stated sigma of {sigma:g} {units} would make "
            f"{survey_px:.2g} px: the survey errs by about {excess:.2g} {units}.",
            f"Set calibration.sigma: {excess:.2g}.",
        )
    return None


LOUD_PX, VERY_LOUD_PX = 0.3, 2.0
"""ASSUME: px, noise below which a survey error that is not stated is no concern, and above which something is wrong."""
