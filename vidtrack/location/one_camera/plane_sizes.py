"""How much larger the camera of mode plane sees the targets of a run than the balls of its calibration clip.

Balls in one plane look the wider the nearer they are, and the further from the middle of the picture: the logarithm of
their width is, over a part of the plane, a paraboloid over the picture. Targets in the same plane that are the same
balls look as wide where the lens is as it was.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.location.cameras.ball_sizes import COMPARING, scatter_of, wander_of

FURTHER = 2.0
"""Of the uncertainty that a width has amid the calibration's balls, beyond which a look counts as far from them."""


def plane_sizes(
    camera: str, looks: Mapping[str, Mapping[str, ArrayLike]] | None, balls: Mapping[str, ArrayLike]
) -> dict[str, Any]:
    """By camera, as `ball_sizes` has it: the scatter of its balls, and of each target how much larger it looks.

    looks   track: Xf, Yf, width (px), in the picture of the calibration; balls: columns Xf, Yf, width (px), used
    Empty for too few balls or looks.
    """
    if not looks or "width" not in balls:
        return {}
    b = np.stack([np.asarray(balls[name], float) for name in ("Xf", "Yf")], -1)
    width = np.asarray(balls["width"], float)
    good = np.isfinite(b).all(-1) & np.isfinite(width)
    if "used" in balls:
        good &= np.asarray(balls["used"], bool)
    if (n := int(good.sum())) < COMPARING.balls:
        return {}
    b, seen = b[good], np.log(width[good])
    middle, reach = b.mean(0), max(float(np.ptp(b, axis=0).max()) / 2, 1.0)
    basis = _basis((b - middle) / reach)
    fit, _, rank, _ = np.linalg.lstsq(basis, seen, rcond=1e-6)
    if rank < basis.shape[1]:
        return {}
    scatter = scatter_of(seen - basis @ fit) * np.sqrt(n / (n - basis.shape[1]))
    inverse = np.linalg.inv(basis.T @ basis)
    targets = {}
    for name, own in looks.items():
        at = np.stack([np.asarray(own[key], float) for key in ("Xf", "Yf")], -1)
        there = _basis((at - middle) / reach)
        unsure = np.sqrt(np.einsum("ni,ij,nj->n", there, inverse, there))
        near = unsure < FURTHER * np.sqrt(np.einsum("ni,ij,nj->n", basis, inverse, basis)).max()
        if near.sum() < COMPARING.looks:
            continue
        values = np.log(np.asarray(own["width"], float)[near]) - there[near] @ fit
        sd = float(np.hypot(scatter_of(values) / np.sqrt(len(values)), scatter * np.median(unsure[near]))) * 1.2533
        targets[name] = {"n": len(values), "larger": float(np.median(values)), "sd": sd, "wander": wander_of(values)}
    return {camera: {"balls": n, "scatter": float(scatter), "targets": targets}} if targets else {}


def _basis(q: Array) -> Array:
    """What the width goes with at places (n, 2) px: linearly, and with the square of the distance from some middle."""
    return np.concatenate([np.ones((len(q), 1)), q, (q**2).sum(-1, keepdims=True)], -1)
