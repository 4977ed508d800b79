"""Sigma in a plane that holds the zoom at which the sizes of the targets hint.

A target that looks larger than the calibration's balls is seen through a lens that was zoomed or focused since, or is
nearer than its plane: either way it is seen further from the middle of the picture by the same share.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vidtrack.arrays import Array

Places = Callable[[Array, Array], tuple[Array, Array]]
"""From px (n, 2) and their sd (n, 2) to positions (n, 2) and covariances (n, 2, 2), world units."""


def with_zoom_in_plane(places: Places, zoom: float, centre: tuple[float, ...]) -> Places:
    """Places whose covariance holds that pictures may be magnified by exp(zoom) about `centre`, px."""
    if not zoom:
        return places

    def held(b: Array, sd: Array) -> tuple[Array, Array]:
        p, covariance = places(b, sd)
        moved = places(centre + (b - centre) * np.exp(-zoom), sd)[0] - p
        return p, covariance + moved[:, :, None] * moved[:, None, :]

    return held
