"""Sigma that holds the common zoom of all lenses at which the sizes of the targets hint.

A zoom of all lenses together leaves the lines of sight meeting: sizes of targets alone show it. What they show is
likelier than the calibration's own error of f, which is all that sigma has of it otherwise; where it is surer, it is a
doubt as well (`verdict.size_rules`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.common_zoom import SAME, common_zoom
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import Located, places_of

HINTED = 1.5
"""Of its sd, from which on a common zoom is held in sigma: so much has one run in eight whose lenses are unchanged."""

ALIKE = 2.5
"""Of its sd, up to which each camera sees what all do; what one alone sees is its own."""


def hinted_zoom(sizes: Mapping[str, Any]) -> float:
    """The common zoom at which `sizes` (of `ball_sizes`) hint, a logarithm; 0 where they hint at none."""
    zoom = common_zoom(sizes)
    if zoom is None or not HINTED * zoom.sd < abs(zoom.larger) < SAME:
        return 0.0
    return zoom.larger if zoom.apart < ALIKE else 0.0


class Hinted(NamedTuple):
    """What `with_zoom` returns: the positions, what was added to their covariance ((m, M, 3, 3) world units squared, or
    None), and the finding that says so.
    """

    located: Located
    added: Array | None
    findings: list[Finding]


def with_zoom(
    located: Located, cameras: Sequence[Camera], b: Array, sd: Array, sizes: Mapping[str, Any], where: str
) -> Hinted:
    """Positions (m, M) with a covariance that holds the common zoom at which the sizes of the targets hint.

    b, sd  (n_cameras, m, M, 2) px
    sizes  of `ball_sizes`
    """
    zoom = hinted_zoom(sizes)
    if not zoom:
        return Hinted(located, None, [])
    used = np.isfinite(located.error[..., 0]) & ~located.left_out
    flat = np.where(used[..., None], b, np.nan).reshape(len(cameras), -1, 2)
    flat_sd = np.broadcast_to(sd, b.shape).reshape(flat.shape)
    zoomed = [replace(camera, f=camera.f * np.exp(zoom)) for camera in cameras]
    moved = places_of(zoomed, flat, flat_sd) - places_of(cameras, flat, flat_sd)
    moved = np.nan_to_num(moved).reshape(located.point.shape)
    added = moved[..., :, None] * moved[..., None, :]
    covariance = located.covariance + added
    sigma = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    note = zoom_finding(zoom, where)
    return Hinted(located._replace(covariance=covariance, sigma=sigma), added, [note])


def zoom_finding(zoom: float, where: str, cause: str = "all lenses were zoomed or focused") -> Finding:
    """That sigma holds a zoom at which sizes hint."""
    way = "larger" if zoom > 0 else "smaller"
    text = (
        f"{where}: the targets look {abs(zoom):.2%} {way} than the balls of the calibration, which is more than chance "
        f"often does: sigma holds that {cause} by as much"
    )
    cure = "Where the targets are other balls, set calibration.same_balls: false."
    return Finding("note", "zoom-in-sigma", text, cure)
