"""Whether targets that are lit from one side look as high beside their width as the pixels of their camera make a ball.

The outlines of such targets are fitted, and how square pixels are with them. A calibrated camera says that as well:
px of a height over px of a width are dx / (Sx dy). Where they disagree, what was fitted is no whole ball: the water's
edge or something in front cuts all of it alike, or the run's picture is squeezed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera


class Unlike(NamedTuple):
    """From where on a height is not that of a ball."""

    share: float = 0.12
    """Of its logarithm: towards the corners of a picture 30 degrees from its axis, balls look longer by as much."""
    sd: float = 4.0
    """Standard deviations of the fitted height, besides."""


UNLIKE = Unlike()


def lit_shape_findings(
    lightings: Mapping[str, Mapping[str, Any] | None], cameras: Mapping[str, Camera], where: str
) -> list[Finding]:
    """One finding for each camera whose targets are not as high as balls are.

    lightings  camera: `lighting` of its centroids' record, height and height_sd (logarithm) where they are known
    cameras    as the run's pictures have them
    """
    found = []
    for name, own in lightings.items():
        value, sd = (own or {}).get("height"), (own or {}).get("height_sd")
        if value is None or sd is None or name not in cameras:
            continue
        camera = cameras[name]
        ball = camera.dx / (camera.Sx * camera.dy)
        if abs(np.log(value / ball)) < UNLIKE.share + UNLIKE.sd * sd:
            continue
        text = (
            f"{where}: {name}: targets that are lit from one side look {value:.2f} times as high as wide, a ball "
            f"{ball:.2f} times: what was fitted is no whole ball"
        )
        cure = "See whether the water's edge or something in front cuts them, or the picture is squeezed."
        found.append(Finding("doubtful", "lit-targets-no-balls", text, cure))
    return found
